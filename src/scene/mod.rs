//! Light and matter, free of files and of Vulkan: flat lists that refer to each
//! other by index. Every index in a [`Scene`] that the loader returns is valid.
//!
//! World space is right-handed, +Y up, in metres. Transforms are kept in double
//! precision so that a scene far from the origin loses nothing before it is
//! moved back to it (see `render::upload`).

mod camera;
pub(crate) mod environment;
pub mod gltf;
mod light;
mod material;
mod medium;
mod mesh;
mod texture;

use glam::{DAffine3, DVec3};

pub use camera::{Camera, Projection};
pub use environment::{Environment, LoadedEnvironment, load_environment};
pub use light::{LightKind, PunctualLight};
pub use material::{AlphaMode, Material};
pub use medium::{Medium, Phase, Volume, absorption_of};
pub use mesh::Mesh;
pub use texture::{Filter, Texels, Texture, TextureRef, Wrap};

/// A mesh placed in the world.
#[derive(Clone, Debug)]
pub struct Instance {
    /// Name of the glTF node, or `node N`.
    pub name: String,
    /// Index into [`Scene::meshes`].
    pub mesh: u32,
    /// Object to world; invertible.
    pub world_from_object: DAffine3,
}

/// A glTF node, as far as it is asked for by name.
#[derive(Clone, Debug, Default)]
pub struct Node {
    /// Name in the file, or `node N`.
    pub name: String,
    /// The node that it hangs on.
    pub parent: Option<u32>,
    /// Its own entries of [`Scene::instances`].
    pub instances: Vec<u32>,
    /// Its own entries of [`Scene::lights`].
    pub lights: Vec<u32>,
}

/// Everything that is needed to compute light transport.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// One entry for each glTF primitive.
    pub meshes: Vec<Mesh>,
    /// Placed meshes; several may share one mesh.
    pub instances: Vec<Instance>,
    /// Surface descriptions; never empty when there are meshes.
    pub materials: Vec<Material>,
    /// Decoded images with their sampler.
    pub textures: Vec<Texture>,
    /// Point, spot and directional lights in world space.
    pub lights: Vec<PunctualLight>,
    /// The nodes of the file, by their index there.
    pub nodes: Vec<Node>,
    /// Cameras in world space, in the order of the file's nodes.
    pub cameras: Vec<Camera>,
    /// Radiance that arrives from infinity; none is black.
    pub environment: Option<Environment>,
    /// What fills all space outside the closed meshes; none is vacuum. Its index of refraction is 1.
    pub medium: Option<Medium>,
    /// What the loader had to leave out or change, for the user to read.
    pub warnings: Vec<String>,
    /// SHA-256 of the scene file and everything that it refers to, hexadecimal.
    pub hash: String,
}

impl Scene {
    /// Number of triangles, instances counted.
    pub fn triangle_count(&self) -> u64 {
        self.instances
            .iter()
            .map(|i| self.meshes[i.mesh as usize].triangles.len() as u64)
            .sum()
    }

    /// A node by its name or, where none is called so, by its index.
    pub fn find_node(&self, asked: &str) -> Option<usize> {
        let by_name = self.nodes.iter().position(|n| n.name == asked);
        let by_index = || asked.parse().ok().filter(|&i| i < self.nodes.len());
        by_name.or_else(by_index)
    }

    /// What hangs on a node, alone in the dark: its meshes and lights and those of its descendants.
    ///
    /// # Panics
    /// There is no such node.
    pub fn luminaire(&self, node: usize) -> Self {
        assert!(node < self.nodes.len(), "there is no node {node}");
        // Whether each node hangs on the asked one; a walk up is as long as the tree is deep, so that answers are kept.
        let mut belongs: Vec<Option<bool>> = vec![None; self.nodes.len()];
        belongs[node] = Some(true);
        for start in 0..self.nodes.len() {
            let mut chain = Vec::new();
            let mut at = Some(start);
            let answer = loop {
                let Some(i) = at else { break false };
                if let Some(known) = belongs[i] {
                    break known;
                }
                chain.push(i);
                at = self.nodes[i].parent.map(|p| p as usize);
            };
            for i in chain {
                belongs[i] = Some(answer);
            }
        }
        let kept = self.nodes.iter().zip(&belongs);
        let kept: Vec<&Node> = kept
            .filter(|(_, b)| **b == Some(true))
            .map(|(n, _)| n)
            .collect();
        let instances = kept.iter().flat_map(|n| &n.instances);
        let lights = kept.iter().flat_map(|n| &n.lights);
        Self {
            instances: instances
                .map(|i| self.instances[*i as usize].clone())
                .collect(),
            lights: lights.map(|i| self.lights[*i as usize].clone()).collect(),
            nodes: Vec::new(),
            cameras: Vec::new(),
            environment: None,
            medium: None,
            ..self.clone()
        }
    }

    /// The camera for scenes that have none: sees all of [`Self::bounds`], see
    /// [`Camera::framing`]. `aspect` is width over height of the picture.
    pub fn framing_camera(&self, aspect: f64) -> Camera {
        let (low, high) = self.bounds().unwrap_or_default();
        Camera::framing(low, high, aspect)
    }

    /// World-space bounding box of all instances, metres; `None` when empty.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        let mut bounds: Option<(DVec3, DVec3)> = None;
        for instance in &self.instances {
            let Some((low, high)) = self.meshes[instance.mesh as usize].bounds() else {
                continue;
            };
            for corner in 0..8 {
                let pick = |axis: usize| {
                    if corner >> axis & 1 == 0 {
                        low[axis]
                    } else {
                        high[axis]
                    }
                };
                let corner = DVec3::new(pick(0).into(), pick(1).into(), pick(2).into());
                let p = instance.world_from_object.transform_point3(corner);
                let (lo, hi) = bounds.unwrap_or((p, p));
                bounds = Some((lo.min(p), hi.max(p)));
            }
        }
        bounds
    }
}
