//! Lines of a bench file as tables.

use etendue::chart::plain;

use super::super::bench::record::{Growth, Limit, Line, Rate, Run};
use super::panels::{self, runs};
use super::table::Table;
use super::{distinct, quantile};

/// Against whose rate those of the other traversals are held, where it was measured.
const BASE_BACKEND: &str = "ray-query";
/// Slopes of growth are fitted where the value is at least this share of the largest.
const FITTED: f64 = 0.01;

fn range((low, high): (f64, f64)) -> String {
    format!("{} to {}", plain(low), plain(high))
}

/// The runs with the most samples of each contender.
pub fn last_runs(lines: &[Line]) -> Table {
    let runs = runs(lines);
    let keys = distinct(
        runs.iter()
            .map(|r| (r.scene.as_str(), r.contender.as_str())),
    );
    let row = |&(scene, contender): &(&str, &str)| {
        let own = || {
            runs.iter()
                .filter(|r| r.scene == scene && r.contender == contender)
        };
        let spp = own().map(|r| r.spp).max().unwrap_or(0);
        let median = |f: &dyn Fn(&Run) -> f64| {
            let values: Vec<f64> = own().filter(|r| r.spp == spp).map(|r| f(r)).collect();
            plain(quantile(&values, 0.5))
        };
        let bias = lines.iter().find_map(|line| match line {
            Line::Bias(b) if b.scene == scene && b.contender == contender && b.spp == spp => {
                Some(format!("{:.1e} ± {:.1e}", b.bias2, b.bias2_error))
            }
            _ => None,
        });
        let start = lines.iter().find_map(|line| match line {
            Line::Start(s) if s.scene == scene && s.contender == contender => {
                let process = s.process.map(plain).unwrap_or_default();
                Some([process, plain(s.build), plain(s.compile)])
            }
            _ => None,
        });
        let rays = match own().all(|r| r.rays_per_second.is_some()) {
            true => median(&|r| r.rays_per_second.unwrap_or(0.0) / 1e6),
            false => String::from("–"),
        };
        let mut row = vec![scene.to_owned(), contender.to_owned(), spp.to_string()];
        row.extend(start.unwrap_or_default());
        row.extend([
            median(&|r| r.seconds),
            median(&|r| r.paths_per_second / 1e6),
            rays,
            median(&|r| r.rmse),
            format!(
                "{} ({})",
                median(&|r| r.relmse),
                median(&|r| r.relmse_trimmed)
            ),
            bias.unwrap_or_default(),
        ]);
        row
    };
    Table {
        title: "The longest runs, medians",
        head: vec![
            "scene",
            "contender",
            "samples",
            "process, s",
            "build, s",
            "compile, s",
            "render, s",
            "Mpaths/s",
            "Mrays/s",
            "RMSE",
            "relMSE (without the worst 0.1 %)",
            "relative bias²",
        ],
        texts: 2,
        rows: keys.iter().map(row).collect(),
    }
}

/// The traversals, and each against ray query in the same round.
pub fn rates(lines: &[Line]) -> Table {
    let all: Vec<&Rate> = lines
        .iter()
        .filter_map(|line| match line {
            Line::Rate(rate) => Some(rate),
            _ => None,
        })
        .collect();
    let keys = distinct(
        all.iter()
            .map(|r| (r.scene.as_str(), r.estimator.as_str(), r.backend.as_str())),
    );
    let row = |&(scene, estimator, backend): &(&str, &str, &str)| {
        let of = |backend: &str| -> Vec<(u64, f64)> {
            let own = all
                .iter()
                .filter(|r| r.scene == scene && r.estimator == estimator && r.backend == backend);
            own.map(|r| (r.round, r.rays_per_second)).collect()
        };
        let (own, base) = (of(backend), of(BASE_BACKEND));
        let rates: Vec<f64> = own.iter().map(|r| r.1 / 1e6).collect();
        let each: Vec<f64> = own
            .iter()
            .filter_map(|r| Some(r.1 / base.iter().find(|b| b.0 == r.0)?.1))
            .collect();
        let compared = !each.is_empty() && backend != BASE_BACKEND;
        let ratio = match compared {
            true => [
                plain(quantile(&each, 0.5)),
                range((quantile(&each, 0.0), quantile(&each, 1.0))),
            ],
            false => Default::default(),
        };
        let mut row = [scene, estimator, backend].map(str::to_owned).to_vec();
        row.push(plain(quantile(&rates, 0.5)));
        row.extend(ratio);
        row
    };
    Table {
        title: "Rates of the traversals",
        head: vec![
            "scene",
            "estimator",
            "traversal",
            "Mrays/s",
            "over ray query",
            "over the rounds",
        ],
        texts: 3,
        rows: keys.iter().map(row).collect(),
    }
}

