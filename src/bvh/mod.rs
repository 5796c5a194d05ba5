//! The project's own bounding volume hierarchy: an eight-wide tree with
//! quantised child boxes (CWBVH, \[Ylitie17\]), built by the obvhs crate, read by
//! `shaders/traverse_software.glsl` and, as the oracle of the tests, by
//! [`traverse`].
//!
//! A *group* is a list of triangles with one tree. Without instances there is one
//! group in world space and one level. With instances a top level over the world
//! boxes of the instances leads to the groups, whose rays are transformed to
//! object space.
//!
//! # Node, twenty words (80 bytes, five texels)
//!
//! | word | bits | meaning |
//! |---|---|---|
//! | 0–2 | f32 | `p`: lower corner of the node's box |
//! | 3 | 3 × 8 | biased exponents of the cell size `e` per axis: `e = bits_to_float(byte << 23)` |
//! | 3 | 24–31 | `imask`: bit i is set when slot i holds a node |
//! | 4 | u32 | index of the first child node in [`Bvh::nodes`]; the others follow in slot order |
//! | 5 | u32 | index of the first record in [`Bvh::triangles`] that the leaves refer to |
//! | 6–7 | 8 × 8 | `meta`, one byte a slot: 0 when empty; node: `0b001` then slot + 24; leaf: 1, 2 or 3 records in unary (`0b001`, `0b011`, `0b111`), then the offset 0–23 of the first |
//! | 8–11 | 16 × 8 | lower x of the slots, then upper x |
//! | 12–15 | 16 × 8 | the same for y |
//! | 16–19 | 16 × 8 | the same for z |
//!
//! Bytes are counted from the low end of a word. The box of a slot is
//! `[p + e·lower, p + e·upper]` and contains, in exact arithmetic, everything below it.
//!
//! # Record, sixteen words (64 bytes, four texels)
//!
//! One triangle `v0 v1 v2`, or two with a common edge, `v0 v1 v2` and `v0 v2 v3`: two in a
//! record take four texel fetches instead of six, and their common edge is tested once.
//! `v0.xyz`, index of the first triangle within the group; `v1.xyz`, index of the second or
//! [`NO_TRIANGLE`]; `v2.xyz`, flags: [`FIRST_MASKED`], [`SECOND_MASKED`], [`FLAT`] and two bits each from
//! [`FIRST_TURN`] and [`SECOND_TURN`], which say which corner of the triangle as it was given is
//! `v0`; `v3.xyz`, equal to `v0` when there is no second triangle, 0. A leaf entry of the top level:
//! three words unused, index of the instance, the rest unused. Integers are stored as the bits of a float.
//!
//! All indices count from the start of the arrays, so a root is all that traversal needs.
//!
//! # References
//!
//! \[Ylitie17\] Ylitie, Karras, Laine: Efficient incoherent ray traversal on GPUs
//! through compressed wide BVHs. High-Performance Graphics 2017.

mod build;
#[cfg(test)]
mod flat;
mod grid;
mod pairs;
mod patches;
mod regroup;
#[cfg(test)]
mod tests;
mod topology;
pub mod traverse;
mod validate;
#[cfg(test)]
mod watertight;

use glam::Vec3;

pub use patches::Patch;

/// A packed node.
pub type Node = [u32; 20];
/// One or two packed triangles or a leaf entry of the top level.
pub type Record = [f32; 16];

