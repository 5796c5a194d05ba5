//! Whole renders of small scenes whose answer is known: in closed form, by
//! symmetry, or because another estimator must agree.
//!
//! Every seed is fixed. Tests of chance are tests of equivalence: they pass only
//! when the deviation plus [`Z`] standard errors stays inside the stated bound,
//! so that too few samples fail instead of passing.
//!
//! Without a device the tests print why they are skipped; with the environment
//! variable `ETENDUE_REQUIRE_DEVICE=1` they fail instead.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "tests may unwrap; they print measured figures and why they skip"
)]

#[path = "../common/mod.rs"]
mod common;

mod analytic;
mod calibration;
mod closed;
mod determinism;
mod emission;
mod features;
mod furnace;
mod lamps;
mod normals;
mod punctual;
mod sky;
mod strategies;

use etendue::film::Film;
use etendue::settings::BackendChoice;

/// Standard errors between an estimate and what it is allowed to be: two-sided 1e-6.
const Z: f64 = 4.9;

/// All traversals, where a few samples do.
const ALL: [BackendChoice; 3] = [
    BackendChoice::Bvh,
    BackendChoice::RayQuery,
    BackendChoice::RayPipeline,
];
/// The two that every test can afford.
const BOTH: [BackendChoice; 2] = [BackendChoice::Bvh, BackendChoice::RayQuery];

/// Mean over pixels and channels with its standard error. Pixels are
/// independent; the channels of a pixel are taken as fully dependent.
fn image_mean(film: &Film) -> (f64, f64) {
    let count = film.pixels() as f64;
    let average = |v: &[f32; 3]| v.iter().map(|x| f64::from(*x)).sum::<f64>() / 3.0;
    let mean = film.mean().iter().map(average).sum::<f64>() / count;
    let variance: f64 = film
        .standard_error()
        .iter()
        .map(|e| average(e).powi(2))
        .sum();
    (mean, variance.sqrt() / count)
}

/// The image mean is `truth` within the relative bound `delta`, chance included.
fn assert_mean(what: &str, film: &Film, truth: f64, delta: f64) {
    let (mean, error) = image_mean(film);
    let (d, bound) = ((mean - truth).abs() / truth, Z * error / truth);
    println!("{what}: {mean:.6}, truth {truth:.6}, off {d:.1e}, ±{bound:.1e}, allowed {delta:.1e}");
    assert!(d + bound <= delta, "{what}: {mean} instead of {truth}");
}

/// Largest relative deviation of any channel of any pixel from `truth`.
fn largest_deviation(film: &Film, truth: f64) -> f64 {
    let off = |v: &f32| (f64::from(*v) / truth - 1.0).abs();
    film.mean().iter().flatten().map(off).fold(0.0, f64::max)
}
