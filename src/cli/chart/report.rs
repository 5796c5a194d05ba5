//! One self-contained page: charts, tables, pictures.

use std::fmt::Write;
use std::path::{Component, Path};

use anyhow::{Context, Result, bail};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use etendue::chart::{Panel, Sheet, escape, plain};

use super::super::bench::record::{self, Line, Run};
use super::compare::{disagrees, means, ratios};
use super::panels::{self, runs};
use super::{distinct, quantile};

/// Whom the others are compared with.
const BASE: &str = "etendue full";

/// The page; pictures are read from `folder`.
pub fn html(lines: &[Line], folder: &Path) -> Result<String> {
    let mut body = String::new();
    body += &machine(lines);
    let note = panels::note(lines);
    let charts = [
        ("Error against time", "errors", panels::errors(lines)),
        ("Rates of the backends", "rates", panels::rates(lines)),
        ("Growth", "growth", panels::growth(lines)),
    ];
    for (title, id, panels) in charts {
        if panels.is_empty() {
            continue;
        }
        body += &section(title, panels, &note, id);
        body += &match id {
            "errors" => equal_error(lines) + &last_runs(lines),
            "growth" => growth(lines),
            _ => String::new(),
        };
    }
    body += &skipped(lines);
    body += &pictures(lines, folder)?;
    Ok(include_str!("report.html").replace("<!-- content -->", &body))
}

fn section(title: &str, panels: Vec<Panel>, note: &str, id: &str) -> String {
    let sheet = Sheet {
        panels,
        note: note.to_owned(),
    };
    format!("<h2>{title}</h2>\n<figure>\n{}</figure>\n", sheet.svg(id))
}

/// A table; the first `texts` columns hold text, the others numbers.
fn table(head: &[&str], texts: usize, rows: &[Vec<String>]) -> String {
    let row = |cells: &[String], tag: &str| {
        let cell = |(i, cell): (usize, &String)| {
            let class = if i < texts { "" } else { " class=\"n\"" };
            format!("<{tag}{class}>{}</{tag}>", escape(cell))
        };
        let cells: String = cells.iter().enumerate().map(cell).collect();
        format!("<tr>{cells}</tr>\n")
    };
    let head: Vec<String> = head.iter().map(|h| (*h).to_owned()).collect();
    let rows: String = rows.iter().map(|cells| row(cells, "td")).collect();
    format!("<table>\n{}{rows}</table>\n", row(&head, "th"))
}

fn machine(lines: &[Line]) -> String {
    let mut out = String::new();
    for line in lines {
        if let Line::Machine(m) = line {
            let load = m.load.map(|l| format!(", load before {}", plain(l)));
            let text = format!(
                "etendue {} on {} ({}), {}, {} cores, {}{}",
                m.version,
                m.device,
                m.driver,
                m.cpu,
                m.cores,
                m.os,
                load.unwrap_or_default()
            );
            let (text, command) = (escape(&text), escape(&m.command));
            writeln!(out, "<p>{text}</p>\n<pre>{command}</pre>").expect("a string takes all");
        }
    }
    out
}

/// Time to equal error against the full estimator.
fn equal_error(lines: &[Line]) -> String {
    let ratios = ratios(lines, BASE);
    let mut rows: Vec<Vec<String>> = Vec::new();
    let scenes = distinct(runs(lines).into_iter().map(|r| r.scene.as_str()));
    let names = distinct(runs(lines).into_iter().map(|r| r.contender.as_str()));
    for scene in scenes {
        for name in names.iter().filter(|n| **n != BASE) {
            let cells = if let Some(a) = disagrees(lines, scene, name) {
                let percent = plain(100.0 * a.difference);
                [
                    format!("not compared: mean off by {percent} %"),
                    String::new(),
                ]
            } else if let Some((_, _, r)) = ratios.iter().find(|r| r.0 == scene && r.1 == *name) {
                let range = format!("{} to {}", plain(r.range.0), plain(r.range.1));
                [plain(r.median), range]
            } else {
                continue;
            };
            let [ratio, range] = cells;
            rows.push(vec![scene.to_owned(), (*name).to_owned(), ratio, range]);
        }
    }
    for (name, count, mean) in means(&ratios) {
        let scenes = format!("geometric mean of {count}");
        rows.push(vec![scenes, name, plain(mean), String::new()]);
    }
    if rows.is_empty() {
        return String::new();
    }
    let head = ["scene", "contender", "its time over ours", "over the seeds"];
    format!(
        "<h3>Time to equal relMSE, as a multiple of that of {BASE}</h3>\n{}",
        table(&head, 2, &rows)
    )
}

