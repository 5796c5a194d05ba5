//! Shading normals that disagree with the surface.

use etendue::render::Tuning;
use etendue::scene::Mesh;
use glam::{DVec3, Vec3};

use crate::common::*;

/// A fixed generator (splitmix64); in −1 … 1.
fn noise(state: &mut u64) -> f32 {
    *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((z ^ (z >> 31)) >> 40) as f32 / 8_388_608.0 - 1.0
}

/// The mesh with vertex normals that lean up to `tilt` per axis off the given or flat ones.
fn bumpy(mut mesh: Mesh, tilt: f32) -> Mesh {
    let mut state = 7;
    // Corners are not shared after this, so that each may lean its own way.
    let corners: Vec<Vec3> = mesh
        .triangles
        .iter()
        .flatten()
        .map(|&v| mesh.positions[v as usize])
        .collect();
    mesh.normals = corners
        .chunks_exact(3)
        .flat_map(|t| {
            let n = (t[1] - t[0]).cross(t[2] - t[0]).normalize();
            [n; 3]
        })
        .map(|n| {
            let lean = Vec3::new(noise(&mut state), noise(&mut state), noise(&mut state));
            (n + tilt * lean).normalize()
        })
        .collect();
    mesh.triangles = (0..corners.len() as u32 / 3)
        .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
        .collect();
    mesh.uvs = Default::default();
    mesh.positions = corners;
    mesh
}

#[test]
fn bumpy_normals_leave_no_pixel_black() {
    for material in [lambert(1.0), metal(1.0, 0.3)] {
        let mut scene = empty();
        let name = material.name.clone();
        add(&mut scene, bumpy(sphere(3), 0.9), material);
        scene.environment = constant_sky(1.0);
        scene.cameras = vec![pinhole(DVec3::new(0.3, 0.5, 4.0), DVec3::ZERO, 30.0)];
        let Some(r) = render(&scene, &settings(32, 64), Tuning::default()) else {
            return;
        };
        let mean = r.film.mean();
        let least = mean.iter().flatten().copied().fold(f32::INFINITY, f32::min);
        let most = mean.iter().flatten().copied().fold(0.0, f32::max);
        println!("{name}: {least} … {most}");
        // A lobe of metal may point below the surface as a whole; Lambert's never does.
        assert!(least > 0.0 || name == "metal", "{name}: a black pixel");
        // Energy may only be lost; 1e-5 for the roundings of 64 weights.
        assert!(most <= 1.0 + 1e-5, "{name}: {most}");
    }
}

#[test]
fn no_light_leaks_through_walls_with_bumpy_normals() {
    let mut scene = empty();
    add(&mut scene, bumpy(room(1.0), 0.9), lambert(0.9));
    scene.environment = constant_sky(100.0);
    let from = DVec3::new(0.3, -0.2, 0.9);
    scene.cameras = vec![
        pinhole(from, DVec3::new(-0.4, 0.1, -1.0), 80.0),
        pinhole(3.0 * from, DVec3::ZERO, 40.0),
    ];
    let Some(r) = render(&scene, &settings(16, 256), Tuning::default()) else {
        return;
    };
    assert!(
        r.film.mean().iter().flatten().all(|v| *v == 0.0),
        "light leaks in"
    );
    // The same walls are bright from outside.
    let outside = etendue::settings::Settings {
        camera: Some(1),
        ..settings(16, 16)
    };
    let r = render(&scene, &outside, Tuning::default()).unwrap();
    assert!(r.film.mean().iter().flatten().all(|v| *v > 1.0));
}
