//! A scene that is scaled or moved shows the same picture, and no ray meets the surface that it leaves.

use etendue::film::Film;
use etendue::render::Tuning;
use etendue::scene::{LightKind, Medium, Mesh, Phase, PunctualLight, Scene};
use etendue::settings::{BackendChoice, Settings, Strategy};
use glam::{DAffine3, DMat3, DQuat, DVec3, Vec3};

use crate::common::*;
use crate::solids::{block, glass, grey};
use crate::support::{Random, largest_difference, mean_of, pair};
use crate::tier::count;

/// The camera stands in a glass cube, within the cone of light that gets out.
fn cube() -> Scene {
    let mut scene = empty();
    add(
        &mut scene,
        block(Vec3::NEG_ONE, Vec3::ONE),
        glass(1.5, Medium::default()),
    );
    let from = DVec3::new(0.1, 0.2, 0.3);
    scene.cameras = vec![pinhole(from, from + DVec3::Z, 40.0)];
    scene.environment = constant_sky(1.0);
    scene
}

/// A mesh of a material in a white world, seen whole.
fn in_white(mesh: Mesh, material: etendue::scene::Material) -> Scene {
    let mut scene = empty();
    add(&mut scene, mesh, material);
    scene.environment = constant_sky(1.0);
    scene.cameras = vec![pinhole(DVec3::new(1.5, 1.0, 3.0), DVec3::ZERO, 40.0)];
    scene
}

/// A plate of glass that absorbs, seen at 60°.
fn slab() -> Scene {
    let plate = block(Vec3::new(-20.0, -20.0, -0.25), Vec3::new(20.0, 20.0, 0.0));
    let mut scene = in_white(plate, glass(1.5, grey(2.0, 0.0, Phase::Isotropic)));
    let (sin, cos) = 60f64.to_radians().sin_cos();
    scene.cameras = vec![parallel(10.0 * DVec3::new(sin, 0.0, cos), DVec3::ZERO, 0.1)];
    scene
}

/// Coefficients of its media follow the size of a scene.
fn carried_with_media(scene: &Scene, scale: f64, offset: DVec3) -> Scene {
    let mut scene = carried(scene.clone(), scale, offset);
    for material in &mut scene.materials {
        if let Some(volume) = &mut material.volume {
            volume.medium.absorption /= scale as f32;
            volume.medium.scattering /= scale as f32;
        }
    }
    scene
}

#[test]
fn pictures_do_not_depend_on_scale_and_place() {
    let cloud = grey(0.0, 4.0, Phase::Rayleigh);
    let half = Vec3::splat(0.8);
    let scenes = [
        ("cube", cube()),
        ("furnace", in_white(faceted(sphere(3)), lambert(0.5))),
        ("plate", slab()),
        (
            "white cloud in glass",
            in_white(block(-half, half), glass(1.5, cloud)),
        ),
    ];
    let step = count(6, 1) as usize;
    let mut places: Vec<(f64, f64)> = (-6..=6)
        .step_by(step)
        .map(|k| (10f64.powi(k), 0.0))
        .collect();
    places.push((1.0, 1e6));
    places.push((1e-6, 1e6));
    for backend in pair() {
        for (name, scene) in &scenes {
            let mut worst = 0.0f64;
            let mut first: Option<Film> = None;
            for &(scale, offset) in &places {
                let scene = carried_with_media(scene, scale, offset * DVec3::new(1.0, -1.0, 0.5));
                let settings = Settings {
                    backend,
                    ..settings(16, 16)
                };
                let Some(r) = render(&scene, &settings, Tuning::default()) else {
                    return;
                };
                let off = first
                    .as_ref()
                    .map_or(0.0, |f| largest_difference(&r.film, f));
                if off > 1e-5 {
                    println!("{backend:?}, {name} × {scale:e} + {offset:e}: off by {off:.1e}");
                }
                worst = worst.max(off);
                first.get_or_insert(r.film);
            }
            println!("{backend:?}, {name}: largest deviation {worst:.1e}");
            assert!(worst <= 1e-5, "{backend:?}, {name}: {worst}");
        }
    }
}

