//! Runs the tests of the table and writes the page.
//!
//! Environment: `ETENDUE_STABILITY`, cases or letters with commas, runs those only and leaves the other rows of the
//! page as they are; `ETENDUE_NIGHTLY=1` takes the counts of the night where tests have some. `ETENDUE_STABILITY_LOG`, what
//! `cargo test -- --nocapture` with `RUST_TEST_THREADS=1` wrote: tests that are in it are not run again.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use crate::named::{self, Outcome, binaries};
use crate::{Case, Figure, page, table, tier};

/// Of one test, with the counts of the night.
const TIME_OUT: Duration = Duration::from_secs(3600);
/// Where the test did not print the words that the table says.
const NO_FIGURE: &str = "passes, without its figure";
/// A figure longer than this is cut.
const LONGEST: usize = 160;

/// What tests printed, each run once.
struct Results {
    binaries: BTreeMap<String, PathBuf>,
    done: BTreeMap<String, (Outcome, String)>,
}

/// The tests in what cargo wrote: each from its name to the line that says how it ended.
fn parsed(log: &str) -> BTreeMap<String, (Outcome, String)> {
    let mut done = BTreeMap::new();
    let (mut binary, mut open) = (String::new(), None);
    for line in log.lines() {
        if let Some(source) = line.trim_start().strip_prefix("Running ") {
            let source = source.split(" (").next().unwrap_or(source);
            let name = source.trim_start_matches("tests/").split(['/', '.']).next();
            binary = match source.contains("src/lib.rs") {
                true => String::from("etendue"),
                false => name.unwrap_or_default().to_owned(),
            };
        }
        if let Some((name, rest)) = line
            .strip_prefix("test ")
            .and_then(|l| l.split_once(" ... "))
        {
            open = Some((format!("{binary}::{name}"), String::new()));
            if rest == "ok" {
                done.extend(
                    open.take()
                        .map(|(name, _)| (name, (Outcome::Passed, String::new()))),
                );
                continue;
            }
        }
        let outcome = match line {
            "ok" => Some(Outcome::Passed),
            "FAILED" => Some(Outcome::Failed),
            _ => None,
        };
        match (outcome, &mut open) {
            (Some(outcome), Some(_)) => {
                done.extend(open.take().map(|(name, text)| (name, (outcome, text))));
            }
            (_, Some((_, text))) => *text += &format!("{line}\n"),
            _ => {}
        }
    }
    done
}

