//! What a render tells about itself, its devices and its scene.

use std::time::Duration;

use crate::film::Film;
use crate::settings::BackendChoice;

/// What a caller wants after a batch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Control {
    /// Go on.
    Continue,
    /// End with the passes that are complete.
    Stop,
}

/// How far a render is.
#[derive(Clone, Copy)]
pub struct Progress<'a> {
    /// The complete passes.
    pub film: &'a Film,
    /// What they took.
    pub work: Work,
    /// Samples a pixel that were there before this run.
    pub samples_before: u64,
    /// Samples a pixel in complete passes.
    pub samples_done: u64,
    /// Samples a pixel in all.
    pub samples_total: u64,
    /// Share of the work, 0 … 1, parts of passes included.
    pub fraction: f64,
    /// Whether the batch completed a pass.
    pub pass_complete: bool,
    /// Since the first sample of this run.
    pub elapsed: Duration,
}

/// A part of the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Feature {
    /// Its name, e.g. `textures`.
    pub name: &'static str,
    /// Whether it is compiled in.
    pub on: bool,
}

/// Durations, seconds.
#[derive(Clone, Copy, Debug, Default)]
pub struct Times {
    /// Preparing, uploading and building acceleration structures.
    pub build: f64,
    /// Making the pipeline, the driver's deferred compilation included.
    pub compile: f64,
    /// Between the first and the last sample.
    pub render: f64,
}

/// Device memory, bytes.
#[derive(Clone, Copy, Debug, Default)]
pub struct Memory {
    /// Vertices and triangles.
    pub geometry: u64,
    /// Trees.
    pub acceleration: u64,
    /// Textures and environment maps.
    pub textures: u64,
    /// Lists of instances, materials, media and lights.
    pub tables: u64,
    /// Sums of samples.
    pub film: u64,
}

impl Memory {
    /// All of it.
    pub fn total(&self) -> u64 {
        self.geometry + self.acceleration + self.textures + self.tables + self.film
    }
}

/// What a render would take, told before it begins.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The traversal that would be used; never `Auto`.
    pub backend: BackendChoice,
    /// Why.
    pub backend_reason: String,
    /// The device's name.
    pub device: String,
    /// Device memory; by ray query and ray tracing pipelines without acceleration
    /// structures, whose size only the device knows once they are built.
    pub memory: Memory,
    /// Bytes that are free on the device.
    pub free: u64,
}

/// What may have changed the expected value.
#[derive(Clone, Copy, Debug, Default)]
pub struct Ledger {
    /// Samples that were not finite and were dropped.
    pub non_finite: u64,
    /// Paths that `--max-depth` cut while they carried light.
    pub truncated_paths: u64,
    /// Their throughput, mean of the channels, summed.
    pub truncated_throughput: f64,
    /// Solids that were entered while the most that are tracked already held the point; their boundaries were missed.
    pub interior_overflows: u64,
}

impl Ledger {
    /// Adds what happened in other samples.
    pub fn add(&mut self, other: &Self) {
        self.non_finite += other.non_finite;
        self.truncated_paths += other.truncated_paths;
        self.truncated_throughput += other.truncated_throughput;
        self.interior_overflows += other.interior_overflows;
    }
}

/// What was done for the samples of a film, over all runs that it took.
#[derive(Clone, Copy, Debug, Default)]
pub struct Work {
    /// Rays traced.
    pub rays: u64,
    /// Seconds between the first and the last sample, breaks excluded.
    pub seconds: f64,
    /// What may have changed the expected value.
    pub ledger: Ledger,
}

/// How a render went.
#[derive(Clone, Debug)]
pub struct Report {
    /// The traversal in use; never `Auto`.
    pub backend: BackendChoice,
    /// Why it was chosen.
    pub backend_reason: String,
    /// The device's name.
    pub device: String,
    /// Its driver.
    pub driver: String,
    /// What the kernels were compiled with.
    pub features: Vec<Feature>,
    /// Durations.
    pub times: Times,
    /// Device memory.
    pub memory: Memory,
    /// Rays traced.
    pub rays: u64,
    /// Paths traced: samples × pixels.
    pub paths: u64,
    /// What may have changed the expected value.
    pub ledger: Ledger,
}

impl Report {
    /// Takes down what a render of `seconds` came to.
    pub(super) fn note(&mut self, film: &Film, work: &Work, seconds: f64) {
        self.times.render = seconds;
        self.paths = film.paths();
        (self.rays, self.ledger) = (work.rays, work.ledger);
    }
}

/// A device and what it can run.
#[derive(Clone, Debug)]
pub struct DeviceInfo {
    /// What `--device` takes.
    pub index: usize,
    /// The device's name.
    pub name: String,
    /// Discrete, integrated, CPU …
    pub kind: String,
    /// Driver's name and version.
    pub driver: String,
    /// Vulkan version.
    pub api_version: String,
    /// Each traversal, with what the device lacks for it.
    pub backends: Vec<(BackendChoice, Result<(), String>)>,
    /// Invocations a subgroup.
    pub subgroup: u32,
}

/// What a scene needs, told without a device.
#[derive(Clone, Debug)]
pub struct SceneModel {
    /// Each part of the model, on or off.
    pub features: Vec<Feature>,
    /// Device memory with the own tree.
    pub memory: Memory,
    /// Triangles that are stored; instances share theirs.
    pub triangles: u64,
    /// Geometry and acceleration for each of them, bytes.
    pub bytes_per_triangle: f64,
}
