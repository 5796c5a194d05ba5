//! Acceleration structures: the scene as rays of the device see it. A [`Blas`] holds the
//! triangles of one group or boxes around them, a [`Tlas`] places groups in the world. Both are cheap handles.

use std::sync::Arc;

use ash::vk;
use bytemuck::{Pod, Zeroable};

use super::buffer::{Buffer, Memory};
use super::commands::Commands;
use super::device::Device;
use super::failed;
use super::usage::Usage;
use crate::error::{Error, Result};

/// Custom indices of instances have 24 bits.
const MAX_CUSTOM_INDEX: u64 = 1 << 24;

/// Compaction must save at least one part in this many to be worth the copy.
const WORTHWHILE: u64 = 16;

/// The triangles of one group.
#[derive(Clone, Copy)]
pub struct BlasGeometry<'a> {
    /// Vertices whose first twelve bytes are the position (three floats, metres);
    /// made with [`Usage::ACCELERATION_INPUT`].
    pub vertices: &'a Buffer,
    /// Bytes from one vertex to the next; a multiple of four.
    pub vertex_stride: u32,
    /// How many vertices there are.
    pub vertex_count: u32,
    /// Vertex indices; the position in this slice is the primitive's id.
    pub triangles: &'a [[u32; 3]],
    /// Whether no triangle is ever cut out, so that traversal need not ask.
    pub opaque: bool,
}

/// A group placed in the world.
#[derive(Clone, Copy)]
pub struct TlasInstance<'a> {
    /// The group.
    pub blas: &'a Blas,
    /// Columns of the object-to-world matrix: images of x, y and z, and the translation.
    pub world_from_object: [[f32; 3]; 4],
}

/// An acceleration structure over triangles or boxes; clones share it.
#[derive(Clone)]
pub struct Blas(Arc<Structure>);

/// An acceleration structure over instances; clones share it.
#[derive(Clone)]
pub struct Tlas(Arc<TlasInner>);

struct TlasInner {
    structure: Structure,
    /// What the instances point to.
    _groups: Vec<Blas>,
}

/// A structure and the buffer that holds it.
struct Structure {
    device: Arc<Device>,
    name: String,
    raw: vk::AccelerationStructureKHR,
    buffer: Buffer,
}

impl Drop for Structure {
    fn drop(&mut self) {
        if let Some(functions) = &self.device.acceleration {
            // SAFETY: recordings, sets and top levels hold what they use, so nothing uses it;
            // null handles are ignored. The buffer is dropped after it.
            unsafe { functions.destroy_acceleration_structure(self.raw, None) };
        }
    }
}

/// VkAccelerationStructureInstanceKHR as plain data.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct InstanceRecord {
    transform: [[f32; 4]; 3],
    custom_index_and_mask: u32,
    offset_and_flags: u32,
    blas_address: u64,
}

const _: () = assert!(size_of::<InstanceRecord>() == 64);

impl Blas {
    /// Builds and compacts the structure. Fails with [`Error::Unsupported`] where
    /// there are more triangles than the device takes or it was opened without ray tracing.
    /// Panics where an index or the vertices leave their buffer.
    pub fn build(device: &Arc<Device>, name: &str, geometry: &BlasGeometry<'_>) -> Result<Self> {
        device.acceleration()?;
        let count = geometry.triangles.len() as u64;
        check_count(
            device,
            name,
            "triangles",
            count,
            device.caps().max_primitives,
        )?;
        check_geometry(device, name, geometry);
        // The triangle records of shaders carry a fourth word, which builds do not take.
        let indices = Buffer::from_slice(
            device,
            &format!("{name}: indices"),
            Usage::ACCELERATION_INPUT,
            geometry.triangles,
        )?;
        let triangles = vk::AccelerationStructureGeometryTrianglesDataKHR::default()
            .vertex_format(vk::Format::R32G32B32_SFLOAT)
            .vertex_data(at(geometry.vertices.address()))
            .vertex_stride(geometry.vertex_stride.into())
            .max_vertex(geometry.vertex_count.saturating_sub(1))
            .index_type(vk::IndexType::UINT32)
            .index_data(at(indices.address()));
        let description = vk::AccelerationStructureGeometryKHR::default()
            .geometry_type(vk::GeometryTypeKHR::TRIANGLES)
            .geometry(vk::AccelerationStructureGeometryDataKHR { triangles })
            .flags(flags(geometry.opaque));
        Self::of(device, name, &description, count as u32)
    }

