//! A second path tracer, its own tests against closed forms, and the renderer
//! compared with it.
//!
//! Every seed is fixed. Tests of chance are tests of equivalence: they pass only
//! when the deviation plus [`Z`] standard errors stays inside the stated bound,
//! so that too few samples fail instead of passing.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "tests may unwrap; they print measured figures"
)]

#[allow(dead_code, reason = "other test programs use the rest")]
#[path = "../common/mod.rs"]
mod common;
mod tracer;

mod compare;
mod furnace;
mod glass;
mod lobes;
mod matter;
mod opaque;
mod scattering;

use etendue::scene::Scene;
use tracer::{Picture, Plan, picture};

/// Standard errors between an estimate and what it is allowed to be: two-sided 1e-6.
const Z: f64 = 4.9;

/// Mean of a channel over the frame with its standard error.
fn mean(p: &Picture, channel: usize) -> (f64, f64) {
    let n = p.mean.len() as f64;
    let sum: f64 = p.mean.iter().map(|v| v[channel]).sum();
    let variance: f64 = p.variance.iter().map(|v| v[channel]).sum();
    (sum / n, variance.sqrt() / n)
}

/// An estimate is `truth` within the bound `delta`, chance included.
fn assert_is(what: &str, (mean, error): (f64, f64), truth: f64, delta: f64) {
    let off = (mean - truth).abs();
    let chance = Z * error;
    println!("{what}: {mean:.6} ± {error:.1e}, truth {truth:.6}, allowed {delta:.1e}");
    assert!(
        off + chance <= delta,
        "{what}: {mean} ± {error} instead of {truth}"
    );
}

/// Means of the channels of a small frame; no path may be given up.
fn traced(scene: &Scene, side: u32, samples: u32, channels: usize) -> Vec<(f64, f64)> {
    let plan = Plan {
        side,
        samples,
        seed: 1,
        channels,
    };
    let p = picture(scene, &plan);
    assert_eq!(p.given_up, 0, "paths were given up");
    (0..channels).map(|channel| mean(&p, channel)).collect()
}
