//! Arithmetic: what the shading core takes for granted, and what Vulkan promises.

use std::sync::Arc;

use super::{Check, Random};
use crate::error::Result;
use crate::gpu::{
    BindSet, BindingKind, Buffer, Device, Memory, Pipeline, PipelineDesc, Resource, Usage,
};

const KERNEL: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/selftest.spv"));
/// Invocations of a work group.
const GROUP: usize = 64;
/// Arguments of an operation.
const COUNT: usize = 100_000;
/// π, or the next number below it.
const HALF_TURN: f32 = std::f32::consts::PI * (1.0 - f32::EPSILON);
/// Steps of the long loop: as many as the longest paths of thick media.
const STEPS: u32 = 200_000;

/// The operations of `shaders/selftest.comp`, in its order.
#[derive(Clone, Copy)]
enum Operation {
    Sin,
    Cos,
    Exp,
    Log,
    Divide,
    Sqrt,
    InverseSqrt,
    Finite,
    Contract,
    Associate,
    Loop,
}

/// How an error is measured.
#[derive(Clone, Copy)]
enum Unit {
    /// Distance from the truth.
    Absolute,
    /// In units of the last place of the truth.
    Ulp,
    /// In (3 + 2|x|) units of the last place, of the argument x.
    Exponential,
}

/// A function with its promise.
struct Function {
    name: &'static str,
    operation: Operation,
    arguments: fn(&mut Random) -> [f32; 2],
    truth: fn(f64, f64) -> f64,
    unit: Unit,
    bound: f64,
    promise: &'static str,
}

/// The Vulkan specification's appendix on the precision of SPIR-V instructions. Divisors are within 2^±126 there.
const FUNCTIONS: [Function; 8] = [
    Function {
        name: "sin in −π … π",
        operation: Operation::Sin,
        arguments: |r| [r.between(-HALF_TURN, HALF_TURN), 0.0],
        truth: |x, _| x.sin(),
        unit: Unit::Absolute,
        bound: 1.0 / 2048.0,
        promise: "error ≤ 2⁻¹¹",
    },
    Function {
        name: "cos in −π … π",
        operation: Operation::Cos,
        arguments: |r| [r.between(-HALF_TURN, HALF_TURN), 0.0],
        truth: |x, _| x.cos(),
        unit: Unit::Absolute,
        bound: 1.0 / 2048.0,
        promise: "error ≤ 2⁻¹¹",
    },
    Function {
        name: "exp in −80 … 80",
        operation: Operation::Exp,
        arguments: |r| [r.between(-80.0, 80.0), 0.0],
        truth: |x, _| x.exp(),
        unit: Unit::Exponential,
        bound: 1.0,
        promise: "error ≤ (3 + 2|x|) ulp",
    },
    Function {
        name: "log in 0.5 … 2",
        operation: Operation::Log,
        arguments: |r| [r.between(0.5, 2.0), 0.0],
        truth: |x, _| x.ln(),
        unit: Unit::Absolute,
        bound: 1.0 / 2_097_152.0,
        promise: "error ≤ 2⁻²¹",
    },
    Function {
        name: "log elsewhere",
        operation: Operation::Log,
        arguments: |r| {
            let far = r.between(1.01, 80.0).exp2();
            [if r.unit() < 0.5 { far } else { 1.0 / far }, 0.0]
        },
        truth: |x, _| x.ln(),
        unit: Unit::Ulp,
        // (half a unit more than Vulkan's 3: the truth here is not rounded to a float first. An H100 needs 3.10)
        bound: 3.5,
        promise: "error ≤ 3 ulp of the nearest float",
    },
    Function {
        name: "division",
        operation: Operation::Divide,
        arguments: |r| [r.between(-1e3, 1e3), r.between(-40.0, 40.0).exp2()],
        truth: |x, y| x / y,
        unit: Unit::Ulp,
        bound: 2.5,
        promise: "error ≤ 2.5 ulp",
    },
    Function {
        name: "sqrt",
        operation: Operation::Sqrt,
        arguments: |r| [r.between(-80.0, 80.0).exp2(), 0.0],
        truth: |x, _| x.sqrt(),
        unit: Unit::Ulp,
        bound: 5.0,
        promise: "error ≤ 5 ulp (as 1/inversesqrt)",
    },
    Function {
        name: "inversesqrt",
        operation: Operation::InverseSqrt,
        arguments: |r| [r.between(-80.0, 80.0).exp2(), 0.0],
        truth: |x, _| 1.0 / x.sqrt(),
        unit: Unit::Ulp,
        bound: 2.0,
        promise: "error ≤ 2 ulp",
    },
];

/// All of them.
pub(super) fn checks(device: &Arc<Device>) -> Result<Vec<Check>> {
    let mut checks = Vec::new();
    for function in &FUNCTIONS {
        checks.push(precision(device, function)?);
    }
    checks.push(not_a_number(device)?);
    checks.extend(precise(device)?);
    checks.push(long_loop(device)?);
    Ok(checks)
}

