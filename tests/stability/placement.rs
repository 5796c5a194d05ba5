//! Instances, mirrors, stretched lamps, cameras far away, long ways.

use std::sync::Arc;

use etendue::layout::NONE;
use etendue::render::Tuning;
use etendue::scene::{Environment, Material, Medium, Phase, Scene};
use etendue::settings::{BackendChoice, Settings};
use glam::{DAffine3, DQuat, DVec3, Vec3};

use crate::common::*;
use crate::solids::{block, glass, grey};
use crate::support::{Estimate, Random, largest_difference, mean_of, open, pair, ray};
use crate::tier::{count, is_night};

/// Keeps groups of their own for meshes that are placed twice.
fn two_levels() -> Tuning {
    Tuning {
        copy_limit: 0,
        ..Tuning::default()
    }
}

/// Two squares, each an instance under its own rotation, meet in an edge.
#[test]
fn edges_between_instances_leak_little() {
    const RAYS: usize = 100_000;
    let mut random = Random(6);
    let mut scene = empty();
    let place = |degrees: f64| DAffine3::from_rotation_y(degrees.to_radians());
    // The edge is the y axis, from −1 to 1.
    let half = quad([[0., -1.], [1., -1.], [1., 1.], [0., 1.]].map(|[x, y]| Vec3::new(x, y, 0.0)));
    add_at(&mut scene, half, lambert(0.5), place(-20.0));
    let mut other = scene.instances[0].clone();
    other.world_from_object = place(200.0);
    scene.instances.push(other);
    scene.cameras = vec![pinhole(DVec3::Z, DVec3::ZERO, 40.0)];
    let rays: Vec<_> = (0..RAYS)
        .map(|_| {
            let from = random.cube() * DVec3::new(0.2, 0.5, 0.2) + DVec3::Z * 2.0;
            let at = DVec3::new(0.0, 1.8 * random.unit() - 0.9, 0.0);
            ray(from.as_vec3(), (at - from).normalize().as_vec3())
        })
        .collect();
    for backend in pair() {
        let settings = Settings {
            backend,
            ..settings(8, 1)
        };
        let Some(renderer) = open(&scene, &settings, two_levels()) else {
            return;
        };
        let hits = renderer.unwrap().probe(&rays).unwrap();
        let lost = hits.iter().filter(|h| h.primitive == NONE).count();
        println!("{backend:?}: {lost} of {RAYS} rays pass between the instances");
        // Rounded rays are beside the edge by 1e-7: half of those that both miss would be 0.25 at worst.
        assert!(lost < RAYS / 2, "{backend:?}: {lost}");
    }
}

/// A wedge of absorbing glass and its mirror image, by a mesh and by an instance.
#[test]
fn mirrored_glass_is_glass() {
    for backend in pair() {
        let picture = |mirror: f64, tuning: Tuning| {
            let medium = grey(2.0, 0.0, Phase::Isotropic);
            let mut scene = empty();
            let wedge = {
                let mut mesh = block(Vec3::new(-0.5, -0.5, -0.2), Vec3::new(0.5, 0.5, 0.2));
                for p in &mut mesh.positions {
                    p.z *= 1.0 + 0.5 * p.x;
                }
                mesh
            };
            let place = DAffine3::from_scale(DVec3::new(mirror, 1.0, 1.0));
            add_at(&mut scene, wedge, glass(1.5, medium), place);
            let mut far = scene.instances[0].clone();
            far.world_from_object.translation = DVec3::new(0.0, 0.0, 50.0);
            scene.instances.push(far);
            scene.environment = constant_sky(1.0);
            let eye = DVec3::new(0.4 * mirror, 0.3, -3.0);
            scene.cameras = vec![pinhole(eye, DVec3::ZERO, 25.0)];
            let settings = Settings {
                backend,
                ..settings(32, 1024)
            };
            render(&scene, &settings, tuning)
        };
        let Some(plain) = picture(1.0, Tuning::default()) else {
            return;
        };
        for (how, tuning) in [("copied", Tuning::default()), ("placed", two_levels())] {
            let mirrored = picture(-1.0, tuning).unwrap();
            let [a, b] = [&plain, &mirrored].map(|r| Estimate::of_image(&r.film));
            let (off, bound) = b.off_from(a);
            let (a, b) = (a.mean, b.mean);
            println!("{backend:?}, {how}: {b:.5}, unmirrored {a:.5}, off {off:.1e} ± {bound:.1e}");
            assert!(
                off + bound <= 5e-3,
                "{backend:?}, {how}: {b} instead of {a}"
            );
        }
    }
}

