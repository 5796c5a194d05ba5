//! Whether two images differ by more than their noise, and how far apart they are.
//!
//! Three families of tests look at the difference A − B of every channel: the whole image (its plain sum, and one in which quiet
//! pixels count more), tiles of 8 × 8 pixels, and single pixels. The verdict is "different" where the least p-value, corrected for the number of tests in
//! its family and for the number of families (Šidák), is below α: chance alone says so in a part α of all pairs at most.
//!
//! Pixels of a path tracer are skewed: most samples are dark and a few are bright, and the bright ones that did not come
//! are missing in the mean and in its standard error alike. A normal law would raise many false alarms. So:
//!
//! - A region's sum is judged by Student's t with the degrees of freedom of Satterthwaite \[Satterthwaite46\],
//!   ν = 2(Σv)²/Σv², as if the variance of each pixel were known no better than by one normal variable. Where few pixels carry
//!   the noise, ν is small and the test nearly blind, as it must be.
//! - Both images estimate the noise of one sample; the larger one counts for both, scaled by the numbers of samples. So a reference that has seen the
//!   rare events speaks for the image that has not.
//! - N equal samples have no variance and need not be exact: d²/N is added to each pixel's variance. Where samples are the
//!   points of nets, N counts nets.
//! - A pixel is judged by 2 exp(−t²/2), which bounds self-normalised sums of symmetric variables of any distribution \[Efron69\], and t² cannot
//!   exceed N. With some dozens of samples it sees nothing but gross errors, and that is all there is to see.

mod metrics;
mod picture;
mod side;

pub use metrics::Metrics;
pub use picture::{difference, signed_picture};
pub use side::{Side, Source};

use crate::error::{Error, Result};
use crate::image_io::Image;
use crate::tails;

/// Side of a tile, pixels.
pub const TILE: usize = 8;
/// Samples a pixel that are assumed where neither image tells their number.
const UNKNOWN_COUNT: f64 = 16.0;
/// Pixels to either side whose noise decides a pixel's weight.
const REACH: isize = 2;
/// Part of the mean variance that no pixel is thought to be below when weights are chosen.
const FLOOR: f64 = 0.01;
/// Names of the channels.
pub const CHANNELS: [&str; 3] = ["red", "green", "blue"];

/// How to compare.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Rate of false alarms, all tests together.
    pub alpha: f64,
    /// Samples a pixel of either image, where the file does not tell.
    pub spp: [Option<f64>; 2],
}

/// A family of tests and the one with the least p-value.
#[derive(Clone, Debug)]
pub struct Family {
    /// `image`, `tile` or `pixel`.
    pub name: &'static str,
    /// How many tests it has.
    pub count: usize,
    /// Its most suspicious test.
    pub worst: Test,
    /// Chance of a p-value like that in the family when nothing differs.
    pub p: f64,
}

/// One test.
#[derive(Clone, Copy, Debug)]
pub struct Test {
    /// First column and row of the region, from the window's corner.
    pub at: (usize, usize),
    /// Channel.
    pub channel: usize,
    /// Whether quiet pixels counted more than noisy ones.
    pub is_weighted: bool,
    /// Difference of the region's means, A − B.
    pub difference: f64,
    /// In standard errors, rounding left out.
    pub z: f64,
    /// Degrees of freedom of Student's t; 0: a bound without a distribution.
    pub degrees: f64,
    /// Chance of such a difference when nothing differs, this test alone.
    pub p: f64,
}

/// What came out.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// The families that could be tested; none without standard errors.
    pub families: Vec<Family>,
    /// p-value of all families together; `None` without standard errors.
    pub p: Option<f64>,
    /// Whether they differ; `None` where nothing can be said.
    pub is_different: Option<bool>,
    /// Every finite value is the same number.
    pub is_identical: bool,
    /// Distances.
    pub metrics: Metrics,
    /// Pixels that are not finite in A alone, B alone, both.
    pub not_finite: [usize; 3],
    /// Relative difference of all pixels alike that would have been found in 95 of 100 cases.
    pub detectable: Option<f64>,
    /// Where the standard errors of either image come from.
    pub sources: [Option<Source>; 2],
    /// What the user should know.
    pub notes: Vec<String>,
}

/// Compares two images of the same pixels.
///
/// # Errors
/// [`Error::Settings`] when the windows differ or an image has no colours.
pub fn compare(a: &Image, b: &Image, options: &Options) -> Result<Comparison> {
    check_windows(a, b)?;
    let sides = [Side::of(a, options.spp[0])?, Side::of(b, options.spp[1])?];
    let mut result = compare_sides(&sides, a.size().0, options.alpha);
    result.notes.extend(side::shared_samples(a, b));
    Ok(result)
}

