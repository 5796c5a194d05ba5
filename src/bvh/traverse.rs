//! Reference traversal, the oracle of the tests: a walk in single precision that
//! mirrors `shaders/traverse_software.glsl` operation by operation, and a search
//! of every triangle in double precision that shares nothing with it.
//!
//! # References
//!
//! \[Woop13\] Woop, Benthin, Wald: Watertight ray/triangle intersection. Journal of
//! Computer Graphics Techniques 2(1), 2013.

use glam::{DVec3, Vec3};

use super::{
    Bvh, FLAT, InstanceDesc, Member, Node, Record, STACK_SIZE, byte, grid, members,
    transform_point, transform_vector, vertex,
};

/// Rounding that the box test must outweigh, relative to the distance to the box's far side, in units of 2⁻²⁴: nine
/// of the planes' parameters (five of them the division, which Vulkan allows 2.5 ulp) and ten of the triangle test,
/// whose vertices move by that much. 19 is rounded up to a power of two.
const BOX_ROUNDING: f32 = 32.0 / (1u32 << 24) as f32;
/// Slopes are computed for directions no closer to an axis plane than this (2⁻⁸⁰), so that nothing overflows. The
/// ray bends by less than rounding.
const MIN_DIRECTION: f32 = f32::from_bits((127 - 80) << 23);
/// A set bit among these: the entry is a group of nodes. Otherwise it is a group of leaf records.
const NODE_BITS: u32 = 0xff00_0000;

/// A ray. Hits lie strictly between `t_min` and `t_max`.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Start, metres.
    pub origin: Vec3,
    /// Direction; parameters are metres when its length is one.
    pub direction: Vec3,
    /// Lower end, in lengths of the direction.
    pub t_min: f32,
    /// Upper end, in lengths of the direction.
    pub t_max: f32,
    /// [`Hit::record`] of the hit that the ray leaves, or [`NO_RECORD`]: what lies in its plane is not met.
    pub from: u32,
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Ray parameter.
    pub t: f32,
    /// Weights of the second and third vertex.
    pub bary: [f32; 2],
    /// Index of the instance; 0 with one level.
    pub instance: u32,
    /// Index of the triangle within its group.
    pub primitive: u32,
    /// Record with this triangle where it is flat and there is one level, else [`NO_RECORD`].
    pub record: u32,
}

/// Stands for no record.
pub const NO_RECORD: u32 = u32::MAX;
/// Records that a node refers to at most.
const NODE_RECORDS: u32 = 24;

/// Decides whether a hit on a masked triangle counts: instance, primitive, weights of the second and third vertex.
pub type IsOpaque<'a> = &'a dyn Fn(u32, u32, [f32; 2]) -> bool;

/// The nearest hit.
pub fn closest(bvh: &Bvh, ray: &Ray, is_opaque: IsOpaque) -> Option<Hit> {
    walk(bvh, ray, is_opaque, false)
}

/// Whether there is any hit.
pub fn occluded(bvh: &Bvh, ray: &Ray, is_opaque: IsOpaque) -> bool {
    walk(bvh, ray, is_opaque, true).is_some()
}

/// What is computed once for a ray in one space.
struct Prepared {
    origin: Vec3,
    inverse: Vec3,
    /// Rows of the shear that takes the direction to the z axis and its largest component to one.
    shear: [Vec3; 3],
    /// Per axis: whether the direction points down.
    negative: [bool; 3],
    /// Flips slots so that higher ones are nearer.
    octant: u32,
}

impl Prepared {
    fn new(origin: Vec3, direction: Vec3) -> Self {
        let negative = direction.to_array().map(|d| d < 0.0);
        let inverse = Vec3::from(direction.to_array().map(|d| {
            let magnitude = d.abs().max(MIN_DIRECTION);
            1.0 / if d < 0.0 { -magnitude } else { magnitude }
        }));
        let octant = [4, 2, 1];
        let octant = (0..3).map(|axis| if negative[axis] { 0 } else { octant[axis] });
        Self {
            origin,
            inverse,
            shear: shear(direction),
            negative,
            octant: octant.sum(),
        }
    }
}

/// Rows are multiples and sums of coordinates with exact factors 0 and 1, so that this equals \[Woop13\] without
/// its permutation of axes.
fn shear(d: Vec3) -> [Vec3; 3] {
    let a = d.abs();
    if a.x >= a.y && a.x >= a.z {
        [
            Vec3::new(-d.y / d.x, 1.0, 0.0),
            Vec3::new(-d.z / d.x, 0.0, 1.0),
            Vec3::new(1.0 / d.x, 0.0, 0.0),
        ]
    } else if a.y >= a.z {
        [
            Vec3::new(0.0, -d.z / d.y, 1.0),
            Vec3::new(1.0, -d.x / d.y, 0.0),
            Vec3::new(0.0, 1.0 / d.y, 0.0),
        ]
    } else {
        [
            Vec3::new(1.0, 0.0, -d.x / d.z),
            Vec3::new(0.0, 1.0, -d.y / d.z),
            Vec3::new(0.0, 0.0, 1.0 / d.z),
        ]
    }
}

