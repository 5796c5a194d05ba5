//! Tests by their names, for tables that point at them and runs that start them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Of the repository.
pub fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// All text below a folder, or of a file.
fn text_below(path: &Path) -> String {
    if !path.is_dir() {
        return std::fs::read_to_string(path).unwrap_or_default();
    }
    let entries = path.read_dir().unwrap();
    entries.map(|e| text_below(&e.unwrap().path())).collect()
}

/// Whether a test of this name (test binary, `::`, name of the test) is written down:
/// its last word as a function, in the binary's folder.
pub fn has_test(name: &str) -> bool {
    let (binary, name) = name.split_once("::").unwrap();
    let function = format!("fn {}()", name.rsplit("::").next().unwrap());
    let places = match binary {
        "etendue" => vec![root().join("src")],
        _ => vec![
            root().join("tests").join(binary),
            root().join(format!("tests/{binary}.rs")),
        ],
    };
    places.iter().any(|p| text_below(p).contains(&function))
}

/// Test binaries by name, built with these features: those named (`etendue` is the library), or all.
pub fn binaries(features: &[&str], names: &[&str]) -> BTreeMap<String, PathBuf> {
    let cargo = std::env::var_os("CARGO").expect("run by cargo");
    let target = |name: &&str| match *name {
        "etendue" => vec![String::from("--lib")],
        name => vec![String::from("--test"), name.to_owned()],
    };
    let arguments = "test --release --locked --no-run --message-format=json";
    let built = Command::new(cargo)
        .args(arguments.split(' '))
        .args(features.iter().flat_map(|f| ["--features", f]))
        .args(names.iter().flat_map(target))
        .current_dir(root())
        .stderr(Stdio::inherit())
        .output()
        .unwrap();
    assert!(built.status.success(), "the tests do not build");
    let mut found = BTreeMap::new();
    for line in String::from_utf8(built.stdout).unwrap().lines() {
        let Ok(message) = serde_json::from_str::<serde_json::Value>(line) else {
            continue;
        };
        let name = message["target"]["name"].as_str();
        let kind = &message["target"]["kind"][0];
        let is_program = kind == "bin" || kind == "example";
        if let (Some(name), Some(path), false) = (name, message["executable"].as_str(), is_program)
        {
            found.insert(name.to_owned(), PathBuf::from(path));
        }
    }
    found
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    Passed,
    Failed,
    Stuck,
}

/// Runs one test with these variables in its environment; what it printed comes along.
pub fn run(
    binaries: &BTreeMap<String, PathBuf>,
    test: &str,
    environment: &[(&str, &std::ffi::OsStr)],
    time_out: Duration,
) -> (Outcome, String) {
    let (binary, name) = test.split_once("::").unwrap();
    let mut child = Command::new(&binaries[binary])
        .args([name, "--exact", "--test-threads=1", "--nocapture"])
        .current_dir(root())
        .envs(environment.iter().copied())
        .env("ETENDUE_REQUIRE_DEVICE", "1")
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut stdout = child.stdout.take().unwrap();
    let reader = std::thread::spawn(move || {
        let mut text = String::new();
        std::io::Read::read_to_string(&mut stdout, &mut text).map(|_| text)
    });
    let started = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        // A test that hangs has found something too.
        if started.elapsed() > time_out {
            child.kill().unwrap();
            child.wait().unwrap();
            return (Outcome::Stuck, String::new());
        }
        std::thread::sleep(Duration::from_millis(20));
    };
    let text = reader.join().unwrap().unwrap_or_default();
    assert!(
        text.contains("running 1 test"),
        "{test} is not a test: {text}"
    );
    let outcome = if status.success() {
        Outcome::Passed
    } else {
        Outcome::Failed
    };
    (outcome, text)
}
