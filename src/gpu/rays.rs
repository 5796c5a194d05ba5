//! Ray tracing pipelines: a ray generation shader that sends rays, and the
//! shaders that hear what they met. One kind of ray, one record of each sort.

use std::sync::Arc;

use ash::vk;

use super::buffer::{Buffer, Memory};
use super::commands::Commands;
use super::device::Device;
use super::failed;
use super::kept::Recipe;
use super::pipeline::{BindSet, Module, Pipeline, PipelineDesc, PipelineInner};
use super::usage::Usage;
use crate::error::{Error, Result};

/// The modules that a ray generation shader calls; the entry point of each is `main`.
#[derive(Clone, Copy, Debug)]
pub struct RayStages<'a> {
    /// Called where a ray met nothing.
    pub miss: &'a [u32],
    /// Called with what it met first.
    pub closest_hit: &'a [u32],
    /// Asked of each candidate of groups that are not opaque; without it all are there.
    pub any_hit: Option<&'a [u32]>,
    /// Says what is in the boxes of groups that are built of boxes; with it, rays meet no triangles.
    pub intersection: Option<&'a [u32]>,
}

/// The stages that read bindings and push constants.
const STAGES: vk::ShaderStageFlags = vk::ShaderStageFlags::from_raw(
    vk::ShaderStageFlags::RAYGEN_KHR.as_raw()
        | vk::ShaderStageFlags::ANY_HIT_KHR.as_raw()
        | vk::ShaderStageFlags::INTERSECTION_KHR.as_raw(),
);

/// Groups of the pipeline in the order of their records: ray generation, miss, hit.
const GROUPS: u32 = 3;

/// Where a trace finds the handles of the groups.
pub(super) struct ShaderTable {
    buffer: Buffer,
    records: [vk::StridedDeviceAddressRegionKHR; GROUPS as usize],
}

impl Pipeline {
    /// Compiles a pipeline that traces rays from `desc`'s module, a ray generation shader.
    /// All modules get its bindings and constants. Fails as [`Self::compute`] does, and with
    /// [`Error::Unsupported`] where the device was opened without ray tracing pipelines.
    pub fn rays(
        device: &Arc<Device>,
        desc: &PipelineDesc<'_>,
        stages: &RayStages<'_>,
    ) -> Result<Self> {
        device.ray_pipelines()?;
        let make = || {
            let mut inner = PipelineInner::new(device, desc, STAGES)?;
            inner.raw = create(device, desc, stages, inner.layout)?;
            inner.table = Some(ShaderTable::new(device, desc.name, inner.raw)?);
            Ok(inner.finish())
        };
        device
            .kept
            .take_or(|| Recipe::new(desc, Some(stages)), make)
    }
}

fn create(
    device: &Arc<Device>,
    desc: &PipelineDesc<'_>,
    stages: &RayStages<'_>,
    layout: vk::PipelineLayout,
) -> Result<vk::Pipeline> {
    let functions = device.ray_pipelines()?;
    let op = || failed(format!("create pipeline \"{}\"", desc.name));
    let mut sources = vec![
        (vk::ShaderStageFlags::RAYGEN_KHR, desc.spirv),
        (vk::ShaderStageFlags::MISS_KHR, stages.miss),
        (vk::ShaderStageFlags::CLOSEST_HIT_KHR, stages.closest_hit),
    ];
    let optional = [
        (vk::ShaderStageFlags::ANY_HIT_KHR, stages.any_hit),
        (vk::ShaderStageFlags::INTERSECTION_KHR, stages.intersection),
    ];
    let optional = optional
        .into_iter()
        .filter_map(|(stage, spirv)| Some((stage, spirv?)));
    sources.extend(optional);
    let modules = sources
        .iter()
        .map(|(_, spirv)| Module::new(device, spirv, desc.constants))
        .collect::<Result<Vec<_>, _>>()
        .map_err(op())?;
    let entries: Vec<_> = sources
        .iter()
        .zip(&modules)
        .map(|(&(stage, _), module)| module.entry(stage))
        .collect();
    let group = vk::RayTracingShaderGroupCreateInfoKHR::default()
        .ty(vk::RayTracingShaderGroupTypeKHR::GENERAL)
        .general_shader(vk::SHADER_UNUSED_KHR)
        .closest_hit_shader(vk::SHADER_UNUSED_KHR)
        .any_hit_shader(vk::SHADER_UNUSED_KHR)
        .intersection_shader(vk::SHADER_UNUSED_KHR);
    let place = |wanted| {
        let place = sources.iter().position(|&(stage, _)| stage == wanted);
        place.map_or(vk::SHADER_UNUSED_KHR, |at| at as u32)
    };
    let kind = match stages.intersection {
        Some(_) => vk::RayTracingShaderGroupTypeKHR::PROCEDURAL_HIT_GROUP,
        None => vk::RayTracingShaderGroupTypeKHR::TRIANGLES_HIT_GROUP,
    };
    let hit = group
        .ty(kind)
        .closest_hit_shader(2)
        .any_hit_shader(place(vk::ShaderStageFlags::ANY_HIT_KHR))
        .intersection_shader(place(vk::ShaderStageFlags::INTERSECTION_KHR));
    let groups = [group.general_shader(0), group.general_shader(1), hit];
    let info = vk::RayTracingPipelineCreateInfoKHR::default()
        .stages(&entries)
        .groups(&groups)
        // Only the ray generation shader sends rays. Every device allows one level.
        .max_pipeline_ray_recursion_depth(1)
        .layout(layout);
    // SAFETY: layout and modules are alive, indices of the groups lie within the stages, and the
    // map entries within the constants; nothing is deferred.
    let made = unsafe {
        functions.create_ray_tracing_pipelines(
            vk::DeferredOperationKHR::null(),
            vk::PipelineCache::null(),
            &[info],
            None,
        )
    };
    Ok(made.map_err(|(_, result)| result).map_err(op())?[0])
}