/// Bits of the children that the ray may meet: nodes in the upper byte in order of visit, leaf records below.
fn node_hits(node: &Node, ray: &Prepared, t_min: f32, t_max: f32) -> u32 {
    let (p, e) = grid(node);
    let from_origin = Vec3::from(p) - ray.origin;
    let size = Vec3::from(e) * 255.0;
    // The far side of the box along any axis bounds every distance in it.
    let pad = (from_origin.abs() + size).max_element() * BOX_ROUNDING;
    let scale = Vec3::from(e) * ray.inverse;
    let offset = from_origin * ray.inverse;
    let slack = ray.inverse.abs() * pad;
    let (near_offset, far_offset) = (offset - slack, offset + slack);
    let mut hits = 0;
    for slot in 0..8 {
        let (mut near, mut far) = (t_min, t_max);
        for axis in 0..3 {
            let low = byte(node, 8 + 4 * axis, slot) as f32;
            let high = byte(node, 8 + 4 * axis, slot + 8) as f32;
            let (first, last) = if ray.negative[axis] {
                (high, low)
            } else {
                (low, high)
            };
            near = near.max(first * scale[axis] + near_offset[axis]);
            far = far.min(last * scale[axis] + far_offset[axis]);
        }
        if near <= far {
            let meta = byte(node, 6, slot);
            let flip = if meta & (meta << 1) & 0x10 != 0 {
                ray.octant
            } else {
                0
            };
            hits |= (meta >> 5) << ((meta ^ flip) & 31);
        }
    }
    hits
}

/// Parameter and weights of the second and third vertex, as the triangle was given. \[Woop13\] without its fall-back
/// to double precision: a product that is rounded once keeps the sign of each edge's function right or makes it zero,
/// in both of the triangles that share the edge, and zero counts as inside.
fn intersect(record: &Record, member: &Member, ray: &Prepared) -> Option<(f32, [f32; 2])> {
    let [a, b, c] = member.corners.map(|corner| {
        let v = vertex(record, corner) - ray.origin;
        let row = |r: Vec3| v.x * r.x + v.y * r.y + v.z * r.z;
        Vec3::new(row(ray.shear[0]), row(ray.shear[1]), row(ray.shear[2]))
    });
    let u = c.x * b.y - c.y * b.x;
    let v = a.x * c.y - a.y * c.x;
    let w = b.x * a.y - b.y * a.x;
    let outside = (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0);
    let sum = u + v + w;
    if outside || sum == 0.0 {
        return None;
    }
    let t = a.z + (v * (b.z - a.z) + w * (c.z - a.z)) / sum;
    let [_, v, w] = member.given([u, v, w]);
    Some((t, [v / sum, w / sum]))
}

