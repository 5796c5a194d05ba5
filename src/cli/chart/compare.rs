//! Time to equal error: how many times as fast one contender is as another.

use super::super::bench::record::{Agreement, Line, Run};
use super::estimate::Estimate;
use super::panels::runs;
use super::{distinct, quantile};

/// What another contender needs, as a multiple of what the base does.
#[derive(Clone)]
pub struct Ratio {
    /// Time to the relMSE that both reach, in the mean over the seeds.
    pub time: Estimate,
    /// The same with everything before the first sample on both sides: start of the process, building, compiling.
    pub with_start: Option<f64>,
    /// The same for the errors of one seed at a time: median, least and greatest.
    pub seeds: [f64; 3],
    /// Squared error × time with the most samples.
    pub work: Estimate,
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
            let of = |name: &str| -> Vec<&Run> {
                let all = runs.iter().copied();
                all.filter(|r| r.scene == scene && r.contender == name)
                    .collect()
            };
            let starts = before(lines, scene, base).zip(before(lines, scene, other));
            if let Some(ratio) = ratio(&of(base), &of(other), starts) {
                found.push((scene.to_owned(), other.to_owned(), ratio));
            }
        }
    }
    found
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
            Some(other) if other.3.time.value() <= ratio.time.value() => {}
            Some(other) => (other.2, other.3) = (contender.clone(), ratio.clone()),
            None => found.push((
                scene.clone(),
                peer.to_owned(),
                contender.clone(),
                ratio.clone(),
            )),
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

/// Of the runs of two contenders on one scene; `starts` are the seconds before. None without a seed that both have.
fn ratio(base: &[&Run], other: &[&Run], starts: Option<(f64, f64)>) -> Option<Ratio> {
    let has = |runs: &[&Run], seed| runs.iter().any(|r| r.seed == seed);
    let mut seeds = distinct(base.iter().map(|r| r.seed));
    seeds.retain(|seed| has(other, *seed));
    let both = |some: &[u64]| times(&curve(base, some), &curve(other, some));
    let (a, b) = both(&seeds)?;
    let each = seeds.iter().filter_map(|seed| both(&[*seed]));
    let each: Vec<f64> = each.map(|(a, b)| b / a).collect();
    Some(Ratio {
        time: Estimate::new(&seeds, |some| both(some).map(|(a, b)| b / a))?,
        with_start: starts.map(|s| (b + s.1) / (a + s.0)),
        seeds: [0.5, 0.0, 1.0].map(|share| quantile(&each, share)),
        work: Estimate::new(&seeds, |some| Some(work(other, some) / work(base, some)))?,
    })
}

/// (seconds, relMSE) with each number of samples: the median of the seconds, which other work on the machine
/// disturbs at times, and the mean of the errors, which is what relMSE estimates.
fn curve(runs: &[&Run], seeds: &[u64]) -> Vec<(f64, f64)> {
    let levels = distinct(runs.iter().map(|r| r.spp)).into_iter();
    levels
        .map(|spp| level(runs, seeds, spp, |r| r.relmse))
        .collect()
}

/// Squared error × time with the most samples.
fn work(runs: &[&Run], seeds: &[u64]) -> f64 {
    let most = runs.iter().map(|r| r.spp).max().unwrap_or(0);
    let (seconds, square) = level(runs, seeds, most, |r| r.rmse * r.rmse);
    seconds * square
}

/// Median of the seconds and mean of the errors of the runs with so many samples.
fn level(runs: &[&Run], seeds: &[u64], spp: u64, error: fn(&Run) -> f64) -> (f64, f64) {
    let own = runs
        .iter()
        .filter(|r| r.spp == spp && seeds.contains(&r.seed));
    let seconds: Vec<f64> = own.clone().map(|r| r.seconds).collect();
    let errors: f64 = own.map(|r| error(r)).sum();
    (quantile(&seconds, 0.5), errors / seconds.len() as f64)
}

/// Seconds of `base` and of `other` to the larger of their last errors. Curves are (seconds, relMSE).
fn times(base: &[(f64, f64)], other: &[(f64, f64)]) -> Option<(f64, f64)> {
    let (a, b) = (base.last()?, other.last()?);
    match a.1 > b.1 {
        true => Some((a.0, time(other, a.1)?)),
        false => Some((time(base, b.1)?, b.0)),
    }
}

