//! The film: sums over samples that have the same bits however a render was
//! split into passes, shards and runs.
//!
//! Floating-point sums depend on their order, so the order is part of the
//! definition: samples are the leaves of a binary tree over their global
//! indices. The node (level k, first = m·2^k) covers the samples
//! first … first + 2^k − 1. A film holds the topmost nodes that are complete;
//! two siblings become their parent as soon as both are there. Which nodes are
//! left, and their bits, depend only on the set of samples. Rounding errors grow
//! with log N instead of N.
//!
//! References: \[Chan83\] Chan, Golub, LeVeque: Algorithms for Computing the
//! Sample Variance, The American Statistician 37 (1983).

mod allotment;
mod error;
mod interval;

use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::ops::Range;

use crate::error::{Error, Result};
use crate::layout::{BLOCK_LEVEL, FILM_FLOATS, FILM_FLOATS_AOV, NET_LEVEL};
use crate::settings::{Crop, Settings};

pub use allotment::{Allotment, Budget};

/// One past the largest sample index, so that ends and node sizes fit 64 bits.
pub const MAX_SAMPLES: u64 = 1 << 63;

// Floats of a pixel in a node, in order.
const RADIANCE: usize = 0;
const DEVIATIONS: usize = 3;
const BETWEEN: usize = 6;
const ALBEDO: usize = 9;
const NORMAL: usize = 12;
const DEPTH: usize = 15;
const COVERAGE: usize = 16;
const DROPPED: usize = 17;

/// A complete node of the tree over sample indices.
struct Node {
    level: u32,
    values: Vec<f32>,
}

/// What has been rendered of an image: see the module's documentation.
pub struct Film {
    window: Crop,
    full: (u32, u32),
    aovs: bool,
    /// log₂ of the samples of a block, whose samples depend on each other; 0: of none.
    block_level: u32,
    /// Samples of a pixel where the film counts one: levels, counts and blocks of that pixel are so much larger.
    allotment: Allotment,
    /// By first sample; disjoint, and no two siblings of the same level.
    nodes: BTreeMap<u64, Node>,
}

/// The fewest aligned nodes (first, level) that make up a range of samples, in order.
pub fn dyadic_pieces(samples: Range<u64>) -> Vec<(u64, u32)> {
    let mut pieces = Vec::new();
    let mut first = samples.start;
    while first < samples.end {
        let level = first.trailing_zeros().min((samples.end - first).ilog2());
        pieces.push((first, level));
        first += 1 << level;
    }
    pieces
}

/// log₂ of the samples of a pair of nets in blocks of 2^`block`; 0 where samples are independent, with a `block` of 0.
pub(crate) fn pair_level(block: u32) -> u32 {
    if block == 0 {
        0
    } else {
        block + NET_LEVEL - BLOCK_LEVEL + 1
    }
}

impl Film {
    /// An empty film for the pixels `window` of a frame of `full` = (width, height)
    /// pixels; `aovs` says whether nodes carry the sums of the first hit.
    pub fn new(window: Crop, full: (u32, u32), aovs: bool) -> Self {
        Self {
            window,
            full,
            aovs,
            block_level: 0,
            allotment: Allotment::default(),
            nodes: BTreeMap::new(),
        }
    }

    /// An empty film for what some settings render.
    pub fn of(settings: &Settings) -> Self {
        let full = (settings.width, settings.height);
        Self::new(settings.window(), full, settings.aovs).with_blocks(settings.block_level())
    }

    /// An empty film of samples of two nets that take turns (`rng_key` in rng.glsl), 2^`level` samples each, and of two
    /// others after 2^(`level` + 5). From two whole blocks on the standard error comes from what nets and their blocks differ by.
    #[must_use]
    pub fn with_blocks(mut self, level: u32) -> Self {
        self.block_level = level;
        self
    }

    /// An empty film whose pixels take different numbers of samples.
    #[must_use]
    pub fn with_allotment(mut self, allotment: Allotment) -> Self {
        self.allotment = allotment;
        self
    }

    /// How many samples pixels take where the film counts one.
    pub fn allotment(&self) -> &Allotment {
        &self.allotment
    }

    /// log₂ of the samples of a block; 0 where samples are independent.
    pub fn block_level(&self) -> u32 {
        self.block_level
    }

    /// The pixels that the film holds.
    pub fn window(&self) -> Crop {
        self.window
    }

