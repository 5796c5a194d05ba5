//! What a device can do: every feature and limit, asked for once. Nothing else
//! in the crate puts questions to a driver.

use ash::vk::SubgroupFeatureFlags as Operations;
use ash::{ext, khr, vk};

use super::failed;
use super::instance::{Instance, has_extension, version_parts};
use crate::error::Result;

/// What kind of device it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DeviceKind {
    /// A card with its own memory.
    Discrete,
    /// A GPU that shares the processor's memory.
    Integrated,
    /// A GPU seen through a virtual machine.
    Virtual,
    /// A driver that computes on the processor.
    Cpu,
    /// Anything else.
    Other,
}

impl DeviceKind {
    /// A word for people and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Discrete => "discrete",
            Self::Integrated => "integrated",
            Self::Virtual => "virtual",
            Self::Cpu => "cpu",
            Self::Other => "other",
        }
    }
}

/// A device's abilities and limits.
#[derive(Clone, Debug)]
pub struct Caps {
    /// Position in the loader's list; what `--device` takes.
    pub index: usize,
    /// The device's own name.
    pub name: String,
    /// Discrete, integrated, CPU …
    pub kind: DeviceKind,
    /// Driver's name and version as the driver words them.
    pub driver: String,
    /// Vulkan version of the device: major, minor, patch.
    pub api_version: (u32, u32, u32),
    /// Whether plain compute (the own BVH) runs, else what is missing.
    pub compute: Result<(), String>,
    /// Whether acceleration structures and ray queries work as well, else what is missing.
    pub ray_query: Result<(), String>,
    /// Whether acceleration structures and ray tracing pipelines work as well, else what is missing.
    pub ray_pipeline: Result<(), String>,
    /// Whether rays are probably traced by circuits: ray query on a device that is no CPU.
    pub ray_hardware_likely: bool,
    /// Whether shaders can read buffers by addresses of 64 bits.
    pub addresses: bool,
    /// Largest storage buffer a shader can see, bytes.
    pub max_storage_range: u64,
    /// Largest uniform buffer a shader can see, bytes.
    pub max_uniform_range: u64,
    /// Most elements of a texel buffer.
    pub max_texel_elements: u64,
    /// Largest buffer of any use, bytes.
    pub max_buffer_bytes: u64,
    /// Most triangles of one bottom-level acceleration structure; 0 without such.
    pub max_primitives: u64,
    /// Most instances of one top-level acceleration structure; 0 without such.
    pub max_instances: u64,
    /// Most work groups of one dispatch along each axis.
    pub max_groups: [u32; 3],
    /// Most invocations of one launch of a ray tracing pipeline; 0 without such.
    pub max_launch: u32,
    /// Most bytes of push constants.
    pub max_push_bytes: u32,
    /// Most storage buffers that one compute stage can bind.
    pub max_storage_buffers: u32,
    /// Invocations a subgroup; 0 where the device does not say.
    pub subgroup_size: u32,
    /// Invocations of a subgroup may read each other's values in compute shaders.
    pub subgroup_shuffle: bool,
    /// Nanoseconds a tick of the timestamp counter.
    pub timestamp_period: f64,
    /// Sum of the device-local heaps, bytes.
    pub device_bytes: u64,
    /// Valid bits of a timestamp on the queue in use; 0: none.
    pub(super) timestamp_bits: u32,
    /// The queue family in use.
    pub(super) queue_family: u32,
    /// Alignment of scratch addresses for acceleration-structure builds, bytes.
    pub(super) scratch_alignment: u64,
    pub(super) ray_pipeline_limits: RayPipelineLimits,
    /// Whether `maintenance4` can be enabled (GLSL's LocalSizeId needs it).
    pub(super) maintenance4: bool,
    /// Whether the driver tells how much memory is left.
    pub(super) memory_budget: bool,
}

