//! Pipelines and the sets of resources they read: made from plain lists of bindings
//! and constants. Both are cheap handles. What rays need besides is in `rays`.

use std::sync::Arc;

use ash::vk;

use super::accel::Tlas;
use super::buffer::Buffer;
use super::device::Device;
use super::failed;
use super::kept::Recipe;
use super::rays::ShaderTable;
use crate::error::{Error, Result};
use crate::spirv;

/// What a shader expects at a binding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BindingKind {
    /// A uniform buffer.
    Uniform,
    /// A storage buffer.
    Storage,
    /// A uniform texel buffer.
    Texel,
    /// Nothing: the shader finds the buffer by its address, sets keep it alive.
    Address,
    /// A top-level acceleration structure.
    AccelerationStructure,
}

impl BindingKind {
    const DESCRIPTORS: [Self; 4] = [
        Self::Uniform,
        Self::Storage,
        Self::Texel,
        Self::AccelerationStructure,
    ];

    fn vulkan(self) -> Option<vk::DescriptorType> {
        match self {
            Self::Uniform => Some(vk::DescriptorType::UNIFORM_BUFFER),
            Self::Storage => Some(vk::DescriptorType::STORAGE_BUFFER),
            Self::Texel => Some(vk::DescriptorType::UNIFORM_TEXEL_BUFFER),
            Self::Address => None,
            Self::AccelerationStructure => Some(vk::DescriptorType::ACCELERATION_STRUCTURE_KHR),
        }
    }
}

/// What is put at a binding.
#[derive(Clone, Copy)]
pub enum Resource<'a> {
    /// A whole buffer, as uniform, storage or texel buffer.
    Buffer(&'a Buffer),
    /// A scene to trace rays in.
    Acceleration(&'a Tlas),
}

/// A pipeline to be made.
#[derive(Clone, Copy, Debug)]
pub struct PipelineDesc<'a> {
    /// For messages and debuggers.
    pub name: &'a str,
    /// The module; its entry point is `main`.
    pub spirv: &'a [u32],
    /// Binding numbers of set 0 and what stands there.
    pub bindings: &'a [(u32, BindingKind)],
    /// Specialisation constants: id and 32-bit value (bools as 0 or 1, floats as bits).
    pub constants: &'a [(u32, u32)],
    /// Size of the push constants, bytes; a multiple of four.
    pub push_bytes: u32,
}

/// A compiled compute shader, or a ray generation shader with what it calls; clones share it.
#[derive(Clone)]
pub struct Pipeline(Arc<PipelineInner>);

pub(super) struct PipelineInner {
    device: Arc<Device>,
    name: String,
    set_layout: vk::DescriptorSetLayout,
    pub(super) layout: vk::PipelineLayout,
    pub(super) raw: vk::Pipeline,
    bindings: Vec<(u32, BindingKind)>,
    push_bytes: u32,
    /// That read bindings and push constants.
    stages: vk::ShaderStageFlags,
    /// Only of pipelines that trace rays.
    pub(super) table: Option<ShaderTable>,
}

impl Drop for PipelineInner {
    fn drop(&mut self) {
        let device = self.device.raw();
        // SAFETY: recordings and sets hold the pipeline, so nothing uses it; null handles are ignored.
        unsafe {
            device.destroy_pipeline(self.raw, None);
            device.destroy_pipeline_layout(self.layout, None);
            device.destroy_descriptor_set_layout(self.set_layout, None);
        }
    }
}

/// A shader module for the time of a pipeline's creation.
pub(super) struct Module<'a> {
    device: &'a Device,
    raw: vk::ShaderModule,
}

impl Drop for Module<'_> {
    fn drop(&mut self) {
        // SAFETY: modules may go once the pipeline was made.
        unsafe { self.device.raw().destroy_shader_module(self.raw, None) };
    }
}

impl<'a> Module<'a> {
    pub(super) fn new(
        device: &'a Device,
        spirv: &[u32],
        constants: &[(u32, u32)],
    ) -> Result<Self, vk::Result> {
        let spirv = spirv::specialised(spirv, constants);
        let info = vk::ShaderModuleCreateInfo::default().code(&spirv);
        // SAFETY: the module is trusted (see the safety policy in mod.rs).
        let raw = unsafe { device.raw().create_shader_module(&info, None) }?;
        Ok(Self { device, raw })
    }

