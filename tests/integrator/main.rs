//! Whole renders of small scenes whose answer is known: in closed form, by
//! symmetry, or because another estimator must agree.
//!
//! Every seed is fixed. Tests of chance are tests of equivalence: they pass only
//! when the deviation plus [`statistics::Z`] standard errors stays inside the stated bound,
//! so that too few samples fail instead of passing.
//!
//! Without a device the tests print why they are skipped; with the environment
//! variable `ETENDUE_REQUIRE_DEVICE` they fail instead.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "tests may unwrap; they print measured figures and why they skip"
)]

#[path = "../common/mod.rs"]
mod common;
#[path = "../common/statistics.rs"]
mod statistics;
#[path = "../common/tier.rs"]
mod tier;

mod analytic;
mod calibration;
mod closed;
mod determinism;
mod emission;
mod features;
mod furnace;
mod guide;
mod intervals;
mod lamps;
mod normals;
mod punctual;
mod share;
mod sky;
mod strategies;

use etendue::film::Film;
use statistics::Estimate;

/// The image mean is `truth` within the relative bound `delta`, chance included.
fn assert_mean(what: &str, film: &Film, truth: f64, delta: f64) {
    Estimate::of_image(film).assert_is(what, truth, delta);
}

/// Largest relative deviation of any channel of any pixel from `truth`.
fn largest_deviation(film: &Film, truth: f64) -> f64 {
    let off = |v: &f32| (f64::from(*v) / truth - 1.0).abs();
    film.mean().iter().flatten().map(off).fold(0.0, f64::max)
}
