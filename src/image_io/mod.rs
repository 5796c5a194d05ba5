//! Images as files: OpenEXR with everything that is known about the render, PNG
//! for the eye. All files appear under their name only when they are complete.

mod atomic;
mod exr;
mod lock;
mod nodes;
mod png;
mod tone;

use std::collections::BTreeMap;
use std::path::Path;

pub use atomic::{probe_writable, write_bytes, write_with};
pub use exr::{read_exr, write_exr};
pub use lock::{Lock, lock};
pub use png::write_png;
pub use tone::Tone;

use crate::error::{Error, Result};
use crate::film::Film;
use crate::settings::Crop;

/// A value in a file's header.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// Text, also for integers that may exceed 2^53.
    Text(String),
    /// A number, stored as a double.
    Number(f64),
}

impl From<String> for Value {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}

impl From<&str> for Value {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

impl From<f64> for Value {
    fn from(number: f64) -> Self {
        Self::Number(number)
    }
}

/// What a file says about its image; names without the prefix `etendue:`.
pub type Metadata = BTreeMap<String, Value>;

/// One channel: name as in the EXR (`R`, `albedo.R`, `depth.Z`) and one value for
/// each pixel of the window, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Name, with the layer before the dot.
    pub name: String,
    /// Pixels of the window.
    pub values: Vec<f32>,
}

/// An image with named channels, possibly a part of a larger frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// The pixels that are there (EXR: data window).
    pub window: Crop,
    /// Width and height of the full frame (EXR: display window, from the origin).
    pub full: (u32, u32),
    /// At least one, with different names.
    pub channels: Vec<Channel>,
    /// What the header says.
    pub metadata: Metadata,
}

/// An image that a film can give besides the radiance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Aov {
    /// `albedo.R/G/B`: reflectance of the first hit.
    Albedo,
    /// `normal.X/Y/Z`: shading normal of the first hit, world space.
    Normal,
    /// `depth.Z`: distance of the first hit from the camera, metres; +∞ where nothing was hit.
    Depth,
    /// `coverage`: fraction of samples that hit something.
    Coverage,
    /// `stderr.R/G/B`: standard error of the radiance; +∞ where unknown (one sample).
    StandardError,
    /// `interval.R/G/B`: half the width of the 95 % interval around the radiance ([`Film::interval`]).
    Interval,
    /// `samples`: number of samples.
    Samples,
    /// `dropped`: how many of them were not finite and count as black.
    Dropped,
    /// `instance`: number of the placed primitive that covers the middle of the pixel; −1 where nothing does.
    Instance,
    /// `material`: number of its material in the file; −1 where nothing is.
    Material,
}

impl Aov {
    /// Every AOV.
    pub const ALL: [Self; 10] = [
        Self::Albedo,
        Self::Normal,
        Self::Depth,
        Self::Coverage,
        Self::StandardError,
        Self::Interval,
        Self::Samples,
        Self::Dropped,
        Self::Instance,
        Self::Material,
    ];

    /// The name on the command line and of the layer.
    pub fn name(self) -> &'static str {
        match self {
            Self::Albedo => "albedo",
            Self::Normal => "normal",
            Self::Depth => "depth",
            Self::Coverage => "coverage",
            Self::StandardError => "stderr",
            Self::Interval => "interval",
            Self::Samples => "samples",
            Self::Dropped => "dropped",
            Self::Instance => "instance",
            Self::Material => "material",
        }
    }

    /// Whether the film must hold the sums that only AOVs need ([`crate::settings::Settings::aovs`]): of the first hit, and of dropped samples.
    pub fn needs_first_hit(self) -> bool {
        !matches!(self, Self::StandardError | Self::Interval | Self::Samples) && !self.is_identity()
    }

    /// Whether the film knows nothing of it: a number, which no mean can give ([`Image::push_layer`]).
    pub fn is_identity(self) -> bool {
        matches!(self, Self::Instance | Self::Material)
    }
}

