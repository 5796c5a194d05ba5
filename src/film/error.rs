//! Standard errors. Independent samples tell theirs by how they differ. Of nets only whole ones are independent: how these
//! differ is right on average, however long they are, but has one degree of freedom for two nets, three for four.
//! How blocks of sixteen samples differ has many, and is rather too large, since nets err less than
//! their blocks would if these were independent. So with a squared error s₁² of d degrees by nets and s₂² by blocks
//!
//! s² = (3 d s₁² + ¾ s₂²) / (3 d + 1), taken for an estimate of d + 2 degrees.
//!
//! The three numbers were set by how often intervals of six scenes hold the truth (docs/decisions.md, *What nets say of their error*).
//!
//! References: \[Satterthwaite46\] F. E. Satterthwaite: An approximate distribution of estimates of variance
//! components, Biometrics Bulletin 2 (1946).

use super::{BETWEEN, DEVIATIONS, Film, RADIANCE, pair_level};

/// Weight of a degree of freedom of nets, beside all blocks.
const NETS: f64 = 3.0;
/// Squared error of nets over that of independent blocks.
const GAIN: f64 = 0.75;
/// Degrees of freedom that blocks add to those of nets.
const DEGREES: f64 = 2.0;

impl Film {
    /// Estimated standard error of [`Film::mean`], cd/m² per channel.
    ///
    /// Of independent samples: √(M₂ / (N (N − 1))), where M₂ is the sum of their squared deviations. Of nets: as above.
    /// Below two whole blocks their samples are taken as independent, so the error is
    /// rather overstated. With fewer than two samples nothing is known, and it is +∞.
    pub fn standard_error(&self) -> Vec<[f32; 3]> {
        self.moments()
            .map(|(_, error)| error.map(|e| e as f32))
            .collect()
    }

    /// Estimated relative error of the image: the root mean square of the standard
    /// error over that of the mean, over all pixels and channels of the window.
    /// 0 for an image without noise (a black one, too), +∞ below two samples.
    pub fn relative_error(&self) -> f64 {
        let (mut signal, mut noise) = (0.0, 0.0);
        for (mean, error) in self.moments() {
            for channel in 0..3 {
                signal += mean[channel] * mean[channel];
                noise += error[channel] * error[channel];
            }
        }
        if noise == 0.0 {
            0.0
        } else if noise.is_infinite() {
            f64::INFINITY
        } else {
            (noise / signal).sqrt()
        }
    }

    /// Number of independent parts that have as many degrees of freedom as [`Film::standard_error`], which is one less, of a pixel with the
    /// fewest samples. Not a whole number where a pair of nets is not complete beside others.
    pub fn parts(&self) -> f64 {
        self.parts_of(0)
    }

    /// The same of a pixel with this exponent.
    pub(super) fn parts_of(&self, exponent: u32) -> f64 {
        let parts = self.independent(exponent);
        match parts.degrees {
            0.0 => parts.blocks,
            degrees => parts.blocks.min(degrees + DEGREES + 1.0),
        }
    }

    /// What of a pixel with this exponent is independent of what.
    fn independent(&self, exponent: u32) -> Parts {
        let whole_blocks = |level: u32| {
            level
                .checked_sub(self.block_level)
                .map_or(0_u64, |more| 1 << more)
        };
        let levels = || self.nodes.values().map(|node| node.level + exponent);
        let has_blocks = levels().map(whole_blocks).sum::<u64>() >= 2;
        let blocks = if has_blocks {
            levels().map(|level| whole_blocks(level).max(1)).sum()
        } else {
            self.samples() << exponent
        };
        let mut parts = Parts {
            has_blocks,
            blocks: blocks as f64,
            ..Parts::default()
        };
        if self.block_level == 0 {
            return parts;
        }
        let pair = pair_level(self.block_level);
        for level in levels().filter(|&level| level > self.block_level) {
            let samples = (1_u64 << level) as f64;
            if level >= pair {
                parts.whole += samples;
            } else {
                parts.rest += samples;
            }
        }
        parts.nets = 2.0 * parts.whole / (1_u64 << pair) as f64;
        let mut square = parts.rest * parts.rest;
        if parts.nets > 0.0 {
            square += parts.whole * parts.whole / (parts.nets - 1.0);
        }
        if square > 0.0 {
            parts.degrees = (parts.whole + parts.rest).powi(2) / square;
        }
        parts
    }

