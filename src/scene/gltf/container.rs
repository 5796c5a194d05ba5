//! From bytes to JSON and the binary chunk: plain `.gltf` text or a `.glb`
//! container, told apart by the magic number.

use super::json::Root;
use super::{Check, Limits, Warnings, quote};

const MAGIC: &[u8; 4] = b"glTF";
const CHUNK_JSON: u32 = 0x4E4F_534A;
const CHUNK_BINARY: u32 = 0x004E_4942;
const HEADER: usize = 12;
const CHUNK_HEADER: usize = 8;

/// The parsed JSON and, for a `.glb`, its binary chunk.
pub(super) fn parse(
    mut bytes: Vec<u8>,
    limits: &Limits,
    warnings: &mut Warnings,
) -> Check<(Root, Option<Vec<u8>>)> {
    if !bytes.starts_with(MAGIC) {
        return Ok((parse_json(&bytes, limits)?, None));
    }
    let chunks = find_chunks(&bytes, warnings)?;
    let root = parse_json(&bytes[chunks.json], limits)?;
    let binary = chunks.binary.map(|range| {
        // Shift within the file's own allocation: no second copy of a large scene.
        bytes.truncate(range.end);
        bytes.drain(..range.start);
        bytes
    });
    Ok((root, binary))
}

struct Chunks {
    json: std::ops::Range<usize>,
    binary: Option<std::ops::Range<usize>>,
}

fn find_chunks(bytes: &[u8], warnings: &mut Warnings) -> Check<Chunks> {
    let word = |at: usize| -> Option<u32> {
        let word = bytes.get(at..at.checked_add(4)?)?;
        Some(u32::from_le_bytes(word.try_into().ok()?))
    };
    let (Some(version), Some(length)) = (word(4), word(8)) else {
        return Err(format!(
            "truncated GLB: {} bytes are less than its {HEADER}-byte header",
            bytes.len()
        ));
    };
    if version != 2 {
        return Err(format!("GLB version {version} is not supported, only 2 is"));
    }
    let length = length as usize;
    if length > bytes.len() {
        return Err(format!(
            "truncated GLB: its header claims {length} bytes, the file has {}",
            bytes.len()
        ));
    }
    if length < HEADER {
        return Err(format!(
            "GLB header claims {length} bytes, less than itself"
        ));
    }
    if length < bytes.len() {
        warnings.push(format!(
            "{} bytes after the end of the GLB are ignored",
            bytes.len() - length
        ));
    }
    let mut json = None;
    let mut binary = None;
    let mut at = HEADER;
    let mut number = 0;
    while at < length {
        let (Some(size), Some(kind)) = (word(at), word(at + 4)) else {
            return Err(format!(
                "truncated GLB: chunk {number} has no complete header"
            ));
        };
        let start = at + CHUNK_HEADER;
        let end = start
            .checked_add(size as usize)
            .filter(|&end| end <= length)
            .ok_or_else(|| {
                format!(
                    "truncated GLB: chunk {number} claims {size} bytes, {} are left",
                    length.saturating_sub(start)
                )
            })?;
        match (number, kind) {
            (0, CHUNK_JSON) => json = Some(start..end),
            (1, CHUNK_BINARY) => binary = Some(start..end),
            // Other chunks are to be ignored, says the specification.
            _ => {}
        }
        number += 1;
        at = end;
    }
    let json = json.ok_or("GLB: the first chunk is not JSON")?;
    Ok(Chunks { json, binary })
}

fn parse_json(text: &[u8], limits: &Limits) -> Check<Root> {
    if text.len() as u64 > limits.json_bytes {
        return Err(format!(
            "the JSON text has {} bytes, more than the cap of {} (Limits::json_bytes)",
            text.len(),
            limits.json_bytes
        ));
    }
    let text = text.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(text);
    let root: Root =
        serde_json::from_slice(text).map_err(|error| format!("not valid glTF JSON: {error}"))?;
    let asset = root
        .asset
        .as_ref()
        .ok_or("asset is missing: this is not a glTF 2.0 file")?;
    let version = asset.version.as_deref().ok_or("asset.version is missing")?;
    let wanted = asset.min_version.as_deref().unwrap_or(version);
    let supported = match asset.min_version {
        Some(_) => wanted == "2.0",
        None => wanted.split('.').next() == Some("2"),
    };
    if !supported {
        return Err(format!(
            "glTF version {} is not supported, only 2.0 is",
            quote(wanted)
        ));
    }
    Ok(root)
}
