//! Opaque scenes by both: metals, plastics, sheets that cover a part, maps.

use std::sync::Arc;

use etendue::scene::{AlphaMode, Environment, Material, Scene};
use glam::{DAffine3, DVec3, Vec3};

use crate::common::backends::pair;
use crate::common::*;
use crate::compare::{Comparison, agree};
use crate::scattering::cuboid;

/// Plastic of a colour.
pub fn plastic(color: Vec3, roughness: f32) -> Material {
    Material {
        name: String::from("plastic"),
        base_color: color.extend(1.0),
        metallic: 0.0,
        roughness,
        ..Material::default()
    }
}

/// A block with edges of twice `half`, turned about the vertical axis.
pub fn block(scene: &mut Scene, centre: DVec3, half: f32, turn: f64, material: Material) {
    let place = DAffine3::from_translation(centre) * DAffine3::from_rotation_y(turn);
    add_at(scene, cuboid(Vec3::splat(half)), material, place);
}

/// A grey room with a wide lamp under its ceiling and a camera at its front wall.
pub fn lit_room() -> Scene {
    let mut scene = empty();
    add(&mut scene, room(1.0), lambert(0.5));
    let lamp = square(0.98 * Vec3::Y, -Vec3::Y, 0.9);
    add(&mut scene, lamp, emitter(0.0, 4.0));
    let (from, at) = (DVec3::new(0.1, 0.0, 0.95), DVec3::new(0.0, -0.3, -1.0));
    scene.cameras = vec![pinhole(from, at, 70.0)];
    scene
}

/// A sky that is different everywhere.
pub fn uneven_sky() -> Environment {
    let texel = |i: usize| {
        let (x, y) = (i as f32 % 16.0, (i / 16) as f32);
        [0.2 + 0.1 * x, 1.0 + 0.1 * y, 2.0 - 0.1 * x]
    };
    Environment::Map {
        width: 16,
        height: 8,
        texels: Arc::new((0..128).map(texel).collect()),
        intensity: 1.5,
        rotation: 0.8,
    }
}

#[test]
fn metal_and_plastic_in_a_room() {
    let mut scene = lit_room();
    let mut copper = metal(0.9, 0.4);
    copper.base_color = Vec3::new(0.95, 0.6, 0.5).extend(1.0);
    block(&mut scene, DVec3::new(-0.4, -0.7, -0.4), 0.3, 0.4, copper);
    let green = plastic(Vec3::new(0.1, 0.7, 0.3), 0.3);
    block(&mut scene, DVec3::new(0.4, -0.75, -0.1), 0.25, -0.3, green);
    let c = Comparison {
        channels: 3,
        reference: 12_000,
        image: 1.5e-2,
        tile: 3e-2,
        backends: pair(),
        ..Comparison::default()
    };
    agree("room", &scene, &c);
}

#[test]
fn tinted_coats_half_metals_and_mirrors_under_a_sky() {
    let mut scene = empty();
    add(&mut scene, square(Vec3::ZERO, Vec3::Y, 4.0), lambert(0.6));
    let half = Material {
        metallic: 0.5,
        specular: 0.8,
        specular_color: Vec3::new(1.0, 0.5, 2.0),
        ior: 1.8,
        ..plastic(Vec3::new(0.8, 0.5, 0.2), 0.6)
    };
    block(&mut scene, DVec3::new(-0.6, 0.5, 0.0), 0.5, 0.5, half);
    block(
        &mut scene,
        DVec3::new(0.7, 0.4, 0.0),
        0.4,
        0.1,
        metal(0.8, 0.0),
    );
    let mut pane = lambert(0.4);
    pane.alpha_mode = AlphaMode::Blend;
    pane.base_color.w = 0.3;
    add(
        &mut scene,
        square(Vec3::Z, Vec3::new(0.0, 0.6, 0.8), 0.5),
        pane,
    );
    scene.environment = Some(uneven_sky());
    scene.cameras = vec![pinhole(DVec3::new(0.5, 2.0, 4.0), DVec3::ZERO, 45.0)];
    let c = Comparison {
        channels: 3,
        ..Comparison::default()
    };
    agree("sky", &scene, &c);
}

/// Shading normals: bent ones, and light that they would send through the surface.
#[test]
fn smooth_normals_of_a_coarse_ball() {
    let mut scene = lit_room();
    let place = DAffine3::from_translation(DVec3::new(0.0, -0.3, -0.2))
        * DAffine3::from_scale(DVec3::new(-0.6, 0.5, 0.4));
    add_at(&mut scene, sphere(1), plastic(Vec3::splat(0.8), 0.3), place);
    let c = Comparison {
        reference: 12_000,
        image: 1.5e-2,
        tile: 3e-2,
        ..Comparison::default()
    };
    agree("ball", &scene, &c);
}
