//! A plane under a map whose upper half shines.

use std::f64::consts::PI;
use std::sync::Arc;

use etendue::render::Tuning;
use etendue::scene::Environment;
use etendue::settings::{Settings, Strategy};
use glam::{DVec3, Vec3};

use crate::assert_mean;
use crate::common::*;

const ALBEDO: f64 = 0.8;

/// Irradiance over π of a horizontal plane under a map of `height` rows, the
/// upper half 1, by Simpson's rule (error below 1e-9): bilinear reconstruction
/// falls from 1 to 0 between the middles of the rows beside the horizon, and
/// half of that ramp lies above it.
fn irradiance_over_pi(height: u32) -> f64 {
    const STEPS: u32 = 4096;
    let rows = f64::from(height);
    let value = |theta: f64| {
        let row = theta / PI * rows - 0.5;
        let radiance = (0.5 * rows - row).clamp(0.0, 1.0);
        2.0 * radiance * theta.sin() * theta.cos()
    };
    // Simpson's rule on both sides of the bend.
    let bend = PI * (0.5 * rows - 0.5) / rows;
    let simpson = |from: f64, to: f64| {
        let h = (to - from) / f64::from(STEPS);
        let inner: f64 = (1..STEPS)
            .map(|i| f64::from(2 + 2 * (i & 1)) * value(from + f64::from(i) * h))
            .sum();
        (value(from) + inner + value(to)) * h / 3.0
    };
    simpson(0.0, bend) + simpson(bend, 0.5 * PI)
}

#[test]
fn half_sky_lights_a_plane_by_its_albedo() {
    for height in [8, 32] {
        let width = 2 * height;
        let upper = (width * height / 2) as usize;
        let mut texels = vec![[1.0; 3]; upper];
        texels.resize(2 * upper, [0.0; 3]);
        let mut scene = empty();
        add(
            &mut scene,
            square(Vec3::ZERO, Vec3::Y, 1.0),
            lambert(ALBEDO as f32),
        );
        scene.environment = Some(Environment::Map {
            width,
            height,
            texels: Arc::new(texels),
            intensity: 1.0,
            rotation: 0.4,
        });
        scene.cameras = vec![pinhole(DVec3::new(0.5, 2.0, 1.0), DVec3::ZERO, 5.0)];
        let truth = ALBEDO * irradiance_over_pi(height);
        for (strategy, samples) in [
            (Strategy::Mis, 4096),
            (Strategy::LightOnly, 16_384),
            (Strategy::BsdfOnly, 1024),
        ] {
            let settings = Settings {
                strategy,
                ..settings(16, samples)
            };
            let Some(r) = render(&scene, &settings, Tuning::default()) else {
                return;
            };
            assert_mean(
                &format!("{height} rows, {strategy:?}"),
                &r.film,
                truth,
                2e-3,
            );
        }
    }
}
