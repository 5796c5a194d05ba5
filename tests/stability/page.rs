//! docs/stability.md: the part between two markers, which the run writes.

use std::path::PathBuf;

use crate::{Case, table};

const BEGIN: &str = "<!-- cases: written by scripts/stability.sh -->\n";
const END: &str = "<!-- end of the cases -->\n";

pub fn path() -> PathBuf {
    crate::named::root().join("docs/stability.md")
}

/// The page up to the first marker, between the markers, and from the second one.
pub fn parts(page: &str) -> (&str, &str, &str) {
    let begin = page.find(BEGIN).expect("the page has its first marker") + BEGIN.len();
    let end = page.find(END).expect("the page has its second marker");
    (&page[..begin], &page[begin..end], &page[end..])
}

/// The row of a case: what was measured in between of what the table says.
pub fn row(case: &Case, measured: &str, tier: &str) -> String {
    format!("{} {measured} | {tier} {}", start(case), end(case))
}

fn start(case: &Case) -> String {
    format!("| {} | {} | {} |", case.id, case.what, case.expected)
}

fn end(case: &Case) -> String {
    format!("| {} |", case.verdict.text())
}

/// Whether a line of the page is a case.
pub fn is_row(line: &str) -> bool {
    table::cases().any(|case| line.starts_with(&format!("| {} |", case.id)))
}

/// The row of a case on a page.
pub fn find<'a>(case: &Case, rows: &'a str) -> Option<&'a str> {
    let name = format!("| {} |", case.id);
    rows.lines().find(|line| line.starts_with(&name))
}

/// Whether the page says of a case what the table does, and names its tests.
pub fn is_current(case: &Case, rows: &str) -> bool {
    find(case, rows).is_some_and(|line| {
        line.starts_with(&start(case))
            && line.ends_with(&end(case))
            && case.evidence.iter().all(|e| line.contains(e.test))
    })
}

/// Replaces what stands between the markers.
pub fn write(rows: &str) {
    let page = std::fs::read_to_string(path()).unwrap();
    let (before, _, after) = parts(&page);
    std::fs::write(path(), format!("{before}{rows}{after}")).unwrap();
}
