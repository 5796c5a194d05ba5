//! KHR_lights_punctual → lights in world space.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use glam::{DVec3, Vec3};

use super::json::{Light, Root};
use super::node::Nodes;
use super::{Check, Warnings, get, quote};
use crate::scene::{LightKind, PunctualLight};

/// Places the lights that the scene's nodes refer to; all lights of the file are checked.
/// Beside each light its node.
pub(super) fn load(
    root: &Root,
    nodes: &Nodes,
    warnings: &mut Warnings,
) -> Check<(Vec<PunctualLight>, Vec<u32>)> {
    let empty = Default::default();
    let defined = root.extensions.lights.as_ref().unwrap_or(&empty);
    let mut checked = Vec::new();
    for (i, light) in defined.lights.iter().enumerate() {
        let user = format!("KHR_lights_punctual.lights[{i}]");
        checked.push((kind(light, &user)?, intensity(light, &user)?));
    }
    let mut lights = Vec::new();
    let mut owners = Vec::new();
    for placed in nodes.iter() {
        let extensions = placed.node.extensions.as_deref();
        let Some(reference) = extensions.and_then(|e| e.light.as_ref()) else {
            continue;
        };
        let user = format!("nodes[{}]: KHR_lights_punctual", placed.index);
        let index = reference
            .light
            .ok_or_else(|| format!("{user}: light is missing"))?;
        let &(kind, intensity) = get(&checked, index, "lights", &user)?;
        // A light shines along its node's −Z.
        let direction = (-placed.world.matrix3.z_axis).try_normalize();
        if direction.is_none() && kind != LightKind::Point {
            warnings.push(format!(
                "light of node {} is left out: the node's scale leaves it no direction",
                quote(&placed.name())
            ));
            continue;
        }
        let own = &defined.lights[index as usize].name;
        let name = own.as_ref().or(placed.node.name.as_ref());
        owners.push(placed.index as u32);
        lights.push(PunctualLight {
            name: name.map_or_else(|| format!("light {}", lights.len()), Clone::clone),
            kind,
            position: placed.world.translation,
            direction: direction.unwrap_or(DVec3::NEG_Z).as_vec3(),
            intensity,
        });
    }
    Ok((lights, owners))
}

fn kind(light: &Light, user: &str) -> Check<LightKind> {
    match light.kind.as_deref() {
        Some("point") => Ok(LightKind::Point),
        Some("directional") => Ok(LightKind::Directional),
        Some("spot") => {
            let spot = light.spot.as_ref();
            let inner = spot.and_then(|s| s.inner_cone_angle).unwrap_or(0.0);
            let outer = spot.and_then(|s| s.outer_cone_angle).unwrap_or(FRAC_PI_4);
            // Files write π/2 with fewer digits than a double has, rounded up at times.
            const ROUNDING: f64 = 1e-6;
            if !(inner >= 0.0 && inner < outer && outer <= FRAC_PI_2 + ROUNDING) {
                return Err(format!(
                    "{user}: cone angles {inner} and {outer} are not in order: 0 ≤ inner < outer ≤ π/2"
                ));
            }
            Ok(LightKind::Spot {
                cos_inner: inner.cos() as f32,
                cos_outer: outer.cos().max(0.0) as f32,
            })
        }
        Some(other) => Err(format!(
            "{user}: type {} is not known, only point, spot and directional",
            quote(other)
        )),
        None => Err(format!("{user}: type is missing")),
    }
}

/// Colour × intensity.
fn intensity(light: &Light, user: &str) -> Check<Vec3> {
    let color = DVec3::from(light.color.unwrap_or([1.0; 3]));
    let product = (color * light.intensity.unwrap_or(1.0)).as_vec3();
    let is_valid =
        color.min_element() >= 0.0 && light.intensity.unwrap_or(1.0) >= 0.0 && product.is_finite();
    if !is_valid {
        return Err(format!(
            "{user}: color and intensity must be finite and not negative"
        ));
    }
    Ok(product)
}
