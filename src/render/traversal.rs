//! The ways to answer "what does this ray meet?": our own tree, or the device's ray
//! query or ray tracing pipeline. They differ in what is built, bound, compiled and launched.

use std::path::Path;
use std::sync::Arc;

use glam::Vec3;

use super::upload::SceneData;
use super::vulkan::{RECORDS, texel};
use super::{Study, boxes, cache};
use crate::bvh::{Bvh, GroupDesc, InstanceDesc, Quality};
use crate::error::Result;
use crate::gpu::{
    BindSet, BindingKind, Blas, BlasGeometry, Buffer, Commands, Device, Pipeline, PipelineDesc,
    RayStages, Resource, Tlas, TlasInstance, Usage,
};
use crate::layout;
use crate::settings::BackendChoice;
use crate::spec::{Kernel, Spec, kernels};

/// Invocations of a work group in both kernels: INVOCATION_GROUP of invocation.glsl.
pub(super) const GROUP: u32 = 64;

/// The best tree is built of scenes with so many triangles, in a quarter of a second more.
const BEST_TRIANGLES: usize = 1 << 18;

/// The own tree of a scene, where rays are traced in it; `cache` is a folder of trees.
pub(super) fn own_tree(
    choice: BackendChoice,
    data: &SceneData,
    cache: Option<&Path>,
) -> Result<Option<Bvh>> {
    match choice {
        BackendChoice::RayQuery | BackendChoice::RayPipeline => Ok(None),
        _ => build_bvh(data, cache).map(Some),
    }
}

/// The own tree of a scene; `cache` is a folder of trees.
pub(super) fn build_bvh(data: &SceneData, cache: Option<&Path>) -> Result<Bvh> {
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
    let quality = match geometry.triangles.len() {
        0..=BEST_TRIANGLES => Quality::Best,
        _ => Quality::Balanced,
    };
    cache::tree(cache, &groups, &instances, quality)
}

/// Tells the kernels where the trees of the groups and of the top level start.
pub(super) fn note_roots(
    bvh: &Bvh,
    data: &SceneData,
    params: &mut layout::Params,
    instances: &mut [layout::Instance],
) {
    params.bvh_root = bvh.root;
    for (record, placement) in instances.iter_mut().zip(&data.geometry.placements) {
        record.bvh_root = bvh.groups[placement.group].root;
        record.bvh_first_triangle = bvh.groups[placement.group].first_record;
    }
}

pub(super) fn world_from_object(record: &layout::Instance) -> [[f32; 3]; 4] {
    [
        record.world_from_object_x,
        record.world_from_object_y,
        record.world_from_object_z,
        record.world_from_object_t,
    ]
}

/// What answers "what does this ray meet?".
pub(super) enum Traversal {
    Software {
        nodes: Buffer,
        records: Buffer,
        planes: Buffer,
        small_nodes: Buffer,
        small_records: Buffer,
    },
    Query {
        scene: Tlas,
        bytes: u64,
    },
    Pipeline {
        scene: Tlas,
        bytes: u64,
    },
}

impl Traversal {
    /// What it adds to a kernel's bindings.
    pub fn bindings(&self, by_address: bool) -> Vec<(u32, BindingKind)> {
        match self {
            Self::Software { .. } => {
                let array = match by_address {
                    true => BindingKind::Address,
                    false => BindingKind::Texel,
                };
                vec![
                    (layout::BIND_BVH_NODES, array),
                    (layout::BIND_BVH_TRIANGLES, array),
                    (layout::BIND_PLANES, array),
                    (layout::BIND_SMALL_NODES, BindingKind::Uniform),
                    (layout::BIND_SMALL_RECORDS, BindingKind::Uniform),
                ]
            }
            Self::Query { .. } | Self::Pipeline { .. } => {
                vec![(layout::BIND_SCENE, BindingKind::AccelerationStructure)]
            }
        }
    }

    /// What is put there.
    pub fn resources(&self) -> Vec<(u32, Resource<'_>)> {
        match self {
            Self::Software {
                nodes,
                records,
                planes,
                small_nodes,
                small_records,
            } => vec![
                (layout::BIND_BVH_NODES, Resource::Buffer(nodes)),
                (layout::BIND_BVH_TRIANGLES, Resource::Buffer(records)),
                (layout::BIND_PLANES, Resource::Buffer(planes)),
                (layout::BIND_SMALL_NODES, Resource::Buffer(small_nodes)),
                (layout::BIND_SMALL_RECORDS, Resource::Buffer(small_records)),
            ],
            Self::Query { scene, .. } | Self::Pipeline { scene, .. } => {
                vec![(layout::BIND_SCENE, Resource::Acceleration(scene))]
            }
        }
    }

