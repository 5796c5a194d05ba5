//! Running the program, and a scene for it.

use std::ffi::OsString;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Output};

use base64::Engine;
use etendue::image_io::{Image, Value, read_exr};
use serde_json::{Value as Json, json};
use tempfile::TempDir;

pub fn etendue(arguments: &str, folder: &Path) -> Output {
    command(arguments, folder).output().unwrap()
}

/// The program. `ETENDUE_TEST_PROGRAM` names another one: that with the feature `faults` for its tests, where that
/// without it lies in its place by now.
fn program() -> OsString {
    let other = std::env::var_os("ETENDUE_TEST_PROGRAM");
    other.unwrap_or_else(|| env!("CARGO_BIN_EXE_etendue").into())
}

pub fn command(arguments: &str, folder: &Path) -> Command {
    let mut command = Command::new(program());
    command
        .args(arguments.split_whitespace())
        .current_dir(folder)
        .env_remove("RUST_LOG")
        .env_remove("RUST_BACKTRACE");
    command
}

pub fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

pub fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

/// Names in a folder.
pub fn list(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<_> = entries
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

/// Whether a device can render; where there is none, says so, or fails if one is required.
pub fn has_device() -> bool {
    let output = etendue("info", Path::new("."));
    match output.status.code() {
        Some(0) => true,
        Some(4) => {
            let required = std::env::var_os("ETENDUE_REQUIRE_DEVICE").is_some();
            assert!(!required, "no device: {}", stderr(&output));
            eprintln!("skipped: {}", stderr(&output));
            false
        }
        _ => panic!("info fails: {}", stderr(&output)),
    }
}

/// Radiance of the surroundings.
pub const SKY: [f32; 3] = [0.5, 0.625, 0.75];

/// A white square of 2 m in a constant surrounding, seen by two cameras: `wide`
/// (2:1), which also sees past it, and `close`, which sees nothing but the square.
pub fn scene() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let mut bytes = Vec::new();
    for corner in [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0_f32]] {
        for value in [corner[0], corner[1], 0.0] {
            bytes.extend(value.to_le_bytes());
        }
    }
    for index in [0, 1, 2, 0, 2, 3_u16] {
        bytes.extend(index.to_le_bytes());
    }
    let data = base64::engine::general_purpose::STANDARD.encode(&bytes);
    let camera = |yfov: f32, aspect: f32| {
        json!({
            "type": "perspective",
            "perspective": { "yfov": yfov, "aspectRatio": aspect, "znear": 0.01 }
        })
    };
    let scene = json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "extensionsUsed": ["ETENDUE_environment", "VENDOR_unknown"],
        "scenes": [{
            "nodes": [0, 1, 2],
            "extensions": { "ETENDUE_environment": { "radiance": SKY } }
        }],
        "nodes": [
            { "name": "square", "mesh": 0 },
            { "name": "wide", "camera": 0, "translation": [0, 0, 3] },
            { "name": "close", "camera": 1, "translation": [0, 0, 1] }
        ],
        "cameras": [camera(1.0, 2.0), camera(0.5, 1.0)],
        "meshes": [{ "primitives": [{
            "attributes": { "POSITION": 0 }, "indices": 1, "material": 0
        }] }],
        "materials": [{ "pbrMetallicRoughness": {
            "baseColorFactor": [0.5, 0.5, 0.5, 1], "metallicFactor": 0, "roughnessFactor": 1
        } }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3",
              "min": [-1, -1, 0], "max": [1, 1, 0] },
            { "bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR" }
        ],
        "bufferViews": [
            { "buffer": 0, "byteLength": 48 },
            { "buffer": 0, "byteOffset": 48, "byteLength": 12 }
        ],
        "buffers": [{
            "byteLength": 60,
            "uri": format!("data:application/octet-stream;base64,{data}")
        }]
    });
    fs::write(folder.path().join("scene.gltf"), scene.to_string()).unwrap();
    folder
}

/// Renders the scene; fails the test unless that works.
pub fn render(folder: &TempDir, options: &str) -> Output {
    let line = format!("render scene.gltf {options}");
    let output = etendue(&line, folder.path());
    assert!(output.status.success(), "{line}: {}", stderr(&output));
    assert!(output.stdout.is_empty(), "{line} writes to stdout");
    output
}

pub fn read(folder: &TempDir, name: &str) -> Image {
    read_exr(&folder.path().join(name)).unwrap()
}

pub fn text<'a>(image: &'a Image, name: &str) -> &'a str {
    match &image.metadata[name] {
        Value::Text(text) => text,
        Value::Number(number) => panic!("{name} is the number {number}"),
    }
}

pub fn number(image: &Image, name: &str) -> f64 {
    match &image.metadata[name] {
        Value::Number(number) => *number,
        Value::Text(text) => panic!("{name} is the text {text}"),
    }
}

/// Reads progress until a sample is finished.
pub fn wait_for_samples(child: &mut Child) {
    use std::io::{BufRead, BufReader};
    let mut lines = BufReader::new(child.stderr.take().unwrap());
    loop {
        let mut line = String::new();
        assert!(lines.read_line(&mut line).unwrap() > 0, "ended early");
        let event: Json = serde_json::from_str(&line).unwrap();
        if event["event"] == "progress" && event["samples"].as_u64().unwrap() > 0 {
            break;
        }
    }
    child.stderr = Some(lines.into_inner());
}
