//! The node tree → world transforms, in double precision. The walk is iterative,
//! so that a chain of a million nodes does not exhaust the stack; cycles and
//! nodes with two parents are refused before it starts.

use glam::{DAffine3, DMat3, DQuat, DVec3};

use super::json::{Node, Root};
use super::{Check, Limits, Warnings, get};
use crate::scene;

/// Coordinates beyond this are refused: their squares would overflow single precision.
pub(super) const FARTHEST: f64 = 1e18;

/// The nodes that belong to the scene.
pub(super) struct Nodes<'a> {
    root: &'a Root,
    world: Vec<Option<DAffine3>>,
}

/// A node that belongs to the scene.
pub(super) struct Placed<'a> {
    /// Its index in the file.
    pub index: usize,
    /// The node.
    pub node: &'a Node,
    /// Its transform to world space.
    pub world: DAffine3,
}

impl Placed<'_> {
    /// Name in the file, or `node N`.
    pub fn name(&self) -> String {
        match &self.node.name {
            Some(name) if !name.is_empty() => name.clone(),
            _ => format!("node {}", self.index),
        }
    }
}

impl<'a> Nodes<'a> {
    /// The scene's nodes, in the order of the file.
    pub fn iter(&self) -> impl Iterator<Item = Placed<'a>> {
        let nodes = self.root.nodes.iter().zip(&self.world).enumerate();
        nodes.filter_map(|(index, (node, world))| {
            Some(Placed {
                index,
                node,
                world: (*world)?,
            })
        })
    }
}

/// Names and places in the tree, with what each node owns.
pub(super) fn owners(root: &Root, instances: &[u32], lights: &[u32]) -> Vec<scene::Node> {
    let named = |(i, node): (usize, &Node)| scene::Node {
        name: match &node.name {
            Some(name) if !name.is_empty() => name.clone(),
            _ => format!("node {i}"),
        },
        ..Default::default()
    };
    let mut nodes: Vec<scene::Node> = root.nodes.iter().enumerate().map(named).collect();
    for (i, node) in root.nodes.iter().enumerate() {
        for &child in &node.children {
            nodes[child as usize].parent = Some(i as u32);
        }
    }
    for (instance, owner) in (0..).zip(instances) {
        nodes[*owner as usize].instances.push(instance);
    }
    for (light, owner) in (0..).zip(lights) {
        nodes[*owner as usize].lights.push(light);
    }
    nodes
}

/// Computes where every node of the scene is.
pub(super) fn walk<'a>(
    root: &'a Root,
    limits: &Limits,
    warnings: &mut Warnings,
) -> Check<Nodes<'a>> {
    let count = root.nodes.len();
    if count as u64 > limits.nodes {
        return Err(format!(
            "{count} nodes are more than the cap of {} (Limits::nodes)",
            limits.nodes
        ));
    }
    let has_parent = check_tree(root)?;
    let mut world: Vec<Option<DAffine3>> = vec![None; count];
    let mut stack: Vec<(u32, DAffine3)> = Vec::new();
    for index in scene_roots(root, &has_parent, warnings)? {
        stack.push((index, DAffine3::IDENTITY));
    }
    while let Some((index, parent)) = stack.pop() {
        let node = &root.nodes[index as usize];
        let placed = parent * local_transform(node, index)?;
        let is_finite = placed.is_finite() && placed.translation.abs().max_element() <= FARTHEST;
        if !is_finite {
            return Err(format!(
                "nodes[{index}]: its place in the world is not finite or beyond {FARTHEST:e} m"
            ));
        }
        let slot = &mut world[index as usize];
        if slot.replace(placed).is_some() {
            return Err(format!("nodes[{index}] is listed twice in the scene"));
        }
        stack.extend(node.children.iter().map(|&child| (child, placed)));
    }
    Ok(Nodes { root, world })
}

/// Checks that the nodes are a forest, and says which of them have a parent.
fn check_tree(root: &Root) -> Check<Vec<bool>> {
    let mut parents: Vec<Option<u32>> = vec![None; root.nodes.len()];
    for (i, node) in root.nodes.iter().enumerate() {
        for &child in &node.children {
            get(&root.nodes, child, "nodes", &format!("nodes[{i}].children"))?;
            if let Some(other) = parents[child as usize].replace(i as u32) {
                return Err(format!(
                    "nodes[{child}] has two parents, nodes[{other}] and nodes[{i}]"
                ));
            }
        }
    }
    // With one parent at most, whatever the roots do not reach hangs on a cycle.
    let mut is_reached = vec![false; root.nodes.len()];
    let roots = (0..).zip(&parents).filter(|(_, parent)| parent.is_none());
    let mut stack: Vec<u32> = roots.map(|(i, _)| i).collect();
    while let Some(i) = stack.pop() {
        is_reached[i as usize] = true;
        stack.extend(&root.nodes[i as usize].children);
    }
    if let Some(i) = is_reached.iter().position(|reached| !reached) {
        return Err(format!("nodes[{i}] is part of a cycle or hangs below one"));
    }
    Ok(parents.iter().map(Option::is_some).collect())
}

