//! A camera in the middle of a glass cube: radiance in glass is n² times that
//! outside, or nothing where total reflection keeps light away for ever.

use etendue::render::Tuning;
use etendue::scene::Medium;
use etendue::settings::Settings;
use glam::{DVec3, Vec3};

use crate::common::backends::pair;
use crate::common::*;
use crate::{block, glass};

#[test]
fn camera_in_a_glass_cube_sees_n_squared_or_nothing() {
    let n = 1.5f64;
    for backend in pair() {
        let mut dark = 0;
        let mut all = 0;
        // Six views of 90° each make up the sphere; pixels are weighted by solid angle.
        let (mut dark_weight, mut weight) = (0.0, 0.0);
        let side = 24;
        for axis in [
            DVec3::X,
            DVec3::Y,
            DVec3::Z,
            -DVec3::X,
            -DVec3::Y,
            -DVec3::Z,
        ] {
            let mut scene = empty();
            let half = Vec3::splat(1.0);
            add(
                &mut scene,
                block(-half, half),
                glass(n as f32, Medium::default()),
            );
            scene.environment = constant_sky(1.0);
            scene.cameras = vec![pinhole(DVec3::ZERO, axis, 90.0)];
            let settings = Settings {
                backend,
                ..settings(side, 16)
            };
            let Some(r) = render(&scene, &settings, Tuning::default()) else {
                return;
            };
            let error = r.film.standard_error();
            for (i, p) in r.film.mean().iter().enumerate() {
                let v = f64::from(p[0]);
                let at = |k: usize| (2.0 * (k as f64 + 0.5) / f64::from(side) - 1.0).powi(2);
                let w = (1.0 + at(i % side as usize) + at(i / side as usize)).powf(-1.5);
                weight += w;
                all += 1;
                if error[i][0] > 1e-5 {
                    dark_weight += w * (1.0 - v / (n * n));
                    continue; // astride the boundary
                }
                let is_dark = v == 0.0;
                assert!(
                    is_dark || (v / (n * n) - 1.0).abs() < 1e-5,
                    "{backend:?}: pixel {v}"
                );
                dark += usize::from(is_dark);
                dark_weight += if is_dark { w } else { 0.0 };
            }
        }
        let truth = 1.0 - 3.0 * (1.0 - (1.0 - 1.0 / (n * n)).sqrt());
        let fraction = dark_weight / weight;
        println!(
            "{backend:?}: trapped {fraction:.5}, truth {truth:.5}; {dark} of {all} pixels dark"
        );
        // Pixel centres stand for pixels: 3456 of them, 16 samples each.
        assert!(
            (fraction - truth).abs() < 5e-3,
            "{fraction} instead of {truth}"
        );
    }
}

/// Neither the size of the cube nor its place changes what is seen from inside.
#[test]
fn glass_cube_may_have_any_size_and_place() {
    for (scale, offset) in [(1e-6, 0.0), (1e6, 0.0), (1.0, 1e6)] {
        let mut scene = empty();
        let half = Vec3::splat(1.0);
        add(
            &mut scene,
            block(-half, half),
            glass(1.5, Medium::default()),
        );
        scene.environment = constant_sky(1.0);
        // Within the cone of light that gets out: every pixel is n².
        let from = DVec3::new(0.1, 0.2, 0.3);
        scene.cameras = vec![pinhole(from, from + DVec3::Z, 40.0)];
        let scene = carried(scene, scale, DVec3::new(offset, -offset, offset));
        for backend in pair() {
            let settings = Settings {
                backend,
                ..settings(16, 16)
            };
            let Some(r) = render(&scene, &settings, Tuning::default()) else {
                return;
            };
            for p in r.film.mean() {
                let off = (f64::from(p[0]) / 2.25 - 1.0).abs();
                assert!(
                    off < 1e-5,
                    "{backend:?}, × {scale}, + {offset}: pixel {}",
                    p[0]
                );
            }
        }
    }
}
