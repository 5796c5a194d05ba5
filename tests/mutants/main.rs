//! Errors of physics planted one at a time, and whether the test suite finds them.
//!
//! A mutant changes a few words of one shader, or asks `mutant::is` in the host's
//! code. The ordinary suite checks that the list still fits the code. The run
//! itself takes the feature `mutants`, and long: scripts/mutants.sh.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "tests may unwrap; they print how far they are"
)]

#[path = "../common/named.rs"]
#[cfg_attr(
    not(feature = "mutants"),
    expect(dead_code, reason = "without mutants nothing is run")
)]
mod named;

mod estimator;
mod light;
mod matter;
mod page;
#[cfg(feature = "mutants")]
mod run;
#[cfg(feature = "mutants")]
#[path = "../../build/shaders.rs"]
mod shaders;

use std::collections::BTreeSet;

use named::{has_test, root};

/// One error.
pub struct Mutant {
    /// A word for the table; that of `mutant::is` where it is the host's.
    pub name: &'static str,
    /// What is wrong, for people.
    pub wrong: &'static str,
    /// From the root.
    pub file: &'static str,
    /// Text that occurs once in the file, and what stands there instead. None where the host asks for the name.
    pub edits: &'static [(&'static str, &'static str)],
    /// Tests that should find it, the cheapest first: test binary, `::`, name of the test.
    pub killers: &'static [&'static str],
}

/// A word that marks mutants that the suite must not find, since they change nothing.
const CONTROL: &str = "control-";

/// All of them, controls included.
fn mutants() -> impl Iterator<Item = &'static Mutant> {
    matter::MUTANTS
        .iter()
        .chain(light::MUTANTS)
        .chain(estimator::MUTANTS)
}

/// The file with the error in it; an error where the list no longer fits.
fn planted(mutant: &Mutant) -> Result<String, String> {
    let path = root().join(mutant.file);
    let mut text = std::fs::read_to_string(path).map_err(|e| e.to_string())?;
    let question = format!("mutant::is(\"{}\")", mutant.name);
    let wanted = mutant.edits.iter().map(|(from, _)| *from);
    for from in wanted.chain(mutant.edits.is_empty().then_some(question.as_str())) {
        let count = text.matches(from).count();
        if count != 1 {
            return Err(format!("{}: {from:?} occurs {count} times", mutant.file));
        }
    }
    for (from, to) in mutant.edits {
        text = text.replace(from, to);
    }
    Ok(text)
}

#[test]
fn every_mutant_fits_the_code_and_names_its_killers() {
    let mut names = BTreeSet::new();
    let mut wrong = Vec::new();
    for mutant in mutants() {
        let name = mutant.name;
        if !names.insert(name) {
            wrong.push(format!("{name}: twice"));
        }
        match planted(mutant) {
            Ok(text) => {
                let was = std::fs::read_to_string(root().join(mutant.file)).unwrap();
                if text == was && !mutant.edits.is_empty() {
                    wrong.push(format!("{name}: changes nothing"));
                }
            }
            Err(error) => wrong.push(format!("{name}: {error}")),
        }
        if mutant.killers.is_empty() {
            wrong.push(format!("{name}: no test"));
        }
        for killer in mutant.killers {
            if !has_test(killer) {
                wrong.push(format!("{name}: no test {killer}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    let controls = names.iter().filter(|n| n.starts_with(CONTROL)).count();
    assert!(controls >= 1 && names.len() - controls >= 40);
}

/// The page lists all of them; scripts/mutants.sh writes it.
#[test]
fn the_page_names_every_mutant() {
    let page = std::fs::read_to_string(page::path()).unwrap();
    let (_, matrix, _) = page::parts(&page);
    let missing: Vec<_> = mutants()
        .map(|m| m.name)
        .filter(|name| !matrix.contains(&format!("| `{name}` |")))
        .collect();
    assert!(missing.is_empty(), "docs/physics.md lacks {missing:?}");
}
