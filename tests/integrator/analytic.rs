//! Lights with an answer from outside: Lambert's polygon formula, and quadrature
//! of a map's bilinear reconstruction.

use std::f64::consts::PI;
use std::sync::Arc;

use etendue::render::{Control, Tuning};
use etendue::scene::{Environment, Scene};
use etendue::settings::{BackendChoice, Settings, Strategy};
use glam::{DVec3, Vec3};

use crate::common::backends::pair;
use crate::common::*;
use crate::statistics::{Batches, Estimate};

/// Relative error that is allowed, chance included.
const DELTA: f64 = 5e-3;

fn assert_mean(what: &str, scene: &Scene, settings: &Settings, truth: f64) {
    let Some(r) = render(scene, settings, Tuning::default()) else {
        return;
    };
    Estimate::of_image(&r.film).assert_is(what, truth, DELTA);
}

/// Irradiance of a polygon of radiance 1 on a point with normal n: half the sum
/// of the edges' angles times the normals of their planes. [Lambert 1760]
fn lambert_polygon(corners: &[DVec3], at: DVec3, n: DVec3) -> f64 {
    let rays: Vec<DVec3> = corners.iter().map(|c| (*c - at).normalize()).collect();
    let sum: f64 = (0..rays.len())
        .map(|i| {
            let (a, b) = (rays[i], rays[(i + 1) % rays.len()]);
            let cross = a.cross(b);
            cross.length().atan2(a.dot(b)) * cross.normalize().dot(n)
        })
        .sum();
    (0.5 * sum).abs()
}

/// From three times the light's size down to a thousandth of it.
#[test]
fn polygon_light_obeys_lamberts_formula_at_every_height() {
    let at = DVec3::new(0.21, 0.0, -0.13);
    for height in [3.0, 0.3, 0.03, 1e-3] {
        let mut scene = empty();
        add(&mut scene, square(Vec3::ZERO, Vec3::Y, 4.0), lambert(1.0));
        let light = square(Vec3::new(0.0, height, 0.0), Vec3::NEG_Y, 0.5);
        let corners: Vec<DVec3> = light.positions.iter().map(|p| p.as_dvec3()).collect();
        add(&mut scene, light, emitter(0.0, 5.0));
        // From between the plane and the light, a spot small enough to be a point.
        let eye = at + f64::from(height) * DVec3::new(0.2, 0.5, 0.1);
        scene
            .cameras
            .push(parallel(eye, at, 1e-3 * f64::from(height)));
        let truth = 5.0 * lambert_polygon(&corners, at, DVec3::Y) / PI;
        assert_mean(&format!("{height} m"), &scene, &settings(32, 1024), truth);
    }
}

/// A point that one ray in two hundred finds the light from, where samples are spread by pilots of sixteen: pixels whose pilots
/// met it take up to four times the samples, and the mean over 512 seeds is that of the formula. With the samples of the
/// picture as pilot it would be dark: pixels that happen to miss the light would stay at sixteen.
#[test]
fn spread_samples_are_not_biased() {
    let mut scene = empty();
    add(&mut scene, square(Vec3::ZERO, Vec3::Y, 4.0), lambert(1.0));
    let light = square(8.0 * Vec3::Y, Vec3::NEG_Y, 0.5);
    let corners: Vec<DVec3> = light.positions.iter().map(|p| p.as_dvec3()).collect();
    add(&mut scene, light, emitter(0.0, 5.0));
    let eye = DVec3::new(1.0, 4.0, 0.5);
    scene.cameras.push(parallel(eye, DVec3::ZERO, 5e-3));
    let adaptive = Settings {
        strategy: Strategy::BsdfOnly,
        adaptive: true,
        ..settings(16, 64)
    };
    let Some(mut renderer) = open(&scene, &adaptive, Tuning::default()) else {
        return;
    };
    let mut batches = Batches::default();
    let mut taken = [u64::MAX, 0];
    for seed in 0..512 {
        renderer.restart(0..64, seed).unwrap();
        let least = renderer.spread(64).unwrap();
        renderer.restart(0..least, seed).unwrap();
        let film = renderer.render(&mut |_| Control::Continue).unwrap();
        batches.push(&film);
        let paths = renderer.report().paths;
        taken = [taken[0].min(paths), taken[1].max(paths)];
    }
    println!("{} to {} samples a pixel", taken[0] / 256, taken[1] / 256);
    assert!(taken[0] > 48 * 256 && taken[1] <= 64 * 256);
    let truth = 5.0 * lambert_polygon(&corners, DVec3::ZERO, DVec3::Y) / PI;
    let all: Vec<usize> = (0..256).collect();
    batches.estimate(&all, 0).assert_is("spread", truth, 0.05);
}