    pub(super) fn entry(
        &self,
        stage: vk::ShaderStageFlags,
    ) -> vk::PipelineShaderStageCreateInfo<'static> {
        vk::PipelineShaderStageCreateInfo::default()
            .stage(stage)
            .module(self.raw)
            .name(c"main")
    }
}

impl Pipeline {
    /// Compiles a compute shader. Fails with [`Error::Unsupported`] where the device
    /// cannot bind so much, and with [`Error::Vulkan`] where the driver refuses.
    pub fn compute(device: &Arc<Device>, desc: &PipelineDesc<'_>) -> Result<Self> {
        let make = || {
            let mut inner = PipelineInner::new(device, desc, vk::ShaderStageFlags::COMPUTE)?;
            inner
                .compile(desc)
                .map_err(failed(format!("create pipeline \"{}\"", desc.name)))?;
            Ok(inner.finish())
        };
        device.kept.take_or(|| Recipe::new(desc, None), make)
    }

    pub(super) fn raw(&self) -> vk::Pipeline {
        self.0.raw
    }

    pub(super) fn layout(&self) -> vk::PipelineLayout {
        self.0.layout
    }

    pub(super) fn name(&self) -> &str {
        &self.0.name
    }

    pub(super) fn stages(&self) -> vk::ShaderStageFlags {
        self.0.stages
    }

    pub(super) fn point(&self) -> vk::PipelineBindPoint {
        match &self.0.table {
            None => vk::PipelineBindPoint::COMPUTE,
            Some(_) => vk::PipelineBindPoint::RAY_TRACING_KHR,
        }
    }

    pub(super) fn table(&self) -> Option<&ShaderTable> {
        self.0.table.as_ref()
    }

    pub(super) fn push_bytes(&self) -> u32 {
        self.0.push_bytes
    }

    pub(super) fn is_of(&self, device: &Arc<Device>) -> bool {
        Arc::ptr_eq(&self.0.device, device)
    }
}

fn check_limits(device: &Device, desc: &PipelineDesc<'_>) -> Result<()> {
    let caps = device.caps();
    let storage = desc
        .bindings
        .iter()
        .filter(|(_, kind)| *kind == BindingKind::Storage)
        .count();
    let too_much = |missing| {
        Err(Error::Unsupported {
            what: format!("pipeline \"{}\"", desc.name),
            missing,
        })
    };
    if storage > caps.max_storage_buffers as usize {
        return too_much(format!(
            "it binds {storage} storage buffers, {} takes {}",
            caps.name, caps.max_storage_buffers
        ));
    }
    if desc.push_bytes > caps.max_push_bytes {
        return too_much(format!(
            "it has {} bytes of push constants, {} takes {}",
            desc.push_bytes, caps.name, caps.max_push_bytes
        ));
    }
    let traces = |(_, kind): &(u32, BindingKind)| *kind == BindingKind::AccelerationStructure;
    if desc.bindings.iter().any(traces) {
        device.acceleration()?;
    }
    assert!(
        desc.push_bytes % 4 == 0,
        "push constants of \"{}\" are not whole words",
        desc.name
    );
    Ok(())
}

impl PipelineInner {
    /// A pipeline that has its layouts, to be compiled.
    pub(super) fn new(
        device: &Arc<Device>,
        desc: &PipelineDesc<'_>,
        stages: vk::ShaderStageFlags,
    ) -> Result<Self> {
        check_limits(device, desc)?;
        let mut inner = Self {
            device: Arc::clone(device),
            name: desc.name.to_owned(),
            set_layout: vk::DescriptorSetLayout::null(),
            layout: vk::PipelineLayout::null(),
            raw: vk::Pipeline::null(),
            bindings: desc.bindings.to_vec(),
            push_bytes: desc.push_bytes,
            stages,
            table: None,
        };
        inner
            .create_layouts()
            .map_err(failed(format!("create pipeline \"{}\"", desc.name)))?;
        Ok(inner)
    }

    pub(super) fn finish(self) -> Pipeline {
        self.device.set_name(self.raw, &self.name);
        Pipeline(Arc::new(self))
    }