fn check_windows(a: &Image, b: &Image) -> Result<()> {
    if a.size() != b.size() {
        let ((w, h), (x, y)) = (a.size(), b.size());
        let what = format!("A has {w} × {h} pixels and B {x} × {y}");
        return Err(Error::Settings {
            name: "image",
            what,
        });
    }
    if a.window != b.window || a.full != b.full {
        let place = |i: &Image| {
            let (w, full) = (i.window, i.full);
            format!(
                "{},{},{},{} of a frame of {} × {} pixels",
                w.x0, w.y0, w.x1, w.y1, full.0, full.1
            )
        };
        let what = format!("A shows {} and B {}", place(a), place(b));
        return Err(Error::Settings {
            name: "image",
            what,
        });
    }
    Ok(())
}

/// As [`compare`], of images `width` pixels wide that are read already.
pub fn compare_sides(sides: &[Side; 2], width: usize, alpha: f64) -> Comparison {
    let [a, b] = sides;
    let pixels = a.mean[0].len();
    let finite: Vec<usize> = (0..pixels)
        .filter(|&i| a.is_finite(i) && b.is_finite(i))
        .collect();
    let mut not_finite = [0; 3];
    for i in 0..pixels {
        match (a.is_finite(i), b.is_finite(i)) {
            (true, true) => {}
            (false, true) => not_finite[0] += 1,
            (true, false) => not_finite[1] += 1,
            (false, false) => not_finite[2] += 1,
        }
    }
    let same = |&i: &usize| (0..3).all(|c| a.mean[c][i] == b.mean[c][i]);
    let mut result = Comparison {
        families: Vec::new(),
        p: None,
        is_different: None,
        is_identical: not_finite[..2] == [0, 0] && finite.iter().all(same),
        metrics: Metrics::of(a, b, &finite),
        not_finite,
        detectable: None,
        sources: sides.each_ref().map(|s| s.source),
        notes: Vec::new(),
    };
    for (side, name) in sides.iter().zip(["A", "B"]) {
        let notes = side.notes.iter().map(|note| format!("{name} {note}"));
        result.notes.extend(notes);
    }
    let has_variance = a.variance.is_some() || b.variance.is_some();
    let known = finite
        .into_iter()
        .filter(|&i| a.is_known(i) && b.is_known(i));
    let known: Vec<usize> = known.collect();
    if has_variance && !known.is_empty() {
        judge(&mut result, sides, width, &known, alpha);
    }
    // A value that is missing in one image alone is no noise.
    if not_finite[0] + not_finite[1] > 0 {
        result.is_different = Some(true);
    }
    result
}

fn judge(result: &mut Comparison, sides: &[Side; 2], width: usize, known: &[usize], alpha: f64) {
    let width = width.max(1);
    let tests = Tests::new(sides, width);
    let has_both = sides.iter().all(|s| s.variance.is_some());
    let has_counts = sides.iter().all(|s| s.count.is_some());
    if !has_both {
        let other = if sides[0].variance.is_none() {
            "A"
        } else {
            "B"
        };
        result.notes.push(format!(
            "{other} has no standard errors and is taken as exact"
        ));
    }
    let tiles_x = width.div_ceil(TILE);
    let rows = sides[0].mean[0].len() / width;
    let mut tiles = vec![Vec::new(); tiles_x * rows.div_ceil(TILE)];
    for &i in known {
        tiles[i / width / TILE * tiles_x + i % width / TILE].push(i);
    }
    tiles.retain(|tile| !tile.is_empty());
    let weights = [0, 1, 2].map(|c| tests.weights(known, c));
    let plain = (0..3).map(|c| tests.region(known, c, None));
    let weighted = (0..3).map(|c| tests.region(known, c, Some(&weights[c])));
    let image: Vec<Test> = plain.chain(weighted).collect();
    result.detectable = tests.detectable(known, &weights, alpha);
    result.families.extend(family("image", image.into_iter()));
    let each = |tile: &Vec<usize>| [0, 1, 2].map(|c| tests.region(tile, c, None));
    result
        .families
        .extend(family("tile", tiles.iter().flat_map(each)));
    if has_both && has_counts {
        let each = |&i: &usize| [0, 1, 2].map(|c| tests.pixel(i, c));
        result
            .families
            .extend(family("pixel", known.iter().flat_map(each)));
    } else {
        result.notes.push(String::from(
            "single pixels are not tested: that needs the standard errors and numbers of samples of both images",
        ));
    }
    let least = result.families.iter().map(|f| f.p).fold(1.0, f64::min);
    let p = tails::least_of(least, result.families.len());
    result.p = Some(p);
    result.is_different = Some(p < alpha);
}