/// A convex solid: a ball squeezed by up to a hundred along random axes, of half width `size`.
fn random_solid(random: &mut Random, size: f64) -> Mesh {
    let mut mesh = faceted(sphere(2));
    let axis = random.cube().normalize_or(DVec3::X);
    let turn = DMat3::from_quat(DQuat::from_axis_angle(axis, random.unit() * 6.0));
    let squeeze = DVec3::from([(); 3].map(|()| 10f64.powf(-2.0 * random.unit())));
    let shape = turn * DMat3::from_diagonal(squeeze * size);
    for p in &mut mesh.positions {
        *p = (shape * p.as_dvec3()).as_vec3();
    }
    mesh
}

/// In a white world a grey convex solid shows its albedo; a ray that meets its own start shows less. Fronts glow, so that
/// a camera's ray which saw the far face of an edge, that it met within rounding of the near one, is told apart: it lacks the glow.
/// Half of the solids are instances that are not copied, up to 10⁵ times their size from the origin, which the
/// other instance holds where it is.
#[test]
fn rays_leave_random_solids_of_all_scales() {
    const ALBEDO: f32 = 0.5;
    const GLOW: f32 = 8.0;
    for backend in pair() {
        let mut random = Random(2026);
        let (mut left, mut met, mut far_faces) = (0u64, 0.0f64, 0.0f64);
        let samples = count(256, 8192);
        for round in 0..count(1, 4) {
            for k in -6..=6 {
                let size = 10f64.powi(k);
                let mesh = random_solid(&mut random, size);
                let is_held = (i64::from(k) + round as i64) % 2 == 0;
                let far = random.cube() * size * 10f64.powf(5.0 * random.unit());
                let holder = random.cube().normalize() * -1e5 * size;
                let mut scene = empty();
                let at = if is_held { far } else { DVec3::ZERO };
                add_at(
                    &mut scene,
                    mesh,
                    emitter(ALBEDO, GLOW),
                    DAffine3::from_translation(at),
                );
                if is_held {
                    let mut other = scene.instances[0].clone();
                    other.world_from_object.translation = holder;
                    scene.instances.push(other);
                }
                scene.environment = constant_sky(1.0);
                let eye = at + DVec3::new(2.0, 2.5, 3.0) * size;
                scene.cameras = vec![pinhole(eye, at, 25.0)];
                let settings = Settings {
                    backend,
                    strategy: Strategy::BsdfOnly,
                    aovs: true,
                    seed: 3 + round,
                    ..settings(32, samples)
                };
                let tuning = Tuning {
                    copy_limit: 0,
                    ..Tuning::default()
                };
                let Some(r) = render(&scene, &settings, tuning) else {
                    return;
                };
                let coverage = r.film.coverage().unwrap();
                for (mean, hit) in r.film.mean().iter().zip(coverage) {
                    let expected = f64::from(1.0 + (GLOW + ALBEDO - 1.0) * hit);
                    let lack = (expected - f64::from(mean[0])).abs() * samples as f64;
                    left += (f64::from(hit) * samples as f64).round() as u64;
                    // A second meeting takes half of what the world brought, or more; a far face takes half of the glow, or all.
                    if lack > 0.4 * f64::from(GLOW) {
                        far_faces += (lack / f64::from(GLOW + ALBEDO)).ceil();
                    } else if lack > 0.1 {
                        met += (lack / 0.25).ceil();
                    }
                }
            }
        }
        println!(
            "{backend:?}: {left} rays left, {met} met their surface again; {far_faces} rays of cameras saw the far face of an edge"
        );
        assert!(
            far_faces <= 1e-6 * left as f64 + 1.0,
            "{backend:?}: {far_faces}"
        );
        let rate = met / left as f64;
        // Our own tree: none. What a driver computes is not ours to bound.
        let most = if backend == BackendChoice::Bvh {
            0.0
        } else {
            1e-5
        };
        assert!(rate <= most, "{backend:?}: {met} of {left}");
        assert!(left >= count(100_000, 10_000_000));
    }
}

