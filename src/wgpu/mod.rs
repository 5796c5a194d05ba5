//! wgpu, as a yardstick: the same kernel and the same buffers through another API, by
//! ways that differ in who translates the kernel. Knows nothing of scenes or light.
//!
//! Nothing runs past the call that started it, as in [`crate::gpu`].

mod bindings;
mod structures;

use std::future::Future;
use std::pin::pin;
use std::task::{Context, Poll, Waker};
use std::time::Instant;

use wgpu::util::DeviceExt;

use crate::error::{Error, Result};
use crate::gpu::passthrough;
use crate::settings::BackendChoice;
use crate::spirv;

/// Every binding has at least so many bytes: wgpu takes no empty ones, and none smaller than an element.
const LEAST_BYTES: usize = 256;

pub(crate) use structures::{Placement, Shapes, Structures};

/// A buffer on a device.
pub(crate) use wgpu::Buffer;

/// What a kernel sees at a binding.
#[derive(Clone, Copy)]
pub(crate) enum Resource<'a> {
    /// A buffer.
    Buffer(Kind, &'a Buffer),
    /// What rays meet.
    Scene(&'a Structures),
}

/// How a kernel sees a buffer.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// A uniform buffer.
    Uniform,
    /// A storage buffer that is only read.
    Read,
    /// A storage buffer that is written as well.
    ReadWrite,
}

/// An open device.
pub(crate) struct Device {
    raw: wgpu::Device,
    queue: wgpu::Queue,
}

/// A kernel with its buffers.
pub(crate) struct Kernel {
    pipeline: wgpu::ComputePipeline,
    group: wgpu::BindGroup,
}

/// What a kernel is made of.
pub(crate) struct KernelDesc<'a> {
    /// Which of the ways through wgpu it takes.
    pub way: BackendChoice,
    /// The module, with specialisation constants.
    pub spirv: &'a [u32],
    /// Their ids and values.
    pub constants: &'a [(u32, u32)],
    /// What is at each binding.
    pub resources: &'a [(u32, Resource<'a>)],
    /// Bytes of push constants.
    pub push_bytes: u32,
    /// Invocations of a work group.
    pub group_size: u32,
}

impl Device {
    /// Opens the Vulkan device of this name for one of the ways.
    pub fn open(name: &str, way: BackendChoice) -> Result<Self> {
        let failed = |missing: String| Error::Unsupported {
            what: format!("{name} through wgpu"),
            missing,
        };
        let mut desc = wgpu::InstanceDescriptor::new_without_display_handle();
        desc.backends = wgpu::Backends::VULKAN;
        desc.flags = wgpu::InstanceFlags::empty();
        let instance = wgpu::Instance::new(desc);
        let adapters = ready(instance.enumerate_adapters(wgpu::Backends::VULKAN));
        let adapter = adapters
            .into_iter()
            .find(|adapter| adapter.get_info().name == name)
            .ok_or_else(|| failed(String::from("wgpu does not offer the device")))?;
        let mut features = wgpu::Features::IMMEDIATES
            | wgpu::Features::SUBGROUP
            | wgpu::Features::PASSTHROUGH_SHADERS;
        let mut experimental_features = wgpu::ExperimentalFeatures::disabled();
        if way == BackendChoice::WgpuRayQuery {
            features |= wgpu::Features::EXPERIMENTAL_RAY_QUERY;
            experimental_features = passthrough::experimental();
        }
        let missing = features - adapter.features();
        if !missing.is_empty() {
            return Err(failed(format!("wgpu's device lacks {missing}")));
        }
        let request = wgpu::DeviceDescriptor {
            required_features: features,
            required_limits: adapter.limits(),
            experimental_features,
            ..Default::default()
        };
        let (raw, queue) =
            ready(adapter.request_device(&request)).map_err(|error| failed(error.to_string()))?;
        Ok(Self { raw, queue })
    }

