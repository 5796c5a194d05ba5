//! A second look at which children share a node: where one is very large, the grid of the node is too coarse for the
//! others, whose boxes on it are much larger than they are. Those get a node of their own, with a grid of their own.

use std::ops::Range;

use obvhs::aabb::Aabb;
use obvhs::cwbvh::node::CwBvhNode;

use super::grid::Grid;
use super::topology::{Slot, Topology};

/// What a slot leads to.
#[derive(Clone)]
enum Kind {
    /// A node of the old tree.
    Node(usize),
    /// Range of the old order.
    Leaf(Range<usize>),
    /// A node of children that moved.
    Group(Box<Family>),
}

/// The children of a node in their slots, with their exact bounds.
type Family = [Option<(Kind, Aabb)>; 8];

impl Topology {
    /// The same leaves, with more nodes where these cost less than they save.
    pub(super) fn regrouped(&self, boxes: &[Aabb]) -> Self {
        let bounds = self.bounds(boxes);
        let family = |node: usize| {
            [0, 1, 2, 3, 4, 5, 6, 7].map(|slot| match Self::slot(&self.nodes[node], slot) {
                Slot::Empty => None,
                Slot::Node(child) => Some((Kind::Node(child), bounds[child])),
                Slot::Leaf(leaf) => Some((Kind::Leaf(leaf.clone()), self.leaf_bounds(leaf, boxes))),
            })
        };
        let mut topology = Self {
            nodes: vec![CwBvhNode::default()],
            order: Vec::with_capacity(self.order.len()),
        };
        // In obvhs's order: a node, then all below its first child, then all below its second.
        let mut pending = vec![(0, family(0))];
        while let Some((index, mut children)) = pending.pop() {
            while let Some(members) = worth_moving(&children) {
                move_down(&mut children, members);
            }
            let mut node = CwBvhNode {
                child_base_idx: topology.nodes.len() as u32,
                primitive_base_idx: topology.order.len() as u32,
                ..CwBvhNode::default()
            };
            let mut below = Vec::new();
            for (slot, child) in children.into_iter().enumerate() {
                let inner = match child {
                    None => continue,
                    Some((Kind::Leaf(leaf), _)) => {
                        let first = topology.order.len() as u32 - node.primitive_base_idx;
                        node.child_meta[slot] = (((1u32 << leaf.len()) - 1) << 5 | first) as u8;
                        topology.order.extend(&self.order[leaf]);
                        continue;
                    }
                    Some((Kind::Node(child), _)) => family(child),
                    Some((Kind::Group(group), _)) => *group,
                };
                node.imask |= 1 << slot;
                node.child_meta[slot] = 0b0010_0000 | (24 + slot) as u8;
                below.push((topology.nodes.len(), inner));
                topology.nodes.push(CwBvhNode::default());
            }
            topology.nodes[index] = node;
            pending.extend(below.into_iter().rev());
        }
        topology
    }
}

fn boxes_of(children: &Family, members: u32) -> impl Iterator<Item = Aabb> {
    let chosen = children.iter().enumerate();
    let chosen = chosen.filter(move |(slot, _)| members >> slot & 1 != 0);
    chosen.filter_map(|(_, child)| child.as_ref().map(|(_, bounds)| *bounds))
}

fn union(boxes: impl Iterator<Item = Aabb>) -> Aabb {
    boxes.fold(Aabb::empty(), |all, one| all.union(&one))
}

/// The children, as bits, that a node of their own makes cheaper to trace; those for which that is worth most.
/// A child costs a visit of every ray that meets its box on the grid of its node.
fn worth_moving(children: &Family) -> Option<u32> {
    let all = (0..8).filter(|&slot| children[slot].is_some());
    let all = all.fold(0, |bits, slot| bits | 1 << slot);
    let coarse = Grid::around(&union(boxes_of(children, all)));
    let cost = |grid: &Grid, members: u32| -> f64 {
        boxes_of(children, members)
            .map(|one| grid.half_area(&one))
            .sum()
    };
    // What can be saved at most, and the least that a node costs.
    let exact: f64 = boxes_of(children, all)
        .map(|one| f64::from(one.half_area()))
        .sum();
    let least = boxes_of(children, all).map(|one| one.half_area());
    let least = f64::from(least.fold(f32::INFINITY, f32::min));
    if cost(&coarse, all) - exact <= least {
        return None;
    }
    let mut best = None;
    let mut most = 0.0;
    // All subsets but the whole.
    let mut members = all & all.wrapping_sub(1);
    while members != 0 {
        let bounds = union(boxes_of(children, members));
        let own = Grid::around(&bounds);
        let saved = cost(&coarse, members) - cost(&own, members) - coarse.half_area(&bounds);
        if saved > most {
            most = saved;
            best = Some(members);
        }
        members = members.wrapping_sub(1) & all;
    }
    best
}