fn family(name: &'static str, tests: impl Iterator<Item = Test>) -> Option<Family> {
    let (mut count, mut worst) = (0, None::<Test>);
    for test in tests {
        count += 1;
        // Where rounding to 0 hides which p is the least, the deviation tells.
        let is_worse = |w: Test| test.p < w.p || (test.p == w.p && test.z.abs() > w.z.abs());
        if worst.is_none_or(is_worse) {
            worst = Some(test);
        }
    }
    let worst = worst?;
    Some(Family {
        name,
        count,
        worst,
        p: tails::least_of(worst.p, count),
    })
}

/// The tests of a pair of images.
struct Tests<'a> {
    sides: &'a [Side; 2],
    width: usize,
}

/// Sums over a region.
struct Sums {
    difference: f64,
    rounding: f64,
    variance: f64,
    squares: f64,
}

impl<'a> Tests<'a> {
    fn new(sides: &'a [Side; 2], width: usize) -> Self {
        Self { sides, width }
    }

    /// Samples of a pixel on either side.
    fn counts(&self, pixel: usize) -> Option<[f64; 2]> {
        match self.sides.each_ref().map(|s| s.count.as_ref()) {
            [Some(a), Some(b)] => Some([a[pixel], b[pixel]]),
            _ => None,
        }
    }

    /// Variances of a pixel as each side knows its own, and as the other side would have it (NaN: it does not know).
    fn variances(&self, pixel: usize, channel: usize) -> [[f64; 2]; 2] {
        let own = self.sides.each_ref().map(|s| {
            s.variance
                .as_ref()
                .map_or(0.0, |variance| variance[channel][pixel])
        });
        let has_both = self.sides.iter().all(|s| s.variance.is_some());
        let other = match self.counts(pixel) {
            Some([n, m]) if has_both => [own[1] * m / n, own[0] * n / m],
            _ => [f64::NAN; 2],
        };
        [own, other]
    }

    /// Fewest independent parts of a pixel.
    fn fewest(&self, pixel: usize) -> f64 {
        let known = self.sides.iter().filter(|s| s.variance.is_some());
        let counts = known.filter_map(|s| s.parts(pixel));
        let least = counts.fold(f64::INFINITY, f64::min);
        if least.is_finite() {
            least
        } else {
            UNKNOWN_COUNT
        }
    }

    /// Difference and the part of it that may be rounding.
    fn difference(&self, pixel: usize, channel: usize) -> (f64, f64) {
        let [a, b] = self.sides;
        let (x, y) = (a.mean[channel][pixel], b.mean[channel][pixel]);
        (x - y, a.rounding * x.abs() + b.rounding * y.abs())
    }

    fn sums(&self, pixels: &[usize], channel: usize, weights: Option<&[f64]>) -> Sums {
        let weight = |i: usize| weights.map_or(1.0, |w| w[i]);
        let shared = self
            .sides
            .each_ref()
            .map(|s| (s.shared[0] * s.shared[1]) as f64);
        // Which side's noise counts for each: the larger sum, as no side sees more than is there on average.
        let mut totals = [[0.0; 2]; 2];
        for &i in pixels {
            let v = self.variances(i, channel);
            for s in 0..2 {
                totals[0][s] += weight(i).powi(2) * v[0][s];
                totals[1][s] += weight(i).powi(2) * v[1][s];
            }
        }
        let from = [0, 1].map(|s| usize::from(totals[1][s] > totals[0][s]));
        let mut sums = Sums {
            difference: 0.0,
            rounding: 0.0,
            variance: 0.0,
            squares: 0.0,
        };
        for &i in pixels {
            let (d, rounding) = self.difference(i, channel);
            let v = self.variances(i, channel);
            // Where errors of a block go together, as many sums of them are as uncertain as if all were equal.
            let v = shared[0] * v[from[0]][0] + shared[1] * v[from[1]][1] + d * d / self.fewest(i);
            let w = weight(i);
            let v = w * w * v;
            sums.difference += w * d;
            sums.rounding += w * rounding;
            sums.variance += v;
            sums.squares += shared[0].max(shared[1]) * v * v;
        }
        sums
    }