/// A lamp that is a ball, stretched and turned by its instance, against the same mesh transformed before.
#[test]
fn stretched_lamps_are_what_they_look_like() {
    let stretch = DAffine3::from_scale_rotation_translation(
        DVec3::new(1.5, 0.2, 0.7),
        DQuat::from_rotation_z(0.7),
        DVec3::new(0.3, 2.0, 0.1),
    );
    let room = || {
        let mut scene = empty();
        add(&mut scene, square(Vec3::ZERO, Vec3::Y, 3.0), lambert(0.5));
        // Only the floor below the lamp is looked at, from the side of it.
        scene.cameras = vec![pinhole(DVec3::new(3.0, 1.0, 0.0), DVec3::ZERO, 20.0)];
        scene
    };
    for backend in pair() {
        let settings = Settings {
            backend,
            ..settings(16, count(8192, 262_144))
        };
        let mut placed = room();
        add_at(&mut placed, faceted(sphere(2)), emitter(0.0, 5.0), stretch);
        let mut copy = placed.instances[1].clone();
        copy.world_from_object.translation = DVec3::new(0.0, -50.0, 0.0);
        placed.instances.push(copy);
        let Some(placed) = render(&placed, &settings, two_levels()) else {
            return;
        };
        let mut baked = room();
        let mut mesh = faceted(sphere(2));
        for p in &mut mesh.positions {
            *p = stretch.transform_point3(p.as_dvec3()).as_vec3();
        }
        add(&mut baked, mesh, emitter(0.0, 5.0));
        let baked = render(&baked, &settings, Tuning::default()).unwrap();
        let [a, b] = [&baked, &placed].map(|r| Estimate::of_image(&r.film));
        let (off, bound) = b.off_from(a);
        let (a, b) = (a.mean, b.mean);
        println!("{backend:?}: {b:.5}, transformed before {a:.5}, off {off:.1e} ± {bound:.1e}");
        let delta = if is_night() { 3e-3 } else { 1.5e-2 };
        assert!(off + bound <= delta, "{backend:?}: {b} instead of {a}");
    }
}

/// A telephoto picture of a ball from far away is that of parallel rays.
#[test]
fn distant_cameras_see_what_parallel_rays_see() {
    let mut offs = Vec::new();
    for power in [2, 4, 5, 6, 7, 8] {
        let distance = 10f64.powi(power);
        let mut scene = empty();
        add(&mut scene, faceted(sphere(3)), emitter(0.0, 1.0));
        let from = DVec3::new(0.36, 0.48, 0.8) * distance;
        let degrees = 2.0 * (1.2 / distance).atan().to_degrees();
        scene.cameras = vec![
            pinhole(from, DVec3::ZERO, degrees as f32),
            parallel(from / distance * 10.0, DVec3::ZERO, 1.2),
        ];
        let picture = |camera| {
            let settings = Settings {
                camera: Some(camera),
                ..settings(32, 64)
            };
            render(&scene, &settings, Tuning::default())
        };
        let Some(near) = picture(1) else { return };
        let far = picture(0).unwrap();
        let (a, b) = (mean_of(&near.film), mean_of(&far.film));
        let off = (b / a - 1.0).abs();
        println!("10^{power} radii away: off by {off:.1e}");
        offs.push(off);
    }
    // At 100 radii perspective hides 1e-4 of the ball's rim; to 10⁵ the direction of a ray has 1e-7 of 1e-5.
    assert!(offs[..3].iter().all(|o| *o <= 1e-2), "{offs:?}");
}

/// The sky's radiance is 1.5 + cos of the angle from its pole.
fn sloped_sky() -> Option<Environment> {
    const HEIGHT: usize = 64;
    let row = |y: usize| 1.5 + (std::f64::consts::PI * (y as f64 + 0.5) / HEIGHT as f64).cos();
    let texels = (0..2 * HEIGHT).map(|i| [row(i / 2) as f32; 3]).collect();
    Some(Environment::Map {
        width: 2,
        height: HEIGHT as u32,
        texels: Arc::new(texels),
        intensity: 1.0,
        rotation: 0.0,
    })
}

