//! Lamps that are tiny, near, many or dark; depth limits and roulette.

use std::sync::Arc;

use etendue::render::Tuning;
use etendue::scene::{Environment, Medium, Scene};
use etendue::settings::{Settings, Strategy};
use glam::{DAffine3, DMat3, DQuat, DVec3, Vec3};

use crate::common::*;
use crate::solids::glass;
use crate::support::{Estimate, mean_of, pair};
use crate::tier::count;

/// The room −1 … 1 of `albedo` that emits 1 everywhere, seen from inside.
fn glowing_room(albedo: f32) -> Scene {
    let mut scene = empty();
    add(&mut scene, room(1.0), emitter(albedo, 1.0));
    let from = DVec3::new(0.3, -0.2, 0.9);
    scene.cameras = vec![pinhole(from, DVec3::new(-0.4, 0.1, -1.0), 80.0)];
    scene
}

/// m scatterings at most: 1 + ρ + … + ρᵐ, to the end where roulette has not begun, in the mean beyond.
#[test]
fn depth_limits_cut_the_series_where_they_say() {
    const ALBEDO: f32 = 0.9;
    let rho = f64::from(ALBEDO);
    let mut depths = vec![1, 2, 3, 8, 32];
    if crate::tier::is_night() {
        depths = (1..=32).collect();
    }
    for max_depth in depths {
        let settings = Settings {
            max_depth,
            strategy: Strategy::BsdfOnly,
            ..settings(16, count(1024, 16_384))
        };
        let Some(r) = render(&glowing_room(ALBEDO), &settings, Tuning::default()) else {
            return;
        };
        let truth = (1.0 - rho.powi(max_depth as i32 + 1)) / (1.0 - rho);
        let seen = Estimate::of_image(&r.film);
        let (off, bound) = seen.off(truth);
        let ledger = r.report.ledger;
        // Each path that was cut carried ρᵐ with the albedo of the last surface still to come.
        let cut = ledger.truncated_throughput / r.report.paths as f64 / rho.powi(max_depth as i32);
        println!(
            "depth {max_depth}: off by {off:.1e} ± {bound:.1e}, cut {cut:.4} of the throughput that was left"
        );
        assert!(off + bound <= 1e-2, "depth {max_depth}");
        assert!(
            (cut - 1.0).abs() <= 0.1 || (cut - rho).abs() <= 0.1,
            "depth {max_depth}: {cut}"
        );
    }
}

/// A path that survives with its throughput's probability has as many scatterings as a geometric law says, and
/// brings 1 for each: variance ρ/(1 − ρ)². Before roulette starts its terms are certain, so it has less.
#[test]
fn roulette_keeps_mean_and_variance() {
    for albedo in [0.5f32, 0.9, 0.99] {
        let rho = f64::from(albedo);
        let settings = Settings {
            strategy: Strategy::BsdfOnly,
            ..settings(16, count(1024, 16_384))
        };
        let Some(r) = render(&glowing_room(albedo), &settings, Tuning::default()) else {
            return;
        };
        let truth = 1.0 / (1.0 - rho);
        let seen = Estimate::of_image(&r.film);
        let (off, bound) = seen.off(truth);
        let variance = seen.error.powi(2) * r.report.paths as f64;
        let share = variance * (1.0 - rho).powi(2) / rho;
        println!(
            "albedo {albedo}: off by {off:.1e} ± {bound:.1e}, variance × {share:.3} of the geometric law's"
        );
        assert!(off + bound <= 3e-2, "{albedo}");
        assert!(share <= 1.2, "{albedo}: {share}");
    }
}

