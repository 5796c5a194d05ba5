//! Primitive modes → triangles, and the removal of vertices that none uses.

use crate::scene::gltf::Check;

/// How corners make triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Topology {
    List,
    Strip,
    Fan,
}

impl Topology {
    /// The topology of a primitive's mode; `None` for points and lines.
    pub fn from_mode(mode: Option<u32>, user: &str) -> Check<Option<Self>> {
        match mode {
            None | Some(4) => Ok(Some(Self::List)),
            Some(5) => Ok(Some(Self::Strip)),
            Some(6) => Ok(Some(Self::Fan)),
            Some(0..=3) => Ok(None),
            Some(mode) => Err(format!("{user}: mode {mode} is not known, only 0 … 6")),
        }
    }

    /// How many triangles that many corners make.
    pub fn triangle_count(self, corners: u64) -> u64 {
        match self {
            Self::List => corners / 3,
            Self::Strip | Self::Fan => corners.saturating_sub(2),
        }
    }

    /// Positions of triangle `t`'s corners in the list of indices, as section 3.7.2.1
    /// of the specification orders them.
    pub fn corners(self, t: u64) -> [u64; 3] {
        match self {
            Self::List => [3 * t, 3 * t + 1, 3 * t + 2],
            Self::Strip => [t, t + 1 + t % 2, t + 2 - t % 2],
            Self::Fan => [t + 1, t + 2, 0],
        }
    }
}

/// Renumbers the vertices so that only used ones remain, their order kept. Gives
/// the old index of each new vertex. `vertex_count` is what the file claims:
/// nothing is allocated for it unless it is in proportion to the triangles.
pub(super) fn compact(triangles: &mut [[u32; 3]], vertex_count: u64) -> Vec<u32> {
    /// A table over all vertices is quicker than sorting up to this ratio.
    const DENSE: u64 = 16;
    let corners = triangles.len() as u64 * 3;
    if vertex_count > corners * DENSE {
        let mut used: Vec<u32> = triangles.iter().flatten().copied().collect();
        used.sort_unstable();
        used.dedup();
        for corner in triangles.iter_mut().flatten() {
            *corner = used
                .binary_search(corner)
                .expect("every corner was collected") as u32;
        }
        return used;
    }
    let mut renumbered = vec![u32::MAX; vertex_count as usize];
    for &corner in triangles.iter().flatten() {
        renumbered[corner as usize] = 0;
    }
    let mut used = Vec::new();
    for (old, new) in renumbered.iter_mut().enumerate() {
        if *new == 0 {
            *new = used.len() as u32;
            used.push(old as u32);
        }
    }
    for corner in triangles.iter_mut().flatten() {
        *corner = renumbered[*corner as usize];
    }
    used
}

#[cfg(test)]
mod tests {
    use super::compact;

    #[test]
    fn compact_agrees_on_dense_and_sparse_vertices() {
        let original = [[7, 3, 9], [3, 9, 12]];
        for vertex_count in [13, 4_000_000_000] {
            let mut triangles = original;
            assert_eq!(compact(&mut triangles, vertex_count), [3, 7, 9, 12]);
            assert_eq!(triangles, [[1, 0, 2], [0, 2, 3]]);
        }
    }
}
