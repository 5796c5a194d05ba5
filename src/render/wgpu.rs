//! The same batches through wgpu, for comparison: our own tree, with every array in a buffer
//! of wgpu's. What differs from `vulkan` is who translates the kernel and who records it.

use super::backend::{Backend, Batch, Frame, film_bytes, film_floats, read_ledger, workers};
use super::traversal::{GROUP, build_bvh, note_roots};
use super::upload::SceneData;
use super::{Ledger, Memory};
use crate::error::{Error, Result};
use crate::gpu::{Caps, DeviceKind};
use crate::layout::{self, ProbeHit, ProbeRay};
use crate::settings::BackendChoice;
use crate::spec::{Spec, kernels};
use crate::wgpu::{Buffer, Device, Kernel, KernelDesc, Kind};

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
    workers: u32,
    memory: Memory,
}

impl WgpuBackend {
    /// On the device of these `caps`, by one of the ways through wgpu.
    pub fn new(caps: &Caps, way: BackendChoice, data: &SceneData) -> Result<Self> {
        let device = Device::open(&caps.name)?;
        let mut params = data.params;
        let mut instances = data.instances.clone();
        let bvh = build_bvh(data, None)?;
        note_roots(&bvh, data, &mut params, &mut instances);

        let arrays = [
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
            (layout::BIND_BVH_NODES, bytes(&bvh.nodes)),
            (layout::BIND_BVH_TRIANGLES, bytes(&bvh.triangles)),
            (layout::BIND_MEDIA, bytes(&data.media)),
        ];
        let read_only = arrays
            .iter()
            .map(|(at, content)| device.upload(&format!("array {at}"), content, Kind::Read))
            .collect::<Result<Vec<_>>>()?;
        let film_bytes = film_bytes(device.max_storage_range(), &params, data.spec.aovs);
        let params_buffer = device.upload("params", bytes(&[params]), Kind::Uniform)?;
        let film = device.zeros("film", film_bytes, Kind::ReadWrite)?;
        let ledger_bytes = u64::from(layout::LEDGER_SIZE) * 4;
        let ledger = device.zeros("ledger", ledger_bytes, Kind::ReadWrite)?;
        let mut buffers = vec![
            (layout::BIND_PARAMS, Kind::Uniform, &params_buffer),
            (layout::BIND_FILM, Kind::ReadWrite, &film),
            (layout::BIND_LEDGER, Kind::ReadWrite, &ledger),
        ];
        let places = arrays.iter().map(|(at, _)| *at);
        buffers.extend(places.zip(&read_only).map(|(at, b)| (at, Kind::Read, b)));
        let kernel = device.kernel(&KernelDesc {
            way,
            spirv: &kernels::PATH_WGPU.words(),
            constants: &data.spec.constants(),
            buffers: &buffers,
            push_bytes: size_of::<layout::Batch>() as u32,
            group_size: GROUP,
        })?;
        let memory = Memory {
            geometry: data.geometry.bytes(),
            acceleration: bvh.bytes(),
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
            spec: data.spec,
            workers: workers(caps.kind == DeviceKind::Cpu),
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

    fn frame(&self) -> Frame<'_> {
        Frame {
            params: &self.params,
            spec: &self.spec,
            film_bytes: self.film_bytes,
        }
    }

    fn render(&mut self, batch: &Batch) -> Result<f64> {
        let (push, groups) = batch.push(self.workers);
        self.device.run(&self.kernel, bytes(&[push]), groups)
    }

    fn read(&self, pixels: usize, values: &mut Vec<f32>) -> Result<()> {
        let start = values.len();
        values.resize(start + pixels * film_floats(self.spec.aovs) as usize, 0.0);
        let content = bytemuck::cast_slice_mut(&mut values[start..]);
        self.device.read(&self.film, content)
    }

    fn reset_ledger(&self) -> Result<()> {
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

fn bytes<T: bytemuck::Pod>(data: &[T]) -> &[u8] {
    bytemuck::cast_slice(data)
}
