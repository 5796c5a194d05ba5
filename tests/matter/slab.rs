//! Plane-parallel plates, one side lit by half a sky: reflectance and transmittance
//! in closed form, with all reflections between the faces.

use etendue::render::Tuning;
use etendue::scene::{Medium, Mesh, Phase, Scene};
use etendue::settings::Settings;
use glam::Vec3;

use crate::common::*;
use crate::{BOTH, assert_channels, block, fresnel, glass, grey, oblique, sheet};

/// (reflectance, transmittance) of a plate of index n and optical thickness `alpha_d` seen at `degrees`.
fn plate(n: f64, alpha_d: f64, degrees: f64) -> (f64, f64) {
    let cos_i = degrees.to_radians().cos();
    let r = fresnel(cos_i, n);
    let cos_t = (1.0 - (1.0 - cos_i * cos_i) / (n * n)).sqrt();
    let tau = (-alpha_d / cos_t).exp();
    let round = 1.0 - r * r * tau * tau;
    (
        r + r * (1.0 - r).powi(2) * tau * tau / round,
        (1.0 - r).powi(2) * tau / round,
    )
}

/// The half space above z = 0 is white when `from_above`, else the one below: a
/// box of black walls around the plate that emits on one side.
fn lit(mesh: Mesh, material: etendue::scene::Material, from_above: bool) -> Scene {
    let mut scene = empty();
    // Far, so that the walls' finite size is not seen: every ray leaves through a wall.
    let wall = |z: f32, normal: Vec3| square(Vec3::new(0.0, 0.0, z), normal, 4000.0);
    let (z, normal) = if from_above {
        (50.0, -Vec3::Z)
    } else {
        (-50.0, Vec3::Z)
    };
    add(&mut scene, wall(z, normal), emitter(0.0, 1.0));
    add(&mut scene, mesh, material);
    scene
}

#[test]
fn plate_reflects_and_transmits() {
    for backend in BOTH {
        // Ray query is slow here; one index shows that it sees the same.
        let indices: &[f64] = if backend == BOTH[0] {
            &[1.33, 1.5, 2.4]
        } else {
            &[1.5]
        };
        for &n in indices {
            for alpha_d in [0.0, 0.5, 5.0] {
                for degrees in [0.0, 30.0, 60.0, 80.0] {
                    let thickness = 0.25;
                    let medium = grey((alpha_d / thickness) as f32, 0.0, Phase::Isotropic);
                    let slab = block(Vec3::new(-20.0, -20.0, -0.25), Vec3::new(20.0, 20.0, 0.0));
                    let (r, t) = plate(n, alpha_d, degrees);
                    for (from_above, truth) in [(true, r), (false, t)] {
                        let mut scene = lit(slab.clone(), glass(n as f32, medium), from_above);
                        scene.cameras = vec![oblique(degrees, 0.1)];
                        let settings = Settings {
                            backend,
                            ..settings(32, 1024)
                        };
                        let Some(r) = render(&scene, &settings, Tuning::default()) else {
                            return;
                        };
                        let what =
                            format!("{backend:?}, n {n}, αd {alpha_d}, {degrees}°, {from_above}");
                        let (mean, error) = crate::channel_mean(&r.film, 0);
                        let off = (mean - truth).abs();
                        println!(
                            "{what}: {mean:.6}, truth {truth:.6}, off {off:.1e} ± {:.1e}",
                            4.9 * error
                        );
                        assert!(
                            off + 4.9 * error <= 3e-3,
                            "{what}: {mean} instead of {truth}"
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn thin_sheet_is_a_plate_without_absorption() {
    for degrees in [0.0, 60.0, 85.0] {
        let (r, t) = plate(1.5, 0.0, degrees);
        for (from_above, truth) in [(true, r), (false, t)] {
            let square = square(Vec3::ZERO, Vec3::Z, 20.0);
            let mut scene = lit(square, sheet(1.5), from_above);
            scene.cameras = vec![oblique(degrees, 0.1)];
            let Some(r) = render(&scene, &settings(16, 4096), Tuning::default()) else {
                return;
            };
            assert_channels(
                &format!("{degrees}°, {from_above}"),
                &r.film,
                [truth; 3],
                0.02,
            );
        }
    }
}

#[test]
fn medium_without_an_interface_absorbs_by_the_law() {
    // No chance is involved. fp32 holds the path to 1e-5, and its logarithm is what counts.
    for alpha_d in [1e-6, 1e-3, 0.5, 5.0, 20.0] {
        for degrees in [0.0, 60.0] {
            let medium = Medium {
                absorption: Vec3::new(1.0, 0.5, 0.0) * alpha_d,
                ..Medium::default()
            };
            let slab = block(Vec3::new(-3.0, -3.0, -1.0), Vec3::new(3.0, 3.0, 0.0));
            let mut scene = lit(slab, glass(1.0, medium), false);
            scene.cameras = vec![oblique(degrees, 0.1)];
            let Some(r) = render(&scene, &settings(8, 2), Tuning::default()) else {
                return;
            };
            let path = 1.0 / degrees.to_radians().cos();
            let truth = [1.0, 0.5, 0.0].map(|s| (-s * f64::from(alpha_d) * path).exp());
            assert_channels(
                &format!("αd {alpha_d}, {degrees}°"),
                &r.film,
                truth,
                1e-5 * (alpha_d as f64 * path).max(1.0),
            );
        }
    }
}
