//! What photons found, as `shaders/guide.glsl` reads it: a tree over positions, with lobes about directions in its leaves.
//! The same photons give the same bits everywhere: single threaded arithmetic without library functions.

use std::ops::Range;

use glam::{DMat3, DVec3, Vec3};

use crate::layout::{self, Photon};

/// Photons of a leaf at most, and of a tree at least.
const LEAF: usize = 48;
/// Photons of a lobe at least: fewer are stray.
const LOBE: usize = 4;
/// Photons count for no more than so many of the median's weight: heavy ones are of light that is spread widely.
const MAX_WEIGHT: f64 = 4.0;
/// How far beyond its photons a leaf reaches, relative to its longest edge.
const REACH: f64 = 0.5;
/// By how much a lobe's mean square angle is enlarged: what is missed costs more than what is too wide.
const WIDEN: f64 = 2.0;
/// What it is at least: single precision tells no finer directions.
const LEAST_SQUARE: f64 = 1e-7;
/// Lobes that are narrower than this are not divided …
const NARROW_SQUARE: f64 = 1e-4;
/// … and wider ones left out: surfaces find such light by themselves.
const WIDE_SQUARE: f64 = 0.05;

/// A leaf has lobes where the light in them would have this variance, relative to the square of all light: below, paths are as good
/// without.
const LEAST_VARIANCE: f64 = 0.06;

/// A texel of the tree.
pub(crate) type Texel = [u32; 4];

#[derive(Clone, Copy)]
struct Arrival {
    position: DVec3,
    /// Unit, to where the photon came from.
    direction: DVec3,
    weight: f64,
    /// Irradiance by direct light.
    direct: f64,
}

#[derive(Clone, Copy)]
struct Bounds {
    low: DVec3,
    high: DVec3,
}

/// Directions that aim at a point.
struct Lobe {
    range: Range<usize>,
    aim: DVec3,
    /// Mean square angle between what it says and what photons had.
    square: f64,
    weight: f64,
}

/// The tree; `None` where too few photons arrived, or nothing that they found is worth it.
pub(crate) fn build(photons: &[Photon]) -> Option<Vec<Texel>> {
    let mut arrivals: Vec<Arrival> = photons
        .iter()
        .filter(|p| p.weight > 0.0 && p.weight.is_finite() && p.direct.is_finite())
        .map(|p| Arrival {
            position: Vec3::from(p.position).as_dvec3(),
            direction: Vec3::from(p.direction).as_dvec3().normalize_or_zero(),
            weight: p.weight.into(),
            direct: p.direct.into(),
        })
        .filter(|p| p.position.is_finite() && p.direction != DVec3::ZERO)
        .collect();
    if arrivals.len() < LEAF {
        return None;
    }
    let middle = arrivals.len() / 2;
    arrivals.select_nth_unstable_by(middle, |a, b| a.weight.total_cmp(&b.weight));
    let most = MAX_WEIGHT * arrivals[middle].weight;
    for arrival in &mut arrivals {
        arrival.weight = arrival.weight.min(most);
    }
    let everywhere = Bounds {
        low: DVec3::NEG_INFINITY,
        high: DVec3::INFINITY,
    };
    let mut texels = vec![[0; 4]];
    let is_worth = fill(&mut texels, 0, &mut arrivals, everywhere, 0);
    is_worth.then_some(texels)
}

/// Writes the node at a texel, and what is below it; whether there is any lobe.
fn fill(
    texels: &mut Vec<Texel>,
    at: usize,
    photons: &mut [Arrival],
    cell: Bounds,
    depth: u32,
) -> bool {
    let (axis, plane, below) = match photons.len() > LEAF && depth < layout::GUIDE_DEPTH {
        true => divide(photons),
        false => (0, 0.0, 0),
    };
    if below == 0 {
        return leaf(texels, at, photons, cell);
    }
    let children = texels.len();
    texels.extend([[0; 4]; 2]);
    texels[at] = node(plane, children, axis as u32, 0);
    let (low, high) = photons.split_at_mut(below);
    let (mut left, mut right) = (cell, cell);
    left.high[axis] = plane.into();
    right.low[axis] = plane.into();
    let is_left = fill(texels, children, low, left, depth + 1);
    fill(texels, children + 1, high, right, depth + 1) || is_left
}

fn node(plane: f32, link: usize, axis: u32, lobes: u32) -> Texel {
    // A tree of all photons that are traced has far fewer texels.
    let link = (link as u32) << layout::GUIDE_LINK_SHIFT;
    [plane.to_bits(), link | axis, lobes, 0]
}

/// Sorts photons to both sides of a plane: its axis, where it is, and how many are below. None, where they cannot be told apart.
fn divide(photons: &mut [Arrival]) -> (usize, f32, usize) {
    let bounds = bounds(photons);
    let extent = bounds.high - bounds.low;
    let axis = match extent.max_element() {
        most if most == extent.x => 0,
        most if most == extent.y => 1,
        _ => 2,
    };
    let middle = photons.len() / 2;
    photons.select_nth_unstable_by(middle, |a, b| a.position[axis].total_cmp(&b.position[axis]));
    // positions were single precision
    let plane = photons[middle].position[axis];
    let mut below = 0;
    for k in 0..photons.len() {
        if photons[k].position[axis] < plane {
            photons.swap(k, below);
            below += 1;
        }
    }
    (axis, plane as f32, below)
}

