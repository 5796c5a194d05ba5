//! Scenes with so many lamps that they are chosen by a tree.

use etendue::render::Tuning;
use etendue::scene::{Instance, LightKind, Medium, PunctualLight, Scene};
use etendue::settings::{Estimator, Settings};
use glam::{DAffine3, DVec3, Vec3};

use crate::common::*;
use crate::statistics::Estimate;
use crate::strategies::{Plan, agree};

/// Lamps of many shapes over a floor: spheres that share a mesh, one of them mirrored
/// and stretched, a sheet that shines to both sides, and one that faces away.
fn lamps() -> Scene {
    let mut scene = empty();
    add(&mut scene, square(Vec3::ZERO, Vec3::Y, 3.0), lambert(0.6));
    let place = |scale: DVec3, at: DVec3| DAffine3 {
        translation: at,
        ..DAffine3::from_scale(scale)
    };
    let (small, far) = (DVec3::splat(0.12), DVec3::new(-0.4, 0.3, 0.4));
    let bulb = place(small, DVec3::new(-1.2, 0.4, -0.3));
    add_at(&mut scene, faceted(sphere(1)), emitter(0.0, 6.0), bulb);
    let mesh = scene.instances[1].mesh;
    for (scale, at) in [
        (DVec3::splat(0.4), DVec3::new(1.6, 1.8, -1.0)),
        (far, DVec3::new(0.3, 1.2, 1.0)),
    ] {
        scene.instances.push(Instance {
            name: String::from("bulb"),
            mesh,
            world_from_object: place(scale, at),
        });
    }
    let mut sheet = emitter(0.0, 1.5);
    sheet.double_sided = true;
    add(
        &mut scene,
        square(Vec3::new(0.9, 0.5, 0.3), Vec3::X, 0.3),
        sheet,
    );
    add(
        &mut scene,
        square(Vec3::new(-0.5, 1.5, 0.5), Vec3::Y, 0.4),
        emitter(0.3, 5.0),
    );
    scene.cameras = vec![pinhole(DVec3::new(0.0, 2.6, 3.4), DVec3::ZERO, 40.0)];
    scene
}

#[test]
fn lamps_of_many_shapes() {
    let plan = Plan {
        samples: [2048, 4096, 2048, 8192],
        delta: 1e-2,
    };
    for copy_limit in [0, usize::MAX] {
        let tuning = Tuning {
            copy_limit,
            ..Tuning::default()
        };
        agree("lamps", &lamps(), &plan, tuning);
    }
}

/// Powers beyond single precision: the same picture, but for its unit. In fog the longest segments count as of one length in
/// metres, so that a few of them choose other lights.
#[test]
fn lamps_of_any_size_and_brightness() {
    // Powers of two, so that nothing is rounded anew.
    const SCALE: f64 = 134_217_728.0;
    let gain = 2.0_f32.powi(76);
    for (is_foggy, allowed) in [(false, 1e-6), (true, 1e-4)] {
        let settings = settings(16, if is_foggy { 1024 } else { 16 });
        let film = |scale: f64, gain: f32| {
            let mut scene = carried(lamps(), scale, DVec3::ZERO);
            for material in &mut scene.materials {
                material.emission *= gain;
            }
            scene.medium = is_foggy.then(|| fog(scale as f32));
            Some(render(&scene, &settings, Tuning::default())?.film.mean())
        };
        let (Some(small), Some(large)) = (film(1.0, 1.0), film(SCALE, gain)) else {
            return;
        };
        let sum = |image: &[[f32; 3]]| image.iter().flatten().map(|&v| f64::from(v)).sum::<f64>();
        let off = (sum(&large) / f64::from(gain) / sum(&small) - 1.0).abs();
        println!("fog {is_foggy}: off by {off:.1e}");
        assert!(off < allowed, "fog {is_foggy}: {off}");
    }
}

/// A medium that scatters, for lamps that many times as large.
fn fog(scale: f32) -> Medium {
    Medium {
        absorption: Vec3::new(0.02, 0.05, 0.1) / scale,
        scattering: Vec3::new(0.2, 0.15, 0.1) / scale,
        ..Medium::default()
    }
}

/// The lamps within a medium that scatters, where lights are chosen for segments.
#[test]
fn lamps_in_fog() {
    let mut scene = lamps();
    scene.medium = Some(fog(1.0));
    let plan = Plan {
        samples: [4096, 4096, 4096, 8192],
        delta: 2e-2,
    };
    agree("lamps in fog", &scene, &plan, Tuning::default());
}

