//! The rules of docs/architecture.md that a machine can check: who imports whom,
//! how long files get, and words that do not belong.
#![allow(
    clippy::unwrap_used,
    reason = "the lint's exception for tests does not reach their helpers"
)]

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Each module of the library and what it may use. `cli` is part of the binary
/// and sees the public items of all; the compiler takes care of it.
const MAY_USE: &[(&str, &[&str])] = &[
    ("error", &[]),
    ("layout", &[]),
    ("fault", &[]),
    ("spirv", &[]),
    ("gpu", &["error", "fault", "spirv"]),
    ("bvh", &["error"]),
    ("guide", &["layout"]),
    ("chart", &[]),
    ("settings", &["error", "layout", "mutant"]),
    ("mutant", &[]),
    ("scene", &["error", "mutant", "store"]),
    ("tails", &[]),
    ("film", &["error", "layout", "settings", "tails"]),
    ("image_io", &["error", "fault", "film", "settings"]),
    ("store", &["image_io"]),
    ("compare", &["error", "image_io", "tails"]),
    ("checkpoint", &["error", "film", "image_io", "settings"]),
    ("spec", &["mutant", "scene", "settings"]),
    ("wgpu", &["error", "gpu", "settings", "spirv"]),
    (
        "selftest",
        &[
            "compare", "error", "film", "gpu", "image_io", "layout", "render", "scene", "settings",
        ],
    ),
    (
        "render",
        &[
            "bvh", "error", "fault", "film", "gpu", "guide", "layout", "mutant", "scene",
            "settings", "spec", "store", "wgpu",
        ],
    ),
];

/// Longest file, lines.
const MAX_LINES: usize = 500;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Files below `folders` with one of the suffixes: path from the root, and text.
fn files(folders: &[&str], suffixes: &[&str]) -> Vec<(String, String)> {
    let mut found = Vec::new();
    let mut pending: Vec<PathBuf> = folders.iter().map(|f| root().join(f)).collect();
    while let Some(path) = pending.pop() {
        if path.is_dir() {
            pending.extend(path.read_dir().unwrap().map(|entry| entry.unwrap().path()));
            continue;
        }
        let suffix = path.extension().and_then(|s| s.to_str());
        if suffix.is_some_and(|s| suffixes.contains(&s)) {
            let text = std::fs::read_to_string(&path).unwrap();
            found.push((name(&path), text));
        }
    }
    assert!(!found.is_empty(), "nothing in {folders:?}");
    found.sort();
    found
}

/// Path from the root, with slashes.
fn name(path: &Path) -> String {
    let inside = path.strip_prefix(root()).unwrap();
    inside.to_str().unwrap().replace('\\', "/")
}

fn rust() -> Vec<(String, String)> {
    files(&["src"], &["rs"])
}

/// Everything that people write, without the documents.
fn code() -> Vec<(String, String)> {
    let mut all = files(
        &[
            "src", "shaders", "examples", "tests", "scripts", "build", "build.rs",
        ],
        &[
            "rs", "glsl", "comp", "rgen", "rmiss", "rchit", "rahit", "sh",
        ],
    );
    // This file names the words that it forbids.
    all.retain(|(path, _)| path != "tests/architecture.rs");
    all
}

/// The module of the library that a file belongs to: `src/film.rs` and `src/film/…` to `film`.
fn module(path: &str) -> &str {
    let inside = path.strip_prefix("src/").unwrap();
    inside.split(['/', '.']).next().unwrap()
}

/// The line without what follows `//`.
fn without_comment(line: &str) -> &str {
    line.split("//").next().unwrap()
}

/// First names behind `crate::` in code: `crate::a::b` and `use crate::{a, b::c}`.
fn crate_paths(text: &str) -> BTreeSet<String> {
    let code: String = text
        .lines()
        .map(without_comment)
        .collect::<Vec<_>>()
        .join("\n");
    let mut names = BTreeSet::new();
    for (at, _) in code.match_indices("crate::") {
        let before = code[..at].chars().next_back();
        if before.is_some_and(|c| c.is_alphanumeric() || c == '_') {
            continue;
        }
        let rest = &code[at + "crate::".len()..];
        let first = |part: &str| {
            let part = part.trim_start();
            let end = part.find(|c: char| !c.is_alphanumeric() && c != '_');
            part[..end.unwrap_or(part.len())].to_owned()
        };
        match rest.strip_prefix('{') {
            None => {
                names.insert(first(rest));
            }
            Some(list) => {
                // Entries at depth one, up to the closing brace.
                let mut depth = 1;
                let mut start = 0;
                for (i, c) in list.char_indices() {
                    match c {
                        '{' => depth += 1,
                        '}' => depth -= 1,
                        _ => {}
                    }
                    if depth == 0 || (depth == 1 && c == ',') {
                        names.insert(first(&list[start..i]));
                        start = i + 1;
                    }
                    if depth == 0 {
                        break;
                    }
                }
            }
        }
    }
    names.remove("");
    names
}

#[test]
fn imports_are_understood() {
    let text = "use crate::error::{Error, Result};\n\
                // crate::ghost\n\
                use crate::{film::{self, Film}, gpu};\n\
                fn f() -> crate::Error { mycrate::other() }";
    let names: Vec<_> = crate_paths(text).into_iter().collect();
    assert_eq!(names, ["Error", "error", "film", "gpu"]);
}