    /// Largest storage buffer that a kernel can see, bytes.
    pub fn max_storage_range(&self) -> u64 {
        self.raw.limits().max_storage_buffer_binding_size
    }

    /// A buffer of this content.
    pub fn upload(&self, name: &str, content: &[u8], kind: Kind) -> Result<Buffer> {
        self.check_size(name, content.len() as u64)?;
        let mut padded = content.to_vec();
        padded.resize(content.len().next_multiple_of(16).max(LEAST_BYTES), 0);
        self.watch(name, || {
            self.raw
                .create_buffer_init(&wgpu::util::BufferInitDescriptor {
                    label: Some(name),
                    contents: &padded,
                    usage: usage(kind),
                })
        })
    }

    /// A buffer of zeros.
    pub fn zeros(&self, name: &str, bytes: u64, kind: Kind) -> Result<Buffer> {
        self.check_size(name, bytes)?;
        self.watch(name, || {
            self.raw.create_buffer(&wgpu::BufferDescriptor {
                label: Some(name),
                size: bytes.next_multiple_of(16).max(LEAST_BYTES as u64),
                usage: usage(kind),
                mapped_at_creation: false,
            })
        })
    }

    fn check_size(&self, name: &str, bytes: u64) -> Result<()> {
        let most = self.max_storage_range();
        if bytes <= most {
            return Ok(());
        }
        Err(Error::Unsupported {
            what: format!("{name} of {bytes} bytes"),
            missing: format!("wgpu binds {most} bytes at most"),
        })
    }

    /// Compiles a kernel and binds its buffers.
    pub fn kernel(&self, desc: &KernelDesc<'_>) -> Result<Kernel> {
        let is_read_only = |resource: &_| matches!(resource, Resource::Buffer(Kind::Read, _));
        let resources = desc.resources.iter();
        let numbers: Vec<_> = resources
            .map(|(at, resource)| (*at, is_read_only(resource)))
            .collect();
        // wgpu gives no values to constants of a module that passes by, and naga knows no OpSpecConstantOp
        let words = spirv::specialised(desc.spirv, desc.constants);
        let words = bindings::numbered(&words, &numbers);
        let module = self.watch("kernel", || match desc.way {
            BackendChoice::WgpuSpirv | BackendChoice::WgpuRayQuery => {
                passthrough::passed(&self.raw, &words, (desc.group_size, 1, 1))
            }
            BackendChoice::WgpuUnchecked => passthrough::unchecked(&self.raw, &words),
            _ => self.raw.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some("checked"),
                source: wgpu::ShaderSource::SpirV(words.as_slice().into()),
            }),
        })?;
        let places = || (0..).zip(desc.resources);
        let entries: Vec<_> = places()
            .map(|(at, (_, resource))| entry(at, resource))
            .collect();
        let resources: Vec<_> = places()
            .map(|(binding, (_, resource))| wgpu::BindGroupEntry {
                binding,
                resource: match resource {
                    Resource::Buffer(_, buffer) => buffer.as_entire_binding(),
                    Resource::Scene(structures) => {
                        wgpu::BindingResource::AccelerationStructure(&structures.scene)
                    }
                },
            })
            .collect();
        self.watch("pipeline", || {
            let layout = self
                .raw
                .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                    label: None,
                    entries: &entries,
                });
            let pipeline_layout =
                self.raw
                    .create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                        label: None,
                        bind_group_layouts: &[Some(&layout)],
                        immediate_size: desc.push_bytes,
                    });
            let pipeline = self
                .raw
                .create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                    label: None,
                    layout: Some(&pipeline_layout),
                    module: &module,
                    entry_point: Some("main"),
                    compilation_options: wgpu::PipelineCompilationOptions::default(),
                    cache: None,
                });
            let group = self.raw.create_bind_group(&wgpu::BindGroupDescriptor {
                label: None,
                layout: &layout,
                entries: &resources,
            });
            Kernel { pipeline, group }
        })
    }

    /// Runs work groups of a kernel; returns seconds.
    pub fn run(&self, kernel: &Kernel, push: &[u8], groups: u32) -> Result<f64> {
        let start = Instant::now();
        let mut encoder = self.raw.create_command_encoder(&Default::default());
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&kernel.pipeline);
            pass.set_bind_group(0, &kernel.group, &[]);
            pass.set_immediates(0, push);
            pass.dispatch_workgroups(groups, 1, 1);
        }
        self.queue.submit([encoder.finish()]);
        self.wait()?;
        Ok(start.elapsed().as_secs_f64())
    }

    /// Overwrites the start of a buffer.
    pub fn write(&self, buffer: &Buffer, content: &[u8]) {
        self.queue.write_buffer(buffer, 0, content);
    }

    /// Fills `content` with the start of a buffer.
    pub fn read(&self, buffer: &Buffer, content: &mut [u8]) -> Result<()> {
        let bytes = content.len() as u64;
        let copy = self.watch("read-back", || {
            self.raw.create_buffer(&wgpu::BufferDescriptor {
                label: Some("read-back"),
                size: bytes,
                usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        })?;
        let mut encoder = self.raw.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(buffer, 0, &copy, 0, bytes);
        self.queue.submit([encoder.finish()]);
        // What the callback would say, the mapping says as well.
        copy.map_async(wgpu::MapMode::Read, .., |_| {});
        self.wait()?;
        let mapped = copy.get_mapped_range(..).map_err(|_| lost())?;
        content.copy_from_slice(&mapped);
        Ok(())
    }

    fn wait(&self) -> Result<()> {
        let status = self.raw.poll(wgpu::PollType::wait_indefinitely());
        status.map(|_| ()).map_err(|_| lost())
    }

    /// Does what wgpu may refuse; its reason becomes the error.
    fn watch<T>(&self, what: &str, make: impl FnOnce() -> T) -> Result<T> {
        let scopes = [
            wgpu::ErrorFilter::Validation,
            wgpu::ErrorFilter::OutOfMemory,
            wgpu::ErrorFilter::Internal,
        ]
        .map(|filter| self.raw.push_error_scope(filter));
        let made = make();
        // Scopes are a stack.
        let errors = scopes.into_iter().rev().map(|scope| ready(scope.pop()));
        match errors.flatten().next() {
            None => Ok(made),
            Some(error) => Err(Error::Unsupported {
                what: format!("{what} through wgpu"),
                missing: chain(&error),
            }),
        }
    }
}

/// An error with its causes.
fn chain(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        text = format!("{text}: {error}");
        cause = error.source();
    }
    text
}

