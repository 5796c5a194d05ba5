//! What can be typed. Turning it into settings is `render.rs`'s part.

use std::ops::Range;
use std::path::{Path, PathBuf};

use clap::builder::PossibleValuesParser;
use clap::{ArgAction, Args, Parser, Subcommand, ValueEnum};
use etendue::film::MAX_SAMPLES;
use etendue::image_io::{Aov, Tone};
use etendue::settings::{BackendChoice, Crop, Estimator, MAX_SIDE};

use super::bench::args::{BenchArgs, ChartArgs};
use super::compare::CompareArgs;
use super::numbers::{crop, finite, not_negative, numbers, positive, samples};
use super::selftest::SelftestArgs;

/// A physically based path tracer on Vulkan: glTF in, radiometrically right OpenEXR out.
#[derive(Parser)]
#[command(version, max_term_width = 100)]
pub struct Arguments {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The commands.
#[derive(Subcommand)]
pub enum Command {
    /// Render a scene
    Render(Box<RenderArgs>),
    /// Merge shards of one render
    Merge(MergeArgs),
    /// Render an image again from its header
    Rerender(RerenderArgs),
    /// Measure light in a scene: irradiance, radiance, intensity or flux
    Measure(Box<MeasureArgs>),
    /// Compare two images: whether they differ by more than their noise, and how much
    Compare(CompareArgs),
    /// Test what this device and driver really do
    Selftest(SelftestArgs),
    /// Show devices and, with a scene, what it holds and needs
    Info(InfoArgs),
    /// Measure error against time, rates and growth; one JSON object a line
    Bench(Box<BenchArgs>),
    /// Draw what bench has measured
    Chart(ChartArgs),
}

/// `etendue info`
#[derive(Args)]
pub struct InfoArgs {
    /// Scene: .gltf or .glb
    pub scene: Option<PathBuf>,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

/// `etendue merge`
#[derive(Args)]
pub struct MergeArgs {
    /// Images of `etendue render --samples A..B`, or merged ones
    #[arg(required = true, value_name = "SHARD.exr")]
    pub shards: Vec<PathBuf>,
    /// Image to write
    #[arg(short, long, value_name = "FILE.exr")]
    pub output: PathBuf,
    /// Allow samples to be missing; the header then tells which are there
    #[arg(long)]
    pub partial: bool,
}

/// `etendue rerender`
#[derive(Args)]
pub struct RerenderArgs {
    /// Image of `etendue render` or `merge`
    #[arg(value_name = "FILE.exr")]
    pub image: PathBuf,
    /// Image to write, .exr or .png by its suffix; may be given several times
    #[arg(short, long, value_name = "FILE", required = true)]
    pub output: Vec<PathBuf>,
    /// Where the scene is now [default: where the header says]
    #[arg(long, value_name = "FILE")]
    pub scene: Option<PathBuf>,
    /// Where the environment image is now [default: where the header says]
    #[arg(long, value_name = "FILE")]
    pub env: Option<PathBuf>,
    /// Vulkan device, by index or a part of its name [default: as the header says]
    #[arg(long, value_name = "INDEX|NAME")]
    pub device: Option<String>,
    /// Show errors only
    #[arg(short, long)]
    pub quiet: bool,
}

/// `etendue measure`
#[derive(Args)]
#[command(group = clap::ArgGroup::new("quantity").required(true))]
pub struct MeasureArgs {
    /// Scene: .gltf or .glb
    pub scene: PathBuf,
    /// Light on a surface at a point, which faces N (lx)
    #[arg(long, group = "quantity", value_name = "X,Y,Z,NX,NY,NZ", allow_hyphen_values = true, value_parser = numbers::<6>)]
    pub irradiance: Option<[f64; 6]>,
    /// Light that arrives at a point, seen into direction D (cd/m²)
    #[arg(long, group = "quantity", value_name = "X,Y,Z,DX,DY,DZ", allow_hyphen_values = true, value_parser = numbers::<6>)]
    pub radiance: Option<[f64; 6]>,
    /// Light of a node and what hangs on it, alone in the dark, into direction D (cd)
    #[arg(long, group = "quantity", value_name = "NODE,DX,DY,DZ")]
    pub intensity: Option<String>,
    /// All light of a node and what hangs on it, alone in the dark (lm)
    #[arg(long, group = "quantity", value_name = "NODE")]
    pub flux: Option<String>,

