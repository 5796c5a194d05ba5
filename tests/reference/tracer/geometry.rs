//! Triangles in world space and the nearest one along a ray: Möller and
//! Trumbore's test below boxes that were split at the median.
//!
//! [Moeller97] Möller, Trumbore, Fast, Minimum Storage Ray/Triangle Intersection.

use etendue::scene::{Instance, Mesh, Scene};
use glam::DVec3;

/// Leaves hold at most so many triangles.
const LEAF: usize = 4;

/// No triangle: the ray starts in free space.
pub const NONE: usize = usize::MAX;

/// A triangle of a placed mesh.
pub struct Triangle {
    /// First corner, metres.
    pub v0: DVec3,
    /// From the first corner to the second.
    pub e1: DVec3,
    /// From the first corner to the third.
    pub e2: DVec3,
    /// Unit normal of the front side.
    pub front: DVec3,
    /// World-space shading normals of the corners, on the front side.
    pub normals: Option<[DVec3; 3]>,
    /// Index of the instance that it belongs to.
    pub instance: usize,
}

/// Where a ray met a triangle.
#[derive(Clone, Copy)]
pub struct Hit {
    /// Distance along the ray, metres.
    pub t: f64,
    /// Index into [`Geometry::triangles`].
    pub triangle: usize,
    /// Barycentric weights of the second and the third corner.
    pub bary: [f64; 2],
}

struct Node {
    low: DVec3,
    high: DVec3,
    first: usize,
    /// Triangles of a leaf; 0 in an inner node, whose children are the next node and `first`.
    count: usize,
}

/// All triangles of a scene.
pub struct Geometry {
    pub triangles: Vec<Triangle>,
    nodes: Vec<Node>,
}

impl Geometry {
    pub fn new(scene: &Scene) -> Self {
        let mut triangles: Vec<Triangle> = scene
            .instances
            .iter()
            .enumerate()
            .flat_map(|(i, instance)| placed(i, instance, &scene.meshes[instance.mesh as usize]))
            .collect();
        let mut nodes = Vec::new();
        if !triangles.is_empty() {
            split(&mut triangles, 0, &mut nodes);
        }
        Self { triangles, nodes }
    }

    /// The first triangle that the ray meets, without `skip`, on which it starts.
    pub fn closest(&self, origin: DVec3, direction: DVec3, skip: usize) -> Option<Hit> {
        let inverse = direction.recip();
        let mut best: Option<Hit> = None;
        // Halving 2⁶⁴ triangles leaves no more than 64 nodes to come back to.
        let mut stack = [0; 65];
        let mut waiting = usize::from(!self.nodes.is_empty());
        while waiting > 0 {
            waiting -= 1;
            let n = stack[waiting];
            let node = &self.nodes[n];
            let limit = best.map_or(f64::INFINITY, |hit| hit.t);
            if !meets(node, origin, inverse, limit) {
                continue;
            }
            if node.count == 0 {
                stack[waiting] = node.first;
                stack[waiting + 1] = n + 1;
                waiting += 2;
                continue;
            }
            for triangle in node.first..node.first + node.count {
                if triangle == skip {
                    continue;
                }
                if let Some((t, bary)) = intersect(&self.triangles[triangle], origin, direction) {
                    if best.is_none_or(|hit| t < hit.t) {
                        best = Some(Hit { t, triangle, bary });
                    }
                }
            }
        }
        best
    }
}

/// The triangles of an instance in world space, without degenerate ones.
fn placed(index: usize, instance: &Instance, mesh: &Mesh) -> Vec<Triangle> {
    let place = &instance.world_from_object;
    let is_mirrored = place.matrix3.determinant() < 0.0;
    let normal_matrix = place.matrix3.inverse().transpose();
    let corner = |v: u32| place.transform_point3(mesh.positions[v as usize].as_dvec3());
    mesh.triangles
        .iter()
        .filter_map(|&[a, b, c]| {
            let v0 = corner(a);
            let (e1, e2) = (corner(b) - v0, corner(c) - v0);
            let mut front = e1.cross(e2).try_normalize()?;
            if is_mirrored {
                front = -front;
            }
            let normals = (!mesh.normals.is_empty())
                .then(|| [a, b, c].map(|v| normal_matrix * mesh.normals[v as usize].as_dvec3()));
            Some(Triangle {
                v0,
                e1,
                e2,
                front,
                normals,
                instance: index,
            })
        })
        .collect()
}

fn centre(t: &Triangle) -> DVec3 {
    t.v0 + (t.e1 + t.e2) / 3.0
}

/// Appends the tree over `triangles`, the first of which has index `offset`.
fn split(triangles: &mut [Triangle], offset: usize, nodes: &mut Vec<Node>) {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for t in triangles.iter() {
        for p in [t.v0, t.v0 + t.e1, t.v0 + t.e2] {
            low = low.min(p);
            high = high.max(p);
        }
    }
    // Room for the roundings of the slab test.
    let margin = 1e-12 * (low.abs() + high.abs()).max_element();
    let this = nodes.len();
    nodes.push(Node {
        low: low - margin,
        high: high + margin,
        first: offset,
        count: triangles.len(),
    });
    if triangles.len() <= LEAF {
        return;
    }
    let size = high - low;
    let axis = (0..3).max_by(|&a, &b| size[a].total_cmp(&size[b])).unwrap();
    let middle = triangles.len() / 2;
    triangles.select_nth_unstable_by(middle, |a, b| centre(a)[axis].total_cmp(&centre(b)[axis]));
    let (left, right) = triangles.split_at_mut(middle);
    split(left, offset, nodes);
    nodes[this].first = nodes.len();
    nodes[this].count = 0;
    split(right, offset + middle, nodes);
}

/// Whether the ray is inside the box anywhere between 0 and `limit`.
fn meets(node: &Node, origin: DVec3, inverse: DVec3, limit: f64) -> bool {
    let a = (node.low - origin) * inverse;
    let b = (node.high - origin) * inverse;
    // A ray within a plane of the box gives NaN there, which `min` and `max` of f64 pass over.
    let (mut near, mut far) = (0.0_f64, limit);
    for axis in 0..3 {
        near = near.max(a[axis].min(b[axis]));
        far = far.min(a[axis].max(b[axis]));
    }
    near <= far
}

/// Distance and barycentric weights, from both sides. [Moeller97]
fn intersect(triangle: &Triangle, origin: DVec3, direction: DVec3) -> Option<(f64, [f64; 2])> {
    let p = direction.cross(triangle.e2);
    let det = triangle.e1.dot(p);
    if det == 0.0 {
        return None;
    }
    let s = origin - triangle.v0;
    let u = s.dot(p) / det;
    if !(0.0..=1.0).contains(&u) {
        return None;
    }
    let q = s.cross(triangle.e1);
    let v = direction.dot(q) / det;
    if v < 0.0 || u + v > 1.0 {
        return None;
    }
    let t = triangle.e2.dot(q) / det;
    (t > 0.0).then_some((t, [u, v]))
}
