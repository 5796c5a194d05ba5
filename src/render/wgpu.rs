//! The same batches through wgpu, for comparison: our own tree or the device's ray query, with every array in a
//! buffer of wgpu's. What differs from `vulkan` is who translates the kernel and who records it.

use std::cell::Cell;

use super::backend::{Backend, Batch, Frame, film_bytes, film_floats, read_ledger};
use super::traversal::{self, GROUP, build_bvh, note_roots, world_from_object};
use super::upload::SceneData;
use super::{Ledger, Memory, Tuning};
use crate::bvh::Bvh;
use crate::error::{Error, Result};
use crate::gpu::{Caps, DeviceKind};
use crate::layout::{self, ProbeHit, ProbeRay};
use crate::settings::BackendChoice;
use crate::spec::{Spec, kernels};
use crate::wgpu::{
    Buffer, Device, Kernel, KernelDesc, Kind, Placement, Resource, Shapes, Structures,
};

/// A scene on a device of wgpu's.
pub(super) struct WgpuBackend {
    device: Device,
    kernel: Kernel,
    params: layout::Params,
    params_buffer: Buffer,
    film: Buffer,
    film_bytes: u64,
    ledger: Buffer,
    spec: Spec,
    /// Pixels that were taken since the ledger was reset, where they are shared.
    taken: Option<Cell<u32>>,
    memory: Memory,
}

impl WgpuBackend {
    /// On the device of these `caps`, by one of the ways through wgpu.
    pub fn new(caps: &Caps, way: BackendChoice, data: &SceneData, tuning: &Tuning) -> Result<Self> {
        if data.spec.shares() {
            return Err(Error::Unsupported {
                what: String::from("--share through wgpu"),
                missing: String::from("its kernels do not share"),
            });
        }
        if data.spec.allotment {
            return Err(no_allotment());
        }
        let device = Device::open(&caps.name, way)?;
        let is_cpu = caps.kind == DeviceKind::Cpu;
        let mut params = data.params;
        let mut spec = data.spec;
        // no kernel traces photons
        spec.guide = false;
        let mut instances = data.instances.clone();
        let (bvh, scene) = if way == BackendChoice::WgpuRayQuery {
            spec.boxes = tuning.boxes.unwrap_or(is_cpu);
            (None, Some(build_scene(&device, data, &spec)?))
        } else {
            let bvh = build_bvh(data, None)?;
            note_roots(&bvh, data, &mut params, &mut instances);
            (Some(bvh), None)
        };

        let mut arrays = vec![
            (layout::BIND_INSTANCES, bytes(&instances)),
            (layout::BIND_TRIANGLES, bytes(&data.geometry.triangles)),
            (layout::BIND_VERTICES, bytes(&data.geometry.vertices)),
            (layout::BIND_ATTRIBUTES, bytes(&data.geometry.attributes)),
            (layout::BIND_MATERIALS, bytes(&data.materials)),
            (layout::BIND_TEXTURE_USES, bytes(&data.texture_uses)),
            (layout::BIND_TEXELS, bytes(&data.texels)),
            (layout::BIND_LIGHTS, bytes(&data.lights)),
            (layout::BIND_ENV_MAP, bytes(&data.env_map)),
            (layout::BIND_ENV_TABLE, bytes(&data.env_table)),
            (layout::BIND_MEDIA, bytes(&data.media)),
        ];
        if let Some(bvh) = &bvh {
            arrays.push((layout::BIND_BVH_NODES, bytes(&bvh.nodes)));
            arrays.push((layout::BIND_BVH_TRIANGLES, bytes(&bvh.triangles)));
        }
        let read_only = arrays
            .iter()
            .map(|(at, content)| device.upload(&format!("array {at}"), content, Kind::Read))
            .collect::<Result<Vec<_>>>()?;
        let film_bytes = film_bytes(device.max_storage_range(), &params, data.spec.aovs);
        let params_buffer = device.upload("params", bytes(&[params]), Kind::Uniform)?;
        let film = device.zeros("film", film_bytes, Kind::ReadWrite)?;
        let ledger_bytes = u64::from(layout::LEDGER_SIZE) * 4;
        let ledger = device.zeros("ledger", ledger_bytes, Kind::ReadWrite)?;
        let buffer = |kind, buffer| Resource::Buffer(kind, buffer);
        let mut resources = vec![
            (layout::BIND_PARAMS, buffer(Kind::Uniform, &params_buffer)),
            (layout::BIND_FILM, buffer(Kind::ReadWrite, &film)),
            (layout::BIND_LEDGER, buffer(Kind::ReadWrite, &ledger)),
        ];
        resources.extend(
            scene
                .as_ref()
                .map(|scene| (layout::BIND_SCENE, Resource::Scene(scene))),
        );
        let places = arrays.iter().map(|(at, _)| *at);
        resources.extend(
            places
                .zip(&read_only)
                .map(|(at, b)| (at, buffer(Kind::Read, b))),
        );
        let kernel_of = match scene {
            Some(_) => kernels::PATH_WGPU_QUERY,
            None => kernels::PATH_WGPU,
        };
        let kernel = device.kernel(&KernelDesc {
            way,
            spirv: &kernel_of.words(),
            constants: &spec.constants(),
            resources: &resources,
            push_bytes: size_of::<layout::Batch>() as u32,
            group_size: GROUP,
        })?;
        let memory = Memory {
            geometry: data.geometry.bytes(),
            // wgpu does not say how large its structures are
            acceleration: bvh.as_ref().map_or(0, Bvh::bytes),
            textures: data.texture_bytes(),
            tables: data.table_bytes(),
            film: film_bytes,
        };
        Ok(Self {
            device,
            kernel,
            params,
            params_buffer,
            film,
            film_bytes,
            ledger,
            spec,
            taken: is_cpu.then(Cell::default),
            memory,
        })
    }
}