/// Between two parallel mirrors a path comes out as it went in: thousands of times mirrored, it still points there.
#[test]
fn directions_survive_many_mirrors() {
    let turn = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 0.9);
    let mirror = Material {
        metallic: 1.0,
        ..metal(1.0, 0.0)
    };
    let picture = |length: f64| -> Option<(Estimate, f64)> {
        let mut scene: Scene = empty();
        for side in [-1.0, 1.0] {
            let mut plane = quad(
                [[0.0, -1.0], [1.0, -1.0], [1.0, 1.0], [0.0, 1.0]]
                    .map(|[x, y]| Vec3::new(x * length as f32, y * length as f32, 0.0)),
            );
            plane.name = format!("mirror {side}");
            let place = DAffine3::from_quat(turn) * DAffine3::from_translation(DVec3::Z * side);
            add_at(&mut scene, plane, mirror.clone(), place);
        }
        scene.environment = sloped_sky();
        // 45° to the mirrors: one meeting for each two metres.
        let direction = turn * DVec3::new(1.0, 0.0, 1.0).normalize();
        let from = turn * DVec3::new(1e-3, 0.0, 0.0);
        scene.cameras = vec![pinhole(from, from + direction, 1e-3)];
        let settings = Settings {
            max_depth: 1_000_000,
            ..settings(8, 64)
        };
        let r = render(&scene, &settings, Tuning::default())?;
        let rays = r.report.rays as f64 / r.report.paths as f64;
        Some((Estimate::of_image(&r.film), rays))
    };
    // Four meetings, and many times four. Beyond 256 roulette thins the paths, and chance comes in.
    let Some((few, _)) = picture(8.0) else {
        return;
    };
    for (length, delta) in [(80.0, 1e-5), (500.0, 1e-5), (1000.0, 0.2)] {
        let (many, rays) = picture(length).unwrap();
        let (off, bound) = many.off(few.mean);
        println!("{length:.0} mirrors, {rays:.0} rays a path: off by {off:.1e} ± {bound:.1e}");
        assert!(off + bound <= delta, "{many:?} instead of {few:?}");
    }
}

/// The face of a lamp in the plane of the receiver and tilted out of it: light goes to 0 without a jump.
#[test]
fn lamps_seen_edge_on_fade_to_nothing() {
    let mut before = f64::INFINITY;
    for degrees in [0.0, 60.0, 85.0, 89.0, 89.9, 89.99, 89.999, 90.0, 90.01] {
        let (sin, cos) = f64::to_radians(degrees).sin_cos();
        let mut scene = empty();
        add(&mut scene, square(Vec3::ZERO, Vec3::Z, 5.0), lambert(0.5));
        let normal = DVec3::new(sin, 0.0, -cos).as_vec3();
        add(
            &mut scene,
            square(Vec3::new(0.0, 0.0, 2.0), normal, 0.1),
            emitter(0.0, 100.0),
        );
        let from = DVec3::new(0.0, 3.0, 1.0);
        scene.cameras = vec![pinhole(from, DVec3::ZERO, 0.01)];
        let settings = Settings {
            backend: BackendChoice::Bvh,
            ..settings(8, 256)
        };
        let Some(r) = render(&scene, &settings, Tuning::default()) else {
            return;
        };
        let mean = mean_of(&r.film);
        println!("{degrees}°: {mean:.3e}");
        assert!(mean.is_finite() && mean <= before, "{degrees}°: {mean}");
        before = mean;
    }
    // Turned by 90°, it still shows its face to what lies 0.003° beside; beyond, to nothing.
    assert!(before == 0.0, "{before}");
}

/// Solids that fill the same place: more than can be told apart are counted.
#[test]
fn too_many_solids_in_one_place_are_counted() {
    let mut scene = empty();
    for i in 0..12 {
        let half = Vec3::splat(1.0 + 0.1 * i as f32);
        add(
            &mut scene,
            block(-half, half),
            glass(1.0, Medium::default()),
        );
    }
    scene.environment = constant_sky(1.0);
    scene.cameras = vec![pinhole(DVec3::new(1.0, 2.0, 9.0), DVec3::ZERO, 10.0)];
    let Some(r) = render(&scene, &settings(16, 16), Tuning::default()) else {
        return;
    };
    let counted = r.report.ledger.interior_overflows;
    let mean = mean_of(&r.film);
    println!("12 solids in each other: {counted} boundaries counted as missed, mean {mean}");
    assert!(counted > 0);
    assert!((mean - 1.0).abs() < 1e-5, "{mean}");
}

/// Glass of index 1 is not there, whatever is behind it.
#[test]
fn glass_of_index_one_is_invisible() {
    for backend in pair() {
        let picture = |has_block: bool| {
            let mut scene = empty();
            if has_block {
                let half = Vec3::splat(0.5);
                add(
                    &mut scene,
                    block(-half, half),
                    glass(1.0, Medium::default()),
                );
            }
            add(
                &mut scene,
                square(Vec3::new(0.0, 0.0, -2.0), Vec3::Z, 0.7),
                emitter(0.0, 3.0),
            );
            scene.environment = sloped_sky();
            scene.cameras = vec![pinhole(DVec3::new(0.2, 0.1, 4.0), DVec3::ZERO, 30.0)];
            let settings = Settings {
                backend,
                ..settings(32, 16)
            };
            render(&scene, &settings, Tuning::default())
        };
        let Some(with) = picture(true) else { return };
        let without = picture(false).unwrap();
        let off = largest_difference(&with.film, &without.film);
        println!("{backend:?}: pictures differ by {off:.1e}");
        assert!(off <= 1e-6, "{backend:?}: {off}");
    }
}
