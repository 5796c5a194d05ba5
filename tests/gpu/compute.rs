//! Pipelines, sets and dispatches.

use std::sync::Arc;

use etendue::gpu::{
    BindSet, BindingKind, Buffer, Device, Memory, Pipeline, PipelineDesc, Resource, TexelFormat,
    Usage,
};

use crate::{GROUP, finish, open};

const RESOURCES: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/test_resources.spv"));

/// `resources.comp` with inputs of `count` elements.
pub struct Kernel {
    pub pipeline: Pipeline,
    pub set: BindSet,
    pub sums: Buffer,
    pub inputs: Vec<Buffer>,
    pub push: Vec<u8>,
    expected: Vec<u32>,
}

const SCALE: u32 = 3;
const BIAS: u32 = 1000;
const FIRST: u32 = 17;
const FACTOR: u32 = 5;

impl Kernel {
    pub fn new(device: &Arc<Device>, count: u32) -> Self {
        let pipeline = Pipeline::compute(
            device,
            &PipelineDesc {
                name: "resources",
                spirv: &bytemuck::pod_collect_to_vec::<u8, u32>(RESOURCES),
                bindings: &[
                    (0, BindingKind::Uniform),
                    (2, BindingKind::Texel),
                    (4, BindingKind::Texel),
                    (5, BindingKind::Texel),
                    (8, BindingKind::Storage),
                    (9, BindingKind::Storage),
                ],
                constants: &[(3, SCALE), (7, 1)],
                push_bytes: 8,
            },
        )
        .unwrap();
        let quads: Vec<[u32; 4]> = (0..count).map(|i| [7 * i, 90, 91, 11 * i]).collect();
        let floats: Vec<[f32; 4]> = (0..count).map(|i| [0.5, i as f32, 2.0, 9.0]).collect();
        let words: Vec<u32> = (0..count).map(|i| i + 100_000).collect();
        let numbers: Vec<u32> = (0..count).map(|i| i * i).collect();
        let texel = Usage::texel;
        let inputs = vec![
            Buffer::from_slice(device, "uniforms", Usage::UNIFORM, &[count, BIAS]).unwrap(),
            Buffer::from_slice(device, "quads", texel(TexelFormat::Rgba32Uint), &quads).unwrap(),
            Buffer::from_slice(device, "floats", texel(TexelFormat::Rgba32Float), &floats).unwrap(),
            Buffer::from_slice(device, "words", texel(TexelFormat::R32Uint), &words).unwrap(),
            Buffer::from_slice(device, "numbers", Usage::STORAGE, &numbers).unwrap(),
        ];
        let sums = Buffer::new(
            device,
            "sums",
            u64::from(count) * 4,
            Usage::STORAGE,
            Memory::DeviceLocal,
        )
        .unwrap();
        let set = bind(&pipeline, &inputs, &sums);
        let expected = (0..count)
            .map(|i| SCALE * i * i + FACTOR * (i + 100_000) + 18 * i + i + 2 + FIRST + BIAS)
            .collect();
        Self {
            pipeline,
            set,
            sums,
            inputs,
            push: bytemuck::cast_slice(&[FIRST, FACTOR]).to_vec(),
            expected,
        }
    }
}

/// A set for `resources.comp` over its five inputs and its output.
pub fn bind(pipeline: &Pipeline, inputs: &[Buffer], sums: &Buffer) -> BindSet {
    let resources: Vec<_> = [0, 2, 4, 5, 8, 9]
        .into_iter()
        .zip(inputs.iter().chain([sums]))
        .map(|(binding, buffer)| (binding, Resource::Buffer(buffer)))
        .collect();
    BindSet::new(pipeline, "resources", &resources).unwrap()
}

#[test]
fn kernel_sees_every_resource_and_constant() {
    let Some(device) = open(false) else { return };
    // Not a multiple of the group's size; the squares stay below 2³².
    let count = 10_007;
    let mut kernel = Kernel::new(&device, count);
    // The set keeps what it points to.
    kernel.inputs.clear();
    let groups = [(count as usize).div_ceil(GROUP) as u32, 1, 1];
    let time = device
        .run("three additions", |commands| {
            commands.fill_zero(&kernel.sums);
            for _ in 0..3 {
                commands.dispatch(&kernel.pipeline, &kernel.set, &kernel.push, groups);
            }
        })
        .unwrap();
    let sums: Vec<u32> = kernel.sums.read(count as usize).unwrap();
    let expected: Vec<u32> = kernel.expected.iter().map(|sum| 3 * sum).collect();
    assert!(sums == expected);
    assert!(time.wall > 0.0 && time.gpu > 0.0, "{time:?}");
    // Clocks of host and device may disagree by a little; their units must not.
    assert!(time.gpu < time.wall * 1.1 + 1e-3, "{time:?}");
    drop(kernel);
    finish(device);
}

#[test]
fn recordings_keep_what_they_use() {
    let Some(device) = open(false) else { return };
    let sums = device
        .run("dropped early", |commands| {
            let kernel = Kernel::new(&device, 64);
            commands.fill_zero(&kernel.sums);
            commands.dispatch(&kernel.pipeline, &kernel.set, &kernel.push, [1, 1, 1]);
        })
        .map(|_| ());
    assert!(sums.is_ok());
    finish(device);
}

#[test]
fn wrong_bindings_panic_with_their_number() {
    let Some(device) = open(false) else { return };
    let kernel = Kernel::new(&device, 4);
    let panic_of = |resources: &[(u32, Resource<'_>)]| {
        let attempt = std::panic::AssertUnwindSafe(|| {
            BindSet::new(&kernel.pipeline, "wrong", resources).map(|_| ())
        });
        let payload = std::panic::catch_unwind(attempt).expect_err("refused");
        payload
            .downcast_ref::<String>()
            .cloned()
            .unwrap_or_default()
    };
    let storage = Resource::Buffer(&kernel.sums);
    assert!(panic_of(&[]).contains("lacks binding 0"));
    assert!(panic_of(&[(6, storage)]).contains("no binding 6"));
    assert!(panic_of(&[(0, storage)]).contains("binding 0 is Uniform"));
    drop(kernel);
    finish(device);
}
