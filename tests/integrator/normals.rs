//! Shading normals that disagree with the surface.

use etendue::render::Tuning;
use etendue::scene::Mesh;
use etendue::settings::{Settings, Strategy};
use glam::{DAffine3, DMat3, DVec3, Vec3};

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
    let outside = Settings {
        camera: Some(1),
        ..settings(16, 16)
    };
    let r = render(&scene, &outside, Tuning::default()).unwrap();
    assert!(r.film.mean().iter().flatten().all(|v| *v > 1.0));
}

/// A plane whose shading normal leans by θ under a white sky: of its lobe (1 + cos θ)/2 lies above the plane, and what
/// lies below is lost, not reflected once more.
#[test]
fn light_below_the_surface_is_lost() {
    let (degrees, albedo) = (40f32, 0.8);
    let (sin, cos) = degrees.to_radians().sin_cos();
    let mut plane = square(Vec3::ZERO, Vec3::Z, 1.0);
    plane.normals = vec![Vec3::new(sin, 0.0, cos); plane.positions.len()];
    let mut scene = empty();
    add(&mut scene, plane, lambert(albedo));
    scene.environment = constant_sky(1.0);
    scene.cameras = vec![parallel(DVec3::Z, DVec3::ZERO, 0.5)];
    let settings = Settings {
        strategy: Strategy::BsdfOnly,
        ..settings(32, 1024)
    };
    let Some(r) = render(&scene, &settings, Tuning::default()) else {
        return;
    };
    let truth = f64::from(albedo) * 0.5 * f64::from(1.0 + cos);
    crate::assert_mean("leaning normal", &r.film, truth, 5e-3);
}

/// A placed mesh carries its normals by the inverse transpose, whether it is copied or kept.
#[test]
fn stretched_meshes_keep_their_normals() {
    // It leans so little that its mirror image of the view is above the surface: nothing bends it.
    let given = Vec3::new(0.2, -0.2, 0.9).normalize();
    let mut plane = square(Vec3::ZERO, Vec3::Z, 1.0);
    plane.normals = vec![given; plane.positions.len()];
    let turn = DMat3::from_rotation_x(0.6) * DMat3::from_rotation_y(-0.4);
    let matrix = turn * DMat3::from_diagonal(DVec3::new(0.4, 1.5, 0.7));
    let mut scene = empty();
    add_at(&mut scene, plane, lambert(0.5), DAffine3::from_mat3(matrix));
    // Kept as a group only if it is placed more than once.
    let mut second = scene.instances[0].clone();
    second.world_from_object.translation = turn * DVec3::new(0.0, 0.0, -5.0);
    scene.instances.push(second);
    scene.cameras = vec![parallel(turn * DVec3::Z, DVec3::ZERO, 0.2)];
    let wanted = (matrix.inverse().transpose() * given.as_dvec3()).normalize();
    for copy_limit in [0, usize::MAX] {
        let tuning = Tuning {
            copy_limit,
            ..Tuning::default()
        };
        let settings = Settings {
            aovs: true,
            ..settings(8, 4)
        };
        let Some(r) = render(&scene, &settings, tuning) else {
            return;
        };
        for n in r.film.normal().unwrap() {
            let off = (Vec3::from(n).as_dvec3() - wanted).length();
            // A product of a matrix with a vector and two square roots.
            assert!(off < 1e-6, "{n:?} instead of {wanted}, limit {copy_limit}");
        }
    }
}
