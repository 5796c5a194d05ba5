//! π by throwing needles on the GPU: the smallest Monte Carlo integrator that uses
//! the library's Vulkan layer and the renderer's random numbers, and a lesson in
//! importance sampling. Needles that are not thrown uniformly give a wrong area, unless each
//! is divided by the density that made it; and a density that is small where the integrand
//! is not makes an estimate whose error bar means nothing.
//!
//!     cargo run --release --example pi
//!     cargo run --release --example pi -- --log2 30 --svg pi.svg
#![allow(clippy::print_stdout, reason = "a program that prints a table")]

mod chart;
mod needle;
mod tail;

use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::Parser;
use etendue::gpu::{Device, DeviceRequest};

use needle::{ESTIMATORS, Estimator, Throws};
use tail::Tail;

/// Lines of the chart end where fewer blocks are left: the median of a few says little.
const LEAST_BLOCKS: usize = 16;

/// π by throwing needles on the GPU.
#[derive(Parser)]
struct Arguments {
    /// Throw 2^LOG2 needles for each estimator
    #[arg(long, default_value_t = 26, value_parser = clap::value_parser!(u32).range(20..=32))]
    log2: u32,
    /// Seed of the random numbers
    #[arg(long, default_value_t = 1)]
    seed: u32,
    /// Device: its number or a part of its name, as in `etendue info`
    #[arg(long)]
    device: Option<String>,
    /// Write a chart of the errors
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
}

fn main() -> Result<()> {
    let args = Arguments::parse();
    let device = Device::open(&DeviceRequest {
        select: args.device.as_deref(),
        ..DeviceRequest::default()
    })?;
    println!("{}", device.caps().name);
    println!(
        "{:<20} {:>5} {:>11} {:>11} {:>10} {:>10} {:>10}",
        "estimator", "N", "mean", "expected", "deviation", "std error", "its truth"
    );
    let mut curves = Vec::new();
    for estimator in ESTIMATORS {
        let throws = needle::throw(&device, estimator, args.log2, args.seed)?;
        let tail = Tail::of(&throws.kept);
        print_rows(estimator, &throws, tail, args.log2);
        curves.push(chart::Errors {
            name: estimator.name,
            is_heavy: tail.is_heavy(),
            points: throws.median_errors(estimator.truth, LEAST_BLOCKS),
        });
    }
    if let Some(path) = args.svg {
        let text = chart::draw(&curves);
        std::fs::write(&path, text).with_context(|| format!("writing {}", path.display()))?;
    }
    Ok(())
}

/// The estimate from a 256th, a 16th and all of the needles.
fn print_rows(estimator: Estimator, throws: &Throws, tail: Tail, log2: u32) {
    for log2 in [log2 - 8, log2 - 4, log2] {
        let estimate = throws.estimate(1 << log2);
        let verdict = if tail.is_heavy() {
            "σ not trustworthy"
        } else {
            ""
        };
        println!(
            "{:<20} {:>5} {:>11.7} {:>11.7} {:>+10.1e} {:>10.1e} {:>10.1e} {verdict}",
            estimator.name,
            format!("2^{log2}"),
            estimate.mean,
            estimator.truth,
            estimate.mean - estimator.truth,
            estimate.standard_error(),
            (estimator.variance / estimate.count as f64).sqrt(),
        );
    }
}
