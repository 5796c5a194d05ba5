//! docs/physics.md: the part between two markers, which the run writes.

use std::path::PathBuf;

const BEGIN: &str = "<!-- kill matrix: written by scripts/mutants.sh -->\n";
const END: &str = "<!-- end of the kill matrix -->\n";

pub fn path() -> PathBuf {
    crate::root().join("docs/physics.md")
}

/// The page up to the first marker, between the markers, and from the second one.
pub fn parts(page: &str) -> (&str, &str, &str) {
    let begin = page.find(BEGIN).expect("the page has its first marker") + BEGIN.len();
    let end = page.find(END).expect("the page has its second marker");
    (&page[..begin], &page[begin..end], &page[end..])
}

/// Replaces what stands between the markers.
#[cfg(feature = "mutants")]
pub fn write(matrix: &str) {
    let page = std::fs::read_to_string(path()).unwrap();
    let (before, _, after) = parts(&page);
    std::fs::write(path(), format!("{before}{matrix}{after}")).unwrap();
}
