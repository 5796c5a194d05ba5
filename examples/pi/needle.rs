//! Needles thrown on the device, and what can be said from their sums.

use std::f64::consts::{FRAC_PI_4, SQRT_2};
use std::sync::Arc;

use anyhow::Result;
use etendue::gpu::{
    BindSet, BindingKind, Buffer, Device, Memory, Pipeline, PipelineDesc, Resource, Usage,
};

const KERNEL: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/example_needle.spv"));

/// Invocations of a work group; `local_size_x` of the kernel.
const GROUP: u32 = 64;

/// Needles of one invocation. Few enough that its sum in single precision is as good as the values.
pub const THROWS: u32 = 256;

/// Most invocations of one dispatch: 2²⁴ needles, well below a second on any device.
const DISPATCH: u32 = 1 << 16;

/// The first 2²⁰ values are kept one by one, to look at their tail.
const KEPT: u32 = (1 << 20) / THROWS;

/// Binary logarithms of the least and the largest number of needles.
pub const LOG2: std::ops::RangeInclusive<u32> = 20..=32;

/// One way to throw and to weigh needles. g(x, y) is 1 in the quarter of the unit disc and 0
/// elsewhere in the unit square.
#[derive(Clone, Copy, Debug)]
pub struct Estimator {
    /// `KIND_…` of the kernel.
    kind: u32,
    /// For people.
    pub name: &'static str,
    /// What the mean converges to.
    pub truth: f64,
    /// Of one needle.
    pub variance: f64,
}

/// Uniform needles: the mean of g is the area, and 4 times it π.
pub const UNIFORM: Estimator = Estimator {
    kind: 0,
    name: "uniform: g",
    truth: FRAC_PI_4,
    variance: FRAC_PI_4 * (1.0 - FRAC_PI_4),
};

/// Needles with density f = x + y, counted as if they were uniform: ∫g f = 2/3, not π/4.
pub const SUM_BARE: Estimator = Estimator {
    kind: 1,
    name: "f = x + y: g",
    truth: 2.0 / 3.0,
    variance: 2.0 / 9.0,
};

/// ln(1 + √2), of which f64 has no constant.
const ASINH_1: f64 = 0.881_373_587_019_543;

/// The same needles, each divided by its density: ∫(g/f) f = π/4 again. The second
/// moment ∫g/f is √2 ln(1+√2). P(g/f > t) = 1/(3t³), so the fourth is infinite.
pub const SUM: Estimator = Estimator {
    kind: 2,
    name: "f = x + y: g/f",
    truth: FRAC_PI_4,
    variance: SQRT_2 * ASINH_1 - FRAC_PI_4 * FRAC_PI_4,
};

/// f = 4xy: π/4 as well, but ∫g/f diverges.
pub const PRODUCT: Estimator = Estimator {
    kind: 3,
    name: "f = 4xy: g/f",
    truth: FRAC_PI_4,
    variance: f64::INFINITY,
};

/// Uniform needles divided by the density x + y that did not make them: ∫g/f, which is
/// √2 ln(1+√2) = 1.2465 and has nothing to do with π/4. ∫g/f² diverges.
pub const MISTAKE: Estimator = Estimator {
    kind: 4,
    name: "uniform: g/(x + y)",
    truth: SQRT_2 * ASINH_1,
    variance: f64::INFINITY,
};

/// All of them.
pub const ESTIMATORS: [Estimator; 5] = [UNIFORM, SUM_BARE, SUM, PRODUCT, MISTAKE];

/// What became of the needles of one estimator.
pub struct Throws {
    /// Sum and sum of squares of each [`THROWS`] needles, in order.
    sums: Vec<[f32; 2]>,
    /// The first values.
    pub kept: Vec<f32>,
}

/// Mean and variance of one needle, from many.
#[derive(Clone, Copy, Debug)]
pub struct Estimate {
    pub count: u64,
    pub mean: f64,
    pub variance: f64,
}

impl Estimate {
    /// Standard error of the mean, if the variance can be trusted.
    pub fn standard_error(&self) -> f64 {
        (self.variance / self.count as f64).sqrt()
    }
}

/// Throws 2^`log2` needles, with `log2` in [`LOG2`].
pub fn throw(device: &Arc<Device>, estimator: Estimator, log2: u32, seed: u32) -> Result<Throws> {
    assert!(
        LOG2.contains(&log2),
        "the table of kept values must be full"
    );
    let invocations = ((1_u64 << log2) / u64::from(THROWS)) as u32;
    let pipeline = Pipeline::compute(
        device,
        &PipelineDesc {
            name: "needle",
            spirv: &bytemuck::pod_collect_to_vec::<u8, u32>(KERNEL),
            bindings: &[(0, BindingKind::Storage), (1, BindingKind::Storage)],
            constants: &[(100, estimator.kind), (101, THROWS)],
            push_bytes: 12,
        },
    )?;
    let storage = |name, bytes| {
        Buffer::new(
            device,
            name,
            u64::from(bytes),
            Usage::STORAGE,
            Memory::DeviceLocal,
        )
    };
    let step = invocations.min(DISPATCH);
    let sums = storage("sums", 8 * step)?;
    let kept = storage("kept", 4 * KEPT * THROWS)?;
    let resources = [(0, Resource::Buffer(&sums)), (1, Resource::Buffer(&kept))];
    let set = BindSet::new(&pipeline, "needle", &resources)?;
    let mut all = Vec::with_capacity(invocations as usize);
    // Both are powers of two, and so is the group.
    for first in (0..invocations).step_by(step as usize) {
        let push = [seed, first, KEPT];
        device.run("needles", |commands| {
            commands.dispatch(
                &pipeline,
                &set,
                bytemuck::cast_slice(&push),
                [step / GROUP, 1, 1],
            );
        })?;
        all.extend(sums.read::<[f32; 2]>(step as usize)?);
    }
    Ok(Throws {
        sums: all,
        kept: kept.read((KEPT * THROWS) as usize)?,
    })
}

impl Throws {
    /// From the first `count` needles, a multiple of [`THROWS`]. Double precision counts to 2⁵³.
    pub fn estimate(&self, count: u64) -> Estimate {
        let used = &self.sums[..(count / u64::from(THROWS)) as usize];
        let n = count as f64;
        let mean = used.iter().map(|s| f64::from(s[0])).sum::<f64>() / n;
        let square = used.iter().map(|s| f64::from(s[1])).sum::<f64>() / n;
        Estimate {
            count,
            mean,
            variance: (square - mean * mean) * n / (n - 1.0),
        }
    }

    /// How far a mean of N needles is from `truth`, for each N that is a power of two and
    /// of which there are at least `least` separate blocks: N, and the median over them.
    pub fn median_errors(&self, truth: f64, least: usize) -> Vec<(u64, f64)> {
        let mut sums: Vec<f64> = self.sums.iter().map(|s| f64::from(s[0])).collect();
        let mut count = u64::from(THROWS);
        let mut medians = Vec::new();
        while sums.len() >= least {
            let mut errors: Vec<f64> = sums
                .iter()
                .map(|sum| (sum / count as f64 - truth).abs())
                .collect();
            let middle = errors.len() / 2;
            let (_, median, _) = errors.select_nth_unstable_by(middle, f64::total_cmp);
            medians.push((count, *median));
            sums = sums.chunks_exact(2).map(|pair| pair[0] + pair[1]).collect();
            count *= 2;
        }
        medians
    }
}
