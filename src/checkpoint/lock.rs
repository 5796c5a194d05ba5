//! One process for a checkpoint: a file beside it is locked as long as somebody works on
//! it. The system lets go of the lock however a process ends.

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

/// Held as long as nobody else may write the checkpoint.
#[derive(Debug)]
pub struct Lock {
    path: PathBuf,
    /// None where the file system has no locks.
    file: Option<File>,
}

/// Keeps other processes from a checkpoint. Where the file system has no locks, nothing
/// is kept from it, and the log says so.
///
/// # Errors
/// [`Error::Busy`] when somebody has it, [`Error::Io`] when the file beside it cannot be made.
pub fn lock(checkpoint: &Path) -> Result<Lock> {
    // the file that other names of it stand for
    let target = fs::canonicalize(checkpoint).unwrap_or_else(|_| checkpoint.to_owned());
    let mut name = OsString::from(".");
    let whole = target.file_name().unwrap_or_default().to_string_lossy();
    name.push(whole.chars().take(NAME_CHARACTERS).collect::<String>());
    name.push(".lock");
    let path = target.with_file_name(name);
    loop {
        match open(&path) {
            // its holder removed it before it was locked here: the next one made another
            Ok(file) if !is_same(&file, &path) => {}
            Ok(file) => {
                return Ok(Lock {
                    path,
                    file: Some(file),
                });
            }
            Err(error) if is_held(&error) => {
                let path = checkpoint.to_owned();
                return Err(Error::Busy { path });
            }
            Err(error) if error.kind() == io::ErrorKind::Unsupported => {
                tracing::warn!("{} cannot be locked: {error}", checkpoint.display());
                return Ok(Lock { path, file: None });
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

/// Characters of the checkpoint's name that the name of its lock has as well; with four
/// bytes each they stay below the 255 bytes that file systems take.
const NAME_CHARACTERS: usize = 60;

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
