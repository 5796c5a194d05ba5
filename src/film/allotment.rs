//! How the samples of a picture are spread over its pixels. Where the squared error of a pixel is v n^−p for n samples, the
//! sum over the picture is least with n in proportion to v^(1/(p+1)) \[Neyman34\]: p is 1 for independent samples and up
//! to 3 for nets, so the cube root is taken. What v is, a pilot tells, a film of other samples. So what a pixel takes is
//! independent of its own samples, and its mean is that of an even picture of so many samples, to the bit: nothing is biased.
//!
//! Pixels take powers of two times the samples of the film, so that its tree, nets and passes are those of an even picture.
//!
//! References: \[Neyman34\] J. Neyman: On the two different aspects of the representative method, Journal of the Royal
//! Statistical Society 97 (1934).

use std::sync::Arc;

use super::{Film, rows_around};
use crate::layout::BLOCK_LEVEL;

/// What a pixel takes at least, as a share of the mean.
const LEAST: u64 = 4;
/// Samples of the pilot as a share of those of the picture, and how many it takes at least and at most.
const PILOT: u64 = 16;
const PILOT_LEAST: u64 = 1 << BLOCK_LEVEL;
const PILOT_MOST: u64 = 4 << BLOCK_LEVEL;
/// Pixels to each side whose variance is averaged: that of few samples is uncertain.
const REACH: usize = 1;
/// Parts of variance to one of relative variance: little of the one is lost, and most of the other is gained.
const PLAIN: f64 = 3.0;
/// What relative variance counts as black, as a share of the mean square: as in the relative squared error of `bench`.
const DARK: f64 = 0.01;
/// Bisections of the scale of the weights: to one part in 10¹⁰.
const BISECTIONS: u32 = 40;

/// Where the film counts one sample, a pixel takes two to the power of its exponent.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Allotment {
    /// For each pixel; empty: 0 for all.
    exponents: Arc<[u8]>,
    most: u32,
    /// Samples of all pixels where the film counts one; 0 without exponents.
    taken: u64,
    /// Samples of the pilot that it was made by.
    pilot: u64,
}

/// How many samples a picture with an allotment takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Budget {
    /// Of the pilot.
    pub pilot: u64,
    /// Of a pixel with the fewest.
    pub least: u64,
}

impl Budget {
    /// Of a picture of so many samples a pixel on average; `None` where these are too few to be spread.
    pub fn of(samples: u64) -> Option<Self> {
        let block = 1 << BLOCK_LEVEL;
        (samples >= LEAST * block).then(|| Self {
            pilot: (samples / PILOT / block * block).clamp(PILOT_LEAST, PILOT_MOST),
            least: samples / LEAST,
        })
    }
}

impl Allotment {
    /// The largest exponent: four times the mean at most, and few enough for an invocation to sum.
    pub const MOST: u8 = 4;

    /// For a picture of `samples` a pixel on average, or a little less, as the pilot says. Of less than two samples, or without any
    /// noise, it says nothing, and all pixels take as many.
    pub fn of(pilot: &Film, samples: u64, budget: Budget) -> Self {
        let weights = weights(pilot);
        let most = samples as f64 / budget.least as f64 * weights.len() as f64;
        let exponents = |scale: f64| weights.iter().map(move |weight| exponent(weight * scale));
        let taken = |scale: f64| exponents(scale).map(|e| f64::from(1 << e)).sum::<f64>();
        let largest = weights.iter().copied().fold(0.0, f64::max);
        // log₂ of the scale: at the lower end all are 0
        let (mut low, mut high) = (-largest.log2(), 64.0 - largest.log2());
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            if taken(middle.exp2()) <= most {
                low = middle;
            } else {
                high = middle;
            }
        }
        // Pixels with the same weight: some take the last step, one here and one there, as far as it goes.
        let (low, high) = (low.exp2(), high.exp2());
        let mut left = most - taken(low);
        let share = left / (taken(high) - taken(low)).max(1.0);
        let mut due = 0.0;
        let step = |(e, larger): (u8, u8)| {
            let more = f64::from((1 << larger) - (1 << e));
            due += if more > 0.0 { share } else { 0.0 };
            if due < 1.0 || left < more {
                return e;
            }
            due -= 1.0;
            left -= more;
            larger
        };
        let exponents = exponents(low).zip(exponents(high)).map(step);
        Self::from_exponents(exponents.collect()).with_pilot(pilot.samples())
    }

    /// For each pixel of the window, row by row, how many samples it takes of each of the film: log₂, at most [`Self::MOST`]. Empty: one each.
    pub fn from_exponents(exponents: Vec<u8>) -> Self {
        let most = exponents.iter().max().map_or(0, |&most| u32::from(most));
        Self {
            taken: exponents.iter().map(|&e| 1 << e).sum(),
            exponents: exponents.into(),
            most,
            pilot: 0,
        }
    }

    /// The same, made by a pilot of so many samples.
    #[must_use]
    pub fn with_pilot(mut self, samples: u64) -> Self {
        self.pilot = samples;
        self
    }

    /// For each pixel, or for none where all are 0.
    pub fn exponents(&self) -> &[u8] {
        &self.exponents
    }

    /// Of a pixel.
    pub fn exponent(&self, pixel: usize) -> u32 {
        self.exponents.get(pixel).map_or(0, |&e| u32::from(e))
    }

    /// The largest exponent.
    pub fn most(&self) -> u32 {
        self.most
    }

    /// Samples that so many pixels take together where the film counts one.
    pub fn taken(&self, pixels: usize) -> u64 {
        match self.exponents.is_empty() {
            true => pixels as u64,
            false => self.taken,
        }
    }

    /// Samples that the film counts where pixels are to take so many on average: as in [`Budget::of`].
    pub fn least(&self, samples: u64) -> u64 {
        match self.exponents.is_empty() {
            true => samples,
            false => samples / LEAST,
        }
    }

    /// Samples of the pilot that it was made by; 0 where there was none.
    pub fn pilot(&self) -> u64 {
        self.pilot
    }
}

