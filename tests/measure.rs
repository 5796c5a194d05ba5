//! The light meter against closed forms: what falls on a point, arrives along a
//! ray, leaves a lamp in a direction and altogether; and its interval against its own spread.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    dead_code,
    reason = "tests may unwrap and print; not every builder of the common module is used here"
)]

#[path = "common/mod.rs"]
mod common;
#[path = "common/statistics.rs"]
mod statistics;

use std::f64::consts::PI;

use common::*;
use etendue::render::{Reading, Tuning};
use etendue::scene::{LightKind, Material, PunctualLight, Scene};
use etendue::settings::{Sensor, Settings};
use etendue::tails::student_quantile;
use glam::{DVec3, Vec3};
use statistics::Estimate;

/// A reading of the sensor from 1024 pixels of `samples`, or none without a device.
fn read(scene: &Scene, sensor: Sensor, samples: u64, seed: u64) -> Option<Reading> {
    let settings = Settings {
        sensor: Some(sensor),
        seed,
        ..settings(32, samples)
    };
    let rendered = render(scene, &settings, Tuning::default())?;
    Some(Reading::of(&rendered.film, &sensor, scene).unwrap())
}

/// The reading is `truth` within the relative bound `delta`, chance included.
fn assert_reads(what: &str, scene: &Scene, sensor: Sensor, truth: f64, delta: f64) {
    let Some(reading) = read(scene, sensor, 1024, 1) else {
        return;
    };
    for (value, error) in reading.value.into_iter().zip(reading.error) {
        Estimate::new(value, error).assert_is(what, truth, delta);
    }
}

fn upwards(position: DVec3) -> Sensor {
    Sensor::Irradiance {
        position,
        normal: DVec3::Y,
    }
}

fn punctual(kind: LightKind, position: DVec3, direction: Vec3) -> PunctualLight {
    PunctualLight {
        name: String::from("lamp"),
        kind,
        position,
        direction,
        intensity: Vec3::splat(3.0),
    }
}

/// Something black far below, so that the scene has an extent.
fn nothing() -> Scene {
    let mut scene = empty();
    add(
        &mut scene,
        square(Vec3::new(0.0, -9.0, 0.0), Vec3::Y, 1.0),
        lambert(0.0),
    );
    scene
}

#[test]
fn irradiance_of_lights_without_extent() {
    for degrees in [0.0f64, 30.0, 60.0, 85.0] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let towards = DVec3::new(sin, cos, 0.0);
        let mut scene = nothing();
        scene.lights = vec![punctual(LightKind::Point, 2.0 * towards, Vec3::NEG_Y)];
        let what = format!("point at {degrees}°");
        assert_reads(&what, &scene, upwards(DVec3::ZERO), 3.0 * cos / 4.0, 1e-5);
        scene.lights = vec![punctual(
            LightKind::Directional,
            DVec3::ZERO,
            -towards.as_vec3(),
        )];
        let what = format!("sun at {degrees}°");
        assert_reads(&what, &scene, upwards(DVec3::ZERO), 3.0 * cos, 1e-5);
    }
}

#[test]
fn irradiance_of_skies_and_rooms() {
    let mut scene = nothing();
    scene.environment = constant_sky(0.7);
    assert_reads("sky", &scene, upwards(DVec3::ZERO), 0.7 * PI, 1e-5);
    let mut scene = empty();
    add(&mut scene, room(1.0), emitter(0.5, 1.0));
    // In the air and on the floor itself: E = π L/(1 − ρ).
    for y in [0.3, -1.0] {
        let sensor = upwards(DVec3::new(0.2, y, -0.1));
        assert_reads("room", &scene, sensor, PI / 0.5, 5e-3);
    }
}

/// The sensor is no scattering event: with one allowed, the room's light has bounced once at most.
#[test]
fn depth_counts_from_the_first_surface() {
    let mut scene = empty();
    add(&mut scene, room(1.0), emitter(0.5, 1.0));
    let sensor = upwards(DVec3::new(0.2, 0.3, -0.1));
    let settings = Settings {
        sensor: Some(sensor),
        max_depth: 1,
        ..settings(32, 256)
    };
    let Some(r) = render(&scene, &settings, Tuning::default()) else {
        return;
    };
    let reading = Reading::of(&r.film, &sensor, &scene).unwrap();
    let seen = Estimate::new(reading.value[0], reading.error[0]);
    seen.assert_is("one scattering", 1.5 * PI, 5e-3);
}

