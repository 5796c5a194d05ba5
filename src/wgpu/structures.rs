//! Acceleration structures through wgpu, as [`crate::gpu`] has them: triangles of one group or boxes around them, and
//! groups placed in the world.

use wgpu::util::DeviceExt;

use super::Device;
use crate::error::Result;

/// What is in one group.
pub(crate) enum Shapes<'a> {
    /// Indices of vertices.
    Triangles(&'a [[u32; 3]]),
    /// Low and high corners.
    Boxes(&'a [[[f32; 3]; 2]]),
}

/// A group placed in the world.
pub(crate) struct Placement {
    /// Index of the group.
    pub group: usize,
    /// Columns of the object-to-world matrix: images of x, y and z, and the translation.
    pub world_from_object: [[f32; 3]; 4],
}

/// The scene as rays of the device see it.
pub(crate) struct Structures {
    pub(super) scene: wgpu::Tlas,
}

impl Device {
    /// Builds structures of `groups`, each with whether no triangle of it is cut out, and over `placements` of them,
    /// whose places are the custom indices. `vertices`: a position in the first twelve of every 32 bytes.
    pub fn structures<'a>(
        &self,
        vertices: &[u8],
        groups: impl Iterator<Item = (Shapes<'a>, bool)>,
        placements: &[Placement],
    ) -> Result<Structures> {
        let vertices = self.build_input(vertices);
        let groups: Vec<wgpu::Blas> = groups
            .map(|(shapes, opaque)| self.group(&vertices, &shapes, opaque))
            .collect::<Result<_>>()?;
        self.watch("acceleration structure", || {
            let mut scene = self.raw.create_tlas(&wgpu::CreateTlasDescriptor {
                label: None,
                max_instances: placements.len().max(1) as u32,
                flags: wgpu::AccelerationStructureFlags::PREFER_FAST_TRACE,
                update_mode: wgpu::AccelerationStructureUpdateMode::Build,
            });
            for (index, placement) in placements.iter().enumerate() {
                let columns = placement.world_from_object;
                // row by row
                let transform = std::array::from_fn(|i| columns[i % 4][i / 4]);
                let blas = &groups[placement.group];
                let instance = wgpu::TlasInstance::new(blas, transform, index as u32, 0xFF);
                scene[index] = Some(instance);
            }
            let mut encoder = self.raw.create_command_encoder(&Default::default());
            encoder.build_acceleration_structures([], [&scene]);
            self.queue.submit([encoder.finish()]);
            Structures { scene }
        })
    }

    fn group(
        &self,
        vertices: &wgpu::Buffer,
        shapes: &Shapes<'_>,
        opaque: bool,
    ) -> Result<wgpu::Blas> {
        let flags = match opaque {
            true => wgpu::AccelerationStructureGeometryFlags::OPAQUE,
            false => wgpu::AccelerationStructureGeometryFlags::empty(),
        };
        let create = |sizes| {
            let desc = wgpu::CreateBlasDescriptor {
                label: None,
                flags: wgpu::AccelerationStructureFlags::PREFER_FAST_TRACE,
                update_mode: wgpu::AccelerationStructureUpdateMode::Build,
            };
            self.raw.create_blas(&desc, sizes)
        };
        self.watch("acceleration structure", || match shapes {
            Shapes::Triangles(triangles) => {
                let size = wgpu::BlasTriangleGeometrySizeDescriptor {
                    vertex_format: wgpu::VertexFormat::Float32x3,
                    vertex_count: (vertices.size() / 32) as u32,
                    index_format: Some(wgpu::IndexFormat::Uint32),
                    index_count: Some(3 * triangles.len() as u32),
                    flags,
                };
                let blas = create(wgpu::BlasGeometrySizeDescriptors::Triangles {
                    descriptors: vec![size.clone()],
                });
                let geometry = wgpu::BlasTriangleGeometry {
                    size: &size,
                    vertex_buffer: vertices,
                    first_vertex: 0,
                    vertex_stride: 32,
                    index_buffer: Some(&self.build_input(bytemuck::cast_slice(triangles))),
                    first_index: Some(0),
                    transform_buffer: None,
                    transform_buffer_offset: None,
                };
                self.fill(
                    &blas,
                    wgpu::BlasGeometries::TriangleGeometries(vec![geometry]),
                );
                blas
            }
            Shapes::Boxes(boxes) => {
                let size = wgpu::BlasAABBGeometrySizeDescriptor {
                    primitive_count: boxes.len() as u32,
                    flags,
                };
                let blas = create(wgpu::BlasGeometrySizeDescriptors::AABBs {
                    descriptors: vec![size.clone()],
                });
                let geometry = wgpu::BlasAabbGeometry {
                    size: &size,
                    stride: size_of::<[[f32; 3]; 2]>() as u64,
                    aabb_buffer: &self.build_input(bytemuck::cast_slice(boxes)),
                    primitive_offset: 0,
                };
                self.fill(&blas, wgpu::BlasGeometries::AabbGeometries(vec![geometry]));
                blas
            }
        })
    }

    fn fill(&self, blas: &wgpu::Blas, geometry: wgpu::BlasGeometries<'_>) {
        let mut encoder = self.raw.create_command_encoder(&Default::default());
        let entry = wgpu::BlasBuildEntry { blas, geometry };
        encoder.build_acceleration_structures([&entry], []);
        self.queue.submit([encoder.finish()]);
    }

    fn build_input(&self, contents: &[u8]) -> wgpu::Buffer {
        self.raw
            .create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: None,
                contents,
                usage: wgpu::BufferUsages::BLAS_INPUT,
            })
    }
}
