//! Random rays at random triangles and at placed meshes, against brute force.

use etendue::layout::{NONE, ProbeRay};
use etendue::scene::Scene;
use glam::{DVec3, Vec3};

use crate::backends::offered;
use crate::brute::{Brute, check, nearest};
use crate::scenes::{Random, mesh, single};
use crate::table::placed;
use crate::{Levels, finish, prober};

/// Rays of the largest test; the others have a share of it.
const RAYS: usize = 100_000;
/// Rays that may have other ids than the nearest hit; every one of them must be a tie, or on an edge within rounding.
const MOST_TIES: f64 = 1e-4;

/// Triangles of edge length about `edge` in the cube of half width `size`.
fn soup(count: usize, size: f64, edge: f64, random: &mut Random) -> Scene {
    let mut positions: Vec<Vec3> = Vec::new();
    for _ in 0..count {
        let middle = random.cube() * size;
        for _ in 0..3 {
            positions.push((middle + random.cube() * edge).as_vec3());
        }
    }
    let triangles = (0..count as u32)
        .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
        .collect();
    single(mesh(positions, triangles))
}

/// Half of the rays go anywhere, half at a triangle.
fn random_rays(brute: &Brute, size: f64, count: usize, random: &mut Random) -> Vec<ProbeRay> {
    (0..count)
        .map(|i| {
            let origin = random.cube() * 1.5 * size;
            let target = if i % 2 == 0 {
                random.cube() * size
            } else {
                let [a, b, c] = brute.corners(random.index(brute.len()));
                let (u, v) = (random.unit().sqrt(), random.unit());
                a * (1.0 - u) + b * (u * (1.0 - v)) + c * (u * v)
            };
            let direction: DVec3 = (target - origin).normalize();
            let t_max = if i % 5 == 0 { size as f32 } else { 3e38 };
            ProbeRay {
                origin: origin.as_vec3().to_array(),
                t_min: 0.0,
                direction: direction.as_vec3().normalize().to_array(),
                t_max,
                from: NONE,
            }
        })
        .collect()
}

fn compare(name: &str, scene: &Scene, levels: Levels, size: f64, count: usize) {
    let mut random = Random(21);
    let brute = Brute::new(scene, levels);
    let rays = random_rays(&brute, size, count, &mut random);
    let found: Vec<_> = rays.iter().map(|ray| brute.trace(ray)).collect();
    let hits = found.iter().filter(|f| nearest(f).is_some()).count();
    assert!(
        hits > count / 4 && hits < count,
        "{hits} of {count} rays hit"
    );
    for backend in offered() {
        let Some(renderer) = prober(scene, backend, levels) else {
            return;
        };
        let mut ties = 0;
        for ((ray, candidates), hit) in rays.iter().zip(&found).zip(renderer.probe(&rays).unwrap())
        {
            match check(&hit, candidates) {
                Ok(is_same) => ties += usize::from(!is_same),
                Err(error) => panic!("{name}, {levels:?}, {}, {ray:?}: {error}", backend.name()),
            }
        }
        println!(
            "{name}, {levels:?}, {}: {hits} of {count} hit, {ties} ties",
            backend.name()
        );
        assert!(ties as f64 <= MOST_TIES * count as f64, "{ties} of {count}");
        finish(&renderer);
    }
}

#[test]
fn random_triangles() {
    let mut random = Random(20);
    compare(
        "coarse soup",
        &soup(150, 1.0, 0.4, &mut random),
        Levels::Flat,
        1.0,
        RAYS,
    );
    compare(
        "fine soup",
        &soup(1000, 1.0, 0.1, &mut random),
        Levels::Flat,
        1.0,
        RAYS / 4,
    );
    compare(
        "large soup",
        &soup(150, 1e6, 4e5, &mut random),
        Levels::Flat,
        1e6,
        RAYS / 4,
    );
    compare(
        "small soup",
        &soup(150, 1e-6, 4e-7, &mut random),
        Levels::Flat,
        1e-6,
        RAYS / 4,
    );
}

#[test]
fn placed_meshes() {
    for levels in [Levels::Flat, Levels::Two] {
        compare("placed", &placed(), levels, 8.0, RAYS);
    }
}
