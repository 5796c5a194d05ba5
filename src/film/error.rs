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
        (0..self.pixels())
            .map(|pixel| self.moments(pixel).1.map(|e| e as f32))
            .collect()
    }

    /// Estimated relative error of the image: the root mean square of the standard
    /// error over that of the mean, over all pixels and channels of the window.
    /// 0 for an image without noise (a black one, too), +∞ below two samples.
    pub fn relative_error(&self) -> f64 {
        let (mut signal, mut noise) = (0.0, 0.0);
        for pixel in 0..self.pixels() {
            let (mean, error) = self.moments(pixel);
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

    /// Number of independent parts that have as many degrees of freedom as [`Film::standard_error`], which is one less. Not a
    /// whole number where a pair of nets is not complete beside others.
    pub fn parts(&self) -> f64 {
        let parts = self.blocks() as f64;
        match self.degrees_of_nets() {
            0.0 => parts,
            degrees => parts.min(degrees + DEGREES + 1.0),
        }
    }

    /// Whole blocks and the nodes that are smaller; samples where there are not two whole blocks.
    fn blocks(&self) -> u64 {
        if !self.has_blocks() {
            return self.samples();
        }
        let nodes = self.nodes.iter();
        nodes
            .map(|(_, node)| self.whole_blocks(node.level).max(1))
            .sum()
    }

    /// Number of whole blocks in a node; 0 where it is a part of one.
    fn whole_blocks(&self, level: u32) -> u64 {
        level
            .checked_sub(self.block_level)
            .map_or(0, |more| 1 << more)
    }

    /// Whether there are two blocks to compare.
    fn has_blocks(&self) -> bool {
        let blocks = self.nodes.values().map(|n| self.whole_blocks(n.level));
        blocks.sum::<u64>() >= 2
    }

    /// Samples in whole pairs of nets, and those in pairs of blocks beside these.
    fn paired(&self) -> [f64; 2] {
        let mut paired = [0.0; 2];
        for node in self.nodes.values().filter(|_| self.block_level > 0) {
            let samples = (1_u64 << node.level) as f64;
            if node.level >= pair_level(self.block_level) {
                paired[0] += samples;
            } else if node.level > self.block_level {
                paired[1] += samples;
            }
        }
        paired
    }

    /// Degrees of freedom of what nets differ by \[Satterthwaite46\]: of whole nets, and one of all others, which are taken together. 0
    /// where no pair of blocks is there.
    fn degrees_of_nets(&self) -> f64 {
        let [whole, rest] = self.paired();
        let square = rest * rest
            + if whole > 0.0 {
                whole * whole / (self.whole_nets(whole) - 1.0)
            } else {
                0.0
            };
        if square > 0.0 {
            (whole + rest).powi(2) / square
        } else {
            0.0
        }
    }

    /// Number of whole nets in so many samples.
    fn whole_nets(&self, samples: f64) -> f64 {
        2.0 * samples / (1_u64 << pair_level(self.block_level)) as f64
    }

    /// Mean and standard error of a pixel's radiance.
    pub(super) fn moments(&self, pixel: usize) -> ([f64; 3], [f64; 3]) {
        let start = pixel * self.floats_per_pixel();
        let (has_blocks, parts) = (self.has_blocks(), self.blocks() as f64);
        let ([whole, rest], degrees) = (self.paired(), self.degrees_of_nets());
        let (mut mean, mut error) = ([0.0; 3], [f64::INFINITY; 3]);
        for channel in 0..3 {
            let (mut all, mut nets) = (Spread::default(), Spread::default());
            let mut difference = 0.0;
            for node in self.nodes.values() {
                let float = |part: usize| f64::from(node.values[start + part + channel]);
                let count = (1_u64 << node.level) as f64;
                // Deviations within a block say nothing about how blocks differ.
                let counts = !has_blocks || node.level > self.block_level;
                let own = if counts { float(DEVIATIONS) } else { 0.0 };
                all.add(count, float(RADIANCE), own);
                if node.level >= pair_level(self.block_level) {
                    nets.add(count, float(RADIANCE), float(BETWEEN));
                } else {
                    difference += float(BETWEEN);
                }
            }
            mean[channel] = all.mean;
            if parts < 2.0 {
                continue;
            }
            let mut square = all.m2 / (parts - 1.0) / all.count;
            if degrees > 0.0 {
                // variance of a sample, as whole nets have it, times their samples
                let of_whole = match whole {
                    0.0 => 0.0,
                    whole => nets.m2 / (self.whole_nets(whole) - 1.0) * whole,
                };
                let of_nets = (of_whole + difference * difference) / ((whole + rest) * all.count);
                square = (NETS * degrees * of_nets + GAIN * square) / (NETS * degrees + 1.0);
            }
            error[channel] = square.sqrt();
        }
        (mean, error)
    }
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
