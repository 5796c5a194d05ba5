//! What can be typed after `bench` and `chart`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use etendue::film::MAX_SAMPLES;
use etendue::settings::{Estimator, Settings};

use super::super::args::{Backend, side};
use super::super::numbers::positive;

/// `etendue bench`
#[derive(Args)]
pub struct BenchArgs {
    /// Scenes: .gltf or .glb
    #[arg(required_unless_present = "growth")]
    pub scenes: Vec<PathBuf>,
    /// Where the lines go; references and pictures go into folders beside it
    #[arg(short, long, value_name = "FILE.jsonl")]
    pub output: PathBuf,

    /// Samples a pixel of the runs, in ascending order
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "1,2,4,8,16,32,64",
          value_parser = clap::value_parser!(u64).range(1..=1 << 20))]
    pub spp: Vec<u64>,
    /// Instead of --spp: powers of two, up to runs of so many seconds
    #[arg(long, value_name = "SECONDS", conflicts_with = "spp", allow_negative_numbers = true, value_parser = positive)]
    pub budget: Option<f64>,
    /// Runs with each number of samples, and rounds of rates and growth
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..=10_000))]
    pub seeds: u64,
    /// Samples a pixel of the reference [default: 128 times the most]
    #[arg(long, value_name = "SPP", value_parser = clap::value_parser!(u64).range(2..=MAX_SAMPLES))]
    pub reference: Option<u64>,
    /// Ways of our own that take part, separated by commas
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_enum, default_values_t = [WayName::Full, WayName::Textbook])]
    pub estimators: Vec<WayName>,
    /// Other renderers as well: the folder of their scripts, *_peer.py
    #[arg(long, value_name = "FOLDER", num_args = 0..=1, require_equals = true, default_missing_value = "benches/peers")]
    pub peers: Option<PathBuf>,
    /// Python that runs the scripts
    #[arg(long, value_name = "PROGRAM", default_value = "python3")]
    pub python: String,
    /// What grows, in generated scenes, separated by commas
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_enum)]
    pub growth: Vec<SweepName>,
    /// Largest number of triangles, lights and instances of --growth
    #[arg(long, value_name = "N", default_value_t = 1_000_000, value_parser = clap::value_parser!(u64).range(1_000..=20_000_000))]
    pub growth_to: u64,
    /// Also measure how traversal and shading share the time of our own tree, and its lanes and loads
    #[arg(long)]
    pub limits: bool,
    /// Also write pictures, which the chart's report shows
    #[arg(long)]
    pub pictures: bool,

    /// Width of the frame in pixels [default: 256, or from the height]
    #[arg(long, value_name = "N", value_parser = side())]
    pub width: Option<u32>,
    /// Height of the frame in pixels [default: from the width and the camera's aspect]
    #[arg(long, value_name = "N", value_parser = side())]
    pub height: Option<u32>,
    /// Scattering events at most; 0: unlimited
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub max_depth: u32,
    /// How rays are traced where backends are not compared
    #[arg(long, value_enum, default_value_t = Backend::Auto)]
    pub backend: Backend,
    /// Vulkan device, by index or a part of its name
    #[arg(long, value_name = "INDEX|NAME")]
    pub device: Option<String>,
    /// Show errors only
    #[arg(short, long)]
    pub quiet: bool,
}

/// `--estimators`
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum WayName {
    /// The full estimator
    Full,
    /// The yardstick
    Textbook,
    /// The full estimator, whose samples are spread over the pixels by a pilot, which counts
    Adaptive,
    /// The full estimator, whose pixels share what their paths find
    Shared,
}

impl WayName {
    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Full => "full",
            Self::Textbook => "textbook",
            Self::Adaptive => "adaptive",
            Self::Shared => "shared",
        }
    }

    pub fn estimator(self) -> Estimator {
        match self {
            Self::Full | Self::Adaptive | Self::Shared => Estimator::Full,
            Self::Textbook => Estimator::Textbook,
        }
    }

    /// Settings of renders this way.
    pub fn settings(self, settings: &Settings) -> Settings {
        Settings {
            estimator: self.estimator(),
            adaptive: self == Self::Adaptive,
            share: self == Self::Shared,
            ..settings.clone()
        }
    }
}

/// `--growth`
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum SweepName {
    /// A terrain of more and more triangles
    Triangles,
    /// More samples
    Spp,
    /// More lamps of the same power in all
    Lights,
    /// More pixels
    Resolution,
    /// More scattering events
    Depth,
    /// More copies of one mesh
    Instances,
}

/// `etendue chart`
#[derive(Args)]
pub struct ChartArgs {
    /// What `etendue bench` wrote
    pub bench: PathBuf,
    /// Picture, report or tables to write: .svg, .html or .md by its suffix
    #[arg(short, long, value_name = "FILE", required = true)]
    pub output: Vec<PathBuf>,
}
