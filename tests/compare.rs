//! `compare` raises no more false alarms than it says, whatever the pixels are like, and finds what is planted.
//!
//! The gate looks at some dozens of pairs of renders; `ETENDUE_NIGHTLY=1` at a thousand of each kind.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "tests may unwrap; they print measured figures and why they skip"
)]

#[path = "common/random.rs"]
mod random;

use std::path::Path;

use etendue::Error;
use etendue::compare::{Comparison, Options, Side, Source, compare, compare_sides};
use etendue::image_io::{Aov, Channel, Image, Metadata};
use etendue::render::{Control, DeviceOptions, Renderer};
use etendue::scene::{Scene, gltf};
use etendue::settings::{BackendChoice, Crop, Settings};
use glam::Vec4;
use random::Random;

/// Rates of false alarms that are looked at.
const LEVELS: [f64; 2] = [0.01, 0.05];
/// Standard deviations of a count that chance does not exceed but once in a thousand.
const Z: f64 = 3.1;

fn is_nightly() -> bool {
    std::env::var_os("ETENDUE_NIGHTLY").is_some_and(|value| value == "1")
}

/// `gate` pairs in the gate, a thousand at night.
fn pairs(gate: u64) -> u64 {
    if is_nightly() { 1000 } else { gate }
}

/// Asserts that the p-values of pairs without a difference fall below each level no more often than the level says.
fn assert_calibrated(what: &str, p: &[f64]) {
    for level in LEVELS {
        let alarms = p.iter().filter(|&&p| p < level).count() as f64;
        let n = p.len() as f64;
        println!("{what}: {alarms} of {n} below {level}");
        let bound = n * level + Z * (n * level * (1.0 - level)).sqrt();
        assert!(alarms <= bound, "{what}: {alarms} alarms of {n} at {level}");
    }
}

/// What one sample of a pixel can be like.
type Law = fn(&mut Random) -> f64;

const LAWS: [(&str, Law); 6] = [
    ("uniform", |r| r.unit()),
    // as a camera ray at an edge, or a small lamp met by chance
    ("binary", |r| f64::from(r.unit() < 0.2)),
    ("rare", |r| f64::from(r.unit() < 1e-3)),
    ("fireflies", |r| {
        0.1 * r.unit() + if r.unit() < 1e-4 { 1000.0 } else { 0.0 }
    }),
    // P(x > t) = t^−2.2: σ is finite, σ of σ is not
    ("heavy tail", |r| (1.0 - r.unit()).powf(-1.0 / 2.2) - 1.0),
    ("no variance", |r| (1.0 - r.unit()).powf(-1.0 / 1.2) - 1.0),
];

/// An image of `side` × `side` pixels of `n` samples with the law.
fn drawn(random: &mut Random, law: Law, side: usize, n: u64) -> Side {
    let mut mean = [const { Vec::new() }; 3];
    let mut variance = [const { Vec::new() }; 3];
    for channel in 0..3 {
        for _ in 0..side * side {
            let (mut average, mut deviations) = (0.0, 0.0);
            for k in 1..=n {
                let x = law(random);
                let d = x - average;
                average += d / k as f64;
                deviations += d * (x - average);
            }
            mean[channel].push(average);
            variance[channel].push(deviations / (n * (n - 1)) as f64);
        }
    }
    Side {
        mean,
        variance: Some(variance),
        source: Some(Source::StandardError),
        count: Some(vec![n as f64; side * side]),
        parts: None,
        shared: [1, 1],
        rounding: 0.0,
        notes: Vec::new(),
    }
}

#[test]
fn alarms_are_as_rare_as_they_should_be_for_any_law() {
    for (name, law) in LAWS {
        for (n, m) in [(2, 2), (16, 16), (64, 64), (16, 512), (512, 4)] {
            let mut random = Random(n * 1000 + m);
            let mut p = Vec::new();
            for _ in 0..pairs(60) {
                let sides = [n, m].map(|n| drawn(&mut random, law, 16, n));
                p.push(compare_sides(&sides, 16, 0.05).p.unwrap());
            }
            assert_calibrated(&format!("{name}, {n} and {m} samples"), &p);
        }
    }
}

