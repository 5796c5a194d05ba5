//! Plants each mutant and runs the tests that should find it.
//!
//! Environment: `ETENDUE_MUTANTS`, names with commas, runs those only and leaves the
//! other rows of the page as they are; `ETENDUE_MUTANTS_ALL=1` goes on after the first test that finds one.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::named::{self, Outcome, binaries, root};
use crate::shaders::{Entry, SHADERS, compile_all};
use crate::{CONTROL, Mutant, mutants, page, planted};

/// Of one test.
const TIME_OUT: Duration = Duration::from_secs(600);

/// Runs one test with the environment of a mutant.
fn run(binaries: &BTreeMap<String, PathBuf>, test: &str, mutant: &str, spirv: &Path) -> Outcome {
    let environment = [
        ("ETENDUE_MUTANT", mutant.as_ref()),
        ("ETENDUE_MUTANT_SPIRV", spirv.as_os_str()),
    ];
    named::run(binaries, test, &environment, TIME_OUT).0
}

/// Whether a shader includes a file, by itself or through others, or is that file.
fn is_part(file: &str, of: &str) -> bool {
    file == of || {
        let text = std::fs::read_to_string(root().join("shaders").join(of)).unwrap();
        text.lines()
            .filter_map(|line| line.strip_prefix("#include \"")?.strip_suffix('"'))
            .any(|included| is_part(file, included))
    }
}

/// Compiles every shader that the changed file is a part of into `folder`.
fn compile_planted(mutant: &Mutant, folder: &Path) {
    let Some(file) = mutant.file.strip_prefix("shaders/") else {
        return;
    };
    let changed = planted(mutant).unwrap();
    let read = |name: &str| {
        if name == file {
            return Ok(changed.clone());
        }
        std::fs::read_to_string(root().join("shaders").join(name)).map_err(|e| e.to_string())
    };
    // `shading` runs kernels of its own, all other tests run the renderer's.
    let is_of =
        |test: &str, source: &str| source.starts_with("tests/") == test.starts_with("shading::");
    let is_used = |source: &str| mutant.killers.iter().any(|test| is_of(test, source));
    let entries: Vec<Entry> = SHADERS
        .iter()
        .filter(|(source, ..)| is_part(file, source) && is_used(source))
        .copied()
        .collect();
    let level = shaderc::OptimizationLevel::Performance;
    compile_all(&entries, level, &read, folder);
}

/// A row of the matrix.
struct Row {
    mutant: &'static Mutant,
    found_by: Vec<String>,
    missed_by: Vec<String>,
}

impl Row {
    fn is_control(&self) -> bool {
        self.mutant.name.starts_with(CONTROL)
    }

    fn is_right(&self) -> bool {
        self.found_by.is_empty() == self.is_control()
    }

    /// The row of the page.
    fn line(&self) -> String {
        let list = |tests: &[String]| tests.join(", ");
        let (name, wrong) = (self.mutant.name, self.mutant.wrong);
        let found = match list(&self.found_by) {
            none if none.is_empty() && self.is_control() => String::from(SURVIVED),
            none if none.is_empty() => String::from(MISSED),
            tests => tests,
        };
        let missed = list(&self.missed_by);
        format!("| `{name}` | {wrong} | {found} | {missed} |")
    }
}

const SURVIVED: &str = "nothing, as it should be";
const MISSED: &str = "**nothing**";

/// The page's part: rows of this run, and where it left some out, those of the run before.
fn matrix(rows: &[Row], before: &str) -> String {
    let lines: Vec<String> = mutants()
        .filter_map(|mutant| {
            let name = format!("| `{}` |", mutant.name);
            let old = || {
                before
                    .lines()
                    .find(|l| l.starts_with(&name))
                    .map(str::to_owned)
            };
            let new = rows.iter().find(|r| r.mutant.name == mutant.name);
            new.map(Row::line).or_else(old)
        })
        .collect();
    let count = |what: &dyn Fn(&str) -> bool| lines.iter().filter(|l| what(l)).count();
    let controls = count(&|l| l.contains(&format!("| `{CONTROL}")));
    let survived = count(&|l| l.contains(SURVIVED));
    let missed = count(&|l| l.contains(MISSED));
    let all = lines.len() - controls;
    let found = all - missed;
    let mut text = format!("\n**{found} of {all} mutants are found");
    writeln!(text, "; {survived} of {controls} control is not.**").unwrap();
    text += "Each met the tests that `tests/mutants` lists for it, the cheapest first, until one failed.\n";
    text += "\n| Mutant | What is wrong | Found by | Missed by |\n|---|---|---|---|\n";
    text + &lines.join("\n") + "\n\n"
}

#[test]
#[ignore = "takes half an hour; scripts/mutants.sh runs it"]
fn every_mutant_is_found_and_no_control() {
    let chosen = std::env::var("ETENDUE_MUTANTS").ok();
    let is_whole = std::env::var_os("ETENDUE_MUTANTS_ALL").is_some_and(|v| v == "1");
    let is_chosen = |m: &&Mutant| {
        chosen
            .as_ref()
            .is_none_or(|names| names.split(',').any(|n| n == m.name))
    };
    let binaries = binaries(&["mutants"], &[]);
    let nothing = tempfile::tempdir().unwrap();
    let mut healthy = BTreeMap::new();
    let mut rows = Vec::new();
    for mutant in mutants().filter(is_chosen) {
        let folder = tempfile::tempdir().unwrap();
        compile_planted(mutant, folder.path());
        let mut row = Row {
            mutant,
            found_by: Vec::new(),
            missed_by: Vec::new(),
        };
        for test in mutant.killers {
            let started = Instant::now();
            let outcome = run(&binaries, test, mutant.name, folder.path());
            println!(
                "{}: {test}: {outcome:?} in {:.0} s",
                mutant.name,
                started.elapsed().as_secs_f64()
            );
            if outcome == Outcome::Passed {
                row.missed_by.push(format!("`{test}`"));
                continue;
            }
            // A test that fails anyway finds nothing.
            let is_healthy = healthy
                .entry(*test)
                .or_insert_with(|| run(&binaries, test, "none", nothing.path()));
            assert_eq!(*is_healthy, Outcome::Passed, "{test} without a mutant");
            row.found_by.push(format!("`{test}`"));
            if !is_whole {
                break;
            }
        }
        rows.push(row);
        // At once: the run is long, and may be stopped.
        let page = std::fs::read_to_string(page::path()).unwrap();
        page::write(&matrix(&rows, page::parts(&page).1));
    }
    let wrong: Vec<_> = rows
        .iter()
        .filter(|r| !r.is_right())
        .map(|r| r.mutant.name)
        .collect();
    assert!(wrong.is_empty(), "wrong: {wrong:?}");
}
