//! The lines of a bench file: one JSON object each. docs/bench-format.md is their description.

use serde::{Deserialize, Serialize};

/// Changes when a name is changed or removed; additions do not count.
pub const SCHEMA: u32 = 2;

/// One line.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Line {
    /// Where and how it was measured; the first line.
    Machine(Machine),
    /// A scene and the reference of its errors.
    Scene(Scene),
    /// What a contender took before its first sample.
    Start(Start),
    /// One render against the reference.
    Run(Run),
    /// What the runs of a contender with so many samples say together.
    Bias(Bias),
    /// Whether the means of a peer's pictures are ours.
    Agreement(Agreement),
    /// What could not be measured, and why.
    Skipped(Skipped),
    /// A render for its rate.
    Rate(Rate),
    /// Where the time of our own tree goes.
    Limit(Limit),
    /// A step of a growth sweep.
    Growth(Growth),
    /// A picture beside the bench file.
    Picture(Picture),
    /// A line of a later version.
    #[serde(other)]
    Unknown,
}

/// Where and how it was measured.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct Machine {
    pub schema: u32,
    /// Of etendue.
    pub version: String,
    pub device: String,
    pub driver: String,
    /// Name of the processor.
    pub cpu: String,
    /// Logical processors that this process may use.
    pub cores: usize,
    pub os: String,
    /// Mean number of busy processors over the minute before; absent where the system does not tell.
    pub load: Option<f64>,
    /// What was typed.
    pub command: String,
}

/// A scene and the reference of its errors.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct Scene {
    pub scene: String,
    /// SHA-256 of its files.
    pub hash: String,
    pub width: u32,
    pub height: u32,
    /// 0: unlimited.
    pub max_depth: u32,
    /// Instances counted.
    pub triangles: u64,
    /// Samples a pixel of both halves of the reference.
    pub reference_spp: u64,
    /// Seeds of the halves.
    pub reference_seeds: [u64; 2],
    pub reference_estimator: String,
    /// Mean of the reference, cd/m² per channel.
    pub mean: [f64; 3],
    /// ε of relMSE, (cd/m²)².
    pub epsilon: f64,
}

/// What a contender took before its first sample, seconds.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct Start {
    pub scene: String,
    pub contender: String,
    /// Of whom it is one way to render: `etendue`, or a peer's name without the sampler.
    pub renderer: Option<String>,
    /// From the start of a peer's process until it could be asked, the same for all scenes; 0 of etendue, which opens
    /// the device in `build`.
    pub process: Option<f64>,
    /// Loading, building, uploading.
    pub build: f64,
    /// Compiling; with whatever the driver or a peer had cached.
    pub compile: f64,
}

/// One render against the reference.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct Run {
    pub scene: String,
    pub contender: String,
    pub spp: u64,
    pub seed: u64,
    /// Between the first and the last sample, everything compiled.
    pub seconds: f64,
    pub paths_per_second: f64,
    /// Absent where a peer does not count.
    pub rays_per_second: Option<f64>,
    /// Root of the mean square deviation over pixels and channels, cd/m².
    pub rmse: f64,
    /// Mean of (x − r)²/(r² + ε).
    pub relmse: f64,
    /// The same without the worst 0.1 % of the pixels.
    pub relmse_trimmed: f64,
    /// Of the picture, cd/m² per channel.
    pub mean: [f64; 3],
}

/// What the runs of a contender with so many samples say together.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct Bias {
    pub scene: String,
    pub contender: String,
    pub spp: u64,
    /// Independent pictures.
    pub seeds: usize,
    /// Mean over pixels and channels of (x₁ − r₁)(x₂ − r₂)/(r² + ε): of expected value bias², and therefore negative at times.
    pub bias2: f64,
    /// Its standard error, from the scatter of the pixels.
    pub bias2_error: f64,
    /// Mean over pixels and channels of the variance of one picture over r² + ε.
    pub variance: f64,
}

/// Whether the means of a peer's pictures are ours.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct Agreement {
    pub scene: String,
    pub contender: String,
    /// Largest relative deviation of a channel's mean from the reference's; of a channel that is dark, relative to the brightest.
    pub difference: f64,
    /// Standard error of that, by the scatter of the runs and of the halves of the reference.
    pub error: f64,
    /// Most that it may be.
    pub allowed: f64,
    /// The difference is allowed within two standard errors, and the error is no larger than what is allowed.
    pub agrees: bool,
}

/// What could not be measured, and why.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct Skipped {
    pub scene: String,
    pub contender: String,
    pub reason: String,
}

/// A render for its rate.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct Rate {
    pub scene: String,
    pub backend: String,
    pub estimator: String,
    pub round: u64,
    pub spp: u64,
    pub seconds: f64,
    pub paths_per_second: f64,
    pub rays_per_second: f64,
    /// Preparing, uploading and building trees, seconds.
    pub build: f64,
    /// Making the pipeline, seconds.
    pub compile: f64,
}

/// Where the time of our own tree goes, and how far the machine is from its limits.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct Limit {
    pub scene: String,
    pub round: u64,
    pub spp: u64,
    pub seconds: f64,
    /// The same, what rays meet being looked up.
    pub seconds_shading: f64,
    /// Its rays alone, in their order …
    pub seconds_replay: f64,
    /// … sorted, …
    pub seconds_sorted: f64,
    /// … only read, not traced (earlier files lack it), …
    #[serde(default)]
    pub seconds_reading: Option<f64>,
    /// … and by the device's ray query; absent where it has none.
    pub seconds_ray_query: Option<f64>,
    /// Rays that met something else there.
    pub different_ray_query: Option<u64>,
    /// Of the pass.
    pub rays: u64,
    pub rays_per_second: f64,
    /// Nodes visited.
    pub nodes_per_ray: f64,
    /// Leaf records read, of up to two triangles each.
    pub records_per_ray: f64,
    /// Of nodes and records, caches not considered.
    pub bytes_per_ray: f64,
    /// Share of the lanes of subgroups that trace which are at work.
    pub lane_use: f64,
    /// Bytes a second that this machine's processors read from memory in order.
    pub bandwidth: f64,
}

impl Limit {
    /// Seconds of traversal by itself: what reading the rays takes is no part of it.
    pub fn seconds_traversal(&self) -> f64 {
        self.seconds_replay - self.seconds_reading.unwrap_or(0.0)
    }

    /// How much faster our own tree traverses than the device's ray query.
    pub fn over_ray_query(&self) -> Option<f64> {
        let query = self.seconds_ray_query? - self.seconds_reading.unwrap_or(0.0);
        Some(query / self.seconds_traversal())
    }
}

/// A step of a growth sweep.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct Growth {
    /// What grows: `triangles`, `spp`, `lights` …
    pub sweep: String,
    /// How far.
    pub value: f64,
    pub backend: String,
    pub round: u64,
    pub spp: u64,
    pub pixels: u64,
    /// Instances counted.
    pub triangles: u64,
    pub seconds: f64,
    pub rays_per_second: f64,
    /// Preparing, uploading and building trees, seconds.
    pub build: f64,
    /// Geometry and trees, bytes.
    pub bytes: u64,
    /// Mean over pixels and channels of the estimated variance of the picture over the square of its mean.
    pub variance: f64,
    /// Share of the paths that the depth limit cut.
    pub truncated: f64,
}

/// A picture beside the bench file.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct Picture {
    pub scene: String,
    /// `reference`, or a contender.
    pub contender: String,
    pub spp: u64,
    /// PNG, relative to the bench file.
    pub file: String,
}
