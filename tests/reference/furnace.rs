//! Light and matter in balance: the answer is a constant.

use std::sync::Arc;

use etendue::scene::{Environment, Material, Scene, Volume};
use glam::{DVec3, Vec3};

use crate::common::*;
use crate::tracer::rng::Rng;
use crate::tracer::{camera, sky};
use crate::{assert_is, traced};

/// Le (1 + ρ + ρ² + …) = Le / (1 − ρ).
#[test]
fn glowing_room_sums_the_geometric_series() {
    let mut scene = empty();
    let albedo = Vec3::new(0.0, 0.5, 0.8);
    let mut wall = emitter(0.0, 2.0);
    wall.base_color = albedo.extend(1.0);
    add(&mut scene, room(1.0), wall);
    scene.cameras = vec![pinhole(DVec3::new(0.1, 0.2, 0.3), DVec3::NEG_ONE, 70.0)];
    let means = traced(&scene, 8, 4096, 3);
    for (channel, mean) in means.into_iter().enumerate() {
        let truth = 2.0 / (1.0 - f64::from(albedo[channel]));
        assert_is(
            &format!("albedo {}", albedo[channel]),
            mean,
            truth,
            2e-2 * truth,
        );
    }
}

/// A body in front of a sky of 1, seen whole, facets and smooth normals as given.
fn under_the_sky(mesh: etendue::scene::Mesh, material: Material) -> Scene {
    let mut scene = empty();
    add(&mut scene, mesh, material);
    scene.environment = constant_sky(1.0);
    scene.cameras = vec![pinhole(DVec3::new(0.3, 0.5, 4.0), DVec3::ZERO, 30.0)];
    scene
}

pub fn glass(roughness: f32) -> Material {
    Material {
        name: String::from("glass"),
        metallic: 0.0,
        roughness,
        transmission: 1.0,
        volume: Some(Volume::default()),
        ..Material::default()
    }
}

/// No losses: each path returns the sky to the bit.
#[test]
fn white_and_clear_bodies_vanish() {
    let thin = Material {
        volume: None,
        ..glass(0.0)
    };
    for (what, material) in [
        ("Lambert", lambert(1.0)),
        ("mirror", metal(1.0, 0.0)),
        ("glass", glass(0.0)),
        ("sheets", thin),
    ] {
        let scene = under_the_sky(faceted(sphere(2)), material);
        let means = traced(&scene, 8, 256, 1);
        assert_is(what, means[0], 1.0, 1e-12);
    }
}

/// Plastic conserves energy; the coupling of base and coat loses some.
#[test]
fn white_plastic_never_gains() {
    let plastic = Material {
        metallic: 0.0,
        roughness: 0.4,
        ..Material::default()
    };
    let scene = under_the_sky(faceted(sphere(2)), plastic);
    let seen = traced(&scene, 8, 4096, 1)[0];
    println!("plastic: {:.5} ± {:.1e}", seen.mean, seen.error);
    assert!(seen.mean + seen.chance() < 1.0 && seen.mean > 0.9);
}

/// The middle of a map looks along −Z, u grows towards +X, and a rotation
/// carries what stood in d to R_y(rotation)·d.
#[test]
fn map_is_the_right_way_round() {
    let (width, height) = (64, 32);
    let mut texels = vec![[0.0; 3]; width * height];
    // One texel at u = 3/4 (plus half a texel), half-way down: +X.
    texels[height / 2 * width + width * 3 / 4] = [1.0; 3];
    let map = |rotation| Environment::Map {
        width: width as u32,
        height: height as u32,
        texels: Arc::new(texels.clone()),
        intensity: 3.0,
        rotation,
    };
    let at = |rotation, d: DVec3| sky::radiance(Some(&map(rotation)), d, 0);
    let half_texel = std::f64::consts::PI / width as f64;
    let d = DVec3::new(half_texel.cos(), -half_texel.sin(), half_texel.sin());
    assert!((at(0.0, d) - 3.0).abs() < 0.05, "{}", at(0.0, d));
    assert_eq!(at(0.0, -d), 0.0);
    // A quarter turn about +Y carries +X to −Z.
    let turned = DVec3::new(d.z, d.y, -d.x);
    assert!((at(std::f32::consts::FRAC_PI_2, turned) - 3.0).abs() < 0.05);
}

#[test]
fn camera_has_right_on_the_right_and_up_above() {
    let view = pinhole(DVec3::Z * 5.0, DVec3::ZERO, 90.0);
    let right = view.world_from_camera.matrix3.x_axis;
    let up = view.world_from_camera.matrix3.y_axis;
    let mut rng = Rng::new(&[1]);
    let (origin, d) = camera::ray(&view, 1000, 999, 0, &mut rng);
    assert_eq!(origin, DVec3::Z * 5.0);
    // 90° across: the corner is at 45° both ways.
    let corner = (right + up - DVec3::Z).normalize();
    assert!(d.dot(corner) > 0.999_99, "{d}");
}
