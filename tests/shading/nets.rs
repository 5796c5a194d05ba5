//! Two scrambled nets take turns, a block of samples each: the samples of either are evenly spread, those of two nets
//! independent.

use bytemuck::{Pod, Zeroable};
use etendue::gpu::BindingKind;
use etendue::layout::{BLOCK_LEVEL, NET_LEVEL};
use etendue::spec::Spec;

use crate::statistics::{Estimate, Family, chi_square};
use crate::{Kernel, finish, groups, open};

const COUNT: usize = 1 << 20;
const BLOCK: usize = 1 << BLOCK_LEVEL;
const NET: usize = 1 << NET_LEVEL;

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

/// The samples of one of the two nets that take turns in some samples, from the beginning of a pair on.
fn net(samples: &[Draw], which: usize) -> Vec<Draw> {
    let blocks = samples.chunks_exact(BLOCK).skip(which).step_by(2);
    blocks.flatten().copied().collect()
}

/// Digits that the planes of two numbers lack for the first 2^m samples of a net, m = 4 … 8, so that a cell may hold 2^lacks points:
/// x with y, z and w; y with z and w; z with w.
const LACKS: [(usize, usize, [u32; 5]); 6] = [
    (0, 1, [0, 1, 1, 0, 1]),
    (0, 2, [0, 1, 1, 1, 0]),
    (0, 3, [1, 1, 1, 1, 2]),
    (1, 2, [0, 0, 0, 0, 0]),
    (1, 3, [0, 1, 1, 0, 1]),
    (2, 3, [0, 0, 1, 0, 0]),
];

/// Each beginning of a net is a net, too.
#[test]
fn samples_in_turn_are_nets() {
    let Some(kernel) = kernel() else { return };
    // the first pair of nets, and the second
    for first in [0, 2 * NET] {
        for place in [[0, 0], [1, 0], [1, 1], [2, 0], [1000, 2]] {
            for (pixel, pair) in draw(&kernel, first as u32, 2 * NET, place)
                .chunks_exact(2 * NET)
                .enumerate()
            {
                for which in 0..2 {
                    let samples = net(pair, which);
                    for m in BLOCK_LEVEL..=NET_LEVEL {
                        let what = format!(
                            "{place:?}, pixel {pixel}, 2^{m} samples of net {which} from {first} on"
                        );
                        assert_net(&samples[..1 << m], m, &what);
                    }
                }
            }
        }
    }
    close(kernel);
}

/// 2^m samples are spread as evenly as the columns of the net allow.
fn assert_net(samples: &[Draw], m: u32, what: &str) {
    for c in 0..4 {
        let line = samples.iter().map(|d| (d.number[c], 0.0));
        assert_eq!(most(line, 1 << m, 1), 1, "{what}, number {c}");
    }
    for (x, y, lacks) in LACKS {
        let lacks = lacks[(m - BLOCK_LEVEL) as usize];
        for columns in 1..m - lacks {
            let plane = samples.iter().map(|d| (d.number[x], d.number[y]));
            let seen = most(plane, 1 << columns, 1 << (m - lacks - columns));
            assert!(
                seen <= 1 << lacks,
                "{what}, numbers {x} and {y}, 2^{columns} columns: {seen}"
            );
        }
    }
}

#[test]
fn nets_are_independent_of_each_other() {
    let Some(kernel) = kernel() else { return };
    let mut family = Family::default();
    // One sample of each net: the first of the first, the last of the first block of the second, and one of the next pair.
    let mut numbers: Vec<Vec<f32>> = Vec::new();
    let places = [
        (0, [1, 0]),
        (0, [1, 1]),
        (0, [2, 0]),
        (31, [1, 0]),
        (512, [1, 0]),
    ];
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
    family.assert("independent nets");
    let count = keys.len();
    keys.sort_unstable();
    keys.dedup();
    assert_eq!(keys.len(), count, "nets share their keys");
    close(kernel);
}

/// Mean of the means of nets.
fn net_means(values: &[f64], net: usize) -> Estimate {
    let means = values.chunks_exact(net);
    Estimate::of(means.map(|n| n.iter().sum::<f64>() / net as f64))
}

#[test]
fn nets_integrate_without_bias_and_slots_do_not_go_together() {
    let Some(kernel) = kernel() else { return };
    // The first block of the first net, and whole nets: of four pairs, so that as many are drawn.
    for size in [BLOCK, NET] {
        let of = |place| -> Vec<Draw> {
            if size == BLOCK {
                return draw(&kernel, 0, BLOCK, place);
            }
            let pairs = (1..5).flat_map(|k| draw(&kernel, 2 * k * NET as u32, 2 * NET, place));
            let pairs: Vec<Draw> = pairs.collect();
            let pairs = pairs.chunks_exact(2 * NET);
            pairs
                .flat_map(|pair| [net(pair, 0), net(pair, 1)].concat())
                .collect()
        };
        let (a, b) = (of([1, 0]), of([1, 1]));
        let u = |d: &Draw, c: usize| f64::from(d.number[c]) - 0.5;
        let assert_zero = |name: &str, values: &[f64]| {
            let seen = net_means(values, size);
            assert!(seen.mean.abs() < seen.chance(), "{name}: {seen:?}");
            // of one net
            seen.error.powi(2) * (seen.degrees + 1.0)
        };
        // ∫ (x − ½)(y − ½) = 0, with variance 1/144 for one sample.
        let independent = 1.0 / 144.0 / size as f64;
        for i in 0..4 {
            let line: Vec<f64> = a.iter().map(|d| u(d, i)).collect();
            let variance = assert_zero(&format!("number {i}"), &line);
            // Stratified into as many parts as samples, n: n⁻² of 1/12 for each sample.
            let gain = 1.0 / 12.0 / size as f64 / variance;
            let parts = (size * size) as f64;
            // Whole nets are fewer.
            let least = if size == BLOCK { 0.95 } else { 0.93 };
            assert!(gain > least * parts, "{size}, number {i}: gain {gain}");
            for j in 0..4 {
                let across: Vec<f64> = a.iter().zip(&b).map(|(a, b)| u(a, i) * u(b, j)).collect();
                let variance = assert_zero(&format!("slots, {i} and {j}"), &across);
                // Padding by shuffles: as good as independent, no better and no worse.
                let ratio = variance / independent;
                println!("{size}: slots {i} and {j}: {ratio:.3}");
                assert!(
                    (0.8..1.1).contains(&ratio),
                    "{size}: slots, {i} and {j}: {ratio}"
                );
                if j < i {
                    let inside: Vec<f64> = a.iter().map(|d| u(d, i) * u(d, j)).collect();
                    let variance = assert_zero(&format!("numbers {i} and {j}"), &inside);
                    println!(
                        "{size}: numbers {i}, {j}: gain {:.1}",
                        independent / variance
                    );
                    assert!(variance < independent, "{size}: numbers {i} and {j}");
                }
            }
        }
    }
    close(kernel);
}