impl Image {
    /// The mean of a film and the layers asked for that it has; [`Self::BLOCK`] and [`Self::PARTS`] are added to the header.
    ///
    /// # Errors
    /// [`Error::Settings`] when a layer needs sums of the first hit that the film does not have.
    pub fn from_film(film: &Film, aovs: &[Aov], mut metadata: Metadata) -> Result<Self> {
        let block = (1_u64 << film.block_level()) as f64;
        metadata.insert(Self::BLOCK.to_owned(), block.into());
        metadata.insert(Self::PARTS.to_owned(), film.parts().into());
        let mut channels = Vec::new();
        push_vectors(
            &mut channels,
            ["R", "G", "B"].map(String::from),
            film.mean(),
        );
        for &aov in aovs.iter().filter(|aov| !aov.is_identity()) {
            push_aov(&mut channels, film, aov).ok_or_else(|| Error::Settings {
                name: "--aov",
                what: format!("{} was not rendered", aov.name()),
            })?;
        }
        Ok(Self {
            window: film.window(),
            full: film.full_size(),
            channels,
            metadata,
        })
    }

    /// Adds a layer of one value for each pixel that the film does not know.
    pub fn push_layer(&mut self, aov: Aov, values: Vec<f32>) {
        let name = aov.name().to_owned();
        self.channels.push(Channel { name, values });
    }

    /// Columns and rows of the window.
    pub fn size(&self) -> (usize, usize) {
        let Crop { x0, y0, x1, y1 } = self.window;
        ((x1 - x0) as usize, (y1 - y0) as usize)
    }

    /// The values of a channel; `None` when there is none of that name.
    pub fn channel(&self, name: &str) -> Option<&[f32]> {
        let channel = self.channels.iter().find(|c| c.name == name)?;
        Some(&channel.values)
    }

    /// The pixels of the channels R, G and B; `None` when one is missing.
    pub fn rgb(&self) -> Option<Vec<[f32; 3]>> {
        let [r, g, b] = ["R", "G", "B"].map(|name| self.channel(name));
        let (r, g, b) = (r?, g?, b?);
        Some((0..r.len()).map(|i| [r[i], g[i], b[i]]).collect())
    }
}

/// A format that images can be written in, by the suffix of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// `.exr`
    Exr,
    /// `.png`
    Png,
}

impl Format {
    /// The format of a file by its suffix, in any case.
    ///
    /// # Errors
    /// [`Error::Settings`] naming the suffixes that are supported.
    pub fn of(path: &Path) -> Result<Self> {
        let suffix = path.extension().unwrap_or_default().to_ascii_lowercase();
        match suffix.to_str() {
            Some("exr") => Ok(Self::Exr),
            Some("png") => Ok(Self::Png),
            _ => Err(Error::Settings {
                name: "--output",
                what: format!("{} does not end in .exr or .png", path.display()),
            }),
        }
    }
}

fn push_aov(channels: &mut Vec<Channel>, film: &Film, aov: Aov) -> Option<()> {
    let names = |parts: [&str; 3]| parts.map(|part| format!("{}.{part}", aov.name()));
    let (rgb, xyz) = (["R", "G", "B"], ["X", "Y", "Z"]);
    let mut single = |name: &str, values| {
        let name = name.to_owned();
        channels.push(Channel { name, values });
    };
    match aov {
        Aov::Depth => single("depth.Z", film.depth()?),
        Aov::Coverage => single("coverage", film.coverage()?),
        Aov::Samples => single("samples", film.samples_taken()),
        Aov::Dropped => single("dropped", film.dropped()?),
        Aov::Albedo => push_vectors(channels, names(rgb), film.albedo()?),
        Aov::Normal => push_vectors(channels, names(xyz), film.normal()?),
        Aov::StandardError => push_vectors(channels, names(rgb), film.standard_error()),
        Aov::Interval => push_vectors(channels, names(rgb), film.interval(0.95)),
        Aov::Instance | Aov::Material => return None,
    }
    Some(())
}

fn push_vectors(channels: &mut Vec<Channel>, names: [String; 3], pixels: Vec<[f32; 3]>) {
    for (i, name) in names.into_iter().enumerate() {
        let values = pixels.iter().map(|p| p[i]).collect();
        channels.push(Channel { name, values });
    }
}