/// What the operation gives for each argument, as bits.
fn evaluate(device: &Arc<Device>, operation: Operation, x: &[[f32; 4]]) -> Result<Vec<u32>> {
    let pipeline = Pipeline::compute(
        device,
        &PipelineDesc {
            name: "selftest",
            spirv: &bytemuck::pod_collect_to_vec::<u8, u32>(KERNEL),
            bindings: &[(0, BindingKind::Storage), (1, BindingKind::Storage)],
            constants: &[(0, operation as u32)],
            push_bytes: 4,
        },
    )?;
    let arguments = Buffer::from_slice(device, "arguments", Usage::STORAGE, x)?;
    let bytes = x.len() as u64 * 4;
    let results = Buffer::new(
        device,
        "results",
        bytes,
        Usage::STORAGE,
        Memory::DeviceLocal,
    )?;
    let resources = [
        (0, Resource::Buffer(&arguments)),
        (1, Resource::Buffer(&results)),
    ];
    let set = BindSet::new(&pipeline, "selftest", &resources)?;
    let push = (x.len() as u32).to_ne_bytes();
    let groups = [x.len().div_ceil(GROUP) as u32, 1, 1];
    device.run("selftest", |commands| {
        commands.dispatch(&pipeline, &set, &push, groups);
    })?;
    results.read(x.len())
}

fn precision(device: &Arc<Device>, f: &Function) -> Result<Check> {
    let mut random = Random(f.operation as u64 + 1);
    let arguments = (0..COUNT).map(|_| (f.arguments)(&mut random));
    let arguments: Vec<[f32; 4]> = arguments.map(|[x, y]| [x, y, 0.0, 0.0]).collect();
    let results = evaluate(device, f.operation, &arguments)?;
    let mut worst = 0.0;
    for (x, bits) in arguments.iter().zip(results) {
        let truth = (f.truth)(x[0].into(), x[1].into());
        let error = (f64::from(f32::from_bits(bits)) - truth).abs();
        let ulp = f64::from(f32::EPSILON) * truth.abs().log2().floor().exp2();
        let error = match f.unit {
            Unit::Absolute => error,
            Unit::Ulp => error / ulp,
            Unit::Exponential => error / ulp / (3.0 + 2.0 * f64::from(x[0].abs())),
        };
        // NaN counts as the worst.
        worst = if error <= worst { worst } else { error };
    }
    let measured = match f.unit {
        Unit::Absolute => format!("{worst:.1e}"),
        Unit::Ulp => format!("{worst:.2} ulp"),
        Unit::Exponential => format!("{worst:.2} of that"),
    };
    Ok(Check::new(
        "numbers",
        f.name,
        f.promise,
        measured,
        worst <= f.bound,
    ))
}

fn not_a_number(device: &Arc<Device>) -> Result<Check> {
    // Quotients and whether they are finite. Of numbers below the least normal one, devices may see 0.
    let cases: [(f32, f32, u32); 6] = [
        (0.0, 0.0, 0),
        (1.0, 0.0, 0),
        (-1.0, 0.0, 0),
        (f32::INFINITY, f32::INFINITY, 0),
        (f32::MAX, 0.5, 0),
        (3.0e38, 2.0, 1),
    ];
    let arguments: Vec<_> = cases.iter().map(|c| [c.0, c.1, 0.0, 0.0]).collect();
    let results = evaluate(device, Operation::Finite, &arguments)?;
    let wrong = cases.iter().zip(&results).filter(|(c, r)| c.2 != **r);
    let wrong = wrong.count();
    let (expected, measured) = ("6 of 6 told", format!("{} of 6", 6 - wrong));
    Ok(Check::new(
        "numbers",
        "NaN and infinity by their bits",
        expected,
        measured,
        wrong == 0,
    ))
}

fn precise(device: &Arc<Device>) -> Result<[Check; 2]> {
    let mut random = Random(77);
    let mut argument = || {
        let (a, b) = (random.between(1.0, 2.0), random.between(1.0, 2.0));
        // c cancels the rounded product, so that a fused operation leaves its rounding error instead of 0 …
        [a, b, -(a * b), 0.0]
    };
    let arguments: Vec<[f32; 4]> = (0..COUNT).map(|_| argument()).collect();
    let results = evaluate(device, Operation::Contract, &arguments)?;
    let fused = results.iter().filter(|bits| f32::from_bits(**bits) != 0.0);
    let fused = fused.count();
    // … and (a + b) − a is not b but b rounded to the last place of a.
    let argument = |x: &[f32; 4]| [1e4 * x[0], x[1], 0.0, 0.0];
    let arguments: Vec<[f32; 4]> = arguments.iter().map(argument).collect();
    let results = evaluate(device, Operation::Associate, &arguments)?;
    let pairs = arguments.iter().zip(&results);
    let changed = pairs.filter(|(x, bits)| (x[0] + x[1]) - x[0] != f32::from_bits(**bits));
    let changed = changed.count();
    let check = |name, count: usize| {
        let measured = format!("{count} of {COUNT} differ");
        Check::new("numbers", name, "as IEEE 754 rounds", measured, count == 0)
    };
    Ok([
        check("precise: products and sums are not fused", fused),
        check("precise: sums keep their order", changed),
    ])
}

fn long_loop(device: &Arc<Device>) -> Result<Check> {
    let arguments: Vec<[f32; 4]> = (0..GROUP as u32)
        .map(|i| [f32::from_bits(i), f32::from_bits(STEPS), 0.0, 0.0])
        .collect();
    let results = evaluate(device, Operation::Loop, &arguments)?;
    let truth = |seed: u32| {
        let step = |s: u32, _| s.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (0..STEPS).fold(seed, step)
    };
    let right = (0..).zip(&results).filter(|&(i, r)| truth(i) == *r).count();
    let measured = format!("{right} of {GROUP}");
    Ok(Check::new(
        "numbers",
        "loops of 200 000 steps run to their end",
        "64 of 64",
        measured,
        right == GROUP,
    ))
}