fn bounds(photons: &[Arrival]) -> Bounds {
    let positions = photons.iter().map(|p| p.position);
    Bounds {
        low: positions.clone().fold(DVec3::INFINITY, DVec3::min),
        high: positions.fold(DVec3::NEG_INFINITY, DVec3::max),
    }
}

fn leaf(texels: &mut Vec<Texel>, at: usize, photons: &mut [Arrival], cell: Bounds) -> bool {
    let held = bounds(photons);
    let reach = DVec3::splat(REACH * (held.high - held.low).max_element());
    let around = Bounds {
        low: (held.low - reach).max(cell.low),
        high: (held.high + reach).min(cell.high),
    };
    let mut lobes = lobes(photons);
    if variance(photons, &lobes, &held) < LEAST_VARIANCE {
        lobes.clear();
    }
    let first = texels.len();
    texels[at] = node(0.0, first, layout::GUIDE_LEAF, lobes.len() as u32);
    let point = |p: DVec3| p.as_vec3().to_array().map(f32::to_bits);
    let texel = |[x, y, z]: [u32; 3], w: f32| [x, y, z, w.to_bits()];
    texels.push(texel(point(around.low), 0.0));
    texels.push(texel(point(around.high), 0.0));
    let total: f64 = lobes.iter().map(|l| l.weight).sum();
    for lobe in &lobes {
        // a small angle's square is 2 / κ in the mean
        let kappa = 2.0 / (WIDEN * lobe.square + LEAST_SQUARE);
        texels.push(texel(point(lobe.aim), kappa as f32));
        texels.push([((lobe.weight / total) as f32).to_bits(), 0, 0, 0]);
    }
    total > 0.0
}

/// Lobes about the directions of some photons: the widest and brightest are divided until they are many or narrow.
fn lobes(photons: &mut [Arrival]) -> Vec<Lobe> {
    let mut lobes = vec![lobe(photons, 0..photons.len())];
    while lobes.len() < layout::GUIDE_LOBES as usize {
        let gain = |k: &usize| lobes[*k].weight * lobes[*k].square;
        let open = (0..lobes.len())
            .filter(|k| lobes[*k].range.len() > LOBE && lobes[*k].square > NARROW_SQUARE);
        let Some(k) = open.max_by(|a, b| gain(a).total_cmp(&gain(b))) else {
            break;
        };
        let range = lobes[k].range.clone();
        let below = divide_directions(&mut photons[range.clone()]);
        if below == 0 {
            break;
        }
        let middle = range.start + below;
        lobes[k] = lobe(photons, range.start..middle);
        lobes.push(lobe(photons, middle..range.end));
    }
    lobes.retain(|l| l.range.len() >= LOBE && l.square < WIDE_SQUARE);
    lobes
}

/// Sorts photons by the coordinate in which their directions differ most; how many are below its mean.
fn divide_directions(photons: &mut [Arrival]) -> usize {
    let total: f64 = photons.iter().map(|p| p.weight).sum();
    let mean: DVec3 = photons
        .iter()
        .map(|p| p.weight * p.direction)
        .sum::<DVec3>()
        / total;
    let square = |p: &Arrival| p.weight * (p.direction - mean) * (p.direction - mean);
    let variance: DVec3 = photons.iter().map(square).sum();
    let axis = match variance.max_element() {
        most if most == variance.x => 0,
        most if most == variance.y => 1,
        _ => 2,
    };
    photons.sort_by(|a, b| a.direction[axis].total_cmp(&b.direction[axis]));
    photons.partition_point(|p| p.direction[axis] < mean[axis])
}

fn lobe(photons: &[Arrival], range: Range<usize>) -> Lobe {
    let photons = &photons[range.clone()];
    let weight: f64 = photons.iter().map(|p| p.weight).sum();
    let mean: DVec3 = photons.iter().map(|p| p.weight * p.direction).sum();
    let center: DVec3 = photons.iter().map(|p| p.weight * p.position).sum::<DVec3>() / weight;
    let bounds = bounds(photons);
    let extent = (bounds.high - bounds.low).length();
    // so far that it is a direction
    let far = center + mean.normalize_or(DVec3::Z) * (1e4 * extent + center.length() + 1.0);
    let of = |aim: DVec3| {
        let angle = |p: &Arrival| {
            let d = (aim - p.position).normalize_or_zero();
            p.weight * (d - p.direction).length_squared()
        };
        (aim, photons.iter().map(angle).sum::<f64>() / weight)
    };
    let far = of(far);
    let (aim, square) = match crossing(photons).map(of) {
        Some(near) if near.1 < far.1 => near,
        _ => far,
    };
    // of few photons the spread is known badly
    let few = photons.len() as f64;
    Lobe {
        range,
        aim,
        square: square * few / (few - 2.0).max(1.0),
        weight,
    }
}

