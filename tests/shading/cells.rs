//! Cells of the sphere that are fine where a lobe is, and integrals over them.

use std::f64::consts::PI;

use glam::DVec3;

/// Cells along θ and φ, as in `shaders/tests/shading_samplers.comp`.
pub const THETA: usize = 32;
pub const PHI: usize = 64;
/// With the one that counts samples without a direction.
pub const CELLS: usize = THETA * PHI + 1;

/// Error allowed in the integral over a cell: one hundredth of a sample in a million.
const CELL_ERROR: f64 = 1e-8;

/// Deepest halving of a cell; 2⁻¹² of a cell resolves every lobe of the tests.
const DEEPEST: u32 = 12;

/// Nodes and weights of Gauss–Legendre on [0, 1], six points.
const GAUSS: [(f64, f64); 6] = [
    (0.033_765_242_898_423_99, 0.085_662_246_189_585_17),
    (0.169_395_306_766_867_74, 0.180_380_786_524_069_3),
    (0.380_690_406_958_401_55, 0.233_956_967_286_345_52),
    (0.619_309_593_041_598_5, 0.233_956_967_286_345_52),
    (0.830_604_693_233_132_3, 0.180_380_786_524_069_3),
    (0.966_234_757_101_576, 0.085_662_246_189_585_17),
];

/// Value of a density and three more functions, integrated together.
pub type Values = [f64; 4];

/// Borders of the cells: angles, radians.
pub struct Grid {
    pub theta: Vec<f64>,
    pub phi: Vec<f64>,
    /// Radians that the border above a row of density 0 is put down.
    floor: f64,
}

impl Grid {
    /// Cells down to `bottom` (radians from +z), dense about a lobe of width `width` that leaves
    /// opposite to `wo`; below `bottom` there is one more row down to −z.
    pub fn new(wo: DVec3, width: f64, bottom: f64) -> Self {
        let theta_o = wo.z.min(1.0).acos();
        let rows = if bottom < PI { THETA - 1 } else { THETA };
        let half_uniform = |t: f64| (1.0 - t.cos()) / (1.0 - bottom.cos());
        let mut theta = invert(rows, bottom, theta_o, width, half_uniform);
        if rows < THETA {
            theta.push(PI);
        }
        let opposite = (-wo.y).atan2(-wo.x).rem_euclid(2.0 * PI);
        // The turn of a facet sideways counts with cot θo; a wide lobe at grazing angles leaves more steeply.
        let cotangent = wo.z / wo.truncate().length().max(1e-9);
        let spread = (width * (cotangent + 0.02 + 0.5 * width)).min(2.0);
        let phi = invert(PHI, 2.0 * PI, opposite, spread, |p| p / (2.0 * PI));
        // A sample on the border to a row of density 0 may round across it.
        Self {
            theta,
            phi,
            floor: 1e-6,
        }
    }

    /// Cells of the whole sphere, dense about two lobes that leave opposite to `wo`: as steeply as `wo`
    /// above, with the cosine `below` to −z under the horizon.
    pub fn of_interface(wo: DVec3, width: f64, below: f64) -> Self {
        let half_uniform = |t: f64| 1.0 - t.cos();
        let half = |cosine: f64| {
            let center = cosine.min(1.0).acos();
            invert(THETA / 2, PI / 2.0, center, width, half_uniform)
        };
        let mut grid = Self::new(wo, width, PI);
        grid.theta = half(wo.z);
        grid.theta
            .extend(half(below).iter().rev().skip(1).map(|t| PI - t));
        grid.floor = 0.0;
        grid
    }

    /// Borders in the coordinates of the kernel.
    pub fn edges(&self) -> Vec<f32> {
        let polar = |(i, t): (usize, &f64)| {
            let t = if i + 2 == self.theta.len() {
                t + self.floor
            } else {
                *t
            };
            let q = if t <= PI / 2.0 {
                (t / 2.0).tan()
            } else {
                2.0 - ((PI - t) / 2.0).tan()
            };
            q as f32
        };
        let azimuth = |p: &f64| {
            let (y, x) = p.sin_cos();
            let r = y / (x.abs() + y.abs());
            // The outermost borders are not read.
            (if x < 0.0 {
                2.0 - r
            } else if r >= 0.0 {
                r
            } else {
                4.0 + r
            }) as f32
        };
        self.theta
            .iter()
            .enumerate()
            .map(polar)
            .chain(self.phi.iter().map(azimuth))
            .collect()
    }

    /// Integrals over every cell of f(direction) dω.
    pub fn integrate(&self, f: &(impl Fn(DVec3) -> Values + Sync)) -> Vec<Values> {
        self.integrate_to(CELL_ERROR, f)
    }

    /// The same with an error of choice in each cell.
    pub fn integrate_to(&self, error: f64, f: &(impl Fn(DVec3) -> Values + Sync)) -> Vec<Values> {
        let row = |i: usize| {
            let (t, p) = (&self.theta, &self.phi);
            (0..PHI).map(move |j| adaptive(f, [t[i], t[i + 1], p[j], p[j + 1]], error))
        };
        // The rows are dealt out to two threads.
        let rows = |first: usize| -> Vec<Vec<Values>> {
            (first..THETA)
                .step_by(2)
                .map(|i| row(i).collect())
                .collect()
        };
        let (even, odd) = std::thread::scope(|scope| {
            let even = scope.spawn(|| rows(0));
            let odd = rows(1);
            (even.join().unwrap(), odd)
        });
        let rows = even.into_iter().zip(odd).flat_map(|(a, b)| [a, b]);
        rows.flatten().collect()
    }

