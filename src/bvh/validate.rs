//! The tree checks itself.

use super::{
    Bvh, Child, FIRST_MASKED, FIRST_TURN, FLAT, MAX_GROUP_LEVELS, MAX_TOP_LEVELS, Node, Record,
    SECOND_MASKED, SECOND_TURN, child, child_box, members, vertex,
};

/// What the flags of a record may be.
const KNOWN_FLAGS: u32 = FIRST_MASKED | SECOND_MASKED | 3 << FIRST_TURN | 3 << SECOND_TURN | FLAT;

/// Bounds in double precision: low, high.
type Bounds = ([f64; 3], [f64; 3]);

/// One tree of the structure while it is walked.
struct Tree<'a> {
    bvh: &'a Bvh,
    /// Its part of [`Bvh::triangles`].
    records: std::ops::Range<usize>,
    /// Number of the things that the records stand for.
    ids: usize,
    /// Which of them a record stands for.
    named: fn(&Record) -> Vec<u32>,
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
            let first = group.first_record as usize;
            let tree = Tree {
                bvh: self,
                records: first..first + group.record_count as usize,
                ids: group.triangle_count as usize,
                named: |record| members(record).map(|member| member.id).collect(),
                max_levels: MAX_GROUP_LEVELS,
                bounds: |record| Some(record_bounds(record)),
            };
            tree.check(group.root, &mut visited)
                .map_err(|what| format!("group {index}: {what}"))?;
            for record in &self.triangles[tree.records.clone()] {
                if record[11].to_bits() & !KNOWN_FLAGS != 0 {
                    return Err(format!("group {index}: unknown flags"));
                }
            }
        }
        if !self.instances.is_empty() {
            let first = self.groups.iter().map(|g| g.record_count as usize).sum();
            let tree = Tree {
                bvh: self,
                records: first..first + self.instances.len(),
                ids: self.instances.len(),
                named: |record| vec![record[3].to_bits()],
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
        let mut named = vec![false; self.ids];
        for record in &self.bvh.triangles[self.records.clone()] {
            for id in (self.named)(record) {
                match named.get_mut(id as usize) {
                    Some(named) if !*named => *named = true,
                    _ => return Err(format!("id {id} is out of range or occurs twice")),
                }
            }
        }
        match named.iter().position(|&named| !named) {
            Some(id) => Err(format!("id {id} is in no record")),
            None => Ok(()),
        }
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

fn record_bounds(record: &Record) -> Bounds {
    let [a, b, c, d] = [0, 1, 2, 3].map(|corner| vertex(record, corner).as_dvec3());
    let (low, high) = (a.min(b).min(c).min(d), a.max(b).max(c).max(d));
    (low.to_array(), high.to_array())
}

fn union(all: Option<Bounds>, one: Bounds) -> Bounds {
    let (low, high) = all.unwrap_or(one);
    (
        [0, 1, 2].map(|axis| low[axis].min(one.0[axis])),
        [0, 1, 2].map(|axis| high[axis].max(one.1[axis])),
    )
}