/// In glass all radiance that gets in is n² times as large: the hemisphere above a meter under a plane face holds
/// what is refracted, π L (1 − F) with Fresnel's mean from outside, and nothing beyond the critical angle.
#[test]
fn irradiance_under_glass_is_what_gets_in() {
    let mut scene = empty();
    let mut slab = square(Vec3::ZERO, Vec3::Y, 50.0);
    // A wide block of glass, black below: its floor absorbs what comes down.
    slab.name = String::from("floor");
    for p in &mut slab.positions {
        p.y = -1.5;
    }
    add(&mut scene, slab, lambert(0.0));
    let mut block = room(1.0);
    for p in &mut block.positions {
        *p *= Vec3::new(50.0, 1.0, 50.0);
        p.y -= 1.0;
    }
    for t in &mut block.triangles {
        t.swap(1, 2);
    }
    let glass = Material {
        metallic: 0.0,
        roughness: 0.0,
        transmission: 1.0,
        volume: Some(Default::default()),
        ..Material::default()
    };
    add(&mut scene, block, glass);
    scene.environment = constant_sky(1.0);
    let truth = PI * (1.0 - 0.091_778_0);
    assert_reads(
        "under glass",
        &scene,
        upwards(DVec3::new(0.0, -1.0, 0.0)),
        truth,
        2e-2,
    );
}

/// Where the scene stands does not matter: 4e5 m away everything reads the same.
#[test]
fn far_away_reads_the_same() {
    let place = DVec3::new(4e5, -2e5, 3e5);
    let mut scene = nothing();
    scene.lights = vec![punctual(
        LightKind::Point,
        DVec3::new(0.0, 2.0, 0.0),
        Vec3::NEG_Y,
    )];
    let mut far = carried(scene, 1.0, place);
    far.lights[0].position += place;
    assert_reads("far", &far, upwards(place), 3.0 / 4.0, 1e-5);
}

/// A node brings its descendants, wherever they stand in the file, and nothing else.
#[test]
fn luminaire_is_a_node_with_its_descendants() {
    let mut scene = nothing();
    add(
        &mut scene,
        square(Vec3::ZERO, Vec3::Y, 0.5),
        emitter(0.0, 2.0),
    );
    scene.lights = vec![punctual(LightKind::Point, DVec3::ZERO, Vec3::NEG_Y)];
    scene.environment = constant_sky(1.0);
    let node = |name: &str, parent, instances: &[u32], lights: &[u32]| etendue::scene::Node {
        name: name.to_owned(),
        parent,
        instances: instances.to_vec(),
        lights: lights.to_vec(),
    };
    scene.nodes = vec![
        node("bulb", Some(2), &[1], &[]),
        node("floor", None, &[0], &[]),
        node("lamp", Some(3), &[], &[]),
        node("ceiling", None, &[], &[0]),
    ];
    let counts = |name: &str| {
        let part = scene.luminaire(scene.find_node(name).unwrap());
        assert!(part.environment.is_none() && part.medium.is_none());
        (part.instances.len(), part.lights.len())
    };
    assert_eq!(counts("bulb"), (1, 0));
    assert_eq!(counts("lamp"), (1, 0));
    assert_eq!(counts("ceiling"), (1, 1));
    assert_eq!(counts("1"), (1, 0));
    assert_eq!(scene.find_node("4"), None);
}

/// A disc-like square above the meter: the form factor of a square over its centre by quadrature.
#[test]
fn irradiance_below_a_square_lamp() {
    let mut scene = empty();
    add(
        &mut scene,
        square(Vec3::new(0.0, 1.0, 0.0), Vec3::NEG_Y, 0.5),
        emitter(0.0, 4.0),
    );
    let count = 1000;
    let at = |i: usize| (i as f64 + 0.5) / count as f64 - 0.5;
    let mut sum = 0.0;
    for x in (0..count).map(at) {
        for z in (0..count).map(at) {
            // cosθ cosθ'/d² with both cosines 1/d.
            sum += (1.0 + x * x + z * z).powi(-2);
        }
    }
    let truth = 4.0 * sum / (count * count) as f64;
    assert_reads("square", &scene, upwards(DVec3::ZERO), truth, 5e-3);
    let looking_up = Sensor::Radiance {
        position: DVec3::ZERO,
        direction: DVec3::Y,
    };
    assert_reads("its radiance", &scene, looking_up, 4.0, 1e-6);
}

