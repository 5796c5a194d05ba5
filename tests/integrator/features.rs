//! Code that a scene does not need changes nothing when it is compiled in.

use etendue::render::Tuning;
use etendue::scene::{
    Environment, Filter, LightKind, PunctualLight, Scene, Texels, Texture, TextureRef, Wrap,
};
use etendue::settings::{BackendChoice, Settings};
use glam::{DVec3, Vec3};

use crate::common::*;

/// Lambert under an area light: no specular, no texture, no normals.
fn plain() -> Scene {
    let mut scene = empty();
    add(&mut scene, room(1.0), lambert(0.6));
    add(
        &mut scene,
        square(0.99 * Vec3::Y, -Vec3::Y, 0.4),
        emitter(0.0, 5.0),
    );
    scene.cameras = vec![pinhole(DVec3::Z * 0.9, -DVec3::Z, 70.0)];
    scene
}

/// Smooth metal under a map.
fn mapped() -> Scene {
    let mut scene = empty();
    add(&mut scene, sphere(2), metal(0.9, 0.3));
    let texels = (0..32).map(|i| [0.1 * i as f32, 0.5, 1.0]).collect();
    scene.environment = Some(Environment::Map {
        width: 8,
        height: 4,
        texels: std::sync::Arc::new(texels),
        intensity: 1.5,
        rotation: 0.3,
    });
    scene.cameras = vec![pinhole(DVec3::Z * 4.0, DVec3::ZERO, 30.0)];
    scene
}

/// A cut-out over a floor, lit by a lamp.
fn cut_out() -> Scene {
    let mut scene = empty();
    add(&mut scene, square(-Vec3::Y, Vec3::Y, 2.0), lambert(0.6));
    let mut material = lambert(0.3);
    material.alpha_mode = etendue::scene::AlphaMode::Mask { cutoff: 0.5 };
    material.base_color_texture = Some(TextureRef {
        texture: 0,
        uv_set: 0,
        uv_transform: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
    });
    scene.textures = vec![Texture {
        name: String::from("checker"),
        width: 2,
        height: 2,
        texels: Texels::Rgba8 {
            data: [
                [200, 100, 50, 255],
                [255, 255, 255, 0],
                [255; 4],
                [90, 90, 90, 0],
            ]
            .concat(),
            srgb: true,
        },
        wrap: [Wrap::Repeat; 2],
        filter: Filter::Nearest,
    }];
    add(&mut scene, square(Vec3::ZERO, Vec3::Y, 0.7), material);
    scene.lights = vec![PunctualLight {
        name: String::from("lamp"),
        kind: LightKind::Point,
        position: DVec3::new(0.3, 2.0, 0.1),
        direction: -Vec3::Y,
        intensity: Vec3::ONE,
    }];
    scene.cameras = vec![pinhole(DVec3::new(0.0, 3.0, 4.0), DVec3::ZERO, 40.0)];
    scene
}

/// A texture of 4 × 4 random texels in one of two formats.
fn noise(seed: u32, is_wide: bool, srgb: bool, wrap: [Wrap; 2], filter: Filter) -> Texture {
    let numbers = (0..64u32).map(|i| (i + 1 + 97 * seed).wrapping_mul(0x9E37_79B9) >> 16);
    let texels = if is_wide {
        Texels::Rgba16(numbers.map(|n| n as u16).collect())
    } else {
        let data = numbers.map(|n| n as u8).collect();
        Texels::Rgba8 { data, srgb }
    };
    Texture {
        name: format!("noise {seed}"),
        width: 4,
        height: 4,
        texels,
        wrap,
        filter,
    }
}

/// Every format, way to wrap and filter, in several slots.
fn papered() -> Scene {
    use Filter::{Linear, Nearest};
    use Wrap::{Clamp, Mirror, Repeat};
    let mut scene = empty();
    scene.textures = vec![
        noise(1, true, false, [Repeat, Mirror], Linear),
        noise(2, false, true, [Clamp, Repeat], Linear),
        noise(3, false, false, [Mirror, Clamp], Nearest),
        noise(4, false, false, [Mirror, Repeat], Linear),
    ];
    // coordinates from -1.3 to 2.3
    let slot = |texture| {
        Some(TextureRef {
            texture,
            uv_set: 0,
            uv_transform: [[3.6, 0.2, -1.3], [0.1, 3.6, -1.3]],
        })
    };
    let mut floor = lambert(0.9);
    floor.base_color_texture = slot(0);
    let mut wall = metal(0.9, 0.8);
    wall.base_color_texture = slot(1);
    wall.metallic_roughness_texture = slot(2);
    wall.normal_texture = slot(3);
    let mut lamp = emitter(0.0, 4.0);
    lamp.emission_texture = slot(1);
    add(&mut scene, square(-Vec3::Y, Vec3::Y, 2.0), floor);
    add(&mut scene, square(-Vec3::Z, Vec3::Z, 2.0), wall);
    add(&mut scene, square(1.5 * Vec3::Y, -Vec3::Y, 0.5), lamp);
    scene.cameras = vec![pinhole(DVec3::new(0.0, 1.0, 4.0), DVec3::ZERO, 40.0)];
    scene
}

#[test]
fn unused_features_do_not_change_the_picture() {
    for (name, scene) in [
        ("plain", plain()),
        ("mapped", mapped()),
        ("cut-out", cut_out()),
        ("papered", papered()),
    ] {
        let settings = Settings {
            backend: BackendChoice::Bvh,
            ..settings(24, 64)
        };
        let everything = Tuning {
            everything: true,
            ..Tuning::default()
        };
        let Some(lean) = render(&scene, &settings, Tuning::default()) else {
            return;
        };
        let full = render(&scene, &settings, everything).unwrap();
        let (lean, full) = (lean.film.mean(), full.film.mean());
        let off: Vec<f32> = lean
            .iter()
            .flatten()
            .zip(full.iter().flatten())
            .map(|(a, b)| (a - b).abs() / a.abs().max(1e-3))
            .collect();
        let largest = off.iter().copied().fold(0.0, f32::max);
        let same = off.iter().filter(|off| **off == 0.0).count();
        println!("{name}: {same} of {} same, off {largest:.1e}", off.len());
        // The compiler may fuse and reorder otherwise, and a Lambert weight is f cosθ / pdf
        // instead of the albedo: a few roundings a bounce. A path that a rounding sends to
        // another triangle would show as 1/64; these seeds have none.
        assert!(largest <= 1e-5, "{name}: off by {largest:.1e}");
    }
}