impl ShaderTable {
    fn new(device: &Arc<Device>, name: &str, pipeline: vk::Pipeline) -> Result<Self> {
        let functions = device.ray_pipelines()?;
        let limits = &device.caps().ray_pipeline_limits;
        let handle = limits.handle_bytes as usize;
        // SAFETY: the pipeline has this many groups, and handles have the size that the device says.
        let handles = unsafe {
            let bytes = handle * GROUPS as usize;
            functions.get_ray_tracing_shader_group_handles(pipeline, 0, GROUPS, bytes)
        }
        .map_err(failed(format!("read the groups of pipeline \"{name}\"")))?;
        // Each record starts a table of its own, so the alignment of tables is enough.
        let alignment = limits.table_alignment.max(1);
        let stride = u64::from(limits.handle_bytes).next_multiple_of(alignment);
        let bytes = stride * u64::from(GROUPS);
        let buffer = Buffer::new(
            device,
            &format!("{name}: shader table"),
            bytes + alignment,
            Usage::SHADER_TABLE,
            Memory::DeviceLocal,
        )?;
        let start = buffer.address().next_multiple_of(alignment);
        let mut table = vec![0u8; bytes as usize];
        for (record, handle) in table
            .chunks_exact_mut(stride as usize)
            .zip(handles.chunks_exact(handle))
        {
            record[..handle.len()].copy_from_slice(handle);
        }
        buffer.write(start - buffer.address(), &table)?;
        let record = |index: u64| vk::StridedDeviceAddressRegionKHR {
            device_address: start + index * stride,
            stride,
            size: stride,
        };
        Ok(Self {
            buffer,
            records: [record(0), record(1), record(2)],
        })
    }
}

impl Commands {
    /// Runs `count` invocations of the pipeline's ray generation shader, side by side. What
    /// holds for [`Self::dispatch`] holds here.
    pub fn trace(&self, pipeline: &Pipeline, set: &BindSet, push: &[u8], count: u32) {
        self.check(pipeline, set, push);
        let device = self.device();
        let table = pipeline.table().unwrap_or_else(|| {
            panic!(
                "pipeline \"{}\" is not one that traces rays",
                pipeline.name()
            )
        });
        let functions = device
            .ray_pipelines()
            .expect("a pipeline that traces rays was made on this device");
        let limit = device.caps().max_launch;
        if count > limit {
            self.refuse(Error::Unsupported {
                what: format!("launch of {count} invocations of \"{}\"", pipeline.name()),
                missing: format!("{} runs at most {limit}", device.caps().name),
            });
            return;
        }
        self.before_command();
        self.keep(set.clone());
        self.keep(pipeline.clone());
        self.keep(table.buffer.clone());
        self.bind(pipeline, set, push);
        let [generate, miss, hit] = &table.records;
        let none = vk::StridedDeviceAddressRegionKHR::default();
        // SAFETY: pipeline, set and push constants were just bound; the table holds the handles of
        // this pipeline, aligned as the device asks; the count is within the limit.
        unsafe { functions.cmd_trace_rays(self.raw(), generate, miss, hit, &none, count, 1, 1) };
    }
}
