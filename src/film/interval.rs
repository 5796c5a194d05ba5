//! Intervals that hold the truth as often as they say. A standard error from few parts is itself uncertain, and where
//! rare samples carry much of the light it is small in most pixels and large in a few. So the relative variance of
//! pixels around that look alike counts as one more degree of freedom, as the prior of \[Smyth04\]:
//!
//! s² = (ν s₀² + r m²) / (ν + 1), r the mean of s₀²/m² over the pixels alike,
//!
//! for a mean m with s₀², its squared standard error from the ν + 1 parts of the pixel alone. The interval is that of
//! Student's t with ν + 1 degrees of freedom. Pixels look alike whose surroundings are about as bright and as noisy.
//!
//! References: \[Smyth04\] G. K. Smyth: Linear models and empirical Bayes methods for assessing differential
//! expression in microarray experiments, Statistical Applications in Genetics and Molecular Biology 3 (2004).

use super::{Film, rows_around};
use crate::tails::student_quantile;

/// Pixels to each side that may be asked.
const REACH: usize = 4;
/// Pixels are alike whose brightness and relative error differ by no more than this part of the larger one.
const LIKENESS: f64 = 0.3;
/// Degrees of freedom that they count for.
const WEIGHT: f64 = 1.0;

impl Film {
    /// Half the width of the intervals around [`Film::mean`] that hold the expected value with this `confidence`, such
    /// as 0.95, cd/m² per channel. Near the borders of a window fewer pixels are asked. With fewer than two samples nothing is known, and it is +∞.
    ///
    /// # Panics
    /// `confidence` is not between 0 and 1.
    pub fn interval(&self, confidence: f64) -> Vec<[f32; 3]> {
        assert!(
            0.0 < confidence && confidence < 1.0,
            "a confidence of {confidence}"
        );
        // by exponent; none where nothing is known
        let students: Vec<Option<(f64, f64)>> = (0..=self.allotment.most())
            .map(|exponent| {
                let degrees = self.parts_of(exponent) - 1.0;
                let quantile = || student_quantile(1.0 - confidence, degrees + WEIGHT);
                (degrees >= 1.0).then(|| (degrees, quantile()))
            })
            .collect();
        let moments: Vec<_> = self.moments().collect();
        let width = (self.window.x1 - self.window.x0) as usize;
        let mut half = vec![[0.0; 3]; self.pixels()];
        for channel in 0..3 {
            let own: Vec<Moments> = moments
                .iter()
                .map(|(mean, error)| Moments {
                    mean: mean[channel],
                    variance: error[channel] * error[channel],
                })
                .collect();
            let neighbours = Neighbours::new(&own, width);
            for (pixel, half) in half.iter_mut().enumerate() {
                let Moments { mean, variance } = own[pixel];
                let student = students[self.allotment.exponent(pixel) as usize];
                let Some((degrees, quantile)) = student else {
                    half[channel] = f32::INFINITY;
                    continue;
                };
                let prior = neighbours.relative_variance(pixel) * mean * mean;
                let moderated = (degrees * variance + WEIGHT * prior) / (degrees + WEIGHT);
                half[channel] = (quantile * moderated.sqrt()) as f32;
            }
        }
        half
    }
}

/// Of a pixel in one channel.
#[derive(Clone, Copy)]
struct Moments {
    mean: f64,
    /// Of the mean.
    variance: f64,
}

/// What pixels can tell of each other.
struct Neighbours {
    width: usize,
    /// Variance over squared mean; 0 where all is black.
    relative: Vec<f64>,
    /// Medians of the means of 3 × 3 pixels: brightness that single bright pixels do not change.
    brightness: Vec<f64>,
    /// Medians of their relative errors.
    noise: Vec<f64>,
}