/// Limits of ray tracing pipelines; 0 without such.
#[derive(Clone, Debug, Default)]
pub(super) struct RayPipelineLimits {
    /// Bytes of a shader group's handle.
    pub handle_bytes: u32,
    /// Alignment of shader tables, bytes; strides of records are multiples of it here as well.
    pub table_alignment: u64,
}

/// The answers that only a device of version 1.2 gives.
#[derive(Default)]
struct Modern {
    driver: String,
    subgroup_size: u32,
    max_buffer_bytes: u64,
    maintenance4: bool,
    addresses: bool,
    memory_budget: bool,
    scalar_block_layout: bool,
    /// Arithmetic and votes in compute shaders.
    subgroup_operations: bool,
    subgroup_shuffle: bool,
    max_primitives: u64,
    max_instances: u64,
    scratch_alignment: u64,
    ray_pipeline_limits: RayPipelineLimits,
    max_launch: u32,
    missing_for_queries: Vec<&'static str>,
    missing_for_pipelines: Vec<&'static str>,
}

impl Caps {
    pub(super) fn query(
        instance: &Instance,
        physical: vk::PhysicalDevice,
        index: usize,
    ) -> Result<Self> {
        let raw = &instance.raw;
        // SAFETY: `physical` was listed by this instance, here and in the two calls below.
        let properties = unsafe { raw.get_physical_device_properties(physical) };
        // SAFETY: as above.
        let memory = unsafe { raw.get_physical_device_memory_properties(physical) };
        // SAFETY: as above.
        let families = unsafe { raw.get_physical_device_queue_family_properties(physical) };
        let limits = &properties.limits;
        let version = properties.api_version.min(instance.version);
        let modern = if version >= vk::API_VERSION_1_2 {
            query_modern(instance, physical, version)?
        } else {
            Modern::default()
        };
        let queue = choose_queue(&families);
        let compute = require_compute(properties.api_version, queue.is_some(), &modern);
        let able = |missing: &[&str]| match missing {
            _ if compute.is_err() => compute.clone(),
            [] => Ok(()),
            missing => Err(missing.join(", ")),
        };
        let ray_query = able(&modern.missing_for_queries);
        let ray_pipeline = able(&modern.missing_for_pipelines);
        let kind = match properties.device_type {
            vk::PhysicalDeviceType::DISCRETE_GPU => DeviceKind::Discrete,
            vk::PhysicalDeviceType::INTEGRATED_GPU => DeviceKind::Integrated,
            vk::PhysicalDeviceType::VIRTUAL_GPU => DeviceKind::Virtual,
            vk::PhysicalDeviceType::CPU => DeviceKind::Cpu,
            _ => DeviceKind::Other,
        };
        let (queue_family, timestamp_bits) = queue.unwrap_or((0, 0));
        Ok(Self {
            index,
            name: text(properties.device_name_as_c_str()),
            kind,
            driver: modern.driver,
            api_version: version_parts(properties.api_version),
            ray_hardware_likely: ray_query.is_ok() && kind != DeviceKind::Cpu,
            compute,
            ray_query,
            ray_pipeline,
            max_storage_range: limits.max_storage_buffer_range.into(),
            max_uniform_range: limits.max_uniform_buffer_range.into(),
            max_texel_elements: limits.max_texel_buffer_elements.into(),
            max_buffer_bytes: modern.max_buffer_bytes,
            max_primitives: modern.max_primitives,
            max_instances: modern.max_instances,
            max_groups: limits.max_compute_work_group_count,
            // Along one axis a launch is also bound like a dispatch.
            max_launch: limits.max_compute_work_group_count[0]
                .saturating_mul(limits.max_compute_work_group_size[0])
                .min(modern.max_launch),
            max_push_bytes: limits.max_push_constants_size,
            max_storage_buffers: limits.max_per_stage_descriptor_storage_buffers,
            subgroup_size: modern.subgroup_size,
            subgroup_shuffle: modern.subgroup_shuffle,
            timestamp_period: limits.timestamp_period.into(),
            device_bytes: memory
                .memory_heaps_as_slice()
                .iter()
                .filter(|heap| heap.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL))
                .map(|heap| heap.size)
                .sum(),
            timestamp_bits,
            queue_family,
            scratch_alignment: modern.scratch_alignment,
            ray_pipeline_limits: modern.ray_pipeline_limits,
            maintenance4: modern.maintenance4,
            addresses: modern.addresses,
            memory_budget: modern.memory_budget,
        })
    }
}

