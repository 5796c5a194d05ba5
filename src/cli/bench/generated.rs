//! Scenes that grow: made of numbers, all with a camera.

use etendue::scene::{Camera, Environment, Instance, Material, Mesh, Projection, Scene};
use glam::{DAffine3, DMat3, DVec3, Vec3};

/// Power of all lamps together over π, in units of radiance × area, cd.
const LAMPS: f32 = 20.0;

/// Hills of about so many triangles under a constant sky, seen from above one side; the same hills whatever the number.
pub fn terrain(triangles: u64) -> Scene {
    let side = ((triangles as f64 / 2.0).sqrt().round() as u32).max(1);
    let height = |x: f32, z: f32| {
        0.6 * (0.9 * x).sin() * (0.7 * z).cos()
            + 0.2 * (2.9 * x + 1.0).sin() * (3.1 * z).sin()
            + 0.05 * (9.0 * x).sin() * (8.0 * z + 2.0).cos()
    };
    let place = |i: u32| 16.0 * (i as f32 / side as f32 - 0.5);
    let mut mesh = Mesh::default();
    for row in 0..=side {
        for column in 0..=side {
            let (x, z) = (place(column), place(row));
            mesh.positions.push(Vec3::new(x, height(x, z), z));
        }
    }
    for row in 0..side {
        for column in 0..side {
            let a = row * (side + 1) + column;
            let (b, c, d) = (a + 1, a + side + 1, a + side + 2);
            mesh.triangles.extend([[a, c, b], [b, c, d]]);
        }
    }
    let mut scene = Scene {
        environment: Some(Environment::Constant(Vec3::ONE)),
        cameras: vec![camera(DVec3::new(0.0, 5.0, 9.0), DVec3::ZERO)],
        ..Scene::default()
    };
    add(&mut scene, mesh, lambert(0.7), &[DVec3::ZERO]);
    scene
}

/// A plane with blocks under so many small lamps, all in one square and of the same power together.
pub fn lamps(count: u64) -> Scene {
    let mut scene = Scene {
        cameras: vec![camera(DVec3::new(0.0, 4.0, 9.0), DVec3::ZERO)],
        ..Scene::default()
    };
    let floor = square(8.0, Vec3::Y);
    add(&mut scene, floor, lambert(0.6), &[DVec3::ZERO]);
    let blocks: Vec<DVec3> = grid(25, 8.0, 0.4).collect();
    add(&mut scene, cube(0.4), lambert(0.7), &blocks);
    let spacing = 8.0 / (count as f32).sqrt();
    let half = (0.2 * spacing).min(0.1);
    let area = 4.0 * half * half * count as f32;
    let lamp = Material {
        emission: Vec3::splat(LAMPS / area),
        ..lambert(0.0)
    };
    let places: Vec<DVec3> = grid(count, 8.0, 2.5).collect();
    add(&mut scene, square(half, -Vec3::Y), lamp, &places);
    scene
}

/// So many cubes over a plane under a constant sky, all copies of one mesh.
pub fn copies(count: u64) -> Scene {
    let mut scene = Scene {
        environment: Some(Environment::Constant(Vec3::ONE)),
        cameras: vec![camera(DVec3::new(0.0, 5.0, 9.0), DVec3::ZERO)],
        ..Scene::default()
    };
    let floor = square(8.0, Vec3::Y);
    add(&mut scene, floor, lambert(0.6), &[DVec3::ZERO]);
    let half = 4.0 / (count as f32).sqrt();
    let places: Vec<DVec3> = grid(count, 14.0, f64::from(half)).collect();
    add(&mut scene, cube(half), lambert(0.7), &places);
    scene
}

/// A closed room of reflectance 0.8 with one lamp: paths end by roulette or by the limit only.
pub fn room() -> Scene {
    let mut scene = Scene {
        cameras: vec![camera(DVec3::new(0.0, 0.0, 1.8), DVec3::ZERO)],
        ..Scene::default()
    };
    let mut walls = cube(2.0);
    for triangle in &mut walls.triangles {
        triangle.swap(1, 2);
    }
    add(&mut scene, walls, lambert(0.8), &[DVec3::ZERO]);
    let lamp = Material {
        emission: Vec3::splat(10.0),
        ..lambert(0.0)
    };
    let place = DVec3::new(0.0, 1.9, 0.0);
    add(&mut scene, square(0.4, -Vec3::Y), lamp, &[place]);
    scene
}

/// Places in a square grid of that many metres, in the middle of their cells, row by row.
fn grid(count: u64, side: f64, height: f64) -> impl Iterator<Item = DVec3> {
    let columns = (count as f64).sqrt().ceil().max(1.0);
    (0..count).map(move |i| {
        let (row, column) = ((i as f64 / columns).floor(), i as f64 % columns);
        let at = |k: f64| side * ((k + 0.5) / columns - 0.5);
        DVec3::new(at(column), height, at(row))
    })
}

fn lambert(reflectance: f32) -> Material {
    Material {
        base_color: Vec3::splat(reflectance).extend(1.0),
        metallic: 0.0,
        specular: 0.0,
        ..Material::default()
    }
}

/// Four corners around the origin, fronts to `normal`.
fn square(half: f32, normal: Vec3) -> Mesh {
    let x = half * normal.any_orthonormal_vector();
    let y = normal.cross(x);
    Mesh {
        positions: vec![-x - y, x - y, x + y, y - x],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    }
}

/// A cube around the origin, fronts outside.
fn cube(half: f32) -> Mesh {
    let mut mesh = Mesh::default();
    for normal in [Vec3::X, Vec3::Y, Vec3::Z]
        .into_iter()
        .flat_map(|n| [n, -n])
    {
        let first = mesh.positions.len() as u32;
        let face = square(half, normal);
        let corners = face.positions.iter().map(|p| *p + half * normal);
        mesh.positions.extend(corners);
        let shifted = face.triangles.iter().map(|t| t.map(|v| v + first));
        mesh.triangles.extend(shifted);
    }
    mesh
}

fn add(scene: &mut Scene, mut mesh: Mesh, material: Material, places: &[DVec3]) {
    mesh.material = scene.materials.len() as u32;
    scene.materials.push(material);
    let index = scene.meshes.len() as u32;
    scene.meshes.push(mesh);
    scene.instances.extend(places.iter().map(|place| Instance {
        name: String::from("generated"),
        mesh: index,
        world_from_object: DAffine3::from_translation(*place),
    }));
}

/// Half a radian up and down.
fn camera(from: DVec3, at: DVec3) -> Camera {
    let back = (from - at).normalize();
    let right = DVec3::Y.cross(back).normalize();
    let turn = DMat3::from_cols(right, back.cross(right), back);
    Camera {
        name: String::from("generated"),
        world_from_camera: DAffine3::from_mat3_translation(turn, from),
        projection: Projection::Perspective {
            yfov: 1.0,
            aspect: Some(1.0),
        },
    }
}
