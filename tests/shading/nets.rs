//! Samples of a block are a scrambled Sobol net: evenly spread within the block,
//! uniform and independent from one block to the next.

use bytemuck::{Pod, Zeroable};
use etendue::gpu::BindingKind;
use etendue::layout::{BLOCK_LEVEL, MAX_BLOCK_LEVEL};
use etendue::spec::Spec;

use crate::statistics::{Estimate, Family, chi_square};
use crate::{Kernel, finish, groups, open};

const COUNT: usize = 1 << 20;

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Draw {
    key: [u32; 4],
    number: [f32; 4],
}

fn kernel() -> Option<Kernel> {
    let device = open()?;
    let storage = [(0, BindingKind::Storage)];
    let strata = Spec {
        strata: true,
        ..Spec::default()
    };
    Some(Kernel::new(
        &device,
        "test_shading_random",
        &storage,
        &strata.constants(),
        9,
    ))
}

fn close(kernel: Kernel) {
    let device = kernel.device.clone();
    drop(kernel);
    finish(device);
}

/// `samples` (they run fastest) from `first` on of as many pixels as there are numbers for.
fn draw(kernel: &Kernel, first: u32, samples: usize, [event, slot]: [u32; 2]) -> Vec<Draw> {
    let draws = kernel.output::<Draw>(COUNT);
    let push = [7, 0, 0, first, 0, event, slot, samples as u32, COUNT as u32];
    kernel.run(&[(0, &draws)], &push, groups(COUNT));
    draws.read(COUNT).unwrap()
}

/// The most points in a cell of a grid of `columns` × `rows`, where each has one if points are spread evenly.
fn most(points: impl Iterator<Item = (f32, f32)>, columns: usize, rows: usize) -> u32 {
    let mut cells = vec![0; columns * rows];
    for (x, y) in points {
        cells[(x * columns as f32) as usize * rows + (y * rows as f32) as usize] += 1;
    }
    cells.into_iter().max().unwrap()
}

/// Digits that the planes of two numbers lack for the first 2^m samples of a block, m = 4 … 8, so that a cell may hold 2^lacks points:
/// x with y, z and w; y with z and w; z with w.
const LACKS: [(usize, usize, [u32; 5]); 6] = [
    (0, 1, [0, 1, 1, 0, 1]),
    (0, 2, [0, 1, 1, 1, 0]),
    (0, 3, [1, 1, 1, 1, 2]),
    (1, 2, [0, 0, 0, 0, 0]),
    (1, 3, [0, 1, 1, 0, 1]),
    (2, 3, [0, 0, 1, 0, 0]),
];

/// Four blocks of 16, then two of each double size; each of their beginnings is a net, too.
#[test]
fn blocks_are_nets() {
    let Some(kernel) = kernel() else { return };
    for level in BLOCK_LEVEL..=MAX_BLOCK_LEVEL {
        // the first block of this size, and the second
        let start = if level == BLOCK_LEVEL { 0 } else { 2 << level };
        for (number, place) in [
            (0, [0, 0]),
            (1, [1, 0]),
            (0, [1, 1]),
            (1, [2, 0]),
            (0, [1000, 2]),
        ] {
            let block = 1_usize << level;
            let first = start + (number << level);
            for (pixel, samples) in draw(&kernel, first, block, place)
                .chunks_exact(block)
                .enumerate()
            {
                for m in BLOCK_LEVEL..=level {
                    let what = format!(
                        "{place:?}, pixel {pixel}, 2^{m} of the 2^{level} samples from {first} on"
                    );
                    let part = &samples[..1 << m];
                    for c in 0..4 {
                        let line = part.iter().map(|d| (d.number[c], 0.0));
                        assert_eq!(most(line, 1 << m, 1), 1, "{what}, number {c}");
                    }
                    for (x, y, lacks) in LACKS {
                        let lacks = lacks[(m - BLOCK_LEVEL) as usize];
                        for columns in 1..m - lacks {
                            let plane = part.iter().map(|d| (d.number[x], d.number[y]));
                            let seen = most(plane, 1 << columns, 1 << (m - lacks - columns));
                            assert!(
                                seen <= 1 << lacks,
                                "{what}, numbers {x} and {y}, 2^{columns} columns: {seen}"
                            );
                        }
                    }
                }
            }
        }
    }
    close(kernel);
}

