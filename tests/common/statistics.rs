//! Statistics of the tests: estimates and their equivalence with the truth, independent batches, χ², Kolmogorov and
//! Smirnov, families of tests that share one rate of false alarms, tails. `tests/statistics.rs` tests them.
//!
//! A test of chance asserts equivalence: the deviation and what chance may add to it stay inside a stated bound, so
//! that too few samples fail. Where the law of a p-value is known exactly, the p-value is printed (`p-value NAME
//! 0.123`), and the night asks whether all of them together are uniform.
#![allow(dead_code, reason = "each test program uses a part")]

use etendue::film::Film;
use etendue::tails::{ln_gamma, share_of, student, student_quantile};

#[path = "../../examples/pi/tail.rs"]
pub mod tail;

pub use tail::Tail;

/// Chance that a correct renderer fails a test function, all its tests of chance together.
pub const FALSE_ALARM: f64 = 1e-3;

/// Chance that a right estimate is further from the truth than [`Estimate::chance`], two-sided.
pub const LEVEL: f64 = 1e-6;

/// Standard errors of the normal law that [`LEVEL`] stands for, rounded up.
pub const Z: f64 = 4.9;

/// Level of each of `count` tests with [`FALSE_ALARM`] for all.
pub fn sidak(count: usize) -> f64 {
    share_of(FALSE_ALARM, count)
}

/// Deviations that none of `count` normal variables exceeds but with the chance [`FALSE_ALARM`].
pub fn largest_of(count: usize) -> f64 {
    student_quantile(sidak(count), 1e12)
}

/// A mean with its standard error, and how well that is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    pub mean: f64,
    pub error: f64,
    /// Degrees of freedom of the error; infinite where it is as good as known.
    pub degrees: f64,
}

impl Estimate {
    /// With an error that is as good as known.
    pub fn new(mean: f64, error: f64) -> Self {
        Self {
            mean,
            error,
            degrees: f64::INFINITY,
        }
    }

    /// Of independent values.
    pub fn of(values: impl Iterator<Item = f64> + Clone) -> Self {
        let n = values.clone().count() as f64;
        let mean = values.clone().sum::<f64>() / n;
        let square = values.map(|v| (v - mean).powi(2)).sum::<f64>();
        Self {
            mean,
            error: (square / (n * (n - 1.0))).sqrt(),
            degrees: n - 1.0,
        }
    }

    /// Of the mean of pixels that are independent, from their means and standard errors.
    pub fn of_pixels(pixels: impl Iterator<Item = (f64, f64)>) -> Self {
        let (n, sum, square) = pixels.fold((0.0, 0.0, 0.0), |(n, sum, square), (m, e)| {
            (n + 1.0, sum + m, square + e * e)
        });
        Self::new(sum / n, square.sqrt() / n)
    }

    /// Mean over the pixels of a film and its channels.
    pub fn of_image(film: &Film) -> Self {
        Self::of_film(film, &[0, 1, 2])
    }

    /// Mean over the pixels of a film and these channels, which are taken as fully dependent.
    pub fn of_film(film: &Film, channels: &[usize]) -> Self {
        let average = |v: &[f32; 3]| {
            let sum: f64 = channels.iter().map(|&c| f64::from(v[c])).sum();
            sum / channels.len() as f64
        };
        let (means, errors) = (film.mean(), film.standard_error());
        Self::of_pixels(means.iter().map(average).zip(errors.iter().map(average)))
    }

    /// What chance may add to a deviation: [`Z`] errors, or as many of Student's t.
    pub fn chance(&self) -> f64 {
        match self.degrees.is_finite() {
            true => student_quantile(LEVEL, self.degrees) * self.error,
            false => Z * self.error,
        }
    }

    /// Less another, independent one (Welch, Satterthwaite).
    pub fn minus(self, other: Self) -> Self {
        let squares = [self, other].map(|e| e.error * e.error);
        let parts = [
            squares[0].powi(2) / self.degrees,
            squares[1].powi(2) / other.degrees,
        ];
        Self {
            mean: self.mean - other.mean,
            error: (squares[0] + squares[1]).sqrt(),
            degrees: (squares[0] + squares[1]).powi(2) / (parts[0] + parts[1]),
        }
    }

    /// How far it is from `truth`, and what of that chance may be or hide; both relative to the truth.
    pub fn off(&self, truth: f64) -> (f64, f64) {
        let off = (self.mean - truth).abs() / truth.abs();
        (off, self.chance() / truth.abs())
    }

