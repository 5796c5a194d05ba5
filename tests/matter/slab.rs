//! Plane-parallel plates, one side lit by half a sky: reflectance and transmittance
//! in closed form, with all reflections between the faces.

use etendue::render::Tuning;
use etendue::scene::{Medium, Mesh, Phase, Scene};
use etendue::settings::{BackendChoice, Settings};
use glam::Vec3;

use crate::common::backends::pair;
use crate::common::*;
use crate::tier::count;
use crate::{
    assert_channels, block, channel_mean, fresnel, glass, grey, oblique, samples_for, sheet,
};

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

/// Reflectance and transmittance of one plate are what the closed form says, within `delta` of the light that meets it.
fn assert_plate(backend: BackendChoice, n: f64, alpha_d: f64, degrees: f64, delta: f64) {
    let thickness = 0.25;
    let medium = grey((alpha_d / thickness) as f32, 0.0, Phase::Isotropic);
    let slab = block(
        Vec3::new(-20.0, -20.0, -thickness as f32),
        Vec3::new(20.0, 20.0, 0.0),
    );
    let (r, t) = plate(n, alpha_d, degrees);
    for (from_above, truth) in [(true, r), (false, t)] {
        let mut scene = lit(slab.clone(), glass(n as f32, medium), from_above);
        scene.cameras = vec![oblique(degrees, 0.1)];
        // A path brings 1 or 0 (or what is not absorbed): enough of them to leave chance 3.5 standard errors beside the 4.9.
        let paths = truth * (1.0 - truth) * (8.4 / delta).powi(2);
        // They are nets, which by day may pay: light that passes through has a fifth of the deviation of coins,
        // what is reflected three fifths.
        let samples = samples_for(paths / 1024.0 / count(if from_above { 2 } else { 4 }, 1) as f64);
        let settings = Settings {
            backend,
            ..settings(32, samples)
        };
        let Some(r) = render(&scene, &settings, Tuning::default()) else {
            return;
        };
        let what = format!("{backend:?}, n {n}, αd {alpha_d}, {degrees}°, from above {from_above}");
        let seen = channel_mean(&r.film, 0);
        let (mean, off, bound) = (seen.mean, (seen.mean - truth).abs(), seen.chance());
        println!("{what}: {mean:.6}, truth {truth:.6}, off {off:.1e} ± {bound:.1e}");
        assert!(off + bound <= delta, "{what}: {mean} instead of {truth}");
    }
}

const ANGLES: [f64; 4] = [0.0, 30.0, 60.0, 80.0];

#[test]
fn absorbing_plate_to_a_thousandth() {
    for degrees in ANGLES {
        assert_plate(BackendChoice::Bvh, 1.5, 0.5, degrees, 1e-3);
    }
}

#[test]
fn plates_of_all_kinds() {
    for n in [1.33, 1.5, 2.4] {
        for alpha_d in [0.0, 0.5, 5.0] {
            for degrees in ANGLES {
                assert_plate(BackendChoice::Bvh, n, alpha_d, degrees, 6e-3);
            }
        }
    }
    for backend in pair() {
        for degrees in ANGLES {
            assert_plate(backend, 1.5, 0.5, degrees, 6e-3);
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
