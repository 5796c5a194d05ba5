//! χ² with pooling, its tail, and Šidák's share of a false alarm.

use etendue::compare::tails::ln_gamma;

/// Chance that a correct renderer fails a test function, all its tests of chance together.
pub const FALSE_ALARM: f64 = 1e-3;

/// Cells with fewer expected counts are pooled: below, χ² is no longer near its limit law.
const MIN_EXPECTED: f64 = 5.0;

/// Level of each of `count` tests with [`FALSE_ALARM`] for all.
pub fn sidak(count: usize) -> f64 {
    -((-FALSE_ALARM).ln_1p() / count as f64).exp_m1()
}

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

/// The p-values of one test function; asserts all of them at once.
#[derive(Default)]
pub struct Family(Vec<(String, f64)>);

impl Family {
    pub fn add(&mut self, name: String, p: f64) {
        self.0.push((name, p));
    }

    /// Fails with the names of the tests whose p-value is below their share.
    pub fn assert(&self, what: &str) {
        let level = sidak(self.0.len());
        let least = self.0.iter().map(|t| t.1).fold(1.0, f64::min);
        println!(
            "{what}: {} tests, least p {least:.2e}, level {level:.2e}",
            self.0.len()
        );
        let failed: Vec<_> = self
            .0
            .iter()
            .filter(|t| t.1 < level || t.1.is_nan())
            .collect();
        assert!(failed.is_empty(), "{what}, level {level:.2e}: {failed:#?}");
    }
}

#[test]
fn tails_are_those_of_tables() {
    // Quantiles of χ² from standard tables, three decimals.
    for (x, degrees, p) in [
        (3.841, 1, 0.05),
        (18.307, 10, 0.05),
        (149.449, 100, 0.001),
        (0.207, 4, 0.995),
    ] {
        let tail = chi_square_tail(x, degrees);
        assert!(
            (tail - p).abs() < 2e-4 * p.max(0.1),
            "{x} {degrees}: {tail}"
        );
    }
    // A large number of degrees: nearly normal, three standard deviations.
    let (n, z) = (20_000.0_f64, 3.0);
    let wilson = n * (1.0 - 2.0 / (9.0 * n) + z * (2.0 / (9.0 * n)).sqrt()).powi(3);
    assert!((chi_square_tail(wilson, 20_000) - 1.3499e-3).abs() < 1e-6);
    assert!((1.0 - (1.0 - sidak(100)).powi(100) - FALSE_ALARM).abs() < 1e-12);
    // A sampler that is off by 6 % in its cells fails; a hit in an empty cell fails.
    let skewed: Vec<u32> = (0..1000)
        .map(|i| if i % 2 == 0 { 1060 } else { 940 })
        .collect();
    assert!(chi_square(&skewed, &[1e-3; 1000]) < 1e-6);
    assert!(chi_square(&[50, 50, 1], &[0.5, 0.5, 0.0]) == 0.0);
}
