//! Where few flat pieces are tested without a walk, hits are those of the walk, to the bit.

use etendue::layout::{NONE, ProbeHit, ProbeRay};
use etendue::render::Tuning;
use etendue::scene::{Mesh, Scene};
use etendue::settings::BackendChoice;
use glam::{DAffine3, DQuat, DVec3, Vec3};

use crate::scenes::{Random, cube, lambert, mesh, scaled, scene};
use crate::{finish, open_tuned, probing};

const RAYS: usize = 40_000;
/// Half widths of the rooms, metres: powers of two, which round nothing.
const SIZES: [f64; 5] = [1.0, 1.0, 1.0 / 1_048_576.0, 1_048_576.0, 8.0];

/// What the rays meet, with the pieces tested or by the walk alone.
fn probe(scene: &Scene, planes: bool, rays: &[ProbeRay]) -> Option<Vec<ProbeHit>> {
    let tuning = Tuning {
        planes: Some(planes),
        copy_limit: usize::MAX,
        ..Tuning::default()
    };
    let renderer = open_tuned(scene, &probing(BackendChoice::Bvh), tuning)?;
    let features = renderer.report().features;
    assert!(
        features
            .iter()
            .any(|f| f.name == "planes" && f.on == planes)
    );
    let hits = renderer.probe(rays).unwrap();
    finish(&renderer);
    Some(hits)
}

/// Triangles that share no edge, long and thin ones among them.
fn shards(random: &mut Random) -> Mesh {
    let positions: Vec<Vec3> = (0..5)
        .flat_map(|i| {
            let stretch = DVec3::new(1.0, 1.0, [1.0, 0.01][i % 2]);
            let middle = random.cube();
            [0, 1, 2].map(|_| (middle + random.cube() * stretch).as_vec3())
        })
        .collect();
    let triangles = (0..5).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    mesh(positions, triangles)
}

/// A box with slanting edges from a corner, in steps of 1/64, so that its faces are parallelograms to the bit.
fn slanted(corner: [i32; 3], edges: [[i32; 3]; 3]) -> Mesh {
    let [p, q, r] = edges;
    let corners = (0..8).map(|i| {
        let at = |axis: usize| {
            let [x, y, z] = [i & 1, i >> 1 & 1, i >> 2];
            (corner[axis] + x * p[axis] + y * q[axis] + z * r[axis]) as f32 / 64.0
        };
        Vec3::new(at(0), at(1), at(2))
    });
    mesh(corners.collect(), cube().triangles)
}

/// A room with slanting boxes that touch and cross it and each other, an upright one that is turned, and triangles.
fn rooms(random: &mut Random, size: f64) -> Scene {
    let mut step = || random.index(41) as i32 - 20;
    let mut boxes = vec![slanted([-64; 3], [[128, 0, 0], [0, 128, 0], [0, 0, 128]])];
    boxes.push(slanted(
        [-30, -64, step()],
        [[step(), 0, 40], [3, step().abs() + 1, 7], [50, 0, step()]],
    ));
    boxes.push(slanted(
        [step(), step(), step()],
        [[9, step(), 2], [step(), 25, 1], [3, 1, step() + 30]],
    ));
    let turn = DAffine3::from_rotation_translation(
        DQuat::from_rotation_y(random.unit()),
        DVec3::new(0.25, -0.75, -0.125) * size,
    );
    let mut meshes: Vec<_> = boxes
        .into_iter()
        .map(|mesh| (scaled(mesh, size as f32), vec![DAffine3::IDENTITY]))
        .collect();
    meshes.push((scaled(cube(), (0.25 * size) as f32), vec![turn]));
    meshes.push((
        scaled(shards(random), (0.5 * size) as f32),
        vec![DAffine3::IDENTITY],
    ));
    scene(meshes, vec![lambert(0.5)])
}

/// The corners of what is met, in the scene's space.
fn corners(scene: &Scene) -> Vec<[Vec3; 3]> {
    let of = |i: &etendue::scene::Instance| {
        let mesh = &scene.meshes[i.mesh as usize];
        let at = |v: u32| {
            let p = mesh.positions[v as usize].as_dvec3();
            i.world_from_object.transform_point3(p).as_vec3()
        };
        mesh.triangles.iter().map(|t| t.map(at)).collect::<Vec<_>>()
    };
    scene.instances.iter().flat_map(of).collect()
}

