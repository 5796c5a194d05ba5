//! The Vulkan side of a render: buffers, pipeline, batches. What the
//! traversals do not share is in `traversal`.

use std::cell::Cell;
use std::sync::Arc;

use bytemuck::cast_slice;

use super::backend::{Backend, Batch, Frame, film_bytes, film_floats, read_ledger};
use super::photons;
use super::planes::Planes;
use super::room;
use super::stream::{self, Stream};
use super::traversal::{GROUP, Traversal, build_scene, note_roots, note_small, upload_bvh};
use super::upload::SceneData;
use super::{DeviceOptions, Ledger, Memory, Study, TraversalCounts, Tuning, Workshop};
use crate::bvh::Bvh;
use crate::error::{Error, Result};
use crate::gpu::{
    self, BindSet, BindingKind, Buffer, Caps, Device, DeviceKind, DeviceRequest, Pipeline,
    Resource, TexelFormat, Usage, gathers_fast,
};
use crate::layout::{self, ProbeHit, ProbeRay, StreamRay};
use crate::settings::BackendChoice;
use crate::spec::Spec;

/// Records that mix integers and floats are read as integers, whose bits no device changes.
pub(super) const RECORDS: TexelFormat = TexelFormat::Rgba32Uint;
/// Single rays that are traced at once: 72 bytes each on the device, and far less than a second.
const PROBE_RAYS: usize = 1 << 18;

/// Opens the device that can run the choice; says which traversal and why.
pub(super) fn open(
    choice: BackendChoice,
    options: &DeviceOptions,
    workshop: Option<&Workshop>,
) -> Result<(Arc<Device>, BackendChoice, String)> {
    let request = |choice| DeviceRequest {
        select: options.device.as_deref(),
        validation: options.validation,
        ray_query: choice == BackendChoice::RayQuery,
        ray_pipeline: choice == BackendChoice::RayPipeline,
    };
    let open = |choice| match workshop {
        Some(workshop) => workshop.open(&request(choice)),
        None => Device::open(&request(choice)),
    };
    let device = open(choice)?;
    if choice != BackendChoice::Auto {
        return Ok((device, choice, String::from("as asked")));
    }
    let caps = device.caps();
    if caps.ray_hardware_likely {
        drop(device);
        let device = open(BackendChoice::RayQuery)?;
        let reason = String::from("the device has ray query in hardware");
        return Ok((device, BackendChoice::RayQuery, reason));
    }
    let reason = match (&caps.ray_query, &caps.ray_pipeline) {
        (Ok(()), _) => String::from("ray query on a CPU is slower than our own tree"),
        (Err(missing), Ok(())) => format!(
            "the device lacks {missing}; ray tracing pipelines without circuits are slower than our own tree"
        ),
        (Err(missing), Err(_)) => format!("the device lacks {missing}"),
    };
    Ok((device, BackendChoice::Bvh, reason))
}

/// A buffer with its binding.
pub(super) type Input = (u32, BindingKind, Buffer);

/// A scene on a device, ready to render batches.
pub(super) struct VulkanBackend {
    device: Arc<Device>,
    traversal: Traversal,
    params: layout::Params,
    spec: Spec,
    /// Everything that both kernels read.
    shared: Vec<Input>,
    film: Buffer,
    ledger: Buffer,
    pipeline: Pipeline,
    set: BindSet,
    /// Pixels that were taken since the ledger was reset, where they are shared.
    taken: Option<Cell<u32>>,
    study: Study,
    memory: Memory,
}

