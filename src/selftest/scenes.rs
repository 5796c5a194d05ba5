//! Scenes so small that they are written here.

use glam::{DAffine3, DMat3, DVec3, Vec3};

use crate::scene::{
    Camera, Environment, Instance, Material, Medium, Mesh, Projection, Scene, Volume,
};

/// A rectangle of half-edges `x` and `y`; its front is towards x × y.
pub(super) fn quad(centre: Vec3, x: Vec3, y: Vec3) -> Mesh {
    Mesh {
        positions: [-x - y, x - y, x + y, y - x].map(|p| centre + p).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    }
}

/// The box from `low` to `high` with its fronts outside, or inside.
pub(super) fn cuboid(low: Vec3, high: Vec3, is_room: bool) -> Mesh {
    let mut mesh = Mesh::default();
    let (centre, half) = (0.5 * (low + high), 0.5 * (high - low));
    for (axis, x, y) in [
        (Vec3::X, Vec3::Y, Vec3::Z),
        (Vec3::Y, Vec3::Z, Vec3::X),
        (Vec3::Z, Vec3::X, Vec3::Y),
    ] {
        for side in [1.0, -1.0] {
            let turn = if is_room { -side } else { side };
            let face = quad(centre + side * axis * half, turn * x * half, y * half);
            let first = mesh.positions.len() as u32;
            mesh.positions.extend(face.positions);
            let moved = face.triangles.iter().map(|t| t.map(|v| first + v));
            mesh.triangles.extend(moved);
        }
    }
    mesh
}

/// A sphere of flat triangles whose corners are shared to the bit: an octahedron, split `levels` times.
pub(super) fn ball(radius: f32, levels: u32) -> Mesh {
    let mut faces = Vec::new();
    for i in 0..8 {
        let sign = |bit: u32| if i >> bit & 1 == 0 { 1.0 } else { -1.0 };
        let [x, y, z] = [sign(0) * Vec3::X, sign(1) * Vec3::Y, sign(2) * Vec3::Z];
        let is_mirrored = sign(0) * sign(1) * sign(2) < 0.0;
        faces.push(if is_mirrored { [y, x, z] } else { [x, y, z] });
    }
    for _ in 0..levels {
        let split = |[a, b, c]: [Vec3; 3]| {
            // Sums are symmetric, so that neighbours get the same bits.
            let [ab, bc, ca] = [a + b, b + c, c + a].map(Vec3::normalize);
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        };
        faces = faces.into_iter().flat_map(split).collect();
    }
    let positions: Vec<Vec3> = faces.iter().flatten().map(|p| *p * radius).collect();
    let count = positions.len() as u32;
    Mesh {
        triangles: (0..count / 3)
            .map(|i| [0, 1, 2].map(|k| 3 * i + k))
            .collect(),
        positions,
        ..Mesh::default()
    }
}

/// Lambert, which may emit.
pub(super) fn lambert(albedo: f32, emission: f32) -> Material {
    Material {
        base_color: Vec3::splat(albedo).extend(1.0),
        emission: Vec3::splat(emission),
        metallic: 0.0,
        specular: 0.0,
        ..Material::default()
    }
}

/// A solid with a smooth surface.
pub(super) fn solid(ior: f32, medium: Medium) -> Material {
    Material {
        metallic: 0.0,
        roughness: 0.0,
        transmission: 1.0,
        ior,
        volume: Some(Volume {
            medium,
            priority: 0,
        }),
        ..Material::default()
    }
}

/// A scene of these meshes in a sky of constant radiance (0: none), seen by a camera at `from` that looks at `at` and
/// sees parallel rays within `half` metres.
pub(super) fn scene(
    parts: Vec<(Mesh, Material)>,
    sky: f32,
    from: DVec3,
    at: DVec3,
    half: f64,
) -> Scene {
    let mut scene = Scene::default();
    for (i, (mesh, material)) in (0..).zip(parts) {
        scene.meshes.push(Mesh {
            material: i,
            ..mesh
        });
        scene.materials.push(material);
        scene.instances.push(Instance {
            name: String::new(),
            mesh: i,
            world_from_object: DAffine3::IDENTITY,
        });
    }
    if sky > 0.0 {
        scene.environment = Some(Environment::Constant(Vec3::splat(sky)));
    }
    let back = (from - at).normalize();
    let right = back.any_orthonormal_vector();
    scene.cameras.push(Camera {
        name: String::new(),
        world_from_camera: DAffine3 {
            matrix3: DMat3::from_cols(right, back.cross(right), back),
            translation: from,
        },
        projection: Projection::Orthographic {
            xmag: half as f32,
            ymag: half as f32,
        },
    });
    scene
}
