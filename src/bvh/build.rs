//! From triangles to packed nodes. The tree's shape comes from `topology`; boxes
//! are quantised here rather than by obvhs, because traversal without gaps needs
//! boxes that contain their triangles in exact arithmetic, not up to rounding.

use std::path::PathBuf;

use glam::{DVec3, Vec3};
use obvhs::aabb::Aabb;

use super::grid::Grid;
use super::pairs::pair;
use super::topology::{Effort, Slot, Topology};
use super::{
    Bvh, GroupDesc, GroupRange, InstanceDesc, MAX_COORDINATE, MAX_GROUP_LEVELS, MAX_TOP_LEVELS,
    Node, Quality, Record, child, child_box,
};
use crate::error::{Error, Result};

/// Rounding of a ray that is moved to object space, relative to the terms of the transform: three products, three
/// sums and the inverse's own rounding make seven halves of 2⁻²³; about twice that.
const TRANSFORM_ROUNDING: f64 = 16.0 / (1u64 << 24) as f64;

impl Bvh {
    /// Builds the tree of each group and, when `instances` is not empty, the top level. Without instances group 0 is
    /// traced as it is.
    ///
    /// # Errors
    /// A coordinate that is not finite or beyond [`MAX_COORDINATE`]; more nodes or records than texels can be counted.
    ///
    /// # Panics
    /// When lengths do not fit (`positions` not a multiple of three, `masked` neither empty nor one per triangle),
    /// when an instance names a missing group, or without instances when there is more than one group.
    pub fn build(
        groups: &[GroupDesc],
        instances: &[InstanceDesc],
        quality: Quality,
    ) -> Result<Self> {
        assert!(
            !instances.is_empty() || groups.len() <= 1,
            "several groups need instances"
        );
        let mut bvh = Self {
            nodes: Vec::new(),
            triangles: Vec::new(),
            groups: Vec::with_capacity(groups.len()),
            instances: instances.to_vec(),
            root: 0,
        };
        for group in groups {
            bvh.push_group(group, quality)?;
        }
        if !instances.is_empty() {
            bvh.push_top_level()?;
        }
        // Buffers of the device cannot be empty; nothing refers to this record.
        if bvh.nodes.is_empty() {
            bvh.nodes.push([0; 20]);
        }
        if bvh.triangles.is_empty() {
            bvh.triangles.push([0.0; 16]);
        }
        Ok(bvh)
    }

    fn push_group(&mut self, group: &GroupDesc, quality: Quality) -> Result<()> {
        assert!(
            group.positions.len() % 3 == 0,
            "each triangle has three corners"
        );
        let corners: &[[Vec3; 3]] = bytemuck::cast_slice(group.positions);
        assert!(
            group.masked.is_empty() || group.masked.len() == corners.len(),
            "one flag for each triangle"
        );
        let boxes = corners
            .iter()
            .enumerate()
            .map(|(index, corners)| triangle_box(corners, index))
            .collect::<Result<Vec<_>>>()?;
        let pairs = pair(corners, &boxes);
        let boxes: Vec<_> = pairs.iter().map(|pair| pair.bounds(&boxes)).collect();
        let topology = Topology::build(&boxes, Effort::Group(quality), MAX_GROUP_LEVELS);
        let first_record = self.triangles.len() as u32;
        let root = self.push_nodes(&topology, &boxes)?;
        let records = topology.order.iter();
        self.triangles
            .extend(records.map(|&index| pairs[index as usize].record(corners, group.masked)));
        self.groups.push(GroupRange {
            root,
            first_record,
            record_count: pairs.len() as u32,
            triangle_count: corners.len() as u32,
        });
        Ok(())
    }

    fn push_top_level(&mut self) -> Result<()> {
        let boxes = self
            .instances
            .iter()
            .enumerate()
            .map(|(index, instance)| {
                let root = self.groups[instance.group as usize].root;
                instance_box(&self.nodes[root as usize], instance, index)
            })
            .collect::<Result<Vec<_>>>()?;
        let topology = Topology::build(&boxes, Effort::TopLevel, MAX_TOP_LEVELS);
        self.root = self.push_nodes(&topology, &boxes)?;
        self.triangles.extend(topology.order.iter().map(|&index| {
            let mut record: Record = [0.0; 16];
            record[3] = f32::from_bits(index);
            record
        }));
        Ok(())
    }

