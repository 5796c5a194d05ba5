//! Placed groups against copies in world space: the same hits and the same
//! pictures, with an emitter among the placed meshes.

use etendue::layout::{NONE, ProbeHit};
use etendue::scene::{Material, Scene};
use glam::{DAffine3, DMat3, DQuat, DVec3, Vec3};

use crate::Levels;
use crate::backends::offered;
use crate::pictures::{SIZE, Side, assert_same_picture, look, other_ids, primary_rays};
use crate::scenes::{cube, fan, icosphere, lambert, look_at, scaled, scene};

/// A floor, placed spheres and placed lamps; turned, stretched and mirrored. Lamps shine from the front only, so
/// that a mirrored one that forgot to turn its winding would be dark.
pub fn lamps() -> Scene {
    let turn = DMat3::from_quat(DQuat::from_axis_angle(DVec3::new(1., 2., -2.) / 3.0, 0.7));
    let stretch = DMat3::from_diagonal(DVec3::new(0.4, 1.2, 0.7));
    let mirror = DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0));
    let place = |matrix3: DMat3, x: f64, y: f64, z: f64| DAffine3 {
        matrix3,
        translation: DVec3::new(x, y, z),
    };
    let floor = scaled(fan(), 6.0);
    let spheres = vec![
        place(DMat3::IDENTITY, -2.0, 0.0, 1.0),
        place(turn * stretch, 0.0, -1.5, 1.0),
        place(mirror * turn * stretch * 1.3, 2.0, 0.5, 1.2),
    ];
    let mut lamp = scaled(fan(), 0.5);
    lamp.material = 1;
    let down = DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
    let lamps = vec![
        place(down, -1.5, 1.5, 3.0),
        // Mirrored in z alone the front still looks down, with the winding the other way.
        place(
            DMat3::from_diagonal(DVec3::new(1.5, 0.5, -1.0)),
            1.5,
            1.5,
            3.0,
        ),
        place(turn * down * stretch, 0.0, -2.5, 3.5),
    ];
    let crates = vec![
        place(stretch * 0.5, -0.5, 2.0, 0.4),
        place(turn * 0.4, 3.0, -2.0, 0.8),
    ];
    let bright = Material {
        emission: Vec3::new(9.0, 8.0, 6.0),
        ..lambert(0.2)
    };
    let mut lamps_scene = scene(
        vec![
            (icosphere(2), spheres),
            (floor, vec![DAffine3::IDENTITY]),
            (lamp, lamps),
            (cube(), crates),
        ],
        vec![lambert(0.6), bright],
    );
    look_at(
        &mut lamps_scene,
        DVec3::new(1.0, -7.0, 6.0),
        DVec3::new(0.0, 0.0, 1.0),
        0.8,
    );
    lamps_scene
}

/// A triangle of the flattened scene as (instance of the scene, triangle of its mesh).
pub fn from_flat(scene: &Scene, primitive: u32) -> (u32, u32) {
    let mut left = primitive;
    for (index, instance) in scene.instances.iter().enumerate() {
        let count = scene.meshes[instance.mesh as usize].triangles.len() as u32;
        if left < count {
            return (index as u32, left);
        }
        left -= count;
    }
    (NONE, NONE)
}

/// The same of the scene on two levels, where only the floor is placed once.
fn from_two(scene: &Scene, hit: &ProbeHit) -> (u32, u32) {
    let floor = scene.instances.iter().position(|i| i.mesh == 1).unwrap() as u32;
    match hit.instance {
        NONE => (NONE, NONE),
        0 => (floor, hit.primitive),
        placed if placed <= floor => (placed - 1, hit.primitive),
        placed => (placed, hit.primitive),
    }
}

#[test]
fn two_levels_equal_copies() {
    let scene = lamps();
    let rays = primary_rays(&scene, (160, 128));
    for backend in offered() {
        let mut hits = Vec::new();
        let mut films = Vec::new();
        for levels in [Levels::Flat, Levels::Two] {
            let Some((found, film)) = look(&scene, &rays, backend, levels) else {
                return;
            };
            hits.push(found);
            films.push(film);
        }
        let sides = [(0, Levels::Flat), (1, Levels::Two)].map(|(i, levels)| Side {
            hits: &hits[i],
            levels,
        });
        let label = format!("two levels, {}", backend.name());
        let same = |a: &ProbeHit, b: &ProbeHit| {
            from_flat(&scene, a.primitive) == from_two(&scene, b) && a.occluded == b.occluded
        };
        other_ids(&label, &scene, &rays, sides, same);
        for instance in 0..=8 {
            let seen = hits[1].iter().any(|hit| hit.instance == instance);
            assert!(seen, "{label}: instance {instance} is not in view");
        }
        let worst = assert_same_picture(&label, &films[0], &films[1], SIZE);
        println!("{label}: tiles differ by {worst:.2} deviations at most");
    }
}
