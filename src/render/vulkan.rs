//! The Vulkan side of a render: buffers, pipeline, batches. What the
//! traversals do not share is in `traversal`.

use std::ops::Range;
use std::sync::Arc;

use super::room;
use super::traversal::{GROUP, Traversal, build_scene, own_tree, upload_bvh};
use super::upload::SceneData;
use super::{DeviceOptions, Ledger, Memory, TraversalCounts, Tuning};
use crate::error::{Error, Result};
use crate::gpu::{
    self, BindSet, BindingKind, Buffer, Device, DeviceKind, DeviceRequest, Pipeline, Resource,
    TexelFormat, Usage,
};
use crate::layout::{self, ProbeHit, ProbeRay};
use crate::settings::BackendChoice;
use crate::spec;

/// Records that mix integers and floats are read as integers, whose bits no device changes.
pub(super) const RECORDS: TexelFormat = TexelFormat::Rgba32Uint;

/// Opens the device that can run the choice; says which traversal and why.
pub(super) fn open(
    choice: BackendChoice,
    options: &DeviceOptions,
) -> Result<(Arc<Device>, BackendChoice, String)> {
    let request = |choice| DeviceRequest {
        select: options.device.as_deref(),
        validation: options.validation,
        ray_query: choice == BackendChoice::RayQuery,
        ray_pipeline: choice == BackendChoice::RayPipeline,
    };
    let device = Device::open(&request(choice))?;
    if choice != BackendChoice::Auto {
        return Ok((device, choice, String::from("as asked")));
    }
    let caps = device.caps();
    if caps.ray_hardware_likely {
        drop(device);
        let device = Device::open(&request(BackendChoice::RayQuery))?;
        let reason = String::from("the device has ray query in hardware");
        return Ok((device, BackendChoice::RayQuery, reason));
    }
    let reason = match (&caps.ray_query, &caps.ray_pipeline) {
        (Ok(()), _) => String::from("ray query on a CPU is slower than our own tree"),
        (Err(missing), Ok(())) => format!(
            "the device lacks {missing}; ray tracing pipelines alone mean that its driver traces without circuits"
        ),
        (Err(missing), Err(_)) => format!("the device lacks {missing}"),
    };
    Ok((device, BackendChoice::Bvh, reason))
}

/// Rows of tiles whose film fits one buffer.
pub(super) struct Band {
    pub tiles: Range<u32>,
    /// Pixels of the window, row by row.
    pub pixels: Range<u32>,
}

/// Some tiles, an aligned power of two of samples.
pub(super) struct Batch {
    pub first_sample: u64,
    pub samples: u32,
    pub tiles: Range<u32>,
    pub film_first_pixel: u32,
    /// Lanes of a subgroup start their samples together.
    pub is_together: bool,
}

/// A scene on a device, ready to render batches.
pub(super) struct VulkanBackend {
    device: Arc<Device>,
    traversal: Traversal,
    params: layout::Params,
    spec: spec::Spec,
    /// Everything that both kernels read, with its binding.
    shared: Vec<(u32, BindingKind, Buffer)>,
    film: Buffer,
    ledger: Buffer,
    pipeline: Pipeline,
    set: BindSet,
    workers: u32,
    memory: Memory,
}