/// A queue family that computes, with the valid bits of its timestamps. A family
/// without graphics is preferred: it leaves a desktop's own queue alone.
fn choose_queue(families: &[vk::QueueFamilyProperties]) -> Option<(u32, u32)> {
    (0..)
        .zip(families)
        .filter(|(_, f)| f.queue_flags.contains(vk::QueueFlags::COMPUTE) && f.queue_count > 0)
        .min_by_key(|(_, f)| {
            (
                f.timestamp_valid_bits == 0,
                f.queue_flags.contains(vk::QueueFlags::GRAPHICS),
            )
        })
        .map(|(index, f)| (index, f.timestamp_valid_bits))
}

fn require_compute(version: u32, has_queue: bool, modern: &Modern) -> Result<(), String> {
    let mut missing = Vec::new();
    if version < vk::API_VERSION_1_2 {
        let (major, minor, _) = version_parts(version);
        missing.push(format!("Vulkan 1.2 (the device has {major}.{minor})"));
    } else if !modern.scalar_block_layout {
        missing.push(String::from("feature scalarBlockLayout"));
    } else if !modern.subgroup_operations {
        missing.push(String::from(
            "subgroup arithmetic and votes in compute shaders",
        ));
    }
    if !has_queue {
        missing.push(String::from("a queue that computes"));
    }
    if missing.is_empty() {
        Ok(())
    } else {
        Err(missing.join(", "))
    }
}

/// Extensions that acceleration structures need.
pub(super) const BUILD_EXTENSIONS: [&std::ffi::CStr; 2] = [
    khr::acceleration_structure::NAME,
    khr::deferred_host_operations::NAME,
];

