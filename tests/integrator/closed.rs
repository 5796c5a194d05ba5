//! Closed rooms whose walls all emit: a geometric series, whatever the room's shape.

use etendue::render::Tuning;
use etendue::scene::Scene;
use etendue::settings::{Settings, Strategy};
use glam::DVec3;

use crate::common::backends::pair;
use crate::common::*;
use crate::tier::count;
use crate::{assert_mean, largest_deviation};

/// The room −1 … 1 of `albedo` that emits 1 everywhere, seen from inside.
pub fn glowing_room(albedo: f32) -> Scene {
    let mut scene = empty();
    add(&mut scene, room(1.0), emitter(albedo, 1.0));
    let from = DVec3::new(0.3, -0.2, 0.9);
    scene.cameras = vec![pinhole(from, DVec3::new(-0.4, 0.1, -1.0), 80.0)];
    scene
}

/// (albedo, depth limit, strategy, samples a pixel, relative bound). The bounds
/// are what the samples can show: roulette makes the number of scatterings
/// geometric, with a standard deviation of 1/(1 − albedo).
const CASES: [(f32, u32, Strategy, u64, f64); 9] = [
    (0.5, 0, Strategy::Mis, 8192, 1e-3),
    (0.5, 0, Strategy::BsdfOnly, 2048, 2e-3),
    (0.5, 1, Strategy::BsdfOnly, 16, 1e-5),
    (0.5, 2, Strategy::BsdfOnly, 16, 1e-5),
    (0.5, 2, Strategy::Mis, 1024, 2e-3),
    (0.5, 5, Strategy::BsdfOnly, 8192, 1e-3),
    (0.9, 0, Strategy::BsdfOnly, 2048, 5e-3),
    (0.9, 2, Strategy::BsdfOnly, 16, 1e-5),
    (0.9, 5, Strategy::BsdfOnly, 2048, 1e-3),
];

#[test]
fn closed_room_sums_the_series() {
    for (albedo, max_depth, strategy, samples, delta) in CASES {
        let settings = Settings {
            max_depth,
            strategy,
            seed: 11,
            // By day chance keeps two fifths of the bound.
            ..settings(32, count(samples.min(16).max(samples / 4), samples))
        };
        let Some(r) = render(&glowing_room(albedo), &settings, Tuning::default()) else {
            return;
        };
        let rho = f64::from(albedo);
        let rest = if max_depth == 0 {
            0.0
        } else {
            rho.powi(max_depth as i32 + 1)
        };
        let what = format!("albedo {albedo}, depth {max_depth}, {strategy:?}");
        assert_mean(&what, &r.film, (1.0 - rest) / (1.0 - rho), delta);
        assert_eq!(r.report.ledger.truncated_paths > 0, max_depth > 0, "{what}");
    }
}

/// Without roulette, which starts later, every path has the same value: two
/// scatterings show a single leak or a single hit on the own wall.
#[test]
fn closed_room_may_have_any_size_and_place() {
    for (scale, offset) in [(1e-6, 0.0), (1e6, 0.0), (1.0, 1e6)] {
        let scene = carried(
            glowing_room(0.5),
            scale,
            DVec3::new(offset, -offset, offset),
        );
        for backend in pair() {
            let settings = Settings {
                strategy: Strategy::BsdfOnly,
                max_depth: 2,
                backend,
                ..settings(32, 256)
            };
            let Some(r) = render(&scene, &settings, Tuning::default()) else {
                continue;
            };
            let off = largest_deviation(&r.film, 1.75);
            // One path in 262 144 that goes astray changes its pixel by 1e-3.
            assert!(off <= 1e-6, "{backend:?}, × {scale}, + {offset}: {off:.1e}");
        }
    }
}
