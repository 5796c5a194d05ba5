//! Trees that were built before, kept in a folder: one file for each list of triangles and build of this program.
//! A file that is missing, damaged or of other content costs time only: the tree is then built.

use std::fs;
use std::io::{self, Write};
use std::path::Path;

use sha2::{Digest, Sha256};

use crate::bvh::{Bvh, GroupDesc, GroupRange, InstanceDesc, Node, Quality, Record};
use crate::error::Result;
use crate::image_io::write_with;

/// Bytes of the digest of all that follows it.
const DIGEST: usize = 32;
/// Then the number of nodes, records and groups, and the root.
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
    let path = folder.join(format!("{}.tree", key(groups, instances, quality)));
    if let Some(bvh) = read(&path, instances) {
        tracing::info!(path = %path.display(), "the tree is from the cache");
        return Ok(bvh);
    }
    let bvh = Bvh::build(groups, instances, quality)?;
    let kept = fs::create_dir_all(folder)
        .map_err(|error| error.to_string())
        .and_then(|()| {
            write_with(&path, &mut |file| write(&bvh, file)).map_err(|error| error.to_string())
        });
    if let Err(error) = kept {
        tracing::warn!("the tree is not kept for later renders: {error}");
    }
    Ok(bvh)
}

/// Names a tree by all that decides it.
fn key(groups: &[GroupDesc], instances: &[InstanceDesc], quality: Quality) -> String {
    let mut hash = Sha256::new();
    hash.update(format!(
        "{} {quality:?} {}",
        env!("ETENDUE_BUILD"),
        groups.len()
    ));
    for group in groups {
        hash.update((group.positions.len() as u64).to_le_bytes());
        hash.update(bytemuck::cast_slice::<_, u8>(group.positions));
        let masked: Vec<u8> = group.masked.iter().map(|&is| u8::from(is)).collect();
        hash.update((masked.len() as u64).to_le_bytes());
        hash.update(masked);
    }
    for instance in instances {
        hash.update(instance.group.to_le_bytes());
        hash.update(bytemuck::bytes_of(&instance.world_from_object));
        hash.update(bytemuck::bytes_of(&instance.object_from_world));
    }
    let digest = hash.finalize();
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn write(bvh: &Bvh, file: &mut dyn Write) -> io::Result<()> {
    let counts = [bvh.nodes.len(), bvh.triangles.len(), bvh.groups.len()];
    let [nodes, records, groups] = counts.map(|count| count as u64);
    let head: Head = [nodes, records, groups, u64::from(bvh.root)];
    let groups: Vec<Group> = bvh
        .groups
        .iter()
        .map(|g| [g.root, g.first_record, g.record_count, g.triangle_count])
        .collect();
    let parts: [&[u8]; 4] = [
        bytemuck::bytes_of(&head),
        bytemuck::cast_slice(&groups),
        bytemuck::cast_slice(&bvh.nodes),
        bytemuck::cast_slice(&bvh.triangles),
    ];
    let mut hash = Sha256::new();
    parts.iter().for_each(|part| hash.update(part));
    file.write_all(&hash.finalize())?;
    parts.iter().try_for_each(|part| file.write_all(part))
}

/// `None` for a file that is not there or not what was written.
fn read(path: &Path, instances: &[InstanceDesc]) -> Option<Bvh> {
    let bytes = fs::read(path).ok()?;
    let (digest, rest) = bytes.split_at_checked(DIGEST)?;
    if digest != Sha256::digest(rest).as_slice() {
        return None;
    }
    let (head, rest) = rest.split_at_checked(size_of::<Head>())?;
    let [nodes, records, groups, root] = bytemuck::pod_read_unaligned::<Head>(head);
    // What has the right digest was written by this build.
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

    fn files(folder: &Path) -> Vec<std::path::PathBuf> {
        let entries = fs::read_dir(folder).unwrap();
        entries.map(|entry| entry.unwrap().path()).collect()
    }

    #[test]
    fn a_kept_tree_is_the_tree() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path().join("made");
        let positions = corners(100);
        let plain = build(None, &positions, &[]);
        assert_eq!(build(Some(&folder), &positions, &[]), plain);
        // The second one is read: what is in the file is what comes.
        let [path] = &files(&folder)[..] else {
            panic!("one file")
        };
        assert_eq!(read(path, &plain.instances), Some(plain.clone()));
        assert_eq!(build(Some(&folder), &positions, &[]), plain);
        // Other content has another file.
        build(Some(&folder), &positions, &[true; 100]);
        build(Some(&folder), &corners(99), &[]);
        assert_eq!(files(&folder).len(), 3);
    }

    #[test]
    fn a_damaged_file_is_written_anew() {
        let folder = tempfile::tempdir().unwrap();
        let positions = corners(50);
        let plain = build(Some(folder.path()), &positions, &[]);
        let path = files(folder.path()).remove(0);
        let good = fs::read(&path).unwrap();
        let mut flipped = good.clone();
        flipped[good.len() / 2] ^= 1;
        for bad in [
            flipped,
            good[..good.len() - 1].to_vec(),
            good[..10].to_vec(),
            Vec::new(),
        ] {
            fs::write(&path, bad).unwrap();
            assert_eq!(read(&path, &plain.instances), None);
            assert_eq!(build(Some(folder.path()), &positions, &[]), plain);
            assert_eq!(fs::read(&path).unwrap(), good);
        }
    }

    #[test]
    fn a_folder_that_cannot_be_written_costs_the_cache_only() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let positions = corners(10);
        let plain = build(None, &positions, &[]);
        assert_eq!(build(Some(file.path()), &positions, &[]), plain);
    }
}
