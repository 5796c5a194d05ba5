//! Trees that were built before, kept in a folder: one file for each list of triangles.

use std::path::Path;

use crate::bvh::{Bvh, GroupDesc, GroupRange, InstanceDesc, Node, Quality, Record};
use crate::error::Result;
use crate::store::{Entry, Key};

/// What a file begins with: the number of nodes, records and groups, and the root.
type Head = [u64; 4];
/// A group, in the order of the fields of [`GroupRange`].
type Group = [u32; 4];

/// The tree that [`Bvh::build`] gives, from the folder where it is there, and else left there.
pub(super) fn tree(
    folder: Option<&Path>,
    groups: &[GroupDesc],
    instances: &[InstanceDesc],
    quality: Quality,
) -> Result<Bvh> {
    let Some(folder) = folder else {
        return Bvh::build(groups, instances, quality);
    };
    let entry = Entry::new(folder, key(groups, instances, quality));
    let kept = entry.read();
    if let Some(bvh) = kept.and_then(|bytes| parse(&bytes, instances)) {
        return Ok(bvh);
    }
    let bvh = Bvh::build(groups, instances, quality)?;
    write(&entry, &bvh);
    Ok(bvh)
}

/// Names a tree by all that decides it.
fn key(groups: &[GroupDesc], instances: &[InstanceDesc], quality: Quality) -> Key {
    let mut key = Key::new("tree");
    key.add(format!("{quality:?}").as_bytes());
    for group in groups {
        key.add(bytemuck::cast_slice(group.positions));
        let masked: Vec<u8> = group.masked.iter().map(|&is| u8::from(is)).collect();
        key.add(&masked);
    }
    for instance in instances {
        key.add(&instance.group.to_le_bytes());
        key.add(bytemuck::bytes_of(&instance.world_from_object));
        key.add(bytemuck::bytes_of(&instance.object_from_world));
    }
    key
}

fn write(entry: &Entry, bvh: &Bvh) {
    let counts = [bvh.nodes.len(), bvh.triangles.len(), bvh.groups.len()];
    let [nodes, records, groups] = counts.map(|count| count as u64);
    let head: Head = [nodes, records, groups, u64::from(bvh.root)];
    let groups: Vec<Group> = bvh
        .groups
        .iter()
        .map(|g| [g.root, g.first_record, g.record_count, g.triangle_count])
        .collect();
    entry.write(&[
        bytemuck::bytes_of(&head),
        bytemuck::cast_slice(&groups),
        bytemuck::cast_slice(&bvh.nodes),
        bytemuck::cast_slice(&bvh.triangles),
    ]);
}

/// `None` for what is not a tree.
fn parse(bytes: &[u8], instances: &[InstanceDesc]) -> Option<Bvh> {
    let (head, rest) = bytes.split_at_checked(size_of::<Head>())?;
    let [nodes, records, groups, root] = bytemuck::pod_read_unaligned::<Head>(head);
    // What was whole was written by this build.
    let (groups, rest) = rest.split_at_checked(groups as usize * size_of::<Group>())?;
    let (nodes, records_bytes) = rest.split_at_checked(nodes as usize * size_of::<Node>())?;
    if records_bytes.len() != records as usize * size_of::<Record>() {
        return None;
    }
    let groups: Vec<Group> = bytemuck::pod_collect_to_vec(groups);
    Some(Bvh {
        nodes: bytemuck::pod_collect_to_vec(nodes),
        triangles: bytemuck::pod_collect_to_vec(records_bytes),
        groups: groups
            .into_iter()
            .map(
                |[root, first_record, record_count, triangle_count]| GroupRange {
                    root,
                    first_record,
                    record_count,
                    triangle_count,
                },
            )
            .collect(),
        instances: instances.to_vec(),
        root: root as u32,
    })
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    fn corners(count: usize) -> Vec<Vec3> {
        let point = |i: usize| Vec3::new(i as f32, (i * i % 17) as f32, (i % 5) as f32);
        (0..3 * count).map(point).collect()
    }

    fn build(folder: Option<&Path>, positions: &[Vec3], masked: &[bool]) -> Bvh {
        let groups = [GroupDesc { positions, masked }];
        let instances = [InstanceDesc::identity(0), InstanceDesc::identity(0)];
        tree(folder, &groups, &instances, Quality::Balanced).unwrap()
    }

    #[test]
    fn a_kept_tree_is_the_tree() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        let positions = corners(100);
        let plain = build(None, &positions, &[]);
        assert_eq!(build(Some(folder), &positions, &[]), plain);
        // The second one is read: what is in the file is what comes.
        let files = || std::fs::read_dir(folder).unwrap().count();
        assert_eq!(files(), 1);
        let groups = [GroupDesc {
            positions: &positions,
            masked: &[],
        }];
        let entry = Entry::new(folder, key(&groups, &plain.instances, Quality::Balanced));
        let bytes = entry.read().unwrap();
        assert_eq!(parse(&bytes, &plain.instances), Some(plain.clone()));
        assert_eq!(parse(&bytes[1..], &plain.instances), None);
        assert_eq!(build(Some(folder), &positions, &[]), plain);
        // Other content has another file.
        build(Some(folder), &positions, &[true; 100]);
        build(Some(folder), &corners(99), &[]);
        assert_eq!(files(), 3);
    }
}
