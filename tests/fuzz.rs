//! Readers of files met with damaged ones: small valid files, a few bytes changed, cut, repeated or swapped. Whatever
//! comes of it, it comes back as a value or an error, soon and with bounded memory, and not as a panic.
//!
//! The damage is a function of the number of the case, so that each can be made again: a failure prints it.
//! `ETENDUE_NIGHTLY=1` runs a hundred thousand of each target, `ETENDUE_FUZZ=N` N. `scripts/fuzz.sh` looks for damage
//! that reaches code which no other did.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "tests may unwrap; they print how many cases ran"
)]

#[path = "loader/builder.rs"]
#[expect(dead_code, reason = "tests/loader uses the rest")]
mod builder;
#[path = "common/random.rs"]
#[expect(dead_code, reason = "no real numbers here")]
mod random;
#[path = "common/seeds.rs"]
mod seeds;
#[path = "common/tier.rs"]
mod tier;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::{Duration, Instant};

use builder::data_uri;
use etendue::checkpoint;
use etendue::image_io::read_exr;
use etendue::scene::gltf::{Limits, load_with};
use etendue::scene::load_environment;
use random::Random;
use serde_json::json;

/// No small file may take longer; a busy machine included.
const LONGEST: Duration = Duration::from_secs(5);
/// Memory of this process, bytes.
const MOST_MEMORY: u64 = 1 << 30;

impl Random {
    fn below(&mut self, n: usize) -> usize {
        (self.bits() % n.max(1) as u64) as usize
    }
}

/// Numbers that readers get wrong.
const ODD: [u32; 10] = [
    0,
    1,
    0x7F,
    0xFF,
    0x7FFF_FFFF,
    0x8000_0000,
    0xFFFF_FFFF,
    0x7FC0_0000,
    0x7F80_0000,
    0x0001_0000,
];
/// Words that mean something in JSON or in numbers.
const WORDS: [&str; 14] = [
    "-1",
    "0",
    "1e999",
    "1e-999",
    "18446744073709551616",
    "null",
    "[]",
    "{}",
    "\"\"",
    "true",
    "[[[[",
    "\"\\u0000\"",
    "2147483648",
    "0.5",
];

/// A change, or up to eight.
fn damage(bytes: &mut Vec<u8>, random: &mut Random) {
    let most = [1, 8][random.below(2)];
    for _ in 0..1 + random.below(most) {
        let at = random.below(bytes.len());
        let end = (at + 1 + random.below(32)).min(bytes.len());
        match random.below(9) {
            _ if bytes.is_empty() => bytes.push(random.bits() as u8),
            0 => bytes[at] ^= 1 << random.below(8),
            1 => bytes[at] = random.bits() as u8,
            2 => bytes.truncate(at),
            3 => drop(bytes.drain(at..end)),
            4 => {
                let part = bytes[at..end].to_vec();
                let to = random.below(bytes.len());
                bytes.splice(to..to, part);
            }
            5 if at + 4 <= bytes.len() => {
                let odd = ODD[random.below(ODD.len())];
                bytes[at..at + 4].copy_from_slice(&odd.to_le_bytes());
            }
            6 => {
                // A number of a text becomes another word.
                let is_digit = |b: &u8| b.is_ascii_digit() || matches!(b, b'.' | b'-');
                if let Some(first) = bytes[at..].iter().position(is_digit) {
                    let first = at + first;
                    let rest = bytes[first..].iter().position(|b| !is_digit(b));
                    let last = rest.map_or(bytes.len(), |n| first + n);
                    let word = WORDS[random.below(WORDS.len())];
                    bytes.splice(first..last, word.bytes());
                }
            }
            7 => {
                let to = random.below(bytes.len());
                bytes.swap(at, to);
            }
            _ => bytes[at] = bytes[at].wrapping_add(1),
        }
    }
}

/// Most memory that this process ever had in use, bytes; 0 outside Linux.
fn peak_memory() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    let kibibytes = line.and_then(|l| l.trim().strip_suffix("kB")?.trim().parse::<u64>().ok());
    kibibytes.unwrap_or(0) * 1024
}

/// Reads damaged copies of the seeds; `read` says whether one was accepted.
fn fuzz(target: &str, suffix: &str, seeds: &[Vec<u8>], read: impl Fn(&Path) -> bool) {
    let asked = std::env::var("ETENDUE_FUZZ").ok();
    let cases = match asked.and_then(|n| n.parse().ok()) {
        Some(cases) => cases,
        None => tier::count(3000, 100_000),
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(format!("case.{suffix}"));
    for seed in seeds {
        std::fs::write(&path, seed).unwrap();
        assert!(read(&path), "{target}: a seed is not accepted");
    }
    let (mut accepted, mut slowest) = (0u64, Duration::ZERO);
    for case in 0..cases {
        let mut random = Random(case.wrapping_mul(0x2545_F491_4F6C_DD1D) ^ target.len() as u64);
        let mut bytes = seeds[random.below(seeds.len())].clone();
        damage(&mut bytes, &mut random);
        if target == "checkpoint" {
            // The checksum is made right again, mostly.
            if random.below(8) > 0 {
                seeds::seal(&mut bytes);
            }
        }
        std::fs::write(&path, &bytes).unwrap();
        let start = Instant::now();
        let result = catch_unwind(AssertUnwindSafe(|| read(&path)));
        slowest = slowest.max(start.elapsed());
        assert!(slowest <= LONGEST, "{target} {case}: {slowest:?}");
        assert!(peak_memory() <= MOST_MEMORY, "{target} {case}: memory");
        accepted += u64::from(result.unwrap_or_else(|_| panic!("{target} {case} panics")));
    }
    println!(
        "{target}: {cases} damaged files, {accepted} accepted, slowest {:.0} ms, peak {} MiB",
        1e3 * slowest.as_secs_f64(),
        peak_memory() >> 20
    );
    // Some damage must get past the first check.
    assert!(accepted > 0 && accepted < cases);
}

/// Small enough that accepted claims stay cheap.
fn loads(path: &Path) -> bool {
    let limits = Limits {
        texels: 1 << 22,
        ..Limits::default()
    };
    load_with(path, &limits).is_ok()
}

#[test]
fn damaged_gltf() {
    fuzz("gltf", "gltf", &seeds::gltf(), loads);
}

#[test]
fn damaged_glb() {
    fuzz("glb", "glb", &seeds::glb(), loads);
}

/// PNG and JPEG by themselves: what is around them is whole.
#[test]
fn damaged_images() {
    fuzz("images", "bin", &seeds::images(), |path| {
        let mut asset = seeds::asset();
        let bytes = std::fs::read(path).unwrap();
        asset.set("/images", json!([{ "uri": data_uri(&bytes) }]));
        let scene = path.with_file_name("scene.gltf");
        std::fs::write(&scene, asset.to_gltf()).unwrap();
        loads(&scene)
    });
}

#[test]
fn damaged_checkpoints() {
    fuzz("checkpoint", "ck", &seeds::checkpoints(), |path| {
        checkpoint::read(path).is_ok()
    });
}

#[test]
fn damaged_exr() {
    fuzz("exr", "exr", &seeds::exr(), |path| {
        read_exr(path).is_ok_and(|image| {
            // Sums of shards are read from images as well.
            let _ = image.film();
            true
        })
    });
    fuzz("environment", "exr", &seeds::exr()[..1], |path| {
        load_environment(path).is_ok()
    });
}

#[test]
fn damaged_hdr() {
    fuzz("hdr", "hdr", &seeds::hdr(), |path| {
        load_environment(path).is_ok()
    });
}