/// Along a plane at 89.9° the origin of the next ray must be above it.
#[test]
fn planes_at_grazing_keep_their_albedo() {
    for backend in pair() {
        for (scale, albedo) in [(1e-6, 0.5), (1e6, 0.5), (1e-6, 1.0), (1e6, 1.0)] {
            let mut scene = in_white(square(Vec3::ZERO, Vec3::Z, 1e3), lambert(albedo));
            let (sin, cos) = 89.9f64.to_radians().sin_cos();
            scene.cameras = vec![parallel(
                100.0 * DVec3::new(sin, 0.0, cos),
                DVec3::ZERO,
                0.1,
            )];
            let scene = carried(scene, scale, DVec3::ZERO);
            let settings = Settings {
                backend,
                strategy: Strategy::BsdfOnly,
                ..settings(16, 1024)
            };
            let Some(r) = render(&scene, &settings, Tuning::default()) else {
                return;
            };
            let off = (mean_of(&r.film) / f64::from(albedo) - 1.0).abs();
            println!("{backend:?}, albedo {albedo}, × {scale:e}: off by {off:.1e}");
            assert!(off <= 1e-6, "{backend:?}, {albedo}, × {scale}: {off}");
        }
    }
}

/// Along the diagonals of a glass cube no light gets in or out: a path bounces until roulette ends it, hundreds of
/// times, and is dark. One that a face let through without refraction would bring light.
#[test]
fn paths_in_glass_keep_their_side() {
    for backend in pair() {
        let mut scene = cube();
        let from = DVec3::new(0.1, 0.2, 0.3);
        scene.cameras = vec![pinhole(from, from + DVec3::new(1.0, 1.0, -1.0), 14.0)];
        let settings = Settings {
            backend,
            ..settings(16, count(16, 1024))
        };
        let Some(r) = render(&scene, &settings, Tuning::default()) else {
            return;
        };
        let (paths, rays) = (r.report.paths, r.report.rays);
        let lit = r.film.mean().iter().filter(|m| m[0] != 0.0).count();
        println!("{backend:?}: {paths} paths, {rays} rays, {lit} pixels saw light");
        assert_eq!(lit, 0, "{backend:?}");
        assert!(rays >= count(1_000_000, 100_000_000));
    }
}

/// A closed white room is black inside whatever shines outside: no place on a wall is beyond the next wall. A sample that
/// leaked would bring the sun or the sky. Rays within a millionth of edges and corners would leak first.
#[test]
fn closed_rooms_are_dark_under_a_sun() {
    let mut scene = empty();
    add(&mut scene, room(1.0), lambert(0.95));
    scene.lights.push(PunctualLight {
        name: String::new(),
        kind: LightKind::Directional,
        position: DVec3::ZERO,
        direction: Vec3::new(-0.3, -0.8, -0.5).normalize(),
        intensity: Vec3::splat(1e6),
    });
    scene.environment = constant_sky(1.0);
    let eye = DVec3::new(0.1, 0.2, 0.3);
    let edge = DVec3::new(-1.0, 0.4, 1.0);
    let corner = DVec3::new(-1.0, -1.0, 1.0);
    for (what, camera, samples) in [
        ("room", pinhole(eye, edge, 90.0), count(64, 4096)),
        ("edge", parallel(eye, edge, 1e-6), count(16, 1024)),
        ("corner", parallel(eye, corner, 1e-6), count(16, 1024)),
    ] {
        scene.cameras = vec![camera];
        let Some(r) = render(&scene, &settings(32, samples), Tuning::default()) else {
            return;
        };
        let rays = r.report.rays;
        let lit = r.film.mean().iter().filter(|m| m[0] != 0.0).count();
        println!("{what}: {rays} rays in a closed room, {lit} pixels saw light");
        assert_eq!(lit, 0, "{what}");
        assert!(rays >= count(300_000, 20_000_000), "{what}: {rays}");
    }
}
