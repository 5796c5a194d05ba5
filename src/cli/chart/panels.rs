//! Lines of a bench file as panels of charts.

use etendue::chart::{Axis, Bar, Bars, Curve, Panel, Plot, Point};

use super::super::bench::record::{Growth, Limit, Line, Rate, Run};
use super::compare::disagrees;
use super::{distinct, quantile};

/// Ends of the bands, as shares of the seeds.
const BAND: (f64, f64) = (0.05, 0.95);

pub fn runs(lines: &[Line]) -> Vec<&Run> {
    let mut found = Vec::new();
    for line in lines {
        if let Line::Run(run) = line {
            found.push(run);
        }
    }
    found
}

/// What the panels do not say themselves.
pub fn note(lines: &[Line]) -> String {
    let machine = lines.iter().find_map(|line| match line {
        Line::Machine(machine) => Some(machine),
        _ => None,
    });
    let place = machine.map(|m| format!("{}, {} cores. ", m.device, m.cores));
    format!(
        "{}Errors: root of the mean relMSE; all else medians. Bands and whiskers: 5 to 95 % of the seeds.",
        place.unwrap_or_default()
    )
}

/// A panel for each scene: error over seconds.
pub fn errors(lines: &[Line]) -> Vec<Panel> {
    let runs = runs(lines);
    // named in one order in all panels, so that the legend keeps it
    let contenders = distinct(runs.iter().map(|r| r.contender.as_str()));
    let panel = |scene: &str| {
        let curve = |contender: &&str| {
            let of = |r: &&&Run| r.scene == scene && r.contender == *contender;
            let own: Vec<&&Run> = runs.iter().filter(of).collect();
            let points = distinct(own.iter().map(|r| r.spp)).into_iter().map(|spp| {
                let at = |f: fn(&Run) -> f64| -> Vec<f64> {
                    let level = own.iter().filter(|r| r.spp == spp);
                    level.map(|r| f(r)).collect()
                };
                let errors = at(|r| r.relmse.sqrt());
                let squares = at(|r| r.relmse);
                Point {
                    x: quantile(&at(|r| r.seconds), 0.5),
                    y: (squares.iter().sum::<f64>() / squares.len() as f64).sqrt(),
                    low: quantile(&errors, BAND.0),
                    high: quantile(&errors, BAND.1),
                }
            });
            Curve {
                name: (*contender).to_owned(),
                is_dashed: disagrees(lines, scene, contender).is_some(),
                points: points.collect(),
            }
        };
        let curves: Vec<Curve> = contenders.iter().map(curve).collect();
        Panel::Plot(Plot {
            title: scene.to_owned(),
            x: Axis::log10("seconds"),
            y: Axis::log10("√relMSE"),
            curves: curves
                .into_iter()
                .filter(|c| !c.points.is_empty())
                .collect(),
            slope: Some(-0.5),
        })
    };
    let scenes = distinct(runs.iter().map(|r| r.scene.as_str()));
    scenes.into_iter().map(panel).collect()
}

/// The backend, and the estimator where it is not the full one.
fn rate_name(rate: &Rate) -> String {
    match rate.estimator.as_str() {
        "full" => rate.backend.clone(),
        estimator => format!("{}, {estimator}", rate.backend),
    }
}

/// Bars of paths and of rays a second for each scene, backend and estimator.
pub fn rates(lines: &[Line]) -> Vec<Panel> {
    let rates: Vec<&Rate> = lines
        .iter()
        .filter_map(|line| match line {
            Line::Rate(rate) => Some(rate),
            _ => None,
        })
        .collect();
    if rates.is_empty() {
        return Vec::new();
    }
    let panel = |title: &str, value: fn(&Rate) -> f64| {
        let keys = distinct(rates.iter().map(|r| (r.scene.as_str(), rate_name(r))));
        let scenes = distinct(keys.iter().map(|k| k.0));
        let keys = scenes
            .iter()
            .flat_map(|scene| keys.iter().filter(move |k| k.0 == *scene));
        let bars = keys.map(|(scene, name)| {
            let own = rates
                .iter()
                .filter(|r| r.scene == *scene && rate_name(r) == *name);
            let values: Vec<f64> = own.map(|r| value(r) / 1e6).collect();
            Bar {
                group: (*scene).to_owned(),
                name: name.clone(),
                value: quantile(&values, 0.5),
                low: quantile(&values, BAND.0),
                high: quantile(&values, BAND.1),
            }
        });
        Panel::Bars(Bars {
            title: title.to_owned(),
            bars: bars.collect(),
            is_stacked: false,
        })
    };
    vec![
        panel("million paths a second", |r| r.paths_per_second),
        panel("million rays a second", |r| r.rays_per_second),
    ]
}

