//! Light that mirrors and interfaces gather, which photons tell paths to look for: the same means, far less noise.

use std::f64::consts::PI;

use etendue::film::Film;
use etendue::render::Tuning;
use etendue::scene::{Material, Scene, Volume};
use etendue::settings::{BackendChoice, Estimator, Settings};
use glam::{DVec3, Vec3};

use crate::common::backends::pair;
use crate::common::*;
use crate::statistics::{Batches, Estimate, Family, regions};

/// Renders of each kind, with seeds of their own.
const SEEDS: u64 = 16;
const SIDE: u32 = 16;
const TILE: usize = 4;
/// Half the edge of the lamp beside the mirror, metres.
const LAMP: f64 = 0.01;

/// A floor below a small lamp, beside a mirror in the plane x = 1.
fn mirrored_lamp() -> Scene {
    let mut scene = empty();
    add(&mut scene, square(Vec3::ZERO, Vec3::Y, 4.0), lambert(0.5));
    let mirror = square(Vec3::new(1.0, 1.0, 0.0), -Vec3::X, 1.0);
    add(&mut scene, mirror, metal(1.0, 0.0));
    add(
        &mut scene,
        square(Vec3::Y, -Vec3::Y, LAMP as f32),
        emitter(0.0, 1e4),
    );
    scene.cameras = vec![parallel(
        DVec3::new(0.2, 0.9, 0.0),
        DVec3::new(0.2, 0.0, 0.0),
        0.4,
    )];
    scene
}

/// A floor with a ball of glass, a small mirror and a polished plate, below a lamp that paths find by chance, too.
fn gathered() -> Scene {
    let mut scene = empty();
    add(&mut scene, square(Vec3::ZERO, Vec3::Y, 2.0), lambert(0.6));
    let mut ball = sphere(3);
    ball.positions
        .iter_mut()
        .for_each(|p| *p = 0.3 * *p + Vec3::new(-0.3, 0.45, 0.0));
    let glass = Material {
        metallic: 0.0,
        roughness: 0.0,
        transmission: 1.0,
        volume: Some(Volume::default()),
        ..Material::default()
    };
    add(&mut scene, ball, glass);
    let slanted = Vec3::new(-1.0, 0.6, 0.0).normalize();
    add(
        &mut scene,
        square(Vec3::new(0.7, 0.4, 0.2), slanted, 0.25),
        metal(0.9, 0.0),
    );
    let mut polished = lambert(0.3);
    (polished.specular, polished.roughness) = (1.0, 0.2);
    add(
        &mut scene,
        square(Vec3::new(0.0, 0.3, -0.7), Vec3::Z, 0.3),
        polished,
    );
    add(
        &mut scene,
        square(Vec3::new(-0.1, 1.6, 0.3), -Vec3::Y, 0.2),
        emitter(0.0, 10.0),
    );
    scene.environment = constant_sky(0.1);
    scene.cameras = vec![pinhole(
        DVec3::new(0.0, 1.3, 1.8),
        DVec3::new(0.0, 0.1, 0.0),
        50.0,
    )];
    scene
}

fn film(scene: &Scene, settings: &Settings, is_guided: bool) -> Option<Film> {
    let rendered = render(scene, settings, Tuning::default())?;
    let features = &rendered.report.features;
    let guides = features.iter().any(|f| f.name == "guide" && f.on);
    assert_eq!(guides, is_guided, "{:?}", settings.backend);
    Some(rendered.film)
}

/// What the floor sends up at (x, z), by the lamp and its image: single points, which is off by the square of the lamp's edge.
fn floor(x: f64, z: f64) -> f64 {
    let intensity = 1e4 * 4.0 * LAMP * LAMP;
    let from = |lamp: f64| {
        let d2 = (x - lamp).powi(2) + z * z + 1.0;
        intensity / (d2 * d2)
    };
    0.5 / PI * (from(0.0) + from(2.0))
}

/// Rays that a floor scatters meet the image of the lamp once in 10⁵; with a guide the picture is as quiet as by direct light.
#[test]
fn a_mirrored_lamp_is_as_bright_as_two() {
    let scene = mirrored_lamp();
    let fine = 64;
    let at = |k: u32| 0.4 * (2.0 * (f64::from(k) + 0.5) / f64::from(fine) - 1.0);
    let places = (0..fine * fine).map(|k| (0.2 + at(k % fine), at(k / fine)));
    let truth = places.map(|(x, z)| floor(x, z)).sum::<f64>() / f64::from(fine * fine);
    for backend in pair() {
        let settings = Settings {
            backend,
            max_depth: 2,
            ..settings(SIDE, 1024)
        };
        let Some(film) = film(&scene, &settings, true) else {
            continue;
        };
        Estimate::of_image(&film).assert_is("floor", truth, 2e-3);
    }
}

#[test]
fn guided_paths_have_the_mean_of_plain_ones() {
    let scene = gathered();
    let batches = |backend, estimator, samples| {
        let mut batches = Batches::default();
        for seed in 0..SEEDS {
            let settings = Settings {
                backend,
                estimator,
                seed: seed + 1000 * samples,
                ..settings(SIDE, samples)
            };
            batches.push(&film(&scene, &settings, estimator == Estimator::Full)?);
        }
        Some(batches)
    };
    let Some(plain) = batches(BackendChoice::Bvh, Estimator::Textbook, 2048) else {
        return;
    };
    for backend in pair() {
        let Some(guided) = batches(backend, Estimator::Full, 512) else {
            continue;
        };
        let mut family = Family::default();
        for (name, pixels) in regions(SIDE as usize, TILE) {
            let [a, b] = [&guided, &plain].map(|x| x.estimate(&pixels, 1));
            println!(
                "{name}: {:.5} ± {:.5}, {:.5} ± {:.5}",
                a.mean, a.error, b.mean, b.error
            );
            family.add(name, a.minus(b).p(0.0));
        }
        family.assert(&format!("{backend:?}"));
    }
}
