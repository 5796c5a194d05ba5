//! One self-contained page: charts, tables, pictures.

use std::fmt::Write;
use std::path::{Component, Path};

use anyhow::{Context, Result, bail};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use etendue::chart::{Panel, Sheet, escape, plain};

use super::super::bench::record::{self, Line};
use super::distinct;
use super::table::Table;
use super::{contest, panels, tables};

/// The page; pictures are read from `folder`.
pub fn html(lines: &[Line], folder: &Path) -> Result<String> {
    let mut body = String::new();
    body += &machine(lines);
    let note = panels::note(lines);
    let charts = [
        ("Error against time", "errors", panels::errors(lines)),
        ("Rates of the backends", "rates", panels::rates(lines)),
        ("Limits", "limits", panels::limits(lines)),
        ("Growth", "growth", panels::growth(lines)),
    ];
    for (title, id, panels) in charts {
        if panels.is_empty() {
            continue;
        }
        body += &section(title, panels, &note, id);
        let tables = match id {
            "errors" => vec![
                contest::best(lines),
                contest::equal_error(lines),
                tables::last_runs(lines),
            ],
            "rates" => vec![tables::rates(lines)],
            "limits" => vec![tables::limits(lines)],
            "growth" => vec![tables::slopes(lines), tables::growth(lines)],
            _ => Vec::new(),
        };
        body.extend(tables.iter().map(Table::html));
    }
    body += &tables::skipped(lines).html();
    body += &pictures(lines, folder)?;
    Ok(include_str!("report.html").replace("<!-- content -->", &body))
}

/// The tables alone, in Markdown.
pub fn markdown(lines: &[Line]) -> String {
    let all = [
        contest::best(lines),
        contest::equal_error(lines),
        tables::last_runs(lines),
        tables::rates(lines),
        tables::limits(lines),
        tables::slopes(lines),
        tables::growth(lines),
        tables::skipped(lines),
    ];
    all.iter().map(Table::markdown).collect()
}

fn section(title: &str, panels: Vec<Panel>, note: &str, id: &str) -> String {
    let sheet = Sheet {
        panels,
        note: note.to_owned(),
    };
    format!("<h2>{title}</h2>\n<figure>\n{}</figure>\n", sheet.svg(id))
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