/// Rays at anything, at edges and corners, along axes and surfaces, from inside and outside.
fn rays(scene: &Scene, size: f64, random: &mut Random) -> Vec<ProbeRay> {
    let corners = corners(scene);
    (0..RAYS)
        .map(|i| {
            let [a, b, c] = corners[random.index(corners.len())];
            let u = [0.0, 0.5, random.unit() as f32][random.index(3)];
            let edge = a + (b - a) * u;
            let inside = edge + (c - edge) * random.unit() as f32 * [0.0, 1.0][random.index(2)];
            let [d, e, _] = corners[random.index(corners.len())];
            let (origin, target) = match i % 6 {
                0 => ((random.cube() * 0.9 * size).as_vec3(), inside),
                1 => ((random.cube() * 3.0 * size).as_vec3(), inside),
                2 => (d + (e - d) * random.unit() as f32, inside),
                3 => (edge, b),
                4 => {
                    let start = (random.cube() * 0.9 * size).as_vec3();
                    (start, start + [Vec3::X, -Vec3::Y, Vec3::Z][random.index(3)])
                }
                _ => (inside * (1.0 - 1e-6), random.cube().as_vec3() * size as f32),
            };
            let way = target - origin;
            let direction = way.normalize_or(Vec3::X);
            // as far as the target, to the bit and nearly, or beyond
            let t_max = [way.length(), way.length() * (1.0 - 1e-6), 3e38][random.index(3)];
            ProbeRay {
                origin: origin.to_array(),
                t_min: [0.0, 0.1 * size as f32][random.index(2)],
                direction: direction.to_array(),
                t_max,
                from: NONE,
            }
        })
        .collect()
}

/// Rays that go on from hits, whose plane they leave.
fn onward(rays: &[ProbeRay], hits: &[ProbeHit], random: &mut Random) -> Vec<ProbeRay> {
    let next = |(ray, hit): (&ProbeRay, &ProbeHit)| {
        let (origin, direction) = (Vec3::from(ray.origin), Vec3::from(ray.direction));
        let back = random.cube().normalize().as_vec3();
        let back = if back.dot(direction) > 0.0 {
            -back
        } else {
            back
        };
        ProbeRay {
            origin: (origin + direction * hit.t * (1.0 - 4e-7)).to_array(),
            direction: back.to_array(),
            t_min: 0.0,
            t_max: 3e38,
            from: hit.record,
        }
    };
    let met = rays
        .iter()
        .zip(hits)
        .filter(|(_, hit)| hit.primitive != NONE);
    met.map(next).collect()
}

fn assert_same(name: &str, scene: &Scene, rays: &[ProbeRay]) -> Option<Vec<ProbeHit>> {
    let walked = probe(scene, false, rays)?;
    let tested = probe(scene, true, rays)?;
    for ((ray, wanted), got) in rays.iter().zip(&walked).zip(&tested) {
        assert_eq!(
            bytes(got),
            bytes(wanted),
            "{name}: {ray:?}: {got:?} instead of {wanted:?}"
        );
    }
    Some(walked)
}

/// Everything that is known of a hit, as bits.
fn bytes(hit: &ProbeHit) -> &[u8] {
    bytemuck::bytes_of(hit)
}

#[test]
fn few_flat_pieces_are_met_as_in_the_tree() {
    for (round, size) in SIZES.into_iter().enumerate() {
        let mut random = Random(41 + round as u64);
        let scene = rooms(&mut random, size);
        let name = format!("room {round} of {size} m");
        let first = rays(&scene, size, &mut random);
        let Some(hits) = assert_same(&name, &scene, &first) else {
            return;
        };
        let next = onward(&first, &hits, &mut random);
        assert!(next.len() > RAYS / 3, "{} rays met something", next.len());
        let Some(hits) = assert_same(&name, &scene, &next) else {
            return;
        };
        let named = hits.iter().filter(|hit| hit.record != NONE).count();
        assert!(named > hits.len() / 2, "{named} of {} hits", hits.len());
    }
}