impl VulkanBackend {
    /// Uploads a scene; `bvh` is its own tree, where rays are traced in it.
    pub fn new(
        device: &Arc<Device>,
        choice: BackendChoice,
        data: &SceneData,
        bvh: Option<Bvh>,
        tuning: &Tuning,
    ) -> Result<Self> {
        let is_cpu = device.caps().kind == DeviceKind::Cpu;
        if data.spec.shares() {
            check_share(device.caps(), choice)?;
        }
        let mut params = data.params;
        let mut spec = data.spec;
        let film_bytes = film_bytes(device.caps().max_storage_range, &params, data.spec.aovs);
        let mut memory = room::estimate(data, bvh.as_ref(), film_bytes);
        room::check(device, &memory, tuning.device_bytes)?;
        let by_address = choice != BackendChoice::RayPipeline
            && tuning.study != Study::Record
            && device.caps().addresses
            && tuning
                .addresses
                .unwrap_or(is_cpu && gathers_fast(device.caps().subgroup_size));
        let (usage, array, storage) = match by_address {
            true => (Usage::ADDRESS, BindingKind::Address, BindingKind::Address),
            false => (Usage::default(), BindingKind::Texel, BindingKind::Storage),
        };
        let film = Buffer::new(
            device,
            "film",
            film_bytes,
            Usage::STORAGE | usage,
            gpu::Memory::DeviceLocal,
        )?;
        let ledger = Buffer::new(
            device,
            "ledger",
            u64::from(layout::LEDGER_SIZE) * 4,
            Usage::STORAGE | usage,
            gpu::Memory::DeviceLocal,
        )?;
        let mut instances = data.instances.clone();
        let vertices = texel(
            device,
            "vertices",
            TexelFormat::Rgba32Float,
            &data.geometry.vertices,
            match choice {
                BackendChoice::Bvh => usage,
                _ => usage | Usage::ACCELERATION_INPUT,
            },
        )?;
        let traversal = match bvh {
            Some(bvh) => {
                note_roots(&bvh, data, &mut params, &mut instances);
                let planes = match tuning.planes.unwrap_or(is_cpu) {
                    true => Planes::of(&bvh, data),
                    false => None,
                };
                if let Some(planes) = &planes {
                    planes.note(&mut spec, &mut params);
                }
                if tuning.small.unwrap_or(is_cpu) && !by_address {
                    note_small(&bvh, &mut spec);
                }
                let list = planes.as_ref().map_or(&[][..], |planes| &planes.list);
                upload_bvh(device, &bvh, list, &spec, usage)?
            }
            None => {
                spec.boxes = tuning.boxes.unwrap_or(is_cpu);
                let (scene, bytes) = build_scene(device, data, &spec, &vertices)?;
                match choice {
                    BackendChoice::RayPipeline => Traversal::Pipeline { scene, bytes },
                    _ => Traversal::Query { scene, bytes },
                }
            }
        };
        let input = |at, name, format, data: &[u8]| -> Result<Input> {
            let buffer = texel(device, name, format, data, usage)?;
            Ok((at, array, buffer))
        };
        let float = TexelFormat::Rgba32Float;
        let (word, pair) = (TexelFormat::R32Uint, TexelFormat::Rg32Uint);
        let allotment = vec![0u32; data.allotted_pixels()];
        let geometry = &data.geometry;
        let mut shared = vec![
            (
                layout::BIND_PARAMS,
                BindingKind::Uniform,
                Buffer::from_slice(device, "params", Usage::UNIFORM | usage, &[params])?,
            ),
            (layout::BIND_VERTICES, array, vertices),
        ];
        #[rustfmt::skip]
        shared.extend([
            input(layout::BIND_INSTANCES, "instances", RECORDS, cast_slice(&instances))?,
            input(layout::BIND_TRIANGLES, "triangles", RECORDS, cast_slice(&geometry.triangles))?,
            input(layout::BIND_ATTRIBUTES, "attributes", float, cast_slice(&geometry.attributes))?,
            input(layout::BIND_MATERIALS, "materials", RECORDS, cast_slice(&data.materials))?,
            input(layout::BIND_TEXTURE_USES, "texture uses", RECORDS, cast_slice(&data.texture_uses))?,
            input(layout::BIND_TEXELS, "texels", word, cast_slice(&data.texels))?,
            input(layout::BIND_LIGHTS, "lights", RECORDS, cast_slice(&data.lights))?,
            input(layout::BIND_ENV_MAP, "environment map", float, cast_slice(&data.env_map))?,
            input(layout::BIND_ENV_TABLE, "environment table", pair, cast_slice(&data.env_table))?,
            input(layout::BIND_MEDIA, "media", RECORDS, cast_slice(&data.media))?,
            input(layout::BIND_GUIDE, "guide", RECORDS, cast_slice(&[[0u32; 4]]))?,
            input(layout::BIND_ALLOTMENT, "allotment", word, cast_slice(&allotment))?,
        ]);
        if tuning.study.has_stream() {
            let none = Stream::with_room(&[])?;
            shared.extend(stream::inputs(device, &none, tuning.study, usage)?);
        }
        let others = [(layout::BIND_FILM, &film), (layout::BIND_LEDGER, &ledger)];
        if by_address {
            let mut all = [0u64; layout::ADDRESSES_SIZE as usize];
            let inputs = shared.iter().map(|(at, _, buffer)| (*at, buffer));
            for (at, buffer) in inputs.chain(others).chain(traversal.arrays()) {
                all[at as usize] = buffer.shader_address().unwrap_or(0);
            }
            let table = Buffer::from_slice(device, "addresses", Usage::UNIFORM, &all)?;
            shared.push((layout::BIND_ADDRESSES, BindingKind::Uniform, table));
        }
        let mut bindings: Vec<_> = shared.iter().map(|(at, kind, _)| (*at, *kind)).collect();
        bindings.extend(others.map(|(at, _)| (at, storage)));
        bindings.extend(traversal.bindings(by_address));
        let compile = |spec: &Spec| {
            traversal.path_pipeline(device, spec, &bindings, tuning.study, by_address)
        };
        let guided = match spec.guide && tuning.guide {
            true => photons::guide(device, &traversal, &spec, &shared, data, compile)?,
            false => None,
        };
        spec.guide = guided.is_some();
        let pipeline = if let Some((guide, pipeline)) = guided {
            let guide = input(layout::BIND_GUIDE, "guide", RECORDS, cast_slice(&guide))?;
            replace(&mut shared, [guide])?;
            pipeline
        } else {
            compile(&spec)?
        };
        let set = bind(&pipeline, "path", &shared, &others, &traversal)?;
        memory.acceleration = traversal.bytes();
        Ok(Self {
            device: Arc::clone(device),
            traversal,
            params,
            spec,
            shared,
            film,
            ledger,
            pipeline,
            set,
            taken: is_cpu.then(Cell::default),
            study: tuning.study,
            memory,
        })
    }
}

