//! What to render and how: everything that decides the bits of the picture
//! besides the scene itself.

use std::ops::Range;

use glam::DVec3;

use crate::error::{Error, Result};
use crate::layout::{BLOCK_LEVEL, SHARE_HEIGHT, SHARE_WIDTH};
use crate::mutant;

/// Which traversal answers "what does this ray meet?".
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BackendChoice {
    /// Ray query where the device likely has hardware for it, else our own tree.
    #[default]
    Auto,
    /// VK_KHR_ray_query in a compute shader.
    RayQuery,
    /// VK_KHR_ray_tracing_pipeline: the same kernel as a ray generation shader.
    RayPipeline,
    /// Our own bounding volume hierarchy in a compute shader.
    Bvh,
    /// The same through wgpu, whose naga translates the shader and adds its checks.
    #[cfg(feature = "wgpu")]
    Wgpu,
    /// The same through wgpu and naga without checks at run time.
    #[cfg(feature = "wgpu")]
    WgpuUnchecked,
    /// The same through wgpu, which hands the shader to the driver as it is.
    #[cfg(feature = "wgpu")]
    WgpuSpirv,
    /// The device's ray query through wgpu, which hands the shader to the driver as it is.
    #[cfg(feature = "wgpu")]
    WgpuRayQuery,
}

impl BackendChoice {
    /// The ways through wgpu, the most usual one first; none in builds without it.
    pub const WGPU: &[Self] = &[
        #[cfg(feature = "wgpu")]
        Self::Wgpu,
        #[cfg(feature = "wgpu")]
        Self::WgpuUnchecked,
        #[cfg(feature = "wgpu")]
        Self::WgpuSpirv,
        #[cfg(feature = "wgpu")]
        Self::WgpuRayQuery,
    ];

    /// The name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::RayQuery => "ray-query",
            Self::RayPipeline => "ray-pipeline",
            Self::Bvh => "bvh",
            #[cfg(feature = "wgpu")]
            Self::Wgpu => "wgpu",
            #[cfg(feature = "wgpu")]
            Self::WgpuUnchecked => "wgpu-unchecked",
            #[cfg(feature = "wgpu")]
            Self::WgpuSpirv => "wgpu-spirv",
            #[cfg(feature = "wgpu")]
            Self::WgpuRayQuery => "wgpu-ray-query",
        }
    }
}

/// The whole estimator or the yardstick it is measured against.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Estimator {
    /// Everything that lowers the error for the time.
    #[default]
    Full,
    /// BSDF sampling, next event estimation with uniform light choice, independent random numbers.
    Textbook,
}

impl Estimator {
    /// The name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Full => "full",
            Self::Textbook => "textbook",
        }
    }
}

/// How direct light is found. All three have the same expected value; tests compare them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Strategy {
    /// Light and BSDF sampling, combined by the power heuristic.
    #[default]
    Mis,
    /// Light sampling alone wherever it is possible.
    LightOnly,
    /// BSDF sampling alone wherever it is possible.
    BsdfOnly,
}

/// A light meter that takes the place of the camera: every pixel is one reading of the same thing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sensor {
    /// Light that falls on a point of a surface. A pixel is the irradiance over π.
    Irradiance {
        /// Where, metres.
        position: DVec3,
        /// Unit normal of the surface.
        normal: DVec3,
    },
    /// Light along a ray that arrives at a point. A pixel is the radiance.
    Radiance {
        /// Where it arrives, metres.
        position: DVec3,
        /// Where the meter looks, unit length.
        direction: DVec3,
    },
    /// Light that the whole scene sends into a direction. A pixel is the mean radiance over a square that holds the scene.
    Intensity {
        /// Where the light goes, unit length.
        direction: DVec3,
    },
    /// Light that the whole scene sends anywhere. A pixel is the mean radiance over directions and the disc of the scene's sphere.
    Flux,
}

impl Sensor {
    /// Whether it starts its rays in another way than a camera.
    pub(crate) fn needs_kernel(self) -> bool {
        matches!(self, Self::Irradiance { .. } | Self::Flux)
    }
}

/// A rectangle of pixels of the full frame; half open.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crop {
    /// First column.
    pub x0: u32,
    /// First row.
    pub y0: u32,
    /// Column after the last.
    pub x1: u32,
    /// Row after the last.
    pub y1: u32,
}

