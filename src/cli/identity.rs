//! Which parts of a header decide the bits of the picture: what must be the same
//! where samples of several runs are added up.

use std::path::Path;

use etendue::image_io::{Metadata, Value};
use etendue::{Error, Result};

/// Known before a device is opened.
pub const JOB: &[&str] = &[
    "version",
    "build",
    "scene_hash",
    "settings.width",
    "settings.height",
    "settings.crop",
    "settings.seed",
    "settings.max_depth",
    "settings.estimator",
    "settings.adaptive",
    "settings.share",
    "settings.strategy",
    "settings.camera",
    "settings.env_hash",
    "settings.env_intensity",
    "settings.env_rotation",
];

/// Where it is rendered. Another device may round differently.
pub const DEVICE: &[&str] = &["backend", "device", "driver"];

/// Refuses a file whose header differs from the expected one in one of `fields`;
/// `whose` says where the expected one is from.
///
/// # Errors
/// [`Error::Mismatch`] with the first field that differs.
pub fn check(
    file: &Path,
    header: &Metadata,
    expected: &Metadata,
    whose: &str,
    fields: &[&'static str],
) -> Result<()> {
    match difference(header, expected, fields) {
        None => Ok(()),
        Some(field) => Err(Error::Mismatch {
            path: file.to_owned(),
            field,
            what: format!(
                "{} there, {} {whose}",
                show(header, field),
                show(expected, field)
            ),
        }),
    }
}

/// The first of `fields` in which two headers differ.
pub fn difference(a: &Metadata, b: &Metadata, fields: &[&'static str]) -> Option<&'static str> {
    let mut fields = fields.iter().copied();
    fields.find(|&field| a.get(field) != b.get(field))
}

/// A value for people.
pub fn show(header: &Metadata, field: &str) -> String {
    match header.get(field) {
        None => String::from("nothing"),
        Some(Value::Text(text)) => text.clone(),
        Some(Value::Number(number)) => number.to_string(),
    }
}

/// A text of a header.
pub fn text<'a>(header: &'a Metadata, field: &str) -> Option<&'a str> {
    match header.get(field) {
        Some(Value::Text(text)) => Some(text),
        _ => None,
    }
}

/// A number of a header.
pub fn number(header: &Metadata, field: &str) -> Option<f64> {
    match header.get(field) {
        Some(Value::Number(number)) => Some(*number),
        _ => None,
    }
}