impl VulkanBackend {
    fn shared(&self, binding: u32) -> &Buffer {
        find(&self.shared, binding).expect("the kernel has it")
    }
}

pub(super) fn find(shared: &[Input], binding: u32) -> Option<&Buffer> {
    let input = shared.iter().find(|(at, _, _)| *at == binding);
    input.map(|(_, _, buffer)| buffer)
}

/// Puts others in the place of some inputs.
fn replace<const N: usize>(shared: &mut Vec<Input>, inputs: [Input; N]) -> Result<()> {
    shared.retain(|(at, ..)| inputs.iter().all(|input| input.0 != *at));
    for (at, _, buffer) in &inputs {
        note_address(shared, *at, buffer)?;
    }
    shared.extend(inputs);
    Ok(())
}

/// Tells kernels that read by addresses where they find a buffer.
pub(super) fn note_address(shared: &[Input], at: u32, buffer: &Buffer) -> Result<()> {
    match (
        find(shared, layout::BIND_ADDRESSES),
        buffer.shader_address(),
    ) {
        (Some(table), Some(address)) => table.write(8 * u64::from(at), &[address]),
        _ => Ok(()),
    }
}

impl Backend for VulkanBackend {
    fn memory(&self) -> Memory {
        self.memory
    }

    fn device_memory(&self) -> (u64, u64) {
        self.device.memory()
    }

    fn validation_messages(&self) -> Vec<String> {
        self.device.validation_messages()
    }

    fn set_seed(&mut self, seed: u64) -> Result<()> {
        self.params.seed_low = seed as u32;
        self.params.seed_high = (seed >> 32) as u32;
        self.shared(layout::BIND_PARAMS).write(0, &[self.params])
    }

    fn set_allotment(&self, exponents: &[u32]) -> Result<()> {
        self.shared(layout::BIND_ALLOTMENT).write(0, exponents)
    }