fn lost() -> Error {
    Error::DeviceLost {
        pass: String::from("a batch through wgpu"),
    }
}

fn usage(kind: Kind) -> wgpu::BufferUsages {
    let usage = match kind {
        Kind::Uniform => wgpu::BufferUsages::UNIFORM,
        Kind::Read | Kind::ReadWrite => wgpu::BufferUsages::STORAGE,
    };
    usage | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST
}

fn entry(binding: u32, resource: &Resource<'_>) -> wgpu::BindGroupLayoutEntry {
    let buffer = |ty| wgpu::BindingType::Buffer {
        ty,
        has_dynamic_offset: false,
        min_binding_size: None,
    };
    let storage = |read_only| buffer(wgpu::BufferBindingType::Storage { read_only });
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: match resource {
            Resource::Buffer(Kind::Uniform, _) => buffer(wgpu::BufferBindingType::Uniform),
            Resource::Buffer(Kind::Read, _) => storage(true),
            Resource::Buffer(Kind::ReadWrite, _) => storage(false),
            Resource::Scene(_) => wgpu::BindingType::AccelerationStructure {
                vertex_return: false,
            },
        },
        count: None,
    }
}

/// wgpu's futures are ready at once where there is no browser.
fn ready<T>(future: impl Future<Output = T>) -> T {
    match pin!(future).poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(value) => value,
        Poll::Pending => unreachable!("wgpu answers at once outside browsers"),
    }
}