/// A mirror and a pane before a lamp: light samples can not meet them, so that the strategies are one.
#[test]
fn smooth_surfaces_leave_nothing_to_light_samples() {
    for (name, material) in [
        ("mirror", metal(1.0, 0.0)),
        ("glass", glass(1.5, Medium::default())),
    ] {
        let picture = |strategy| {
            let mut scene = empty();
            let mesh = match name {
                "mirror" => square(Vec3::ZERO, Vec3::Z, 2.0),
                _ => crate::solids::block(Vec3::new(-2.0, -2.0, -0.2), Vec3::new(2.0, 2.0, 0.0)),
            };
            add(&mut scene, mesh, material.clone());
            for z in [-3.0, 3.0] {
                let lamp = square(Vec3::new(0.5, 0.0, z), Vec3::new(0.0, 0.0, -z), 0.7);
                add(&mut scene, lamp, emitter(0.0, 4.0));
            }
            scene.cameras = vec![pinhole(DVec3::new(2.0, 0.0, 2.5), DVec3::ZERO, 50.0)];
            let settings = Settings {
                strategy,
                ..settings(32, 64)
            };
            render(&scene, &settings, Tuning::default())
        };
        let Some(with) = picture(Strategy::Mis) else {
            return;
        };
        let without = picture(Strategy::BsdfOnly).unwrap();
        let off = crate::support::largest_difference(&with.film, &without.film);
        println!(
            "{name}: strategies differ by {off:.1e}, mean {:.3}",
            mean_of(&with.film)
        );
        assert!(mean_of(&with.film) > 0.1);
        assert!(off <= 1e-6, "{name}: {off}");
    }
}

/// A receiver under a square of radiance 1/size²: E is that of a point as soon as the lamp is small.
#[test]
fn tiny_lamps_keep_their_power() {
    let truth = 0.5 / std::f64::consts::PI;
    for power in [-8, -6, -4, -2] {
        let size = 10f32.powi(power);
        let mut scene = empty();
        add(&mut scene, square(Vec3::ZERO, Vec3::Z, 5.0), lambert(0.5));
        let lamp = square(Vec3::Z, Vec3::NEG_Z, 0.5 * size);
        add(&mut scene, lamp, emitter(0.0, 1.0 / (size * size)));
        let from = DVec3::new(0.0, 2.0, 0.5);
        scene.cameras = vec![pinhole(from, DVec3::ZERO, 1e-3)];
        let Some(r) = render(&scene, &settings(8, 64), Tuning::default()) else {
            return;
        };
        let off = (mean_of(&r.film) / truth - 1.0).abs();
        println!("lamp of {size:e} m: off by {off:.1e}");
        assert!(off <= 1e-3, "{size}: {}", mean_of(&r.film));
    }
}

/// The camera looks at a point that is part of the lamp; and at one that the lamp touches.
#[test]
fn points_on_a_lamp_are_finite() {
    for albedo in [0.0, 0.8] {
        let mut scene = empty();
        add(
            &mut scene,
            square(Vec3::ZERO, Vec3::Z, 1.0),
            emitter(albedo, 2.0),
        );
        let lamp = quad([[0., 0., 0.], [0., 1., 0.], [0., 1., 1.], [0., 0., 1.]].map(Vec3::from));
        add(&mut scene, lamp, emitter(albedo, 2.0));
        scene.cameras = vec![pinhole(DVec3::new(2.0, -1.0, 1.0), DVec3::ZERO, 0.01)];
        let Some(r) = render(&scene, &settings(16, 1024), Tuning::default()) else {
            return;
        };
        let (low, high) = r
            .film
            .mean()
            .iter()
            .flatten()
            .fold((f32::MAX, 0.0f32), |(l, h), v| (l.min(*v), h.max(*v)));
        println!("albedo {albedo}: pixels {low} … {high}");
        // Two faces of a corner that reflect 0.8: less than 2/(1 − 0.8).
        assert!(low >= 1.9 && high <= 10.0, "{low} … {high}");
    }
}

/// A map of 1 everywhere lights a plane with π from every side, its poles and its seam.
#[test]
fn uniform_maps_have_no_poles() {
    for backend in pair() {
        for normal in [Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z] {
            let mut scene = empty();
            add(&mut scene, square(Vec3::ZERO, normal, 5.0), lambert(0.5));
            scene.environment = Some(Environment::Map {
                width: 8,
                height: 4,
                texels: Arc::new(vec![[1.0; 3]; 32]),
                intensity: 1.0,
                rotation: 0.3,
            });
            let from = normal.as_dvec3() * 2.0;
            scene.cameras = vec![pinhole(from, DVec3::ZERO, 1.0)];
            let settings = Settings {
                backend,
                ..settings(16, count(256, 65_536))
            };
            let Some(r) = render(&scene, &settings, Tuning::default()) else {
                return;
            };
            let seen = Estimate::of_image(&r.film);
            let (mean, (off, bound)) = (seen.mean, seen.off(0.5));
            println!("{backend:?}, towards {normal}: off by {off:.1e} ± {bound:.1e}");
            assert!(
                off + bound <= count(20, 2) as f64 * 1e-3,
                "{backend:?}, {normal}: {mean}"
            );
        }
    }
}

