//! Interfaces and media in whole renders: closed forms of slabs, cubes and balls,
//! and of light in fog. Oblique on purpose: errors of Fresnel's equations and of
//! radiance's n² hide at normal incidence.
//!
//! Every seed is fixed; tests of chance are tests of equivalence as in `integrator`.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "tests may unwrap; they print measured figures and why they skip"
)]

#[path = "../common/mod.rs"]
mod common;
#[path = "../common/solids.rs"]
mod solids;
#[path = "../common/statistics.rs"]
mod statistics;
#[path = "../common/tier.rs"]
mod tier;

mod closed;
mod cube;
mod fog;
mod gradient;
mod lamps;
mod nested;
mod scatter;
mod slab;

use common::*;
use etendue::film::Film;
use glam::DVec3;
use solids::*;
use statistics::Estimate;

/// Parallel rays that meet the plane z = 0 at `degrees` from +z, over a square of 2 · half metres about its origin.
fn oblique(degrees: f64, half: f64) -> etendue::scene::Camera {
    let (sin, cos) = degrees.to_radians().sin_cos();
    parallel(10.0 * DVec3::new(sin, 0.0, cos), DVec3::ZERO, half)
}

/// Mean of one channel over the pixels.
fn channel_mean(film: &Film, channel: usize) -> Estimate {
    Estimate::of_film(film, &[channel])
}

/// As many samples as that, in whole passes.
fn samples_for(enough: f64) -> u64 {
    match enough.ceil() as u64 {
        few @ ..256 => few.next_power_of_two().max(16),
        many => many.next_multiple_of(256),
    }
}

/// Every channel's mean is its truth within the relative bound `delta`, chance included.
fn assert_channels(what: &str, film: &Film, truth: [f64; 3], delta: f64) {
    for (channel, truth) in truth.into_iter().enumerate() {
        let what = format!("{what}, channel {channel}");
        channel_mean(film, channel).assert_is(&what, truth, delta);
    }
}
