//! URIs to bytes. Only `data:` URIs and files inside the scene's own folder are
//! read; a path is checked as text first and, with its links resolved, once more.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use sha2::{Digest, Sha256};

use super::{Check, Limits, quote};

/// Padding is optional: several exporters leave it out.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// Reads what a scene refers to, and remembers a digest of it.
pub(super) struct Files {
    /// Folder of the scene, links resolved: nothing outside is opened.
    folder: PathBuf,
    limits: Limits,
    total: u64,
    digest: Sha256,
}

impl Files {
    /// Finds the scene's folder.
    pub fn open(scene: &Path, limits: &Limits) -> Check<Self> {
        let parent = match scene.parent() {
            Some(parent) if parent != Path::new("") => parent,
            _ => Path::new("."),
        };
        let folder = parent
            .canonicalize()
            .map_err(|error| format!("cannot be read: {error}"))?;
        Ok(Self {
            folder,
            limits: limits.clone(),
            total: 0,
            digest: Sha256::new(),
        })
    }

    /// The scene file itself.
    pub fn read_scene(&mut self, path: &Path) -> Check<Vec<u8>> {
        self.read(path)
    }

    /// What a URI stands for.
    pub fn fetch(&mut self, uri: &str) -> Check<Vec<u8>> {
        if let Some(data) = strip_data_scheme(uri) {
            let bytes = decode_data(data)?;
            self.count(bytes.len() as u64)?;
            return Ok(bytes);
        }
        let path = self.locate(uri)?;
        self.read(&path)
            .map_err(|what| format!("URI {} {what}", quote(uri)))
    }

    /// SHA-256 of all files read so far, in that order, hexadecimal.
    pub fn hash(self) -> String {
        let digest = self.digest.finalize();
        digest.iter().map(|byte| format!("{byte:02x}")).collect()
    }

    /// Turns a URI into a file inside the folder.
    pub fn locate(&self, uri: &str) -> Check<PathBuf> {
        let relative = relative_path(uri).map_err(|what| format!("URI {} {what}", quote(uri)))?;
        let path = self
            .folder
            .join(relative)
            .canonicalize()
            .map_err(|error| format!("file {} is missing: {error}", quote(uri)))?;
        if !path.starts_with(&self.folder) {
            return Err(format!(
                "URI {} leads through a link out of the scene's folder, which is refused",
                quote(uri)
            ));
        }
        Ok(path)
    }

    fn read(&mut self, path: &Path) -> Check<Vec<u8>> {
        let failed = |error: std::io::Error| format!("cannot be read: {error}");
        let kind = std::fs::metadata(path).map_err(failed)?;
        if !kind.is_file() {
            return Err(String::from("is not a regular file"));
        }
        let cap = self.limits.file_bytes;
        let too_large =
            || format!("is larger than the cap of {cap} bytes a file (Limits::file_bytes)");
        if kind.len() > cap {
            return Err(too_large());
        }
        // `take` hides the size from `read_to_end`, so memory grows with what arrives.
        let mut bytes = Vec::new();
        File::open(path)
            .and_then(|file| file.take(cap.saturating_add(1)).read_to_end(&mut bytes))
            .map_err(failed)?;
        if bytes.len() as u64 > cap {
            return Err(too_large());
        }
        self.count(bytes.len() as u64)?;
        self.digest.update(&bytes);
        Ok(bytes)
    }

    fn count(&mut self, bytes: u64) -> Check<()> {
        self.total = self.total.saturating_add(bytes);
        if self.total > self.limits.total_bytes {
            return Err(format!(
                "takes the files beyond the cap of {} bytes in total (Limits::total_bytes)",
                self.limits.total_bytes
            ));
        }
        Ok(())
    }
}

fn strip_data_scheme(uri: &str) -> Option<&str> {
    let (scheme, rest) = uri.split_once(':')?;
    scheme.eq_ignore_ascii_case("data").then_some(rest)
}

/// The payload of `data:[type][;parameter]…[;base64],payload`.
fn decode_data(data: &str) -> Check<Vec<u8>> {
    let (head, payload) = data
        .split_once(',')
        .ok_or("data URI has no comma before its payload")?;
    if head
        .rsplit(';')
        .next()
        .is_some_and(|last| last.eq_ignore_ascii_case("base64"))
    {
        return BASE64
            .decode(payload)
            .map_err(|error| format!("data URI is not valid base64: {error}"));
    }
    decode_percent(payload).map_err(|what| format!("data URI {what}"))
}

/// Checks the text of a URI and gives the path that it stands for, relative to the scene's folder.
fn relative_path(uri: &str) -> Check<PathBuf> {
    if uri.is_empty() {
        return Err(String::from("is empty"));
    }
    if let Some(scheme) = scheme_of(uri) {
        return Err(format!(
            "has the scheme {}, but only data: URIs and files in the scene's folder are read",
            quote(scheme)
        ));
    }
    if uri.contains(['?', '#']) {
        return Err(String::from(
            "has a query or fragment, which a file has not; write %3F or %23 for ? and #",
        ));
    }
    let text = String::from_utf8(decode_percent(uri)?)
        .map_err(|_| String::from("does not decode to UTF-8"))?;
    if text.contains('\\') {
        return Err(String::from("holds a backslash; folders are parted by /"));
    }
    if text.chars().any(char::is_control) {
        return Err(String::from("holds a NUL or another control character"));
    }
    if text.starts_with('/') {
        return Err(String::from(
            "is absolute; only files in the scene's folder are read",
        ));
    }
    let mut path = PathBuf::new();
    for part in text.split('/') {
        match part {
            "" => return Err(String::from("has an empty path segment")),
            "." => {}
            ".." => {
                return Err(String::from(
                    "uses .. but only files in the scene's folder are read",
                ));
            }
            _ if part.contains(':') => {
                return Err(String::from(
                    "holds a colon, which is a drive or scheme elsewhere",
                ));
            }
            _ => path.push(part),
        }
    }
    Ok(path)
}

/// The scheme of a URI by RFC 3986: a letter, then letters, digits, `+`, `-`, `.` up to a colon.
fn scheme_of(uri: &str) -> Option<&str> {
    let (scheme, _) = uri.split_once(':')?;
    let is_scheme = scheme.starts_with(|c: char| c.is_ascii_alphabetic())
        && scheme
            .chars()
            .all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c));
    is_scheme.then_some(scheme)
}

/// Replaces `%XX`; an incomplete or non-hexadecimal escape is an error.
fn decode_percent(text: &str) -> Check<Vec<u8>> {
    let mut decoded = Vec::with_capacity(text.len());
    let mut bytes = text.bytes();
    while let Some(byte) = bytes.next() {
        if byte != b'%' {
            decoded.push(byte);
            continue;
        }
        let mut digit = || bytes.next().and_then(|d| char::from(d).to_digit(16));
        let (Some(high), Some(low)) = (digit(), digit()) else {
            return Err(String::from(
                "has a bad percent escape: % needs two hexadecimal digits",
            ));
        };
        decoded.push((high * 16 + low) as u8);
    }
    Ok(decoded)
}
