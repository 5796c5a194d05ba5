//! Which extensions are understood, and those that hang on the scene.

use std::sync::Arc;

use glam::DVec3;

use super::json::Root;
use super::node::scene_index;
use super::resolve::Files;
use super::texture::Textures;
use super::{Check, Warnings, quote};
use crate::scene::Environment;
use crate::scene::environment::decode_map;

/// Extensions that are read.
const SUPPORTED: &[&str] = &[
    "ETENDUE_environment",
    "ETENDUE_medium",
    "EXT_mesh_gpu_instancing",
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_volume",
    QUANTIZATION,
    "KHR_texture_transform",
];

const QUANTIZATION: &str = "KHR_mesh_quantization";

/// Refuses required extensions that are not understood, and names optional ones in a warning.
pub(super) fn check(root: &Root, warnings: &mut Warnings) -> Check<()> {
    let unknown = |list: &[String]| -> Vec<String> {
        let names = list.iter().filter(|n| !SUPPORTED.contains(&n.as_str()));
        names.map(|name| quote(name)).collect()
    };
    let required = unknown(&root.extensions_required);
    if !required.is_empty() {
        return Err(format!(
            "requires extensions that are not supported: {}",
            required.join(", ")
        ));
    }
    for name in unknown(&root.extensions_used) {
        warnings.push(format!(
            "extension {name} is not supported: what it adds is left out"
        ));
    }
    Ok(())
}

/// Whether vertices may be stored as small integers.
pub(super) fn allows_quantization(root: &Root) -> bool {
    let lists = root
        .extensions_used
        .iter()
        .chain(&*root.extensions_required);
    lists.into_iter().any(|name| name == QUANTIZATION)
}

/// ETENDUE_environment of the scene.
pub(super) fn environment(
    root: &Root,
    files: &mut Files,
    textures: &mut Textures,
    warnings: &mut Warnings,
) -> Check<Option<Environment>> {
    let Some(scene) = scene_index(root)? else {
        return Ok(None);
    };
    let Some(given) = &root.scenes[scene].extensions.environment else {
        return Ok(None);
    };
    let user = format!("scenes[{scene}]: ETENDUE_environment");
    let uri = match (given.radiance, &given.uri) {
        (Some(radiance), None) => {
            let radiance = DVec3::from(radiance);
            let single = radiance.as_vec3();
            if !(radiance.min_element() >= 0.0 && single.is_finite()) {
                return Err(format!("{user}: radiance must be finite and not negative"));
            }
            return Ok(Some(Environment::Constant(single)));
        }
        (None, Some(uri)) => uri,
        _ => {
            return Err(format!(
                "{user}: exactly one of radiance and uri must be given"
            ));
        }
    };
    let intensity = given.intensity.unwrap_or(1.0) as f32;
    if !(intensity >= 0.0 && intensity.is_finite()) {
        return Err(format!("{user}: intensity must be finite and not negative"));
    }
    let rotation = given.rotation.unwrap_or(0.0) as f32;
    if !rotation.is_finite() {
        return Err(format!("{user}: rotation must be finite"));
    }
    let at = |what: String| format!("{user}: {}: {what}", quote(uri));
    let bytes = files.fetch(uri).map_err(|what| format!("{user}: {what}"))?;
    let map = decode_map(&bytes, textures.limits.image_side, textures.texels_left()).map_err(at)?;
    for warning in map.warnings {
        warnings.push(at(warning));
    }
    Ok(Some(Environment::Map {
        width: map.width,
        height: map.height,
        texels: Arc::new(map.texels),
        intensity,
        rotation,
    }))
}
