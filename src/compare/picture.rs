//! Where two images differ, as an image.

use super::side::Side;
use crate::image_io::{Channel, Image, Metadata};

/// Deviations, or relative differences without standard errors, that reach the full colour.
const FULL_DEVIATIONS: f64 = 5.0;
const FULL_RELATIVE: f64 = 0.5;

/// A − B in R, G, B; with standard errors also the deviations, in the layers `deviation`.
pub fn difference(sides: &[Side; 2], like: &Image) -> Image {
    let [a, b] = sides;
    let mut channels = Vec::new();
    for (c, name) in ["R", "G", "B"].into_iter().enumerate() {
        let values = a.mean[c].iter().zip(&b.mean[c]);
        channels.push(Channel {
            name: name.to_owned(),
            values: values.map(|(a, b)| (a - b) as f32).collect(),
        });
        if sides.iter().any(|s| s.variance.is_some()) {
            let pixels = 0..a.mean[c].len();
            channels.push(Channel {
                name: format!("deviation.{name}"),
                values: pixels.map(|i| deviation(sides, i, c) as f32).collect(),
            });
        }
    }
    Image {
        window: like.window,
        full: like.full,
        channels,
        metadata: Metadata::new(),
    }
}

/// For the eye: red where A is brighter, blue where B is, in full colour at 5 standard errors (without standard errors:
/// half of B's value), towards white beyond. The channel that differs most counts.
pub fn signed_picture(sides: &[Side; 2], like: &Image) -> Image {
    let [a, b] = sides;
    let has_variance = sides.iter().any(|s| s.variance.is_some());
    let amount = |i: usize, c: usize| {
        let (x, y) = (a.mean[c][i], b.mean[c][i]);
        match has_variance {
            true => deviation(sides, i, c) / FULL_DEVIATIONS,
            false if x == y => 0.0,
            false => (x - y) / (FULL_RELATIVE * y.abs()),
        }
    };
    let colour = |i: usize| {
        let most = [0, 1, 2].map(|c| amount(i, c));
        let most = most.into_iter().max_by(|x, y| x.abs().total_cmp(&y.abs()));
        let most = most.unwrap_or_default();
        // Nothing is black; a whole unit is the pure colour, twice that white. What is not finite is white, too.
        let size = if most.is_nan() {
            2.0
        } else {
            most.abs().min(2.0)
        };
        let (strong, weak) = (size.min(1.0), (size - 1.0).max(0.0));
        match most > 0.0 {
            true => [strong, weak, weak],
            false => [weak, weak, strong],
        }
    };
    let pixels: Vec<[f64; 3]> = (0..a.mean[0].len()).map(colour).collect();
    let names = ["R", "G", "B"].into_iter().enumerate();
    let channels = names.map(|(c, name)| Channel {
        name: name.to_owned(),
        values: pixels.iter().map(|p| p[c] as f32).collect(),
    });
    Image {
        window: like.window,
        full: like.full,
        channels: channels.collect(),
        metadata: Metadata::new(),
    }
}

/// A − B in standard errors; NaN where one is not known.
fn deviation(sides: &[Side; 2], pixel: usize, channel: usize) -> f64 {
    let difference = sides[0].mean[channel][pixel] - sides[1].mean[channel][pixel];
    if difference == 0.0 {
        return 0.0;
    }
    let known = sides.iter().filter_map(|s| s.variance.as_ref());
    difference / known.map(|v| v[channel][pixel]).sum::<f64>().sqrt()
}