impl Backend for WgpuBackend {
    fn memory(&self) -> Memory {
        self.memory
    }

    fn set_seed(&mut self, seed: u64) -> Result<()> {
        self.params.seed_low = seed as u32;
        self.params.seed_high = (seed >> 32) as u32;
        self.device
            .write(&self.params_buffer, bytes(&[self.params]));
        Ok(())
    }

    /// Its kernel is made for none.
    fn set_allotment(&self, _: &[u32]) -> Result<()> {
        Err(no_allotment())
    }

    fn frame(&self) -> Frame<'_> {
        Frame {
            params: &self.params,
            spec: &self.spec,
            film_bytes: self.film_bytes,
        }
    }

    fn render(&mut self, batch: &Batch) -> Result<f64> {
        let (push, groups) = batch.push(self.taken.as_ref());
        self.device.run(&self.kernel, bytes(&[push]), groups)
    }

    fn read(&self, pixels: usize, values: &mut Vec<f32>) -> Result<()> {
        let start = values.len();
        values.resize(start + pixels * film_floats(self.spec.aovs) as usize, 0.0);
        let content = bytemuck::cast_slice_mut(&mut values[start..]);
        self.device.read(&self.film, content)
    }

    fn reset_ledger(&self) -> Result<()> {
        self.taken.iter().for_each(|taken| taken.set(0));
        let zeros = [0u32; layout::LEDGER_SIZE as usize];
        self.device.write(&self.ledger, bytes(&zeros));
        Ok(())
    }

    fn ledger(&self) -> Result<(u64, Ledger)> {
        let mut words = [0u32; layout::LEDGER_SIZE as usize];
        let content = bytemuck::cast_slice_mut(&mut words);
        self.device.read(&self.ledger, content)?;
        Ok(read_ledger(&words))
    }

    fn probe(&self, _: &[ProbeRay]) -> Result<Vec<ProbeHit>> {
        Err(Error::Unsupported {
            what: String::from("rays one at a time"),
            missing: String::from(
                "the way through wgpu renders pictures only; take the bvh backend",
            ),
        })
    }

    /// Vulkan's layer watches our own device only.
    fn validation_messages(&self) -> Vec<String> {
        Vec::new()
    }
}

fn no_allotment() -> Error {
    Error::Unsupported {
        what: String::from("--adaptive through wgpu"),
        missing: String::from(
            "kernels for it give all pixels as many samples; take the bvh backend",
        ),
    }
}

/// The device's structures of the scene, of boxes with `spec.boxes`.
fn build_scene(device: &Device, data: &SceneData, spec: &Spec) -> Result<Structures> {
    let geometry = &data.geometry;
    let shapes: Vec<_> = traversal::shapes(data, spec).collect();
    let groups = shapes.iter().zip(&geometry.groups).map(|(shapes, group)| {
        let shapes = match shapes {
            traversal::Shapes::Triangles(triangles) => Shapes::Triangles(triangles),
            traversal::Shapes::Boxes(boxes) => Shapes::Boxes(boxes),
        };
        (shapes, !group.has_cutouts)
    });
    let places = geometry.placements.iter().zip(&data.instances);
    let placements: Vec<_> = places
        .map(|(placement, record)| Placement {
            group: placement.group,
            world_from_object: world_from_object(record),
        })
        .collect();
    device.structures(bytes(&geometry.vertices), groups, &placements)
}

fn bytes<T: bytemuck::Pod>(data: &[T]) -> &[u8] {
    bytemuck::cast_slice(data)
}
