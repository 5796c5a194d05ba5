//! The functions of shading, run on the device and compared with independent
//! double-precision references: samplers against their densities, values against
//! the formulas, and the random numbers against chance.
//!
//! Every seed is fixed. All tests of chance share a family-wise false alarm of
//! [`statistics::FALSE_ALARM`] within one test function (Šidák).
//!
//! Without a device the tests print why they are skipped; with the environment
//! variable `ETENDUE_REQUIRE_DEVICE` they fail instead.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "tests may unwrap; they print tables and why they skip"
)]

mod cells;
mod environment;
mod fixture;
mod fresnel;
mod interface;
mod interface_samplers;
mod lights;
mod lookups;
mod media;
mod nets;
mod oracle;
mod phase;
mod random;
mod samplers;
mod scene;
#[path = "../common/statistics.rs"]
mod statistics;
mod values;

use std::path::PathBuf;
use std::sync::Arc;

use etendue::Error;
use etendue::gpu::{
    BindSet, BindingKind, Buffer, Device, DeviceRequest, Memory, Pipeline, PipelineDesc, Resource,
    Usage,
};

/// Invocations a work group in the test kernels.
const GROUP: usize = 64;

/// Bindings of the test kernels beside those of the scene.
const BIND_CASES: u32 = 20;
const BIND_INPUT: u32 = 21;
const BIND_OUTPUT: u32 = 22;
const BIND_COUNTS: u32 = 23;

/// A device under validation, or the printed reason why there is none.
fn open() -> Option<Arc<Device>> {
    let request = DeviceRequest {
        select: None,
        validation: true,
        ray_query: false,
        ray_pipeline: false,
    };
    let required = std::env::var_os("ETENDUE_REQUIRE_DEVICE").is_some();
    match Device::open(&request) {
        Ok(device) => Some(device),
        Err(error @ Error::Unsupported { .. }) if !required => {
            println!("skipped: {error}");
            None
        }
        Err(error) => panic!("{error}"),
    }
}

/// SPIR-V of a kernel; with the feature `mutants`, of the changed one that tests/mutants made of it, which is told the names.
fn spirv(name: &str) -> Vec<u8> {
    let planted = std::env::var_os("ETENDUE_MUTANT_SPIRV").filter(|_| cfg!(feature = "mutants"));
    if let Some(folder) = planted {
        let file = PathBuf::from(folder).join(name);
        if let Ok(words) = std::fs::read(file.with_extension("spv")) {
            return words;
        }
        std::fs::write(file.with_extension("asked"), "").unwrap();
    }
    let file = format!("{name}.spv");
    std::fs::read(PathBuf::from(env!("ETENDUE_SHADER_DIR")).join(file)).unwrap()
}

/// Destroys the device and asserts that validation had nothing to say.
fn finish(device: Arc<Device>) {
    let log = device.validation_log();
    let device =
        Arc::into_inner(device).expect("the test dropped everything that holds the device");
    drop(device);
    assert_eq!(log.messages(), Vec::<String>::new());
}

/// A test kernel.
struct Kernel {
    device: Arc<Device>,
    pipeline: Pipeline,
}

impl Kernel {
    fn new(
        device: &Arc<Device>,
        name: &str,
        bindings: &[(u32, BindingKind)],
        constants: &[(u32, u32)],
        push_words: u32,
    ) -> Self {
        let desc = PipelineDesc {
            name: "shading",
            spirv: &bytemuck::pod_collect_to_vec::<u8, u32>(&spirv(name)),
            bindings,
            constants,
            push_bytes: 4 * push_words,
        };
        Self {
            device: Arc::clone(device),
            pipeline: Pipeline::compute(device, &desc).unwrap(),
        }
    }

    fn storage<T: bytemuck::Pod>(&self, data: &[T]) -> Buffer {
        Buffer::from_slice(&self.device, "input", Usage::STORAGE, data).unwrap()
    }

    /// A buffer of `count` zeroed elements that the host reads back.
    fn output<T: bytemuck::Pod>(&self, count: usize) -> Buffer {
        let bytes = (count * size_of::<T>()) as u64;
        let buffer = Buffer::new(
            &self.device,
            "output",
            bytes,
            Usage::STORAGE,
            Memory::Readback,
        );
        buffer.unwrap()
    }

    fn run(&self, resources: &[(u32, &Buffer)], push: &[u32], groups: [u32; 3]) {
        let resources: Vec<_> = resources
            .iter()
            .map(|&(binding, buffer)| (binding, Resource::Buffer(buffer)))
            .collect();
        let set = BindSet::new(&self.pipeline, "shading", &resources).unwrap();
        self.device
            .run("shading", |commands| {
                commands.dispatch(&self.pipeline, &set, bytemuck::cast_slice(push), groups);
            })
            .unwrap();
    }
}

/// Groups that cover `count` invocations.
fn groups(count: usize) -> [u32; 3] {
    [count.div_ceil(GROUP) as u32, 1, 1]
}
