//! Small scenes, and the random numbers that the tests are made of.

use etendue::scene::{
    AlphaMode, Camera, Environment, Filter, Instance, Material, Mesh, Projection, Scene, Texels,
    Texture, TextureRef, Wrap,
};
use glam::{DAffine3, DMat3, DVec3, Vec2, Vec3, Vec4};

pub use crate::random::Random;

impl Random {
    pub fn index(&mut self, count: usize) -> usize {
        (self.bits() % count as u64) as usize
    }

    /// Uniform in [−1, 1]³.
    pub fn cube(&mut self) -> DVec3 {
        DVec3::from([(); 3].map(|()| 2.0 * self.unit() - 1.0))
    }
}

/// Lambert of the given albedo.
pub fn lambert(albedo: f32) -> Material {
    Material {
        base_color: Vec4::new(albedo, albedo, albedo, 1.0),
        metallic: 0.0,
        specular: 0.0,
        ..Material::default()
    }
}

/// A mesh of material 0 without normals.
pub fn mesh(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Mesh {
    Mesh {
        positions,
        triangles,
        ..Mesh::default()
    }
}

/// Meshes, each placed as often as there are transforms for it.
pub fn scene(meshes: Vec<(Mesh, Vec<DAffine3>)>, materials: Vec<Material>) -> Scene {
    let mut scene = Scene {
        materials,
        ..Scene::default()
    };
    for (index, (mesh, places)) in meshes.into_iter().enumerate() {
        scene.meshes.push(mesh);
        for world_from_object in places {
            scene.instances.push(Instance {
                name: String::new(),
                mesh: index as u32,
                world_from_object,
            });
        }
    }
    scene
}

/// One mesh where it is, half white.
pub fn single(mesh: Mesh) -> Scene {
    scene(vec![(mesh, vec![DAffine3::IDENTITY])], vec![lambert(0.5)])
}

/// Adds a camera at `eye` that looks at `target`.
pub fn look_at(scene: &mut Scene, eye: DVec3, target: DVec3, yfov: f32) {
    let back = (eye - target).normalize();
    let right = back.any_orthonormal_vector();
    scene.cameras.push(Camera {
        name: String::new(),
        world_from_camera: DAffine3 {
            matrix3: DMat3::from_cols(right, back.cross(right), back),
            translation: eye,
        },
        projection: Projection::Perspective { yfov, aspect: None },
    });
}

/// Radiance 1 from everywhere.
pub fn white_sky(scene: &mut Scene) {
    scene.environment = Some(Environment::Constant(Vec3::ONE));
}

/// The square |x|, |y| ≤ 1 at z = 0 as a fan of four triangles about its middle,
/// counter-clockwise seen from +z. `u = (x+1)/2`, `v = (y+1)/2`.
pub fn fan() -> Mesh {
    let corners = [[0., 0.], [-1., -1.], [1., -1.], [1., 1.], [-1., 1.]];
    let mut fan = mesh(
        corners.map(|[x, y]| Vec3::new(x, y, 0.0)).to_vec(),
        vec![[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]],
    );
    fan.uvs[0] = corners
        .map(|[x, y]| Vec2::new(0.5 * x + 0.5, 0.5 * y + 0.5))
        .to_vec();
    fan
}

/// Edge length of [`checker`], texels.
pub const CHECKER: u32 = 4;

/// A texture whose alpha is 1 where the sum of column and row is even, else 0.
pub fn checker() -> Texture {
    let mut data = Vec::new();
    for row in 0..CHECKER {
        for column in 0..CHECKER {
            let alpha = if (row + column) % 2 == 0 { 255 } else { 0 };
            data.extend([255, 255, 255, alpha]);
        }
    }
    Texture {
        name: String::new(),
        width: CHECKER,
        height: CHECKER,
        texels: Texels::Rgba8 { data, srgb: false },
        wrap: [Wrap::Clamp; 2],
        filter: Filter::Nearest,
    }
}

/// A material cut out by texture 0.
pub fn cut_out(alpha_mode: AlphaMode) -> Material {
    Material {
        base_color_texture: Some(TextureRef {
            texture: 0,
            uv_set: 0,
            uv_transform: [[1., 0., 0.], [0., 1., 0.]],
        }),
        alpha_mode,
        ..lambert(0.5)
    }
}

/// The cube |x|, |y|, |z| ≤ 1 with eight shared vertices, normals outwards.
pub fn cube() -> Mesh {
    let positions = (0..8u32)
        .map(|i| Vec3::from([0, 1, 2].map(|axis| if i >> axis & 1 == 0 { -1.0 } else { 1.0 })))
        .collect();
    let sides = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    let triangles = sides
        .iter()
        .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
        .collect();
    mesh(positions, triangles)
}

/// A prism of height 2 and radius 0.9 about the y axis, normals outwards: the more sides, the thinner its triangles.
pub fn prism(sides: u32) -> Mesh {
    let ring = |y: f32| {
        (0..sides).map(move |i| {
            let (sine, cosine) =
                (std::f64::consts::TAU * f64::from(i) / f64::from(sides)).sin_cos();
            Vec3::new((0.9 * cosine) as f32, y, (-0.9 * sine) as f32)
        })
    };
    let centres = [Vec3::NEG_Y, Vec3::Y];
    let positions = ring(-1.0).chain(ring(1.0)).chain(centres).collect();
    let triangles = (0..sides)
        .flat_map(|a| {
            let b = (a + 1) % sides;
            let (c, d) = (a + sides, b + sides);
            let (low, high) = (2 * sides, 2 * sides + 1);
            [[a, b, d], [a, d, c], [b, a, low], [c, d, high]]
        })
        .collect();
    mesh(positions, triangles)
}

/// An icosahedron split `splits` times; every vertex is shared and has distance 1 from the origin.
pub fn icosphere(splits: u32) -> Mesh {
    let g = 0.5 * (1.0 + 5f64.sqrt());
    let mut points: Vec<DVec3> = Vec::new();
    for (a, b) in [(-1., g), (1., g), (-1., -g), (1., -g)] {
        points.push(DVec3::new(a, b, 0.).normalize());
    }
    for (a, b) in [(-1., g), (1., g), (-1., -g), (1., -g)] {
        points.push(DVec3::new(0., a, b).normalize());
    }
    for (a, b) in [(g, -1.), (g, 1.), (-g, -1.), (-g, 1.)] {
        points.push(DVec3::new(a, 0., b).normalize());
    }
    let mut triangles: Vec<[u32; 3]> = vec![
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    for _ in 0..splits {
        let mut middles = std::collections::BTreeMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                points.push((points[a as usize] + points[b as usize]).normalize());
                points.len() as u32 - 1
            })
        };
        triangles = triangles
            .iter()
            .flat_map(|&[a, b, c]| {
                let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
            })
            .collect();
    }
    mesh(points.iter().map(|p| p.as_vec3()).collect(), triangles)
}

/// Every position times `factor`.
pub fn scaled(mut mesh: Mesh, factor: f32) -> Mesh {
    for p in &mut mesh.positions {
        *p *= factor;
    }
    mesh
}
