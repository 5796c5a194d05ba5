//! Flat pieces of small scenes as `shaders/traverse_planes.glsl` reads them, with bounds on the rounding of
//! the tests there and in the tree.

use glam::{DVec3, Vec3};

use super::upload::SceneData;
use crate::bvh::{Bvh, Patch};
use crate::layout::{self, Plane};
use crate::spec::Spec;

/// Half the distance from one to the next number in single precision.
const UNIT: f64 = 1.0 / (1 << 24) as f64;
/// Pieces whose coordinates are less exact than this leave too many rays to the tree.
const MAX_ERROR: f64 = 1e-2;

/// The pieces of a scene, and where rays may start.
pub(super) struct Planes {
    pub list: Vec<Plane>,
    center: Vec3,
    extent: Vec3,
    parallelograms: u32,
}

impl Planes {
    /// `None` where a scene has too many, or other shapes, or what the kernels would have to ask more of.
    pub fn of(bvh: &Bvh, data: &SceneData) -> Option<Self> {
        let spec = &data.spec;
        if spec.has_candidates() || spec.instances {
            return None;
        }
        let patches = bvh.patches(layout::PLANES_MAX as usize)?;
        let eye = Vec3::from(data.params.camera_position).as_dvec3();
        let points = || patches.iter().flat_map(|patch| patch.corners);
        let low = points().fold(eye, DVec3::min);
        let high = points().fold(eye, DVec3::max);
        let center = ((low + high) / 2.0).as_vec3();
        // Rays start beside surfaces, not on them.
        let extent = ((high - low) * 0.501).as_vec3();
        let list = patches
            .iter()
            .map(|patch| plane(patch, center.as_dvec3(), extent.as_dvec3()));
        Some(Self {
            list: list.collect::<Option<_>>()?,
            center,
            extent,
            parallelograms: patches
                .iter()
                .filter(|patch| patch.is_parallelogram)
                .count() as u32,
        })
    }

    /// Tells the kernels.
    pub fn note(&self, spec: &mut Spec, params: &mut layout::Params) {
        spec.parallelograms = self.parallelograms;
        spec.triangles = self.list.len() as u32 - self.parallelograms;
        spec.without = without(&self.list);
        params.planes_center = self.center.to_array();
        params.planes_extent = self.extent.to_array();
    }
}

/// For each component of normals and gradients the pieces that have none, a bit each.
fn without(list: &[Plane]) -> [u32; 9] {
    let mut bits = [0; 9];
    for (i, plane) in list.iter().enumerate() {
        let components = [plane.normal, plane.u, plane.v].into_iter().flatten();
        for (bits, component) in bits.iter_mut().zip(components) {
            *bits |= u32::from(component == 0.0) << i;
        }
    }
    bits
}

/// A piece with its bounds, to first order in [`UNIT`] with every rounding at its worst.
///
/// With W the unit normal, U and V the gradients of the coordinates, R the extent, D = 2|R| the longest way
/// within it, and c the cosine between ray and normal:
/// - the numerator of t is off by 5 W·R, its denominator by 4, the quotient by 1: t by (5 W·R + 6 D) / c;
/// - the point by that along the ray and by 2 (R + D) of its own, a coordinate by |U| times both and 5 (U·R + U₀);
/// - vertices in the tree's test are off by 5 D across the ray, products of two by 30 D × diameter, and they are divided
///   by c times twice the triangle's area: weights by that, coordinates from -1 to 1 by twice as much, t by two
///   weights' times the diameter, as long as √3 of it in the tree's units.
fn plane(patch: &Patch, center: DVec3, extent: DVec3) -> Option<Plane> {
    let corners = patch.corners.map(|corner| corner - center);
    let [a, b, c, d] = corners;
    let normal = (b - a).cross(c - a).normalize();
    // Along an axis it is the axis itself, which kernels know.
    let is_zero = normal.as_vec3().cmpeq(Vec3::ZERO);
    let normal = if is_zero.bitmask().count_ones() == 2 {
        DVec3::select(is_zero, DVec3::ZERO, DVec3::ONE)
    } else {
        normal
    };
    let doubled = (b - a).cross(c - a).length();
    // u grows along p and v along q.
    let (p, q) = (b - a, if patch.is_parallelogram { d - a } else { c - a });
    let scale = if patch.is_parallelogram { 2.0 } else { 1.0 };
    let u = q.cross(normal) / q.cross(normal).dot(p) * scale;
    let v = p.cross(normal) / p.cross(normal).dot(q) * scale;
    let start = if patch.is_parallelogram { 1.0 } else { 0.0 };
    let offsets = [-normal.dot(a), -u.dot(a) - start, -v.dot(a) - start];

    let way = 2.0 * extent.length();
    let reach = |w: DVec3, offset: f64| w.abs().dot(extent) + offset.abs();
    let gradient = u.length().max(v.length()).max((u + v).length());
    let diameter = (c - a).length().max((d - b).length()).max((b - a).length());
    let coordinates = reach(u, offsets[1]).max(reach(v, offsets[2]));
    // A fourth corner that is off, and coefficients rounded to single precision.
    let bend = (a + c - b - d).length();
    let bend = if patch.is_parallelogram { bend } else { 0.0 };
    let own = UNIT * (6.0 * reach(normal, offsets[0]) + 7.0 * way);
    let weight = UNIT * 30.0 * way * diameter / doubled;
    let t_error = own + UNIT * 6.0 * way + 4.0 * weight * diameter + bend;
    let edge_error =
        gradient * (own + UNIT * 4.0 * way + bend) + UNIT * 6.0 * coordinates + scale * weight;
    let is_good = t_error.is_finite() && edge_error < MAX_ERROR;
    let single = |w: DVec3| w.as_vec3().to_array();
    is_good.then(|| Plane {
        normal: single(normal),
        offset: offsets[0] as f32,
        u: single(u),
        u_offset: offsets[1] as f32,
        v: single(v),
        v_offset: offsets[2] as f32,
        t_error: (2.0 * t_error) as f32,
        edge_error: (2.0 * edge_error) as f32,
        record: patch.record,
        first_triangle: patch.triangles[0],
        second_triangle: patch.triangles[1],
        ..Plane::default()
    })
}
