//! The tree checks itself.

use super::{
    Bvh, Child, MAX_GROUP_LEVELS, MAX_TOP_LEVELS, Node, RECORD_MASKED, Record, child, child_box,
    vertex,
};

/// Bounds in double precision: low, high.
type Bounds = ([f64; 3], [f64; 3]);

/// One tree of the structure while it is walked.
struct Tree<'a> {
    bvh: &'a Bvh,
    /// Its part of [`Bvh::triangles`].
    records: std::ops::Range<usize>,
    /// Levels allowed.
    max_levels: u32,
    /// Bounds of a record; `None` where they are not known (instances).
    bounds: fn(&Record) -> Option<Bounds>,
}

impl Bvh {
    /// Checks what traversal relies on: every index is in range, every node is reached once, every record is in one
    /// leaf, ids are a permutation, every child box contains what is below it, and no tree is too deep for the stack.
    ///
    /// # Errors
    /// What is wrong first, and where.
    pub fn validate(&self) -> Result<(), String> {
        let mut visited = vec![false; self.nodes.len()];
        for (index, group) in self.groups.iter().enumerate() {
            let first = group.first_triangle as usize;
            let tree = Tree {
                bvh: self,
                records: first..first + group.triangle_count as usize,
                max_levels: MAX_GROUP_LEVELS,
                bounds: |record| Some(triangle_bounds(record)),
            };
            tree.check(group.root, &mut visited)
                .map_err(|what| format!("group {index}: {what}"))?;
            for record in &self.triangles[tree.records.clone()] {
                if record[7].to_bits() & !RECORD_MASKED != 0 {
                    return Err(format!("group {index}: unknown flags"));
                }
            }
        }
        if !self.instances.is_empty() {
            let first = self.groups.iter().map(|g| g.triangle_count as usize).sum();
            let tree = Tree {
                bvh: self,
                records: first..first + self.instances.len(),
                max_levels: MAX_TOP_LEVELS,
                bounds: |_| None,
            };
            tree.check(self.root, &mut visited)
                .map_err(|what| format!("top level: {what}"))?;
        } else if self.groups.is_empty() {
            // The one node that an empty structure keeps.
            visited[0] = true;
        }
        match visited.iter().position(|&visited| !visited) {
            Some(node) => Err(format!("node {node} is never reached")),
            None => Ok(()),
        }
    }
}

impl Tree<'_> {
    fn check(&self, root: u32, visited: &mut [bool]) -> Result<(), String> {
        let mut referenced = vec![false; self.records.len()];
        self.check_node(root, 1, visited, &mut referenced)?;
        if let Some(lost) = referenced.iter().position(|&referenced| !referenced) {
            return Err(format!("record {lost} is in no leaf"));
        }
        let mut named = vec![false; self.records.len()];
        for record in &self.bvh.triangles[self.records.clone()] {
            let id = record[3].to_bits();
            match named.get_mut(id as usize) {
                Some(named) if !*named => *named = true,
                _ => return Err(format!("id {id} is out of range or occurs twice")),
            }
        }
        Ok(())
    }

    /// Checks what is below a node and returns its exact bounds.
    fn check_node(
        &self,
        index: u32,
        level: u32,
        visited: &mut [bool],
        referenced: &mut [bool],
    ) -> Result<Option<Bounds>, String> {
        if level > self.max_levels {
            return Err(format!("more than {} levels", self.max_levels));
        }
        match visited.get_mut(index as usize) {
            Some(visited) if !*visited => *visited = true,
            _ => return Err(format!("node {index} is out of range or reached twice")),
        }
        let node: &Node = &self.bvh.nodes[index as usize];
        let mut all: Option<Bounds> = None;
        for slot in 0..8 {
            let below = match child(node, slot) {
                Child::Empty => None,
                Child::Node(next) => self.check_node(next, level + 1, visited, referenced)?,
                Child::Leaf(first, count) => self.check_leaf(first, count, referenced)?,
            };
            let Some(below) = below else { continue };
            let outer = child_box(node, slot);
            for axis in 0..3 {
                if outer.0[axis] > below.0[axis] || outer.1[axis] < below.1[axis] {
                    return Err(format!(
                        "node {index}: slot {slot} does not contain {below:?}"
                    ));
                }
            }
            all = Some(union(all, below));
        }
        Ok(all)
    }

    fn check_leaf(
        &self,
        first: u32,
        count: u32,
        referenced: &mut [bool],
    ) -> Result<Option<Bounds>, String> {
        let mut all = None;
        for index in first as usize..(first + count) as usize {
            if !self.records.contains(&index) {
                return Err(format!("record {index} belongs to another tree"));
            }
            let referenced = &mut referenced[index - self.records.start];
            if std::mem::replace(referenced, true) {
                return Err(format!("record {index} is in two leaves"));
            }
            if let Some(bounds) = (self.bounds)(&self.bvh.triangles[index]) {
                all = Some(union(all, bounds));
            }
        }
        Ok(all)
    }
}

fn triangle_bounds(record: &Record) -> Bounds {
    let [a, b, c] = [0, 1, 2].map(|corner| vertex(record, corner).as_dvec3());
    (a.min(b).min(c).to_array(), a.max(b).max(c).to_array())
}

fn union(all: Option<Bounds>, one: Bounds) -> Bounds {
    let (low, high) = all.unwrap_or(one);
    (
        [0, 1, 2].map(|axis| low[axis].min(one.0[axis])),
        [0, 1, 2].map(|axis| high[axis].max(one.1[axis])),
    )
}