impl VulkanBackend {
    /// Uploads a scene.
    pub fn new(
        device: &Arc<Device>,
        choice: BackendChoice,
        data: &SceneData,
        tuning: &Tuning,
    ) -> Result<Self> {
        let mut params = data.params;
        let bvh = own_tree(choice, data)?;
        let film_bytes = film_bytes(device, &params, data.spec.aovs);
        let mut memory = room::estimate(data, bvh.as_ref(), film_bytes);
        room::check(device, &memory, tuning.device_bytes)?;
        let mut instances = data.instances.clone();
        let vertices = texel(
            device,
            "vertices",
            TexelFormat::Rgba32Float,
            &data.geometry.vertices,
            choice != BackendChoice::Bvh,
        )?;
        let traversal = match bvh {
            Some(bvh) => {
                params.bvh_root = bvh.root;
                for (record, placement) in instances.iter_mut().zip(&data.geometry.placements) {
                    record.bvh_root = bvh.groups[placement.group].root;
                    record.bvh_first_triangle = bvh.groups[placement.group].first_record;
                }
                upload_bvh(device, &bvh)?
            }
            None => {
                let (scene, bytes) = build_scene(device, data, &vertices)?;
                match choice {
                    BackendChoice::RayPipeline => Traversal::Pipeline { scene, bytes },
                    _ => Traversal::Query { scene, bytes },
                }
            }
        };
        let storage = BindingKind::Storage;
        let shared = vec![
            (
                layout::BIND_PARAMS,
                BindingKind::Uniform,
                Buffer::from_slice(device, "params", Usage::UNIFORM, &[params])?,
            ),
            (
                layout::BIND_INSTANCES,
                storage,
                upload(device, "instances", &instances)?,
            ),
            (
                layout::BIND_TRIANGLES,
                BindingKind::Texel,
                texel(
                    device,
                    "triangles",
                    TexelFormat::Rgba32Uint,
                    &data.geometry.triangles,
                    false,
                )?,
            ),
            (layout::BIND_VERTICES, BindingKind::Texel, vertices),
            (
                layout::BIND_ATTRIBUTES,
                BindingKind::Texel,
                texel(
                    device,
                    "attributes",
                    TexelFormat::Rgba32Float,
                    &data.geometry.attributes,
                    false,
                )?,
            ),
            (
                layout::BIND_MATERIALS,
                BindingKind::Texel,
                texel(device, "materials", RECORDS, &data.materials, false)?,
            ),
            (
                layout::BIND_TEXTURE_USES,
                storage,
                upload(device, "texture uses", &data.texture_uses)?,
            ),
            (
                layout::BIND_TEXELS,
                BindingKind::Texel,
                texel(device, "texels", TexelFormat::R32Uint, &data.texels, false)?,
            ),
            (
                layout::BIND_LIGHTS,
                BindingKind::Texel,
                texel(device, "lights", RECORDS, &data.lights, false)?,
            ),
            (
                layout::BIND_ENV_MAP,
                BindingKind::Texel,
                texel(
                    device,
                    "environment map",
                    TexelFormat::Rgba32Float,
                    &data.env_map,
                    false,
                )?,
            ),
            (
                layout::BIND_MEDIA,
                BindingKind::Texel,
                texel(device, "media", RECORDS, &data.media, false)?,
            ),
            (
                layout::BIND_ENV_TABLE,
                storage,
                upload(device, "environment table", &data.env_table)?,
            ),
        ];

        let film = Buffer::new(
            device,
            "film",
            film_bytes,
            Usage::STORAGE,
            gpu::Memory::DeviceLocal,
        )?;
        let ledger = Buffer::new(
            device,
            "ledger",
            u64::from(layout::LEDGER_SIZE) * 4,
            Usage::STORAGE,
            gpu::Memory::DeviceLocal,
        )?;
        let mut bindings: Vec<_> = shared.iter().map(|(at, kind, _)| (*at, *kind)).collect();
        bindings.extend([(layout::BIND_FILM, storage), (layout::BIND_LEDGER, storage)]);
        bindings.extend(traversal.bindings());
        let pipeline = traversal.path_pipeline(device, &data.spec, &bindings, tuning.study)?;
        let mut resources: Vec<_> = shared
            .iter()
            .map(|(at, _, buffer)| (*at, Resource::Buffer(buffer)))
            .collect();
        resources.extend([
            (layout::BIND_FILM, Resource::Buffer(&film)),
            (layout::BIND_LEDGER, Resource::Buffer(&ledger)),
        ]);
        resources.extend(traversal.resources());
        let set = BindSet::new(&pipeline, "path", &resources)?;
        memory.acceleration = traversal.bytes();
        // A CPU driver runs its threads on contiguous runs of work groups.
        let workers = if device.caps().kind == DeviceKind::Cpu {
            std::thread::available_parallelism().map_or(1, |n| n.get() as u32)
        } else {
            1
        };
        Ok(Self {
            device: Arc::clone(device),
            traversal,
            params,
            spec: data.spec,
            shared,
            film,
            ledger,
            pipeline,
            set,
            workers,
            memory,
        })
    }