    /// The same against another estimate, relative to that.
    pub fn off_from(self, other: Self) -> (f64, f64) {
        let difference = self.minus(other);
        let scale = other.mean.abs();
        (difference.mean.abs() / scale, difference.chance() / scale)
    }

    /// Whether it is within `delta` of `truth`, chance included.
    pub fn is_within(&self, truth: f64, delta: f64) -> bool {
        (self.mean - truth).abs() + self.chance() <= delta
    }

    /// Asserts that it is within the relative bound `delta` of `truth`, chance included.
    pub fn assert_is(&self, what: &str, truth: f64, delta: f64) {
        let (mean, (off, chance)) = (self.mean, self.off(truth));
        println!(
            "{what}: {mean:.7}, truth {truth:.7}, off {off:.1e}, ±{chance:.1e}, allowed {delta:.1e}"
        );
        assert!(off + chance <= delta, "{what}: {mean} instead of {truth}");
    }

    /// Chance of a deviation from the truth as large as this one.
    pub fn p(&self, truth: f64) -> f64 {
        // Student's t beyond 10¹² degrees of freedom is the normal law.
        student((self.mean - truth) / self.error, self.degrees.min(1e12))
    }
}

/// Names and pixels of a square image and of its tiles.
pub fn regions(side: usize, tile: usize) -> Vec<(String, Vec<usize>)> {
    let mut regions = vec![(String::from("image"), (0..side * side).collect())];
    let across = side / tile;
    for (y, x) in (0..across).flat_map(|y| (0..across).map(move |x| (y, x))) {
        let pixels = (0..tile * tile)
            .map(|i| (y * tile + i / tile) * side + x * tile + i % tile)
            .collect();
        regions.push((format!("tile ({x}, {y})"), pixels));
    }
    regions
}

/// Pictures of one scene, each with a seed of its own: what is said of them needs no standard error of theirs.
#[derive(Default)]
pub struct Batches(Vec<Vec<[f32; 3]>>);

impl Batches {
    pub fn push(&mut self, film: &Film) {
        self.0.push(film.mean());
    }

    /// Mean of a channel over these pixels.
    pub fn estimate(&self, pixels: &[usize], channel: usize) -> Estimate {
        let mean = |picture: &Vec<[f32; 3]>| {
            let sum: f64 = pixels.iter().map(|&i| f64::from(picture[i][channel])).sum();
            sum / pixels.len() as f64
        };
        Estimate::of(self.0.iter().map(mean))
    }

    /// How the largest pixels of all pictures behave: no verdict by standard errors where they are heavy.
    pub fn tail(&self, channel: usize) -> Tail {
        let all: Vec<f32> = self.0.iter().flatten().map(|v| v[channel]).collect();
        Tail::of(&all)
    }
}

/// Cells with fewer expected counts are pooled: below, χ² is no longer near its limit law.
const MIN_EXPECTED: f64 = 5.0;

/// Probability that χ² of correct counts is at least as large as that of `counts`.
/// A cell of probability 0 that was hit gives 0.
pub fn chi_square(counts: &[u32], probabilities: &[f64]) -> f64 {
    assert_eq!(counts.len(), probabilities.len());
    let total: f64 = counts.iter().map(|&c| f64::from(c)).sum();
    let mut sum = 0.0;
    let mut used = 0;
    let mut pool = (0.0, 0.0);
    for (&count, &p) in counts.iter().zip(probabilities) {
        let (count, expected) = (f64::from(count), p * total);
        if p <= 0.0 && count > 0.0 {
            return 0.0;
        }
        if expected < MIN_EXPECTED {
            pool = (pool.0 + count, pool.1 + expected);
        } else {
            sum += (count - expected).powi(2) / expected;
            used += 1;
        }
    }
    if pool.1 >= MIN_EXPECTED {
        sum += (pool.0 - pool.1).powi(2) / pool.1;
        used += 1;
    } else if pool.0 > 0.0 && poisson_tail(pool.0, pool.1) < 1e-9 {
        return 0.0;
    }
    if used < 2 {
        1.0
    } else {
        chi_square_tail(sum, used - 1)
    }
}

/// P(X ≥ count) of a Poisson variable: for the few counts outside all large cells.
fn poisson_tail(count: f64, mean: f64) -> f64 {
    let mut term = (-mean).exp();
    let mut below = 0.0;
    for k in 0..count as u32 {
        below += term;
        term *= mean / f64::from(k + 1);
    }
    (1.0 - below).max(0.0)
}