fn query_modern(instance: &Instance, physical: vk::PhysicalDevice, version: u32) -> Result<Modern> {
    let raw = &instance.raw;
    // SAFETY: `physical` was listed by this instance.
    let extensions = unsafe { raw.enumerate_device_extension_properties(physical) }
        .map_err(failed("list the extensions of a device"))?;
    let has = |name| has_extension(&extensions, name);
    let has_builds = BUILD_EXTENSIONS.iter().all(|&name| has(name));
    let has_queries = has(khr::ray_query::NAME);
    let has_pipelines = has(khr::ray_tracing_pipeline::NAME);
    let is_13 = version >= vk::API_VERSION_1_3;

    let mut v11 = vk::PhysicalDeviceVulkan11Properties::default();
    let mut v12 = vk::PhysicalDeviceVulkan12Properties::default();
    let mut v13 = vk::PhysicalDeviceVulkan13Properties::default();
    let mut builds = vk::PhysicalDeviceAccelerationStructurePropertiesKHR::default();
    let mut pipelines = vk::PhysicalDeviceRayTracingPipelinePropertiesKHR::default();
    let mut properties = vk::PhysicalDeviceProperties2::default()
        .push_next(&mut v11)
        .push_next(&mut v12);
    let mut f12 = vk::PhysicalDeviceVulkan12Features::default();
    let mut f13 = vk::PhysicalDeviceVulkan13Features::default();
    let mut f_build = vk::PhysicalDeviceAccelerationStructureFeaturesKHR::default();
    let mut f_query = vk::PhysicalDeviceRayQueryFeaturesKHR::default();
    let mut f_pipeline = vk::PhysicalDeviceRayTracingPipelineFeaturesKHR::default();
    let mut features = vk::PhysicalDeviceFeatures2::default().push_next(&mut f12);
    if is_13 {
        properties = properties.push_next(&mut v13);
        features = features.push_next(&mut f13);
    }
    if has_builds {
        properties = properties.push_next(&mut builds);
        features = features.push_next(&mut f_build);
    }
    if has_queries {
        features = features.push_next(&mut f_query);
    }
    if has_pipelines {
        properties = properties.push_next(&mut pipelines);
        features = features.push_next(&mut f_pipeline);
    }
    // SAFETY: every struct in the chains belongs to a version or extension that the device has.
    unsafe {
        raw.get_physical_device_properties2(physical, &mut properties);
        raw.get_physical_device_features2(physical, &mut features);
    }

    let is_on = |feature: vk::Bool32| feature == vk::TRUE;
    let addresses = is_on(features.features.shader_int64) && is_on(f12.buffer_device_address);
    let mut missing = Vec::new();
    for name in BUILD_EXTENSIONS.into_iter().filter(|&name| !has(name)) {
        missing.push(name.to_str().expect("extension names are ASCII"));
    }
    if has_builds && !is_on(f_build.acceleration_structure) {
        missing.push("feature accelerationStructure");
    }
    if !is_on(f12.buffer_device_address) {
        missing.push("feature bufferDeviceAddress");
    }
    let (mut missing_for_queries, mut missing_for_pipelines) = (missing.clone(), missing);
    if !has_queries {
        missing_for_queries.push("VK_KHR_ray_query");
    } else if !is_on(f_query.ray_query) {
        missing_for_queries.push("feature rayQuery");
    }
    if !has_pipelines {
        missing_for_pipelines.push("VK_KHR_ray_tracing_pipeline");
    } else if !is_on(f_pipeline.ray_tracing_pipeline) {
        missing_for_pipelines.push("feature rayTracingPipeline");
    }
    let max_buffer_bytes = if is_13 {
        v13.max_buffer_size.min(v11.max_memory_allocation_size)
    } else {
        v11.max_memory_allocation_size
    };
    let subgroups = |operations| {
        let stages = v11.subgroup_supported_stages;
        stages.contains(vk::ShaderStageFlags::COMPUTE)
            && v11.subgroup_supported_operations.contains(operations)
    };
    let driver = format!(
        "{} {}",
        text(v12.driver_name_as_c_str()),
        text(v12.driver_info_as_c_str())
    );
    Ok(Modern {
        driver: driver.trim().to_owned(),
        subgroup_size: v11.subgroup_size,
        max_buffer_bytes,
        maintenance4: is_on(f13.maintenance4),
        addresses,
        memory_budget: has(ext::memory_budget::NAME),
        scalar_block_layout: is_on(f12.scalar_block_layout),
        subgroup_operations: subgroups(Operations::ARITHMETIC | Operations::VOTE),
        subgroup_shuffle: subgroups(Operations::BALLOT | Operations::SHUFFLE),
        max_primitives: builds.max_primitive_count,
        max_instances: builds.max_instance_count,
        scratch_alignment: builds
            .min_acceleration_structure_scratch_offset_alignment
            .into(),
        ray_pipeline_limits: RayPipelineLimits {
            handle_bytes: pipelines.shader_group_handle_size,
            // Both are powers of two, so that the larger is a multiple of the other.
            table_alignment: pipelines
                .shader_group_base_alignment
                .max(pipelines.shader_group_handle_alignment)
                .into(),
        },
        max_launch: pipelines.max_ray_dispatch_invocation_count,
        missing_for_queries,
        missing_for_pipelines,
    })
}

/// A name that a driver reports; empty where it is not terminated.
fn text(name: Result<&std::ffi::CStr, std::ffi::FromBytesUntilNulError>) -> String {
    name.map_or(String::new(), |n| n.to_string_lossy().into_owned())
}