    /// Width and height of the full frame, pixels.
    pub fn full_size(&self) -> (u32, u32) {
        self.full
    }

    /// Whether albedo, normal, depth and coverage are averaged and dropped samples counted too.
    pub fn has_aovs(&self) -> bool {
        self.aovs
    }

    /// Number of pixels in the window.
    pub fn pixels(&self) -> usize {
        let Crop { x0, y0, x1, y1 } = self.window;
        (x1 - x0) as usize * (y1 - y0) as usize
    }

    /// Floats that a node holds for each pixel.
    pub fn floats_per_pixel(&self) -> usize {
        if self.aovs {
            FILM_FLOATS_AOV as usize
        } else {
            FILM_FLOATS as usize
        }
    }

    /// Bytes held on the host.
    pub fn bytes(&self) -> u64 {
        self.nodes
            .values()
            .map(|node| size_of_val(&node.values[..]) as u64)
            .sum()
    }

    /// Number of samples for each pixel, as the film counts: of a pixel whose exponent is 0.
    pub fn samples(&self) -> u64 {
        self.nodes.values().map(|node| 1 << node.level).sum()
    }

    /// Number of samples of all pixels together.
    pub fn paths(&self) -> u64 {
        self.samples() * self.allotment.taken(self.pixels())
    }

    /// Samples a pixel on average, rounded down, where the film counts so many.
    pub fn mean_of(&self, samples: u64) -> u64 {
        let pixels = self.pixels();
        let mean = u128::from(samples) * u128::from(self.allotment.taken(pixels)) / pixels as u128;
        mean as u64
    }

    /// Number of samples of each pixel.
    pub fn samples_taken(&self) -> Vec<f32> {
        let samples = self.samples();
        self.map_pixels(|pixel| self.count(samples, pixel) as f32)
    }

    /// The samples that are in the film: disjoint, in order, as few ranges as possible.
    pub fn ranges(&self) -> Vec<Range<u64>> {
        let mut ranges: Vec<Range<u64>> = Vec::new();
        for (&first, node) in &self.nodes {
            let end = first + (1 << node.level);
            match ranges.last_mut() {
                Some(last) if last.end == first => last.end = end,
                _ => ranges.push(first..end),
            }
        }
        ranges
    }

    /// What the film lacks of some ranges, which are disjoint and in order.
    pub fn missing(&self, samples: &[Range<u64>]) -> Vec<Range<u64>> {
        let held = self.ranges();
        let mut missing = Vec::new();
        for range in samples {
            let mut next = range.start;
            for there in &held {
                if there.start.min(range.end) > next {
                    missing.push(next..there.start.min(range.end));
                }
                next = next.max(there.end);
            }
            if next < range.end {
                missing.push(next..range.end);
            }
        }
        missing
    }

    /// The nodes (first sample, level, values) in sample order: everything that
    /// [`Film::add`] needs to build this film again.
    pub fn nodes(&self) -> impl Iterator<Item = (u64, u32, &[f32])> {
        self.nodes
            .iter()
            .map(|(&first, node)| (first, node.level, &node.values[..]))
    }

    /// Adds the samples first … first + 2^level − 1, those of a pixel with exponent e times 2^e. `values` holds, for each pixel
    /// of the window row by row, the sum of radiance (3), the sum of squared
    /// deviations from the node's own mean (3; of samples up to a single block, of
    /// blocks beyond, each counted once for each of its samples), what the samples of the first net add up to less those of
    /// the second (3; from a pair of nets on the squared deviations of nets, as above; 0 up to a single block) and, with AOVs,
    /// the sums of albedo (3), normal (3), depth (1) and coverage (1) and the number of dropped samples (1).
    ///
    /// # Errors
    /// [`Error::Settings`] when the node is not aligned, has the wrong size, or
    /// holds samples that the film already has; the film is then unchanged.
    pub fn add(&mut self, first: u64, level: u32, values: Vec<f32>) -> Result<()> {
        self.check(first, level, values.len())?;
        self.insert(first, level, values);
        Ok(())
    }