/// Gives all pixels of a block the values of its first one.
fn share(side: &mut Side, width: usize, block: [usize; 2]) {
    let first = |i: usize| {
        let (x, y) = (i % width, i / width);
        (y - y % block[1]) * width + x - x % block[0]
    };
    let all = side
        .mean
        .iter_mut()
        .chain(side.variance.iter_mut().flatten());
    for values in all {
        *values = (0..values.len()).map(|i| values[first(i)]).collect();
    }
    side.shared = block;
}

/// Pixels of blocks that are wrong together: no more alarms, and too many where the files do not tell.
#[test]
fn alarms_are_as_rare_as_they_should_be_where_pixels_share() {
    const WIDTH: usize = 32;
    for (name, law) in LAWS {
        let mut random = Random(77);
        let (mut p, mut untold) = (Vec::new(), Vec::new());
        for k in 0..pairs(60) {
            let mut sides = [16, 64].map(|n| drawn(&mut random, law, WIDTH, n));
            share(&mut sides[0], WIDTH, [4, 2]);
            if k % 2 == 0 {
                share(&mut sides[1], WIDTH, [4, 2]);
            }
            p.push(compare_sides(&sides, WIDTH, 0.05).p.unwrap());
            sides.iter_mut().for_each(|side| side.shared = [1, 1]);
            untold.push(compare_sides(&sides, WIDTH, 0.05).p.unwrap());
        }
        assert_calibrated(name, &p);
        if name == "uniform" {
            let alarms = untold.iter().filter(|p| **p < 0.05).count();
            assert!(4 * alarms > untold.len(), "{alarms} without the header");
        }
    }
}

/// Renders with a new seed each time.
struct Samples {
    renderer: Renderer,
    seed: u64,
}

impl Samples {
    fn new(scene: &Scene, side: u32) -> Option<Self> {
        let settings = Settings {
            width: side,
            height: side,
            backend: BackendChoice::Bvh,
            ..Settings::default()
        };
        let required = std::env::var_os("ETENDUE_REQUIRE_DEVICE").is_some();
        match Renderer::new(scene, &settings, &DeviceOptions::default()) {
            Ok(renderer) => Some(Self { renderer, seed: 0 }),
            Err(error @ Error::Unsupported { .. }) if !required => {
                println!("skipped: {error}");
                None
            }
            Err(error) => panic!("{error}"),
        }
    }

    fn image(&mut self, samples: u64) -> Image {
        self.seed += 1;
        self.renderer.restart(0..samples, self.seed).unwrap();
        let film = self.renderer.render(&mut |_| Control::Continue).unwrap();
        Image::from_film(&film, &[Aov::StandardError, Aov::Samples], Metadata::new()).unwrap()
    }
}

fn scene(name: &str) -> Scene {
    gltf::load(
        &Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("scenes")
            .join(name),
    )
    .unwrap()
}

fn judged(a: &Image, b: &Image, alpha: f64) -> Comparison {
    let options = Options {
        alpha,
        spp: [None; 2],
    };
    compare(a, b, &options).unwrap()
}

#[test]
fn alarms_are_as_rare_as_they_should_be_for_renders() {
    for name in ["cornell.gltf", "glass.gltf"] {
        let Some(mut source) = Samples::new(&scene(name), 32) else {
            return;
        };
        for (n, m) in [(16, 16), (64, 64), (16, 256)] {
            let mut p = Vec::new();
            let mut families = [const { Vec::new() }; 3];
            for _ in 0..pairs(30) {
                let (a, b) = (source.image(n), source.image(m));
                let result = judged(&a, &b, 0.05);
                p.push(result.p.unwrap());
                for (all, family) in families.iter_mut().zip(&result.families) {
                    all.push(family.p);
                }
            }
            for (p, family) in families.iter().zip(["image", "tile", "pixel"]) {
                assert_calibrated(&format!("{name}, {n} and {m} samples, {family}"), p);
            }
            assert_calibrated(&format!("{name}, {n} and {m} samples"), &p);
        }
    }
}

