//! Builds glTF files in memory and loads them from a temporary folder.

use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use etendue::scene::Scene;
use etendue::scene::gltf::{Limits, load_with};
use etendue::{Error, Result};
use serde_json::{Value, json};

pub const I8: u32 = 5120;
pub const U8: u32 = 5121;
pub const I16: u32 = 5122;
pub const U16: u32 = 5123;
pub const U32: u32 = 5125;
pub const F32: u32 = 5126;

/// A glTF file under construction; all its views lie in one buffer.
pub struct Asset {
    pub json: Value,
    pub bytes: Vec<u8>,
}

impl Asset {
    /// One node with one mesh with one primitive, which has no attributes yet.
    pub fn new() -> Self {
        Self {
            json: json!({
                "asset": { "version": "2.0" },
                "scene": 0,
                "scenes": [{ "nodes": [0] }],
                "nodes": [{ "mesh": 0 }],
                "meshes": [{ "primitives": [{ "attributes": {} }] }],
                "bufferViews": [],
                "accessors": [],
            }),
            bytes: Vec::new(),
        }
    }

    /// [`Self::new`] with the triangle (0,0,0), (1,0,0), (0,1,0).
    pub fn triangle() -> Self {
        let mut asset = Self::new();
        let positions = asset.floats("VEC3", &[0., 0., 0., 1., 0., 0., 0., 1., 0.]);
        asset.attribute("POSITION", positions);
        asset
    }

    /// Appends a buffer view and gives its index.
    pub fn view(&mut self, bytes: &[u8]) -> usize {
        while self.bytes.len() % 4 != 0 {
            self.bytes.push(0xAA);
        }
        let view =
            json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len() });
        self.bytes.extend(bytes);
        self.push("/bufferViews", view)
    }

    /// Appends a tightly packed accessor and gives its index.
    pub fn accessor(&mut self, component: u32, shape: &str, count: usize, bytes: &[u8]) -> usize {
        let view = self.view(bytes);
        self.push(
            "/accessors",
            json!({ "bufferView": view, "componentType": component, "type": shape, "count": count }),
        )
    }

    /// Appends an accessor of floats.
    pub fn floats(&mut self, shape: &str, values: &[f32]) -> usize {
        let parts = match shape {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            _ => 4,
        };
        let bytes = le_bytes(values);
        self.accessor(F32, shape, values.len() / parts, &bytes)
    }

    /// Sets an attribute of the first primitive.
    pub fn attribute(&mut self, name: &str, accessor: usize) {
        let pointer = format!("/meshes/0/primitives/0/attributes/{name}");
        self.set(&pointer, json!(accessor));
    }

    /// Sets the value at a JSON pointer, whose parent must exist.
    pub fn set(&mut self, pointer: &str, value: Value) -> &mut Self {
        let (parent, key) = pointer.rsplit_once('/').unwrap();
        let parent = self
            .json
            .pointer_mut(parent)
            .unwrap_or_else(|| panic!("no parent of {pointer}"));
        match parent {
            Value::Object(map) => {
                map.insert(key.to_owned(), value);
            }
            Value::Array(list) => list[key.parse::<usize>().unwrap()] = value,
            other => panic!("{pointer}: {other}"),
        }
        self
    }

    /// Removes what a JSON pointer points at.
    pub fn remove(&mut self, pointer: &str) -> &mut Self {
        let (parent, key) = pointer.rsplit_once('/').unwrap();
        let parent = self.json.pointer_mut(parent).unwrap();
        assert!(parent.as_object_mut().unwrap().remove(key).is_some());
        self
    }

    /// Appends to the array at a JSON pointer and gives the index.
    pub fn push(&mut self, pointer: &str, value: Value) -> usize {
        let list = self.json.pointer_mut(pointer).unwrap();
        let list = list.as_array_mut().unwrap();
        list.push(value);
        list.len() - 1
    }

    /// The file as text, the buffer as a data URI unless one is set already.
    pub fn to_gltf(&self) -> String {
        let mut json = self.json.clone();
        if json.get("buffers").is_none() {
            json["buffers"] =
                json!([{ "byteLength": self.bytes.len(), "uri": data_uri(&self.bytes) }]);
        }
        json.to_string()
    }

    /// The file as a `.glb`.
    pub fn to_glb(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        json["buffers"] = json!([{ "byteLength": self.bytes.len() }]);
        let mut text = json.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let mut binary = self.bytes.clone();
        binary.resize(binary.len().next_multiple_of(4), 0);
        glb(&[(0x4E4F_534A, &text), (0x004E_4942, &binary)])
    }

    /// Loads the file from a folder of its own.
    pub fn load(&self) -> Result<Scene> {
        load_bytes(self.to_gltf().as_bytes(), &Limits::default())
    }
}

/// A GLB container around chunks.
pub fn glb(chunks: &[(u32, &[u8])]) -> Vec<u8> {
    let length = 12 + chunks.iter().map(|(_, data)| 8 + data.len()).sum::<usize>();
    let mut bytes = b"glTF".to_vec();
    bytes.extend(2_u32.to_le_bytes());
    bytes.extend((length as u32).to_le_bytes());
    for (kind, data) in chunks {
        bytes.extend((data.len() as u32).to_le_bytes());
        bytes.extend(kind.to_le_bytes());
        bytes.extend(*data);
    }
    bytes
}

pub fn le_bytes(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|x| x.to_le_bytes()).collect()
}

pub fn data_uri(bytes: &[u8]) -> String {
    format!(
        "data:application/octet-stream;base64,{}",
        STANDARD.encode(bytes)
    )
}

/// Writes a file into an empty folder and loads it.
pub fn load_bytes(bytes: &[u8], limits: &Limits) -> Result<Scene> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.gltf");
    std::fs::write(&path, bytes).unwrap();
    load_with(&path, limits)
}

/// The message of a refusal; anything but [`Error::Scene`] fails the test.
pub fn refusal(result: Result<Scene>, case: &str) -> String {
    match result {
        Err(Error::Scene { what, .. }) => what,
        Err(other) => panic!("{case}: wrong kind of error: {other}"),
        Ok(_) => panic!("{case}: was loaded"),
    }
}

/// Loads a path and asserts that it is refused with a message that holds `fragment`.
pub fn assert_refused(path: &Path, fragment: &str) {
    let case = path.display().to_string();
    let what = refusal(etendue::scene::gltf::load(path), &case);
    assert!(
        what.contains(fragment),
        "{case}: {fragment:?} not in {what:?}"
    );
}

/// A PNG from RGBA bytes.
pub fn png(width: u32, height: u32, rgba: &[u8]) -> Vec<u8> {
    let image = image::RgbaImage::from_raw(width, height, rgba.to_vec()).unwrap();
    encode(&image.into())
}

/// Encodes any image as PNG.
pub fn encode(image: &image::DynamicImage) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}