    /// Quadrature nodes in the hemisphere with their solid angles.
    pub fn nodes(&self) -> Vec<(DVec3, f64)> {
        let mut nodes = Vec::new();
        for t in self.theta.windows(2).filter(|t| t[1] <= PI / 2.0 + 1e-9) {
            for p in self.phi.windows(2) {
                for i in 0..36 {
                    let ((gt, wt), (gp, wp)) = (GAUSS[i / 6], GAUSS[i % 6]);
                    let theta = t[0] + (t[1] - t[0]) * gt;
                    let phi = p[0] + (p[1] - p[0]) * gp;
                    let area = wt * wp * (t[1] - t[0]) * (p[1] - p[0]) * theta.sin();
                    nodes.push((spherical(theta, phi), area));
                }
            }
        }
        nodes
    }
}

/// Borders at equal steps of half `uniform`, half a Cauchy distribution about `center`.
fn invert(
    count: usize,
    end: f64,
    center: f64,
    width: f64,
    uniform: impl Fn(f64) -> f64,
) -> Vec<f64> {
    let cauchy = |t: f64| ((t - center) / width).atan();
    let cdf = |t: f64| {
        let lobe = (cauchy(t) - cauchy(0.0)) / (cauchy(end) - cauchy(0.0));
        0.5 * uniform(t) + 0.5 * lobe
    };
    let border = |i: usize| {
        let (mut low, mut high) = (0.0, end);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if cdf(middle) < i as f64 / count as f64 {
                low = middle;
            } else {
                high = middle;
            }
        }
        high
    };
    let mut borders = vec![0.0];
    borders.extend((1..count).map(border));
    borders.push(end);
    borders
}

fn spherical(theta: f64, phi: f64) -> DVec3 {
    let (sin_t, cos_t) = theta.sin_cos();
    let (sin_p, cos_p) = phi.sin_cos();
    DVec3::new(sin_t * cos_p, sin_t * sin_p, cos_t)
}

fn gauss(f: &impl Fn(DVec3) -> Values, [t0, t1, p0, p1]: [f64; 4]) -> Values {
    let mut sum = [0.0; 4];
    let azimuths = GAUSS.map(|(x, w)| ((p0 + (p1 - p0) * x).sin_cos(), w));
    for (x, wt) in GAUSS {
        let (sin_t, cos_t) = (t0 + (t1 - t0) * x).sin_cos();
        for ((sin_p, cos_p), wp) in azimuths {
            let values = f(DVec3::new(sin_t * cos_p, sin_t * sin_p, cos_t));
            for (total, value) in sum.iter_mut().zip(values) {
                *total += wt * wp * sin_t * value;
            }
        }
    }
    sum.map(|s| s * (t1 - t0) * (p1 - p0))
}

fn adaptive(f: &impl Fn(DVec3) -> Values, cell: [f64; 4], error: f64) -> Values {
    refine(f, cell, gauss(f, cell), error, 0)
}

fn refine(
    f: &impl Fn(DVec3) -> Values,
    cell: [f64; 4],
    whole: Values,
    error: f64,
    depth: u32,
) -> Values {
    let [t0, t1, p0, p1] = cell;
    let (t, p) = (0.5 * (t0 + t1), 0.5 * (p0 + p1));
    let quarters = [
        [t0, t, p0, p],
        [t0, t, p, p1],
        [t, t1, p0, p],
        [t, t1, p, p1],
    ];
    let parts = quarters.map(|q| gauss(f, q));
    let sum = std::array::from_fn(|k| parts.iter().map(|part| part[k]).sum::<f64>());
    let off = (0..4)
        .map(|k| (sum[k] - whole[k]).abs())
        .fold(0.0, f64::max);
    if off < error || depth == DEEPEST {
        return sum;
    }
    let mut total = [0.0; 4];
    for (quarter, part) in quarters.into_iter().zip(parts) {
        let values = refine(f, quarter, part, 0.5 * error, depth + 1);
        for (t, v) in total.iter_mut().zip(values) {
            *t += v;
        }
    }
    total
}

#[test]
fn integrals_of_known_functions() {
    let wo = DVec3::new(0.6, 0.0, 0.8);
    for bottom in [PI / 2.0, 2.0] {
        let grid = Grid::new(wo, 0.02, bottom);
        let cells = grid.integrate(&|d| [1.0, d.z * d.z, d.x * d.x, d.z]);
        let total: Values = std::array::from_fn(|k| cells.iter().map(|c| c[k]).sum());
        // Sphere: 4π, and 4π/3 of each squared component. 2048 cells of 1e-8 each.
        for (got, expected) in
            total
                .into_iter()
                .zip([4.0 * PI, 4.0 * PI / 3.0, 4.0 * PI / 3.0, 0.0])
        {
            assert!((got - expected).abs() < 2e-5, "{total:?}");
        }
    }
}
