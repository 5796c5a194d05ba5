//! Contenders against each other, as tables.

use etendue::chart::plain;

use super::super::bench::record::Line;
use super::compare::{Ratio, best as best_of, disagrees, ratios, renderer};
use super::distinct;
use super::estimate::Estimate;
use super::panels::runs;
use super::table::Table;

/// Whom the others are compared with.
const BASE: &str = "etendue full";

/// Time to equal error: the value with its interval, seed by seed, with start-up.
fn times(r: &Ratio) -> [String; 4] {
    let [median, least, greatest] = r.seeds.map(plain);
    [
        plain(r.time.value()),
        r.time.interval(),
        format!("{median} ({least} to {greatest})"),
        r.with_start.map(plain).unwrap_or_default(),
    ]
}

/// Geometric means of the same, and the least of the values.
fn mean_times(all: &[&Ratio]) -> Option<([String; 4], f64)> {
    let times: Vec<Estimate> = all.iter().map(|r| r.time.clone()).collect();
    let mean = Estimate::geometric_mean(&times)?;
    let with: Option<Vec<f64>> = all.iter().map(|r| r.with_start).collect();
    let medians: Vec<f64> = all.iter().map(|r| r.seeds[0]).collect();
    let cells = [
        plain(mean.value()),
        mean.interval(),
        plain(geometric_mean(&medians)),
        with.map(|w| plain(geometric_mean(&w))).unwrap_or_default(),
    ];
    let values = times.iter().map(Estimate::value);
    Some((cells, values.fold(f64::INFINITY, f64::min)))
}

fn geometric_mean(values: &[f64]) -> f64 {
    let logs: f64 = values.iter().map(|v| v.ln()).sum();
    (logs / values.len() as f64).exp()
}

/// Every peer on every scene, by its best contender.
pub fn best(lines: &[Line]) -> Table {
    let all = ratios(lines, BASE);
    let found = best_of(lines, &all);
    let scenes = distinct(runs(lines).into_iter().map(|r| r.scene.as_str()));
    let starts = lines.iter().filter_map(|line| match line {
        Line::Start(s) => s.renderer.as_deref(),
        _ => None,
    });
    let mut rows = Vec::new();
    for peer in distinct(starts).into_iter().filter(|r| *r != "etendue") {
        for scene in &scenes {
            let own = found.iter().find(|f| f.0 == *scene && f.1 == peer);
            let (way, cells) = match own {
                Some((_, _, contender, r)) => {
                    let way = contender.strip_prefix(peer).unwrap_or(contender).trim();
                    (way.to_owned(), times(r))
                }
                None => (without(lines, scene, peer), Default::default()),
            };
            let mut row = vec![peer.to_owned(), (*scene).to_owned(), way];
            row.extend(cells);
            rows.push(row);
        }
        let own: Vec<&Ratio> = found.iter().filter(|f| f.1 == peer).map(|f| &f.3).collect();
        if let Some((cells, least)) = mean_times(&own) {
            let count = format!("geometric mean of {}", own.len());
            let mut row = vec![peer.to_owned(), count, format!("least {}", plain(least))];
            row.extend(cells);
            rows.push(row);
        }
    }
    Table {
        title: "Peers at their best: time to equal relMSE as a multiple of that of etendue full",
        head: vec![
            "renderer",
            "scene",
            "its best way",
            "its time over ours",
            "95 % interval",
            "seed by seed",
            "with start-up",
        ],
        texts: 3,
        rows,
    }
}

/// Why a peer is not compared on a scene.
fn without(lines: &[Line], scene: &str, peer: &str) -> String {
    let reason = lines.iter().find_map(|line| match line {
        Line::Skipped(s) if s.scene == scene && s.contender == peer => Some(&s.reason),
        _ => None,
    });
    match reason {
        Some(reason) => format!("not expressed: {reason}"),
        None if renders(lines, scene, peer) => String::from("not compared: no agreement"),
        None => String::from("not measured"),
    }
}

/// Whether a peer has runs of a scene.
fn renders(lines: &[Line], scene: &str, peer: &str) -> bool {
    let mut all = runs(lines).into_iter();
    all.any(|r| r.scene == scene && renderer(lines, &r.contender) == peer)
}

/// Time to equal error against the full estimator, for every contender.
pub fn equal_error(lines: &[Line]) -> Table {
    let ratios = ratios(lines, BASE);
    let mut rows: Vec<Vec<String>> = Vec::new();
    let scenes = distinct(runs(lines).into_iter().map(|r| r.scene.as_str()));
    let names = distinct(runs(lines).into_iter().map(|r| r.contender.as_str()));
    for scene in scenes {
        for name in names.iter().filter(|n| **n != BASE) {
            let mut row = vec![scene.to_owned(), (*name).to_owned()];
            if let Some(a) = disagrees(lines, scene, name) {
                let percent = plain(100.0 * a.difference);
                let error = plain(100.0 * a.error);
                row.push(format!("not compared: mean off by {percent} ± {error} %"));
                row.resize(8, String::new());
            } else if let Some((_, _, r)) = ratios.iter().find(|r| r.0 == scene && r.1 == *name) {
                row.extend(times(r));
                row.extend([plain(r.work.value()), r.work.interval()]);
            } else {
                continue;
            }
            rows.push(row);
        }
    }
    for name in names {
        let own: Vec<&Ratio> = ratios
            .iter()
            .filter(|r| r.1 == name)
            .map(|r| &r.2)
            .collect();
        let works: Vec<Estimate> = own.iter().map(|r| r.work.clone()).collect();
        let work = Estimate::geometric_mean(&works);
        if let Some(((cells, _), work)) = mean_times(&own).zip(work) {
            let scenes = format!("geometric mean of {}", own.len());
            let mut row = vec![scenes, name.to_owned()];
            row.extend(cells);
            row.extend([plain(work.value()), work.interval()]);
            rows.push(row);
        }
    }
    Table {
        title: "Time to equal relMSE, as a multiple of that of etendue full",
        head: vec![
            "scene",
            "contender",
            "its time over ours",
            "95 % interval",
            "seed by seed",
            "with start-up",
            "squared error × time over ours",
            "95 % interval",
        ],
        texts: 2,
        rows,
    }
}
