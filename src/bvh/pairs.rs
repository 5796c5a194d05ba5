//! Which triangles share a record. Meshes list neighbours close to each other, so
//! a search among the next few triangles finds a partner for nearly all.

use glam::{DVec3, Vec3};
use obvhs::aabb::Aabb;

use super::{FIRST_MASKED, FIRST_TURN, FLAT, NO_TRIANGLE, Record, SECOND_MASKED, SECOND_TURN};

/// How far ahead in the list a partner is looked for.
const WINDOW: usize = 8;

/// One or two triangles: each the index and the corner that comes first in the record.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair {
    first: (u32, usize),
    second: Option<(u32, usize)>,
}

impl Pair {
    /// What is stored; `masked` is empty or has a flag for each triangle.
    pub(super) fn record(&self, corners: &[[Vec3; 3]], masked: &[bool]) -> Record {
        let is_masked = |id: u32| masked.get(id as usize).copied().unwrap_or(false);
        let (id, turn) = self.first;
        let turned = |id: u32, turn: usize| [0, 1, 2].map(|i| corners[id as usize][(i + turn) % 3]);
        let [a, b, c] = turned(id, turn);
        let mut flags = (turn as u32) << FIRST_TURN;
        flags |= if is_masked(id) { FIRST_MASKED } else { 0 };
        // A triangle without area is never hit.
        let (mut other, mut d) = (NO_TRIANGLE, a);
        if let Some((id, turn)) = self.second {
            (other, d) = (id, turned(id, turn)[2]);
            flags |= (turn as u32) << SECOND_TURN;
            flags |= if is_masked(id) { SECOND_MASKED } else { 0 };
        }
        flags |= if is_flat([a, b, c, d]) { FLAT } else { 0 };
        let [id, other, flags] = [id, other, flags].map(f32::from_bits);
        [
            a.x, a.y, a.z, id, b.x, b.y, b.z, other, c.x, c.y, c.z, flags, d.x, d.y, d.z, 0.0,
        ]
    }

    /// Bounds of its triangles, whose own bounds are `boxes`.
    pub(super) fn bounds(&self, boxes: &[Aabb]) -> Aabb {
        let bounds = boxes[self.first.0 as usize];
        self.second
            .map_or(bounds, |(id, _)| bounds.union(&boxes[id as usize]))
    }
}

/// Deals the triangles into pairs with a common edge and singles. A pair's box costs a visit whenever one of the
/// boxes would have: it must not be larger than both together.
pub(super) fn pair(corners: &[[Vec3; 3]], boxes: &[Aabb]) -> Vec<Pair> {
    let mut taken = vec![false; corners.len()];
    let mut pairs = Vec::with_capacity(corners.len() / 2 + 1);
    for first in 0..corners.len() {
        if taken[first] {
            continue;
        }
        let mut best = None;
        let mut least = 1.0;
        for second in first + 1..corners.len().min(first + 1 + WINDOW) {
            if taken[second] {
                continue;
            }
            let Some(turns) = common_edge(&corners[first], &corners[second]) else {
                continue;
            };
            let apart = boxes[first].half_area() + boxes[second].half_area();
            let share = boxes[first].union(&boxes[second]).half_area() / apart;
            if share < least {
                (best, least) = (Some((second, turns)), share);
            }
        }
        let mut pair = Pair {
            first: (first as u32, 0),
            second: None,
        };
        if let Some((second, (turn, second_turn))) = best {
            taken[second] = true;
            pair.first.1 = turn;
            pair.second = Some((second as u32, second_turn));
        }
        pairs.push(pair);
    }
    pairs
}

/// Whether four corners lie in one plane, in exact arithmetic; `false` where that is not known. A corner that occurs
/// twice leaves three, which always do; a plane across an axis is seen at once. Elsewhere the volume that the corners
/// span is believed only where double precision holds it exactly.
pub(super) fn is_flat([a, b, c, d]: [Vec3; 4]) -> bool {
    if d == a {
        return true;
    }
    if (0..3).any(|axis| [b, c, d].iter().all(|v| v[axis] == a[axis])) {
        return true;
    }
    if is_parallelogram([a, b, c, d]) {
        return true;
    }
    let edges = [b, c, d].map(|v| v.as_dvec3() - a.as_dvec3());
    // Coordinates that are multiples of one unit, differences below 2¹⁶ units: products of three are below 2⁴⁸, and
    // their sums below 2⁵¹, so nothing is rounded.
    let largest = edges
        .iter()
        .fold(0.0, |m: f64, e| m.max(e.abs().max_element()));
    let unit = (largest.log2().floor() - 15.0).exp2();
    let is_exact = [a, b, c, d]
        .iter()
        .all(|v| (v.as_dvec3() / unit).fract() == DVec3::ZERO);
    is_exact && edges[0].cross(edges[1]).dot(edges[2]) == 0.0
}

/// Whether opposite edges are equal, in exact arithmetic; `false` where that is not known.
fn is_parallelogram([a, b, c, d]: [Vec3; 4]) -> bool {
    (0..3).all(|axis| {
        let [a, b, c, d] = [a, b, c, d].map(|v| f64::from(v[axis]));
        // A sum that gives back both its terms was not rounded.
        let is_exact = |x: f64, y: f64| x + y - x == y && x + y - y == x;
        is_exact(a, c) && is_exact(b, d) && a + c == b + d
    })
}

/// Turns that make the edge from the last corner of `a` to its first the edge from the first corner of `b` to its
/// second. Triangles that are wound differently have none.
fn common_edge(a: &[Vec3; 3], b: &[Vec3; 3]) -> Option<(usize, usize)> {
    for turn in 0..3 {
        for second in 0..3 {
            if a[turn] == b[second] && a[(turn + 2) % 3] == b[(second + 1) % 3] {
                return Some((turn, second));
            }
        }
    }
    None
}
