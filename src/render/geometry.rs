//! Meshes and instances → the flat arrays that both traversals and the kernels
//! read. Meshes that are placed once go to world space, into one group; meshes
//! that are placed often keep a group of their own unless copying them is cheap.

use std::path::PathBuf;

use glam::{DAffine3, DMat3, DVec3, Vec3};

use super::identity::Owner;
use super::solids::Solids;
use crate::bvh::MAX_COORDINATE;
use crate::error::{Error, Result};
use crate::layout;
use crate::scene::{AlphaMode, Mesh, Scene};

/// Meshes are copied into world space as long as that adds no more triangles than
/// this: one level is faster to trace, two levels are smaller.
pub const DEFAULT_COPY_LIMIT: usize = 500_000;

/// A normal this close to the triangle's own is the same one: it is dropped, so
/// that flat meshes pay nothing and keep an exact normal.
const FLAT_NORMAL: f32 = 1e-5;

/// A list of triangles with one acceleration structure.
#[derive(Clone, Debug, Default)]
pub struct Group {
    /// Its triangles in [`Geometry::triangles`].
    pub triangles: std::ops::Range<usize>,
    /// Whether any triangle may be cut out.
    pub has_cutouts: bool,
}

/// A placed group.
#[derive(Clone, Debug)]
pub struct Placement {
    /// Index into [`Geometry::groups`].
    pub group: usize,
    /// Object to world, relative to the scene's origin.
    pub world_from_object: DAffine3,
}

/// All geometry of a scene, ready to be uploaded.
#[derive(Debug, Default)]
pub struct Geometry {
    /// Subtracted from all world positions, metres.
    pub origin: DVec3,
    /// (vertex, vertex, vertex, material | flags).
    pub triangles: Vec<[u32; 4]>,
    /// Two texels a vertex: (position, u), (normal, v).
    pub vertices: Vec<[f32; 4]>,
    /// Three texels a vertex, or empty: tangent, colour, second coordinates.
    pub attributes: Vec<[f32; 4]>,
    /// Group 0 is in world space; it may be empty.
    pub groups: Vec<Group>,
    /// Placement 0 is group 0.
    pub placements: Vec<Placement>,
    /// Which placed primitive each triangle comes from, sorted.
    pub owners: Vec<Owner>,
    /// Radius of a sphere about the middle of the scene that holds it, metres.
    pub radius: f64,
    /// Any triangle has shading normals of its own.
    pub has_normals: bool,
}