impl Results {
    /// Runs the tests of the feature `faults` among these. They need a program that has it too, which lies where the
    /// others look for theirs: so they run first.
    fn with_faults(&mut self, cases: &[&'static Case]) {
        const FEATURE: &str = "faults";
        let binary = |test: &'static str| test.split("::").next().unwrap();
        let all = cases.iter().flat_map(|case| case.evidence).map(|e| e.test);
        let (with, without): (Vec<_>, Vec<_>) = all.partition(|test| binary(test) == FEATURE);
        if !with.is_empty() {
            self.binaries = binaries(&[FEATURE], &[FEATURE]);
        }
        for test in with {
            self.of(test);
        }
        let names: BTreeSet<_> = without.into_iter().map(binary).collect();
        self.binaries = binaries(&[], &Vec::from_iter(names));
    }

    fn of(&mut self, test: &'static str) -> &(Outcome, String) {
        let binaries = &self.binaries;
        self.done.entry(test.to_owned()).or_insert_with(|| {
            let started = Instant::now();
            let result = named::run(binaries, test, &[], TIME_OUT);
            let seconds = started.elapsed().as_secs_f64();
            println!("{test}: {:?} in {seconds:.0} s", result.0);
            result
        })
    }
}

/// The numbers that follow `words` in a text.
fn numbers(text: &str, words: &str) -> Vec<f64> {
    let is_part = |c: char| c.is_ascii_digit() || matches!(c, '.' | 'e' | '-' | '+');
    let number = |rest: &str| {
        let rest = rest.trim_start();
        let end = rest.find(|c| !is_part(c)).unwrap_or(rest.len());
        rest[..end]
            .trim_end_matches(['.', 'e', '-', '+'])
            .parse()
            .ok()
    };
    text.match_indices(words)
        .filter_map(|(at, _)| number(&text[at + words.len()..]))
        .collect()
}

/// What a test's output says of a case.
fn figure(figure: Figure, text: &str) -> String {
    match figure {
        Figure::Passes => String::from("passes"),
        Figure::Line(words) => {
            let Some(found) = text.lines().find(|l| l.contains(words)) else {
                return String::from(NO_FIGURE);
            };
            // The first line follows the name of the test.
            let found = found.rsplit("... ").next().unwrap_or(found);
            found.chars().take(LONGEST).collect()
        }
        Figure::Largest(words) => {
            let all = numbers(text, words);
            let largest = all.iter().copied();
            let Some(largest) = largest.max_by(|a, b| a.abs().total_cmp(&b.abs())) else {
                return String::from(NO_FIGURE);
            };
            let shown = match largest.abs() {
                x if x == 0.0 || (0.01..1e5).contains(&x) => format!("{largest}"),
                _ => format!("{largest:.1e}"),
            };
            match all.len() {
                1 => format!("{words} {shown}"),
                n => format!("{words} {shown} at most, of {n}"),
            }
        }
    }
}

/// The row of a case, and whether its tests passed.
fn measure(case: &Case, results: &mut Results) -> (String, bool) {
    let mut measured = Vec::new();
    let (mut is_right, mut tier) = (true, "gate");
    for evidence in case.evidence {
        let (outcome, text) = results.of(evidence.test);
        let what = match outcome {
            Outcome::Passed => figure(evidence.figure, text).replace('|', "¦"),
            other => format!("**{other:?}**"),
        };
        is_right &= *outcome == Outcome::Passed;
        if text.contains(tier::OF_THE_NIGHT) {
            tier = "night";
        }
        measured.push(format!("{what} (`{}`)", evidence.test));
    }
    if measured.is_empty() {
        tier = "";
    }
    (page::row(case, &measured.join("<br>"), tier), is_right)
}

/// The page's part: rows of this run, and where it left some out, those of the run before.
fn rows(new: &BTreeMap<&str, String>, before: &str) -> String {
    let mut text = String::new();
    let mut counts = BTreeMap::new();
    for group in table::GROUPS {
        writeln!(text, "\n## {}. {}\n", group.letter, group.name).unwrap();
        text += "| Case | How methods fail | Expected | Measured | Tier | Verdict |\n|---|---|---|---|---|---|\n";
        for case in group.cases {
            let old = || page::find(case, before).map(str::to_owned);
            if let Some(row) = new.get(case.id).cloned().or_else(old) {
                text += &row;
                text += "\n";
            }
            let verdict = case.verdict.text().replace('*', "");
            let kind = verdict.split(':').next().unwrap().to_owned();
            *counts.entry(kind).or_insert(0) += 1;
        }
    }
    let counts: Vec<_> = counts.iter().map(|(k, n)| format!("{n} {k}")).collect();
    let all = table::cases().count();
    format!("\n**Of {all} cases: {}.**\n{text}\n", counts.join(", "))
}

#[test]
#[ignore = "runs a good part of the suite; scripts/stability.sh does it"]
fn every_case_is_measured() {
    let chosen = std::env::var("ETENDUE_STABILITY").ok();
    let is_chosen = |case: &&'static Case| {
        let is_named = |name: &str| name == case.id || name == &case.id[..1];
        chosen.as_ref().is_none_or(|c| c.split(',').any(is_named))
    };
    let log =
        std::env::var_os("ETENDUE_STABILITY_LOG").map(|p| std::fs::read_to_string(p).unwrap());
    let cases: Vec<_> = table::cases().filter(is_chosen).collect();
    let mut results = Results {
        binaries: BTreeMap::new(),
        done: parsed(&log.unwrap_or_default()),
    };
    results.with_faults(&cases);
    let (mut new, mut wrong) = (BTreeMap::new(), Vec::new());
    for case in cases {
        let (row, is_right) = measure(case, &mut results);
        new.insert(case.id, row);
        if !is_right {
            wrong.push(case.id);
        }
        // At once: the run is long, and may be stopped.
        let text = std::fs::read_to_string(page::path()).unwrap();
        page::write(&rows(&new, page::parts(&text).1));
    }
    assert!(wrong.is_empty(), "tests of {wrong:?} failed");
}

#[test]
fn tests_are_found_in_what_cargo_writes() {
    let log = "     Running tests/film.rs (target/film-1)\n\ntest a ... ok\n     Running tests/gpu/main.rs (target/gpu-1)\n\
        test m::b ... x 1\ny 2\nok\ntest c ... x\nFAILED\ntest d ... cut";
    let done = parsed(log);
    let names: Vec<_> = done.keys().map(String::as_str).collect();
    assert_eq!(names, ["film::a", "gpu::c", "gpu::m::b"]);
    assert_eq!(done["gpu::c"].0, Outcome::Failed);
    assert_eq!(numbers(&done["gpu::m::b"].1, "y"), [2.0]);
}

#[test]
fn figures_are_found_in_what_tests_print() {
    let text = "test a ... x off by 1.5e-7, allowed 3\ny off by -2e-6.\noff by nothing";
    assert_eq!(numbers(text, "off by"), [1.5e-7, -2e-6]);
    assert_eq!(
        figure(Figure::Largest("off by"), text),
        "off by -2.0e-6 at most, of 2"
    );
    assert_eq!(
        figure(Figure::Line("x off"), text),
        "x off by 1.5e-7, allowed 3"
    );
}
