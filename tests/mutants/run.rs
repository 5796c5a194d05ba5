//! Plants each mutant and runs the tests that should find it.
//!
//! Environment: `ETENDUE_MUTANTS`, names with commas, runs those only and leaves the
//! other rows of the page as they are; `ETENDUE_MUTANTS_ALL=1` goes on after the first test that finds one.

use std::collections::{BTreeMap, BTreeSet};
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

/// Whether the mutant changes the kernel of an entry of the table.
fn is_changed(mutant: &Mutant, source: &str) -> bool {
    let file = mutant.file.strip_prefix("shaders/");
    file.is_some_and(|file| is_part(file, source))
}

/// Compiles those of the kernels that the mutant changes into `folder`, where they are not there yet.
fn plant(mutant: &Mutant, kernels: &BTreeSet<String>, folder: &Path) {
    let read = |name: &str| {
        if mutant.file.strip_prefix("shaders/") == Some(name) {
            return planted(mutant);
        }
        std::fs::read_to_string(root().join("shaders").join(name)).map_err(|e| e.to_string())
    };
    let is_missing = |name: &str| !folder.join(name).with_extension("spv").exists();
    let entries: Vec<Entry> = SHADERS
        .iter()
        .filter(|(source, _, name)| {
            kernels.contains(*name) && is_changed(mutant, source) && is_missing(name)
        })
        .copied()
        .collect();
    let level = shaderc::OptimizationLevel::Performance;
    compile_all(&entries, level, &read, folder);
}

/// Kernels that a test asked for and that were not planted in `folder`.
fn asked(folder: &Path) -> BTreeSet<String> {
    let entries = folder.read_dir().unwrap();
    entries
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|e| e == "asked"))
        .map(|path| path.file_stem().unwrap().to_string_lossy().into_owned())
        .collect()
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
    // Tests that pass without a mutant, and the kernels that they run.
    let mut healthy: BTreeMap<_, BTreeSet<String>> = BTreeMap::new();
    let mut rows = Vec::new();
    for mutant in mutants().filter(is_chosen) {
        let folder = tempfile::tempdir().unwrap();
        let mut row = Row {
            mutant,
            found_by: Vec::new(),
            missed_by: Vec::new(),
        };
        for test in mutant.killers {
            let kernels = healthy.entry(*test).or_insert_with(|| {
                let nothing = tempfile::tempdir().unwrap();
                let outcome = run(&binaries, test, "none", nothing.path());
                // A test that fails anyway finds nothing.
                assert_eq!(outcome, Outcome::Passed, "{test} without a mutant");
                asked(nothing.path())
            });
            plant(mutant, kernels, folder.path());
            let started = Instant::now();
            let outcome = run(&binaries, test, mutant.name, folder.path());
            println!(
                "{}: {test}: {outcome:?} in {:.0} s",
                mutant.name,
                started.elapsed().as_secs_f64()
            );
            let is_healthy = |name: &String| {
                let mut shaders = SHADERS.iter();
                !shaders.any(|(source, _, n)| n == name && is_changed(mutant, source))
            };
            let others = asked(folder.path());
            assert!(others.iter().all(is_healthy), "{test} ran {others:?}, too");
            if outcome == Outcome::Passed {
                row.missed_by.push(format!("`{test}`"));
                continue;
            }
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
