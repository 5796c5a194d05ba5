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
use etendue::settings::BackendChoice;
use glam::DVec3;
use solids::*;

/// Standard errors between an estimate and what it is allowed to be: two-sided 1e-6.
const Z: f64 = 4.9;

/// Both traversals.
const BOTH: [BackendChoice; 2] = [BackendChoice::Bvh, BackendChoice::RayQuery];

/// Parallel rays that meet the plane z = 0 at `degrees` from +z, over a square of 2 · half metres about its origin.
fn oblique(degrees: f64, half: f64) -> etendue::scene::Camera {
    let (sin, cos) = degrees.to_radians().sin_cos();
    parallel(10.0 * DVec3::new(sin, 0.0, cos), DVec3::ZERO, half)
}

/// Mean of one channel over the pixels with its standard error.
fn channel_mean(film: &Film, channel: usize) -> (f64, f64) {
    let count = film.pixels() as f64;
    let sum: f64 = film.mean().iter().map(|p| f64::from(p[channel])).sum();
    let variance: f64 = film
        .standard_error()
        .iter()
        .map(|e| f64::from(e[channel]).powi(2))
        .sum();
    (sum / count, variance.sqrt() / count)
}

/// Every channel's mean is its truth within the relative bound `delta`, chance included.
fn assert_channels(what: &str, film: &Film, truth: [f64; 3], delta: f64) {
    for (channel, truth) in truth.into_iter().enumerate() {
        let (mean, error) = channel_mean(film, channel);
        let (d, bound) = ((mean - truth).abs() / truth, Z * error / truth);
        println!(
            "{what}, channel {channel}: {mean:.7}, truth {truth:.7}, off {d:.1e}, ±{bound:.1e}, allowed {delta:.1e}"
        );
        assert!(
            d + bound <= delta,
            "{what}, channel {channel}: {mean} instead of {truth}"
        );
    }
}