/// The point that is closest to the lines along which photons came.
fn crossing(photons: &[Arrival]) -> Option<DVec3> {
    let mut matrix = DMat3::ZERO;
    let mut vector = DVec3::ZERO;
    for p in photons {
        let d = p.direction;
        let across = DMat3::IDENTITY - DMat3::from_cols(d * d.x, d * d.y, d * d.z);
        matrix += across * p.weight;
        vector += across * (p.weight * p.position);
    }
    let total = matrix.col(0).x + matrix.col(1).y + matrix.col(2).z;
    let is_sure = matrix.determinant() > 1e-12 * total * total * total;
    is_sure.then(|| matrix.inverse() * vector)
}

/// Variance of the lobes' light where surfaces find it by themselves, relative to the square of all light.
fn variance(photons: &[Arrival], lobes: &[Lobe], held: &Bounds) -> f64 {
    let extent = held.high - held.low;
    // they lie on a surface
    let area = (extent.x * extent.y)
        .max(extent.y * extent.z)
        .max(extent.z * extent.x)
        .max(f64::MIN_POSITIVE);
    let direct = photons.iter().map(|p| p.direct).sum::<f64>() / photons.len() as f64;
    let bent = photons.iter().map(|p| p.weight).sum::<f64>() / area;
    // a lobe of the mean square angle a has about 1/a of the hemisphere's directions in it
    let one = |l: &Lobe| (l.weight / area / (bent + direct)).powi(2) / (l.square + LEAST_SQUARE);
    lobes.iter().map(one).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Photons on a floor of 2 m by 2 m that came from about the point `from`, as a grid, `spread` apart in their aim.
    fn photons(from: Vec3, spread: f32, direct: f32) -> Vec<Photon> {
        let one = |k: u32| {
            let position = Vec3::new(
                (k % 64) as f32 / 32.0 - 1.0,
                0.0,
                (k / 64) as f32 / 32.0 - 1.0,
            );
            let turn = 2.4 * k as f32;
            let aim = from + spread * Vec3::new(turn.cos(), 0.0, turn.sin());
            Photon {
                position: position.to_array(),
                weight: 1e-3,
                direction: (aim - position).normalize().to_array(),
                direct,
            }
        };
        (0..4096).map(one).collect()
    }

    /// Lobes of every leaf: point that they aim at, and κ.
    fn leaves(texels: &[Texel]) -> Vec<Vec<(Vec3, f32)>> {
        let mut pending = vec![0];
        let mut leaves = Vec::new();
        while let Some(at) = pending.pop() {
            let [_, link, lobes, _]: Texel = texels[at];
            let first = (link >> layout::GUIDE_LINK_SHIFT) as usize;
            if link & layout::GUIDE_AXIS_MASK != layout::GUIDE_LEAF {
                pending.extend([first, first + 1]);
                continue;
            }
            let lobe = |k: u32| {
                let [x, y, z, kappa] = texels[first + 2 + 2 * k as usize].map(f32::from_bits);
                (Vec3::new(x, y, z), kappa)
            };
            leaves.push((0..lobes).map(lobe).collect());
        }
        leaves
    }

    #[test]
    fn lobes_aim_at_what_photons_came_from() {
        let from = Vec3::new(0.5, 2.0, -0.25);
        let texels = build(&photons(from, 0.002, 0.0)).unwrap();
        let leaves = leaves(&texels);
        assert!(leaves.len() >= 4096 / LEAF, "{} leaves", leaves.len());
        for lobes in leaves {
            assert!(!lobes.is_empty());
            for (aim, kappa) in lobes {
                assert!(aim.distance(from) < 0.3, "{aim}");
                assert!(kappa > 1e3, "{kappa}");
            }
        }
    }

    /// Photons of a wide sky weigh much, since they are rarely sent; they must not blur what is narrow.
    #[test]
    fn stray_photons_blur_no_lobe() {
        let from = Vec3::new(0.5, 2.0, -0.25);
        let mut photons = photons(from, 0.001, 0.0);
        for (k, photon) in (0u32..).zip(photons.iter_mut().step_by(37)) {
            let turn = 1.7 * k as f32;
            photon.direction = Vec3::new(turn.cos(), 0.3, turn.sin())
                .normalize()
                .to_array();
            photon.weight = 1.0;
        }
        let leaves = leaves(&build(&photons).unwrap());
        let narrow = |lobes: &Vec<(Vec3, f32)>| lobes.iter().any(|l| l.1 > 1e4);
        let held = leaves.iter().filter(|l| narrow(l)).count();
        assert!(held * 10 >= leaves.len() * 9, "{held} of {}", leaves.len());
    }

    #[test]
    fn what_is_not_worth_it_is_left_out() {
        let from = Vec3::new(0.5, 2.0, -0.25);
        assert!(
            build(&photons(from, 0.02, 0.0)[..LEAF - 1]).is_none(),
            "too few"
        );
        assert!(
            build(&photons(from, 0.02, 1e4)).is_none(),
            "dim beside direct light"
        );
        assert!(build(&photons(from, 3.0, 0.0)).is_none(), "from everywhere");
    }
}