    pub fn memory(&self) -> Memory {
        self.memory
    }

    pub fn device_memory(&self) -> (u64, u64) {
        self.device.memory()
    }

    pub fn validation_messages(&self) -> Vec<String> {
        self.device.validation_messages()
    }

    pub fn set_seed(&mut self, seed: u64) -> Result<()> {
        self.params.seed_low = seed as u32;
        self.params.seed_high = (seed >> 32) as u32;
        let mut inputs = self.shared.iter();
        let params = inputs.find(|(at, _, _)| *at == layout::BIND_PARAMS);
        let (_, _, buffer) = params.expect("every kernel reads the parameters");
        buffer.write(0, &[self.params])
    }

    /// Tiles of the window.
    pub fn tiles(&self) -> u32 {
        self.params.tiles_x * self.params.tiles_y
    }

    /// The window in parts whose film fits the buffer.
    pub fn bands(&self) -> Vec<Band> {
        let floats = film_floats(self.spec.aovs);
        let row_bytes = u64::from(self.params.window_width) * 4 * floats * u64::from(layout::TILE);
        let rows = ((self.film.bytes() / row_bytes) as u32).max(1);
        (0..self.params.tiles_y)
            .step_by(rows as usize)
            .map(|row| {
                let end = (row + rows).min(self.params.tiles_y);
                let pixel_row = |r: u32| {
                    (r * layout::TILE).min(self.params.window_height) * self.params.window_width
                };
                Band {
                    tiles: row * self.params.tiles_x..end * self.params.tiles_x,
                    pixels: pixel_row(row)..pixel_row(end),
                }
            })
            .collect()
    }

    /// Makes the driver compile: no sample is taken.
    pub fn warm_up(&mut self) -> Result<()> {
        let batch = Batch {
            first_sample: 0,
            samples: 0,
            tiles: 0..1,
            film_first_pixel: 0,
            is_together: false,
        };
        self.render(&batch).map(|_| ())
    }

    /// Renders a batch into the film buffer; returns seconds.
    pub fn render(&mut self, batch: &Batch) -> Result<f64> {
        let count = batch.tiles.len() as u32;
        let push = layout::Batch {
            first_sample_low: batch.first_sample as u32,
            first_sample_high: (batch.first_sample >> 32) as u32,
            sample_count: batch.samples,
            first_tile: batch.tiles.start,
            tile_count: count,
            interleave: self.workers,
            film_first_pixel: batch.film_first_pixel,
            is_together: u32::from(batch.is_together),
        };
        let groups = count.div_ceil(self.workers) * self.workers;
        let time = self.device.run("path", |commands| {
            self.traversal
                .launch(commands, &self.pipeline, &self.set, &push, groups);
        })?;
        Ok(time.wall)
    }

    /// Appends the film of a band of `pixels`.
    pub fn read(&self, pixels: usize, values: &mut Vec<f32>) -> Result<()> {
        let start = values.len();
        values.resize(start + pixels * film_floats(self.spec.aovs) as usize, 0.0);
        self.film.read_into(&mut values[start..])
    }

    pub fn reset_ledger(&self) -> Result<()> {
        self.ledger.write(0, &[0u32; layout::LEDGER_SIZE as usize])
    }

