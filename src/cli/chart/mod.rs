//! `etendue chart`: draws what `etendue bench` wrote; measures nothing.

mod compare;
mod contest;
mod estimate;
mod panels;
mod report;
mod table;
mod tables;

use std::path::Path;

use anyhow::{Context, anyhow};
use etendue::Error;
use etendue::chart::Sheet;
use etendue::image_io::{probe_writable, write_bytes};

use super::bench::args::ChartArgs;
use super::bench::record::{Line, SCHEMA};
use super::failure::{FAILED, Failure, Outcome};

/// Reads the lines and writes every file asked for.
pub fn run(args: &ChartArgs) -> Result<Outcome, Failure> {
    for path in &args.output {
        if !["svg", "html", "md"].iter().any(|s| has_suffix(path, s)) {
            return Err(Failure::usage(Error::Settings {
                name: "--output",
                what: format!(
                    "{} ends with neither .svg nor .html nor .md",
                    path.display()
                ),
            }));
        }
        probe_writable(path).map_err(Failure::usage)?;
    }
    let lines =
        read(&args.bench).map_err(|error| Failure::new(FAILED, error, "read the bench file"))?;
    for path in &args.output {
        let text = if has_suffix(path, "html") {
            let folder = args.bench.parent().unwrap_or(Path::new(""));
            let html = report::html(&lines, folder);
            html.map_err(|error| Failure::new(FAILED, error, "make the report"))?
        } else if has_suffix(path, "md") {
            report::markdown(&lines)
        } else {
            let sheet = Sheet {
                panels: [
                    panels::errors(&lines),
                    panels::rates(&lines),
                    panels::limits(&lines),
                    panels::growth(&lines),
                ]
                .into_iter()
                .flatten()
                .collect(),
                note: panels::note(&lines),
            };
            sheet.svg("bench")
        };
        write_bytes(path, text.as_bytes())?;
    }
    Ok(Outcome::Done)
}

fn has_suffix(path: &Path, suffix: &str) -> bool {
    path.extension()
        .is_some_and(|s| s.eq_ignore_ascii_case(suffix))
}

/// The lines of a bench file; what is wrong is said with its line.
fn read(path: &Path) -> anyhow::Result<Vec<Line>> {
    let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
    let mut lines = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        let place = || format!("{}, line {number}", path.display());
        let line: Line = serde_json::from_str(line).with_context(place)?;
        match &line {
            Line::Machine(machine) if machine.schema != SCHEMA => {
                let found = machine.schema;
                return Err(anyhow!("schema {found}; this program reads {SCHEMA}"))
                    .with_context(place);
            }
            _ => lines.push(line),
        }
    }
    let measures = |line: &Line| {
        matches!(
            line,
            Line::Run(_) | Line::Rate(_) | Line::Limit(_) | Line::Growth(_)
        )
    };
    if !lines.iter().any(measures) {
        return Err(anyhow!("{}: nothing that can be drawn", path.display()));
    }
    Ok(lines)
}

/// Of sorted or unsorted values the one below which the share lies, between neighbours by proportion.
fn quantile(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let at = share * (sorted.len().max(1) - 1) as f64;
    let (below, part) = (at.floor() as usize, at.fract());
    let value = |i: usize| sorted.get(i).or(sorted.last()).copied();
    match (value(below), value(below + 1)) {
        (Some(a), Some(b)) => a + part * (b - a),
        _ => f64::NAN,
    }
}

/// Values in order of their first occurrence.
fn distinct<T: PartialEq>(values: impl Iterator<Item = T>) -> Vec<T> {
    let mut found = Vec::new();
    for value in values {
        if !found.contains(&value) {
            found.push(value);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_lie_between_neighbours() {
        let values = [4.0, 1.0, 3.0, 2.0, 5.0];
        assert_eq!(quantile(&values, 0.5), 3.0);
        assert_eq!(quantile(&values, 0.0), 1.0);
        assert_eq!(quantile(&values, 1.0), 5.0);
        assert!((quantile(&values, 0.05) - 1.2).abs() < 1e-12);
        assert!(quantile(&[], 0.5).is_nan());
    }
}
