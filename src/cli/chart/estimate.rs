//! Positive numbers that are known from a few seeds.

use etendue::chart::plain;
use etendue::tails::student_quantile;

/// Confidence of the intervals.
const CONFIDENCE: f64 = 0.95;

/// A positive number and how uncertain it is, by its logarithm.
#[derive(Clone, Copy)]
pub struct Estimate {
    ln: f64,
    spread: Option<Spread>,
}

#[derive(Clone, Copy)]
struct Spread {
    /// Of the logarithm.
    variance: f64,
    degrees: f64,
}

impl Estimate {
    /// What `of` makes of all seeds; its uncertainty by leaving out one seed at a time \[Efron81\]. None where it makes
    /// nothing of them.
    pub fn new(seeds: &[u64], of: impl Fn(&[u64]) -> Option<f64>) -> Option<Self> {
        let ln = |some: &[u64]| Some(of(some)?.ln()).filter(|ln| ln.is_finite());
        let without = |seed: &u64| {
            let others: Vec<u64> = seeds.iter().copied().filter(|s| s != seed).collect();
            ln(&others)
        };
        let count = seeds.len() as f64;
        let spread = |each: Vec<f64>| {
            let mean = each.iter().sum::<f64>() / count;
            let squares: f64 = each.iter().map(|ln| (ln - mean).powi(2)).sum();
            Spread {
                variance: (count - 1.0) / count * squares,
                degrees: count - 1.0,
            }
        };
        let each: Option<Vec<f64>> = seeds.iter().map(without).collect();
        Some(Self {
            ln: ln(seeds)?,
            spread: each.filter(|_| seeds.len() > 1).map(spread),
        })
    }

    /// Geometric mean of independent numbers; None of none.
    pub fn geometric_mean(all: &[Self]) -> Option<Self> {
        let count = all.len() as f64;
        let spreads: Option<Vec<Spread>> = all.iter().map(|e| e.spread).collect();
        // degrees of freedom by Welch and Satterthwaite
        let spread = |spreads: Vec<Spread>| {
            let sum: f64 = spreads.iter().map(|s| s.variance).sum();
            let squares = spreads.iter().map(|s| s.variance.powi(2) / s.degrees);
            Spread {
                variance: sum / (count * count),
                degrees: sum * sum / squares.sum::<f64>(),
            }
        };
        (!all.is_empty()).then(|| Self {
            ln: all.iter().map(|e| e.ln).sum::<f64>() / count,
            spread: spreads.map(spread),
        })
    }

    pub fn value(self) -> f64 {
        self.ln.exp()
    }

    /// The 95 % interval by Student's t; empty with one seed.
    pub fn interval(self) -> String {
        let Some(spread) = self.spread else {
            return String::new();
        };
        let half = match spread.variance > 0.0 {
            true => student_quantile(1.0 - CONFIDENCE, spread.degrees) * spread.variance.sqrt(),
            false => 0.0,
        };
        let (low, high) = (self.ln - half, self.ln + half);
        format!("{} to {}", plain(low.exp()), plain(high.exp()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers of seeds 1 to 5, and their mean.
    const NUMBERS: [f64; 5] = [1.0, 1.5, 2.0, 2.5, 3.0];

    fn mean(seeds: &[u64]) -> Option<f64> {
        let sum: f64 = seeds.iter().map(|s| NUMBERS[*s as usize - 1]).sum();
        Some(sum / seeds.len() as f64)
    }

    #[test]
    fn leaving_out_seeds_gives_the_standard_error_of_a_mean() {
        // exp undoes the logarithm: the jackknife of a mean is its usual standard error, here √(0.625/5)
        let estimate = Estimate::new(&[1, 2, 3, 4, 5], |some| mean(some).map(f64::exp)).unwrap();
        let spread = estimate.spread.unwrap();
        assert!((spread.variance - 0.125).abs() < 1e-12);
        assert_eq!(spread.degrees, 4.0);
        // t of four degrees of freedom in tables: 2.776
        let half = 2.776 * 0.125_f64.sqrt();
        let ends = [2.0 - half, 2.0 + half].map(|x| plain(x.exp()));
        assert_eq!(estimate.interval(), format!("{} to {}", ends[0], ends[1]));
    }

    #[test]
    fn one_seed_tells_no_interval() {
        let estimate = Estimate::new(&[4], mean).unwrap();
        assert!((estimate.value() - 2.5).abs() < 1e-12);
        assert_eq!(estimate.interval(), "");
        assert!(Estimate::new(&[], mean).is_none());
    }

    #[test]
    fn a_mean_of_four_is_half_as_uncertain() {
        let one = Estimate::new(&[1, 2, 3, 4, 5], mean).unwrap();
        let four = Estimate::geometric_mean(&[one; 4]).unwrap();
        let (one, four) = (one.spread.unwrap(), four.spread.unwrap());
        assert!((four.variance - one.variance / 4.0).abs() < 1e-12);
        assert!((four.degrees - 16.0).abs() < 1e-9);
        assert!(Estimate::geometric_mean(&[]).is_none());
    }
}
