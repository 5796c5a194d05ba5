//! Normals, tangents, texture coordinates and colours of the vertices in use.

use glam::{DVec3, Vec2, Vec3, Vec4};

use crate::scene::Mesh;
use crate::scene::gltf::accessor::{Buffers, Kinds, Reader};
use crate::scene::gltf::json::{self, Shape};
use crate::scene::gltf::{Check, Warnings};

/// What is needed to read a primitive's attributes.
pub(super) struct Attributes<'a> {
    pub buffers: &'a Buffers<'a>,
    /// Vertices of the file; every attribute must have as many.
    pub vertex_count: u64,
    /// What KHR_mesh_quantization allows; without it nothing beyond floats.
    pub quantized: Kinds,
    /// The vertices to read, in order.
    pub used: &'a [u32],
    pub user: &'a str,
}

impl Attributes<'_> {
    /// Fills in what the primitive has.
    pub fn load(
        &self,
        from: &json::Attributes,
        mesh: &mut Mesh,
        warnings: &mut Warnings,
    ) -> Check<()> {
        let coordinates = Kinds::FLOAT
            .or(Kinds::UNSIGNED_NORMALIZED)
            .or(self.quantized);
        for (set, index) in [from.texcoord_0, from.texcoord_1].into_iter().enumerate() {
            let name = format!("TEXCOORD_{set}");
            if let Some(reader) = self.reader(index, &name, &[Shape::Vec2], coordinates)? {
                for &i in self.used {
                    let [u, v, ..] = reader.finite(i.into())?;
                    mesh.uvs[set].push(Vec2::new(u, v));
                }
            }
        }
        let kinds = Kinds::FLOAT.or(Kinds::UNSIGNED_NORMALIZED);
        let shapes = [Shape::Vec3, Shape::Vec4];
        if let Some(reader) = self.reader(from.color_0, "COLOR_0", &shapes, kinds)? {
            self.colors(&reader, mesh, warnings)?;
        }
        let directions = match self.quantized.intersects(Kinds::SIGNED_NORMALIZED) {
            true => Kinds::FLOAT.or(Kinds::SIGNED_NORMALIZED),
            false => Kinds::FLOAT,
        };
        if let Some(reader) = self.reader(from.normal, "NORMAL", &[Shape::Vec3], directions)? {
            self.normals(&reader, mesh, warnings);
            // Without normals tangents are to be ignored, says the specification.
            let tangents = self.reader(from.tangent, "TANGENT", &[Shape::Vec4], directions)?;
            if let Some(reader) = tangents {
                self.tangents(&reader, mesh, warnings);
            }
        }
        Ok(())
    }

    fn reader(
        &self,
        index: Option<u32>,
        name: &str,
        shapes: &[Shape],
        kinds: Kinds,
    ) -> Check<Option<Reader<'_>>> {
        let Some(index) = index else {
            return Ok(None);
        };
        let user = format!("{name} of {}", self.user);
        let reader = self.buffers.reader(index, &user, shapes, kinds)?;
        if reader.count != self.vertex_count {
            return Err(format!(
                "{}: count is {}, but POSITION has {}",
                reader.name(),
                reader.count,
                self.vertex_count
            ));
        }
        Ok(Some(reader))
    }

    fn colors(&self, reader: &Reader, mesh: &mut Mesh, warnings: &mut Warnings) -> Check<()> {
        let mut clamped = 0_u64;
        for &i in self.used {
            let [r, g, b, a] = reader.finite(i.into())?;
            let alpha = if reader.components == 4 { a } else { 1.0 };
            let color = Vec4::new(r, g, b, alpha);
            // A factor above 1 would reflect more light than arrives.
            let valid = color.clamp(Vec4::ZERO, Vec4::ONE);
            clamped += u64::from(valid != color);
            mesh.colors.push(valid);
        }
        if clamped > 0 {
            warnings.push(format!(
                "{}: {clamped} colours are clamped to 0 … 1",
                reader.name()
            ));
        }
        Ok(())
    }

    fn normals(&self, reader: &Reader, mesh: &mut Mesh, warnings: &mut Warnings) {
        let mut bad = Vec::new();
        for (k, &i) in self.used.iter().enumerate() {
            let normal = unit(reader.floats(i.into()));
            if normal.is_none() {
                bad.push(k);
            }
            mesh.normals.push(normal.unwrap_or(Vec3::ZERO));
        }
        if bad.is_empty() {
            return;
        }
        warnings.push(format!(
            "{}: {} normals are zero or not finite; they are computed from the triangles",
            reader.name(),
            bad.len()
        ));
        replace_normals(mesh, &bad);
    }

    fn tangents(&self, reader: &Reader, mesh: &mut Mesh, warnings: &mut Warnings) {
        let mut tangents = Vec::new();
        for &i in self.used {
            let [x, y, z, w] = reader.floats(i.into());
            let Some(tangent) = unit([x, y, z, 0.0]).filter(|_| !w.is_nan()) else {
                warnings.push(format!(
                    "{}: vertex {i} has no direction; all tangents of this mesh are left out",
                    reader.name()
                ));
                return;
            };
            tangents.push(tangent.extend(if w < 0.0 { -1.0 } else { 1.0 }));
        }
        mesh.tangents = tangents;
    }
}

/// The unit vector along the first three components, `None` for zero, NaN and infinity.
fn unit([x, y, z, _]: [f32; 4]) -> Option<Vec3> {
    // In double precision, so that short vectors do not underflow.
    let v = DVec3::new(x.into(), y.into(), z.into());
    v.try_normalize().map(|v| v.as_vec3())
}

/// Gives the vertices `bad` (increasing) the mean normal of their triangles, weighted by area.
fn replace_normals(mesh: &mut Mesh, bad: &[usize]) {
    let mut sums = vec![(DVec3::ZERO, DVec3::ZERO); bad.len()];
    for triangle in &mesh.triangles {
        for vertex in triangle {
            let Ok(k) = bad.binary_search(&(*vertex as usize)) else {
                continue;
            };
            let [a, b, c] = triangle.map(|v| mesh.positions[v as usize].as_dvec3());
            let normal = (b - a).cross(c - a);
            let (sum, last) = &mut sums[k];
            *sum += normal;
            *last = normal;
        }
    }
    for (&vertex, (sum, last)) in bad.iter().zip(sums) {
        // Faces that cancel leave one of them; every triangle kept has an area.
        let normal = sum.try_normalize().or_else(|| last.try_normalize());
        mesh.normals[vertex] = normal.unwrap_or(DVec3::Y).as_vec3();
    }
}
