//! What earlier runs of this build have computed, kept in a folder: one file for each content that it came from. A file
//! that is missing, damaged or cannot be written costs time only.

use std::fs;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use crate::image_io::write_with;

/// Bytes of the digest that ends each file.
const DIGEST: usize = 32;

/// Names what is kept, by all that decides it.
pub(crate) struct Key {
    kind: &'static str,
    digest: Sha256,
}

impl Key {
    /// Something of this kind, made by this build.
    pub fn new(kind: &'static str) -> Self {
        let digest = Sha256::new().chain_update(env!("ETENDUE_BUILD"));
        Self { kind, digest }
    }

    /// Adds a part that decides.
    pub fn add(&mut self, part: &[u8]) {
        // so that parts do not run into each other
        self.digest.update((part.len() as u64).to_le_bytes());
        self.digest.update(part);
    }
}

/// A file of the folder, which may not be there.
pub(crate) struct Entry(PathBuf);

impl Entry {
    /// That of this key.
    pub fn new(folder: &Path, key: Key) -> Self {
        let digest = key.digest.finalize();
        let name: String = digest.iter().map(|byte| format!("{byte:02x}")).collect();
        Self(folder.join(name).with_extension(key.kind))
    }

    /// What was written; `None` where it is not there or not whole.
    pub fn read(&self) -> Option<Vec<u8>> {
        let mut bytes = fs::read(&self.0).ok()?;
        let (content, digest) = bytes.split_at_checked(bytes.len().checked_sub(DIGEST)?)?;
        if digest != Sha256::digest(content).as_slice() {
            return None;
        }
        bytes.truncate(bytes.len() - DIGEST);
        tracing::info!(path = %self.0.display(), "kept from an earlier run");
        Some(bytes)
    }

    /// Keeps these parts, one after the other; a warning says why it can't.
    pub fn write(&self, parts: &[&[u8]]) {
        let mut hash = Sha256::new();
        parts.iter().for_each(|part| hash.update(part));
        let digest = hash.finalize();
        let folder = self.0.parent().unwrap_or(Path::new(""));
        let made = fs::create_dir_all(folder).map_err(|error| error.to_string());
        let kept = made.and_then(|()| {
            write_with(&self.0, &mut |file| {
                parts.iter().try_for_each(|part| file.write_all(part))?;
                file.write_all(&digest)
            })
            .map_err(|error| error.to_string())
        });
        if let Err(error) = kept {
            let path = self.0.display();
            tracing::warn!("{path} is not kept for later renders: {error}");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(parts: &[&[u8]]) -> Key {
        let mut key = Key::new("test");
        parts.iter().for_each(|part| key.add(part));
        key
    }

    #[test]
    fn what_is_kept_comes_back() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path().join("made");
        let entry = || Entry::new(&folder, key(&[b"ab", b"c"]));
        assert_eq!(entry().read(), None);
        entry().write(&[b"con", b"tent"]);
        assert_eq!(entry().read(), Some(b"content".to_vec()));
        // Neither other parts nor the same bytes in other parts are it.
        for other in [key(&[b"ab", b"d"]), key(&[b"a", b"bc"]), key(&[b"abc"])] {
            assert_eq!(Entry::new(&folder, other).read(), None);
        }
    }

    #[test]
    fn damaged_files_are_not_there() {
        let folder = tempfile::tempdir().unwrap();
        let entry = Entry::new(folder.path(), key(&[]));
        entry.write(&[b"some content"]);
        let good = fs::read(&entry.0).unwrap();
        let mut flipped = good.clone();
        flipped[3] ^= 1;
        let cut = |length: usize| good[..length].to_vec();
        for bad in [
            flipped,
            cut(good.len() - 1),
            cut(DIGEST),
            cut(10),
            Vec::new(),
        ] {
            fs::write(&entry.0, bad).unwrap();
            assert_eq!(entry.read(), None);
        }
        entry.write(&[b"some content"]);
        assert_eq!(fs::read(&entry.0).unwrap(), good);
    }

    #[test]
    fn a_folder_that_cannot_be_written_does_no_harm() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let entry = Entry::new(file.path(), key(&[]));
        entry.write(&[b"content"]);
        assert_eq!(entry.read(), None);
    }
}