/// Lamps in a lattice on the ceiling, every other one dark; their light is that of one lamp of the same shape.
#[test]
fn many_lamps_half_of_them_dark() {
    let side = if crate::tier::is_night() { 316 } else { 100 };
    let mut scene = empty();
    add(&mut scene, square(Vec3::ZERO, Vec3::Z, 50.0), lambert(0.5));
    let cell = 2.0 / side as f32;
    let lamp = square(Vec3::ZERO, Vec3::NEG_Z, 0.5 * cell);
    for (name, radiance) in [("bright", 10.0), ("dark", 0.0)] {
        let mut mesh = lamp.clone();
        mesh.name = name.into();
        mesh.material = scene.materials.len() as u32;
        scene.materials.push(emitter(0.0, radiance));
        scene.meshes.push(mesh);
    }
    for i in 0..side * side {
        let (x, y) = (i % side, i / side);
        let at = Vec3::new(x as f32 + 0.5, y as f32 + 0.5, 0.0) * cell - Vec3::new(1.0, 1.0, -1.0);
        scene.instances.push(etendue::scene::Instance {
            name: String::new(),
            mesh: 1 + (x + y) as u32 % 2,
            world_from_object: DAffine3::from_translation(at.as_dvec3()),
        });
    }
    let from = DVec3::new(0.0, 2.0, 0.5);
    scene.cameras = vec![pinhole(from, DVec3::ZERO, 0.1)];
    let Some(many) = render(&scene, &settings(16, count(256, 4096)), Tuning::default()) else {
        return;
    };
    let mut one = empty();
    add(&mut one, square(Vec3::ZERO, Vec3::Z, 50.0), lambert(0.5));
    add(
        &mut one,
        square(Vec3::Z, Vec3::NEG_Z, 1.0),
        emitter(0.0, 5.0),
    );
    one.cameras = scene.cameras;
    let one = render(&one, &settings(16, count(256, 4096)), Tuning::default()).unwrap();
    let [a, b] = [&one, &many].map(|r| Estimate::of_image(&r.film));
    let (off, bound) = b.off_from(a);
    println!(
        "{} lamps, half of them dark: off by {off:.1e} ± {bound:.1e}",
        side * side
    );
    assert!(off + bound <= 3e-2, "{b:?} instead of {a:?}");
}

#[test]
fn without_light_it_is_dark() {
    let black_map = Environment::Map {
        width: 4,
        height: 2,
        texels: Arc::new(vec![[0.0; 3]; 8]),
        intensity: 1.0,
        rotation: 0.0,
    };
    for environment in [None, constant_sky(0.0), Some(black_map)] {
        let mut scene = empty();
        add(&mut scene, room(1.0), lambert(0.5));
        add(&mut scene, faceted(sphere(1)), emitter(0.5, 0.0));
        scene.environment = environment;
        scene.cameras = vec![pinhole(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 40.0)];
        let Some(r) = render(&scene, &settings(8, 16), Tuning::default()) else {
            return;
        };
        assert!(r.film.mean().iter().flatten().all(|v| *v == 0.0));
    }
    println!("3 dark scenes: every pixel is 0");
}

