//! Time to equal error: how many times as fast one contender is as another.

use super::super::bench::record::{Agreement, Line, Run};
use super::panels::runs;
use super::{distinct, quantile};

/// How many times as long another contender takes for the error that both reach.
pub struct Ratio {
    /// Median over the seeds' pairs of curves.
    pub median: f64,
    /// Least and greatest of them.
    pub range: (f64, f64),
}

/// Contenders compared with `base` on every scene: (scene, contender, ratio).
pub fn ratios(lines: &[Line], base: &str) -> Vec<(String, String, Ratio)> {
    let runs = runs(lines);
    let mut found = Vec::new();
    for scene in distinct(runs.iter().map(|r| r.scene.as_str())) {
        for other in distinct(runs.iter().map(|r| r.contender.as_str())) {
            if other == base || disagrees(lines, scene, other).is_some() {
                continue;
            }
            let of = |name: &str, seed: u64| -> Vec<(f64, f64)> {
                let own = runs
                    .iter()
                    .filter(|r| r.scene == scene && r.contender == name && r.seed == seed);
                own.map(|r| (r.seconds, r.relmse)).collect()
            };
            let seeds = distinct(runs.iter().map(|r: &&Run| r.seed));
            let each = seeds.into_iter().filter_map(|seed| {
                let (a, b) = (of(base, seed), of(other, seed));
                ratio(&a, &b)
            });
            let each: Vec<f64> = each.collect();
            if !each.is_empty() {
                found.push((scene.to_owned(), other.to_owned(), summary(&each)));
            }
        }
    }
    found
}

/// The geometric means over the scenes: (contender, scenes, mean).
pub fn means(ratios: &[(String, String, Ratio)]) -> Vec<(String, usize, f64)> {
    let names = distinct(ratios.iter().map(|r| r.1.as_str()));
    let mean = |name: &str| {
        let own = ratios.iter().filter(|r| r.1 == name);
        let logs: Vec<f64> = own.map(|r| r.2.median.ln()).collect();
        let mean = (logs.iter().sum::<f64>() / logs.len() as f64).exp();
        (name.to_owned(), logs.len(), mean)
    };
    names.into_iter().map(mean).collect()
}

/// The agreement line of a peer whose pictures are not ours.
pub fn disagrees<'a>(lines: &'a [Line], scene: &str, contender: &str) -> Option<&'a Agreement> {
    lines.iter().find_map(|line| match line {
        Line::Agreement(a) if !a.agrees && a.scene == scene && a.contender == contender => Some(a),
        _ => None,
    })
}

fn summary(each: &[f64]) -> Ratio {
    Ratio {
        median: quantile(each, 0.5),
        range: (quantile(each, 0.0), quantile(each, 1.0)),
    }
}

/// Time of `other` over that of `base` at the larger of their last errors. Curves are (seconds, relMSE).
fn ratio(base: &[(f64, f64)], other: &[(f64, f64)]) -> Option<f64> {
    let target = base.last()?.1.max(other.last()?.1);
    Some(time(other, target)? / time(base, target)?)
}

/// Seconds to an error: between two points on a straight line in logarithms; where even the first point is
/// better, by the law that error² × time is constant.
fn time(curve: &[(f64, f64)], target: f64) -> Option<f64> {
    let first = curve.first()?;
    if first.1 <= target {
        return Some(first.0 * first.1 / target).filter(|t| *t > 0.0);
    }
    let pair = curve.windows(2).find(|pair| pair[1].1 <= target)?;
    let logs = |p: (f64, f64)| (p.0.ln(), p.1.ln());
    let ((t0, e0), (t1, e1)) = (logs(pair[0]), logs(pair[1]));
    let time = (t0 + (t1 - t0) * (target.ln() - e0) / (e1 - e0)).exp();
    time.is_finite().then_some(time)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_contender_twice_as_fast_is_twice_as_fast() {
        let slow: Vec<(f64, f64)> = (0..5).map(|i| (2f64.powi(i), 2f64.powi(-i))).collect();
        let fast: Vec<(f64, f64)> = slow.iter().map(|(t, e)| (t / 2.0, *e)).collect();
        assert!((ratio(&fast, &slow).unwrap() - 2.0).abs() < 1e-12);
        assert!((ratio(&slow, &fast).unwrap() - 0.5).abs() < 1e-12);
        // the same, with samples that reach elsewhere
        assert!((ratio(&fast[..3], &slow[1..]).unwrap() - 2.0).abs() < 1e-12);
        // even one sample is better than all that the other reaches
        let good = [(1.0, 1e-3), (2.0, 5e-4)];
        let ratio = ratio(&good, &slow).unwrap();
        assert!((ratio - 16.0 / (1e-3 * 16.0)).abs() < 1e-9, "{ratio}");
    }
}