    /// Adds all samples of another film of the same pixels.
    ///
    /// # Errors
    /// [`Error::Settings`] when windows, frames or AOVs differ or when both hold
    /// the same sample; the film is then unchanged.
    pub fn merge(&mut self, other: Self) -> Result<()> {
        if self.window != other.window {
            let what = format!("cannot merge {:?} into {:?}", other.window, self.window);
            return settings_error("--crop", what);
        }
        if self.full != other.full {
            let what = format!("cannot merge {:?} into {:?} pixels", other.full, self.full);
            return settings_error("--width, --height", what);
        }
        if self.aovs != other.aovs {
            let what = String::from("only one of the films has sums of the first hit");
            return settings_error("--aov", what);
        }
        if self.block_level != other.block_level {
            let what =
                String::from("samples of one film are a net, those of the other independent");
            return settings_error("--estimator", what);
        }
        if self.allotment != other.allotment {
            let what = String::from("the films spread their samples in different ways");
            return settings_error("--adaptive", what);
        }
        for (&first, node) in &other.nodes {
            self.check(first, node.level, node.values.len())?;
        }
        for (first, node) in other.nodes {
            self.insert(first, node.level, node.values);
        }
        Ok(())
    }

    /// Mean radiance, cd/m² per channel, for each pixel row by row: node sums added
    /// in double precision in sample order, divided, rounded once. Black when empty.
    pub fn mean(&self) -> Vec<[f32; 3]> {
        self.averages(RADIANCE)
    }

    /// Mean albedo of the first hit for each pixel (0 where nothing was hit); `None` without AOVs.
    pub fn albedo(&self) -> Option<Vec<[f32; 3]>> {
        self.aovs.then(|| self.averages(ALBEDO))
    }

    /// Mean shading normal of the first hit in world space for each pixel, shorter
    /// than 1 where samples differ or miss; `None` without AOVs.
    pub fn normal(&self) -> Option<Vec<[f32; 3]>> {
        self.aovs.then(|| self.averages(NORMAL))
    }

    /// Mean depth of the first hit in metres, over the samples that hit something;
    /// +∞ where none did; `None` without AOVs.
    pub fn depth(&self) -> Option<Vec<f32>> {
        self.aovs.then(|| {
            self.map_pixels(|pixel| {
                let [depth, coverage] = self.sum(pixel, DEPTH);
                if coverage > 0.0 {
                    (depth / coverage) as f32
                } else {
                    f32::INFINITY
                }
            })
        })
    }

    /// Fraction of samples that hit something, for each pixel; `None` without AOVs.
    pub fn coverage(&self) -> Option<Vec<f32>> {
        let samples = self.samples().max(1);
        self.aovs.then(|| {
            self.map_pixels(|pixel| {
                let [coverage] = self.sum(pixel, COVERAGE);
                (coverage / self.count(samples, pixel)) as f32
            })
        })
    }

    /// Number of samples that were dropped since they were not finite, for each pixel, exact up to 2²⁴; `None` without AOVs.
    pub fn dropped(&self) -> Option<Vec<f32>> {
        self.aovs.then(|| {
            self.map_pixels(|pixel| {
                let [dropped] = self.sum(pixel, DROPPED);
                dropped as f32
            })
        })
    }

    /// Refuses nodes that do not fit the tree, the window or the samples that are there.
    fn check(&self, first: u64, level: u32, len: usize) -> Result<()> {
        let aligned = level < 64 && first % (1 << level) == 0;
        let end = if aligned {
            first.checked_add(1 << level)
        } else {
            None
        };
        let Some(end) = end.filter(|&end| end <= MAX_SAMPLES >> self.allotment.most()) else {
            let what = format!("no node of level {level} starts at sample {first}");
            return settings_error("--samples", what);
        };
        let expected = self.pixels() * self.floats_per_pixel();
        if len != expected {
            let what = format!("a node of this film holds {expected} floats, not {len}");
            return settings_error("--samples", what);
        }
        let before = self.nodes.range(..end).next_back();
        if let Some((&start, node)) = before {
            let stop = start + (1 << node.level);
            if stop > first {
                let what =
                    format!("samples {first}..{end} overlap {start}..{stop}, which are there");
                return settings_error("--samples", what);
            }
        }
        Ok(())
    }

    /// Inserts a checked node and merges siblings upwards.
    fn insert(&mut self, mut first: u64, mut level: u32, mut values: Vec<f32>) {
        loop {
            let sibling = first ^ (1 << level);
            if self.nodes.get(&sibling).is_none_or(|n| n.level != level) {
                break;
            }
            let other = self.nodes.remove(&sibling).expect("was just found").values;
            let right;
            (values, right) = if sibling < first {
                (other, values)
            } else {
                (values, other)
            };
            self.merge_siblings(&mut values, &right, level);
            first = first.min(sibling);
            level += 1;
        }
        self.nodes.insert(first, Node { level, values });
    }

