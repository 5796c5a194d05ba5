//! Time to equal error: how many times as fast one contender is as another.

use super::super::bench::record::{Agreement, Line, Run};
use super::panels::runs;
use super::{distinct, quantile};

/// How many times as long another contender takes for the error that both reach.
#[derive(Clone, Copy)]
pub struct Ratio {
    /// Median over the seeds' pairs of curves.
    pub median: f64,
    /// Least and greatest of them.
    pub range: (f64, f64),
    /// Median with everything before the first sample on both sides: start of the process, building, compiling.
    pub with_start: Option<f64>,
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
                times(&a, &b)
            });
            let each: Vec<(f64, f64)> = each.collect();
            if !each.is_empty() {
                let starts = before(lines, scene, base).zip(before(lines, scene, other));
                found.push((scene.to_owned(), other.to_owned(), summary(&each, starts)));
            }
        }
    }
    found
}

/// Geometric means: of (name, ratio) the name, how many there are, and the mean.
pub fn means<'a>(
    ratios: impl Iterator<Item = (&'a str, f64)> + Clone,
) -> Vec<(&'a str, usize, f64)> {
    let names = distinct(ratios.clone().map(|r| r.0));
    let mean = |name| {
        let logs: Vec<f64> = ratios
            .clone()
            .filter(|r| r.0 == name)
            .map(|r| r.1.ln())
            .collect();
        let mean = (logs.iter().sum::<f64>() / logs.len() as f64).exp();
        (name, logs.len(), mean)
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

/// Whose way to render a contender is; itself where the file does not tell.
pub fn renderer<'a>(lines: &'a [Line], contender: &'a str) -> &'a str {
    let told = lines.iter().find_map(|line| match line {
        Line::Start(s) if s.contender == contender => s.renderer.as_deref(),
        _ => None,
    });
    told.unwrap_or(contender)
}

/// Of each scene and peer the contender that needs least time: the peer at its best.
pub fn best(
    lines: &[Line],
    ratios: &[(String, String, Ratio)],
) -> Vec<(String, String, String, Ratio)> {
    let mut found: Vec<(String, String, String, Ratio)> = Vec::new();
    for (scene, contender, ratio) in ratios {
        let peer = renderer(lines, contender);
        if peer == "etendue" {
            continue;
        }
        match found.iter_mut().find(|f| f.0 == *scene && f.1 == peer) {
            Some(other) if other.3.median <= ratio.median => {}
            Some(other) => (other.2, other.3) = (contender.clone(), *ratio),
            None => found.push((scene.clone(), peer.to_owned(), contender.clone(), *ratio)),
        }
    }
    found
}

/// Seconds before the first sample, from the start of the process.
fn before(lines: &[Line], scene: &str, contender: &str) -> Option<f64> {
    lines.iter().find_map(|line| match line {
        Line::Start(s) if s.scene == scene && s.contender == contender => {
            Some(s.process? + s.build + s.compile)
        }
        _ => None,
    })
}

/// Of pairs (base, other) of seconds to one error; `starts` are the seconds before.
fn summary(each: &[(f64, f64)], starts: Option<(f64, f64)>) -> Ratio {
    let of = |(a, b): (f64, f64)| each.iter().map(|t| (t.1 + b) / (t.0 + a)).collect();
    let plain: Vec<f64> = of((0.0, 0.0));
    Ratio {
        median: quantile(&plain, 0.5),
        range: (quantile(&plain, 0.0), quantile(&plain, 1.0)),
        with_start: starts.map(|s| quantile(&of(s), 0.5)),
    }
}

/// Seconds of `base` and of `other` to the larger of their last errors. Curves are (seconds, relMSE).
fn times(base: &[(f64, f64)], other: &[(f64, f64)]) -> Option<(f64, f64)> {
    let target = base.last()?.1.max(other.last()?.1);
    Some((time(base, target)?, time(other, target)?))
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

    fn ratio(base: &[(f64, f64)], other: &[(f64, f64)]) -> Option<f64> {
        times(base, other).map(|(a, b)| b / a)
    }

    #[test]
    fn what_comes_before_counts_where_it_is_asked_for() {
        let each = [(1.0, 4.0), (1.0, 3.0), (1.0, 2.0)];
        let ratio = summary(&each, Some((0.5, 6.0)));
        assert_eq!((ratio.median, ratio.range), (3.0, (2.0, 4.0)));
        assert_eq!(ratio.with_start, Some(6.0));
        assert_eq!(summary(&each, None).with_start, None);
    }

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