impl Geometry {
    /// Flattens the scene; `copy_limit` as in [`DEFAULT_COPY_LIMIT`], `solids` as [`Solids::of`] finds them.
    pub fn new(scene: &Scene, solids: &Solids, copy_limit: usize) -> Self {
        let (low, high) = scene.bounds().unwrap_or_default();
        let centre = 0.5 * (low + high);
        let radius = 0.5 * (high - low).length();
        // Single precision is spent on the scene and not on where it stands.
        // Scenes around the origin stay as they are, to the bit.
        let origin = if centre.abs().max_element() > 2.0 * radius {
            centre
        } else {
            DVec3::ZERO
        };
        let mut geometry = Self {
            origin,
            radius,
            groups: vec![Group::default()],
            placements: vec![Placement {
                group: 0,
                world_from_object: DAffine3::IDENTITY,
            }],
            ..Self::default()
        };
        let has_attributes = needs_attributes(scene);

        let mut uses = vec![0usize; scene.meshes.len()];
        for instance in &scene.instances {
            uses[instance.mesh as usize] += 1;
        }
        let copied: usize = scene
            .meshes
            .iter()
            .zip(&uses)
            .filter(|(_, n)| **n > 1)
            .map(|(mesh, n)| mesh.triangles.len() * n)
            .sum();
        let is_shared = |mesh: u32| uses[mesh as usize] > 1 && copied > copy_limit;

        let records = || (0..).zip(&scene.instances).zip(&solids.records);
        for ((number, instance), record) in records().filter(|((_, i), _)| !is_shared(i.mesh)) {
            geometry.owners.push(Owner {
                placement: 0,
                first_triangle: geometry.triangles.len() as u32,
                instance: number,
                material: scene.meshes[instance.mesh as usize].material,
            });
            let place = DAffine3 {
                translation: instance.world_from_object.translation - origin,
                ..instance.world_from_object
            };
            geometry.append(
                scene,
                instance.mesh,
                *record,
                solids,
                &place,
                has_attributes,
            );
        }
        geometry.groups[0].triangles = 0..geometry.triangles.len();

        let mut group_of = vec![None; scene.meshes.len()];
        for ((number, instance), record) in records().filter(|((_, i), _)| is_shared(i.mesh)) {
            let group = *group_of[instance.mesh as usize].get_or_insert_with(|| {
                let first = geometry.triangles.len();
                let place = DAffine3::IDENTITY;
                geometry.append(
                    scene,
                    instance.mesh,
                    *record,
                    solids,
                    &place,
                    has_attributes,
                );
                let triangles = first..geometry.triangles.len();
                geometry.groups.push(Group {
                    triangles,
                    has_cutouts: false,
                });
                geometry.groups.len() - 1
            });
            geometry.owners.push(Owner {
                placement: geometry.placements.len() as u32,
                first_triangle: 0,
                instance: number,
                material: scene.meshes[instance.mesh as usize].material,
            });
            geometry.placements.push(Placement {
                group,
                world_from_object: DAffine3 {
                    translation: instance.world_from_object.translation - origin,
                    ..instance.world_from_object
                },
            });
        }
        for group in &mut geometry.groups {
            group.has_cutouts = geometry.triangles[group.triangles.clone()]
                .iter()
                .any(|t| t[3] & layout::TRIANGLE_IS_MASKED != 0);
        }
        geometry
    }

    /// What no traversal can take is refused before the driver sees it.
    ///
    /// # Errors
    /// A vertex or a placement is not finite or too far away.
    pub fn check(&self) -> Result<()> {
        let limit = f64::from(MAX_COORDINATE);
        let positions = self.vertices.iter().step_by(2);
        // NaN fails the comparison as well.
        let is_near = |p: DVec3| p.to_array().iter().all(|x| x.abs() <= limit);
        let far = positions.map(|p| Vec3::from_slice(&p[..3]).as_dvec3());
        let places = self.placements.iter().map(|p| p.world_from_object);
        let columns = places.flat_map(|p| {
            let m = p.matrix3;
            [m.x_axis, m.y_axis, m.z_axis, p.translation]
        });
        match far.chain(columns).find(|p| !is_near(*p)) {
            None => Ok(()),
            Some(p) => Err(Error::Scene {
                path: PathBuf::from("(geometry)"),
                what: format!(
                    "a vertex or a placement at {p} is not a number or beyond {limit:e} m; rescale the scene"
                ),
            }),
        }
    }

    /// Whether there is more than the group in world space.
    pub fn has_instances(&self) -> bool {
        self.placements.len() > 1
    }

    /// Position of a vertex in its group's space, metres.
    pub fn position(&self, vertex: u32) -> Vec3 {
        Vec3::from_slice(&self.vertices[2 * vertex as usize][..3])
    }

    /// Corners of a triangle in its group's space, metres.
    pub fn corners(&self, triangle: usize) -> [Vec3; 3] {
        let [a, b, c, _] = self.triangles[triangle];
        [a, b, c].map(|v| self.position(v))
    }

    /// Bytes of the arrays here, on the device.
    pub fn bytes(&self) -> u64 {
        let texels = self.triangles.len() + self.vertices.len() + self.attributes.len();
        16 * texels as u64
    }

