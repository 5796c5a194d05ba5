//! What a file says about its image: means, squared standard errors, sample counts.

use std::ops::Range;

use crate::error::{Error, Result};
use crate::image_io::{Image, Value};

/// Relative rounding of 16-bit floats, to nearest.
const HALF: f64 = 1.0 / 2048.0;
/// What devices and traversals may differ by without meaning anything: single precision after some operations.
const SINGLE: f64 = 5e-6;
/// So many different values, all of which fit 16-bit floats, are not there by chance.
const CERTAINLY_HALF: usize = 16;

/// Where standard errors come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// Layers `stderr`.
    StandardError,
    /// Layers `variance`: of samples, over their number.
    Variance,
    /// Second moments of samples, layers `m2_…`.
    SecondMoment,
}

impl Source {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::StandardError => "stderr layers",
            Self::Variance => "variance layers",
            Self::SecondMoment => "second moments",
        }
    }
}

/// One image as the tests see it; values by channel, then by pixel.
pub struct Side {
    /// Mean radiance.
    pub mean: [Vec<f64>; 3],
    /// Squared standard error of the mean; NaN where it is not known.
    pub variance: Option<[Vec<f64>; 3]>,
    /// Where it comes from.
    pub source: Option<Source>,
    /// Samples of each pixel.
    pub count: Option<Vec<f64>>,
    /// Independent parts that the variance was estimated from, where the file tells; else samples are.
    pub parts: Option<f64>,
    /// Columns and rows of the blocks of pixels whose errors go together.
    pub shared: [usize; 2],
    /// Relative size of differences that are rounding.
    pub rounding: f64,
    /// What the user should know.
    pub notes: Vec<String>,
}

impl Side {
    /// Reads an image. `spp` stands in for a number of samples that the file does not tell.
    ///
    /// # Errors
    /// [`Error::Settings`] when there are no colours.
    pub fn of(image: &Image, spp: Option<f64>) -> Result<Self> {
        let wide = |values: &[f32]| values.iter().map(|&v| f64::from(v)).collect::<Vec<f64>>();
        let Some(mean) = colours(image) else {
            let names: Vec<_> = image.channels.iter().map(|c| c.name.as_str()).collect();
            return Err(Error::Settings {
                name: "image",
                what: format!("has no channels R, G, B; it has {}", names.join(", ")),
            });
        };
        let rounding = if is_half(&mean) { HALF } else { SINGLE };
        let mean = mean.map(wide);
        let count = count(image, mean[0].len(), spp);
        let mut side = Self {
            variance: None,
            source: None,
            rounding,
            notes: Vec::new(),
            mean,
            count,
            parts: image.parts(),
            shared: image.shared(),
        };
        side.find_variance(image);
        Ok(side)
    }

    fn find_variance(&mut self, image: &Image) {
        let layer = |is: &dyn Fn(&str) -> bool| -> Option<[Vec<f64>; 3]> {
            let find = |part: &str| {
                let fits = |name: &str| name.strip_suffix(part).is_some_and(is);
                let channel = image.channels.iter().find(|c| fits(&c.name))?;
                Some(channel.values.iter().map(|&v| f64::from(v)).collect())
            };
            Some([find(".R")?, find(".G")?, find(".B")?])
        };
        let known = |v: f64| {
            if v >= 0.0 && v.is_finite() {
                v
            } else {
                f64::NAN
            }
        };
        if let Some(errors) = layer(&|name| name == "stderr") {
            // Of a single sample the error is infinite.
            let square = |e: f64| if e >= 0.0 { known(e * e) } else { f64::NAN };
            self.variance = Some(errors.map(|c| c.into_iter().map(square).collect()));
            self.source = Some(Source::StandardError);
            return;
        }
        let variances = layer(&|name| name.eq_ignore_ascii_case("variance"));
        let moments = layer(&|name| name.starts_with("m2_"));
        let (values, source) = match (variances, moments) {
            (Some(values), _) => (values, Source::Variance),
            (None, Some(values)) => (values, Source::SecondMoment),
            (None, None) => return,
        };
        let Some(count) = &self.count else {
            let what = source.name();
            self.notes.push(format!(
                "has {what} but does not tell how many samples a pixel has; --spp does"
            ));
            return;
        };
        let mut variance = values;
        for (variance, mean) in variance.iter_mut().zip(&self.mean) {
            for ((v, m), &n) in variance.iter_mut().zip(mean).zip(count) {
                // One sample tells nothing about its error.
                *v = match source {
                    _ if n < 2.0 => f64::NAN,
                    Source::SecondMoment => known((*v - m * m).max(0.0) / (n - 1.0)),
                    _ => known(*v / n),
                };
            }
        }
        self.variance = Some(variance);
        self.source = Some(source);
    }