/// 1 % more or less albedo of one material, at 128 × 128 pixels and 512 samples, is found at the default α: at night in 38 of 40 pairs
/// of each material at least.
#[test]
fn a_hundredth_of_an_albedo_is_found() {
    let original = scene("cornell.gltf");
    let Some(mut left) = Samples::new(&original, 128) else {
        return;
    };
    for (material, gate) in [("white", 3), ("green", 3), ("red", 1)] {
        let count = pairs(gate).min(40);
        let mut changed = original.clone();
        let index = changed.materials.iter().position(|m| m.name == material);
        changed.materials[index.unwrap()].base_color *= Vec4::new(0.99, 0.99, 0.99, 1.0);
        let mut right = Samples::new(&changed, 128).unwrap();
        let mut found = 0;
        for _ in 0..count {
            let (a, b) = (left.image(512), right.image(512));
            let result = judged(&a, &b, 1e-3);
            let p = result.families.iter().map(|f| format!("{:.0e}", f.p));
            let p: Vec<_> = p.collect();
            println!(
                "{material}: {p:?}, detectable {:.2e}",
                result.detectable.unwrap()
            );
            found += u64::from(result.is_different.unwrap());
        }
        println!("{material}: {found} of {count} found");
        assert!(found as f64 >= 0.95 * count as f64, "{material}");
        // Not because the samples differ: the scene against itself.
        let (a, b) = (left.image(512), left.image(512));
        assert_eq!(judged(&a, &b, 1e-3).is_different, Some(false));
    }
}

fn image(channels: &[(&str, Vec<f32>)]) -> Image {
    let (width, height) = (4, channels[0].1.len() as u32 / 4);
    Image {
        window: Crop {
            x0: 0,
            y0: 0,
            x1: width,
            y1: height,
        },
        full: (width, height),
        channels: (channels.iter())
            .map(|(name, values)| Channel {
                name: (*name).to_owned(),
                values: values.clone(),
            })
            .collect(),
        metadata: Metadata::new(),
    }
}

/// R, G and B with the same values, and layers of the same values named `layer` + R …
fn grey(values: &[f32], layer: Option<(&str, f32)>) -> Image {
    let mut channels = Vec::new();
    for c in ["R", "G", "B"] {
        channels.push((String::from(c), values.to_vec()));
        if let Some((name, value)) = layer {
            channels.push((format!("{name}.{c}"), vec![value; values.len()]));
        }
    }
    let named: Vec<_> = channels
        .iter()
        .map(|(n, v)| (n.as_str(), v.clone()))
        .collect();
    image(&named)
}

#[test]
fn metrics_are_what_they_are_called() {
    let a = grey(&[1.1, 2.2, 0.0, 4.4], None);
    let b = grey(&[1.0, 2.0, 0.0, 4.0], None);
    let result = judged(&a, &b, 1e-3);
    assert_eq!((result.is_different, result.p), (None, None));
    let m = result.metrics;
    let close = |x: f64, y: f64| assert!((x / y - 1.0).abs() < 1e-5, "{x} {y}");
    close(m.rmse, ((0.01f64 + 0.04 + 0.16) / 4.0).sqrt());
    close(m.epsilon, 0.0175);
    for bias in m.bias {
        close(bias, 0.1);
    }
    let e = 0.0175;
    close(
        m.mape,
        (0.1 / (1.0 + e) + 0.2 / (2.0 + e) + 0.4 / (4.0 + e)) / 4.0,
    );
    let square = |d: f64, b: f64| d * d / (b * b + e * e);
    close(
        m.relmse,
        (square(0.1, 1.0) + square(0.2, 2.0) + square(0.4, 4.0)) / 4.0,
    );
    close(m.psnr, 20.0 * (4.0 / m.rmse).log10());
    close(m.largest, 0.4);
    assert!(judged(&a, &a, 1e-3).is_identical && !result.is_identical);
}

