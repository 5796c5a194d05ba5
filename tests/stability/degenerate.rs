//! Triangles that are none, coordinates that are none, rays that are none.

use etendue::layout::{NONE, ProbeHit, ProbeRay};
use etendue::render::Tuning;
use etendue::scene::{Medium, Mesh, Phase};
use etendue::settings::Settings;
use glam::{DVec3, Vec3};

use crate::common::*;
use crate::solids::{block, glass, grey};
use crate::support::{Random, largest_difference, mean_of, open, pair, ray};

/// As many triangles without area as there are others, between them: corners that coincide or lie on a line.
fn with_degenerates(mut mesh: Mesh) -> Mesh {
    let triangles = std::mem::take(&mut mesh.triangles);
    for (i, [a, b, c]) in triangles.into_iter().enumerate() {
        let middle = mesh.positions.len() as u32;
        let half = 0.5 * (mesh.positions[a as usize] + mesh.positions[b as usize]);
        mesh.positions.push(half);
        mesh.triangles
            .push([[a, a, b], [c, c, c], [a, middle, b]][i % 3]);
        mesh.triangles.push([a, b, c]);
    }
    mesh
}

#[test]
fn triangles_without_area_change_nothing() {
    for backend in pair() {
        let picture = |mesh: Mesh| {
            let mut scene = empty();
            add(&mut scene, mesh, lambert(0.5));
            add(&mut scene, square(Vec3::NEG_Y, Vec3::Y, 3.0), lambert(0.5));
            scene.environment = constant_sky(1.0);
            scene.cameras = vec![pinhole(DVec3::new(2.0, 2.0, 3.0), DVec3::ZERO, 50.0)];
            let settings = Settings {
                backend,
                ..settings(32, 16)
            };
            render(&scene, &settings, Tuning::default())
        };
        let Some(plain) = picture(faceted(sphere(3))) else {
            return;
        };
        let other = picture(with_degenerates(faceted(sphere(3)))).unwrap();
        let off = largest_difference(&other.film, &plain.film);
        println!("{backend:?}: pictures differ by {off:.1e}");
        assert!(off == 0.0, "{backend:?}: {off}");
    }
}

/// An absorbing plate whose upper face is there twice.
#[test]
fn a_face_that_is_there_twice_keeps_its_parity() {
    for backend in pair() {
        let picture = |is_doubled: bool| {
            let medium = grey(2.0, 0.0, Phase::Isotropic);
            let mut plate = block(Vec3::new(-9.0, -9.0, -0.25), Vec3::new(9.0, 9.0, 0.0));
            if is_doubled {
                let top: Vec<_> = plate.triangles.clone();
                let is_top =
                    |t: &&[u32; 3]| t.iter().all(|v| plate.positions[*v as usize].z == 0.0);
                plate.triangles.extend(top.iter().filter(is_top));
            }
            let mut scene = empty();
            add(&mut scene, plate, glass(1.5, medium));
            let sky = square(Vec3::new(0.0, 0.0, -50.0), Vec3::Z, 4000.0);
            add(&mut scene, sky, emitter(0.0, 1.0));
            scene.cameras = vec![parallel(DVec3::new(6.0, 0.0, 8.0), DVec3::ZERO, 0.1)];
            let settings = Settings {
                backend,
                ..settings(32, 256)
            };
            render(&scene, &settings, Tuning::default())
        };
        let Some(once) = picture(false) else { return };
        let twice = picture(true).unwrap();
        let (a, b) = (mean_of(&once.film), mean_of(&twice.film));
        println!(
            "{backend:?}: transmits {a:.5}, with the face twice {b:.5}, off {:.1e}",
            (b / a - 1.0).abs()
        );
        assert!(
            (b / a - 1.0).abs() < 1e-2,
            "{backend:?}: {b} instead of {a}"
        );
    }
}

/// A vertex that is no number, or too far, is refused before anything is uploaded.
#[test]
fn vertices_that_are_no_numbers_are_refused() {
    let mut refused = 0;
    for backend in pair() {
        for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e38, -2e18] {
            for axis in 0..3 {
                let mut mesh = square(Vec3::ZERO, Vec3::Z, 1.0);
                mesh.positions[2][axis] = value;
                let mut scene = empty();
                add(&mut scene, mesh, lambert(0.5));
                scene.cameras = vec![pinhole(DVec3::Z * 3.0, DVec3::ZERO, 40.0)];
                let settings = Settings {
                    backend,
                    ..settings(8, 1)
                };
                match open(&scene, &settings, Tuning::default()) {
                    None => return,
                    Some(Err(_)) => refused += 1,
                    Some(Ok(_)) => println!("{backend:?}, {value} at {axis}: accepted"),
                }
            }
        }
    }
    println!("{refused} of 30 refused");
    assert_eq!(refused, 30);
}