    /// The sum over a region, plain or weighted.
    fn region(&self, pixels: &[usize], channel: usize, weights: Option<&[f64]>) -> Test {
        let sums = self.sums(pixels, channel, weights);
        let excess = (sums.difference.abs() - sums.rounding).max(0.0);
        let (z, degrees, p) = if excess == 0.0 {
            (0.0, f64::INFINITY, 1.0)
        } else {
            // [Satterthwaite46]; the excess stands in the variance, so that is above 0.
            let degrees = 2.0 * sums.variance * sums.variance / sums.squares;
            let z = excess / sums.variance.sqrt();
            (z, degrees, tails::student(z, degrees))
        };
        let first = pixels[0];
        Test {
            at: (first % self.width, first / self.width),
            channel,
            is_weighted: weights.is_some(),
            difference: sums.difference
                / pixels
                    .iter()
                    .map(|&i| weights.map_or(1.0, |w| w[i]))
                    .sum::<f64>(),
            z: z.copysign(sums.difference),
            degrees,
            p,
        }
    }

    /// Weights that make a common relative difference stand out: mean over the largest variance around. They are taken from the neighbours of a pixel
    /// and not from the pixel, or from its block where pixels share, whose noise is therefore independent of its weight: the weighted sum has the mean 0.
    fn weights(&self, pixels: &[usize], channel: usize) -> Vec<f64> {
        let total = self.sides[0].mean[0].len();
        let (mut means, mut variances) = (vec![f64::NAN; total], vec![0.0; total]);
        for &i in pixels {
            let [own, _] = self.variances(i, channel);
            means[i] = self.sides.iter().map(|s| s.mean[channel][i].abs()).sum();
            variances[i] = own[0] + own[1];
        }
        let floor = FLOOR * variances.iter().sum::<f64>() / pixels.len() as f64;
        let (width, rows) = (self.width as isize, (total / self.width) as isize);
        let size = [0, 1].map(|axis| self.sides[0].shared[axis].max(self.sides[1].shared[axis]));
        let block = |i: usize| (i % self.width / size[0], i / self.width / size[1]);
        let weight = |i: usize| {
            let (x, y) = ((i % self.width) as isize, (i / self.width) as isize);
            let (mut mean, mut variance, mut count) = (0.0, 0.0, 0.0);
            for ny in (y - REACH).max(0)..=(y + REACH).min(rows - 1) {
                for nx in (x - REACH).max(0)..=(x + REACH).min(width - 1) {
                    let n = (ny * width + nx) as usize;
                    let is_other = block(i) != block(n);
                    if is_other && !means[n].is_nan() {
                        mean += means[n];
                        variance = f64::max(variance, variances[n]);
                        count += 1.0;
                    }
                }
            }
            (mean / count) / (variance + floor).max(f64::MIN_POSITIVE)
        };
        let mut weights = vec![0.0; total];
        for &i in pixels {
            weights[i] = weight(i);
        }
        // About 1, so that nothing overflows; all alike where there is no noise to weigh by.
        let most = weights.iter().fold(0.0, |m: f64, &w| m.max(w));
        for w in &mut weights {
            *w = if floor > 0.0 && most > 0.0 {
                *w / most
            } else {
                1.0
            };
        }
        weights
    }

    /// A pixel alone.
    fn pixel(&self, pixel: usize, channel: usize) -> Test {
        let (d, rounding) = self.difference(pixel, channel);
        let [own, other] = self.variances(pixel, channel);
        let excess = (d.abs() - rounding).max(0.0);
        let variance = own[0].max(other[0]) + own[1].max(other[1]) + d * d / self.fewest(pixel);
        let z = if excess == 0.0 {
            0.0
        } else {
            excess / variance.sqrt()
        };
        Test {
            at: (pixel % self.width, pixel / self.width),
            channel,
            is_weighted: false,
            difference: d,
            z: z.copysign(d),
            degrees: 0.0,
            p: (2.0 * (-0.5 * z * z).exp()).min(1.0),
        }
    }

    /// The least relative difference of all pixels alike that the weighted test of a channel finds in 95 of 100 cases.
    fn detectable(&self, pixels: &[usize], weights: &[Vec<f64>; 3], alpha: f64) -> Option<f64> {
        let level = tails::share_of(tails::share_of(alpha, 3), 6);
        let of = |c: usize| {
            let sums = self.sums(pixels, c, Some(&weights[c]));
            let total: f64 = pixels
                .iter()
                .map(|&i| weights[c][i] * self.sides[1].mean[c][i])
                .sum();
            let degrees = 2.0 * sums.variance * sums.variance / sums.squares;
            // One-sided 5 % of the normal law.
            let errors = tails::student_quantile(level, degrees) + 1.645;
            (total > 0.0 && degrees.is_finite()).then(|| errors * sums.variance.sqrt() / total)
        };
        (0..3).filter_map(of).min_by(f64::total_cmp)
    }
}