    /// Its arrays.
    pub fn arrays(&self) -> Vec<(u32, &Buffer)> {
        match self {
            Self::Software {
                nodes,
                records,
                planes,
                ..
            } => vec![
                (layout::BIND_BVH_NODES, nodes),
                (layout::BIND_BVH_TRIANGLES, records),
                (layout::BIND_PLANES, planes),
            ],
            Self::Query { .. } | Self::Pipeline { .. } => Vec::new(),
        }
    }

    /// Compiles the kernel that renders, or one that studies it.
    pub fn path_pipeline(
        &self,
        device: &Arc<Device>,
        spec: &Spec,
        bindings: &[(u32, BindingKind)],
        study: Study,
        by_address: bool,
    ) -> Result<Pipeline> {
        let address = usize::from(by_address);
        let kernel = match (self, study) {
            (Self::Software { .. }, Study::Counts) => kernels::PATH_COUNTS[address],
            (Self::Software { .. }, Study::Record) => kernels::PATH_RECORD,
            (Self::Software { .. }, Study::Recall) => kernels::PATH_RECALL[address],
            (Self::Software { .. }, Study::Replay) => kernels::REPLAY_SOFTWARE[address],
            (Self::Software { .. }, Study::Read) => kernels::REPLAY_NOTHING[address],
            (Self::Query { .. }, Study::Replay) => kernels::REPLAY_QUERY[address],
            (Self::Pipeline { .. }, Study::Replay) => kernels::REPLAY_PIPELINE,
            (Self::Software { .. }, _) if spec.shares() => kernels::SHARE_SOFTWARE[address],
            (Self::Query { .. }, _) if spec.shares() => kernels::SHARE_QUERY[address],
            (Self::Software { .. }, _) => kernels::PATH_SOFTWARE[address],
            (Self::Query { .. }, _) => kernels::PATH_QUERY[address],
            (Self::Pipeline { .. }, _) => kernels::PATH_PIPELINE,
        };
        self.pipeline(device, "path", kernel, spec, bindings)
    }

    /// Compiles the kernel that traces photons.
    pub fn photon_pipeline(
        &self,
        device: &Arc<Device>,
        spec: &Spec,
        bindings: &[(u32, BindingKind)],
        by_address: bool,
    ) -> Result<Pipeline> {
        let address = usize::from(by_address);
        let kernel = match self {
            Self::Software { .. } => kernels::PHOTON_SOFTWARE[address],
            Self::Query { .. } => kernels::PHOTON_QUERY[address],
            Self::Pipeline { .. } => kernels::PHOTON_PIPELINE,
        };
        self.pipeline(device, "photons", kernel, spec, bindings)
    }

    /// Compiles the kernel that answers given rays.
    pub fn probe_pipeline(
        &self,
        device: &Arc<Device>,
        spec: &Spec,
        bindings: &[(u32, BindingKind)],
    ) -> Result<Pipeline> {
        let kernel = match self {
            Self::Software { .. } => kernels::PROBE_SOFTWARE,
            Self::Query { .. } => kernels::PROBE_QUERY,
            Self::Pipeline { .. } => kernels::PROBE_PIPELINE,
        };
        self.pipeline(device, "probe", kernel, spec, bindings)
    }

    fn pipeline(
        &self,
        device: &Arc<Device>,
        name: &str,
        kernel: Kernel,
        spec: &Spec,
        bindings: &[(u32, BindingKind)],
    ) -> Result<Pipeline> {
        let desc = PipelineDesc {
            name,
            spirv: &kernel.words(),
            bindings,
            constants: &spec.constants(),
            push_bytes: size_of::<layout::Batch>() as u32,
        };
        let Self::Pipeline { .. } = self else {
            return Pipeline::compute(device, &desc);
        };
        // A hit group without it lets the driver leave out what asks.
        let any_hit = spec
            .has_candidates()
            .then(|| kernels::TRACE_ANY_HIT.words());
        let intersection = spec.boxes.then(|| kernels::TRACE_INTERSECTION.words());
        let stages = RayStages {
            miss: &kernels::TRACE_MISS.words(),
            closest_hit: &kernels::TRACE_CLOSEST_HIT.words(),
            any_hit: any_hit.as_deref(),
            intersection: intersection.as_deref(),
        };
        Pipeline::rays(device, &desc, &stages)
    }

    /// Runs work groups of a kernel, or as many invocations where there are no groups.
    pub fn launch(
        &self,
        commands: &Commands,
        pipeline: &Pipeline,
        set: &BindSet,
        push: &layout::Batch,
        groups: u32,
    ) {
        let push = bytemuck::bytes_of(push);
        match self {
            Self::Software { .. } | Self::Query { .. } => {
                commands.dispatch(pipeline, set, push, [groups, 1, 1]);
            }
            // A count that does not fit is beyond every device's limit.
            Self::Pipeline { .. } => {
                commands.trace(pipeline, set, push, groups.saturating_mul(GROUP));
            }
        }
    }

