//! A corpus of files that mean harm, given to the program: each is refused with the code of a bad scene, soon, with little
//! memory, and without a look at anything outside the scene's folder. What is opened is recorded by strace.
#![cfg(target_os = "linux")]
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "tests may unwrap; they print what they measured"
)]

#[path = "loader/builder.rs"]
#[expect(dead_code, reason = "tests/loader uses the rest")]
mod builder;
#[path = "hostile/corpus.rs"]
mod corpus;
#[path = "hostile/pictures.rs"]
mod pictures;
#[path = "common/tier.rs"]
mod tier;

use std::collections::BTreeSet;
use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use corpus::{Case, corpus};
use tempfile::TempDir;

/// From the start to the end of the program; a busy machine included.
const LONGEST: Duration = Duration::from_secs(20);
/// Memory beyond twice the files of a scene, bytes: what as many nodes take as are allowed, and
/// the program. Of the address space, which the system can enforce, and so of what is resident.
const MEMORY: u64 = 512 << 20;
/// A scene that cannot be read.
const BAD_SCENE: i32 = 3;

/// A folder for the scene, one beside it whose files a slip would read, and one to write to.
struct Place {
    root: TempDir,
}

impl Place {
    fn new() -> Self {
        let place = Self {
            root: tempfile::tempdir().unwrap(),
        };
        for name in ["scene", "secrets", "out"] {
            fs::create_dir(place.path(name)).unwrap();
        }
        corpus::plant(&place.path("secrets"));
        place
    }

    /// Links resolved.
    fn path(&self, name: &str) -> PathBuf {
        self.root.path().canonicalize().unwrap().join(name)
    }

    /// Renders the scene with a limit on memory; `before` stands before the program.
    fn render(&self, before: &[&str], more: &[&str], memory: u64) -> Output {
        let start = Instant::now();
        let mut child = Command::new("sh")
            .args([
                "-c",
                "ulimit -v $0; exec \"$@\"",
                &(memory >> 10).to_string(),
            ])
            .args(before)
            .arg(env!("CARGO_BIN_EXE_etendue"))
            .args([
                "render",
                "../scene/scene.gltf",
                "-o",
                "a.exr",
                "--width",
                "8",
                "--spp",
                "1",
            ])
            .args(more)
            .current_dir(self.path("out"))
            .env_remove("RUST_LOG")
            .env_remove("RUST_BACKTRACE")
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        while child.try_wait().unwrap().is_none() {
            if start.elapsed() > LONGEST {
                end(&mut child);
            }
            sleep(Duration::from_millis(1));
        }
        child.wait_with_output().unwrap()
    }

    /// What the program opened, or tried to, in the same way.
    fn opened(&self, more: &[&str]) -> (Output, BTreeSet<PathBuf>) {
        let log = self.root.path().join("log");
        let before = [
            "strace",
            "-f",
            "-qq",
            "-e",
            "trace=open,openat,openat2,creat",
            "-o",
        ];
        let before = [&before[..], &[log.to_str().unwrap()]].concat();
        // strace itself takes some
        let output = self.render(&before, more, MEMORY * 2 + 2 * size(&self.path("scene")));
        let text = fs::read_to_string(&log)
            .unwrap_or_else(|error| panic!("strace, which scripts/setup.sh installs: {error}"));
        let paths = text.lines().filter_map(|line| {
            let (call, rest) = line.split_once('"')?;
            let (path, _) = rest.split_once('"')?;
            let is_open = call.contains("open") || call.contains("creat(");
            assert!(
                call.contains("AT_FDCWD") || path.starts_with('/') || !is_open,
                "{line}"
            );
            is_open.then(|| self.path("out").join(path))
        });
        (output, paths.collect())
    }

    /// Of what was opened, all that lies neither in the scene's folder nor in that of the output.
    fn outside(&self, opened: BTreeSet<PathBuf>) -> BTreeSet<PathBuf> {
        let is_outside = |path: &PathBuf| {
            let path = path.canonicalize().unwrap_or_else(|_| path.clone());
            !["scene", "out"]
                .iter()
                .any(|name| path.starts_with(self.path(name)))
        };
        opened.into_iter().filter(is_outside).collect()
    }
}

