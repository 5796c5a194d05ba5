//! An environment map as kernels sample it: a density that is bilinear between the centres of texels, and
//! a table of the cells between four of them, along a curve.
//!
//! \[Karlik19\] Karlík, Šik, Vévoda, Skřivan, Křivánek, MIS Compensation: Optimizing
//! Sampling Techniques in Multiple Importance Sampling.

use std::f64::consts::PI;

use glam::Vec3;

use super::curve::along_hilbert;
use super::lights::sampling_weight;
use crate::layout;
use crate::mutant;

/// Share of the mean radiance that direct light leaves to scattering, which finds it as well. \[Karlik19\]
const COMPENSATION: f64 = 1.0;

/// A map that is not black.
pub(crate) struct SampledMap {
    /// Radiance without the map's intensity, and the density in (u, v) over 2π².
    pub texels: Vec<[f32; 4]>,
    /// Where to look for the cell of a place, and the cells between the centres of texels, a row of half the height at each pole.
    pub table: CellTable,
    /// Mean of the map over the sphere, as a scalar for sampling.
    pub mean: f64,
}

impl SampledMap {
    /// `None` for a black map. With `is_compensated` directions that are no brighter than the mean may have
    /// density 0: for estimators that weigh direct light against scattering.
    pub fn new(
        [width, height]: [usize; 2],
        texels: &[[f32; 3]],
        is_compensated: bool,
    ) -> Option<Self> {
        let weights: Vec<f64> = texels
            .iter()
            .map(|t| sampling_weight(Vec3::from(*t)))
            .collect();
        // Lines of u and v are closer together on the sphere towards the poles.
        let sine = |y: usize| (PI * (y as f64 + 0.5) / height as f64).sin();
        let sines: f64 = (0..height).map(sine).sum();
        let rows = || weights.chunks(width).enumerate();
        let mean = rows()
            .map(|(y, row)| sine(y) * row.iter().sum::<f64>())
            .sum::<f64>()
            / (sines * width as f64);
        if mean <= 0.0 {
            return None;
        }
        let less = |floor: f64| -> Vec<f64> {
            rows()
                .flat_map(|(y, row)| row.iter().map(move |w| (w - floor).max(0.0) * sine(y)))
                .collect()
        };
        let mut densities = less(if is_compensated {
            COMPENSATION * mean
        } else {
            0.0
        });
        if densities.iter().all(|d| *d == 0.0) {
            densities = less(0.0);
        }
        let in_cells = cells([width, height], &densities);
        let total: f64 = in_cells.iter().sum();
        let texels = texels
            .iter()
            .zip(&densities)
            .map(|(&[r, g, b], d)| [r, g, b, (d / total / (2.0 * PI * PI)) as f32])
            .collect();
        Some(Self {
            texels,
            table: CellTable::new([width, height + 1], &in_cells),
            mean,
        })
    }
}

/// Cells by their places from 0 to 2³² − 1.
pub(crate) struct CellTable {
    /// Runs of places and then cells, as kernels read them.
    pub words: Vec<[u32; 2]>,
    /// log₂ of the places in a run.
    pub shift: u32,
}

impl CellTable {
    /// Each of `size` cells gets its share of the places, in an order in which neighbours stay together: samples that
    /// are spread evenly over the places are spread evenly over the map.
    fn new(size: [usize; 2], weights: &[f64]) -> Self {
        let scale = (1_u64 << 32) as f64 / weights.iter().sum::<f64>();
        let mut cells: Vec<layout::EnvCell> = Vec::new();
        let (mut sum, mut end) = (0.0, 0_u64);
        along_hilbert(size, &mut |index| {
            sum += weights[index] * scale;
            let next = (sum.round() as u64).min(1 << 32);
            if next > end {
                let (last, cell) = ((next - 1) as u32, index as u32);
                cells.push(layout::EnvCell { last, cell });
                end = next;
            }
        });
        if let Some(cell) = cells.last_mut() {
            cell.last = u32::MAX;
        }
        // Most runs lie in one cell and need no more than a look.
        let level = cells.len().max(2).ilog2();
        let shift = 32 - level;
        let runs = 1_u32 << level;
        let mut at = 0;
        let mut words = Vec::with_capacity(cells.len() + runs as usize);
        for run in 0..runs {
            let last = ((u64::from(run + 1) << shift) - 1) as u32;
            let first = at;
            while cells[at].last < last {
                at += 1;
            }
            words.push(if first == at {
                [cells[at].cell, layout::NONE]
            } else {
                [runs + first as u32, runs + at as u32]
            });
            if cells[at].last == last {
                at += 1;
            }
        }
        words.extend(cells.iter().map(|c| [c.last, c.cell]));
        Self { words, shift }
    }
}

