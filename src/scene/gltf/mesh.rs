//! Primitives → triangle meshes: only the vertices that triangles use are read,
//! since exporters often let many primitives share one large vertex buffer.

mod attributes;
mod topology;

use std::ops::Range;

use glam::Vec3;

use self::attributes::Attributes;
use self::topology::Topology;
use super::accessor::{Buffers, Kinds, Reader};
use super::json::{Primitive, Root, Shape};
use super::node::{FARTHEST, Nodes};
use super::{Check, Limits, Warnings, extension, get, quote};
use crate::scene::{Material, Mesh};

/// The meshes that the scene's nodes refer to.
pub(super) struct Meshes {
    /// One entry for each primitive that has triangles.
    pub list: Vec<Mesh>,
    /// Entries of `list` for each mesh of the file.
    ranges: Vec<Range<u32>>,
    /// Largest absolute coordinate of each entry of `list`.
    extents: Vec<f64>,
    /// Index that stands for glTF's default material.
    default_material: u32,
}

impl Meshes {
    /// Entries of [`Self::list`] that a mesh of the file became.
    pub fn primitives_of(&self, mesh: u32) -> Range<u32> {
        self.ranges[mesh as usize].clone()
    }

    /// Largest absolute coordinate of a mesh, metres.
    pub fn extent(&self, mesh: u32) -> f64 {
        self.extents[mesh as usize]
    }

    /// Whether any primitive names no material.
    pub fn uses_default_material(&self) -> bool {
        let default = self.default_material;
        self.list.iter().any(|mesh| mesh.material == default)
    }
}

/// Loads every mesh that a node of the scene refers to.
pub(super) fn load_used(
    root: &Root,
    buffers: &Buffers,
    nodes: &Nodes,
    limits: &Limits,
    warnings: &mut Warnings,
) -> Check<Meshes> {
    let mut is_used = vec![false; root.meshes.len()];
    for placed in nodes.iter() {
        if let Some(mesh) = placed.node.mesh {
            let user = format!("nodes[{}].mesh", placed.index);
            get(&root.meshes, mesh, "meshes", &user)?;
            is_used[mesh as usize] = true;
        }
    }
    let mut loader = Loader {
        root,
        buffers,
        allows_quantization: extension::allows_quantization(root),
        triangles_left: limits.triangles,
        limits,
        warnings,
    };
    let mut meshes = Meshes {
        list: Vec::new(),
        ranges: vec![0..0; root.meshes.len()],
        extents: Vec::new(),
        default_material: root.materials.len() as u32,
    };
    for (i, mesh) in root.meshes.iter().enumerate() {
        if !is_used[i] {
            continue;
        }
        let start = meshes.list.len() as u32;
        for (k, primitive) in mesh.primitives.iter().enumerate() {
            let user = format!("meshes[{i}].primitives[{k}]");
            if let Some(mut loaded) = loader.primitive(primitive, &user)? {
                let own = mesh.name.as_deref().unwrap_or("mesh");
                loaded.name = format!("{own} ({user})");
                let farthest = loaded.positions.iter().map(|p| p.abs().max_element());
                meshes.extents.push(farthest.fold(0.0, f32::max).into());
                meshes.list.push(loaded);
            }
        }
        meshes.ranges[i] = start..meshes.list.len() as u32;
    }
    Ok(meshes)
}

struct Loader<'a, 'b> {
    root: &'a Root,
    buffers: &'a Buffers<'a>,
    allows_quantization: bool,
    triangles_left: u64,
    limits: &'a Limits,
    warnings: &'b mut Warnings,
}

impl Loader<'_, '_> {
    /// One primitive, or `None` where it has no triangles.
    fn primitive(&mut self, primitive: &Primitive, user: &str) -> Check<Option<Mesh>> {
        let Some(topology) = Topology::from_mode(primitive.mode, user)? else {
            self.warnings.push(format!(
                "{user} is left out: points and lines are not drawn"
            ));
            return Ok(None);
        };
        let Some(position) = primitive.attributes.position else {
            self.warnings
                .push(format!("{user} is left out: it has no POSITION"));
            return Ok(None);
        };
        if !primitive.targets.is_empty() {
            self.warnings
                .push(format!("{user}: morph targets are not applied"));
        }
        let quantized = if self.allows_quantization {
            Kinds::SMALL_INTEGER
                .or(Kinds::UNSIGNED_NORMALIZED)
                .or(Kinds::SIGNED_NORMALIZED)
        } else {
            Kinds::FLOAT
        };
        let positions = self.buffers.reader(
            position,
            &format!("POSITION of {user}"),
            &[Shape::Vec3],
            Kinds::FLOAT.or(quantized),
        )?;
        let mut mesh = Mesh {
            triangles: self.triangles(primitive, topology, &positions, user)?,
            material: match primitive.material {
                None => self.root.materials.len() as u32,
                Some(index) => {
                    let user = format!("{user}.material");
                    get(&self.root.materials, index, "materials", &user)?;
                    index
                }
            },
            ..Mesh::default()
        };
        if mesh.triangles.is_empty() {
            return Ok(None);
        }
        let used = topology::compact(&mut mesh.triangles, positions.count);
        for &i in &used {
            mesh.positions.push(position_at(&positions, i)?);
        }
        Attributes {
            buffers: self.buffers,
            vertex_count: positions.count,
            quantized,
            used: &used,
            user,
        }
        .load(&primitive.attributes, &mut mesh, self.warnings)?;
        Ok(Some(mesh))
    }