    /// Independent parts that the variance of a pixel was estimated from.
    pub fn parts(&self, pixel: usize) -> Option<f64> {
        let count = self.count.as_ref()?[pixel];
        Some(self.parts.unwrap_or(count))
    }

    /// Whether a pixel is finite in all channels.
    pub fn is_finite(&self, pixel: usize) -> bool {
        self.mean.iter().all(|c| c[pixel].is_finite())
    }

    /// Whether the standard errors of a pixel are known.
    pub fn is_known(&self, pixel: usize) -> bool {
        let known = |v: &[Vec<f64>; 3]| v.iter().all(|c| !c[pixel].is_nan());
        self.variance.as_ref().is_none_or(known)
    }
}

/// R, G and B; of Blender's layers the combined one; or luminance alone.
fn colours(image: &Image) -> Option<[&[f32]; 3]> {
    let rgb = |prefix: &str| {
        let [r, g, b] = ["R", "G", "B"].map(|c| image.channel(&format!("{prefix}{c}")));
        Some([r?, g?, b?])
    };
    let combined = || {
        let name = |c: &crate::image_io::Channel| c.name.strip_suffix("Combined.R").map(str::len);
        let at = image.channels.iter().find_map(|c| Some((c, name(c)?)));
        at.and_then(|(c, length)| rgb(&format!("{}Combined.", &c.name[..length])))
    };
    rgb("")
        .or_else(combined)
        .or_else(|| image.channel("Y").map(|y| [y; 3]))
}

/// Samples of each pixel: the layer, the header, or what the user says.
fn count(image: &Image, pixels: usize, spp: Option<f64>) -> Option<Vec<f64>> {
    if let Some(layer) = image.channel("samples") {
        return Some(layer.iter().map(|&n| f64::from(n).max(1.0)).collect());
    }
    let header = match image.metadata.get("spp") {
        Some(Value::Number(n)) if *n >= 1.0 => Some(*n),
        _ => None,
    };
    header.or(spp).map(|n| vec![n; pixels])
}

/// Whether the values were 16-bit floats once.
fn is_half(mean: &[&[f32]; 3]) -> bool {
    let fits = |v: &f32| !v.is_finite() || v.to_bits() & 0x1fff == 0;
    if !mean.iter().all(|c| c.iter().all(fits)) {
        return false;
    }
    let mut bits: Vec<u32> = mean
        .iter()
        .flat_map(|c| c.iter().map(|v| v.to_bits()))
        .collect();
    bits.sort_unstable();
    bits.dedup();
    bits.len() >= CERTAINLY_HALF
}

/// Says so when two renders of the same scene share random numbers.
pub fn shared_samples(a: &Image, b: &Image) -> Option<String> {
    let text = |image: &Image, name: &str| match image.metadata.get(name) {
        Some(Value::Text(text)) => Some(text.clone()),
        _ => None,
    };
    for name in ["settings.seed", "scene_hash"] {
        if text(a, name)? != text(b, name)? {
            return None;
        }
    }
    // Samples of one net are not independent, even if none is in both.
    let nets = |image: &Image| -> Option<Vec<Range<u64>>> {
        let list = text(image, "samples")?;
        let nets = |r: &str| {
            let (start, end) = r.split_once("..")?;
            Some(image.nets_around(start.parse().ok()?..end.parse().ok()?))
        };
        list.split(',').map(nets).collect()
    };
    let (ours, theirs) = (nets(a)?, nets(b)?);
    let overlaps = |o: &Range<u64>| theirs.iter().any(|t| o.start < t.end && t.start < o.end);
    let seed = text(a, "settings.seed")?;
    ours.iter().any(overlaps).then(|| {
        format!(
            "both images have samples of seed {seed} in common, or parts of the same nets: they are not independent and agree \
             better or worse than chance alone would let them; render one of them with another --seed"
        )
    })
}
