//! Files that are either the old one or the complete new one, never a part: a
//! temporary file in the same folder is written, flushed to the disk and renamed.

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use crate::error::{Error, Result};
use crate::fault::file_step;

/// Characters of a file's name that its temporary file's has as well. With what is added
/// and four bytes each they stay below 255 bytes, which is what file systems take.
const NAME_CHARACTERS: usize = 48;

/// Writes a file atomically. An existing file keeps its permissions, a symbolic
/// link keeps pointing to where it points, and devices and pipes are written to.
///
/// # Errors
/// [`Error::Io`]; the temporary file is then removed and the old file intact.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<()> {
    write_with(path, &mut |file| file.write_all(bytes))
}

/// As [`write_bytes`], with the bytes that `content` writes.
///
/// # Errors
/// [`Error::Io`]; the temporary file is then removed and the old file intact.
pub fn write_with(
    path: &Path,
    content: &mut dyn FnMut(&mut dyn Write) -> io::Result<()>,
) -> Result<()> {
    if is_special(path) {
        return OpenOptions::new()
            .write(true)
            .open(path)
            .and_then(|file| content(&mut Steps(file)))
            .map_err(|source| io_error("write", path, source));
    }
    let target = resolve(path);
    let mut temporary = Temporary::create(&target)?;
    let written = (|| {
        if let Ok(old) = fs::metadata(&target) {
            file_step("permissions")?;
            temporary.file.0.set_permissions(old.permissions())?;
        }
        content(&mut temporary.file)?;
        file_step("flush")?;
        temporary.file.0.sync_all()
    })();
    written.map_err(|source| io_error("write", path, source))?;
    temporary.publish(&target)
}

/// Finds out at the start whether [`write_bytes`] will be able to write a file,
/// without touching it.
///
/// # Errors
/// [`Error::Io`] when the path is a folder or read-only, or its folder is missing or not writable.
pub fn probe_writable(path: &Path) -> Result<()> {
    if is_special(path) {
        return OpenOptions::new()
            .write(true)
            .open(path)
            .map(drop)
            .map_err(|source| io_error("write", path, source));
    }
    // dropped at once, which removes it
    Temporary::create(&resolve(path)).map(drop)
}

/// Whether the path leads to a device, pipe or socket: replacing `/dev/null` by a file would do harm.
pub(super) fn is_special(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|meta| !meta.is_file() && !meta.is_dir())
}

/// The file that a symbolic link stands for; the path itself otherwise.
pub(super) fn resolve(path: &Path) -> PathBuf {
    match fs::read_link(path) {
        // a link to nowhere: create what it points to
        Ok(link) => fs::canonicalize(path).unwrap_or_else(|_| folder(path).join(link)),
        Err(_) => path.to_owned(),
    }
}

pub(super) fn folder(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    }
}

/// A file each of whose writes is a step.
struct Steps(File);

impl Write for Steps {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        file_step("write")?;
        self.0.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

/// A file that removes itself unless it is published.
struct Temporary {
    path: PathBuf,
    file: Steps,
    published: bool,
}

impl Temporary {
    /// Creates a file next to `target` under a name that no other thread or process uses.
    fn create(target: &Path) -> Result<Self> {
        static COUNTER: AtomicU64 = AtomicU64::new(0);
        let fail = |source| io_error("write", target, source);
        let Some(name) = target.file_name() else {
            return Err(fail(io::ErrorKind::InvalidInput.into()));
        };
        match fs::metadata(target) {
            Ok(old) if old.is_dir() => return Err(fail(io::ErrorKind::IsADirectory.into())),
            // renaming over it would succeed, but its owner asked to keep it
            Ok(old) if old.permissions().readonly() => {
                return Err(fail(io::ErrorKind::PermissionDenied.into()));
            }
            Ok(_) => {}
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            // a name that is too long, among others: the temporary file's is not
            Err(error) => return Err(fail(error)),
        }
        loop {
            let mut unique = OsString::from(".");
            let name = name.to_string_lossy();
            unique.push(name.chars().take(NAME_CHARACTERS).collect::<String>());
            let number = COUNTER.fetch_add(1, Ordering::Relaxed);
            unique.push(format!(".{}-{number}.tmp", std::process::id()));
            let path = folder(target).join(unique);
            let create = || OpenOptions::new().write(true).create_new(true).open(&path);
            match file_step("create").and_then(|()| create()) {
                Ok(file) => {
                    return Ok(Self {
                        path,
                        file: Steps(file),
                        published: false,
                    });
                }
                // left behind by a process of the same number
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(fail(error)),
            }
        }
    }

    /// Gives the file its name, and makes the name last.
    fn publish(mut self, target: &Path) -> Result<()> {
        let renamed = file_step("rename").and_then(|()| fs::rename(&self.path, target));
        renamed.map_err(|source| io_error("rename to", target, source))?;
        self.published = true;
        sync_folder(folder(target)).map_err(|source| io_error("flush", target, source))
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        if !self.published {
            // nothing better can be done if even this fails
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// A rename lasts through a power failure only once its folder is on the disk.
#[cfg(unix)]
fn sync_folder(folder: &Path) -> io::Result<()> {
    file_step("flush folder")?;
    match File::open(folder)?.sync_all() {
        // file systems that cannot flush folders say so
        Err(error) if error.kind() == io::ErrorKind::InvalidInput => Ok(()),
        result => result,
    }
}

/// Folders cannot be opened as files here; renaming is already atomic.
#[cfg(not(unix))]
fn sync_folder(_folder: &Path) -> io::Result<()> {
    Ok(())
}

fn io_error(action: &'static str, path: &Path, source: io::Error) -> Error {
    Error::Io {
        action,
        path: path.to_owned(),
        source,
    }
}