    /// Builds and compacts a structure over boxes, each a low and a high corner; the position in the slice
    /// is the primitive's id. What is in a box, the shaders say. Fails as [`Self::build`] does.
    pub fn build_boxes(
        device: &Arc<Device>,
        name: &str,
        boxes: &[[[f32; 3]; 2]],
        opaque: bool,
    ) -> Result<Self> {
        device.acceleration()?;
        let count = boxes.len() as u64;
        check_count(device, name, "boxes", count, device.caps().max_primitives)?;
        let usage = Usage::ACCELERATION_INPUT;
        let corners = Buffer::from_slice(device, &format!("{name}: boxes"), usage, boxes)?;
        let aabbs = vk::AccelerationStructureGeometryAabbsDataKHR::default()
            .data(at(corners.address()))
            .stride(size_of::<vk::AabbPositionsKHR>() as u64);
        let description = vk::AccelerationStructureGeometryKHR::default()
            .geometry_type(vk::GeometryTypeKHR::AABBS)
            .geometry(vk::AccelerationStructureGeometryDataKHR { aabbs })
            .flags(flags(opaque));
        Self::of(device, name, &description, count as u32)
    }

    fn of(
        device: &Arc<Device>,
        name: &str,
        geometry: &vk::AccelerationStructureGeometryKHR<'_>,
        count: u32,
    ) -> Result<Self> {
        let kind = vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL;
        let built = build(device, name, kind, geometry, count)?;
        Ok(Self(Arc::new(compact(built)?)))
    }

    /// Memory of the structure, bytes.
    pub fn bytes(&self) -> u64 {
        self.0.buffer.bytes()
    }

    fn address(&self) -> Result<vk::DeviceAddress> {
        let info = vk::AccelerationStructureDeviceAddressInfoKHR::default()
            .acceleration_structure(self.0.raw);
        let functions = self.0.device.acceleration()?;
        // SAFETY: the structure is alive.
        Ok(unsafe { functions.get_acceleration_structure_device_address(&info) })
    }
}

