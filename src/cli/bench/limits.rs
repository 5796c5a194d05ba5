//! The limit report: where the time of our own tree goes, and how far the machine is from its limits.
//!
//! Traversal is measured in place: a kernel that traces every ray twice renders the same image, and the time that it
//! takes longer is that of tracing the real stream of rays with the real lanes. The second walk finds its nodes in the
//! caches, so this is a lower bound of traversal.

use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use etendue::render::{DeviceOptions, Renderer, Study, TraversalCounts, Tuning};
use etendue::scene::Scene;
use etendue::settings::{BackendChoice, Estimator, Settings};

use super::super::failure::Failure;
use super::contender::{render_all, warm_up};
use super::record::{Limit, Line};
use super::{Output, scene_name};

/// Samples a pixel of a round; one pass, so that counts are of all of it.
const SPP: u64 = 16;
/// Bytes of a node and of a leaf record of our own tree (src/bvh/mod.rs).
const NODE_BYTES: f64 = 80.0;
const RECORD_BYTES: f64 = 64.0;
/// Bytes that each thread reads for the bandwidth of memory; beyond the caches of most machines.
const READ_BYTES: usize = 256 << 20;
/// The best of so many counts.
const READ_ROUNDS: usize = 3;

/// Renders by the plain kernel and by those that study it, in turns.
pub fn run(
    path: &Path,
    scene: &Scene,
    settings: &Settings,
    options: &DeviceOptions,
    rounds: u64,
    out: &mut Output,
) -> Result<(), Failure> {
    let name = scene_name(path);
    let settings = Settings {
        backend: BackendChoice::Bvh,
        estimator: Estimator::Full,
        ..settings.clone()
    };
    let renderer = |study: Study| {
        let tuning = Tuning {
            study,
            ..Tuning::default()
        };
        Renderer::tuned(scene, &settings, options, tuning)
    };
    let counts = {
        let mut counter = renderer(Study::Counts)?;
        render_all(&mut counter, SPP, 1)?;
        counter.traversal_counts()?
    };
    let bandwidth = bandwidth();
    let mut plain = renderer(Study::None)?;
    let mut twice = renderer(Study::Twice)?;
    for renderer in [&mut plain, &mut twice] {
        warm_up(renderer)?;
    }
    for round in 1..=rounds {
        let seconds = |renderer: &mut Renderer| -> Result<f64, Failure> {
            render_all(renderer, SPP, round)?;
            Ok(renderer.report().times.render)
        };
        let (once, again) = (seconds(&mut plain)?, seconds(&mut twice)?);
        let rays = plain.report().rays;
        let line = record(&name, round, (once, again), rays, counts, bandwidth);
        out.line(&Line::Limit(line))?;
    }
    Ok(())
}

fn record(
    scene: &str,
    round: u64,
    (seconds, seconds_twice): (f64, f64),
    rays: u64,
    counts: TraversalCounts,
    bandwidth: f64,
) -> Limit {
    let per_ray = |n: u64| n as f64 / counts.rays.max(1) as f64;
    let (nodes, records) = (per_ray(counts.nodes), per_ray(counts.records));
    Limit {
        scene: scene.to_owned(),
        round,
        spp: SPP,
        seconds,
        seconds_twice,
        rays_per_second: rays as f64 / seconds,
        nodes_per_ray: nodes,
        records_per_ray: records,
        bytes_per_ray: NODE_BYTES * nodes + RECORD_BYTES * records,
        lane_use: counts.steps as f64 / counts.lane_steps.max(1) as f64,
        bandwidth,
    }
}

/// Bytes a second that all processors together read from memory, one after the other.
fn bandwidth() -> f64 {
    let threads = std::thread::available_parallelism().map_or(1, |n| n.get());
    let words = READ_BYTES / size_of::<u64>();
    let data: Vec<u64> = (0..words as u64).collect();
    let read = || {
        let start = Instant::now();
        std::thread::scope(|scope| {
            for _ in 0..threads {
                scope.spawn(|| black_box(data.iter().fold(0, |sum: u64, w| sum.wrapping_add(*w))));
            }
        });
        (threads * READ_BYTES) as f64 / start.elapsed().as_secs_f64()
    };
    (0..READ_ROUNDS).map(|_| read()).fold(0.0, f64::max)
}