/// Both traversals; `any` ends at the first hit.
fn walk(bvh: &Bvh, world: &Ray, is_opaque: IsOpaque, any: bool) -> Option<Hit> {
    let has_instances = !bvh.instances.is_empty();
    let mut stack = [(0u32, 0u32); STACK_SIZE];
    let (mut height, mut base) = (0, 0);
    let mut ray = Prepared::new(world.origin, world.direction);
    let mut instance = if has_instances { None } else { Some(0u32) };
    let mut nodes = (bvh.root, 0x8000_0000);
    let mut leaves = (0, 0);
    let mut best: Option<Hit> = None;
    loop {
        if leaves.1 == 0 {
            if nodes.1 & NODE_BITS == 0 {
                if has_instances && instance.is_some() && height == base {
                    instance = None;
                    ray = Prepared::new(world.origin, world.direction);
                }
                if height == 0 {
                    return best;
                }
                height -= 1;
                nodes = stack[height];
            }
            if nodes.1 & NODE_BITS == 0 {
                leaves = nodes;
            } else {
                let bit = 31 - nodes.1.leading_zeros();
                let slot = (bit - 24) ^ ray.octant;
                let below = nodes.1 & !(u32::MAX << slot) & 0xff;
                let index = nodes.0 + below.count_ones();
                nodes.1 &= !(1 << bit);
                if nodes.1 & NODE_BITS != 0 {
                    stack[height] = nodes;
                    height += 1;
                }
                let node = &bvh.nodes[index as usize];
                let t_max = best.map_or(world.t_max, |hit| hit.t);
                let hits = node_hits(node, &ray, world.t_min, t_max);
                nodes = (node[4], hits & NODE_BITS | node[3] >> 24);
                leaves = (node[5], hits & !NODE_BITS);
                // The box of a plane that the ray leaves is always met.
                let place = world.from.wrapping_sub(leaves.0);
                if !has_instances && place < NODE_RECORDS {
                    leaves.1 &= !(1 << place);
                }
            }
        }
        if leaves.1 == 0 {
            continue;
        }
        let place = leaves.0 + leaves.1.trailing_zeros();
        let record = &bvh.triangles[place as usize];
        leaves.1 &= leaves.1 - 1;
        let Some(instance_id) = instance else {
            let id = record[3].to_bits();
            // A leaf entry of the top level: leave what remains for later and enter the group.
            if nodes.1 & NODE_BITS != 0 {
                stack[height] = nodes;
                height += 1;
            }
            if leaves.1 != 0 {
                stack[height] = leaves;
                height += 1;
            }
            let placed = &bvh.instances[id as usize];
            (instance, base, leaves) = (Some(id), height, (0, 0));
            nodes = (bvh.groups[placed.group as usize].root, 0x8000_0000);
            let matrix = &placed.object_from_world;
            ray = Prepared::new(
                transform_point(matrix, world.origin),
                transform_vector(matrix, world.direction),
            );
            continue;
        };
        let t_max = best.map_or(world.t_max, |hit| hit.t);
        let mut nearest: Option<Hit> = None;
        // The same record is in several places where its group is.
        let is_named = !has_instances && record[11].to_bits() & FLAT != 0;
        let name = if is_named { place } else { NO_RECORD };
        for member in members(record) {
            let Some((t, bary)) = intersect(record, &member, &ray) else {
                continue;
            };
            if t > world.t_min
                && t < t_max
                && (!member.is_masked || is_opaque(instance_id, member.id, bary))
                && nearest.is_none_or(|hit| t < hit.t)
            {
                nearest = Some(Hit {
                    t,
                    bary,
                    instance: instance_id,
                    primitive: member.id,
                    record: name,
                });
            }
        }
        best = nearest.or(best);
        if any && best.is_some() {
            return best;
        }
    }
}

/// The nearest hit of all triangles in double precision, with the distance of the second nearest: tests that
/// compare ids must allow for ties. The matrices are those of the structure, so their rounding does not count.
pub fn closest_exhaustive(bvh: &Bvh, ray: &Ray, is_opaque: IsOpaque) -> (Option<Hit>, f64) {
    let identity = [InstanceDesc::identity(0)];
    let instances = if bvh.instances.is_empty() {
        &identity[..]
    } else {
        &bvh.instances
    };
    let (mut best, mut first, mut second) = (None, f64::INFINITY, f64::INFINITY);
    for (instance, placed) in instances.iter().enumerate() {
        let Some(group) = bvh.groups.get(placed.group as usize) else {
            continue;
        };
        let m = placed
            .object_from_world
            .map(|c| DVec3::new(c[0].into(), c[1].into(), c[2].into()));
        let linear = |v: DVec3| m[0] * v.x + m[1] * v.y + m[2] * v.z;
        let origin = linear(ray.origin.as_dvec3()) + m[3];
        let direction = linear(ray.direction.as_dvec3());
        let records = &bvh.triangles[group.first_record as usize..][..group.record_count as usize];
        let triangles = records
            .iter()
            .flat_map(|record| members(record).map(move |member| (record, member)));
        for (record, member) in triangles {
            let Some((t, bary)) = intersect_double(record, &member, origin, direction) else {
                continue;
            };
            let (instance, primitive) = (instance as u32, member.id);
            if !(t > f64::from(ray.t_min) && t < f64::from(ray.t_max))
                || member.is_masked && !is_opaque(instance, primitive, bary)
            {
                continue;
            }
            if t < first {
                (second, first) = (first, t);
                best = Some(Hit {
                    t: t as f32,
                    bary,
                    instance,
                    primitive,
                    record: NO_RECORD,
                });
            } else {
                second = second.min(t);
            }
        }
    }
    (best, second)
}

/// Möller and Trumbore in double precision.
fn intersect_double(
    record: &Record,
    member: &Member,
    origin: DVec3,
    direction: DVec3,
) -> Option<(f64, [f32; 2])> {
    let corners = member
        .corners
        .map(|corner| vertex(record, corner).as_dvec3());
    let [a, b, c] = member.given(corners);
    let (ab, ac) = (b - a, c - a);
    let across = direction.cross(ac);
    let det = ab.dot(across);
    if det == 0.0 {
        return None;
    }
    let from_a = origin - a;
    let v = from_a.dot(across) / det;
    let around = from_a.cross(ab);
    let w = direction.dot(around) / det;
    let inside = v >= 0.0 && w >= 0.0 && v + w <= 1.0;
    inside.then(|| (ac.dot(around) / det, [v as f32, w as f32]))
}
