//! The generator: uniform, independent, never 0 or 1, no number twice.

use bytemuck::{Pod, Zeroable};
use etendue::gpu::BindingKind;

use crate::statistics::{Family, Z, chi_square};
use crate::{Kernel, finish, groups, open};

const RANDOM: &str = "test_shading_random";

/// Draws of one block.
const COUNT: usize = 1 << 20;
const SAMPLES: u32 = 1 << 10;

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Draw {
    key: [u32; 4],
    number: [f32; 4],
}

/// 1024 samples (they run fastest) of each of 1024 pixels.
#[derive(Clone, Copy, Default)]
struct Block {
    seed: [u32; 2],
    pixel: u32,
    sample: u64,
    event: u32,
    slot: u32,
}

fn draw(kernel: &Kernel, block: Block) -> Vec<Draw> {
    let draws = kernel.output::<Draw>(COUNT);
    let push = [
        block.seed[0],
        block.seed[1],
        block.pixel,
        block.sample as u32,
        (block.sample >> 32) as u32,
        block.event,
        block.slot,
        SAMPLES,
        COUNT as u32,
    ];
    kernel.run(&[(0, &draws)], &push, groups(COUNT));
    draws.read(COUNT).unwrap()
}

fn column(draws: &[Draw], component: usize) -> Vec<f32> {
    draws.iter().map(|d| d.number[component]).collect()
}

/// χ² over 256 bins.
fn uniformity(x: &[f32]) -> f64 {
    let mut counts = [0; 256];
    for &u in x {
        counts[(u * 256.0) as usize] += 1;
    }
    chi_square(&counts, &[1.0 / 256.0; 256])
}

/// χ² of pairs over 32 × 32 bins.
fn independence<'a>(pairs: impl Iterator<Item = (&'a f32, &'a f32)>) -> f64 {
    let mut counts = [0; 1024];
    for (x, y) in pairs {
        counts[(x * 32.0) as usize * 32 + (y * 32.0) as usize] += 1;
    }
    chi_square(&counts, &[1.0 / 1024.0; 1024])
}

fn kernel() -> Option<Kernel> {
    let device = open()?;
    Some(Kernel::new(
        &device,
        RANDOM,
        &[(0, BindingKind::Storage)],
        &[],
        9,
    ))
}

fn close(kernel: Kernel) {
    let device = kernel.device.clone();
    drop(kernel);
    finish(device);
}

#[test]
fn numbers_are_uniform_and_inside() {
    let Some(kernel) = kernel() else { return };
    let mut family = Family::default();
    let events = [(0, 0), (1, 0), (1, 1), (1, 2), (2, 0), (7, 1), (1000, 0)];
    for (event, slot) in events {
        let block = Block {
            seed: [7, 0],
            event,
            slot,
            ..Block::default()
        };
        let draws = draw(&kernel, block);
        for component in 0..4 {
            let x = column(&draws, component);
            // Odd multiples of 2⁻²⁴ in (0, 1): neither 0 nor 1 is among them.
            let is_inside = |u: &f32| *u > 0.0 && *u < 1.0 && (u * 16_777_216.0) as u32 % 2 == 1;
            assert!(x.iter().all(is_inside), "event {event}, slot {slot}");
            family.add(format!("event {event}.{slot}.{component}"), uniformity(&x));
        }
    }
    family.assert("uniform");
    close(kernel);
}

#[test]
fn dimensions_pixels_samples_and_seeds_are_independent() {
    let Some(kernel) = kernel() else { return };
    let mut family = Family::default();
    let base = Block {
        seed: [7, 0],
        pixel: 1000,
        event: 1,
        ..Block::default()
    };
    let x = draw(&kernel, base);
    let first: Vec<Vec<f32>> = (0..4).map(|c| column(&x, c)).collect();

    // Dimensions of one event, and of the next slot and event.
    let mut dimensions = first.clone();
    for other in [Block { slot: 1, ..base }, Block { event: 2, ..base }] {
        let draws = draw(&kernel, other);
        dimensions.extend((0..4).map(|c| column(&draws, c)));
    }
    for i in 0..dimensions.len() {
        for j in 0..i {
            let p = independence(dimensions[i].iter().zip(&dimensions[j]));
            family.add(format!("dimensions {i}, {j}"), p);
        }
    }
    // The same draw one sample, pixel, seed or 2³² samples away.
    let neighbours = [
        ("sample", Block { sample: 1, ..base }),
        (
            "pixel",
            Block {
                pixel: 1001,
                ..base
            },
        ),
        (
            "row",
            Block {
                pixel: 1000 + 1920,
                ..base
            },
        ),
        (
            "seed",
            Block {
                seed: [8, 0],
                ..base
            },
        ),
        (
            "high seed",
            Block {
                seed: [7, 1],
                ..base
            },
        ),
        (
            "2³² samples",
            Block {
                sample: 1 << 32,
                ..base
            },
        ),
    ];
    for (name, other) in neighbours {
        let draws = draw(&kernel, other);
        for c in 0..4 {
            for (d, x) in first.iter().enumerate() {
                let y = column(&draws, c);
                family.add(
                    format!("next {name}, {d} {c}"),
                    independence(x.iter().zip(&y)),
                );
            }
        }
    }
    family.assert("independent");

    // Autocorrelation along samples and along pixels at 64 lags.
    // |ρ| > Z/√N has probability 1e-6 each, 5e-4 for all 512.
    let bound = Z / (COUNT as f64).sqrt();
    let mut worst = 0.0_f64;
    for x in &first {
        let along_samples: Vec<f64> = x.iter().map(|&u| f64::from(u) - 0.5).collect();
        let s = SAMPLES as usize;
        let along_pixels: Vec<f64> = (0..COUNT)
            .map(|i| along_samples[i % (COUNT / s) * s + i / (COUNT / s)])
            .collect();
        for series in [along_samples, along_pixels] {
            for lag in 1..=64 {
                let sum: f64 = series.iter().zip(&series[lag..]).map(|(a, b)| a * b).sum();
                // The variance of a uniform number is 1/12.
                let rho = 12.0 * sum / (COUNT - lag) as f64;
                worst = worst.max(rho.abs());
                assert!(rho.abs() < bound, "lag {lag}: {rho}");
            }
        }
    }
    println!("autocorrelation {worst:.1e} at most, bound {bound:.1e}");
    close(kernel);
}

#[test]
fn no_pixel_sample_shares_its_key() {
    let Some(kernel) = kernel() else { return };
    let seeded = Block {
        seed: [7, 0],
        event: 1,
        ..Block::default()
    };
    // Around sample 2³², whose low half starts again, beside the first samples of all.
    let crossing = Block {
        sample: (1 << 32) - u64::from(SAMPLES) / 2,
        ..seeded
    };
    let blocks = [
        seeded,
        crossing,
        Block {
            seed: [8, 0],
            ..seeded
        },
        Block {
            seed: [0, 7],
            ..seeded
        },
    ];
    let mut keys: Vec<[u32; 4]> = Vec::new();
    let mut family = Family::default();
    for block in blocks {
        let draws = draw(&kernel, block);
        family.add(
            format!("sample {}", block.sample),
            uniformity(&column(&draws, 0)),
        );
        keys.extend(draws.iter().map(|d| d.key));
    }
    let count = keys.len();
    keys.sort_unstable();
    keys.dedup();
    // Four million keys of 128 bits: two alike would be chance with probability 2e-26.
    assert_eq!(keys.len(), count, "keys are shared");
    family.assert("keys");
    close(kernel);
}