impl Neighbours {
    fn new(own: &[Moments], width: usize) -> Self {
        let relative = |m: &Moments| match m.mean {
            0.0 => 0.0,
            mean => m.variance / (mean * mean),
        };
        let relative: Vec<f64> = own.iter().map(relative).collect();
        let means: Vec<f64> = own.iter().map(|m| m.mean).collect();
        let errors: Vec<f64> = relative.iter().map(|r| r.sqrt()).collect();
        Self {
            width,
            relative,
            brightness: medians(&means, width),
            noise: medians(&errors, width),
        }
    }

    /// The mean over the pixels around that look alike, the pixel itself included.
    fn relative_variance(&self, pixel: usize) -> f64 {
        let (brightness, noise) = (self.brightness[pixel], self.noise[pixel]);
        let is_alike = |other: usize| {
            is_near(self.brightness[other], brightness)
                // Where most pixels show no noise, nothing is known of it.
                && (noise == 0.0 || is_near(self.noise[other], noise))
        };
        let (mut sum, mut count) = (0.0, 0.0);
        for row in rows_around(pixel, self.width, self.relative.len(), REACH) {
            for other in row.filter(|&other| is_alike(other)) {
                sum += self.relative[other];
                count += 1.0;
            }
        }
        sum / f64::max(count, 1.0)
    }
}

fn is_near(a: f64, b: f64) -> bool {
    (a - b).abs() <= LIKENESS * a.abs().max(b.abs())
}

fn medians(values: &[f64], width: usize) -> Vec<f64> {
    let mut near = Vec::with_capacity(9);
    let median = |pixel| {
        near.clear();
        for row in rows_around(pixel, width, values.len(), 1) {
            near.extend(&values[row]);
        }
        near.sort_unstable_by(f64::total_cmp);
        near[near.len() / 2]
    };
    (0..values.len()).map(median).collect()
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
    fn neighbours_that_look_alike_lend_their_relative_variance() {
        // Two samples: only the pixel in the middle of 11 × 11 differs from one to the other. Half of the picture is dark.
        let (middle, side) = (5 * 11 + 5, 11);
        let value = |sample: u64, pixel: usize| match pixel {
            _ if pixel == middle => 1.0 + sample as f32,
            _ if pixel % 11 > 7 => 0.5,
            _ => 2.0,
        };
        let half = film([side, side], 2, value).interval(0.95);
        let quantile = student_quantile(0.05, 2.0);
        // Its mean is 1.5 and its squared standard error 1/4. Of the 81 pixels around 63 are bright.
        let relative = |bright: f64| 0.25 / (1.5 * 1.5) / bright;
        let own = quantile * ((0.25 + relative(63.0) * 2.25) / 2.0).sqrt();
        assert!((f64::from(half[middle][1]) / own - 1.0).abs() < 1e-6);
        // Four to the left and four up, 6 × 6 pixels are near enough and in the picture.
        let corner = quantile * (relative(6.0 * 6.0) * 4.0 / 2.0).sqrt();
        let found = f64::from(half[11 + 1][1]);
        assert!((found / corner - 1.0).abs() < 1e-6, "{found} {corner}");
        // Nothing is known to vary beyond the reach, nor where it is dark.
        assert_eq!([half[0], half[middle + 3]], [[0.0; 3]; 2]);
    }

    #[test]
    fn what_is_noisy_does_not_widen_what_is_quiet() {
        // Two samples; all pixels are as bright, and those to the left ten times as noisy.
        let noise = |pixel: usize| if pixel % 12 < 6 { 0.5 } else { 0.05 };
        let value = |sample: u64, pixel: usize| 1.0 + noise(pixel) * (sample as f32 - 0.5);
        let half = film([12, 12], 2, value).interval(0.95);
        for (pixel, half) in half.iter().enumerate() {
            // half the difference of the samples
            let own = student_quantile(0.05, 2.0) * 0.5 * f64::from(noise(pixel));
            let found = f64::from(half[0]);
            assert!((found / own - 1.0).abs() < 1e-5, "{pixel}: {found} {own}");
        }
    }

    #[test]
    fn black_stays_black() {
        let half = film([3, 2], 4, |_, _| 0.0).interval(0.95);
        assert_eq!(half, vec![[0.0; 3]; 6]);
    }
}