/// P(χ² ≥ x) with `degrees` of freedom: the regularised upper incomplete gamma function.
pub fn chi_square_tail(x: f64, degrees: usize) -> f64 {
    let (a, x) = (degrees as f64 / 2.0, x / 2.0);
    if x <= 0.0 {
        return 1.0;
    }
    let scale = (a * x.ln() - x - ln_gamma(a)).exp();
    if x < a + 1.0 {
        // The series of the lower function.
        let mut term = 1.0 / a;
        let mut sum = term;
        let mut n = a;
        while term > sum * 1e-16 {
            n += 1.0;
            term *= x / n;
            sum += term;
        }
        return 1.0 - scale * sum;
    }
    // Lentz's continued fraction of the upper function.
    let mut b = x + 1.0 - a;
    let mut c = 1e300;
    let mut d = 1.0 / b;
    let mut h = d;
    for i in 1..100_000 {
        let an = -f64::from(i) * (f64::from(i) - a);
        b += 2.0;
        d = 1.0 / (an * d + b);
        c = b + an / c;
        h *= d * c;
        if (d * c - 1.0).abs() < 1e-15 {
            break;
        }
    }
    scale * h
}

/// Kolmogorov's and Smirnov's distance of values from their law times the root of the count, and the chance of one as large.
pub fn kolmogorov<T: Copy + PartialOrd + Into<f64>>(
    mut values: Vec<T>,
    cdf: impl Fn(f64) -> f64,
) -> (f64, f64) {
    values.sort_unstable_by(|a, b| a.partial_cmp(b).expect("NaN has no place"));
    let n = values.len() as f64;
    let mut largest = 0.0_f64;
    for (i, &v) in values.iter().enumerate() {
        let p = cdf(v.into());
        let (below, above) = (i as f64 / n, (i + 1) as f64 / n);
        largest = largest.max((p - below).abs()).max((above - p).abs());
    }
    let distance = largest * n.sqrt();
    (
        distance,
        kolmogorov_tail(distance + largest * (0.12 + 0.11 / n.sqrt())),
    )
}

/// P(√n D ≥ x) in the limit of many values; [`kolmogorov`] corrects x for few [Press07] §14.3.3.
pub fn kolmogorov_tail(x: f64) -> f64 {
    if x < 0.2 {
        return 1.0;
    }
    let term = |k: i32| 2.0 * (-2.0 * f64::from(k * k) * x * x).exp();
    let sum: f64 = (1..40)
        .map(|k| if k % 2 == 1 { term(k) } else { -term(k) })
        .sum();
    sum.clamp(0.0, 1.0)
}

/// The p-values of one test function; asserts all of them at once.
#[derive(Default)]
pub struct Family(Vec<(String, f64)>);

impl Family {
    pub fn add(&mut self, name: String, p: f64) {
        self.0.push((name, p));
    }

    /// Prints all, and fails with the names of the tests whose p-value is below their share.
    pub fn assert(&self, what: &str) {
        let level = sidak(self.0.len());
        for (name, p) in &self.0 {
            println!("p-value {what}, {name} {p:.6e}");
        }
        let least = self.0.iter().map(|t| t.1).fold(1.0, f64::min);
        let count = self.0.len();
        println!("{what}: {count} tests, least p {least:.2e}, level {level:.2e}");
        let is_failed = |t: &&(String, f64)| t.1 < level || t.1.is_nan();
        let failed: Vec<_> = self.0.iter().filter(is_failed).collect();
        assert!(failed.is_empty(), "{what}, level {level:.2e}: {failed:#?}");
    }

    /// The chance of p-values that stray as far from the uniform law as these: by Kolmogorov and Smirnov.
    pub fn uniformity(&self) -> f64 {
        let all: Vec<f64> = self.0.iter().map(|t| t.1).collect();
        kolmogorov(all, |p| p).1
    }

    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// The p-values that tests have printed.
    pub fn printed(log: &str) -> Self {
        const WORD: &str = "p-value ";
        let mut family = Self::default();
        for line in log.lines() {
            let text = line.find(WORD).map(|at| &line[at + WORD.len()..]);
            let parts = text.and_then(|t| t.rsplit_once(' '));
            if let Some((name, Ok(p))) = parts.map(|(name, p)| (name, p.parse())) {
                family.add(name.to_owned(), p);
            }
        }
        family
    }
}