    /// Sums of `N` neighbouring floats of a pixel over all nodes, in sample order.
    fn sum<const N: usize>(&self, pixel: usize, offset: usize) -> [f64; N] {
        let start = pixel * self.floats_per_pixel() + offset;
        let mut sum = [0.0; N];
        for node in self.nodes.values() {
            for (s, &v) in sum.iter_mut().zip(&node.values[start..start + N]) {
                *s += f64::from(v);
            }
        }
        sum
    }

    fn map_pixels<T>(&self, f: impl Fn(usize) -> T) -> Vec<T> {
        (0..self.pixels()).map(f).collect()
    }

    fn averages(&self, offset: usize) -> Vec<[f32; 3]> {
        let samples = self.samples().max(1);
        self.map_pixels(|pixel| {
            let count = self.count(samples, pixel);
            self.sum(pixel, offset).map(|s: f64| (s / count) as f32)
        })
    }

    /// Samples of a pixel where the film counts so many.
    fn count(&self, samples: u64, pixel: usize) -> f64 {
        samples as f64 * f64::from(1u32 << self.allotment.exponent(pixel))
    }

    /// Adds the right sibling to the left one, both of `level`.
    fn merge_siblings(&self, left: &mut [f32], right: &[f32], level: u32) {
        let steps: Vec<Step> = (0..=self.allotment.most())
            .map(|exponent| Step::of(level + exponent, self.block_level))
            .collect();
        let stride = self.floats_per_pixel();
        let both = left
            .chunks_exact_mut(stride)
            .zip(right.chunks_exact(stride));
        for (pixel, (a, b)) in both.enumerate() {
            steps[self.allotment.exponent(pixel) as usize].merge(a, b);
        }
    }
}

/// How two siblings of a pixel are added.
struct Step {
    scale: f32,
    /// Siblings are blocks.
    are_blocks: bool,
    /// Level of their parent beside that of a pair of nets; without nets there is none.
    pair: Option<Ordering>,
}

impl Step {
    /// For siblings of 2^`level` samples, in blocks of 2^`block`.
    fn of(level: u32, block: u32) -> Self {
        Self {
            // A power of two, hence exact.
            scale: 0.5 / (1_u64 << level) as f32,
            are_blocks: block > 0 && level == block,
            pair: (block > 0).then(|| (level + 1).cmp(&pair_level(block))),
        }
    }

    /// Adds the right sibling to the left one. The shaders do the same below the nodes that they return, in this order and
    /// without fused operations, so the bits do not depend on who merges.
    fn merge(&self, a: &mut [f32], b: &[f32]) {
        // [Chan83] Eq. 2.1 for equal counts n: M₂ = M₂a + M₂b + (Σa − Σb)² / (2n).
        let scale = self.scale;
        for channel in 0..3 {
            let d = a[RADIANCE + channel] - b[RADIANCE + channel];
            let within = a[DEVIATIONS + channel] + b[DEVIATIONS + channel];
            let between = a[BETWEEN + channel] + b[BETWEEN + channel];
            let (within, between) = if self.are_blocks {
                (0.0, d)
            } else {
                (within, between)
            };
            a[RADIANCE + channel] += b[RADIANCE + channel];
            a[DEVIATIONS + channel] = within + d * d * scale;
            // Of a pair of nets on, deviations of nets.
            a[BETWEEN + channel] = match self.pair {
                None => 0.0,
                Some(Ordering::Less) => between,
                Some(Ordering::Equal) => between * between * scale,
                Some(Ordering::Greater) => between + d * d * scale,
            };
        }
        for (a, b) in a.iter_mut().zip(b).skip(ALBEDO) {
            *a += b;
        }
    }
}

/// The pixels of a picture that are at most `reach` away along each axis, row by row, the pixel itself included.
fn rows_around(
    pixel: usize,
    width: usize,
    count: usize,
    reach: usize,
) -> impl Iterator<Item = Range<usize>> {
    let near = |at: usize, end: usize| at.saturating_sub(reach)..(at + reach + 1).min(end);
    let columns = near(pixel % width, width);
    near(pixel / width, count / width)
        .map(move |row| row * width + columns.start..row * width + columns.end)
}

fn settings_error(name: &'static str, what: String) -> Result<()> {
    Err(Error::Settings { name, what })
}
