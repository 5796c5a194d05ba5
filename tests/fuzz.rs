//! Readers of files met with damaged ones: small valid files, a few bytes changed, cut, repeated or swapped. Whatever
//! comes of it, it comes back as a value or an error, soon and with bounded memory, and not as a panic.
//!
//! The damage is a function of the number of the case, so that each can be made again: a failure prints it.
//! `ETENDUE_NIGHTLY=1` runs a million of each target, `ETENDUE_FUZZ=N` N.
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
#[path = "common/tier.rs"]
mod tier;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::{Duration, Instant};

use builder::{Asset, data_uri, png};
use etendue::checkpoint;
use etendue::film::Film;
use etendue::image_io::{Aov, Image, Metadata, read_exr, write_exr};
use etendue::scene::gltf::{Limits, load_with};
use etendue::scene::load_environment;
use etendue::settings::Crop;
use random::Random;
use serde_json::json;
use sha2::{Digest, Sha256};

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
        None => tier::count(3000, 1_000_000),
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
            seal(&mut bytes, &mut random);
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

/// The checksum at the end is made right again, mostly.
fn seal(bytes: &mut [u8], random: &mut Random) {
    const SUM: usize = 32;
    if bytes.len() > SUM && random.below(8) > 0 {
        let body = bytes.len() - SUM;
        let sum = Sha256::digest(&bytes[..body]);
        bytes[body..].copy_from_slice(&sum);
    }
}

/// A small scene with most of what the loader knows.
fn asset() -> Asset {
    let mut asset = Asset::triangle();
    let normals = asset.floats("VEC3", &[0., 0., 1., 0., 0., 1., 0., 0., 1.]);
    asset.attribute("NORMAL", normals);
    let uvs = asset.floats("VEC2", &[0., 0., 1., 0., 0., 1.]);
    asset.attribute("TEXCOORD_0", uvs);
    let indices = asset.accessor(builder::U16, "SCALAR", 3, &[0, 0, 1, 0, 2, 0]);
    asset.set("/meshes/0/primitives/0/indices", json!(indices));
    asset.set("/meshes/0/primitives/0/material", json!(0));
    let picture = data_uri(&png(2, 2, &[200; 16]));
    asset.set("/images", json!([{ "uri": picture }]));
    asset.set("/samplers", json!([{ "wrapS": 33071, "magFilter": 9728 }]));
    asset.set("/textures", json!([{ "source": 0, "sampler": 0 }]));
    asset.set(
        "/materials",
        json!([{
            "pbrMetallicRoughness": {
                "baseColorFactor": [0.5, 0.6, 0.7, 1.0],
                "baseColorTexture": { "index": 0 },
                "roughnessFactor": 0.3,
            },
            "emissiveFactor": [1, 0.5, 0],
            "extensions": {
                "KHR_materials_transmission": { "transmissionFactor": 0.5 },
                "KHR_materials_volume": { "thicknessFactor": 1, "attenuationDistance": 2.5, "attenuationColor": [0.5, 0.5, 1] },
                "KHR_materials_ior": { "ior": 1.4 },
                "ETENDUE_medium": { "scattering": [1, 2, 3], "phase": "henyey-greenstein", "g": 0.5 },
            },
        }]),
    );
    asset.set(
        "/cameras",
        json!([{ "type": "perspective", "perspective": { "yfov": 0.7, "znear": 0.1 } }]),
    );
    asset.set(
        "/nodes",
        json!([
            { "mesh": 0, "children": [1], "rotation": [0, 0.6, 0, 0.8] },
            { "camera": 0, "translation": [0, 0, 3] },
        ]),
    );
    asset
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
    let seeds = [
        asset().to_gltf().into_bytes(),
        Asset::triangle().to_gltf().into_bytes(),
    ];
    fuzz("gltf", "gltf", &seeds, loads);
}

#[test]
fn damaged_glb() {
    let seeds = [asset().to_glb(), Asset::triangle().to_glb()];
    fuzz("glb", "glb", &seeds, loads);
}

/// PNG and JPEG by themselves: what is around them is whole.
#[test]
fn damaged_images() {
    let picture = image::DynamicImage::ImageRgb8(image::RgbImage::from_fn(9, 7, |x, y| {
        image::Rgb([x as u8 * 20, y as u8 * 30, (x * y) as u8])
    }));
    let encoded = |format| {
        let mut bytes = std::io::Cursor::new(Vec::new());
        picture.write_to(&mut bytes, format).unwrap();
        bytes.into_inner()
    };
    let seeds = [
        encoded(image::ImageFormat::Png),
        encoded(image::ImageFormat::Jpeg),
    ];
    fuzz("images", "bin", &seeds, |path| {
        let mut asset = asset();
        let bytes = std::fs::read(path).unwrap();
        asset.set("/images", json!([{ "uri": data_uri(&bytes) }]));
        let scene = path.with_file_name("scene.gltf");
        std::fs::write(&scene, asset.to_gltf()).unwrap();
        loads(&scene)
    });
}

fn film() -> Film {
    let window = Crop {
        x0: 1,
        y0: 0,
        x1: 4,
        y1: 2,
    };
    let mut film = Film::new(window, (5, 3), false);
    film.add(0, 3, (0..36).map(|i| i as f32).collect()).unwrap();
    film.add(16, 1, (0..36).map(|i| 0.5 * i as f32).collect())
        .unwrap();
    film
}

fn header() -> Metadata {
    let mut header = Metadata::new();
    header.insert("text".into(), "Größe\n".into());
    header.insert("number".into(), 0.1.into());
    header
}

#[test]
fn damaged_checkpoints() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("c.ck");
    checkpoint::write(&path, &header(), &film()).unwrap();
    let seeds = [std::fs::read(&path).unwrap()];
    fuzz("checkpoint", "ck", &seeds, |path| {
        checkpoint::read(path).is_ok()
    });
}

#[test]
fn damaged_exr() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let mut image = Image::from_film(&film(), &Aov::ALL[..0], header()).unwrap();
    write_exr(&path, &image).unwrap();
    let plain = std::fs::read(&path).unwrap();
    image.push_nodes(&film());
    write_exr(&path, &image).unwrap();
    let seeds = [plain, std::fs::read(&path).unwrap()];
    fuzz("exr", "exr", &seeds, |path| {
        read_exr(path).is_ok_and(|image| {
            // Sums of shards are read from images as well.
            let _ = image.film();
            true
        })
    });
    fuzz("environment", "exr", &seeds[..1], |path| {
        load_environment(path).is_ok()
    });
}

#[test]
fn damaged_hdr() {
    let pixels: Vec<_> = (0..64).map(|i| image::Rgb([i as f32, 1.0, 0.25])).collect();
    let mut bytes = Vec::new();
    let encoder = image::codecs::hdr::HdrEncoder::new(&mut bytes);
    encoder.encode(&pixels, 16, 4).unwrap();
    fuzz("hdr", "hdr", &[bytes], |path| {
        load_environment(path).is_ok()
    });
}