    /// Rays traced, and what may have changed the expected value.
    pub fn ledger(&self) -> Result<(u64, Ledger)> {
        let words: Vec<u32> = self.ledger.read(layout::LEDGER_SIZE as usize)?;
        let word = |at: u32| u64::from(words[at as usize]);
        let pair = |low: u32| word(low) | word(low + 1) << 32;
        let ledger = Ledger {
            non_finite: word(layout::LEDGER_NON_FINITE),
            truncated_paths: word(layout::LEDGER_TRUNCATED),
            truncated_throughput: pair(layout::LEDGER_THROUGHPUT_LOW) as f64 / 65_536.0,
            interior_overflows: word(layout::LEDGER_INTERIOR_OVERFLOWS),
        };
        Ok((pair(layout::LEDGER_RAYS_LOW), ledger))
    }

    /// What traversal did since the ledger was reset, by the kernel that counts.
    pub fn traversal_counts(&self) -> Result<TraversalCounts> {
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
        })
    }

    /// What given rays meet.
    pub fn probe(&self, rays: &[ProbeRay]) -> Result<Vec<ProbeHit>> {
        let storage = BindingKind::Storage;
        let mut bindings: Vec<_> = self
            .shared
            .iter()
            .map(|(at, kind, _)| (*at, *kind))
            .collect();
        bindings.extend([
            (layout::BIND_PROBE_RAYS, storage),
            (layout::BIND_PROBE_HITS, storage),
        ]);
        bindings.extend(self.traversal.bindings());
        let traversal = &self.traversal;
        let pipeline = traversal.probe_pipeline(&self.device, &self.spec, &bindings)?;
        let input = upload(&self.device, "probe rays", rays)?;
        let output = Buffer::new(
            &self.device,
            "probe hits",
            (rays.len() * size_of::<ProbeHit>()).max(16) as u64,
            Usage::STORAGE,
            gpu::Memory::DeviceLocal,
        )?;
        let mut resources: Vec<_> = self
            .shared
            .iter()
            .map(|(at, _, buffer)| (*at, Resource::Buffer(buffer)))
            .collect();
        resources.extend([
            (layout::BIND_PROBE_RAYS, Resource::Buffer(&input)),
            (layout::BIND_PROBE_HITS, Resource::Buffer(&output)),
        ]);
        resources.extend(self.traversal.resources());
        let set = BindSet::new(&pipeline, "probe", &resources)?;
        let push = layout::Batch {
            sample_count: rays.len() as u32,
            ..Default::default()
        };
        let groups = (rays.len() as u32).div_ceil(GROUP);
        self.device.run("probe", |commands| {
            traversal.launch(commands, &pipeline, &set, &push, groups);
        })?;
        output.read(rays.len())
    }
}

fn upload<T: bytemuck::Pod>(device: &Arc<Device>, name: &str, data: &[T]) -> Result<Buffer> {
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
    Buffer::from_slice(device, name, Usage::STORAGE, data)
}

/// A texel buffer, of which acceleration structures are built if `is_input`.
pub(super) fn texel<T: bytemuck::Pod>(
    device: &Arc<Device>,
    name: &str,
    format: TexelFormat,
    data: &[T],
    is_input: bool,
) -> Result<Buffer> {
    let usage = Usage::texel(format);
    let usage = if is_input {
        usage | Usage::ACCELERATION_INPUT
    } else {
        usage
    };
    Buffer::from_slice(device, name, usage, data)
}

fn film_floats(aovs: bool) -> u64 {
    u64::from(if aovs {
        layout::FILM_FLOATS_AOV
    } else {
        layout::FILM_FLOATS
    })
}

/// Bytes of a film of the whole window, or of as many rows of tiles as the device can bind.
pub(super) fn film_bytes(device: &Device, params: &layout::Params, aovs: bool) -> u64 {
    let row = u64::from(params.window_width) * 4 * film_floats(aovs) * u64::from(layout::TILE);
    let rows = (device.caps().max_storage_range / row).clamp(1, u64::from(params.tiles_y));
    rows * row
}