    /// Take the scene's units as radiometric (W instead of lm) at this wavelength, and show photons a second as well
    #[arg(long, value_name = "NM", allow_negative_numbers = true, value_parser = positive)]
    pub wavelength: Option<f64>,
    /// Samples at most, in thousands [default: 1024]; the first limit reached stops
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(2..=MAX_SAMPLES))]
    pub spp: Option<u64>,
    /// Seconds of measuring at most; at least one pass is measured
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = positive)]
    pub time: Option<f64>,
    /// As many samples as give a standard error of X of the luminance-weighted value;
    /// other samples, a ninth as many, tell how many that are
    #[arg(long, value_name = "X", allow_negative_numbers = true, value_parser = positive)]
    pub noise: Option<f64>,
    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Latitude-longitude image that lights the scene, .hdr or .exr; replaces the scene's own
    #[arg(long, value_name = "FILE")]
    pub env: Option<PathBuf>,
    /// Factor on the image's values
    #[arg(long, value_name = "X", requires = "env", default_value_t = 1.0, allow_negative_numbers = true, value_parser = not_negative)]
    pub env_intensity: f64,
    /// Rotation of the image about +Y, right-handed
    #[arg(long, value_name = "DEGREES", requires = "env", default_value_t = 0.0,
          allow_negative_numbers = true, value_parser = finite)]
    pub env_rotation: f64,
    /// Scattering events at most; 0: unlimited
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub max_depth: u32,
    /// How rays are traced
    #[arg(long, value_enum, default_value_t = Backend::Auto)]
    pub backend: Backend,
    /// Vulkan device, by index or a part of its name
    #[arg(long, value_name = "INDEX|NAME")]
    pub device: Option<String>,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
    /// Show errors only
    #[arg(short, long)]
    pub quiet: bool,
}

/// `etendue render`
#[derive(Args)]
pub struct RenderArgs {
    /// Scene: .gltf or .glb
    pub scene: PathBuf,
    /// Image to write, .exr or .png by its suffix; may be given several times
    #[arg(short, long, value_name = "FILE", required = true)]
    pub output: Vec<PathBuf>,