    /// Appends one mesh with a material record, carried by `place`.
    fn append(
        &mut self,
        scene: &Scene,
        mesh: u32,
        record: u32,
        solids: &Solids,
        place: &DAffine3,
        has_attributes: bool,
    ) {
        let mesh = &scene.meshes[mesh as usize];
        let material = &scene.materials[mesh.material as usize];
        let first = (self.vertices.len() / 2) as u32;
        let is_mirrored = place.matrix3.determinant() < 0.0;
        let normal_matrix = place.matrix3.inverse().transpose();

        for i in 0..mesh.positions.len() {
            let p = place
                .transform_point3(mesh.positions[i].as_dvec3())
                .as_vec3();
            let n = mesh
                .normals
                .get(i)
                .map_or(Vec3::ZERO, |n| turned(normal_matrix, *n));
            let uv = mesh.uvs[0].get(i).copied().unwrap_or_default();
            self.vertices.push(p.extend(uv.x).to_array());
            self.vertices.push(n.extend(uv.y).to_array());
            if has_attributes {
                let tangent = mesh.tangents.get(i).copied().unwrap_or_default();
                let sign = if is_mirrored { -tangent.w } else { tangent.w };
                let t = turned(place.matrix3, tangent.truncate());
                self.attributes.push(t.extend(sign).to_array());
                let color = mesh.colors.get(i).copied().unwrap_or(glam::Vec4::ONE);
                self.attributes.push(color.to_array());
                let uv1 = mesh.uvs[1].get(i).copied().unwrap_or_default();
                self.attributes.push([uv1.x, uv1.y, 0.0, 0.0]);
            }
        }

        let mut flags = record;
        if !mesh.tangents.is_empty() {
            flags |= layout::TRIANGLE_HAS_TANGENTS;
        }
        if !mesh.colors.is_empty() {
            flags |= layout::TRIANGLE_HAS_COLORS;
        }
        // Rays skip a boundary of overlapping solids that they just crossed, which asks for the same test as cut-outs.
        let is_skipped = solids.are_nested && material.volume.is_some();
        if is_skipped || matches!(material.alpha_mode, AlphaMode::Mask { .. }) {
            flags |= layout::TRIANGLE_IS_MASKED;
        }
        for (triangle, is_curved) in mesh.triangles.iter().zip(curved(mesh)) {
            let [a, b, c] = triangle.map(|v| first + v);
            // The winding says which side is the front; mirroring turns it round.
            let [b, c] = if is_mirrored { [c, b] } else { [b, c] };
            let own = if is_curved {
                layout::TRIANGLE_HAS_NORMALS
            } else {
                0
            };
            self.has_normals |= is_curved;
            self.triangles.push([a, b, c, flags | own]);
        }
    }
}

/// A direction carried by a matrix, unit length; zero stays zero.
fn turned(matrix: DMat3, v: Vec3) -> Vec3 {
    (matrix * v.as_dvec3()).normalize_or_zero().as_vec3()
}

/// For each triangle whether its shading normals differ from its own normal.
fn curved(mesh: &Mesh) -> Vec<bool> {
    mesh.triangles
        .iter()
        .map(|triangle| {
            if mesh.normals.is_empty() {
                return false;
            }
            let [a, b, c] = triangle.map(|v| mesh.positions[v as usize].as_dvec3());
            let own = (b - a).cross(c - a).normalize_or_zero().as_vec3();
            triangle
                .iter()
                .any(|&v| (mesh.normals[v as usize] - own).abs().max_element() > FLAT_NORMAL)
        })
        .collect()
}

/// Whether any mesh in use has vertex colours, or tangents or second coordinates that its material asks for.
fn needs_attributes(scene: &Scene) -> bool {
    scene.instances.iter().any(|instance| {
        let mesh = &scene.meshes[instance.mesh as usize];
        let material = &scene.materials[mesh.material as usize];
        !mesh.colors.is_empty()
            || (!mesh.tangents.is_empty() && material.normal_texture.is_some())
            || material.textures().any(|t| t.uv_set == 1)
    })
}