/// Seconds after which the error stays below `target`, as the last one does: between two points on a straight line in
/// logarithms; where even the first point is better, by the law that error² × time is constant.
fn time(curve: &[(f64, f64)], target: f64) -> Option<f64> {
    let logs = |p: (f64, f64)| (p.0.ln(), p.1.ln());
    let time = match curve.windows(2).rev().find(|pair| pair[0].1 > target) {
        Some(pair) => {
            let ((t0, e0), (t1, e1)) = (logs(pair[0]), logs(pair[1]));
            (t0 + (t1 - t0) * (target.ln() - e0) / (e1 - e0)).exp()
        }
        None => curve.first().map(|first| first.0 * first.1 / target)?,
    };
    (time.is_finite() && time > 0.0).then_some(time)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(spp: u64, seed: u64, seconds: f64, relmse: f64) -> Run {
        Run {
            scene: String::from("s"),
            contender: String::from("c"),
            spp,
            seed,
            seconds,
            paths_per_second: 0.0,
            rays_per_second: None,
            rmse: relmse.sqrt(),
            relmse,
            relmse_trimmed: relmse,
            mean: [0.0; 3],
        }
    }

    fn compared(base: &[Run], other: &[Run], starts: Option<(f64, f64)>) -> Ratio {
        let (base, other): (Vec<_>, Vec<_>) = (base.iter().collect(), other.iter().collect());
        ratio(&base, &other, starts).unwrap()
    }

    #[test]
    fn what_comes_before_counts_where_it_is_asked_for() {
        let of = |seconds: f64| -> Vec<Run> { (1..4).map(|s| run(1, s, seconds, 0.1)).collect() };
        let with = compared(&of(1.0), &of(3.0), Some((0.5, 6.0)));
        assert!((with.time.value() - 3.0).abs() < 1e-12);
        assert_eq!(with.with_start, Some(6.0));
        assert_eq!(compared(&of(1.0), &of(3.0), None).with_start, None);
    }

    #[test]
    fn a_contender_twice_as_fast_is_twice_as_fast() {
        let slow: Vec<(f64, f64)> = (0..5).map(|i| (2f64.powi(i), 2f64.powi(-i))).collect();
        let fast: Vec<(f64, f64)> = slow.iter().map(|(t, e)| (t / 2.0, *e)).collect();
        let ratio = |base, other| times(base, other).map(|(a, b)| b / a).unwrap();
        assert!((ratio(&fast, &slow) - 2.0).abs() < 1e-12);
        assert!((ratio(&slow, &fast) - 0.5).abs() < 1e-12);
        // the same, with samples that reach elsewhere
        assert!((ratio(&fast[..3], &slow[1..]) - 2.0).abs() < 1e-12);
        // a lucky start does not count
        let lucky = [(1.0, 1e-3), (2.0, 0.5), (4.0, 0.25)];
        assert!((ratio(&lucky, &slow) - 1.0).abs() < 1e-12);
        assert!((ratio(&slow, &lucky) - 1.0).abs() < 1e-12);
        // even one sample is better than all that the other reaches
        let good = [(1.0, 1e-3), (2.0, 5e-4)];
        assert!((ratio(&good, &slow) - 16.0 / (1e-3 * 16.0)).abs() < 1e-9);
    }

    #[test]
    fn a_rare_bright_sample_counts_in_the_mean_and_not_in_the_median() {
        // one seed of five has a hundred times the error of the others: 0.01 becomes 0.208 in the mean
        let lucky = |seed: u64| if seed == 3 { 1.0 } else { 0.01 };
        let rare: Vec<Run> = (1..6).map(|s| run(8, s, 1.0, lucky(s))).collect();
        let even: Vec<Run> = (1..6).map(|s| run(8, s, 1.0, 0.01)).collect();
        let ratio = compared(&even, &rare, None);
        assert!((ratio.time.value() - 20.8).abs() < 1e-9);
        assert!((ratio.work.value() - 20.8).abs() < 1e-9);
        assert!((ratio.seeds[0] - 1.0).abs() < 1e-9);
        assert!((ratio.seeds[2] - 100.0).abs() < 1e-9);
    }

    #[test]
    fn seeds_that_one_of_them_lacks_are_left_out() {
        let base: Vec<Run> = (1..4).map(|s| run(1, s, 1.0, 0.1)).collect();
        let other = [run(1, 2, 2.0, 0.1), run(1, 9, 50.0, 7.0)];
        let ratio = compared(&base, &other, None);
        assert!((ratio.time.value() - 2.0).abs() < 1e-12);
        assert_eq!(ratio.time.interval(), "");
    }
}