/// The scene's root nodes: of the default scene, else the first one, else all roots.
fn scene_roots(root: &Root, has_parent: &[bool], warnings: &mut Warnings) -> Check<Vec<u32>> {
    let Some(index) = scene_index(root)? else {
        warnings.push(String::from(
            "the file has no scene; all root nodes are used",
        ));
        let roots = (0..has_parent.len()).filter(|&i| !has_parent[i]);
        return Ok(roots.map(|i| i as u32).collect());
    };
    let user = format!("scenes[{index}].nodes");
    let roots = &root.scenes[index].nodes;
    for &i in roots {
        get(&root.nodes, i, "nodes", &user)?;
        if has_parent[i as usize] {
            return Err(format!("{user}: nodes[{i}] is no root, it has a parent"));
        }
    }
    if root.scenes.len() > 1 {
        warnings.push(format!(
            "only scenes[{index}] of {} is used",
            root.scenes.len()
        ));
    }
    Ok(roots.clone())
}

/// Which scene is used; `None` when the file has none.
pub(super) fn scene_index(root: &Root) -> Check<Option<usize>> {
    match root.scene {
        Some(index) => {
            get(&root.scenes, index, "scenes", "scene")?;
            Ok(Some(index as usize))
        }
        None => Ok((!root.scenes.is_empty()).then_some(0)),
    }
}

fn local_transform(node: &Node, index: u32) -> Check<DAffine3> {
    let has_parts = node.translation.is_some() || node.rotation.is_some() || node.scale.is_some();
    if let Some(matrix) = &node.matrix {
        if has_parts {
            return Err(format!(
                "nodes[{index}] has both a matrix and translation, rotation or scale"
            ));
        }
        return affine(matrix).ok_or_else(|| {
            format!("nodes[{index}]: the last row of its matrix is not 0, 0, 0, 1")
        });
    }
    let rotation = match node.rotation {
        None => DQuat::IDENTITY,
        Some(rotation) => unit_quaternion(rotation)
            .ok_or_else(|| format!("nodes[{index}]: its rotation is no unit quaternion"))?,
    };
    Ok(DAffine3::from_scale_rotation_translation(
        node.scale.map_or(DVec3::ONE, DVec3::from),
        rotation,
        node.translation.map_or(DVec3::ZERO, DVec3::from),
    ))
}

/// A rotation from its four numbers, or `None` where they are far from unit length.
pub(super) fn unit_quaternion(xyzw: [f64; 4]) -> Option<DQuat> {
    // Files hold single precision or less; quantised instancing holds 8 bits.
    const TOLERANCE: f64 = 0.05;
    let q = DQuat::from_array(xyzw);
    ((q.length() - 1.0).abs() < TOLERANCE).then(|| q.normalize())
}

/// A column-major 4 × 4 matrix without perspective.
fn affine(m: &[f64; 16]) -> Option<DAffine3> {
    // Exporters that invert in single precision leave such residues.
    const TOLERANCE: f64 = 1e-6;
    let off = m[3].abs() + m[7].abs() + m[11].abs() + (m[15] - 1.0).abs();
    let column = |at: usize| DVec3::new(m[at], m[at + 1], m[at + 2]);
    (off <= TOLERANCE).then(|| DAffine3 {
        matrix3: DMat3::from_cols(column(0), column(4), column(8)),
        translation: column(12),
    })
}

/// Whether a transform flattens space so far that it has no usable inverse.
pub(super) fn is_singular(transform: &DAffine3) -> bool {
    // Relative to the cube of the largest axis; a scale of 1 : 1 : 1e-12 is a
    // plane for single precision.
    const TINY: f64 = 1e-12;
    let m = transform.matrix3;
    let largest = m
        .x_axis
        .length()
        .max(m.y_axis.length())
        .max(m.z_axis.length());
    let volume = m.determinant().abs();
    // 0 ≤ 0 covers the zero matrix.
    volume <= TINY * largest.powi(3)
}
