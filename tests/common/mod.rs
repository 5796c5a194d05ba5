//! Small scenes made by hand and one way to render them, for the tests of whole pictures.

use etendue::Error;
use etendue::film::Film;
use etendue::render::{Control, DeviceOptions, Renderer, Report, Tuning, Workshop};
use etendue::scene::{Camera, Environment, Instance, Material, Mesh, Projection, Scene};
use etendue::settings::{BackendChoice, Settings};
use glam::{DAffine3, DMat3, DVec3, Vec2, Vec3};

#[allow(dead_code, reason = "not every test program asks for all")]
pub mod backends;

/// Half of the time of these tests would go into kernels that another test had before.
pub static WORKSHOP: Workshop = Workshop::new();

/// What came out of [`render`].
pub struct Rendered {
    pub film: Film,
    pub report: Report,
}

/// Renders under validation, and asserts that no sample was dropped and that
/// validation had nothing to say. Without a device that can do it: `None` and
/// a printed reason, or a failure where `ETENDUE_REQUIRE_DEVICE` is set.
pub fn render(scene: &Scene, settings: &Settings, tuning: Tuning) -> Option<Rendered> {
    let mut renderer = open(scene, settings, tuning)?;
    let film = renderer.render(&mut |_| Control::Continue).unwrap();
    let report = renderer.report();
    assert_eq!(
        film.samples(),
        settings.samples.end - settings.samples.start
    );
    assert_eq!(report.ledger.non_finite, 0, "samples were dropped");
    assert_eq!(renderer.validation_messages(), Vec::<String>::new());
    Some(Rendered { film, report })
}

/// A renderer under validation, or the printed reason why there is none.
pub fn open(scene: &Scene, settings: &Settings, tuning: Tuning) -> Option<Renderer> {
    let options = DeviceOptions {
        validation: true,
        ..DeviceOptions::default()
    };
    match Renderer::made_in(&WORKSHOP, scene, settings, &options, tuning) {
        Ok(renderer) => Some(renderer),
        Err(error @ Error::Unsupported { .. }) if !backends::is_device_required() => {
            println!("skipped: {error}");
            None
        }
        Err(error) => panic!("{error}"),
    }
}

/// Of the random numbers: always the same, unless `ETENDUE_SEED` says another one.
fn seed() -> u64 {
    let asked = std::env::var("ETENDUE_SEED").ok();
    asked.and_then(|n| n.parse().ok()).unwrap_or(1)
}

/// A square frame of `side` pixels and `samples` samples with our own tree.
pub fn settings(side: u32, samples: u64) -> Settings {
    Settings {
        width: side,
        height: side,
        samples: 0..samples,
        seed: seed(),
        backend: BackendChoice::Bvh,
        ..Settings::default()
    }
}

/// Pure Lambert with the same albedo in all channels.
pub fn lambert(albedo: f32) -> Material {
    Material {
        name: String::from("lambert"),
        base_color: Vec3::splat(albedo).extend(1.0),
        metallic: 0.0,
        specular: 0.0,
        ..Material::default()
    }
}

/// A metal with the same F0 in all channels.
pub fn metal(f0: f32, roughness: f32) -> Material {
    Material {
        name: String::from("metal"),
        base_color: Vec3::splat(f0).extend(1.0),
        roughness,
        ..Material::default()
    }
}

/// Lambert that also emits `radiance`, cd/m², from its front.
pub fn emitter(albedo: f32, radiance: f32) -> Material {
    Material {
        name: String::from("emitter"),
        emission: Vec3::splat(radiance),
        ..lambert(albedo)
    }
}

/// A rectangle with its corners counter-clockwise seen from the front; uv runs
/// from (0, 0) at the first corner to (1, 1) at the third.
pub fn quad(corners: [Vec3; 4]) -> Mesh {
    Mesh {
        name: String::from("quad"),
        positions: corners.to_vec(),
        uvs: [vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y], Vec::new()],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    }
}

/// A square about `centre` with half-edge `half`, its front towards `normal`.
pub fn square(centre: Vec3, normal: Vec3, half: f32) -> Mesh {
    let x = half * normal.any_orthonormal_vector();
    let y = normal.cross(x);
    quad([-x - y, x - y, x + y, y - x].map(|p| centre + p))
}