/// A smooth ball of flat triangles lit from the side: the error of faceting falls with their size.
#[test]
fn terminators_converge_with_the_triangles() {
    let picture = |levels: u32| {
        let mut scene = empty();
        add(&mut scene, sphere(levels), lambert(1.0));
        scene.lights.push(etendue::scene::PunctualLight {
            name: String::new(),
            kind: etendue::scene::LightKind::Directional,
            position: DVec3::ZERO,
            direction: Vec3::new(-1.0, 0.0, -0.2).normalize(),
            intensity: Vec3::ONE,
        });
        scene.cameras = vec![parallel(DVec3::Z * 5.0, DVec3::ZERO, 1.0)];
        let settings = Settings {
            max_depth: 1,
            ..settings(32, 256)
        };
        render(&scene, &settings, Tuning::default())
    };
    // Of the unit ball: n · l over π where positive, by the midpoint rule at many points of each pixel.
    let light = DVec3::new(1.0, 0.0, 0.2).normalize();
    let truth = |x: usize, y: usize| {
        let at = |i: usize, k: usize| ((i * 16 + k) as f64 + 0.5) / 256.0 - 1.0;
        let mut sum = 0.0;
        for k in 0..256 {
            // The picture's right is +y, up is −x.
            let (px, py) = (at(y, k / 16), at(x, k % 16));
            let z2 = 1.0 - px * px - py * py;
            if z2 > 0.0 {
                sum += light.dot(DVec3::new(px, py, z2.sqrt())).max(0.0);
            }
        }
        sum / 256.0 / std::f64::consts::PI
    };
    let truth: Vec<f64> = (0..1024).map(|i| truth(i % 32, i / 32)).collect();
    // The rim of the ball is chance.
    let is_inner = |i: usize| {
        let at = |i: usize| (i as f64 + 0.5) / 16.0 - 1.0;
        at(i % 32).hypot(at(i / 32)) < 0.9
    };
    let mut errors = Vec::new();
    for levels in [2, 3, 4, 5] {
        let Some(r) = picture(levels) else { return };
        let off: f64 = r
            .film
            .mean()
            .iter()
            .zip(&truth)
            .enumerate()
            .filter(|(i, _)| is_inner(*i))
            .map(|(_, (m, t))| (f64::from(m[0]) - t).abs())
            .sum::<f64>()
            / truth.iter().sum::<f64>();
        println!("{} triangles: off by {off:.1e}", 8 * 4u32.pow(levels));
        errors.push(off);
    }
    // Of first order or better, until what chance leaves within pixels.
    let is_falling = errors.windows(2).all(|e| e[1] < 0.6 * e[0] || e[1] < 3e-3);
    assert!(is_falling && errors[3] < 5e-3, "{errors:?}");
}

/// A lamp in the plane of a nearly smooth metal: densities from 0 to 1e12.
#[test]
fn narrow_lobes_and_grazing_lamps_agree() {
    let faces = [
        ("towards", Vec3::NEG_X, 1024, 5e-3),
        ("edge-on to", Vec3::Y, count(8192, 65_536), 2e-2),
    ];
    let cases = [0.04f32, 0.1, 0.3].map(|r| faces.map(|face| (r, face)));
    for (roughness, (what, face, samples, delta)) in cases.into_iter().flatten() {
        let mut means = Vec::new();
        for strategy in [Strategy::Mis, Strategy::BsdfOnly] {
            let mut scene = empty();
            add(
                &mut scene,
                square(Vec3::ZERO, Vec3::Z, 3.0),
                metal(0.9, roughness),
            );
            let axis = if face == Vec3::Y { DVec3::Z } else { DVec3::Y };
            let tilt = DMat3::from_quat(DQuat::from_axis_angle(axis, 0.02));
            let mut lamp = square(Vec3::ZERO, face, 0.3);
            for p in &mut lamp.positions {
                *p = (tilt * p.as_dvec3()).as_vec3() + Vec3::new(1.5, 0.0, 0.3);
            }
            add(&mut scene, lamp, emitter(0.0, 5.0));
            scene.cameras = vec![pinhole(DVec3::new(-2.0, 0.0, 0.15), DVec3::ZERO, 6.0)];
            let settings = Settings {
                strategy,
                max_depth: 2,
                ..settings(16, samples)
            };
            let Some(r) = render(&scene, &settings, Tuning::default()) else {
                return;
            };
            means.push(Estimate::of_image(&r.film));
        }
        let [a, b] = means[..] else { unreachable!() };
        let (off, bound) = b.off_from(a);
        println!(
            "roughness {roughness}, {what} the metal: strategies differ by {off:.1e} ± {bound:.1e}"
        );
        assert!(off + bound <= delta, "{roughness}, {what}: {a:?} and {b:?}");
    }
}
