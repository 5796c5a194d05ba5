//! The grid of a node, on which the boxes of its children are kept.

use obvhs::aabb::Aabb;

/// Smallest biased exponent of a cell: keeps the cell and its products with ray slopes normal numbers.
const MIN_CELL_EXPONENT: i32 = 27;
/// Cells along an axis.
const CELLS: f64 = 255.0;

/// Cells of a power of two along each axis, from a corner.
pub(super) struct Grid {
    low: [f64; 3],
    /// Biased exponents of the size of a cell.
    pub(super) exponents: [i32; 3],
}

impl Grid {
    /// The finest grid that holds a box, which may not be empty.
    pub(super) fn around(bounds: &Aabb) -> Self {
        let mut grid = Self {
            low: [0, 1, 2].map(|axis| f64::from(bounds.min[axis])),
            exponents: [MIN_CELL_EXPONENT; 3],
        };
        for axis in 0..3 {
            let (low, high) = (grid.low[axis], f64::from(bounds.max[axis]));
            if low > high {
                continue; // an empty box
            }
            let least = ((high - low) / CELLS).log2().ceil() as i32 + 127;
            let mut exponent = least.clamp(MIN_CELL_EXPONENT, 254);
            while low + CELLS * cell(exponent) < high {
                exponent += 1; // the logarithm was rounded down
            }
            grid.exponents[axis] = exponent;
        }
        grid
    }

    /// Planes of the box on the grid along an axis, rounded outwards: what they stand for contains the box exactly.
    pub(super) fn planes(&self, bounds: &Aabb, axis: usize) -> [f64; 2] {
        let (low, cell) = (self.low[axis], cell(self.exponents[axis]));
        let (min, max) = (f64::from(bounds.min[axis]), f64::from(bounds.max[axis]));
        let mut lower = ((min - low) / cell).floor().clamp(0.0, CELLS);
        let mut upper = ((max - low) / cell).ceil().clamp(0.0, CELLS);
        // Subtraction may round when the magnitudes differ very much.
        while low + lower * cell > min {
            lower -= 1.0;
        }
        while low + upper * cell < max {
            upper += 1.0;
        }
        [lower, upper]
    }

    /// Half of the surface of the box on the grid.
    pub(super) fn half_area(&self, bounds: &Aabb) -> f64 {
        let [x, y, z] = [0, 1, 2].map(|axis| {
            let [lower, upper] = self.planes(bounds, axis);
            (upper - lower) * cell(self.exponents[axis])
        });
        x * y + y * z + z * x
    }
}

/// Size of a cell with this biased exponent.
fn cell(exponent: i32) -> f64 {
    f64::powi(2.0, exponent - 127)
}