/// Everything a render depends on besides the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Full frame width, pixels.
    pub width: u32,
    /// Full frame height, pixels.
    pub height: u32,
    /// Part of the frame to render; `None` is all of it.
    pub crop: Option<Crop>,
    /// Global sample indices to render, half open.
    pub samples: Range<u64>,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Scattering events at most; 0 is unlimited.
    pub max_depth: u32,
    /// Traversal.
    pub backend: BackendChoice,
    /// Estimator.
    pub estimator: Estimator,
    /// How direct light is found.
    pub strategy: Strategy,
    /// Which camera of the scene; `None` is the first, or one that frames the scene.
    pub camera: Option<usize>,
    /// A light meter instead of the camera.
    pub sensor: Option<Sensor>,
    /// Also average albedo, normal, depth and coverage of the first hit, and count dropped samples for each pixel.
    pub aovs: bool,
    /// Pixels may take different numbers of samples ([`crate::film::Allotment`]); `samples` counts those of a pixel with the fewest.
    pub adaptive: bool,
    /// Pixels of a block share what their paths find, in scenes of opaque surfaces: less noise where light comes from other surfaces, the
    /// same in neighbours. The expected value is the same.
    pub share: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            width: 1280,
            height: 720,
            crop: None,
            samples: 0..128,
            seed: 0,
            max_depth: 0,
            backend: BackendChoice::Auto,
            estimator: Estimator::Full,
            strategy: Strategy::Mis,
            camera: None,
            sensor: None,
            aovs: false,
            adaptive: false,
            share: false,
        }
    }
}

/// Mixed into the seed of pilots.
const PILOT_SEED: u64 = 0x9e37_79b9_7f4a_7c15;

/// Largest width or height of a frame: what OpenEXR viewers and 32-bit pixel indices take.
pub const MAX_SIDE: u32 = 65_536;

impl Settings {
    /// The pixels to render: the crop, or the whole frame.
    pub fn window(&self) -> Crop {
        self.crop.unwrap_or(Crop {
            x0: 0,
            y0: 0,
            x1: self.width,
            y1: self.height,
        })
    }

    /// The settings of a pilot: its samples are independent of those of the picture.
    pub fn pilot(&self) -> Self {
        let other = match mutant::is("spread-itself") {
            true => 0,
            false => PILOT_SEED,
        };
        Self {
            seed: self.seed ^ other,
            ..self.clone()
        }
    }

    /// log₂ of the samples that a net takes in turn; 0 when all are independent.
    pub fn block_level(&self) -> u32 {
        match self.estimator {
            Estimator::Full => BLOCK_LEVEL,
            Estimator::Textbook => 0,
        }
    }

    /// Refuses what cannot be rendered, naming the option.
    pub fn validate(&self) -> Result<()> {
        let fail = |name, what: String| Err(Error::Settings { name, what });
        for (name, side) in [("--width", self.width), ("--height", self.height)] {
            if side == 0 || side > MAX_SIDE {
                return fail(name, format!("{side} is not in 1 … {MAX_SIDE}"));
            }
        }
        let Crop { x0, y0, x1, y1 } = self.window();
        if x0 >= x1 || y0 >= y1 || x1 > self.width || y1 > self.height {
            return fail(
                "--crop",
                format!(
                    "{x0},{y0},{x1},{y1} is empty or leaves the frame of {} × {} pixels",
                    self.width, self.height
                ),
            );
        }
        if self.share && (x0 % SHARE_WIDTH != 0 || y0 % SHARE_HEIGHT != 0) {
            let what = format!(
                "{x0},{y0},{x1},{y1} begins within a block of pixels that share: {SHARE_WIDTH} × {SHARE_HEIGHT} from the corner of the frame"
            );
            return fail("--crop", what);
        }
        if self.share && self.adaptive {
            let what = String::from("pixels that share take the same number of samples");
            return fail("--adaptive", what);
        }
        if self.samples.is_empty() {
            return fail(
                "--samples",
                format!(
                    "{}..{} holds no sample",
                    self.samples.start, self.samples.end
                ),
            );
        }
        Ok(())
    }
}
