//! The flat pieces that a small scene is made of: whoever tests all of them needs no walk.

use glam::DVec3;

use super::{Bvh, Record, members, vertex};
use super::{FLAT, NO_TRIANGLE};

/// Largest deviation of a fourth corner from a parallelogram, of its longest edge.
const TOLERANCE: f64 = 1e-6;

/// A triangle or a parallelogram in one plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// Its corners; of a triangle the last one is the first again.
    pub corners: [DVec3; 4],
    /// Record that names the plane.
    pub record: u32,
    /// Triangles of the group that lie in it, one of them twice where there is no other.
    pub triangles: [u32; 2],
    /// Whether it is a parallelogram.
    pub is_parallelogram: bool,
}

impl Bvh {
    /// The patches of a tree of one level, parallelograms first; `None` where there would be more than `limit`, or
    /// where a record is not flat or may be cut out.
    pub fn patches(&self, limit: usize) -> Option<Vec<Patch>> {
        if !self.instances.is_empty() || self.groups.len() != 1 {
            return None;
        }
        let group = &self.groups[0];
        if group.record_count as usize > limit {
            return None;
        }
        let records = group.first_record..group.first_record + group.record_count;
        let mut patches = Vec::with_capacity(limit);
        for index in records {
            let record = &self.triangles[index as usize];
            let is_plain =
                record[11].to_bits() & FLAT != 0 && members(record).all(|m| !m.is_masked);
            if !is_plain {
                return None;
            }
            patches.extend(patches_of(record, index));
        }
        patches.sort_by_key(|patch| !patch.is_parallelogram);
        (patches.len() <= limit).then_some(patches)
    }
}

fn patches_of(record: &Record, index: u32) -> Vec<Patch> {
    let [a, b, c, d] = [0, 1, 2, 3].map(|corner| vertex(record, corner).as_dvec3());
    let [first, second] = [3, 7].map(|word| record[word].to_bits());
    let is_single = second == NO_TRIANGLE;
    let patch = |corners, is_parallelogram| Patch {
        corners,
        record: index,
        triangles: [first, if is_single { first } else { second }],
        is_parallelogram,
    };
    let size = (b - a).length().max((c - b).length());
    if is_single {
        vec![patch([a, b, c, a], false)]
    } else if (a + c - b - d).length() <= TOLERANCE * size {
        vec![patch([a, b, c, d], true)]
    } else {
        vec![patch([a, b, c, a], false), patch([a, c, d, a], false)]
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::super::tests::single;

    fn points(of: &[[f32; 3]]) -> Vec<Vec3> {
        of.iter().copied().map(Vec3::from).collect()
    }

    #[test]
    fn scenes_of_few_flat_pieces_have_patches() {
        let square = points(&[
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [0.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [0.0, 1.0, 0.0],
        ]);
        let patches = single(&square).patches(8).unwrap();
        assert_eq!(patches.len(), 1);
        assert!(patches[0].is_parallelogram);
        let mut triangles = patches[0].triangles;
        triangles.sort_unstable();
        assert_eq!(triangles, [0, 1]);

        // A kite, and a triangle far away: three triangles behind no parallelogram.
        let mut kite = square.clone();
        kite[2].x = 3.0;
        kite[4].x = 3.0;
        kite.extend(points(&[[9.0, 0.0, 0.0], [9.0, 1.0, 0.0], [9.0, 0.0, 1.0]]));
        let patches = single(&kite).patches(8).unwrap();
        assert_eq!(patches.len(), 3);
        assert!(patches.iter().all(|patch| !patch.is_parallelogram));
        let alone = patches
            .iter()
            .find(|patch| patch.corners[0].x == 9.0)
            .unwrap();
        assert_eq!(alone.triangles, [2, 2]);
        assert!(single(&kite).patches(2).is_none());

        // A fold has no plane.
        let mut fold = square;
        fold[5].z = 1.0;
        assert!(single(&fold).patches(8).is_none());
    }
}
