//! What the targets share: files for readers that take paths, and what an accepted scene must keep to.

#[path = "../../tests/loader/builder.rs"]
#[allow(dead_code, reason = "tests/loader uses the rest")]
mod builder;
#[path = "../../tests/common/seeds.rs"]
pub mod seeds;

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use etendue::scene::gltf::{Limits, load_with};

/// A file of this process with these bytes; the next call writes over it. `TMPDIR` had better be in memory.
pub fn file(name: &str, bytes: &[u8]) -> PathBuf {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| tempfile::tempdir().expect("a folder").keep());
    let path = folder.join(name);
    std::fs::write(&path, bytes).expect("a file");
    path
}

/// Loads a scene, with limits that keep accepted claims cheap, and checks what others rely on.
pub fn load(path: &Path) {
    let limits = Limits {
        texels: 1 << 22,
        ..Limits::default()
    };
    let Ok(scene) = load_with(path, &limits) else {
        return;
    };
    for mesh in &scene.meshes {
        let vertices = mesh.positions.len();
        assert!(
            mesh.triangles
                .iter()
                .flatten()
                .all(|&v| (v as usize) < vertices)
        );
        assert!(mesh.positions.iter().all(|p| p.is_finite()));
        assert!((mesh.material as usize) < scene.materials.len());
        for list in [mesh.normals.len(), mesh.uvs[0].len(), mesh.uvs[1].len()] {
            assert!(list == 0 || list == vertices);
        }
    }
    for instance in &scene.instances {
        assert!((instance.mesh as usize) < scene.meshes.len());
        assert!(instance.world_from_object.is_finite());
    }
}
