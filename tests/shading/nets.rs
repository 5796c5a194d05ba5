//! Samples of a block are a scrambled Sobol net: evenly spread within the block,
//! uniform and independent from one block to the next.

use bytemuck::{Pod, Zeroable};
use etendue::gpu::BindingKind;
use etendue::layout::BLOCK_LEVEL;
use etendue::spec::Spec;

use crate::statistics::{Estimate, Family, chi_square};
use crate::{Kernel, finish, groups, open};

const COUNT: usize = 1 << 20;
const BLOCK: usize = 1 << BLOCK_LEVEL;

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

/// Whether each of `BLOCK` cells, `columns` wide in x, holds one point.
fn fills(points: impl Iterator<Item = (f32, f32)>, columns: usize) -> bool {
    let rows = BLOCK / columns;
    let mut cells = [0; BLOCK];
    for (x, y) in points {
        cells[(x * columns as f32) as usize * rows + (y * rows as f32) as usize] += 1;
    }
    cells == [1; BLOCK]
}

#[test]
fn blocks_are_nets() {
    let Some(kernel) = kernel() else { return };
    for place in [[0, 0], [1, 0], [1, 1], [2, 0], [1000, 2]] {
        for (pixel, block) in draw(&kernel, 32, BLOCK, place)
            .chunks_exact(BLOCK)
            .enumerate()
        {
            for c in 0..4 {
                let column = block.iter().map(|d| (d.number[c], 0.0));
                assert!(fills(column, BLOCK), "{place:?}, pixel {pixel}, number {c}");
            }
            // The planes of the first three numbers have no gaps of any shape.
            for (x, y) in [(0, 1), (0, 2), (1, 2)] {
                for columns in [2, 4, 8] {
                    let plane = block.iter().map(|d| (d.number[x], d.number[y]));
                    assert!(
                        fills(plane, columns),
                        "{place:?}, pixel {pixel}, numbers {x} and {y}, {columns} columns"
                    );
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
fn block_means(values: &[f64]) -> Estimate {
    let means = values.chunks_exact(BLOCK);
    Estimate::of(means.map(|b| b.iter().sum::<f64>() / BLOCK as f64))
}

#[test]
fn nets_integrate_without_bias_and_slots_do_not_go_together() {
    let Some(kernel) = kernel() else { return };
    let a = draw(&kernel, 0, BLOCK, [1, 0]);
    let b = draw(&kernel, 0, BLOCK, [1, 1]);
    let u = |d: &Draw, c: usize| f64::from(d.number[c]) - 0.5;
    let assert_zero = |name: &str, values: &[f64]| {
        let seen = block_means(values);
        assert!(seen.mean.abs() < seen.chance(), "{name}: {seen:?}");
        // of one block
        seen.error.powi(2) * (seen.degrees + 1.0)
    };
    // ∫ (x − ½)(y − ½) = 0, with variance 1/144 for one sample.
    let independent = 1.0 / 144.0 / BLOCK as f64;
    for i in 0..4 {
        let line: Vec<f64> = a.iter().map(|d| u(d, i)).collect();
        let variance = assert_zero(&format!("number {i}"), &line);
        // Stratified into 16 parts: 16⁻² of 1/12 for each sample.
        let gain = 1.0 / 12.0 / BLOCK as f64 / variance;
        assert!(gain > 0.95 * 256.0, "number {i}: gain {gain}");
        for j in 0..4 {
            let across: Vec<f64> = a.iter().zip(&b).map(|(a, b)| u(a, i) * u(b, j)).collect();
            let variance = assert_zero(&format!("slots, {i} and {j}"), &across);
            // Padding by shuffles: as good as independent, no better and no worse.
            let ratio = variance / independent;
            assert!((0.8..1.1).contains(&ratio), "slots, {i} and {j}: {ratio}");
            if j < i {
                let inside: Vec<f64> = a.iter().map(|d| u(d, i) * u(d, j)).collect();
                let variance = assert_zero(&format!("numbers {i} and {j}"), &inside);
                println!("numbers {i}, {j}: gain {:.1}", independent / variance);
                assert!(variance < independent, "numbers {i} and {j}");
            }
        }
    }
    close(kernel);
}