/// Flag of a record whose first triangle may be cut out: hits are confirmed by the alpha test.
pub const FIRST_MASKED: u32 = 1;
/// The same for the second triangle.
pub const SECOND_MASKED: u32 = 2;
/// Position of the bits that hold how far the first triangle is turned.
pub const FIRST_TURN: u32 = 2;
/// The same for the second triangle.
pub const SECOND_TURN: u32 = 4;
/// Flag of a record whose triangles lie in one plane exactly: a ray that leaves one of them meets none of them.
pub const FLAT: u32 = 64;
/// Stands for a second triangle that is not there; not a NaN, so that records compare.
pub const NO_TRIANGLE: u32 = f32::MAX.to_bits();
/// Levels of nodes that a top level may have.
pub const MAX_TOP_LEVELS: u32 = 10;
/// Levels of nodes that a group may have.
pub const MAX_GROUP_LEVELS: u32 = 22;
/// Entries of the traversal stack, as in the shader. A node leaves at most one entry behind when one of its children
/// is visited, and the last level has no child nodes. Entering an instance leaves at most two: what remains of the
/// node's children and of its leaves. So a top level of a levels and a group of b need (a − 1) + 2 + (b − 1).
pub const STACK_SIZE: usize = 32;
const _: () = assert!((MAX_TOP_LEVELS + MAX_GROUP_LEVELS) as usize <= STACK_SIZE);
/// Largest coordinate, metres: products of three coordinates stay finite in single precision.
pub const MAX_COORDINATE: f32 = 1e12;

/// How much time building may take.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Quality {
    /// For previews: a fifth faster to build than `Balanced`, slower to trace.
    Fast,
    /// About 1.2 s per million triangles on one core.
    #[default]
    Balanced,
    /// Up to a fifth faster to trace, where triangles are of unequal size, for about twice the build time.
    Best,
}

/// The triangles of one group.
#[derive(Clone, Copy, Debug)]
pub struct GroupDesc<'a> {
    /// Corners, three for each triangle, metres in the group's space. Shared vertices must be equal to the bit for
    /// edges without gaps.
    pub positions: &'a [Vec3],
    /// For each triangle whether it may be cut out; empty when none is.
    pub masked: &'a [bool],
}

/// A group placed in the world. Matrices are columns of 4 × 3, as in `layout::Instance`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InstanceDesc {
    /// Index of the group.
    pub group: u32,
    /// Object to world.
    pub world_from_object: [[f32; 3]; 4],
    /// World to object: what traversal applies to rays.
    pub object_from_world: [[f32; 3]; 4],
}

impl InstanceDesc {
    /// A group that already is in world space.
    pub const fn identity(group: u32) -> Self {
        let identity = [[1., 0., 0.], [0., 1., 0.], [0., 0., 1.], [0., 0., 0.]];
        Self {
            group,
            world_from_object: identity,
            object_from_world: identity,
        }
    }
}

/// Where a group lies in the arrays of a [`Bvh`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GroupRange {
    /// Its root in [`Bvh::nodes`].
    pub root: u32,
    /// Its first record in [`Bvh::triangles`].
    pub first_record: u32,
    /// Number of its records.
    pub record_count: u32,
    /// Number of its triangles.
    pub triangle_count: u32,
}

/// A tree ready to be uploaded. Neither array is ever empty: a group without triangles has a node without children.
#[derive(Clone, Debug, PartialEq)]
pub struct Bvh {
    /// Nodes of all groups, then of the top level.
    pub nodes: Vec<Node>,
    /// Triangles of all groups in the order of their leaves, then the leaf entries of the top level.
    pub triangles: Vec<Record>,
    /// One entry for each group.
    pub groups: Vec<GroupRange>,
    /// The instances of the top level; empty when there is one level only.
    pub instances: Vec<InstanceDesc>,
    /// Where traversal starts: root of the top level, or of group 0 when there is one level only.
    pub root: u32,
}

impl Bvh {
    /// Bytes of nodes and records on the device.
    pub fn bytes(&self) -> u64 {
        (size_of_val(self.nodes.as_slice()) + size_of_val(self.triangles.as_slice())) as u64
    }

    /// Bytes of nodes and records for each triangle of the groups; 0 without triangles.
    pub fn bytes_per_triangle(&self) -> f64 {
        let count: u64 = self
            .groups
            .iter()
            .map(|group| u64::from(group.triangle_count))
            .sum();
        if count == 0 {
            return 0.0;
        }
        self.bytes() as f64 / count as f64
    }
}