impl Tlas {
    /// Builds the structure; the custom index of an instance is its position in
    /// the slice. An empty slice makes a scene that no ray meets. Fails with
    /// [`Error::Unsupported`] where there are more instances than the device or 24 bits take.
    pub fn build(device: &Arc<Device>, name: &str, instances: &[TlasInstance<'_>]) -> Result<Self> {
        device.acceleration()?;
        let count = instances.len() as u64;
        let limit = device.caps().max_instances.min(MAX_CUSTOM_INDEX);
        check_count(device, name, "instances", count, limit)?;
        let records = (0..)
            .zip(instances)
            .map(|(index, instance)| record(index, instance))
            .collect::<Result<Vec<_>>>()?;
        let buffer = Buffer::from_slice(
            device,
            &format!("{name}: instances"),
            Usage::ACCELERATION_INPUT,
            &records,
        )?;
        let data =
            vk::AccelerationStructureGeometryInstancesDataKHR::default().data(at(buffer.address()));
        let description = vk::AccelerationStructureGeometryKHR::default()
            .geometry_type(vk::GeometryTypeKHR::INSTANCES)
            .geometry(vk::AccelerationStructureGeometryDataKHR { instances: data });
        let structure = build(
            device,
            name,
            vk::AccelerationStructureTypeKHR::TOP_LEVEL,
            &description,
            count as u32,
        )?;
        Ok(Self(Arc::new(TlasInner {
            structure,
            _groups: instances.iter().map(|i| i.blas.clone()).collect(),
        })))
    }

    /// Memory of the structure itself, bytes.
    pub fn bytes(&self) -> u64 {
        self.0.structure.buffer.bytes()
    }

    pub(super) fn raw(&self) -> vk::AccelerationStructureKHR {
        self.0.structure.raw
    }

    pub(super) fn name(&self) -> &str {
        &self.0.structure.name
    }

    pub(super) fn is_of(&self, device: &Arc<Device>) -> bool {
        Arc::ptr_eq(&self.0.structure.device, device)
    }
}

fn flags(opaque: bool) -> vk::GeometryFlagsKHR {
    if opaque {
        vk::GeometryFlagsKHR::OPAQUE
    } else {
        // Alpha tests need no count of calls: confirming twice changes nothing.
        vk::GeometryFlagsKHR::empty()
    }
}

fn at(device_address: vk::DeviceAddress) -> vk::DeviceOrHostAddressConstKHR {
    vk::DeviceOrHostAddressConstKHR { device_address }
}

fn check_count(device: &Device, name: &str, of: &str, count: u64, limit: u64) -> Result<()> {
    if count <= limit {
        return Ok(());
    }
    Err(Error::Unsupported {
        what: format!("acceleration structure \"{name}\" over {count} {of}"),
        missing: format!("{} takes at most {limit}", device.caps().name),
    })
}

fn check_geometry(device: &Arc<Device>, name: &str, geometry: &BlasGeometry<'_>) {
    let stride = u64::from(geometry.vertex_stride);
    let count = u64::from(geometry.vertex_count);
    assert!(
        geometry.vertices.is_of(device),
        "\"{name}\": vertices of another device"
    );
    assert!(
        stride % 4 == 0 && (stride >= 12 || count <= 1),
        "\"{name}\": a vertex stride of {stride} bytes"
    );
    let end = count.checked_sub(1).map_or(0, |last| last * stride + 12);
    geometry.vertices.check_range(0, end);
    let highest = geometry.triangles.iter().flatten().max();
    assert!(
        highest.is_none_or(|&index| u64::from(index) < count),
        "\"{name}\": an index leaves its {count} vertices"
    );
}

/// An instance as the build reads it. The one place where columns become
/// Vulkan's row-major 3 × 4 matrix.
fn record(index: u32, instance: &TlasInstance<'_>) -> Result<InstanceRecord> {
    let columns = instance.world_from_object;
    let row = |axis: usize| columns.map(|column| column[axis]);
    // Interfaces must be seen from both sides.
    let flags = vk::GeometryInstanceFlagsKHR::TRIANGLE_FACING_CULL_DISABLE.as_raw();
    Ok(InstanceRecord {
        transform: [row(0), row(1), row(2)],
        custom_index_and_mask: index | 0xFF << 24,
        offset_and_flags: flags << 24,
        blas_address: instance.blas.address()?,
    })
}

fn build(
    device: &Arc<Device>,
    name: &str,
    kind: vk::AccelerationStructureTypeKHR,
    geometry: &vk::AccelerationStructureGeometryKHR<'_>,
    count: u32,
) -> Result<Structure> {
    let functions = device.acceleration()?;
    let mut flags = vk::BuildAccelerationStructureFlagsKHR::PREFER_FAST_TRACE;
    if kind == vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL {
        flags |= vk::BuildAccelerationStructureFlagsKHR::ALLOW_COMPACTION;
    }
    let geometries = [*geometry];
    let mut info = vk::AccelerationStructureBuildGeometryInfoKHR::default()
        .ty(kind)
        .flags(flags)
        .mode(vk::BuildAccelerationStructureModeKHR::BUILD)
        .geometries(&geometries);
    let mut sizes = vk::AccelerationStructureBuildSizesInfoKHR::default();
    // SAFETY: `info` describes one geometry, and there is one count.
    unsafe {
        functions.get_acceleration_structure_build_sizes(
            vk::AccelerationStructureBuildTypeKHR::DEVICE,
            &info,
            &[count],
            &mut sizes,
        );
    }
    let structure = Structure::new(device, name, kind, sizes.acceleration_structure_size)?;
    // Some drivers need none (lavapipe); a buffer is never smaller than 16 bytes.
    let alignment = device.caps().scratch_alignment.max(1);
    let scratch = Buffer::new(
        device,
        &format!("{name}: scratch"),
        sizes.build_scratch_size.saturating_add(alignment),
        Usage::SCRATCH,
        Memory::DeviceLocal,
    )?;
    info.dst_acceleration_structure = structure.raw;
    info.scratch_data = vk::DeviceOrHostAddressKHR {
        device_address: scratch.address().next_multiple_of(alignment),
    };
    let range = vk::AccelerationStructureBuildRangeInfoKHR::default().primitive_count(count);
    device.run(&format!("build {name}"), |commands| {
        commands.before_command();
        // SAFETY: inputs, scratch and structure are alive until `run` returns (the callers and
        // this function own them) and as large as the driver asked for; indices were checked.
        unsafe {
            functions.cmd_build_acceleration_structures(commands.raw(), &[info], &[&[range]]);
        }
    })?;
    Ok(structure)
}

/// A smaller copy where it saves memory, else the structure itself.
fn compact(built: Structure) -> Result<Structure> {
    let device = &built.device;
    let bytes = compacted_bytes(&built)?;
    if bytes == 0 || bytes > built.buffer.bytes() - built.buffer.bytes() / WORTHWHILE {
        return Ok(built);
    }
    let kind = vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL;
    let small = Structure::new(device, &built.name, kind, bytes)?;
    let functions = device.acceleration()?;
    let info = vk::CopyAccelerationStructureInfoKHR::default()
        .src(built.raw)
        .dst(small.raw)
        .mode(vk::CopyAccelerationStructureModeKHR::COMPACT);
    device.run(&format!("compact {}", built.name), |commands| {
        commands.before_command();
        // SAFETY: the source allows compaction, the target has the size that was asked for, and
        // both live until `run` returns.
        unsafe { functions.cmd_copy_acceleration_structure(commands.raw(), &info) };
    })?;
    Ok(small)
}

/// A query pool for the compacted size.
struct SizeQuery<'a> {
    device: &'a Device,
    raw: vk::QueryPool,
}