    /// Samples per pixel at most; the first limit reached stops [default: 128]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=MAX_SAMPLES))]
    pub spp: Option<u64>,
    /// Seconds of rendering at most; at least one pass is rendered
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = positive)]
    pub time: Option<f64>,
    /// As many samples as give a standard error of X of the signal, both as root mean
    /// squares over the image; other samples, a ninth as many, tell how many that are
    #[arg(long, value_name = "X", allow_negative_numbers = true, value_parser = positive)]
    pub noise: Option<f64>,
    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Global sample indices, A is rendered, B is not: the shard of a larger render
    #[arg(long, value_name = "A..B", conflicts_with = "spp", value_parser = samples)]
    pub samples: Option<Range<u64>>,
    /// Spread the samples so that noisy pixels take more, as a sixteenth as many other samples tell:
    /// --spp on average, a quarter of it at least and four times it at most; from 64 on
    #[arg(long, conflicts_with_all = ["samples", "noise"])]
    pub adaptive: bool,
    /// Let blocks of 4 × 2 pixels share what their paths find, where all surfaces are opaque: less noise in rooms, and
    /// the same noise in neighbours
    #[arg(long, conflicts_with = "adaptive")]
    pub share: bool,

    /// Width of the frame in pixels [default: 1280, or from the height]
    #[arg(long, value_name = "N", value_parser = side())]
    pub width: Option<u32>,
    /// Height of the frame in pixels [default: from the width and the camera's aspect, else 16:9]
    #[arg(long, value_name = "N", value_parser = side())]
    pub height: Option<u32>,
    /// Pixels of the frame to render; X1 and Y1 are not part of it
    #[arg(long, value_name = "X0,Y0,X1,Y1", value_parser = crop)]
    pub crop: Option<Crop>,
    /// Camera of the scene, by name or index [default: the first, else one that frames the scene]
    #[arg(long, value_name = "NAME|INDEX")]
    pub camera: Option<String>,

    /// Latitude-longitude image that lights the scene, .hdr or .exr; replaces the scene's own
    #[arg(long, value_name = "FILE")]
    pub env: Option<PathBuf>,
    /// Factor on the image's values
    #[arg(long, value_name = "X", requires = "env", default_value_t = 1.0, allow_negative_numbers = true, value_parser = not_negative)]
    pub env_intensity: f64,
    /// Rotation of the image about +Y, right-handed
    #[arg(long, value_name = "DEGREES", requires = "env", default_value_t = 0.0,
          allow_negative_numbers = true, value_parser = finite)]
    pub env_rotation: f64,

    /// Scattering events at most; 0: unlimited
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub max_depth: u32,
    /// How rays are traced
    #[arg(long, value_enum, default_value_t = Backend::Auto)]
    pub backend: Backend,
    /// Vulkan device, by index or a part of its name; several by indices between commas; all
    #[arg(long, value_name = "INDEX|NAME|LIST|all")]
    pub device: Option<String>,
    /// Everything that lowers the error for the time, or the yardstick
    #[arg(long, value_enum, default_value_t = EstimatorName::Full)]
    pub estimator: EstimatorName,
    /// Keep the tree over the scene's triangles and its decoded images in this folder, so that later renders start sooner; safe to delete
    #[arg(long, value_name = "FOLDER")]
    pub cache: Option<PathBuf>,

    /// Share of samples that may be dropped, since they were not finite, before the render counts as failed
    #[arg(long, value_name = "X", default_value_t = 1e-6, allow_negative_numbers = true, value_parser = not_negative)]
    pub max_dropped: f64,

    /// Extra layers of the EXR, separated by commas; `dropped` counts samples that were not finite,
    /// `instance` and `material` number what covers the middle of a pixel (-1: nothing)
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = aov())]
    pub aov: Vec<String>,
    /// Tone curve of display formats; EXR is always linear. none: linear values
    /// stored unencoded; srgb: clamped, then the sRGB transfer curve
    #[arg(long, default_value = Tone::Srgb.name(),
          value_parser = PossibleValuesParser::new(Tone::ALL.map(Tone::name)))]
    pub tonemap: String,
    /// Exposure of display formats in stops
    #[arg(long, value_name = "EV", default_value_t = 0.0, allow_negative_numbers = true,
          value_parser = finite)]
    pub exposure: f64,

    /// Save all work in this file at an interval, at the end and when interrupted
    #[arg(long, value_name = "FILE")]
    pub checkpoint: Option<PathBuf>,
    /// Seconds between checkpoints, at least
    #[arg(long, value_name = "SECONDS", requires = "checkpoint", default_value_t = 60.0,
          allow_negative_numbers = true, value_parser = not_negative)]
    pub checkpoint_interval: f64,
    /// Go on from the checkpoint, if it is there
    #[arg(long, requires = "checkpoint")]
    pub resume: bool,

    /// Check everything and say what memory the render would take, without rendering
    #[arg(long)]
    pub dry_run: bool,

    /// Write statistics as JSON
    #[arg(long, value_name = "FILE.json")]
    pub stats: Option<PathBuf>,
    /// How progress is shown on stderr; auto: a bar on a terminal, else plain lines
    #[arg(long, value_enum, default_value_t = ProgressName::Auto)]
    pub progress: ProgressName,
    /// Show errors only
    #[arg(short, long, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Show what is done (-vv: in detail)
    #[arg(short, long, action = ArgAction::Count)]
    pub verbose: u8,
}