pub fn limit_lines(lines: &[Line]) -> Vec<&Limit> {
    let all = lines.iter().filter_map(|line| match line {
        Line::Limit(limit) => Some(limit),
        _ => None,
    });
    all.collect()
}

/// Parts of the time of a render that are measured by themselves, and the share of each.
type Part = (&'static str, fn(&Limit) -> f64);
const PARTS: [Part; 2] = [
    ("traversal: its rays alone", |l| {
        l.seconds_traversal() / l.seconds
    }),
    ("shading: what rays meet is known", |l| {
        l.seconds_shading / l.seconds
    }),
];

/// How traversal and shading share the time of our own tree.
pub fn limits(lines: &[Line]) -> Vec<Panel> {
    let all = limit_lines(lines);
    if all.is_empty() {
        return Vec::new();
    }
    let mut bars = Vec::new();
    for scene in distinct(all.iter().map(|l| l.scene.as_str())) {
        for (name, share) in PARTS {
            let own = all.iter().filter(|l| l.scene == scene);
            let shares: Vec<f64> = own.map(|l| 100.0 * share(l)).collect();
            bars.push(Bar {
                group: scene.to_owned(),
                name: name.to_owned(),
                value: quantile(&shares, 0.5),
                low: quantile(&shares, BAND.0),
                high: quantile(&shares, BAND.1),
            });
        }
    }
    vec![Panel::Bars(Bars {
        title: String::from("% of the time with our own tree"),
        bars,
        is_stacked: true,
    })]
}

/// What a panel of a sweep shows: title, its vertical axis, the value.
type View = (&'static str, &'static str, fn(&Growth) -> f64);

fn time_per_sample(growth: &Growth) -> f64 {
    1e3 * growth.seconds / growth.spp as f64
}

/// A panel or two for each sweep.
pub fn growth(lines: &[Line]) -> Vec<Panel> {
    let all = sweeps(lines);
    let mut panels = Vec::new();
    for sweep in distinct(all.iter().map(|g| g.sweep.as_str())) {
        let own: Vec<&Growth> = all.iter().copied().filter(|g| g.sweep == sweep).collect();
        let time: View = (
            "time per sample",
            "ms per sample of the picture",
            time_per_sample,
        );
        let (x, slope, views): (Axis, Option<f64>, Vec<View>) = match sweep {
            "triangles" => (
                Axis::log10("triangles"),
                None,
                vec![
                    time,
                    ("memory", "bytes a triangle", |g| {
                        g.bytes as f64 / g.triangles as f64
                    }),
                ],
            ),
            "lights" => (
                Axis::log10("lamps"),
                None,
                vec![
                    time,
                    ("variance × time", "relative variance × seconds", |g| {
                        g.variance * g.seconds
                    }),
                ],
            ),
            "instances" => (
                Axis::log10("instances"),
                None,
                vec![
                    time,
                    ("memory", "bytes an instance", |g| g.bytes as f64 / g.value),
                ],
            ),
            "spp" => (
                Axis::log2("samples a pixel"),
                Some(1.0),
                vec![("time", "seconds", |g| g.seconds)],
            ),
            "resolution" => (
                Axis::log2("width = height, pixels"),
                None,
                vec![("rate", "million paths a second", |g| {
                    1e-6 * (g.pixels * g.spp) as f64 / g.seconds
                })],
            ),
            _ => (Axis::log2(sweep), None, vec![time]),
        };
        for view in views {
            panels.push(growth_panel(sweep, &own, x.clone(), slope, view));
        }
    }
    panels
}

fn growth_panel(
    sweep: &str,
    all: &[&Growth],
    x: Axis,
    slope: Option<f64>,
    (title, y, value): View,
) -> Panel {
    let curve = |backend: &str| {
        let own = || all.iter().filter(|g| g.backend == backend);
        let points = distinct(own().map(|g| g.value)).into_iter().map(|x| {
            let values: Vec<f64> = own().filter(|g| g.value == x).map(|g| value(g)).collect();
            Point {
                x,
                y: quantile(&values, 0.5),
                low: quantile(&values, BAND.0),
                high: quantile(&values, BAND.1),
            }
        });
        Curve {
            name: backend.to_owned(),
            is_dashed: false,
            points: points.collect(),
        }
    };
    let backends = distinct(all.iter().map(|g| g.backend.as_str()));
    Panel::Plot(Plot {
        title: format!("growth with {sweep}: {title}"),
        x,
        y: Axis::log10(y),
        curves: backends.into_iter().map(curve).collect(),
        slope,
    })
}

pub fn sweeps(lines: &[Line]) -> Vec<&Growth> {
    let mut found = Vec::new();
    for line in lines {
        if let Line::Growth(growth) = line {
            found.push(growth);
        }
    }
    found
}
