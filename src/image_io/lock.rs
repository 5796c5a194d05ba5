//! One process for a file that is going to be written: a file beside it is locked as long as
//! somebody works on it. The system lets go of the lock however a process ends.

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use super::atomic::{folder, is_special, resolve};
use crate::error::{Error, Result};

/// Held as long as nobody else may write the file.
#[derive(Debug)]
pub struct Lock {
    path: PathBuf,
    /// None where the file system has no locks.
    file: Option<File>,
}

impl Lock {
    /// Whether it is of this file, under whatever name.
    #[must_use]
    pub fn is_of(&self, path: &Path) -> bool {
        !is_special(path) && place(path) == self.path
    }
}

/// Keeps other processes from writing a file. Where the file system has no locks, nothing is kept from
/// it, and the log says so. None of devices and pipes, which have no place beside them.
///
/// # Errors
/// [`Error::Busy`] when somebody has it, [`Error::Io`] when the file beside it cannot be made.
pub fn lock(target: &Path) -> Result<Option<Lock>> {
    if is_special(target) {
        return Ok(None);
    }
    let path = place(target);
    loop {
        match open(&path) {
            // its holder removed it before it was locked here: the next one made another
            Ok(file) if !is_same(&file, &path) => {}
            Ok(file) => {
                let file = Some(file);
                return Ok(Some(Lock { path, file }));
            }
            Err(error) if is_held(&error) => {
                let path = target.to_owned();
                return Err(Error::Busy { path });
            }
            Err(error) if error.kind() == io::ErrorKind::Unsupported => {
                tracing::warn!("{} cannot be locked: {error}", target.display());
                return Ok(Some(Lock { path, file: None }));
            }
            Err(source) => {
                let action = "lock";
                return Err(Error::Io {
                    action,
                    path,
                    source,
                });
            }
        }
    }
}

/// Characters of a file's name that the name of its lock has as well; with four bytes each
/// they stay below the 255 bytes that file systems take.
const NAME_CHARACTERS: usize = 50;

/// The file beside the one that all names of it stand for.
fn place(path: &Path) -> PathBuf {
    let target = resolve(path);
    let whole = target.file_name().unwrap_or_default().to_string_lossy();
    let mut name = OsString::from(".");
    name.push(whole.chars().take(NAME_CHARACTERS).collect::<String>());
    if whole.chars().count() > NAME_CHARACTERS {
        // names that begin alike are still other names
        let sum = Sha256::digest(whole.as_bytes());
        let sum: String = sum
            .iter()
            .take(8)
            .map(|byte| format!("{byte:02x}"))
            .collect();
        name.push(format!("-{sum}"));
    }
    name.push(".lock");
    let folder = folder(&target);
    let folder = fs::canonicalize(folder).unwrap_or_else(|_| folder.to_owned());
    folder.join(name)
}

impl Drop for Lock {
    fn drop(&mut self) {
        // First, as long as nobody else can have it. What is left of a process that was
        // killed is in nobody's way.
        let _ = fs::remove_file(&self.path);
        self.file = None;
    }
}

#[cfg(unix)]
fn open(path: &Path) -> io::Result<File> {
    use rustix::fs::{FlockOperation, flock};
    let mut options = OpenOptions::new();
    let file = options
        .write(true)
        .create(true)
        .truncate(false)
        .open(path)?;
    flock(&file, FlockOperation::NonBlockingLockExclusive)?;
    Ok(file)
}

#[cfg(unix)]
fn is_held(error: &io::Error) -> bool {
    error.kind() == io::ErrorKind::WouldBlock
}

#[cfg(unix)]
fn is_same(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let id = |meta: fs::Metadata| (meta.dev(), meta.ino());
    match (file.metadata(), fs::metadata(path)) {
        (Ok(held), Ok(named)) => id(held) == id(named),
        _ => false,
    }
}

/// Opening a file that one shares with nobody is a lock here.
#[cfg(windows)]
fn open(path: &Path) -> io::Result<File> {
    use std::os::windows::fs::OpenOptionsExt;
    let mut options = OpenOptions::new();
    options.write(true).create(true).truncate(false);
    options.share_mode(0).open(path)
}

#[cfg(windows)]
fn is_held(error: &io::Error) -> bool {
    const ERROR_SHARING_VIOLATION: i32 = 32;
    error.raw_os_error() == Some(ERROR_SHARING_VIOLATION)
}

/// Files in use are not removed here.
#[cfg(windows)]
fn is_same(_file: &File, _path: &Path) -> bool {
    true
}