impl RenderArgs {
    /// The layers asked for, each once, in order of their definition.
    pub fn aovs(&self) -> Vec<Aov> {
        let asked = |aov: &Aov| self.aov.iter().any(|name| name == aov.name());
        Aov::ALL.into_iter().filter(asked).collect()
    }

    /// The folder in which trees and images are kept; a dry run leaves nothing there.
    pub fn cache(&self) -> Option<&Path> {
        self.cache.as_deref().filter(|_| !self.dry_run)
    }

    /// The tone curve asked for.
    pub fn tone(&self) -> Tone {
        Tone::ALL
            .into_iter()
            .find(|tone| tone.name() == self.tonemap)
            .expect("the parser admits only these names")
    }
}

/// `--backend`
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Backend {
    /// The fastest one that the device can run
    Auto,
    /// The device's ray query (VK_KHR_ray_query)
    RayQuery,
    /// The device's ray tracing pipeline (VK_KHR_ray_tracing_pipeline)
    RayPipeline,
    /// Own bounding volume hierarchy in a compute shader; needs no ray tracing hardware
    Bvh,
    /// The same through wgpu, for comparison of speed
    #[cfg(feature = "wgpu")]
    #[value(alias = "wgpu-checked")]
    Wgpu,
    /// The same through wgpu, without naga's checks at run time
    #[cfg(feature = "wgpu")]
    WgpuUnchecked,
    /// The same through wgpu, with the shader as it is
    #[cfg(feature = "wgpu")]
    WgpuSpirv,
    /// The device's ray query through wgpu, with the shader as it is
    #[cfg(feature = "wgpu")]
    WgpuRayQuery,
}

impl From<Backend> for BackendChoice {
    fn from(backend: Backend) -> Self {
        match backend {
            Backend::Auto => Self::Auto,
            Backend::RayQuery => Self::RayQuery,
            Backend::RayPipeline => Self::RayPipeline,
            Backend::Bvh => Self::Bvh,
            #[cfg(feature = "wgpu")]
            Backend::Wgpu => Self::Wgpu,
            #[cfg(feature = "wgpu")]
            Backend::WgpuUnchecked => Self::WgpuUnchecked,
            #[cfg(feature = "wgpu")]
            Backend::WgpuSpirv => Self::WgpuSpirv,
            #[cfg(feature = "wgpu")]
            Backend::WgpuRayQuery => Self::WgpuRayQuery,
        }
    }
}

/// `--estimator`
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum EstimatorName {
    /// Everything that lowers the error for the time
    Full,
    /// BSDF sampling, next event estimation with uniform light choice, independent random numbers
    Textbook,
}

impl From<EstimatorName> for Estimator {
    fn from(estimator: EstimatorName) -> Self {
        match estimator {
            EstimatorName::Full => Self::Full,
            EstimatorName::Textbook => Self::Textbook,
        }
    }
}

/// `--progress`
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ProgressName {
    /// A bar on a terminal, else plain lines
    Auto,
    /// A line every few seconds
    Plain,
    /// JSON objects, one a line
    Json,
    /// Nothing
    None,
}

pub fn side() -> clap::builder::RangedI64ValueParser<u32> {
    clap::value_parser!(u32).range(1..=i64::from(MAX_SIDE))
}

fn aov() -> PossibleValuesParser {
    PossibleValuesParser::new(Aov::ALL.map(Aov::name))
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn definitions_are_consistent() {
        Arguments::command().debug_assert();
    }

    #[test]
    fn names_are_those_of_the_library() {
        for &backend in Backend::value_variants() {
            let name = backend.to_possible_value().expect("none is skipped");
            assert_eq!(name.get_name(), BackendChoice::from(backend).name());
        }
        for &estimator in EstimatorName::value_variants() {
            let name = estimator.to_possible_value().expect("none is skipped");
            assert_eq!(name.get_name(), Estimator::from(estimator).name());
        }
    }
}