    /// Vertex indices of the triangles that have an area, all in range.
    fn triangles(
        &mut self,
        primitive: &Primitive,
        topology: Topology,
        positions: &Reader,
        user: &str,
    ) -> Check<Vec<[u32; 3]>> {
        let indices = match primitive.indices {
            None => None,
            Some(index) => Some(self.buffers.reader(
                index,
                &format!("indices of {user}"),
                &[Shape::Scalar],
                Kinds::INDEX,
            )?),
        };
        let corners = indices.as_ref().map_or(positions.count, |i| i.count);
        let count = topology.triangle_count(corners);
        if count > self.triangles_left {
            return Err(format!(
                "{user}: {count} more triangles exceed the cap of {} (Limits::triangles)",
                self.limits.triangles
            ));
        }
        self.triangles_left -= count;
        let corner = |k: u64| -> Check<u32> {
            let Some(indices) = &indices else {
                // In u32: there are at most three corners for each triangle under the cap.
                return Ok(k as u32);
            };
            let vertex = indices.index(k);
            if u64::from(vertex) < positions.count {
                Ok(vertex)
            } else {
                Err(format!(
                    "{}: index {vertex} at {k} is out of range, there are {} vertices",
                    indices.name(),
                    positions.count
                ))
            }
        };
        let mut triangles = Vec::new();
        for t in 0..count {
            let [a, b, c] = topology.corners(t);
            let triangle = [corner(a)?, corner(b)?, corner(c)?];
            if has_area(positions, triangle) {
                triangles.push(triangle);
            }
        }
        let dropped = count - triangles.len() as u64;
        if dropped > 0 {
            self.warnings.push(format!(
                "{user}: {dropped} of {count} triangles without area are left out"
            ));
        }
        if topology == Topology::List && corners % 3 != 0 {
            self.warnings.push(format!(
                "{user}: {corners} corners are no whole number of triangles"
            ));
        }
        Ok(triangles)
    }
}

fn position_at(positions: &Reader, i: u32) -> Check<Vec3> {
    let [x, y, z, _] = positions.floats(i.into());
    let p = Vec3::new(x, y, z);
    if p.is_finite() && f64::from(p.abs().max_element()) <= FARTHEST {
        Ok(p)
    } else {
        Err(format!(
            "{}: vertex {i} is at {x}, {y}, {z}, not finite or beyond {FARTHEST:e} m",
            positions.name()
        ))
    }
}

/// Whether a triangle spans an area. Coordinates that are not finite count as
/// area: they are refused when the vertices are read.
fn has_area(positions: &Reader, [a, b, c]: [u32; 3]) -> bool {
    if a == b || b == c || c == a {
        return false;
    }
    let at = |i: u32| {
        let [x, y, z, _] = positions.floats(i.into());
        Vec3::new(x, y, z).as_dvec3()
    };
    let origin = at(a);
    // Exact for corners that coincide or lie on an axis-parallel line.
    (at(b) - origin).cross(at(c) - origin).length_squared() != 0.0
}

/// Warns of textures whose coordinates a mesh lacks: they are looked up at 0, 0.
pub(super) fn check_texture_coordinates(
    meshes: &[Mesh],
    materials: &[Material],
    warnings: &mut Warnings,
) {
    for mesh in meshes {
        let material = &materials[mesh.material as usize];
        let missing = material
            .textures()
            .find(|t| mesh.uvs[t.uv_set as usize].is_empty());
        if let Some(texture) = missing {
            warnings.push(format!(
                "mesh {} has no TEXCOORD_{} for the textures of material {}",
                quote(&mesh.name),
                texture.uv_set,
                quote(&material.name)
            ));
        }
    }
}