/// The cube −half … half with its fronts inside.
pub fn room(half: f32) -> Mesh {
    let mut mesh = Mesh {
        name: String::from("room"),
        ..Mesh::default()
    };
    for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
        for normal in [axis, -axis] {
            let wall = square(-half * normal, normal, half);
            let first = mesh.positions.len() as u32;
            mesh.positions.extend(wall.positions);
            mesh.triangles
                .extend(wall.triangles.iter().map(|t| t.map(|v| first + v)));
        }
    }
    mesh
}

/// A unit sphere from an octahedron whose faces were split `levels` times, with smooth normals.
pub fn sphere(levels: u32) -> Mesh {
    let (x, y, z) = (Vec3::X, Vec3::Y, Vec3::Z);
    let mut faces: Vec<[Vec3; 3]> = [
        [x, y, z],
        [y, -x, z],
        [-x, -y, z],
        [-y, x, z],
        [y, x, -z],
        [-x, y, -z],
        [-y, -x, -z],
        [x, -y, -z],
    ]
    .to_vec();
    for _ in 0..levels {
        faces = faces
            .iter()
            .flat_map(|&[a, b, c]| {
                // The sums are symmetric, so that neighbours get the same bits.
                let (ab, bc, ca) = (
                    (a + b).normalize(),
                    (b + c).normalize(),
                    (c + a).normalize(),
                );
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    let positions: Vec<Vec3> = faces.into_iter().flatten().collect();
    Mesh {
        name: String::from("sphere"),
        triangles: (0..positions.len() as u32 / 3)
            .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
            .collect(),
        normals: positions.clone(),
        positions,
        ..Mesh::default()
    }
}

/// The mesh with flat faces.
pub fn faceted(mesh: Mesh) -> Mesh {
    Mesh {
        normals: Vec::new(),
        ..mesh
    }
}

/// A scene without anything.
pub fn empty() -> Scene {
    Scene::default()
}

/// Adds a mesh of a material where it stands.
pub fn add(scene: &mut Scene, mesh: Mesh, material: Material) {
    add_at(scene, mesh, material, DAffine3::IDENTITY);
}

/// Adds a mesh of a material at a place.
pub fn add_at(scene: &mut Scene, mut mesh: Mesh, material: Material, place: DAffine3) {
    mesh.material = scene.materials.len() as u32;
    scene.instances.push(Instance {
        name: mesh.name.clone(),
        mesh: scene.meshes.len() as u32,
        world_from_object: place,
    });
    scene.meshes.push(mesh);
    scene.materials.push(material);
}

/// The same radiance, cd/m², from everywhere.
pub fn constant_sky(radiance: f32) -> Option<Environment> {
    Some(Environment::Constant(Vec3::splat(radiance)))
}

/// A camera at `from` that looks at `at`.
fn camera(from: DVec3, at: DVec3, projection: Projection) -> Camera {
    let back = (from - at).normalize();
    let right = back.any_orthonormal_vector();
    Camera {
        name: String::from("camera"),
        world_from_camera: DAffine3 {
            matrix3: DMat3::from_cols(right, back.cross(right), back),
            translation: from,
        },
        projection,
    }
}

/// A pinhole with a full field of view of `degrees`.
pub fn pinhole(from: DVec3, at: DVec3, degrees: f32) -> Camera {
    let yfov = degrees.to_radians();
    camera(from, at, Projection::Perspective { yfov, aspect: None })
}

/// Parallel rays; `half` is half the height of the view, metres.
pub fn parallel(from: DVec3, at: DVec3, half: f64) -> Camera {
    let mag = half as f32;
    let projection = Projection::Orthographic {
        xmag: mag,
        ymag: mag,
    };
    camera(from, at, projection)
}

/// The scene scaled about the origin by `scale` and then moved, cameras included.
pub fn carried(mut scene: Scene, scale: f64, offset: DVec3) -> Scene {
    let place = DAffine3 {
        matrix3: DMat3::from_diagonal(DVec3::splat(scale)),
        translation: offset,
    };
    for instance in &mut scene.instances {
        instance.world_from_object = place * instance.world_from_object;
    }
    for camera in &mut scene.cameras {
        let position = camera.world_from_camera.translation;
        camera.world_from_camera.translation = place.transform_point3(position);
        if let Projection::Orthographic { xmag, ymag } = &mut camera.projection {
            *xmag *= scale as f32;
            *ymag *= scale as f32;
        }
    }
    scene
}