    /// Appends the packed nodes of a tree whose records are about to be appended, and returns its root.
    fn push_nodes(&mut self, topology: &Topology, boxes: &[Aabb]) -> Result<u32> {
        let (first_node, first_record) = (self.nodes.len(), self.triangles.len());
        for (what, count, texels) in [
            ("the BVH's nodes", first_node + topology.nodes.len(), 5),
            (
                "the BVH's triangles",
                first_record + topology.order.len(),
                4,
            ),
        ] {
            let texels = count as u64 * texels;
            if i32::try_from(texels).is_err() {
                return Err(Error::OutOfMemory {
                    what: what.to_owned(),
                    bytes: texels * 16,
                });
            }
        }
        let bounds = topology.bounds(boxes);
        let packed = topology.nodes.iter().enumerate().map(|(index, node)| {
            let children = [0, 1, 2, 3, 4, 5, 6, 7].map(|slot| match Topology::slot(node, slot) {
                Slot::Empty => None,
                Slot::Node(child) => Some(bounds[child]),
                Slot::Leaf(leaf) => Some(topology.leaf_bounds(leaf, boxes)),
            });
            let mut packed = quantise(&bounds[index], &children);
            packed[3] |= u32::from(node.imask) << 24;
            packed[4] = first_node as u32 + node.child_base_idx;
            packed[5] = first_record as u32 + node.primitive_base_idx;
            let [a, b, c, d, e, f, g, h] = node.child_meta;
            packed[6] = u32::from_le_bytes([a, b, c, d]);
            packed[7] = u32::from_le_bytes([e, f, g, h]);
            packed
        });
        self.nodes.extend(packed);
        Ok(first_node as u32)
    }
}

/// A node's grid and the boxes of its children on it, rounded outwards so that they contain `children` exactly.
fn quantise(bounds: &Aabb, children: &[Option<Aabb>; 8]) -> Node {
    let mut node: Node = [0; 20];
    let grid = Grid::around(bounds);
    for axis in 0..3 {
        if bounds.min[axis] > bounds.max[axis] {
            continue; // no children
        }
        node[axis] = bounds.min[axis].to_bits();
        node[3] |= (grid.exponents[axis] as u32) << (8 * axis);
        for (slot, child) in children.iter().enumerate() {
            let Some(child) = child else { continue };
            for (plane, offset) in grid.planes(child, axis).into_iter().zip([0, 8]) {
                let index = slot + offset;
                node[8 + 4 * axis + index / 4] |= (plane as u32) << (8 * (index % 4));
            }
        }
    }
    node
}

fn triangle_box(corners: &[Vec3; 3], index: usize) -> Result<Aabb> {
    let valid = |v: &Vec3| v.abs().max_element() <= MAX_COORDINATE && !v.is_nan();
    if !corners.iter().all(valid) {
        return Err(out_of_range(&format!("triangle {index}")));
    }
    let [a, b, c] = *corners;
    Ok(Aabb::new(a.min(b).min(c).into(), a.max(b).max(c).into()))
}

/// World box of an instance: that of its group's outermost child boxes, enlarged by what rounding may do to a ray
/// on its way to object space.
fn instance_box(root: &Node, instance: &InstanceDesc, index: usize) -> Result<Aabb> {
    let columns = |m: &[[f32; 3]; 4]| m.map(|c| DVec3::new(c[0].into(), c[1].into(), c[2].into()));
    let to_world = columns(&instance.world_from_object);
    let to_object = columns(&instance.object_from_world);
    let apply = |m: &[DVec3; 4], v: DVec3, w: f64| m[0] * v.x + m[1] * v.y + m[2] * v.z + m[3] * w;
    let (abs_to_world, abs_to_object) = (to_world.map(DVec3::abs), to_object.map(DVec3::abs));
    let mut bounds: Option<(DVec3, DVec3)> = None;
    for slot in (0..8).filter(|&slot| child(root, slot) != super::Child::Empty) {
        let planes = child_box(root, slot);
        let planes = [DVec3::from(planes.0), DVec3::from(planes.1)];
        for corner in 0..8 {
            let [x, y, z] = [0, 1, 2].map(|axis| planes[corner >> axis & 1][axis]);
            let p = apply(&to_world, DVec3::new(x, y, z), 1.0);
            // Error of the ray in object space, seen from the world.
            let error = apply(&abs_to_object, p.abs(), 1.0) * TRANSFORM_ROUNDING;
            let error = apply(&abs_to_world, error, 0.0);
            let (low, high) = bounds.unwrap_or((p, p));
            bounds = Some((low.min(p - error), high.max(p + error)));
        }
    }
    // An empty group is a point: it costs a visit and hits nothing.
    let (low, high) = bounds.unwrap_or((to_world[3], to_world[3]));
    let limit = f64::from(MAX_COORDINATE);
    // NaN fails the comparison as well.
    if !(low.min_element() >= -limit && high.max_element() <= limit) {
        return Err(out_of_range(&format!("instance {index}")));
    }
    // Twice the rounding of the conversion, outwards.
    let slack = |v: DVec3| v.abs() * f64::from(f32::EPSILON) + f64::from(f32::MIN_POSITIVE);
    let (low, high) = ((low - slack(low)).as_vec3(), (high + slack(high)).as_vec3());
    Ok(Aabb::new(low.into(), high.into()))
}

fn out_of_range(what: &str) -> Error {
    Error::Scene {
        path: PathBuf::from("(geometry)"),
        what: format!(
            "{what} has a coordinate that is not a number or beyond {MAX_COORDINATE:e} m; rescale the scene"
        ),
    }
}