#[test]
fn intensity_and_flux_of_a_square_lamp() {
    for is_double_sided in [false, true] {
        let mut scene = empty();
        let material = Material {
            double_sided: is_double_sided,
            ..emitter(0.0, 2.0)
        };
        add(
            &mut scene,
            square(Vec3::new(3.0, 1.0, 0.0), Vec3::Y, 0.5),
            material,
        );
        let sides = if is_double_sided { 2.0 } else { 1.0 };
        assert_reads("flux", &scene, Sensor::Flux, sides * PI * 2.0, 2e-2);
        for degrees in [0.0f64, 60.0, 180.0] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let sensor = Sensor::Intensity {
                direction: DVec3::new(sin, cos, 0.0),
            };
            let what = format!("intensity at {degrees}°");
            if cos > 0.0 || is_double_sided {
                assert_reads(&what, &scene, sensor, 2.0 * cos.abs(), 1e-2);
            } else if let Some(reading) = read(&scene, sensor, 16, 1) {
                assert_eq!(reading.value, [0.0; 3], "{what}");
            }
        }
    }
}

/// 4πI of a point, and a spot's profile: its flux is its intensity's integral, by quadrature.
#[test]
fn flux_of_lights_without_extent() {
    let alone = |kind| Scene {
        lights: vec![punctual(kind, DVec3::ZERO, Vec3::NEG_Y)],
        ..empty()
    };
    assert_eq!(flux_of(&alone(LightKind::Point)), 4.0 * PI * 3.0);
    let spot = alone(LightKind::Spot {
        cos_inner: 0.9,
        cos_outer: 0.7,
    });
    let count = 20_000;
    let mut sum = 0.0;
    for i in 0..count {
        let cosine = 2.0 * (f64::from(i) + 0.5) / f64::from(count) - 1.0;
        let sine = (1.0 - cosine * cosine).sqrt();
        let direction = DVec3::new(sine, -cosine, 0.0);
        sum += reading_without_surfaces(&spot, Sensor::Intensity { direction });
    }
    let truth = 4.0 * PI * sum / f64::from(count);
    let flux = flux_of(&spot);
    assert!(
        (flux / truth - 1.0).abs() < 1e-4,
        "{flux} instead of {truth}"
    );
    // Surfaces would cast shadows that the meter does not know.
    let mut mixed = nothing();
    mixed.lights = spot.lights;
    let film = etendue::film::Film::new(settings(1, 1).window(), (1, 1), false);
    assert!(Reading::of(&film, &Sensor::Flux, &mixed).is_err());
}

/// A reading of a scene of lights alone needs no device.
fn reading_without_surfaces(scene: &Scene, sensor: Sensor) -> f64 {
    let mut film = etendue::film::Film::new(settings(1, 1).window(), (1, 1), false);
    film.add(0, 0, vec![0.0; etendue::layout::FILM_FLOATS as usize])
        .unwrap();
    Reading::of(&film, &sensor, scene).unwrap().value[0]
}

fn flux_of(scene: &Scene) -> f64 {
    reading_without_surfaces(scene, Sensor::Flux)
}

/// Of 1024 readings (the pixels) the 95 % interval holds the truth in 93 to 97 %: three
/// standard deviations of chance.
#[test]
fn interval_is_what_it_says() {
    let mut scene = empty();
    add(&mut scene, room(1.0), emitter(0.5, 1.0));
    let sensor = upwards(DVec3::new(0.2, 0.3, -0.1));
    let settings = Settings {
        sensor: Some(sensor),
        ..settings(32, 256)
    };
    let Some(r) = render(&scene, &settings, Tuning::default()) else {
        return;
    };
    // The error of each pixel comes from two nets of 128 samples and their blocks.
    assert_eq!(r.film.parts(), 4.0);
    let quantile = student_quantile(0.05, 3.0) as f32;
    let readings = r.film.mean().into_iter().zip(r.film.standard_error());
    let held = readings
        .filter(|(mean, error)| (mean[0] - 2.0).abs() <= quantile * error[0])
        .count();
    println!("{held} of 1024 intervals hold the truth");
    assert!((952..=993).contains(&held), "{held} of 1024");
}