    fn frame(&self) -> Frame<'_> {
        Frame {
            params: &self.params,
            spec: &self.spec,
            film_bytes: self.film.bytes(),
        }
    }

    fn render(&mut self, batch: &Batch) -> Result<f64> {
        let (push, groups) = batch.push(self.taken.as_ref());
        let time = self.device.run("path", |commands| {
            self.traversal
                .launch(commands, &self.pipeline, &self.set, &push, groups);
        })?;
        Ok(time.wall)
    }

    fn read(&self, pixels: usize, values: &mut Vec<f32>) -> Result<()> {
        let start = values.len();
        values.resize(start + pixels * film_floats(self.spec.aovs) as usize, 0.0);
        self.film.read_into(&mut values[start..])
    }

    fn reset_ledger(&self) -> Result<()> {
        self.taken.iter().for_each(|taken| taken.set(0));
        self.ledger.write(0, &[0u32; layout::LEDGER_SIZE as usize])
    }

    fn ledger(&self) -> Result<(u64, Ledger)> {
        let words: Vec<u32> = self.ledger.read(layout::LEDGER_SIZE as usize)?;
        Ok(read_ledger(&words))
    }

    fn traversal_counts(&self) -> Result<TraversalCounts> {
        let words: Vec<u32> = self.ledger.read(layout::LEDGER_SIZE as usize)?;
        let pair = |low: u32| {
            let word = |at: u32| u64::from(words[at as usize]);
            word(low) | word(low + 1) << 32
        };
        Ok(TraversalCounts {
            rays: pair(layout::LEDGER_RAYS_LOW),
            nodes: pair(layout::LEDGER_NODES_LOW),
            records: pair(layout::LEDGER_RECORDS_LOW),
            steps: pair(layout::LEDGER_STEPS_LOW),
            lane_steps: pair(layout::LEDGER_LANES_LOW),
            different: words[layout::LEDGER_DIFFERENT as usize].into(),
        })
    }

    fn hold(&mut self, stream: &Stream) -> Result<()> {
        let usage = match find(&self.shared, layout::BIND_ADDRESSES) {
            Some(_) => Usage::ADDRESS,
            None => Usage::default(),
        };
        let inputs = stream::inputs(&self.device, stream, self.study, usage)?;
        replace(&mut self.shared, inputs)?;
        let others = [
            (layout::BIND_FILM, &self.film),
            (layout::BIND_LEDGER, &self.ledger),
        ];
        self.set = bind(
            &self.pipeline,
            "path",
            &self.shared,
            &others,
            &self.traversal,
        )?;
        Ok(())
    }

    fn recorded_counts(&self) -> Result<Vec<u32>> {
        let pixels = self.frame().tiles() * layout::TILE * layout::TILE;
        self.shared(layout::BIND_STREAM_COUNTS)
            .read(pixels as usize)
    }

    fn recorded_rays(&self, count: usize) -> Result<Vec<StreamRay>> {
        self.shared(layout::BIND_STREAM).read(count)
    }

    fn probe(&self, rays: &[ProbeRay]) -> Result<Vec<ProbeHit>> {
        let storage = BindingKind::Storage;
        let mut bindings: Vec<_> = self
            .shared
            .iter()
            .map(|(at, kind, _)| match kind {
                // the kernel has no edition that reads by addresses
                BindingKind::Address => (*at, BindingKind::Texel),
                _ => (*at, *kind),
            })
            .collect();
        bindings.extend([
            (layout::BIND_PROBE_RAYS, storage),
            (layout::BIND_PROBE_HITS, storage),
        ]);
        bindings.extend(self.traversal.bindings(false));
        let traversal = &self.traversal;
        let pipeline = traversal.probe_pipeline(&self.device, &self.spec, &bindings)?;
        let mut hits = Vec::with_capacity(rays.len());
        for some in rays.chunks(PROBE_RAYS) {
            let input = upload(&self.device, "probe rays", some, Usage::STORAGE)?;
            let output = Buffer::new(
                &self.device,
                "probe hits",
                (some.len() * size_of::<ProbeHit>()) as u64,
                Usage::STORAGE,
                gpu::Memory::DeviceLocal,
            )?;
            let others = [
                (layout::BIND_PROBE_RAYS, &input),
                (layout::BIND_PROBE_HITS, &output),
            ];
            let set = bind(&pipeline, "probe", &self.shared, &others, traversal)?;
            let push = layout::Batch {
                sample_count: some.len() as u32,
                ..Default::default()
            };
            let groups = (some.len() as u32).div_ceil(GROUP);
            self.device.run("probe", |commands| {
                traversal.launch(commands, &pipeline, &set, &push, groups);
            })?;
            hits.extend(output.read::<ProbeHit>(some.len())?);
        }
        Ok(hits)
    }
}

/// What a kernel reads and writes.
pub(super) fn bind(
    pipeline: &Pipeline,
    name: &str,
    shared: &[Input],
    others: &[(u32, &Buffer)],
    traversal: &Traversal,
) -> Result<BindSet> {
    let inputs = shared.iter().map(|(at, _, buffer)| (*at, buffer));
    let buffers = inputs.chain(others.iter().copied());
    let mut resources: Vec<_> = buffers.map(|(at, b)| (at, Resource::Buffer(b))).collect();
    resources.extend(traversal.resources());
    BindSet::new(pipeline, name, &resources)
}

pub(super) fn upload<T: bytemuck::Pod>(
    device: &Arc<Device>,
    name: &str,
    data: &[T],
    usage: Usage,
) -> Result<Buffer> {
    let bytes = size_of_val(data) as u64;
    if bytes > device.caps().max_storage_range {
        return Err(Error::Unsupported {
            what: format!("{name} of {bytes} bytes"),
            missing: format!(
                "the device binds {} bytes at most",
                device.caps().max_storage_range
            ),
        });
    }
    Buffer::from_slice(device, name, usage, data)
}

/// Whether pixels can share: those of a block are lanes of a subgroup.
fn check_share(caps: &Caps, choice: BackendChoice) -> Result<()> {
    let missing = match choice {
        BackendChoice::RayPipeline => "pipelines may regroup invocations at every ray",
        _ if !caps.subgroup_shuffle => "the device lacks shuffles in subgroups",
        _ if caps.subgroup_size < layout::SHARE_COUNT => "subgroups of the device are too small",
        _ => return Ok(()),
    };
    Err(Error::Unsupported {
        what: String::from("--share"),
        missing: missing.to_owned(),
    })
}

/// A texel buffer, with `usage` besides.
pub(super) fn texel<T: bytemuck::Pod>(
    device: &Arc<Device>,
    name: &str,
    format: TexelFormat,
    data: &[T],
    usage: Usage,
) -> Result<Buffer> {
    Buffer::from_slice(device, name, Usage::texel(format) | usage, data)
}
