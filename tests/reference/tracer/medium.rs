//! Free flight through a homogeneous medium and the deflection at its particles.
//!
//! [Henyey41] Henyey, Greenstein, Diffuse Radiation in the Galaxy.

use std::f64::consts::TAU;

use etendue::scene::{Medium, Phase};
use glam::DVec3;

use super::rng::{Rng, around};

/// How a flight over a distance ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Flight {
    /// Nothing was met.
    Passed,
    /// Absorbed on the way.
    Absorbed,
    /// Met a scattering particle after so many metres.
    Scattered(f64),
}

/// Flies up to `distance` metres (or for ever) through `medium`: the way to the
/// next particle has density σ_t e^{−σ_t t}, and the particle absorbs with probability σ_a/σ_t.
pub fn fly(medium: Option<&Medium>, channel: usize, distance: f64, rng: &mut Rng) -> Flight {
    let Some(medium) = medium else {
        return Flight::Passed;
    };
    let absorption = f64::from(medium.absorption[channel]);
    let extinction = absorption + f64::from(medium.scattering[channel]);
    if extinction == 0.0 {
        return Flight::Passed;
    }
    let way = -(1.0 - rng.uniform()).ln() / extinction;
    if way >= distance {
        Flight::Passed
    } else if rng.happens(absorption / extinction) {
        Flight::Absorbed
    } else {
        Flight::Scattered(way)
    }
}

/// The direction after scattering of light that travels along `direction`.
pub fn deflect(phase: Phase, direction: DVec3, rng: &mut Rng) -> DVec3 {
    let cosine = match phase {
        Phase::Isotropic => return rng.direction(),
        // 3/8 (1 + μ²) by rejection.
        Phase::Rayleigh => loop {
            let mu = 2.0 * rng.uniform() - 1.0;
            if rng.happens(0.5 * (1.0 + mu * mu)) {
                break mu;
            }
        },
        // Inverse of the distribution of (1 − g²) / (2 (1 + g² − 2gμ)^{3/2}). [Henyey41]
        Phase::HenyeyGreenstein { g } => {
            let (g, u) = (f64::from(g), rng.uniform());
            if g.abs() < 1e-6 {
                2.0 * u - 1.0
            } else {
                let s = (1.0 - g * g) / (1.0 - g + 2.0 * g * u);
                (1.0 + g * g - s * s) / (2.0 * g)
            }
        }
    };
    around(direction, cosine.clamp(-1.0, 1.0), TAU * rng.uniform()).normalize()
}