/// What a slot of a node holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Child {
    Empty,
    /// Index of a node.
    Node(u32),
    /// First record and number of records.
    Leaf(u32, u32),
}

/// The content of slot `slot` (0–7) of a node.
fn child(node: &Node, slot: usize) -> Child {
    let meta = byte(node, 6, slot);
    if meta == 0 {
        return Child::Empty;
    }
    let low = meta & 31;
    if low >= 24 {
        let before = (node[3] >> 24) & !(u32::MAX << (low - 24));
        return Child::Node(node[4] + before.count_ones());
    }
    Child::Leaf(node[5] + low, (meta >> 5).count_ones())
}

/// Byte `index` (0–15) of the words from `word` on.
fn byte(node: &Node, word: usize, index: usize) -> u32 {
    node[word + index / 4] >> (8 * (index % 4)) & 0xff
}

/// Corner and cell size of a node's grid.
fn grid(node: &Node) -> ([f32; 3], [f32; 3]) {
    let p = [0, 1, 2].map(|axis| f32::from_bits(node[axis]));
    let e = [0, 1, 2].map(|axis| f32::from_bits((node[3] >> (8 * axis) & 0xff) << 23));
    (p, e)
}

/// Box of a slot in double precision, in which it is exact but for cells that are smaller than 2⁻⁵³ of `p`.
fn child_box(node: &Node, slot: usize) -> ([f64; 3], [f64; 3]) {
    let (p, e) = grid(node);
    let plane = |axis: usize, offset: usize| {
        let q = byte(node, 8 + 4 * axis, slot + offset);
        f64::from(p[axis]) + f64::from(q) * f64::from(e[axis])
    };
    (
        [0, 1, 2].map(|axis| plane(axis, 0)),
        [0, 1, 2].map(|axis| plane(axis, 8)),
    )
}

/// Vertex `corner` (0–3) of a record.
fn vertex(record: &Record, corner: usize) -> Vec3 {
    Vec3::from_slice(&record[4 * corner..4 * corner + 3])
}

/// A triangle of a record.
struct Member {
    /// Index within the group.
    id: u32,
    /// Which vertices of the record are its corners.
    corners: [usize; 3],
    is_masked: bool,
    /// Which of its corners, as it was given, comes first in the record.
    turn: usize,
}

impl Member {
    /// Something for each corner in the record's order, as the triangle was given.
    fn given<T: Copy>(&self, of_corners: [T; 3]) -> [T; 3] {
        [0, 1, 2].map(|corner| of_corners[(corner + 3 - self.turn) % 3])
    }
}

/// The one or two triangles of a record.
fn members(record: &Record) -> impl Iterator<Item = Member> {
    let flags = record[11].to_bits();
    let member = |id: u32, corners, mask, turn| Member {
        id,
        corners,
        is_masked: flags & mask != 0,
        turn: (flags >> turn & 3) as usize,
    };
    let first = member(record[3].to_bits(), [0, 1, 2], FIRST_MASKED, FIRST_TURN);
    let second = member(record[7].to_bits(), [0, 2, 3], SECOND_MASKED, SECOND_TURN);
    [first, second]
        .into_iter()
        .filter(|member| member.id != NO_TRIANGLE)
}

/// A point moved by a 4 × 3 matrix, in the shader's order of operations.
fn transform_point(matrix: &[[f32; 3]; 4], p: Vec3) -> Vec3 {
    transform_vector(matrix, p) + Vec3::from(matrix[3])
}

/// A vector moved by a 4 × 3 matrix, in the shader's order of operations.
fn transform_vector(matrix: &[[f32; 3]; 4], v: Vec3) -> Vec3 {
    Vec3::from(matrix[0]) * v.x + Vec3::from(matrix[1]) * v.y + Vec3::from(matrix[2]) * v.z
}
