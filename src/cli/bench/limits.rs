//! The limit report: where the time of our own tree goes, and how far the machine is from its limits.
//!
//! The rays of a pass are recorded with what they met. Then the same pass is rendered as always; without traversal, what
//! rays meet being looked up; and its rays are traced alone: in their order, sorted, and by the device's ray query. What
//! reading them takes by itself is measured by a kernel that traces none.

use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use anyhow::anyhow;
use etendue::error::Error;
use etendue::render::{DeviceOptions, Renderer, Stream, Studied, Study, TraversalCounts, Tuning};
use etendue::scene::Scene;
use etendue::settings::{BackendChoice, Estimator, Settings};

use super::super::failure::{FAILED, Failure};
use super::record::{Limit, Line, Skipped};
use super::{Output, scene_name};

/// log₂ of the samples of the pass; of fewer where the device's buffers do not hold its rays.
const LEVEL: u32 = 4;
/// Passes before the first round: the size of batches and the pace of lanes are found.
const WARM_UPS: usize = 2;
/// Bytes of a node and of a leaf record of our own tree (src/bvh/mod.rs).
const NODE_BYTES: f64 = 80.0;
const RECORD_BYTES: f64 = 64.0;
/// Bytes that each thread reads for the bandwidth of memory; beyond the caches of most machines.
const READ_BYTES: usize = 256 << 20;
/// The best of so many counts.
const READ_ROUNDS: usize = 3;

/// Renders and replays in turns.
pub fn run(
    path: &Path,
    scene: &Scene,
    settings: &Settings,
    options: &DeviceOptions,
    rounds: u64,
    out: &mut Output,
) -> Result<(), Failure> {
    let name = scene_name(path);
    let renderer = |backend: BackendChoice, study: Study| {
        let settings = Settings {
            backend,
            estimator: Estimator::Full,
            ..settings.clone()
        };
        let tuning = Tuning {
            // the device's own test of triangles is part of what is measured
            boxes: Some(false),
            study,
            ..Tuning::default()
        };
        Renderer::tuned(scene, &settings, options, tuning)
    };
    let own = |study: Study| renderer(BackendChoice::Bvh, study);
    let (level, stream) = match record(&mut own(Study::Record)?)? {
        Ok(recording) => recording,
        Err(reason) => {
            let contender = String::from("limits");
            return out.line(&Line::Skipped(Skipped {
                scene: name,
                contender,
                reason,
            }));
        }
    };
    let counts = own(Study::Counts)?.study(level)?.counts;
    let bandwidth = bandwidth();
    let holding = |backend: BackendChoice, study: Study, stream: &Stream| {
        let mut renderer = renderer(backend, study)?;
        renderer.hold(stream)?;
        Ok::<_, Error>(renderer)
    };
    let mut kernels = vec![
        own(Study::None)?,
        holding(BackendChoice::Bvh, Study::Recall, &stream)?,
        holding(BackendChoice::Bvh, Study::Replay, &stream)?,
        holding(BackendChoice::Bvh, Study::Replay, &stream.sorted())?,
        holding(BackendChoice::Bvh, Study::Read, &stream)?,
    ];
    match holding(BackendChoice::RayQuery, Study::Replay, &stream) {
        Ok(query) => kernels.push(query),
        Err(Error::Unsupported { .. }) => {}
        Err(error) => return Err(error.into()),
    }
    drop(stream);
    for _ in 0..WARM_UPS {
        for kernel in &mut kernels {
            kernel.study(level)?;
        }
    }
    for round in 1..=rounds {
        let passes: Result<Vec<Studied>, Error> = kernels
            .iter_mut()
            .map(|kernel| kernel.study(level))
            .collect();
        let line = line(&name, round, level, &passes?, counts, bandwidth)?;
        out.line(&Line::Limit(line))?;
    }
    Ok(())
}

/// The rays of a pass of as many samples as fit, and log₂ of these; or why there is none.
fn record(recorder: &mut Renderer) -> Result<Result<(u32, Stream), String>, Failure> {
    let features = recorder.report().features;
    if features.iter().any(|f| f.name == "nested" && f.on) {
        let reason = "between touching solids rays pass what those before them met";
        return Ok(Err(String::from(reason)));
    }
    let mut level = LEVEL;
    loop {
        match recorder.record(level) {
            Ok(stream) => return Ok(Ok((level, stream))),
            Err(Error::Unsupported { .. }) if level > 0 => level -= 1,
            Err(error @ Error::Unsupported { .. }) => return Ok(Err(error.to_string())),
            Err(error) => return Err(error.into()),
        }
    }
}

/// From the passes of the kernels, in their order.
fn line(
    scene: &str,
    round: u64,
    level: u32,
    passes: &[Studied],
    counts: TraversalCounts,
    bandwidth: f64,
) -> Result<Limit, Failure> {
    let [plain, shading, replay, sorted, reading, query @ ..] = passes else {
        unreachable!("every round has these");
    };
    let different = replay.counts.different + sorted.counts.different;
    if different > 0 {
        let error = anyhow!("{different} rays of {scene} met something else than before");
        return Err(Failure::new(FAILED, error, "replay a render"));
    }
    let per_ray = |n: u64| n as f64 / counts.rays.max(1) as f64;
    let (nodes, records) = (per_ray(counts.nodes), per_ray(counts.records));
    let query = query.first();
    Ok(Limit {
        scene: scene.to_owned(),
        round,
        spp: 1 << level,
        seconds: plain.seconds,
        seconds_shading: shading.seconds,
        seconds_replay: replay.seconds,
        seconds_sorted: sorted.seconds,
        seconds_reading: Some(reading.seconds),
        seconds_ray_query: query.map(|pass| pass.seconds),
        different_ray_query: query.map(|pass| pass.counts.different),
        rays: counts.rays,
        rays_per_second: counts.rays as f64 / plain.seconds,
        nodes_per_ray: nodes,
        records_per_ray: records,
        bytes_per_ray: NODE_BYTES * nodes + RECORD_BYTES * records,
        lane_use: counts.steps as f64 / counts.lane_steps.max(1) as f64,
        bandwidth,
    })
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
