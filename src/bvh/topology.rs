//! Which things lie together in which node. obvhs decides; where its tree is too
//! deep for the traversal stack, a balanced one is built instead.

use std::time::Duration;

use glam::Vec3A;
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::cwbvh::builder::build_cwbvh;
use obvhs::cwbvh::node::CwBvhNode;

use super::Quality;

/// How a tree is built.
#[derive(Clone, Copy, Debug)]
pub(super) enum Effort {
    /// Over triangles.
    Group(Quality),
    /// Over instances: few boxes, and visits that are worth avoiding.
    TopLevel,
}

impl Effort {
    fn params(self) -> BvhBuildParams {
        let preset = match self {
            Self::Group(Quality::Fast) => BvhBuildParams::very_fast_build(),
            Self::Group(Quality::Balanced) => BvhBuildParams::medium_build(),
            Self::Group(Quality::Best) | Self::TopLevel => BvhBuildParams::very_slow_build(),
        };
        BvhBuildParams {
            // Each triangle is in one leaf only: records are not duplicated and boxes contain them.
            pre_split: false,
            // A record is dearer to meet than its box, and lanes that have one wait for those that have more.
            max_prims_per_leaf: 1,
            ..preset
        }
    }
}

/// Records in a leaf of a balanced tree at most: what the node's unary count holds.
const MAX_LEAF: usize = 3;

/// Disturbance of a box relative to its longest side: does not change which tree is good.
const DISTURB_SIZE: f32 = 1.0 / 1024.0;
/// Disturbance relative to its coordinates: a few times their rounding.
const DISTURB_REACH: f32 = 1.0 / (1 << 21) as f32;
/// Disturbance in metres of a point at the origin: areas stay normal numbers.
const DISTURB_LEAST: f32 = 1e-14;
/// Bytes of address space for the builder's stack: enough for a chain of a million.
const BUILD_STACK: usize = 512 << 20;

/// What a slot of a node holds.
pub(super) enum Slot {
    Empty,
    /// Index of a node.
    Node(usize),
    /// Range of [`Topology::order`].
    Leaf(std::ops::Range<usize>),
}

/// Nodes without boxes, children after their parents, and the order of the leaves' entries.
pub(super) struct Topology {
    /// The root first; never empty. Only links and masks are valid.
    pub(super) nodes: Vec<CwBvhNode>,
    /// Index of the box that each leaf entry stands for.
    pub(super) order: Vec<u32>,
}

impl Topology {
    /// A tree over `boxes` of at most `max_levels` levels, which must be enough for a balanced tree.
    pub(super) fn build(boxes: &[Aabb], effort: Effort, max_levels: u32) -> Self {
        if boxes.is_empty() {
            return Self {
                nodes: vec![CwBvhNode::default()],
                order: Vec::new(),
            };
        }
        let topology = Self::clustered(boxes, effort);
        let regrouped = topology.regrouped(boxes);
        for topology in [regrouped, topology] {
            if topology.levels() <= max_levels {
                return topology;
            }
        }
        let balanced = Self::balanced(boxes);
        assert!(
            balanced.levels() <= max_levels,
            "log₈ of 2³² things is below every limit"
        );
        balanced
    }

    /// The tree of obvhs. It merges neighbours along a curve through space that each prefer the other; where costs
    /// tie or grow along the curve only one pair does, which takes quadratic time and ends in a chain. So boxes go in
    /// shuffled, which is the order of boxes with one centre, and disturbed, which breaks ties.
    pub(super) fn clustered(boxes: &[Aabb], effort: Effort) -> Self {
        let mut random = SplitMix(0);
        let mut shuffle: Vec<_> = (0..boxes.len() as u32).collect();
        for last in (1..shuffle.len()).rev() {
            shuffle.swap(last, (random.next() % (last as u64 + 1)) as usize);
        }
        let disturbed: Vec<_> = shuffle
            .iter()
            .map(|&index| disturb(&boxes[index as usize], &mut random))
            .collect();
        let build = || build_cwbvh(&disturbed, effort.params(), &mut Duration::default());
        // Conversion descends recursively: a chain must not end the process.
        let built = std::thread::scope(|scope| {
            std::thread::Builder::new()
                .stack_size(BUILD_STACK)
                .spawn_scoped(scope, build)
                .map_or_else(
                    |_| build(),
                    |thread| thread.join().expect("obvhs accepts finite boxes"),
                )
        });
        let original = |index: &u32| shuffle[*index as usize];
        Self {
            nodes: built.nodes,
            order: built.primitive_indices.iter().map(original).collect(),
        }
    }

