//! Where methods fail: known ways in which path tracers go wrong, and for each the
//! tests that hold this one to a threshold, or the reason why there is none.
//!
//! `table` lists the cases. Most point at tests elsewhere; what had no test has one here. scripts/stability.sh runs
//! them and writes docs/stability.md: what each printed is the measured figure. The ordinary suite checks that the
//! tests exist and that the page is that of the table.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "tests may unwrap; they print measured figures and why they skip"
)]

#[path = "../common/mod.rs"]
mod common;
#[path = "../common/named.rs"]
mod named;
#[path = "../common/random.rs"]
mod random;
#[path = "../common/solids.rs"]
#[expect(dead_code, reason = "tests/matter uses the rest")]
mod solids;
#[path = "../common/statistics.rs"]
mod statistics;
#[path = "../common/tier.rs"]
mod tier;

mod chance;
mod degenerate;
mod light;
mod numbers;
mod page;
mod placement;
mod run;
mod scales;
mod support;
mod table;

use std::collections::BTreeSet;

/// What of a test's output is the figure.
#[derive(Clone, Copy)]
pub enum Figure {
    /// Nothing: it passes or it does not.
    Passes,
    /// The first line that holds these words.
    Line(&'static str),
    /// The largest of all numbers that follow these words.
    Largest(&'static str),
}

/// A test that says something about a case.
pub struct Evidence {
    /// Test binary, `::`, name of the test.
    pub test: &'static str,
    /// Where its figure is.
    pub figure: Figure,
}

/// What is known of a case.
pub enum Verdict {
    /// Tests assert the threshold.
    Holds,
    /// Tests assert another bound, for this reason.
    Wider(&'static str),
    /// It is measured and not good enough, for this reason.
    Misses(&'static str),
    /// There is nothing of the kind here.
    Absent(&'static str),
}

/// A way in which methods fail.
pub struct Case {
    /// A letter for the group, a number within.
    pub id: &'static str,
    /// What goes wrong elsewhere.
    pub what: &'static str,
    /// The threshold.
    pub expected: &'static str,
    /// How it stands.
    pub verdict: Verdict,
    /// What says so.
    pub evidence: &'static [Evidence],
}

const fn passes(test: &'static str) -> Evidence {
    Evidence {
        test,
        figure: Figure::Passes,
    }
}

const fn line(test: &'static str, words: &'static str) -> Evidence {
    Evidence {
        test,
        figure: Figure::Line(words),
    }
}

const fn largest(test: &'static str, words: &'static str) -> Evidence {
    Evidence {
        test,
        figure: Figure::Largest(words),
    }
}

impl Verdict {
    fn text(&self) -> String {
        match self {
            Self::Holds => String::from("holds"),
            Self::Wider(why) => format!("holds with a wider bound: {why}"),
            Self::Misses(why) => format!("**does not hold**: {why}"),
            Self::Absent(why) => format!("does not apply: {why}"),
        }
    }
}

#[test]
fn every_case_has_tests_that_exist_or_a_reason() {
    let mut ids = BTreeSet::new();
    let mut wrong = Vec::new();
    for case in table::cases() {
        if !ids.insert(case.id) {
            wrong.push(format!("{}: twice", case.id));
        }
        let needs_tests = !matches!(case.verdict, Verdict::Absent(_));
        if needs_tests && case.evidence.is_empty() {
            wrong.push(format!("{}: no test", case.id));
        }
        for evidence in case.evidence {
            if !named::has_test(evidence.test) {
                wrong.push(format!("{}: no test {}", case.id, evidence.test));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    let wanted = table::GROUPS
        .iter()
        .flat_map(|g| (1..=g.count).map(|i| format!("{}{i}", g.letter)));
    let missing: Vec<_> = wanted.filter(|id| !ids.contains(id.as_str())).collect();
    assert!(missing.is_empty(), "no case {missing:?}");
    assert_eq!(ids.len(), 126);
}

/// scripts/stability.sh writes the page; what the table says of a case stands there word for word.
#[test]
fn the_page_is_that_of_the_table() {
    let text = std::fs::read_to_string(page::path()).unwrap();
    let (_, rows, _) = page::parts(&text);
    let stale: Vec<_> = table::cases()
        .filter(|case| !page::is_current(case, rows))
        .map(|case| case.id)
        .collect();
    assert!(
        stale.is_empty(),
        "docs/stability.md is older than the table: scripts/stability.sh {}",
        stale.join(",")
    );
    let count = rows.lines().filter(|l| page::is_row(l)).count();
    assert_eq!(count, table::cases().count());
}
