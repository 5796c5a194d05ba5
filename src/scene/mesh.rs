//! Triangles with their attributes, in object space.

use glam::{Vec2, Vec3, Vec4};

/// An indexed triangle mesh with one material. Optional attributes are empty
/// when absent, else as long as `positions`.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// For messages: mesh and primitive of the file.
    pub name: String,
    /// Vertex positions, metres; finite.
    pub positions: Vec<Vec3>,
    /// Shading normals, unit length.
    pub normals: Vec<Vec3>,
    /// Tangents, unit length, with the sign of the bitangent in `w`.
    pub tangents: Vec<Vec4>,
    /// Two sets of texture coordinates.
    pub uvs: [Vec<Vec2>; 2],
    /// Factors on the base colour, linear Rec. 709 and alpha.
    pub colors: Vec<Vec4>,
    /// Vertex indices, counter-clockwise seen from the front; in range.
    pub triangles: Vec<[u32; 3]>,
    /// Index into [`super::Scene::materials`].
    pub material: u32,
}

impl Mesh {
    /// Object-space bounding box of the vertices in use, metres; `None` when there are no triangles.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        let mut used = self
            .triangles
            .iter()
            .flatten()
            .map(|&v| self.positions[v as usize]);
        let first = used.next()?;
        Some(used.fold((first, first), |(low, high), p| (low.min(p), high.max(p))))
    }
}
