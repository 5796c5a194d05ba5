//! glTF 2.0 → [`Scene`]. Nothing in a file is trusted: every index, size and
//! offset is checked before it is used, memory grows with the bytes that really
//! arrive and not with what a header claims, and only files inside the asset's
//! own folder are opened.
//!
//! What is read: `.gltf`, `.glb`, data URIs and external files; meshes (sparse
//! accessors, KHR_mesh_quantization, EXT_mesh_gpu_instancing), cameras,
//! metallic-roughness materials (KHR_texture_transform,
//! KHR_materials_emissive_strength, _ior, _specular, _transmission, _unlit,
//! _volume), KHR_lights_punctual, ETENDUE_environment and ETENDUE_medium. Skins,
//! morph targets and animations are left out with a warning; occlusion textures
//! need none, since occlusion is computed, nor do thickness textures, since rays
//! go as far as the mesh is thick. A light's `range` is ignored: it would break
//! the inverse square law.

mod accessor;
mod container;
mod extension;
mod image;
mod json;
mod light;
mod material;
mod medium;
mod mesh;
mod node;
mod place;
mod resolve;
mod texture;
mod view;

use std::path::Path;

use super::{Material, Scene};
use crate::error::{Error, Result};

/// What a file may ask for. Whoever exceeds a limit is told its name and value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Size of each file that is read, bytes. Default 4 GiB, the most a `.glb` can hold.
    pub file_bytes: u64,
    /// Size of all files together, decoded data URIs included, bytes. Default 16 GiB.
    pub total_bytes: u64,
    /// Size of the JSON text, bytes. Default 256 MiB.
    pub json_bytes: u64,
    /// Nodes. Default 2²¹, which is also the most that the parser takes.
    pub nodes: u64,
    /// Placed meshes. Default 2²².
    pub instances: u64,
    /// Triangles of all meshes, instances not multiplied. Default 2²⁷.
    pub triangles: u64,
    /// Texels of all textures and the environment together. Default 2²⁸.
    pub texels: u64,
    /// Width and height of an image, pixels. Default 16384.
    pub image_side: u32,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            file_bytes: 1 << 32,
            total_bytes: 1 << 34,
            json_bytes: 1 << 28,
            nodes: 1 << 21,
            instances: 1 << 22,
            triangles: 1 << 27,
            texels: 1 << 28,
            image_side: 16_384,
        }
    }
}

/// Loads a `.gltf` or `.glb` file with everything that it refers to, within the default [`Limits`].
///
/// # Errors
/// [`Error::Scene`] for whatever is wrong with the file or anything that it
/// refers to, a file that cannot be read included.
pub fn load(path: &Path) -> Result<Scene> {
    load_with(path, &Limits::default())
}

/// Loads a `.gltf` or `.glb` file within the given limits. Errors as for [`load`].
pub fn load_with(path: &Path, limits: &Limits) -> Result<Scene> {
    load_cached(path, limits, None)
}

/// As [`load_with`], with a folder that keeps decoded images, so that they need not be decoded again; safe to delete.
pub fn load_cached(path: &Path, limits: &Limits, cache: Option<&Path>) -> Result<Scene> {
    let scene = load_checked(path, limits, cache).map_err(|what| Error::Scene {
        path: path.to_owned(),
        what,
    })?;
    for warning in &scene.warnings {
        tracing::warn!("{}: {warning}", path.display());
    }
    Ok(scene)
}

/// Inside the loader an error is the text of [`Error::Scene`].
type Check<T> = std::result::Result<T, String>;

fn load_checked(path: &Path, limits: &Limits, cache: Option<&Path>) -> Check<Scene> {
    let mut warnings = Warnings::default();
    let mut files = resolve::Files::open(path, limits)?;
    let bytes = files.read_scene(path)?;
    let (root, binary) = container::parse(bytes, limits, &mut warnings)?;
    extension::check(&root, &mut warnings)?;
    let buffers = accessor::Buffers::load(&root, binary, &mut files)?;
    let nodes = node::walk(&root, limits, &mut warnings)?;
    let mut meshes = mesh::load_used(&root, &buffers, &nodes, limits, &mut warnings)?;
    let mut textures = texture::Textures::new(&root, &buffers, limits);
    let mut materials = material::load(&root, &mut textures, &mut files, &mut warnings)?;
    if meshes.uses_default_material() {
        materials.push(Material::default());
    }
    mesh::check_texture_coordinates(&meshes.list, &materials, &mut warnings);
    let (instances, instance_nodes) =
        place::instances(&root, &buffers, &nodes, &meshes, limits, &mut warnings)?;
    if instances.is_empty() {
        return Err(String::from(
            "holds nothing to render: no node of the scene places a mesh with triangles",
        ));
    }
    let environment = extension::environment(&root, &mut files, &mut textures, &mut warnings)?;
    let medium = medium::of_scene(&root, &mut warnings)?;
    let (lights, light_nodes) = light::load(&root, &nodes, &mut warnings)?;
    Ok(Scene {
        nodes: node::owners(&root, &instance_nodes, &light_nodes),
        meshes: std::mem::take(&mut meshes.list),
        instances,
        materials,
        textures: textures.finish(cache)?,
        lights,
        cameras: view::load(&root, &nodes)?,
        environment,
        medium,
        warnings: warnings.finish(),
        hash: files.hash(),
    })
}

/// Collects what the user should know; a hostile file cannot make it grow without end.
#[derive(Debug, Default)]
struct Warnings {
    list: Vec<String>,
    suppressed: u64,
}

impl Warnings {
    /// Beyond this many only the number is kept.
    const MAX: usize = 100;

    fn push(&mut self, warning: String) {
        if self.list.len() < Self::MAX {
            self.list.push(warning);
        } else {
            self.suppressed += 1;
        }
    }

    fn finish(mut self) -> Vec<String> {
        if self.suppressed > 0 {
            self.list
                .push(format!("{} more warnings are not shown", self.suppressed));
        }
        self.list
    }
}

/// Quotes text from the file for a message: shortened, control characters escaped.
fn quote(text: &str) -> String {
    const LONGEST: usize = 80;
    match text.char_indices().nth(LONGEST) {
        None => format!("{text:?}"),
        Some((end, _)) => format!("{:?}…", &text[..end]),
    }
}

/// Looks up an index of the file, or says what it should have pointed at.
fn get<'a, T>(list: &'a [T], index: u32, what: &str, user: &str) -> Check<&'a T> {
    list.get(index as usize).ok_or_else(|| {
        format!(
            "{user} refers to {what}[{index}], but there are {}",
            list.len()
        )
    })
}
