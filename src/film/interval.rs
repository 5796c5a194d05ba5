//! Intervals that hold the truth as often as they say. A standard error from few parts is itself uncertain, and where
//! rare samples carry much of the light it is small in most pixels and large in a few. So the relative variance of
//! the pixels around counts as one more degree of freedom, as the prior of \[Smyth04\]:
//!
//! s² = (ν s₀² + r m²) / (ν + 1), r = Σ s₀² / Σ m² over the neighbourhood,
//!
//! for a mean m with s₀², its squared standard error from the ν + 1 parts of the pixel alone. The interval is that of
//! Student's t with ν + 1 degrees of freedom.
//!
//! References: \[Smyth04\] G. K. Smyth: Linear models and empirical Bayes methods for assessing differential
//! expression in microarray experiments, Statistical Applications in Genetics and Molecular Biology 3 (2004).

use super::Film;
use crate::tails::student_quantile;

/// Pixels to each side that belong to the neighbourhood.
const REACH: usize = 4;
/// Degrees of freedom that it counts for.
const WEIGHT: f64 = 1.0;

impl Film {
    /// Half the width of the intervals around [`Film::mean`] that hold the expected value with this `confidence`, such
    /// as 0.95, cd/m² per channel. Near the borders of a window the neighbourhood is smaller. With fewer than two samples nothing is known, and it is +∞.
    ///
    /// # Panics
    /// `confidence` is not between 0 and 1.
    pub fn interval(&self, confidence: f64) -> Vec<[f32; 3]> {
        assert!(
            0.0 < confidence && confidence < 1.0,
            "a confidence of {confidence}"
        );
        let degrees = self.parts() as f64 - 1.0;
        if degrees < 1.0 {
            return vec![[f32::INFINITY; 3]; self.pixels()];
        }
        let quantile = student_quantile(1.0 - confidence, degrees + WEIGHT);
        let moments: Vec<_> = (0..self.pixels())
            .map(|pixel| self.moments(pixel))
            .collect();
        let width = (self.window.x1 - self.window.x0) as usize;
        let mut half = vec![[0.0; 3]; self.pixels()];
        for channel in 0..3 {
            let squares = |(mean, error): &([f64; 3], [f64; 3])| {
                [
                    error[channel] * error[channel],
                    mean[channel] * mean[channel],
                ]
            };
            let own: Vec<[f64; 2]> = moments.iter().map(squares).collect();
            let around = sums_around(&own, width);
            for ((half, own), around) in half.iter_mut().zip(&own).zip(&around) {
                let prior = if around[1] > 0.0 {
                    around[0] / around[1] * own[1]
                } else {
                    own[0]
                };
                let variance = (degrees * own[0] + WEIGHT * prior) / (degrees + WEIGHT);
                half[channel] = (quantile * variance.sqrt()) as f32;
            }
        }
        half
    }
}

/// Sums over the neighbourhood of each pixel, the pixel itself included.
fn sums_around(values: &[[f64; 2]], width: usize) -> Vec<[f64; 2]> {
    let height = values.len() / width;
    let rows = sums_along(values, width, height, 1, width);
    sums_along(&rows, height, width, width, 1)
}

/// Sums over neighbours in one direction: of `count` in a line with this `step`, for so many lines with this `line` between them.
fn sums_along(
    values: &[[f64; 2]],
    count: usize,
    lines: usize,
    step: usize,
    line: usize,
) -> Vec<[f64; 2]> {
    let mut sums = vec![[0.0; 2]; values.len()];
    for start in (0..lines).map(|l| l * line) {
        for i in 0..count {
            // Added anew for each, so that nothing of a bright pixel is left in sums that it is no part of.
            let near = i.saturating_sub(REACH)..(i + REACH + 1).min(count);
            let sum = &mut sums[start + i * step];
            for value in near.map(|n| values[start + n * step]) {
                sum[0] += value[0];
                sum[1] += value[1];
            }
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::FILM_FLOATS;
    use crate::settings::Crop;

    /// A film of `samples` samples of each pixel, which `radiance` gives.
    fn film(size: [u32; 2], samples: u64, radiance: impl Fn(u64, usize) -> f32) -> Film {
        let [x1, y1] = size;
        let mut film = Film::new(
            Crop {
                x0: 0,
                y0: 0,
                x1,
                y1,
            },
            (x1, y1),
            false,
        );
        for sample in 0..samples {
            let mut values = vec![0.0; film.pixels() * FILM_FLOATS as usize];
            for (pixel, values) in values.chunks_exact_mut(FILM_FLOATS as usize).enumerate() {
                values[..3].fill(radiance(sample, pixel));
            }
            film.add(sample, 0, values).unwrap();
        }
        film
    }

    #[test]
    fn one_pixel_has_the_interval_of_one_degree_more() {
        // 1, 2, 3, 4: mean 2.5, variance 5/3, squared standard error 5/12
        let one = film([1, 1], 4, |sample, _| 1.0 + sample as f32);
        // quantile of four degrees of freedom in tables: 2.776
        let expected = 2.776 * (5.0f64 / 12.0).sqrt();
        let half = one.interval(0.95)[0].map(f64::from);
        assert!(
            half.iter().all(|h| (h / expected - 1.0).abs() < 1e-3),
            "{half:?}"
        );
        assert!(one.interval(0.5)[0][0] < one.interval(0.95)[0][0]);
        assert_eq!(
            film([1, 1], 1, |_, _| 1.0).interval(0.95),
            [[f32::INFINITY; 3]]
        );
    }

    #[test]
    fn neighbours_lend_their_relative_variance() {
        // Two samples: only the pixel in the middle of 11 × 11 differs from one to the other.
        let (middle, side) = (5 * 11 + 5, 11);
        let value = |sample: u64, pixel: usize| match pixel == middle {
            true => 1.0 + sample as f32,
            false => 2.0,
        };
        let half = film([side, side], 2, value).interval(0.95);
        let quantile = student_quantile(0.05, 2.0);
        // Its mean is 1.5 and its squared standard error 1/4; 81 pixels are around it.
        let relative = |neighbours: f64| 0.25 / (1.5 * 1.5 + 4.0 * (neighbours - 1.0));
        let own = quantile * ((0.25 + relative(81.0) * 2.25) / 2.0).sqrt();
        assert!((f64::from(half[middle][1]) / own - 1.0).abs() < 1e-6);
        // A pixel four to the left and four up has nine less in each direction that leaves the picture.
        let corner = quantile * (relative(6.0 * 6.0) * 4.0 / 2.0).sqrt();
        let found = f64::from(half[11 + 1][1]);
        assert!((found / corner - 1.0).abs() < 1e-6, "{found} {corner}");
        // and beyond the reach nothing is known to vary
        assert_eq!(half[0], [0.0; 3]);
    }

    #[test]
    fn black_stays_black() {
        let half = film([3, 2], 4, |_, _| 0.0).interval(0.95);
        assert_eq!(half, vec![[0.0; 3]; 6]);
    }
}