#[test]
fn layers_of_other_renderers_are_understood() {
    let options = Options {
        alpha: 1e-3,
        spp: [Some(64.0); 2],
    };
    let values = vec![1.0; 64];
    // The same noise said in three ways: per sample σ² = 0.16, of the mean 0.0025.
    let ways = [
        ("stderr", 0.05),
        ("Variance", 0.16),
        ("m2_nested", 1.0 + 0.0025 * 63.0),
    ];
    let mut p = Vec::new();
    for way in ways {
        let (a, b) = (grey(&values, Some(way)), grey(&[1.02; 64], Some(way)));
        let result = compare(&a, &b, &options).unwrap();
        assert_eq!(result.is_different, Some(false));
        p.push(result.p.unwrap());
        // 64 pixels: the mean is known to 0.05 √2 / 8.
        let c = grey(&[1.08; 64], Some(way));
        assert_eq!(compare(&a, &c, &options).unwrap().is_different, Some(true));
        // Without a number of samples two of them say nothing.
        if way.0 != "stderr" {
            let result = judged(&a, &c, 1e-3);
            assert_eq!(result.is_different, None);
            assert!(result.notes[0].contains("--spp"), "{:?}", result.notes);
        }
        // One side alone.
        let exact = compare(&a, &grey(&[1.08; 64], None), &options).unwrap();
        assert_eq!((exact.is_different, exact.families.len()), (Some(true), 2));
    }
    assert!(p.iter().all(|q| (q / p[0] - 1.0).abs() < 1e-3), "{p:?}");
    // Blender's names; luminance alone.
    let combined = image(
        &["Scene.Combined.R", "Scene.Combined.G", "Scene.Combined.B"].map(|n| (n, values.clone())),
    );
    let y = image(&[("Y", values.clone())]);
    assert!(judged(&combined, &y, 1e-3).is_identical);
    assert!(compare(&image(&[("Z", values)]), &y, &options).is_err());
}

#[test]
fn what_is_no_noise_is_no_chance() {
    let noise = Some(("stderr", 0.05));
    let mut hole = vec![1.0; 64];
    let a = grey(&hole, noise);
    hole[9] = f32::NAN;
    let b = grey(&hole, noise);
    let result = judged(&a, &b, 1e-3);
    assert_eq!(
        (result.is_different, result.not_finite),
        (Some(true), [0, 1, 0])
    );
    // Missing in both is counted and no difference.
    let result = judged(&b, &b, 1e-3);
    assert_eq!(
        (result.is_different, result.not_finite),
        (Some(false), [0, 0, 1])
    );
    // A single sample has no error.
    let one = Some(("stderr", f32::INFINITY));
    assert_eq!(
        judged(&grey(&[1.0; 64], one), &grey(&[2.0; 64], one), 1e-3).is_different,
        None
    );
    // No noise at all: rounding is forgiven, more is not.
    let exact = Some(("stderr", 0.0));
    let of = |v: f32| judged(&grey(&[1.0; 64], exact), &grey(&[v; 64], exact), 1e-3).is_different;
    assert_eq!((of(1.000_005), of(1.001)), (Some(false), Some(true)));
    // 16-bit floats: the difference is their rounding.
    let ramp: Vec<f32> = (0..64).map(|i| 0.1 + 0.037 * i as f32).collect();
    let half = |v: &f32| f32::from_bits((v.to_bits() + 0x1000) & !0x1fff);
    let halved: Vec<f32> = ramp.iter().map(half).collect();
    let result = judged(&grey(&ramp, exact), &grey(&halved, exact), 1e-3);
    assert_eq!(
        (result.is_different, result.is_identical),
        (Some(false), false)
    );
}

#[test]
fn windows_must_be_the_same() {
    let a = grey(&[1.0; 64], None);
    let mut b = grey(&[1.0; 60], None);
    let options = Options {
        alpha: 1e-3,
        spp: [None; 2],
    };
    let message = |b: &Image| compare(&a, b, &options).unwrap_err().to_string();
    assert!(
        message(&b).contains("4 × 16 pixels and B 4 × 15"),
        "{}",
        message(&b)
    );
    b = a.clone();
    b.full = (8, 16);
    assert!(message(&b).contains("frame of 8 × 16"), "{}", message(&b));
}