    /// Splits the boxes at the median of their centres, three times a node: as shallow as a tree can be.
    pub(super) fn balanced(boxes: &[Aabb]) -> Self {
        let mut topology = Self {
            nodes: vec![CwBvhNode::default()],
            order: (0..boxes.len() as u32).collect(),
        };
        // Nodes to fill and the part of `order` below them.
        let mut pending = vec![(0, 0..boxes.len())];
        while let Some((index, range)) = pending.pop() {
            let mut parts = vec![range.clone()];
            for _ in 0..3 {
                parts = parts
                    .into_iter()
                    .flat_map(|part| {
                        let middle = part.start + part.len() / 2;
                        if part.len() > MAX_LEAF {
                            split(boxes, &mut topology.order[part.clone()]);
                            vec![part.start..middle, middle..part.end]
                        } else {
                            vec![part]
                        }
                    })
                    .collect();
            }
            let mut node = CwBvhNode {
                child_base_idx: topology.nodes.len() as u32,
                primitive_base_idx: range.start as u32,
                ..Default::default()
            };
            // Offsets of leaves stay below 24: halves on the right are never the smaller ones, so parts before a leaf
            // of three hold at most four, and the last part is a leaf only when all are.
            let mut next = 0;
            for (slot, part) in parts.into_iter().enumerate() {
                if part.len() <= MAX_LEAF {
                    node.child_meta[slot] =
                        (((1u32 << part.len()) - 1) << 5) as u8 | (part.start - range.start) as u8;
                } else {
                    node.imask |= 1 << slot;
                    node.child_meta[slot] = 0b0010_0000 | (24 + slot) as u8;
                    pending.push((node.child_base_idx as usize + next, part));
                    next += 1;
                }
            }
            topology.nodes[index] = node;
            let length = topology.nodes.len() + next;
            topology.nodes.resize(length, CwBvhNode::default());
        }
        topology
    }

    /// What slot `slot` of `node` holds.
    pub(super) fn slot(node: &CwBvhNode, slot: usize) -> Slot {
        if node.is_child_empty(slot) {
            Slot::Empty
        } else if node.is_leaf(slot) {
            let (first, count) = node.child_primitives(slot);
            Slot::Leaf(first as usize..(first + count) as usize)
        } else {
            Slot::Node(node.child_node_index(slot) as usize)
        }
    }

    /// Number of nodes on the longest way down.
    pub(super) fn levels(&self) -> u32 {
        let mut levels = vec![1; self.nodes.len()];
        for (index, node) in self.nodes.iter().enumerate() {
            for slot in 0..8 {
                if let Slot::Node(child) = Self::slot(node, slot) {
                    levels[child] = levels[index] + 1;
                }
            }
        }
        levels.into_iter().max().unwrap_or(0)
    }

    /// Exact bounds of everything below each node.
    pub(super) fn bounds(&self, boxes: &[Aabb]) -> Vec<Aabb> {
        let mut bounds = vec![Aabb::empty(); self.nodes.len()];
        for (index, node) in self.nodes.iter().enumerate().rev() {
            for slot in 0..8 {
                let child = match Self::slot(node, slot) {
                    Slot::Empty => continue,
                    Slot::Node(child) => bounds[child],
                    Slot::Leaf(range) => self.leaf_bounds(range, boxes),
                };
                bounds[index] = bounds[index].union(&child);
            }
        }
        bounds
    }

    /// Exact bounds of a leaf.
    pub(super) fn leaf_bounds(&self, range: std::ops::Range<usize>, boxes: &[Aabb]) -> Aabb {
        self.order[range]
            .iter()
            .map(|&index| boxes[index as usize])
            .fold(Aabb::empty(), |all, one| all.union(&one))
    }
}

/// The box, enlarged by random amounts that are small against its size, and large enough to differ after rounding.
fn disturb(exact: &Aabb, random: &mut SplitMix) -> Aabb {
    let size = exact.diagonal().max_element();
    let reach = exact.min.abs().max(exact.max.abs());
    let amount = size * DISTURB_SIZE + reach * DISTURB_REACH + DISTURB_LEAST;
    Aabb::new(
        exact.min - amount * random.unit_vector(),
        exact.max + amount * random.unit_vector(),
    )
}

/// SplitMix64, for repeatable disorder.
struct SplitMix(u64);

impl SplitMix {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// In [0, 1)³, 21 bits each.
    fn unit_vector(&mut self) -> Vec3A {
        let bits = self.next();
        let part = |shift: u32| (bits >> shift & 0x1f_ffff) as f32 / (1 << 21) as f32;
        Vec3A::new(part(0), part(21), part(42))
    }
}

/// Orders `part` so that its halves are separated along the axis on which the centres spread most.
fn split(boxes: &[Aabb], part: &mut [u32]) {
    let centre = |index: u32| boxes[index as usize].center();
    let (low, high) = part.iter().fold(
        (Vec3A::INFINITY, Vec3A::NEG_INFINITY),
        |(low, high), &index| (low.min(centre(index)), high.max(centre(index))),
    );
    let spread = high - low;
    let axis = (0..3).fold(0, |best, axis| {
        if spread[axis] > spread[best] {
            axis
        } else {
            best
        }
    });
    let middle = part.len() / 2;
    part.select_nth_unstable_by(middle, |&a, &b| {
        centre(a)[axis].total_cmp(&centre(b)[axis]).then(a.cmp(&b))
    });
}