/// Integrals over u and v of what is bilinear between `values` at the centres of texels, around in u, held in v.
fn cells([width, height]: [usize; 2], values: &[f64]) -> Vec<f64> {
    let area = 1.0 / (width * height) as f64;
    let at = |x: usize, y: usize| values[y * width + x % width];
    (0..=height)
        .flat_map(|row| (0..width).map(move |x| (x, row)))
        .map(|(x, row)| {
            let (above, below) = (row.saturating_sub(1), row.min(height - 1));
            let share = if row == 0 || row == height { 0.5 } else { 1.0 };
            if mutant::is("environment-nearest") {
                return share * area * at(x, below);
            }
            let corners = at(x, above) + at(x + 1, above) + at(x, below) + at(x + 1, below);
            share * area * corners / 4.0
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [usize; 2] = [16, 8];

    fn one_bright(others: f32) -> Vec<[f32; 3]> {
        let mut texels = vec![[others; 3]; SIZE[0] * SIZE[1]];
        texels[3 * SIZE[0] + 15] = [100.0, 0.0, 0.0];
        texels
    }

    /// Entries of the cells, after those of the runs.
    fn entries(table: &CellTable) -> &[[u32; 2]] {
        &table.words[1 << (32 - table.shift)..]
    }

    /// Probability of each cell by the table.
    fn chances(map: &SampledMap) -> Vec<f64> {
        let mut chances = vec![0.0; SIZE[0] * (SIZE[1] + 1)];
        let mut first = 0;
        for &[last, cell] in entries(&map.table) {
            let end = u64::from(last) + 1;
            chances[cell as usize] += (end - first) as f64 / (1_u64 << 32) as f64;
            first = end;
        }
        assert_eq!(first, 1 << 32);
        chances
    }

    #[test]
    fn runs_say_where_their_cells_are() {
        for others in [0.0, 0.5] {
            let map = SampledMap::new(SIZE, &one_bright(others), false).unwrap();
            let CellTable { words, shift } = &map.table;
            let entry = |place: u32| {
                let before = entries(&map.table).iter().filter(|e| e[0] < place);
                before.count() + (1 << (32 - shift))
            };
            for run in 0..1_u32 << (32 - shift) {
                let first = entry(run << shift);
                let last = entry((run << shift) | ((1 << shift) - 1));
                let expected = match first == last {
                    true => [words[first][1], layout::NONE],
                    false => [first as u32, last as u32],
                };
                assert_eq!(words[run as usize], expected, "{others}: run {run}");
            }
        }
    }

    #[test]
    fn cells_hold_the_integral_of_the_density() {
        for (others, is_compensated) in [(0.0, false), (0.5, false), (0.5, true)] {
            let map = SampledMap::new(SIZE, &one_bright(others), is_compensated)
                .expect("the map is not black");
            let [width, height] = SIZE;
            let density = |x: usize, y: usize| f64::from(map.texels[y * width + x % width][3]);
            // Midpoints of four by four parts, of a tent in each axis.
            for (i, chance) in chances(&map).into_iter().enumerate() {
                let (x, row) = (i % width, i / width);
                let (above, below) = (row.saturating_sub(1), row.min(height - 1));
                let mut sum = 0.0;
                for part in 0..16 {
                    let [s, t] = [part % 4, part / 4].map(|k| (f64::from(k) + 0.5) / 4.0);
                    let line = |y: usize| (1.0 - s) * density(x, y) + s * density(x + 1, y);
                    sum += ((1.0 - t) * line(above) + t * line(below)) / 16.0;
                }
                let share = if row == 0 || row == height { 0.5 } else { 1.0 };
                let expected = 2.0 * PI * PI * sum * share / (width * height) as f64;
                // Roundings of the table and of the densities.
                assert!(
                    (chance - expected).abs() < 1e-6,
                    "{others} cell {i}: {chance} instead of {expected}"
                );
            }
        }
    }

    #[test]
    fn every_direction_with_light_has_a_density_unless_scattering_finds_it() {
        let lit = |is_compensated| {
            let map = SampledMap::new(SIZE, &one_bright(0.5), is_compensated).unwrap();
            map.texels.iter().filter(|t| t[3] > 0.0).count()
        };
        assert_eq!((lit(false), lit(true)), (SIZE[0] * SIZE[1], 1));
        // A map of one colour has nothing above its mean.
        let plain = SampledMap::new([4, 2], &[[0.3; 3]; 8], true).unwrap();
        assert!(plain.texels.iter().all(|t| t[3] > 0.0));
    }

    #[test]
    fn a_black_map_is_none() {
        assert!(SampledMap::new([2, 1], &[[0.0; 3]; 2], false).is_none());
    }
}
