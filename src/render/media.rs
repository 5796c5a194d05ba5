//! The table of what fills solids and the space outside them.

use super::solids::Solids;
use crate::layout;
use crate::scene::{Medium, Phase, Scene};

/// Entry 0 is the space outside all solids, entry 1 + r the inside of solids with record r.
pub(super) fn table(scene: &Scene, solids: &Solids) -> Vec<layout::Medium> {
    let outside = record(&scene.medium.unwrap_or_default(), 1.0, 0);
    let inside = solids.materials(scene).zip(&solids.ranks).map(|(m, rank)| {
        let medium = m.volume.map(|v| v.medium).unwrap_or_default();
        record(&medium, m.ior, *rank)
    });
    std::iter::once(outside).chain(inside).collect()
}

fn record(medium: &Medium, ior: f32, rank: u32) -> layout::Medium {
    let (phase, g) = match medium.phase {
        Phase::Isotropic => (layout::PHASE_HENYEY_GREENSTEIN, 0.0),
        Phase::HenyeyGreenstein { g } => (layout::PHASE_HENYEY_GREENSTEIN, g),
        Phase::Rayleigh => (layout::PHASE_RAYLEIGH, 0.0),
    };
    // The sum of two large coefficients must stay finite.
    let sigma_t = (medium.absorption + medium.scattering).min(glam::Vec3::splat(f32::MAX));
    layout::Medium {
        sigma_t: sigma_t.to_array(),
        phase,
        sigma_s: medium.scattering.to_array(),
        g,
        ior,
        rank,
        ..Default::default()
    }
}