    /// Bytes of trees or acceleration structures on the device.
    pub fn bytes(&self) -> u64 {
        match self {
            Self::Software {
                nodes,
                records,
                planes,
                small_nodes,
                small_records,
            } => [nodes, records, planes, small_nodes, small_records]
                .map(Buffer::bytes)
                .iter()
                .sum(),
            Self::Query { bytes, .. } | Self::Pipeline { bytes, .. } => *bytes,
        }
    }
}

/// The tree on the device, in texel buffers with `usage` besides, and what is tested before it.
pub(super) fn upload_bvh(
    device: &Arc<Device>,
    bvh: &Bvh,
    planes: &[layout::Plane],
    spec: &Spec,
    usage: Usage,
) -> Result<Traversal> {
    Ok(Traversal::Software {
        nodes: texel(device, "bvh nodes", RECORDS, &bvh.nodes, usage)?,
        records: texel(device, "bvh triangles", RECORDS, &bvh.triangles, usage)?,
        planes: texel(device, "planes", RECORDS, planes, usage)?,
        small_nodes: small(device, "small nodes", &bvh.nodes, spec.small_nodes)?,
        small_records: small(device, "small records", &bvh.triangles, spec.small_records)?,
    })
}

/// Bytes of a uniform buffer of a small tree's texels.
const SMALL_BYTES: usize = 16 * layout::SMALL_TEXELS as usize;
/// Most bytes of nodes that go there: with 14 to 24 KB renders are 1.07 to 1.25 times as fast, with 29 KB 1.05, with 37 KB 0.9.
const SMALL_NODE_BYTES: usize = 32 << 10;

/// Notes what of our own tree goes to uniform buffers.
pub(super) fn note_small(bvh: &Bvh, spec: &mut Spec) {
    spec.small_nodes = size_of_val(&bvh.nodes[..]) <= SMALL_NODE_BYTES;
    spec.small_records = size_of_val(&bvh.triangles[..]) <= SMALL_BYTES;
}

/// The items in a uniform buffer, or nothing.
fn small<T: bytemuck::Pod>(
    device: &Arc<Device>,
    name: &str,
    items: &[T],
    is_used: bool,
) -> Result<Buffer> {
    let mut all = vec![0u8; SMALL_BYTES];
    if is_used {
        let bytes = bytemuck::cast_slice(items);
        all[..bytes.len()].copy_from_slice(bytes);
    }
    Buffer::from_slice(device, name, Usage::UNIFORM, &all)
}

/// The device's own acceleration structures, with their size in bytes: over `vertices`, two texels each, or, with
/// `spec.boxes`, over boxes around triangles.
pub(super) fn build_scene(
    device: &Arc<Device>,
    data: &SceneData,
    spec: &Spec,
    vertices: &Buffer,
) -> Result<(Tlas, u64)> {
    let geometry = &data.geometry;
    let mut bytes = 0;
    let mut groups = Vec::with_capacity(geometry.groups.len());
    for (shapes, group) in shapes(data, spec).zip(&geometry.groups) {
        let opaque = !group.has_cutouts;
        let blas = match &shapes {
            Shapes::Boxes(boxes) => Blas::build_boxes(device, "group", boxes, opaque)?,
            Shapes::Triangles(triangles) => {
                let description = BlasGeometry {
                    vertices,
                    vertex_stride: 32,
                    vertex_count: (geometry.vertices.len() / 2) as u32,
                    triangles,
                    opaque,
                };
                Blas::build(device, "group", &description)?
            }
        };
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
    Ok((scene, bytes))
}

/// What a device's structure over a group is built of.
pub(super) enum Shapes {
    /// Indices of vertices.
    Triangles(Vec<[u32; 3]>),
    /// Low and high corners, one box around each triangle.
    Boxes(Vec<[[f32; 3]; 2]>),
}

/// The shapes of each group: boxes with `spec.boxes`.
pub(super) fn shapes<'a>(data: &'a SceneData, spec: &Spec) -> impl Iterator<Item = Shapes> + 'a {
    let geometry = &data.geometry;
    let slacks = match spec.boxes {
        true => boxes::slacks(geometry, Vec3::from(data.params.camera_position).as_dvec3()),
        false => Vec::new(),
    };
    let groups = geometry.groups.iter().enumerate();
    groups.map(move |(index, group)| match slacks.get(index) {
        Some(&slack) => Shapes::Boxes(boxes::around(geometry, group, slack)),
        None => {
            let triangles = &geometry.triangles[group.triangles.clone()];
            Shapes::Triangles(triangles.iter().map(|t| [t[0], t[1], t[2]]).collect())
        }
    })
}
