//! The two ways to answer "what does this ray meet?": our own tree, or the
//! device's ray query. They differ in what is built, bound and compiled.

use std::sync::Arc;

use glam::Vec3;

use super::upload::SceneData;
use super::vulkan::{RECORDS, texel};
use crate::bvh::{Bvh, GroupDesc, InstanceDesc, Quality};
use crate::error::Result;
use crate::gpu::{BindingKind, Blas, BlasGeometry, Buffer, Device, Resource, Tlas, TlasInstance};
use crate::layout;
use crate::spec::{Kernel, kernels};

/// The own tree of a scene.
pub(super) fn build_bvh(data: &SceneData) -> Result<Bvh> {
    let geometry = &data.geometry;
    let positions: Vec<Vec<Vec3>> = geometry
        .groups
        .iter()
        .map(|g| {
            g.triangles
                .clone()
                .flat_map(|t| geometry.corners(t))
                .collect()
        })
        .collect();
    let masked: Vec<Vec<bool>> = geometry
        .groups
        .iter()
        .map(|g| {
            if !g.has_cutouts {
                return Vec::new();
            }
            geometry.triangles[g.triangles.clone()]
                .iter()
                .map(|t| t[3] & layout::TRIANGLE_IS_MASKED != 0)
                .collect()
        })
        .collect();
    let groups: Vec<GroupDesc> = positions
        .iter()
        .zip(&masked)
        .map(|(positions, masked)| GroupDesc { positions, masked })
        .collect();
    let mut instances = Vec::new();
    if geometry.has_instances() {
        for (placement, record) in geometry.placements.iter().zip(&data.instances) {
            instances.push(InstanceDesc {
                group: placement.group as u32,
                world_from_object: world_from_object(record),
                object_from_world: [
                    record.object_from_world_x,
                    record.object_from_world_y,
                    record.object_from_world_z,
                    record.object_from_world_t,
                ],
            });
        }
    }
    Bvh::build(&groups, &instances, Quality::Balanced)
}

fn world_from_object(record: &layout::Instance) -> [[f32; 3]; 4] {
    [
        record.world_from_object_x,
        record.world_from_object_y,
        record.world_from_object_z,
        record.world_from_object_t,
    ]
}

/// What answers "what does this ray meet?".
pub(super) enum Traversal {
    Software { nodes: Buffer, records: Buffer },
    Query { scene: Tlas, bytes: u64 },
}

impl Traversal {
    /// What it adds to a kernel's bindings.
    pub fn bindings(&self) -> Vec<(u32, BindingKind)> {
        match self {
            Self::Software { .. } => vec![
                (layout::BIND_BVH_NODES, BindingKind::Texel),
                (layout::BIND_BVH_TRIANGLES, BindingKind::Texel),
            ],
            Self::Query { .. } => vec![(layout::BIND_SCENE, BindingKind::AccelerationStructure)],
        }
    }

    /// What is put there.
    pub fn resources(&self) -> Vec<(u32, Resource<'_>)> {
        match self {
            Self::Software { nodes, records } => vec![
                (layout::BIND_BVH_NODES, Resource::Buffer(nodes)),
                (layout::BIND_BVH_TRIANGLES, Resource::Buffer(records)),
            ],
            Self::Query { scene, .. } => vec![(layout::BIND_SCENE, Resource::Acceleration(scene))],
        }
    }

    /// The kernel that renders.
    pub fn path_kernel(&self) -> Kernel {
        match self {
            Self::Software { .. } => kernels::PATH_SOFTWARE,
            Self::Query { .. } => kernels::PATH_QUERY,
        }
    }

    /// The kernel that answers given rays.
    pub fn probe_kernel(&self) -> Kernel {
        match self {
            Self::Software { .. } => kernels::PROBE_SOFTWARE,
            Self::Query { .. } => kernels::PROBE_QUERY,
        }
    }

    /// Bytes of trees or acceleration structures on the device.
    pub fn bytes(&self) -> u64 {
        match self {
            Self::Software { nodes, records } => nodes.bytes() + records.bytes(),
            Self::Query { bytes, .. } => *bytes,
        }
    }
}

/// The tree on the device.
pub(super) fn upload_bvh(device: &Arc<Device>, bvh: &Bvh) -> Result<Traversal> {
    Ok(Traversal::Software {
        nodes: texel(device, "bvh nodes", RECORDS, &bvh.nodes, false)?,
        records: texel(device, "bvh triangles", RECORDS, &bvh.triangles, false)?,
    })
}

/// The device's own acceleration structures over `vertices`, two texels each.
pub(super) fn build_query(
    device: &Arc<Device>,
    data: &SceneData,
    vertices: &Buffer,
) -> Result<Traversal> {
    let geometry = &data.geometry;
    let mut bytes = 0;
    let mut groups = Vec::with_capacity(geometry.groups.len());
    for group in &geometry.groups {
        let triangles: Vec<[u32; 3]> = geometry.triangles[group.triangles.clone()]
            .iter()
            .map(|t| [t[0], t[1], t[2]])
            .collect();
        let blas = Blas::build(
            device,
            "group",
            &BlasGeometry {
                vertices,
                vertex_stride: 32,
                vertex_count: (geometry.vertices.len() / 2) as u32,
                triangles: &triangles,
                opaque: !group.has_cutouts,
            },
        )?;
        bytes += blas.bytes();
        groups.push(blas);
    }
    let instances: Vec<TlasInstance> = geometry
        .placements
        .iter()
        .zip(&data.instances)
        .map(|(placement, record)| TlasInstance {
            blas: &groups[placement.group],
            world_from_object: world_from_object(record),
        })
        .collect();
    let scene = Tlas::build(device, "scene", &instances)?;
    bytes += scene.bytes();
    Ok(Traversal::Query { scene, bytes })
}