    fn create_layouts(&mut self) -> Result<(), vk::Result> {
        let device = self.device.raw();
        let bindings: Vec<_> = self
            .bindings
            .iter()
            .filter_map(|&(binding, kind)| {
                let binding = vk::DescriptorSetLayoutBinding::default()
                    .binding(binding)
                    .descriptor_type(kind.vulkan()?)
                    .descriptor_count(1)
                    .stage_flags(self.stages);
                Some(binding)
            })
            .collect();
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        // SAFETY: the description is plain data that outlives the call.
        self.set_layout = unsafe { device.create_descriptor_set_layout(&info, None) }?;
        let ranges = [vk::PushConstantRange::default()
            .stage_flags(self.stages)
            .size(self.push_bytes)];
        let layouts = [self.set_layout];
        let mut info = vk::PipelineLayoutCreateInfo::default().set_layouts(&layouts);
        if self.push_bytes > 0 {
            info = info.push_constant_ranges(&ranges);
        }
        // SAFETY: the set layout was just made; the range is within the device's limit.
        self.layout = unsafe { device.create_pipeline_layout(&info, None) }?;
        Ok(())
    }

    fn compile(&mut self, desc: &PipelineDesc<'_>) -> Result<(), vk::Result> {
        let device = self.device.raw();
        let module = Module::new(&self.device, desc.spirv, desc.constants)?;
        let stage = module.entry(vk::ShaderStageFlags::COMPUTE);
        let info = vk::ComputePipelineCreateInfo::default()
            .stage(stage)
            .layout(self.layout);
        let cache = vk::PipelineCache::null();
        // SAFETY: layout and module are alive and the map entries lie within the constants.
        let result = unsafe { device.create_compute_pipelines(cache, &[info], None) };
        self.raw = result.map_err(|(_, result)| result)?[0];
        Ok(())
    }
}

/// Resources for all bindings of one pipeline; clones share it.
#[derive(Clone)]
pub struct BindSet(Arc<SetInner>);

struct SetInner {
    pipeline: Pipeline,
    name: String,
    pool: vk::DescriptorPool,
    raw: vk::DescriptorSet,
    /// What the descriptors point to, kept alive as long as they do.
    _buffers: Vec<Buffer>,
    _scenes: Vec<Tlas>,
}

impl Drop for SetInner {
    fn drop(&mut self) {
        // SAFETY: recordings hold their sets, so nothing uses this one; it goes with its pool.
        unsafe {
            self.pipeline
                .0
                .device
                .raw()
                .destroy_descriptor_pool(self.pool, None);
        }
    }
}

