//! A second path tracer, its own tests against closed forms, and the renderer
//! compared with it.
//!
//! Every seed is fixed. Tests of chance are tests of equivalence: they pass only
//! when the deviation plus [`statistics::Z`] standard errors stays inside the stated bound,
//! so that too few samples fail instead of passing.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "tests may unwrap; they print measured figures"
)]

#[allow(dead_code, reason = "other test programs use the rest")]
#[path = "../common/mod.rs"]
mod common;
#[path = "../common/statistics.rs"]
mod statistics;
#[allow(dead_code, reason = "other test programs use the rest")]
#[path = "../common/tier.rs"]
mod tier;
mod tracer;

mod compare;
mod furnace;
mod glass;
mod lobes;
mod matter;
mod opaque;
mod scattering;

use etendue::scene::Scene;
use statistics::Estimate;
use tracer::{Picture, Plan, picture};

/// Mean of a channel over the frame.
fn mean(p: &Picture, channel: usize) -> Estimate {
    let pixels = p.mean.iter().zip(&p.variance);
    Estimate::of_pixels(pixels.map(|(m, v)| (m[channel], v[channel].sqrt())))
}

/// An estimate is `truth` within the bound `delta`, chance included.
fn assert_is(what: &str, seen: Estimate, truth: f64, delta: f64) {
    let Estimate { mean, error, .. } = seen;
    println!("{what}: {mean:.6} ± {error:.1e}, truth {truth:.6}, allowed {delta:.1e}");
    assert!(
        seen.is_within(truth, delta),
        "{what}: {mean} ± {error} instead of {truth}"
    );
}

/// Means of the channels of a small frame; no path may be given up.
fn traced(scene: &Scene, side: u32, samples: u32, channels: usize) -> Vec<Estimate> {
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