fn end(child: &mut Child) -> ! {
    child.kill().unwrap();
    panic!("after {LONGEST:?} it still runs");
}

/// Of the files in a folder, as far as they are on the disk, bytes; links not followed.
fn size(folder: &Path) -> u64 {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
    let sizes = entries.filter_map(|entry| entry.metadata().ok());
    sizes
        .filter(|meta| meta.is_file())
        .map(|meta| meta.blocks() * 512)
        .sum()
}

/// What is wrong with how a file was met.
fn check(case: &Case, is_recorded: bool, harmless: &BTreeSet<PathBuf>) -> Vec<String> {
    let place = Place::new();
    (case.write)(&place.path("scene"), &place.path("secrets"));
    let mut wrong = Vec::new();
    let mut check_refusal = |output: &Output| {
        let message = String::from_utf8_lossy(&output.stderr);
        let shown: String = message.chars().take(300).collect();
        let left = fs::read_dir(place.path("out")).unwrap().count();
        for (what, is_so) in [
            ("code", output.status.code() == Some(BAD_SCENE)),
            (
                "message",
                message.contains(case.says) && message.len() < 1000,
            ),
            ("a secret", !message.contains(corpus::SECRET)),
            ("files are left", left == 0),
        ] {
            if !is_so {
                wrong.push(format!("{}: {what}: {} {shown}", case.name, output.status));
            }
        }
    };
    let files = size(&place.path("scene"));
    check_refusal(&place.render(&[], &[], MEMORY + 2 * files));
    if is_recorded {
        let (output, opened) = place.opened(&[]);
        check_refusal(&output);
        for path in place.outside(opened).difference(harmless) {
            wrong.push(format!("{}: opened {}", case.name, path.display()));
        }
    }
    wrong
}

/// What the program opens anyway: its libraries. A scene that is refused at once, so no driver.
fn harmless() -> BTreeSet<PathBuf> {
    let place = Place::new();
    fs::write(place.path("scene/scene.gltf"), "{}").unwrap();
    let (output, opened) = place.opened(&[]);
    assert_eq!(output.status.code(), Some(BAD_SCENE));
    assert!(
        opened.contains(&place.path("out/../scene/scene.gltf")),
        "{opened:?}"
    );
    place.outside(opened)
}

#[test]
fn the_recorder_sees_what_is_opened_outside() {
    let harmless = harmless();
    assert!(!harmless.is_empty());
    let place = Place::new();
    corpus::write_whole(&place.path("scene"));
    // files of the command line may lie anywhere
    let env = place.path("secrets/broken.hdr");
    let (output, opened) = place.opened(&["--env", env.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(BAD_SCENE), "{output:?}");
    assert!(
        opened.contains(&place.path("scene/inside.bin")),
        "{opened:?}"
    );
    let outside: Vec<_> = place
        .outside(opened)
        .difference(&harmless)
        .cloned()
        .collect();
    assert_eq!(outside, [env]);
}

#[test]
fn hostile_files_are_refused_and_open_nothing_outside_their_folder() {
    let cases = corpus();
    let names: BTreeSet<_> = cases.iter().map(|case| case.name).collect();
    assert_eq!(names.len(), cases.len());
    assert!(cases.len() >= 60, "{}", cases.len());
    let harmless = harmless();
    let step = (cases.len() as u64 / tier::count(12, cases.len() as u64)) as usize;
    let start = Instant::now();
    let (mut recorded, mut wrong) = (0, Vec::new());
    for (i, case) in cases.iter().enumerate() {
        let is_recorded = i % step == 0;
        recorded += usize::from(is_recorded);
        wrong.extend(check(case, is_recorded, &harmless));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    println!(
        "{} files refused, {recorded} recorded, in {:.1?}",
        cases.len(),
        start.elapsed()
    );
}