/// Shadow rays from afar end with an error that grows with their length. They must not meet
/// the lamp that they aim at, even where it is seen nearly edge-on.
#[test]
fn far_lamps_are_not_in_their_own_shadow() {
    let normal = Vec3::new(0.48, 0.6, 0.64);
    let along = Vec3::new(0.8, -0.6, 0.0).cross(normal).normalize();
    for distance in [13.0, 1000.0] {
        for cosine in [0.5_f32, 0.005] {
            let towards = cosine * normal + (1.0 - cosine * cosine).sqrt() * along;
            let mut scene = empty();
            let light = square(Vec3::ZERO, normal, 0.5);
            let corners: Vec<DVec3> = light.positions.iter().map(|p| p.as_dvec3()).collect();
            add(&mut scene, light, emitter(0.0, 5.0));
            add(
                &mut scene,
                square(distance * towards, -towards, 0.1),
                lambert(1.0),
            );
            let at = f64::from(distance) * towards.as_dvec3();
            scene
                .cameras
                .push(parallel(at - towards.as_dvec3(), at, 1e-2));
            let truth = 5.0 * lambert_polygon(&corners, at, -towards.as_dvec3()) / PI;
            for backend in pair() {
                let settings = Settings {
                    backend,
                    ..settings(16, 64)
                };
                let what = format!("{} at {distance} m, cosine {cosine}", backend.name());
                let Some(r) = render(&scene, &settings, Tuning::default()) else {
                    return;
                };
                Estimate::of_image(&r.film).assert_is(&what, truth, 1e-3);
            }
        }
    }
}

const WIDTH: i64 = 12;
const HEIGHT: i64 = 6;

/// The only texel with light.
fn texel(x: i64, y: i64) -> f64 {
    if (x.rem_euclid(WIDTH), y) == (5, 1) {
        30.0
    } else {
        0.0
    }
}

/// Irradiance over π of a plane y = 0, by the midpoint rule with 64² points a texel.
fn quadrature() -> f64 {
    const POINTS: i64 = 64;
    let (columns, rows) = (WIDTH * POINTS, HEIGHT * POINTS);
    let cell = 2.0 * PI / columns as f64 * PI / rows as f64;
    let mut sum = 0.0;
    for row in 0..rows / 2 {
        let theta = PI * (row as f64 + 0.5) / rows as f64;
        let y = (row as f64 + 0.5) / POINTS as f64 - 0.5;
        for column in 0..columns {
            let x = (column as f64 + 0.5) / POINTS as f64 - 0.5;
            let (fx, fy) = (x - x.floor(), y - y.floor());
            let at = |dx, dy: i64| texel(x.floor() as i64 + dx, y.floor() as i64 + dy);
            let value = (at(0, 0) * (1.0 - fx) + at(1, 0) * fx) * (1.0 - fy)
                + (at(0, 1) * (1.0 - fx) + at(1, 1) * fx) * fy;
            sum += value * theta.sin() * theta.cos() * cell;
        }
    }
    sum / PI
}

/// A table from the texels alone has density zero beside the bright one, where
/// the bilinear reconstruction has light.
#[test]
fn single_bright_texel_lights_a_plane_by_its_reconstruction() {
    let texels = (0..WIDTH * HEIGHT).map(|i| [texel(i % WIDTH, i / WIDTH) as f32; 3]);
    let mut scene = empty();
    scene.environment = Some(Environment::Map {
        width: WIDTH as u32,
        height: HEIGHT as u32,
        texels: Arc::new(texels.collect()),
        intensity: 1.0,
        rotation: 0.0,
    });
    add(&mut scene, square(Vec3::ZERO, Vec3::Y, 1.0), lambert(1.0));
    scene
        .cameras
        .push(pinhole(DVec3::new(0.1, 1.0, 0.2), DVec3::ZERO, 30.0));
    let truth = quadrature();
    // Light that is found by chance needs more samples.
    for (strategy, samples) in [
        (Strategy::BsdfOnly, 16_384),
        (Strategy::LightOnly, 2048),
        (Strategy::Mis, 2048),
    ] {
        let settings = Settings {
            strategy,
            backend: BackendChoice::Bvh,
            ..settings(32, samples)
        };
        assert_mean(&format!("{strategy:?}"), &scene, &settings, truth);
    }
}