#[test]
fn modules_import_only_what_lies_below_them() {
    let mut seen = BTreeSet::new();
    for (path, text) in rust() {
        let from = module(&path);
        if ["lib", "main", "cli"].contains(&from) {
            continue;
        }
        let Some((_, allowed)) = MAY_USE.iter().find(|(name, _)| *name == from) else {
            panic!(
                "{path}: give `{from}` a line in the table of this test and of docs/architecture.md"
            );
        };
        for to in crate_paths(&text) {
            // lib.rs re-exports these two.
            let to = match to.as_str() {
                "Error" | "Result" => "error",
                other => other,
            };
            assert!(
                to == from || allowed.contains(&to),
                "{path}: `{from}` may not import `{to}`"
            );
            seen.insert((from.to_owned(), to.to_owned()));
        }
    }
    for (from, allowed) in MAY_USE {
        for to in *allowed {
            let edge = ((*from).to_owned(), (*to).to_owned());
            assert!(
                seen.contains(&edge),
                "nothing uses {from} → {to} any more: remove it"
            );
        }
    }
}

#[test]
fn architecture_document_has_the_same_table() {
    let document = std::fs::read_to_string(root().join("docs/architecture.md")).unwrap();
    for (from, allowed) in MAY_USE {
        let to = match allowed {
            [] => String::from("nothing"),
            some => some
                .iter()
                .map(|m| format!("`{m}`"))
                .collect::<Vec<_>>()
                .join(", "),
        };
        let line = format!("| `{from}` | {to} |");
        assert!(
            document.contains(&line),
            "docs/architecture.md lacks {line}"
        );
    }
}

#[test]
fn architecture_document_names_every_file() {
    let document = std::fs::read_to_string(root().join("docs/architecture.md")).unwrap();
    let mut folder = String::new();
    let mut listed = BTreeSet::new();
    // The map: a line `src/bvh/` opens a folder, indented lines name files in it.
    for line in document.split("```").nth(1).unwrap().lines() {
        let Some(word) = line.split_whitespace().next() else {
            continue;
        };
        if !line.starts_with(' ') {
            folder = word.to_owned();
        } else if let Some(indented) = line.strip_prefix("  ") {
            // Deeper lines go on with a description.
            if !indented.starts_with(' ') {
                listed.insert(format!("{folder}{word}"));
            }
        }
    }
    let real: BTreeSet<String> = files(
        &["src", "shaders", "examples"],
        &["rs", "glsl", "comp", "rgen", "rmiss", "rchit", "rahit"],
    )
    .into_iter()
    .map(|(path, _)| path)
    .filter(|path| !path.starts_with("shaders/tests/"))
    .collect();
    let missing: Vec<_> = real.difference(&listed).collect();
    assert!(missing.is_empty(), "the map lacks {missing:?}");
    let gone: Vec<_> = listed
        .iter()
        .filter(|path| !root().join(path).exists())
        .collect();
    assert!(
        gone.is_empty(),
        "the map names {gone:?}, which are not there"
    );
}

#[test]
fn files_are_short() {
    for (path, text) in code() {
        let lines = text.lines().count();
        assert!(
            lines <= MAX_LINES,
            "{path} has {lines} lines; {MAX_LINES} at most"
        );
    }
}

#[test]
fn unsafe_stays_with_vulkan_and_printing_with_the_program() {
    for (path, text) in rust() {
        for (number, line) in (1..).zip(text.lines()) {
            let line = without_comment(line);
            let has = |word: &str| {
                line.split(|c: char| !c.is_alphanumeric() && c != '_')
                    .any(|w| w == word)
            };
            if !path.starts_with("src/gpu/") {
                assert!(!has("unsafe"), "{path}:{number}: unsafe outside src/gpu");
            }
            if !path.starts_with("src/cli/") {
                for word in ["println", "eprintln", "print", "eprint"] {
                    let call = line.contains(&format!("{word}!"));
                    assert!(
                        !(call && has(word)),
                        "{path}:{number}: printing outside src/cli"
                    );
                }
            }
        }
    }
}

#[test]
fn library_does_not_unwrap() {
    for (path, text) in rust() {
        // Unit tests stand at the end of a file, or in a file of their own.
        if text.lines().any(|l| l.starts_with("#![cfg(test)]")) || is_test_module(&path) {
            continue;
        }
        let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap();
        for (number, line) in (1..).zip(code.lines()) {
            assert!(
                !without_comment(line).contains(".unwrap()"),
                "{path}:{number}: .unwrap()"
            );
        }
    }
}

/// Whether the module's parent compiles it for tests only.
fn is_test_module(path: &str) -> bool {
    let (folder, file) = path.rsplit_once('/').unwrap();
    let stem = file.strip_suffix(".rs").unwrap();
    [format!("{folder}/mod.rs"), format!("{folder}.rs")]
        .iter()
        .filter_map(|parent| std::fs::read_to_string(root().join(parent)).ok())
        .any(|parent| parent.contains(&format!("#[cfg(test)]\nmod {stem};")))
}

#[test]
fn nothing_unfinished_or_local_is_left() {
    for (path, text) in code() {
        for (number, line) in (1..).zip(text.lines()) {
            for word in ["dbg!", "todo!", "unimplemented!", "FIXME", "XXX"] {
                assert!(!line.contains(word), "{path}:{number}: {word}");
            }
            for (at, _) in line.match_indices("TODO") {
                let issue = line[at + "TODO".len()..].strip_prefix("(#");
                let is_numbered =
                    issue.is_some_and(|i| i.starts_with(|c: char| c.is_ascii_digit()));
                assert!(is_numbered, "{path}:{number}: TODO without (#issue)");
            }
            // Homes and scratch folders of one machine.
            for place in ["/home/", "/root/", "/Users/", "C:\\"] {
                assert!(
                    !line.contains(place),
                    "{path}:{number}: path of one machine"
                );
            }
        }
    }
}
