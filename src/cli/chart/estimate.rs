//! Positive numbers that are known from a few seeds.

use etendue::chart::plain;
use etendue::tails::student_quantile;

use super::distinct;

/// Confidence of the intervals.
const CONFIDENCE: f64 = 0.95;

/// A positive number and how uncertain it is, by its logarithm.
#[derive(Clone)]
pub struct Estimate {
    ln: f64,
    /// Of seeds what the logarithm deviates by for their sake: the sum of the squares is its variance. Empty with one seed.
    parts: Vec<(u64, f64)>,
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
        let each: Option<Vec<f64>> = seeds.iter().map(without).collect();
        let each = each.filter(|_| seeds.len() > 1).unwrap_or_default();
        let count = each.len() as f64;
        let mean = each.iter().sum::<f64>() / count;
        let part = |ln: &f64| (ln - mean) * ((count - 1.0) / count).sqrt();
        Some(Self {
            ln: ln(seeds)?,
            parts: seeds.iter().copied().zip(each.iter().map(part)).collect(),
            degrees: count - 1.0,
        })
    }

    /// Geometric mean; None of none. What scenes have of one seed goes together, since they may be much alike.
    pub fn geometric_mean(all: &[Self]) -> Option<Self> {
        let count = all.len() as f64;
        let known = all.iter().all(|e| !e.parts.is_empty());
        let parts = all.iter().filter(|_| known).flat_map(|e| &e.parts);
        let seeds = distinct(parts.clone().map(|part| part.0));
        let of = |seed| {
            parts
                .clone()
                .filter(move |part| part.0 == seed)
                .map(|p| p.1)
        };
        let variances: f64 = all.iter().map(Self::variance).sum();
        let degrees: f64 = all.iter().map(|e| e.variance() * e.degrees).sum();
        (!all.is_empty()).then(|| Self {
            ln: all.iter().map(|e| e.ln).sum::<f64>() / count,
            parts: seeds
                .into_iter()
                .map(|seed| (seed, of(seed).sum::<f64>() / count))
                .collect(),
            degrees: degrees / variances,
        })
    }

    fn variance(&self) -> f64 {
        self.parts.iter().map(|part| part.1 * part.1).sum()
    }

    pub fn value(&self) -> f64 {
        self.ln.exp()
    }

    /// The 95 % interval by Student's t; empty with one seed.
    pub fn interval(&self) -> String {
        if self.parts.is_empty() {
            return String::new();
        }
        let half = match self.variance() {
            0.0 => 0.0,
            variance => student_quantile(1.0 - CONFIDENCE, self.degrees) * variance.sqrt(),
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
        assert!((estimate.variance() - 0.125).abs() < 1e-12);
        assert_eq!(estimate.degrees, 4.0);
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
    fn means_of_what_has_other_seeds_are_less_uncertain() {
        let one = Estimate::new(&[1, 2, 3, 4, 5], mean).unwrap();
        let shifted = |by: u64| {
            let seeds = [1, 2, 3, 4, 5].map(|s| s + by);
            Estimate::new(&seeds, |some| {
                mean(&some.iter().map(|s| s - by).collect::<Vec<_>>())
            })
        };
        let others: Vec<Estimate> = (0..4).map(|k| shifted(10 * k).unwrap()).collect();
        for (all, share) in [(vec![one.clone(); 4], 1.0), (others, 0.25)] {
            let four = Estimate::geometric_mean(&all).unwrap();
            assert!((four.variance() - share * one.variance()).abs() < 1e-12);
            assert!((four.degrees - 4.0).abs() < 1e-9);
        }
        assert!(Estimate::geometric_mean(&[]).is_none());
        let single = Estimate::new(&[4], mean).unwrap();
        let mixed = Estimate::geometric_mean(&[one, single]).unwrap();
        assert_eq!(mixed.interval(), "");
    }
}