#[test]
fn blocks_are_independent_of_each_other() {
    let Some(kernel) = kernel() else { return };
    let mut family = Family::default();
    // One sample of each block: the first of the first and the last of the third.
    let mut numbers: Vec<Vec<f32>> = Vec::new();
    let places = [(0, [1, 0]), (0, [1, 1]), (0, [2, 0]), (47, [1, 0])];
    let mut keys: Vec<[u32; 4]> = Vec::new();
    for (sample, place) in places {
        let draws = draw(&kernel, sample, 1, place);
        for c in 0..4 {
            numbers.push(draws.iter().map(|d| d.number[c]).collect());
        }
        if place == [1, 0] {
            keys.extend(draws.iter().map(|d| d.key));
        }
    }
    for (i, x) in numbers.iter().enumerate() {
        let mut counts = [0; 256];
        for u in x {
            assert!(*u > 0.0 && *u < 1.0, "number {i}");
            counts[(u * 256.0) as usize] += 1;
        }
        let p = chi_square(&counts, &[1.0 / 256.0; 256]);
        family.add(format!("number {i} is uniform"), p);
        for (j, y) in numbers[..i].iter().enumerate() {
            let mut counts = [0; 1024];
            for (x, y) in x.iter().zip(y) {
                counts[(x * 32.0) as usize * 32 + (y * 32.0) as usize] += 1;
            }
            let p = chi_square(&counts, &[1.0 / 1024.0; 1024]);
            family.add(format!("numbers {i}, {j}"), p);
        }
    }
    family.assert("independent blocks");
    let count = keys.len();
    keys.sort_unstable();
    keys.dedup();
    assert_eq!(keys.len(), count, "blocks share their keys");
    close(kernel);
}

/// Mean of the means of blocks.
fn block_means(values: &[f64], block: usize) -> Estimate {
    let means = values.chunks_exact(block);
    Estimate::of(means.map(|b| b.iter().sum::<f64>() / block as f64))
}

#[test]
fn nets_integrate_without_bias_and_slots_do_not_go_together() {
    let Some(kernel) = kernel() else { return };
    // The first blocks, and the first of the largest.
    for (first, level) in [(0, BLOCK_LEVEL), (512, MAX_BLOCK_LEVEL)] {
        let block = 1_usize << level;
        let a = draw(&kernel, first, block, [1, 0]);
        let b = draw(&kernel, first, block, [1, 1]);
        let u = |d: &Draw, c: usize| f64::from(d.number[c]) - 0.5;
        let assert_zero = |name: &str, values: &[f64]| {
            let seen = block_means(values, block);
            assert!(seen.mean.abs() < seen.chance(), "{name}: {seen:?}");
            // of one block
            seen.error.powi(2) * (seen.degrees + 1.0)
        };
        // ∫ (x − ½)(y − ½) = 0, with variance 1/144 for one sample.
        let independent = 1.0 / 144.0 / block as f64;
        for i in 0..4 {
            let line: Vec<f64> = a.iter().map(|d| u(d, i)).collect();
            let variance = assert_zero(&format!("number {i}"), &line);
            // Stratified into as many parts as samples, n: n⁻² of 1/12 for each sample.
            let gain = 1.0 / 12.0 / block as f64 / variance;
            let parts = (block * block) as f64;
            // The largest are 4096 blocks only.
            let least = if level == BLOCK_LEVEL { 0.95 } else { 0.93 };
            assert!(gain > least * parts, "{block}, number {i}: gain {gain}");
            for j in 0..4 {
                let across: Vec<f64> = a.iter().zip(&b).map(|(a, b)| u(a, i) * u(b, j)).collect();
                let variance = assert_zero(&format!("slots, {i} and {j}"), &across);
                // Padding by shuffles: as good as independent, no better and no worse.
                let ratio = variance / independent;
                println!("{block}: slots {i} and {j}: {ratio:.3}");
                assert!(
                    (0.8..1.1).contains(&ratio),
                    "{block}: slots, {i} and {j}: {ratio}"
                );
                if j < i {
                    let inside: Vec<f64> = a.iter().map(|d| u(d, i) * u(d, j)).collect();
                    let variance = assert_zero(&format!("numbers {i} and {j}"), &inside);
                    println!(
                        "{block}: numbers {i}, {j}: gain {:.1}",
                        independent / variance
                    );
                    assert!(variance < independent, "{block}: numbers {i} and {j}");
                }
            }
        }
    }
    close(kernel);
}