/// log₂ of a weight, rounded down, between 0 and [`Allotment::MOST`].
fn exponent(weight: f64) -> u8 {
    (0..Allotment::MOST)
        .take_while(|&e| weight >= f64::from(2u32 << e))
        .count() as u8
}

/// What pixels should take, but for a factor: the cube root of variance and relative variance, each as a share of its sum over the
/// picture, three parts to one.
fn weights(pilot: &Film) -> Vec<f64> {
    let (means, variances) = around(pilot);
    let pixels = means.len() as f64;
    let squares = means.iter().flatten().map(|m| m * m).sum::<f64>() / (3.0 * pixels);
    let relative = |pixel: usize| {
        let channels = means[pixel].iter().zip(variances[pixel]);
        channels
            .map(|(mean, variance)| variance / (mean * mean + DARK * squares))
            .sum::<f64>()
    };
    let pairs: Vec<(f64, f64)> = (0..means.len())
        .map(|pixel| (variances[pixel].iter().sum(), relative(pixel)))
        .collect();
    let total = pairs.iter().fold((0.0, 0.0), |t, p| (t.0 + p.0, t.1 + p.1));
    if total.0 == 0.0 || !total.0.is_finite() {
        // nothing is known
        return vec![1.0; pairs.len()];
    }
    let weight =
        |(plain, relative): (f64, f64)| (PLAIN * plain / total.0 + relative / total.1).cbrt();
    pairs.into_iter().map(weight).collect()
}

/// Means over pixels and those around them of the mean and of its squared error.
fn around(pilot: &Film) -> (Vec<[f64; 3]>, Vec<[f64; 3]>) {
    let moments: Vec<_> = pilot.moments().collect();
    let window = pilot.window();
    let width = (window.x1 - window.x0) as usize;
    let near = |pixel| {
        let (mut means, mut variances, mut count) = ([0.0; 3], [0.0; 3], 0.0);
        for row in rows_around(pixel, width, moments.len(), REACH) {
            for (mean, error) in &moments[row] {
                count += 1.0;
                for channel in 0..3 {
                    means[channel] += mean[channel];
                    variances[channel] += error[channel] * error[channel];
                }
            }
        }
        (means.map(|m| m / count), variances.map(|v| v / count))
    };
    (0..moments.len()).map(near).unzip()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::FILM_FLOATS;
    use crate::settings::Crop;

    /// A pilot of two samples of 8 × 8 pixels with a mean of 1, which differ by `spread` of the column.
    fn pilot(spread: impl Fn(usize) -> f32) -> Film {
        let window = Crop {
            x0: 0,
            y0: 0,
            x1: 8,
            y1: 8,
        };
        let mut film = Film::new(window, (8, 8), false);
        for (sample, sign) in [(0, -1.0), (1, 1.0)] {
            let values = (0..64).flat_map(|pixel| {
                let mut values = [0.0; FILM_FLOATS as usize];
                values[..3].fill(1.0 + sign * spread(pixel % 8));
                values
            });
            film.add(sample, 0, values.collect()).expect("two samples");
        }
        film
    }

    #[test]
    fn pixels_take_samples_by_the_cube_root_of_their_variance() {
        // Away from the border of the halves: deviations of 1 and 1/8, variances 64 to 1, cube roots 4 to 1.
        let budget = Budget::of(256).expect("enough");
        let spread = |column: usize| if column < 4 { 0.5 } else { 0.0625 };
        let allotment = Allotment::of(&pilot(spread), 256, budget);
        let column = |column| {
            (0..8usize)
                .map(|y| 1u64 << allotment.exponent(8 * y + column))
                .sum::<u64>()
        };
        let ratio = column(1) as f64 / column(6) as f64;
        assert!((3.5..4.5).contains(&ratio), "{ratio}");
        let mean = allotment.taken(64) as f64 / 64.0;
        assert!((3.9..=4.0).contains(&mean), "{mean}");
    }

    #[test]
    fn no_more_is_taken_than_there_is() {
        for samples in [64, 65, 100, 127, 128, 256, 1000, 1 << 40] {
            let budget = Budget::of(samples).expect("enough");
            let noise = |column: usize| (1.0 + column as f32).powi(-3);
            let allotment = Allotment::of(&pilot(noise), samples, budget);
            let all = budget.least * allotment.taken(64);
            assert!(all <= samples * 64, "{all} of {samples}");
            assert!(
                all as f64 > samples as f64 * 64.0 * 0.95,
                "{all} of {samples}"
            );
        }
        assert_eq!(Budget::of(63), None);
    }

    #[test]
    fn pictures_without_noise_are_even() {
        let budget = Budget::of(64).expect("enough");
        let one = Film::new(pilot(|_| 0.0).window(), (8, 8), false);
        assert_eq!(Allotment::of(&one, 64, budget).exponents(), [2; 64]);
        for noise in [0.0, 0.5, 1e30] {
            let allotment = Allotment::of(&pilot(|_| noise), 64, budget);
            assert_eq!(allotment.exponents(), [2; 64], "{noise}");
        }
    }
}