/// Where the time goes, and how far the machine is from its limits.
pub fn limits(lines: &[Line]) -> Table {
    let all = panels::limit_lines(lines);
    // of what not every line has
    let median_of = |scene: &str, f: &dyn Fn(&Limit) -> Option<f64>| {
        let own = all.iter().filter(|l| l.scene == scene);
        let values: Vec<f64> = own.filter_map(|l| f(l)).collect();
        match values.is_empty() {
            true => String::from("–"),
            false => plain(quantile(&values, 0.5)),
        }
    };
    let row = |scene: &str| {
        let of = |f: &dyn Fn(&Limit) -> f64| -> Vec<f64> {
            let own = all.iter().filter(|l| l.scene == scene);
            own.map(|l| f(l)).collect()
        };
        let median = |f: &dyn Fn(&Limit) -> f64| plain(quantile(&of(f), 0.5));
        let shares = of(&|l| 100.0 * l.seconds_traversal() / l.seconds);
        let loads = |l: &Limit| l.rays_per_second * l.bytes_per_ray;
        vec![
            scene.to_owned(),
            plain(quantile(&shares, 0.5)),
            range((quantile(&shares, 0.0), quantile(&shares, 1.0))),
            median(&|l| 100.0 * l.seconds_shading / l.seconds),
            median_of(scene, &|l| Some(100.0 * l.seconds_reading? / l.seconds)),
            median(&|l| l.rays_per_second / 1e6),
            median(&|l| l.rays as f64 / l.seconds_traversal() / 1e6),
            median(&|l| l.seconds_replay / l.seconds_sorted),
            median_of(scene, &|l| l.over_ray_query()),
            median(&|l| l.nodes_per_ray),
            median(&|l| l.records_per_ray),
            median(&|l| l.bytes_per_ray),
            median(&|l| 100.0 * l.lane_use),
            median(&|l| loads(l) / 1e9),
            median(&|l| 100.0 * loads(l) / l.bandwidth),
        ]
    };
    let scenes = distinct(all.iter().map(|l| l.scene.as_str()));
    Table {
        title: "Limits of our own tree",
        head: vec![
            "scene",
            "traversal (rays alone), % of time",
            "over the rounds",
            "shading (hits known), %",
            "reading of rays, %",
            "Mrays/s",
            "Mrays/s alone",
            "sorted over unsorted",
            "own tree over ray query, rays alone",
            "nodes a ray",
            "records a ray",
            "bytes a ray",
            "lanes at work, %",
            "loads, GB/s",
            "of memory's bandwidth, %",
        ],
        texts: 1,
        rows: scenes.into_iter().map(row).collect(),
    }
}

/// Exponents: time per sample goes with value^slope over the last decades of a sweep.
pub fn slopes(lines: &[Line]) -> Table {
    let all = panels::sweeps(lines);
    let keys = distinct(all.iter().map(|g| (g.sweep.as_str(), g.backend.as_str())));
    let row = |&(sweep, backend): &(&str, &str)| {
        let own = || {
            all.iter()
                .filter(|g| g.sweep == sweep && g.backend == backend)
        };
        let most = own().map(|g| g.value).fold(0.0, f64::max);
        let values = distinct(own().map(|g| g.value).filter(|v| *v >= FITTED * most));
        let points = |f: fn(&Growth) -> f64| -> Vec<(f64, f64)> {
            let at =
                |x: f64| -> Vec<f64> { own().filter(|g| g.value == x).map(|g| f(g)).collect() };
            let of = |x: &f64| (x.ln(), quantile(&at(*x), 0.5).ln());
            values.iter().map(of).collect()
        };
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        let exponent = |points: &[(f64, f64)]| {
            slope(points).map_or(String::from("–"), |s| format!("{s:.2}"))
        };
        vec![
            sweep.to_owned(),
            backend.to_owned(),
            range((least, most)),
            exponent(&points(|g| g.seconds / g.spp as f64)),
            exponent(&points(|g| g.build)),
            exponent(&points(|g| g.bytes as f64)),
        ]
    };
    Table {
        title: "Exponents of growth",
        head: vec![
            "sweep",
            "traversal",
            "fitted over",
            "time per sample",
            "build",
            "bytes",
        ],
        texts: 2,
        rows: keys.iter().map(row).collect(),
    }
}

/// Of the straight line with the least square deviation.
fn slope(points: &[(f64, f64)]) -> Option<f64> {
    let count = points.len() as f64;
    let x = points.iter().map(|p| p.0).sum::<f64>() / count;
    let y = points.iter().map(|p| p.1).sum::<f64>() / count;
    let both: f64 = points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
    let square: f64 = points.iter().map(|p| (p.0 - x).powi(2)).sum();
    (square > 0.0).then(|| both / square)
}

/// Every step of the sweeps.
pub fn growth(lines: &[Line]) -> Table {
    let all = panels::sweeps(lines);
    let keys = distinct(all.iter().map(|g| (g.sweep.as_str(), g.value)));
    let row = |&(sweep, value): &(&str, f64)| {
        let median = |f: fn(&Growth) -> f64| {
            let own = all.iter().filter(|g| g.sweep == sweep && g.value == value);
            let values: Vec<f64> = own.map(|g| f(g)).collect();
            plain(quantile(&values, 0.5))
        };
        vec![
            sweep.to_owned(),
            plain(value),
            median(|g| 1e3 * g.seconds / g.spp as f64),
            median(|g| g.rays_per_second / 1e6),
            median(|g| g.build),
            median(|g| g.bytes as f64 / g.triangles as f64),
            median(|g| g.variance * g.seconds),
            median(|g| 100.0 * g.truncated),
        ]
    };
    Table {
        title: "Steps of growth",
        head: vec![
            "sweep",
            "value",
            "ms per sample",
            "Mrays/s",
            "build, s",
            "bytes a triangle",
            "variance × s",
            "paths cut, %",
        ],
        texts: 1,
        rows: keys.iter().map(row).collect(),
    }
}

/// What could not be measured.
pub fn skipped(lines: &[Line]) -> Table {
    let rows = lines.iter().filter_map(|line| match line {
        Line::Skipped(s) => Some(vec![s.scene.clone(), s.contender.clone(), s.reason.clone()]),
        _ => None,
    });
    Table {
        title: "Not measured",
        head: vec!["scene", "contender", "why"],
        texts: 3,
        rows: rows.collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_of_powers_are_their_exponents() {
        let power = |x: f64| (x.ln(), (3.0 * x.powf(0.25)).ln());
        let points: Vec<(f64, f64)> = [1e3, 1e4, 1e6].map(power).into();
        assert!((slope(&points).unwrap() - 0.25).abs() < 1e-12);
        assert_eq!(slope(&points[..1]), None);
    }
}
