//! Where light goes: a mirror, a sheet and the face of a glass block under a sky that is
//! different in every direction. A white world cannot see a wrong direction.

use std::sync::Arc;

use etendue::render::Tuning;
use etendue::scene::{Environment, Medium, Scene};
use etendue::settings::{Settings, Strategy};
use glam::{DVec3, Vec3};

use crate::common::backends::pair;
use crate::common::*;
use crate::{block, glass, oblique, sheet};

const WIDTH: usize = 64;
const HEIGHT: usize = 32;

/// Radiance of a texel: positive, and with another slope in each channel.
fn texel(x: usize, y: usize) -> [f64; 3] {
    let u = std::f64::consts::TAU * (x as f64 + 0.5) / WIDTH as f64;
    let v = std::f64::consts::PI * (y as f64 + 0.5) / HEIGHT as f64;
    [1.5 + u.cos(), 1.5 + v.cos(), 2.0 + u.sin() * v.sin()]
}

fn sky() -> Option<Environment> {
    let texels = (0..WIDTH * HEIGHT).map(|i| texel(i % WIDTH, i / WIDTH).map(|v| v as f32));
    Some(Environment::Map {
        width: WIDTH as u32,
        height: HEIGHT as u32,
        texels: Arc::new(texels.collect()),
        intensity: 1.0,
        rotation: 0.0,
    })
}

/// The sky's radiance from direction d, bilinear between the texels' centres.
fn sky_from(d: DVec3) -> [f64; 3] {
    let d = d.normalize();
    let at = |turn: f64, size: usize| turn * size as f64 - 0.5;
    let x = at(0.5 + d.x.atan2(-d.z) / std::f64::consts::TAU, WIDTH);
    let y = at(d.y.acos() / std::f64::consts::PI, HEIGHT);
    let (x0, y0) = (x.floor(), y.floor());
    let look = |x: f64, y: f64| {
        texel(
            x.rem_euclid(WIDTH as f64) as usize,
            y.clamp(0.0, HEIGHT as f64 - 1.0) as usize,
        )
    };
    let mix = |a: [f64; 3], b: [f64; 3], f: f64| [0, 1, 2].map(|c| a[c] + (b[c] - a[c]) * f);
    let top = mix(look(x0, y0), look(x0 + 1.0, y0), x - x0);
    let bottom = mix(look(x0, y0 + 1.0), look(x0 + 1.0, y0 + 1.0), x - x0);
    mix(top, bottom, y - y0)
}

/// Every pixel is one of the values; all of them occur.
fn assert_one_of(what: &str, scene: &Scene, settings: &Settings, values: &[[f64; 3]]) {
    let Some(r) = render(scene, settings, Tuning::default()) else {
        return;
    };
    let mut seen = vec![0; values.len()];
    for pixel in r.film.mean() {
        let off = |v: &[f64; 3]| {
            let d = |c: usize| (f64::from(pixel[c]) - v[c]).abs() / v[c].max(1.0);
            d(0).max(d(1)).max(d(2))
        };
        let nearest =
            (0..values.len()).min_by(|a, b| off(&values[*a]).total_cmp(&off(&values[*b])));
        let nearest = nearest.unwrap();
        assert!(
            off(&values[nearest]) <= 1e-5,
            "{what}: {pixel:?} is none of {values:?}"
        );
        seen[nearest] += 1;
    }
    println!("{what}: {seen:?} pixels");
    assert!(
        seen.iter().all(|n| *n > 0),
        "{what}: {seen:?} pixels of {values:?}"
    );
}

/// One sample a pixel, so that each is one outcome of chance.
fn single(backend: etendue::settings::BackendChoice) -> Settings {
    Settings {
        backend,
        strategy: Strategy::BsdfOnly,
        ..settings(32, 1)
    }
}

#[test]
fn mirror_shows_the_mirrored_sky() {
    for backend in pair() {
        for degrees in [0.0f64, 60.0, 85.0] {
            let mut scene = empty();
            add(
                &mut scene,
                square(Vec3::ZERO, Vec3::Z, 5.0),
                metal(1.0, 0.0),
            );
            scene.environment = sky();
            scene.cameras = vec![oblique(degrees, 1e-3)];
            let (sin, cos) = degrees.to_radians().sin_cos();
            let truth = sky_from(DVec3::new(-sin, 0.0, cos));
            assert_one_of(
                &format!("{backend:?}, {degrees}°"),
                &scene,
                &single(backend),
                &[truth],
            );
        }
    }
}

#[test]
fn sheet_shows_the_sky_behind_and_the_mirrored_one() {
    for backend in pair() {
        for degrees in [0.0f64, 60.0, 85.0] {
            let mut scene = empty();
            add(&mut scene, square(Vec3::ZERO, Vec3::Z, 5.0), sheet(1.5));
            scene.environment = sky();
            scene.cameras = vec![oblique(degrees, 1e-3)];
            let (sin, cos) = degrees.to_radians().sin_cos();
            let mirrored = sky_from(DVec3::new(-sin, 0.0, cos));
            let behind = sky_from(DVec3::new(-sin, 0.0, -cos));
            let what = format!("{backend:?}, {degrees}°");
            assert_one_of(&what, &scene, &single(backend), &[mirrored, behind]);
        }
    }
}

/// From inside a block, beyond its face: n² times the refracted sky, or (with one
/// scattering allowed) nothing where the light would have to be reflected on.
#[test]
fn face_of_a_block_shows_the_refracted_sky() {
    let n = 1.5f64;
    for backend in pair() {
        for degrees in [0.0f64, 20.0, 40.0] {
            let mut scene = empty();
            let half = Vec3::splat(2.0);
            add(
                &mut scene,
                block(-half, half),
                glass(n as f32, Medium::default()),
            );
            scene.environment = sky();
            let (sin, cos) = degrees.to_radians().sin_cos();
            let d = DVec3::new(sin, 0.0, cos);
            scene.cameras = vec![parallel(DVec3::ZERO, d, 1e-3)];
            let sin_t = n * sin;
            let sky = sky_from(DVec3::new(sin_t, 0.0, (1.0 - sin_t * sin_t).sqrt()));
            let settings = Settings {
                max_depth: 1,
                ..single(backend)
            };
            let what = format!("{backend:?}, {degrees}°");
            assert_one_of(
                &what,
                &scene,
                &settings,
                &[sky.map(|v| n * n * v), [0.0; 3]],
            );
        }
    }
}
