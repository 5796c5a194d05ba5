//! ETENDUE_medium: what fills a closed mesh, or all space outside of them.

use glam::{DVec3, Vec3};

use super::json::{self, Root};
use super::node::scene_index;
use super::{Check, Warnings, quote};
use crate::mutant;
use crate::scene::{Medium, Phase};

/// ETENDUE_medium of the scene.
pub(super) fn of_scene(root: &Root, warnings: &mut Warnings) -> Check<Option<Medium>> {
    let Some(scene) = scene_index(root)? else {
        return Ok(None);
    };
    let Some(given) = &root.scenes[scene].extensions.medium else {
        return Ok(None);
    };
    let user = format!("scenes[{scene}]: ETENDUE_medium");
    if given.priority.is_some() {
        warnings.push(format!(
            "{user}: priority is ignored: the scene's medium fills what closed meshes leave"
        ));
    }
    read(given, &user).map(Some)
}

/// Checks and converts one ETENDUE_medium but for its priority.
pub(super) fn read(given: &json::Medium, user: &str) -> Check<Medium> {
    let coefficient = |value: DVec3, name: &str| {
        let single = value.as_vec3();
        if value.min_element() >= 0.0 && single.is_finite() {
            Ok(single)
        } else {
            Err(format!("{user}: {name} must be finite and not negative"))
        }
    };
    let scattering = match (given.scattering, given.rayleigh550) {
        (Some(_), Some(_)) => {
            return Err(format!(
                "{user}: only one of scattering and rayleigh550 may be given"
            ));
        }
        (_, Some(at_550)) => coefficient(rayleigh(at_550), "rayleigh550")?,
        (given, None) => coefficient(given.unwrap_or_default().into(), "scattering")?,
    };
    Ok(Medium {
        absorption: coefficient(given.absorption.unwrap_or_default().into(), "absorption")?,
        scattering,
        phase: phase(given, user)?,
    })
}

/// Rayleigh's λ⁻⁴: the coefficient at 550 nm → one for each channel, at the
/// dominant wavelengths of the Rec. 709 primaries.
fn rayleigh(at_550: f64) -> DVec3 {
    const WAVELENGTHS: DVec3 = DVec3::new(611.4, 549.1, 464.2);
    let exponent = if mutant::is("rayleigh-square") {
        2.0
    } else {
        4.0
    };
    at_550 * (550.0 / WAVELENGTHS).powf(exponent)
}

/// Without a phase, `rayleigh550` scatters as Rayleigh does and all else evenly.
fn phase(given: &json::Medium, user: &str) -> Check<Phase> {
    let default = match given.rayleigh550 {
        Some(_) => "rayleigh",
        None => "isotropic",
    };
    let name = given.phase.as_deref().unwrap_or(default);
    let phase = match name {
        "isotropic" => Phase::Isotropic,
        "rayleigh" => Phase::Rayleigh,
        "henyey-greenstein" => {
            let g = given.g.unwrap_or(0.0) as f32;
            // At ±1 all light goes into one direction, which has no density.
            if g.abs() >= 1.0 {
                return Err(format!(
                    "{user}: g must lie between -1 and 1, both excluded"
                ));
            }
            return Ok(Phase::HenyeyGreenstein { g });
        }
        other => {
            return Err(format!(
                "{user}: phase {} is not known, only isotropic, rayleigh and henyey-greenstein",
                quote(other)
            ));
        }
    };
    if given.g.is_some() {
        return Err(format!(
            "{user}: g belongs to the phase henyey-greenstein, not to {name}"
        ));
    }
    Ok(phase)
}

/// The sum of two absorption coefficients, 1/m, which stays finite.
pub(super) fn sum(a: Vec3, b: Vec3) -> Vec3 {
    (a + b).min(Vec3::MAX)
}