    /// Mean and standard error of the radiance of each pixel.
    pub(super) fn moments(&self) -> impl Iterator<Item = ([f64; 3], [f64; 3])> + '_ {
        let parts: Vec<Parts> = (0..=self.allotment.most())
            .map(|exponent| self.independent(exponent))
            .collect();
        (0..self.pixels()).map(move |pixel| {
            let parts = &parts[self.allotment.exponent(pixel) as usize];
            let [red, green, blue] = [0, 1, 2].map(|channel| self.moment(pixel, channel, parts));
            ([red.0, green.0, blue.0], [red.1, green.1, blue.1])
        })
    }

    /// Mean and standard error of one channel of a pixel's radiance.
    fn moment(&self, pixel: usize, channel: usize, parts: &Parts) -> (f64, f64) {
        let start = pixel * self.floats_per_pixel() + channel;
        let exponent = self.allotment.exponent(pixel);
        let (mut all, mut nets) = (Spread::default(), Spread::default());
        let mut difference = 0.0;
        for node in self.nodes.values() {
            let float = |part: usize| f64::from(node.values[start + part]);
            let level = node.level + exponent;
            let count = (1_u64 << level) as f64;
            // Deviations within a block say nothing about how blocks differ.
            let counts = !parts.has_blocks || level > self.block_level;
            let own = if counts { float(DEVIATIONS) } else { 0.0 };
            all.add(count, float(RADIANCE), own);
            if parts.degrees == 0.0 {
                continue;
            }
            if level >= pair_level(self.block_level) {
                nets.add(count, float(RADIANCE), float(BETWEEN));
            } else {
                difference += float(BETWEEN);
            }
        }
        if parts.blocks < 2.0 {
            return (all.mean, f64::INFINITY);
        }
        let mut square = all.m2 / (parts.blocks - 1.0) / all.count;
        if parts.degrees > 0.0 {
            // variance of a sample, as whole nets have it, times their samples
            let of_whole = match parts.whole {
                0.0 => 0.0,
                whole => nets.m2 / (parts.nets - 1.0) * whole,
            };
            let paired = parts.whole + parts.rest;
            let of_nets = (of_whole + difference * difference) / (paired * all.count);
            let weight = NETS * parts.degrees;
            square = (weight * of_nets + GAIN * square) / (weight + 1.0);
        }
        (all.mean, square.sqrt())
    }
}

/// What standard errors are taken from.
#[derive(Default)]
struct Parts {
    /// Whether there are two whole blocks to compare.
    has_blocks: bool,
    /// Number of whole blocks and of nodes that are smaller; of samples where there are not two whole blocks.
    blocks: f64,
    /// Samples in whole pairs of nets, and in pairs of blocks beside these, which are taken together.
    whole: f64,
    rest: f64,
    /// Number of whole nets.
    nets: f64,
    /// Degrees of freedom of what nets differ by \[Satterthwaite46\]; 0 where no pair of blocks is there.
    degrees: f64,
}

/// Mean and squared deviations of what is added up.
#[derive(Default)]
struct Spread {
    count: f64,
    mean: f64,
    m2: f64,
}

impl Spread {
    /// Adds `count` samples with their sum and the squared deviations from their mean: \[Chan83\] Eq. 2.1, written with means instead of sums.
    fn add(&mut self, count: f64, sum: f64, m2: f64) {
        let delta = sum / count - self.mean;
        let all = self.count + count;
        self.m2 += m2 + delta * delta * (self.count * count / all);
        self.mean += delta * (count / all);
        self.count = all;
    }
}