impl BindSet {
    /// Points every binding of the pipeline to a resource. Panics where a binding
    /// is missing, unknown, or of another kind than the resource.
    pub fn new(pipeline: &Pipeline, name: &str, resources: &[(u32, Resource<'_>)]) -> Result<Self> {
        let bindings = &pipeline.0.bindings;
        for &(binding, _) in resources {
            assert!(
                bindings.iter().any(|&(b, _)| b == binding),
                "\"{name}\": pipeline \"{}\" has no binding {binding}",
                pipeline.name()
            );
        }
        let mut inner = SetInner {
            pipeline: pipeline.clone(),
            name: name.to_owned(),
            pool: vk::DescriptorPool::null(),
            raw: vk::DescriptorSet::null(),
            _buffers: Vec::new(),
            _scenes: Vec::new(),
        };
        inner
            .allocate()
            .map_err(failed(format!("create bind set \"{name}\"")))?;
        for &(binding, kind) in bindings {
            let resource = resources.iter().find(|&&(b, _)| b == binding);
            let &(_, resource) = resource.unwrap_or_else(|| {
                panic!(
                    "\"{name}\" lacks binding {binding} of pipeline \"{}\"",
                    pipeline.name()
                )
            });
            inner.write(binding, kind, resource)?;
        }
        pipeline.0.device.set_name(inner.raw, name);
        Ok(Self(Arc::new(inner)))
    }

    pub(super) fn raw(&self) -> vk::DescriptorSet {
        self.0.raw
    }

    pub(super) fn name(&self) -> &str {
        &self.0.name
    }

    pub(super) fn fits(&self, pipeline: &Pipeline) -> bool {
        Arc::ptr_eq(&self.0.pipeline.0, &pipeline.0)
    }
}

impl SetInner {
    fn allocate(&mut self) -> Result<(), vk::Result> {
        let pipeline = &self.pipeline.0;
        let device = pipeline.device.raw();
        let count = |kind| pipeline.bindings.iter().filter(|b| b.1 == kind).count();
        let sizes: Vec<_> = BindingKind::DESCRIPTORS
            .into_iter()
            .filter_map(|kind| {
                Some(vk::DescriptorPoolSize {
                    ty: kind.vulkan()?,
                    descriptor_count: count(kind) as u32,
                })
            })
            .filter(|size| size.descriptor_count > 0)
            .collect();
        let info = vk::DescriptorPoolCreateInfo::default()
            .max_sets(1)
            .pool_sizes(&sizes);
        // SAFETY: the description is plain data that outlives the call.
        self.pool = unsafe { device.create_descriptor_pool(&info, None) }?;
        let layouts = [pipeline.set_layout];
        let info = vk::DescriptorSetAllocateInfo::default()
            .descriptor_pool(self.pool)
            .set_layouts(&layouts);
        // SAFETY: the pool was made for exactly one set of this layout.
        self.raw = unsafe { device.allocate_descriptor_sets(&info) }?[0];
        Ok(())
    }

    fn write(&mut self, binding: u32, kind: BindingKind, resource: Resource<'_>) -> Result<()> {
        let device = Arc::clone(&self.pipeline.0.device);
        self.check(binding, kind, resource);
        let mut buffers = [vk::DescriptorBufferInfo::default()];
        let mut views = [vk::BufferView::null()];
        let mut scenes = [vk::AccelerationStructureKHR::null()];
        match resource {
            Resource::Buffer(buffer) => {
                buffers[0] = vk::DescriptorBufferInfo {
                    buffer: buffer.raw(),
                    offset: 0,
                    range: vk::WHOLE_SIZE,
                };
                if kind == BindingKind::Texel {
                    views[0] = buffer.view()?;
                }
                self._buffers.push(buffer.clone());
            }
            Resource::Acceleration(tlas) => {
                scenes[0] = tlas.raw();
                self._scenes.push(tlas.clone());
            }
        }
        let mut scene_write = vk::WriteDescriptorSetAccelerationStructureKHR::default()
            .acceleration_structures(&scenes);
        let mut write = vk::WriteDescriptorSet::default()
            .dst_set(self.raw)
            .dst_binding(binding)
            .descriptor_count(1);
        write = match kind {
            BindingKind::Uniform | BindingKind::Storage => write.buffer_info(&buffers),
            BindingKind::Texel => write.texel_buffer_view(&views),
            BindingKind::Address => write,
            BindingKind::AccelerationStructure => write.push_next(&mut scene_write),
        };
        let Some(ty) = kind.vulkan() else {
            return Ok(());
        };
        write = write.descriptor_type(ty);
        // SAFETY: `check` has compared kinds, usages and devices; the set is not in use yet and
        // its resources are kept by `self`.
        unsafe { device.raw().update_descriptor_sets(&[write], &[]) };
        Ok(())
    }

    fn check(&self, binding: u32, kind: BindingKind, resource: Resource<'_>) {
        let device = &self.pipeline.0.device;
        let (what, fits) = match resource {
            Resource::Buffer(buffer) => {
                let flag = match kind {
                    BindingKind::Uniform => vk::BufferUsageFlags::UNIFORM_BUFFER,
                    BindingKind::Storage => vk::BufferUsageFlags::STORAGE_BUFFER,
                    BindingKind::Texel => vk::BufferUsageFlags::UNIFORM_TEXEL_BUFFER,
                    BindingKind::Address => vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS,
                    BindingKind::AccelerationStructure => vk::BufferUsageFlags::empty(),
                };
                let fits = !flag.is_empty() && buffer.usage().allows(flag);
                (buffer.name(), fits && buffer.is_of(device))
            }
            Resource::Acceleration(tlas) => (
                tlas.name(),
                kind == BindingKind::AccelerationStructure && tlas.is_of(device),
            ),
        };
        assert!(
            fits,
            "\"{}\": binding {binding} is {kind:?}, \"{what}\" does not allow that",
            self.name
        );
    }
}