/// The runs with the most samples of each contender.
fn last_runs(lines: &[Line]) -> String {
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
                Some(plain(s.build + s.compile))
            }
            _ => None,
        });
        let rays = match own().all(|r| r.rays_per_second.is_some()) {
            true => median(&|r| r.rays_per_second.unwrap_or(0.0) / 1e6),
            false => String::from("–"),
        };
        vec![
            scene.to_owned(),
            contender.to_owned(),
            spp.to_string(),
            start.unwrap_or_default(),
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
        ]
    };
    let rows: Vec<Vec<String>> = keys.iter().map(row).collect();
    let head = [
        "scene",
        "contender",
        "samples",
        "start, s",
        "render, s",
        "Mpaths/s",
        "Mrays/s",
        "RMSE",
        "relMSE (without the worst 0.1 %)",
        "relative bias²",
    ];
    format!(
        "<h3>The longest runs, medians</h3>\n{}",
        table(&head, 2, &rows)
    )
}

fn growth(lines: &[Line]) -> String {
    let all = panels::sweeps(lines);
    let keys = distinct(all.iter().map(|g| (g.sweep.as_str(), g.value)));
    let row = |&(sweep, value): &(&str, f64)| {
        let median = |f: fn(&record::Growth) -> f64| {
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
    let rows: Vec<Vec<String>> = keys.iter().map(row).collect();
    let head = [
        "sweep",
        "value",
        "ms per sample",
        "Mrays/s",
        "build, s",
        "bytes a triangle",
        "variance × s",
        "paths cut, %",
    ];
    table(&head, 1, &rows)
}

fn skipped(lines: &[Line]) -> String {
    let rows: Vec<Vec<String>> = lines
        .iter()
        .filter_map(|line| match line {
            Line::Skipped(s) => Some(vec![s.scene.clone(), s.contender.clone(), s.reason.clone()]),
            _ => None,
        })
        .collect();
    match rows.is_empty() {
        true => String::new(),
        false => format!(
            "<h2>Not measured</h2>\n{}",
            table(&["scene", "contender", "why"], 3, &rows)
        ),
    }
}

/// For each scene two of its pictures over each other with a slider between.
fn pictures(lines: &[Line], folder: &Path) -> Result<String> {
    let all = lines.iter().filter_map(|line| match line {
        Line::Picture(picture) => Some(picture),
        _ => None,
    });
    let all: Vec<&record::Picture> = all.collect();
    let mut out = String::new();
    for scene in distinct(all.iter().map(|p| p.scene.as_str())) {
        let mut images = String::new();
        for picture in all.iter().filter(|p| p.scene == scene) {
            let data = STANDARD.encode(read(folder, &picture.file)?);
            let name = match picture.spp {
                0 => picture.contender.clone(),
                spp => format!("{}, {spp} samples", picture.contender),
            };
            let name = escape(&name);
            writeln!(
                images,
                r#"<img alt="{name}" src="data:image/png;base64,{data}">"#
            )?;
        }
        let scene = escape(scene);
        writeln!(
            out,
            "<h3>{scene}</h3>\n<div class=\"slider\">\n{images}</div>"
        )?;
    }
    match out.is_empty() {
        true => Ok(out),
        false => Ok(format!("<h2>Pictures</h2>\n{out}")),
    }
}

/// A PNG of the folder: a bench file from elsewhere shall not bring other files into the page.
fn read(folder: &Path, file: &str) -> Result<Vec<u8>> {
    let inside = Path::new(file)
        .components()
        .all(|c| matches!(c, Component::Normal(_)));
    if !inside || !file.ends_with(".png") {
        bail!("{file:?} is not a PNG beside the bench file");
    }
    let path = folder.join(file);
    std::fs::read(&path).with_context(|| format!("read {}", path.display()))
}