impl Drop for SizeQuery<'_> {
    fn drop(&mut self) {
        // SAFETY: `run` has waited for the query.
        unsafe { self.device.raw().destroy_query_pool(self.raw, None) };
    }
}

fn compacted_bytes(built: &Structure) -> Result<u64> {
    let device = &built.device;
    let functions = device.acceleration()?;
    let ask = || failed(format!("ask for the compacted size of {}", built.name));
    let kind = vk::QueryType::ACCELERATION_STRUCTURE_COMPACTED_SIZE_KHR;
    let info = vk::QueryPoolCreateInfo::default()
        .query_type(kind)
        .query_count(1);
    let query = SizeQuery {
        device,
        // SAFETY: the extension of this query type is enabled.
        raw: unsafe { device.raw().create_query_pool(&info, None) }.map_err(ask())?,
    };
    device.run(&format!("size of {}", built.name), |commands: &Commands| {
        commands.before_command();
        // SAFETY: the structure was built with ALLOW_COMPACTION; the query is reset first.
        unsafe {
            device
                .raw()
                .cmd_reset_query_pool(commands.raw(), query.raw, 0, 1);
            functions.cmd_write_acceleration_structures_properties(
                commands.raw(),
                &[built.raw],
                kind,
                query.raw,
                0,
            );
        }
    })?;
    let mut bytes = [0u64];
    let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT;
    // SAFETY: the query was written by the submission that has completed.
    unsafe {
        device
            .raw()
            .get_query_pool_results(query.raw, 0, &mut bytes, flags)
    }
    .map_err(ask())?;
    Ok(bytes[0])
}

impl Structure {
    fn new(
        device: &Arc<Device>,
        name: &str,
        kind: vk::AccelerationStructureTypeKHR,
        bytes: u64,
    ) -> Result<Self> {
        let buffer = Buffer::new(
            device,
            name,
            bytes,
            Usage::ACCELERATION_STORAGE,
            Memory::DeviceLocal,
        )?;
        let info = vk::AccelerationStructureCreateInfoKHR::default()
            .buffer(buffer.raw())
            .size(bytes)
            .ty(kind);
        let functions = device.acceleration()?;
        // SAFETY: the buffer has the usage and at least this size; offset 0 is aligned.
        let raw = unsafe { functions.create_acceleration_structure(&info, None) }
            .map_err(failed(format!("create acceleration structure \"{name}\"")))?;
        device.set_name(raw, name);
        Ok(Self {
            device: Arc::clone(device),
            name: name.to_owned(),
            raw,
            buffer,
        })
    }
}