/// Irradiance of points of light, spots and the sun on a white floor, in closed form.
#[test]
fn points_of_light_add_up() {
    let mut scene = empty();
    add(&mut scene, square(Vec3::ZERO, Vec3::Y, 3.0), lambert(1.0));
    scene.cameras = vec![parallel(DVec3::Y, DVec3::ZERO, 1e-4)];
    let (mut expected, down) = (DVec3::ZERO, -Vec3::Y);
    for i in 0..60 {
        let angle = f64::from(i) * 2.4;
        let height = 0.2 + 0.05 * f64::from(i % 40);
        let position = DVec3::new(angle.cos(), height, 2.0 * angle.sin());
        let candela = 1.0 + 0.3 * f64::from(i % 7);
        // E = I cosθ / d²
        let distance2 = position.length_squared();
        // Colours differ: which lights are followed must not change them.
        let mut color = DVec3::splat(0.25);
        color[i as usize % 3] = 1.0;
        let irradiance = candela * height / distance2.sqrt() / distance2;
        let (kind, direction, ramp) = if i % 4 == 0 {
            spot(position, f64::from(i) * 0.4)
        } else {
            (LightKind::Point, down, 1.0)
        };
        expected += irradiance * ramp * color;
        scene.lights.push(PunctualLight {
            name: String::from("point"),
            kind,
            position,
            direction,
            intensity: (candela * color).as_vec3(),
        });
    }
    expected += DVec3::splat(3.0);
    scene.lights.push(PunctualLight {
        name: String::from("sun"),
        kind: LightKind::Directional,
        position: DVec3::ZERO,
        direction: down,
        intensity: Vec3::splat(3.0),
    });
    // What a floor of reflectance 1 sends on.
    let truth = expected / std::f64::consts::PI;
    for (estimator, samples) in [(Estimator::Full, 8192), (Estimator::Textbook, 262_144)] {
        let settings = Settings {
            estimator,
            ..settings(8, samples)
        };
        let Some(r) = render(&scene, &settings, Tuning::default()) else {
            return;
        };
        for channel in 0..3 {
            let seen = Estimate::of_film(&r.film, &[channel]);
            seen.assert_is(estimator.name(), truth[channel], 5e-3);
        }
    }
}

/// The same where clusters are on both sides of the floor, most of each below: the tree splits them across their longer axis.
#[test]
fn points_below_the_floor_hide_none_above() {
    let mut scene = empty();
    add(&mut scene, square(Vec3::ZERO, Vec3::Y, 3.0), lambert(1.0));
    scene.cameras = vec![parallel(DVec3::Y, DVec3::ZERO, 1e-4)];
    let mut expected = 0.0;
    for (x, height) in [(-1.0, 0.3), (-1.0, -0.9), (1.0, 0.4), (1.0, -0.8)] {
        let position = DVec3::new(x, height, 0.0);
        expected += height.max(0.0) / position.length().powi(3);
        scene.lights.push(PunctualLight {
            name: String::from("point"),
            kind: LightKind::Point,
            position,
            direction: -Vec3::Y,
            intensity: Vec3::ONE,
        });
    }
    let Some(r) = render(&scene, &settings(8, 1024), Tuning::default()) else {
        return;
    };
    let seen = Estimate::of_film(&r.film, &[0, 1, 2]);
    seen.assert_is("points", expected / std::f64::consts::PI, 5e-3);
}

/// A spot at `position` that is aimed past the origin by `degrees`, and what of its intensity it sends there: from its inner
/// cone of 10° to beyond its outer one of 20°.
fn spot(position: DVec3, degrees: f64) -> (LightKind, Vec3, f64) {
    let towards = -position.normalize();
    let aside = towards.any_orthonormal_vector();
    let (sin, cos) = degrees.to_radians().sin_cos();
    let (inner, outer) = (10.0_f64.to_radians().cos(), 20.0_f64.to_radians().cos());
    let kind = LightKind::Spot {
        cos_inner: inner as f32,
        cos_outer: outer as f32,
    };
    // KHR_lights_punctual
    let ramp = ((cos - outer) / (inner - outer)).clamp(0.0, 1.0).powi(2);
    (kind, (cos * towards + sin * aside).as_vec3(), ramp)
}

/// Walls that shine alike all around: a matt square sends on its part of their radiance. Direct light and scattering find them
/// about as often, so weights that do not add up to one are seen.
#[test]
fn walls_of_lamps_are_counted_once() {
    let mut scene = empty();
    add(&mut scene, square(Vec3::ZERO, Vec3::Y, 0.3), lambert(0.5));
    for wall in [Vec3::X, Vec3::Y, Vec3::Z] {
        for normal in [wall, -wall] {
            add(
                &mut scene,
                square(-2.0 * normal, normal, 2.0),
                emitter(0.0, 1.0),
            );
        }
    }
    scene.cameras = vec![parallel(DVec3::Y, DVec3::ZERO, 1e-2)];
    // out of sight: where anything is no Lambert surface, more samples are drawn
    let mut shiny = scene.clone();
    let outside = square(Vec3::new(0.0, -9.0, 0.0), Vec3::Y, 0.3);
    add(&mut shiny, outside, metal(0.8, 0.4));
    for (name, scene) in [("matt", scene), ("shiny", shiny)] {
        let Some(r) = render(&scene, &settings(8, 1024), Tuning::default()) else {
            return;
        };
        let seen = Estimate::of_film(&r.film, &[0, 1, 2]);
        seen.assert_is(name, 0.5, 5e-3);
    }
}