/// Moves children to a node of their own in that of their slots in which their middle lies.
fn move_down(children: &mut Family, members: u32) {
    let middle = union(boxes_of(children, u32::MAX)).center();
    let bounds = union(boxes_of(children, members));
    let away = bounds.center() - middle;
    let mut group = Family::default();
    let mut slots = Vec::new();
    for slot in (0..8).filter(|slot| members >> slot & 1 != 0) {
        group[slot] = children[slot].take();
        slots.push(slot);
    }
    // Slots with the bit of an axis are on its far side.
    let reach = |slot: usize| -> f32 {
        let side = |axis: usize| {
            if slot & (4 >> axis) != 0 {
                away[axis]
            } else {
                -away[axis]
            }
        };
        side(0) + side(1) + side(2)
    };
    let slot = slots
        .into_iter()
        .max_by(|&a, &b| reach(a).total_cmp(&reach(b)));
    if let Some(slot) = slot {
        children[slot] = Some((Kind::Group(Box::new(group)), bounds));
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3A;

    use super::super::topology::Effort;
    use super::*;
    use crate::bvh::Quality;

    /// Boxes of `count` small things in a cube of a metre, and a ground so many metres wide.
    fn boxes(count: u32, ground: Option<f32>) -> Vec<Aabb> {
        let place = |k: u32| {
            let part = |prime: u32| (k * prime % 1009) as f32 / 1009.0;
            Vec3A::new(part(7), part(71), part(709))
        };
        let thing = |k| Aabb::new(place(k), place(k) + 0.02);
        let ground = ground.map(|width| {
            let half = Vec3A::new(0.5 * width, 0.0, 0.5 * width);
            Aabb::new(-half, half)
        });
        (0..count).map(thing).chain(ground).collect()
    }

    /// Half the surfaces of all children but the largest on the grids of their nodes, square metres.
    fn cost(topology: &Topology, boxes: &[Aabb]) -> f64 {
        let bounds = topology.bounds(boxes);
        let (mut sum, mut largest) = (0.0, 0.0f64);
        for (index, node) in topology.nodes.iter().enumerate() {
            let grid = Grid::around(&bounds[index]);
            for slot in 0..8 {
                let area = match Topology::slot(node, slot) {
                    Slot::Empty => continue,
                    Slot::Node(child) => grid.half_area(&bounds[child]),
                    Slot::Leaf(leaf) => grid.half_area(&topology.leaf_bounds(leaf, boxes)),
                };
                sum += area;
                largest = largest.max(area);
            }
        }
        sum - largest
    }

    #[test]
    fn a_large_neighbour_costs_one_more_node() {
        let effort = Effort::Group(Quality::Best);
        for count in [6, 40, 1000] {
            let alone = boxes(count, None);
            let plain = cost(&Topology::clustered(&alone, effort), &alone);
            for width in [30.0, 1e3, 1e5] {
                let boxes = boxes(count, Some(width));
                let before = Topology::clustered(&boxes, effort);
                let after = before.regrouped(&boxes);
                let cell = f64::from(width) / 128.0;
                // the box of the new node is some cells large, and the rest may lie in another tree
                let bound = 1.1 * plain + 3.0 * (1.1 + 2.0 * cell) * (1.1 + 2.0 * cell);
                let cost = [cost(&before, &boxes), cost(&after, &boxes)];
                assert!(
                    cost[1] <= bound,
                    "{count}, {width} m: {cost:?}, bound {bound}"
                );
                assert!(cost[1] <= cost[0], "{count}, {width} m: {cost:?}");
                if width >= 1e3 {
                    assert!(cost[0] > 1.5 * cost[1], "{count}, {width} m: {cost:?}");
                }
                let mut order = after.order.clone();
                order.sort_unstable();
                assert!(order.into_iter().eq(0..=count), "a leaf is lost");
            }
        }
    }

    #[test]
    fn a_tree_without_large_neighbours_stays_as_it_is() {
        for boxes in [boxes(1000, None), boxes(1, None), boxes(0, Some(1.0))] {
            let before = Topology::clustered(&boxes, Effort::Group(Quality::Best));
            let after = before.regrouped(&boxes);
            assert_eq!(after.order, before.order);
            assert_eq!(after.nodes.len(), before.nodes.len());
            for (a, b) in after.nodes.iter().zip(&before.nodes) {
                assert_eq!(a.child_meta, b.child_meta);
                assert_eq!(a.imask, b.imask);
                assert_eq!(a.child_base_idx, b.child_base_idx);
                assert_eq!(a.primitive_base_idx, b.primitive_base_idx);
            }
        }
    }
}