/// What the rays meet in front of a unit square at z = 0, under validation.
fn probe(backend: etendue::settings::BackendChoice, rays: &[ProbeRay]) -> Option<Vec<ProbeHit>> {
    let mut scene = empty();
    add(&mut scene, square(Vec3::ZERO, Vec3::Z, 1.0), lambert(0.5));
    scene.cameras = vec![pinhole(DVec3::Z, DVec3::ZERO, 40.0)];
    let settings = Settings {
        backend,
        ..settings(8, 1)
    };
    let renderer = open(&scene, &settings, Tuning::default())?.unwrap();
    let hits = renderer.probe(rays).unwrap();
    assert_eq!(renderer.validation_messages(), Vec::<String>::new());
    Some(hits)
}

#[test]
fn rays_that_are_none_meet_nothing() {
    let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
    let mut rays = vec![ray(Vec3::Z, Vec3::ZERO), ray(Vec3::Z, -Vec3::ZERO)];
    for value in odd {
        for axis in 0..3 {
            let (mut origin, mut direction) = (Vec3::Z, Vec3::NEG_Z);
            origin[axis] = value;
            direction[axis] = value;
            rays.push(ray(origin, Vec3::NEG_Z));
            rays.push(ray(Vec3::Z, direction));
        }
    }
    for backend in pair() {
        let Some(hits) = probe(backend, &rays) else {
            return;
        };
        let met: Vec<_> = rays
            .iter()
            .zip(&hits)
            .filter(|(_, h)| h.primitive != NONE || h.occluded != 0)
            .collect();
        println!(
            "{backend:?}: {} of {} odd rays met something",
            met.len(),
            rays.len()
        );
        for (ray, hit) in &met {
            println!("  {ray:?} met {hit:?}");
        }
    }
}

#[test]
fn bounds_of_rays_are_open_and_kept() {
    let mut rays = Vec::new();
    let mut random = Random(14);
    let mut bounds = |t_min: f32, t_max: f32, distance: f32| {
        let at = Vec3::new(random.unit() as f32 * 0.5, 0.25, distance);
        rays.push(ProbeRay {
            t_min,
            t_max,
            ..ray(at, Vec3::NEG_Z)
        });
    };
    let mut wanted = Vec::new();
    for distance in [1e-6f32, 0.1, 1.0, 7.3, 1e6] {
        // f32::next_down and next_up, which are younger than the compiler that is asked for
        let [below, above] =
            [-1, 1].map(|step| f32::from_bits(distance.to_bits().wrapping_add_signed(step)));
        for (t_min, t_max, is_met) in [
            (0.0, above, true),
            (0.0, distance, false),
            (0.0, below, false),
            (below, 3e38, true),
            (distance, 3e38, false),
            (above, 3e38, false),
            (-0.0, 3e38, true),
            (2.0 * distance, 0.5 * distance, false),
            (f32::NAN, 3e38, false),
            (0.0, f32::NAN, false),
        ] {
            bounds(t_min, t_max, distance);
            wanted.push(is_met);
        }
    }
    for backend in pair() {
        let Some(hits) = probe(backend, &rays) else {
            return;
        };
        let mut wrong = Vec::new();
        for ((ray, hit), is_met) in rays.iter().zip(hits).zip(&wanted) {
            if (hit.primitive != NONE) != *is_met || (hit.occluded != 0) != *is_met {
                wrong.push((ray.origin[2], ray.t_min, ray.t_max, hit));
            }
        }
        println!(
            "{backend:?}: {} of {} bounds kept",
            rays.len() - wrong.len(),
            rays.len()
        );
        assert!(wrong.is_empty(), "{backend:?}: {wrong:?}");
    }
}

/// The camera lies in the plane of a square.
#[test]
fn squares_seen_edge_on_are_not_there() {
    for backend in pair() {
        let mut scene = empty();
        add(
            &mut scene,
            square(Vec3::ZERO, Vec3::Z, 1.0),
            emitter(0.5, 7.0),
        );
        add(
            &mut scene,
            square(Vec3::ZERO, Vec3::Z, 1.0),
            glass(1.5, Medium::default()),
        );
        scene.environment = constant_sky(1.0);
        scene.cameras = vec![pinhole(DVec3::new(3.0, 0.0, 0.0), DVec3::ZERO, 0.001)];
        let settings = Settings {
            backend,
            ..settings(16, 64)
        };
        let Some(r) = render(&scene, &settings, Tuning::default()) else {
            return;
        };
        let values: Vec<f32> = r.film.mean().into_iter().flatten().collect();
        let (low, high) = values
            .iter()
            .fold((f32::MAX, 0.0f32), |(l, h), v| (l.min(*v), h.max(*v)));
        println!("{backend:?}: pixels {low} … {high}");
        assert!(low >= 0.0 && high.is_finite() && high <= 8.0);
    }
}
