//! Small valid files of every kind that is read: `tests/fuzz.rs` damages them, and `fuzz/` starts from them.

use std::io::Cursor;
use std::path::Path;

use etendue::checkpoint;
use etendue::film::Film;
use etendue::image_io::{Aov, Image, Metadata, write_exr};
use etendue::settings::Crop;
use image::codecs::hdr::HdrEncoder;
use image::{DynamicImage, ImageFormat, Rgb, RgbImage};
use serde_json::json;
use sha2::{Digest, Sha256};

use super::builder::{self, Asset, data_uri, png};

/// A small scene with most of what the loader knows.
pub fn asset() -> Asset {
    let mut asset = Asset::triangle();
    let normals = asset.floats("VEC3", &[0., 0., 1., 0., 0., 1., 0., 0., 1.]);
    asset.attribute("NORMAL", normals);
    let uvs = asset.floats("VEC2", &[0., 0., 1., 0., 0., 1.]);
    asset.attribute("TEXCOORD_0", uvs);
    let indices = asset.accessor(builder::U16, "SCALAR", 3, &[0, 0, 1, 0, 2, 0]);
    asset.set("/meshes/0/primitives/0/indices", json!(indices));
    asset.set("/meshes/0/primitives/0/material", json!(0));
    let picture = data_uri(&png(2, 2, &[200; 16]));
    asset.set("/images", json!([{ "uri": picture }]));
    asset.set("/samplers", json!([{ "wrapS": 33071, "magFilter": 9728 }]));
    asset.set("/textures", json!([{ "source": 0, "sampler": 0 }]));
    asset.set(
        "/materials",
        json!([{
            "pbrMetallicRoughness": {
                "baseColorFactor": [0.5, 0.6, 0.7, 1.0],
                "baseColorTexture": { "index": 0 },
                "roughnessFactor": 0.3,
            },
            "emissiveFactor": [1, 0.5, 0],
            "extensions": {
                "KHR_materials_transmission": { "transmissionFactor": 0.5 },
                "KHR_materials_volume": { "thicknessFactor": 1, "attenuationDistance": 2.5, "attenuationColor": [0.5, 0.5, 1] },
                "KHR_materials_ior": { "ior": 1.4 },
                "ETENDUE_medium": { "scattering": [1, 2, 3], "phase": "henyey-greenstein", "g": 0.5 },
            },
        }]),
    );
    asset.set(
        "/cameras",
        json!([{ "type": "perspective", "perspective": { "yfov": 0.7, "znear": 0.1 } }]),
    );
    asset.set(
        "/nodes",
        json!([
            { "mesh": 0, "children": [1], "rotation": [0, 0.6, 0, 0.8] },
            { "camera": 0, "translation": [0, 0, 3] },
        ]),
    );
    asset
}

/// Scenes as text.
pub fn gltf() -> Vec<Vec<u8>> {
    [asset(), Asset::triangle()]
        .map(|asset| asset.to_gltf().into_bytes())
        .into()
}

/// Scenes in containers.
pub fn glb() -> Vec<Vec<u8>> {
    [asset(), Asset::triangle()]
        .map(|asset| asset.to_glb())
        .into()
}

/// PNG and JPEG.
pub fn images() -> Vec<Vec<u8>> {
    let picture = DynamicImage::ImageRgb8(RgbImage::from_fn(9, 7, |x, y| {
        Rgb([x as u8 * 20, y as u8 * 30, (x * y) as u8])
    }));
    let encoded = |format| {
        let mut bytes = Cursor::new(Vec::new());
        picture.write_to(&mut bytes, format).unwrap();
        bytes.into_inner()
    };
    [ImageFormat::Png, ImageFormat::Jpeg].map(encoded).into()
}

fn film() -> Film {
    let window = Crop {
        x0: 1,
        y0: 0,
        x1: 4,
        y1: 2,
    };
    let mut film = Film::new(window, (5, 3), false);
    film.add(0, 3, (0..54).map(|i| i as f32).collect()).unwrap();
    film.add(16, 1, (0..54).map(|i| 0.5 * i as f32).collect())
        .unwrap();
    film
}

fn header() -> Metadata {
    let mut header = Metadata::new();
    header.insert("text".into(), "Größe\n".into());
    header.insert("number".into(), 0.1.into());
    header
}

/// What `write` writes.
fn written(write: impl FnOnce(&Path)) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("seed");
    write(&path);
    std::fs::read(&path).unwrap()
}

/// A film with its header.
pub fn checkpoints() -> Vec<Vec<u8>> {
    vec![written(|path| {
        checkpoint::write(path, &header(), &film()).unwrap();
    })]
}

/// Makes the checksum at the end of a checkpoint right again.
pub fn seal(bytes: &mut [u8]) {
    const SUM: usize = 32;
    if let Some(body) = bytes.len().checked_sub(SUM) {
        let sum = Sha256::digest(&bytes[..body]);
        bytes[body..].copy_from_slice(&sum);
    }
}

/// Images without and with the sums of a shard.
pub fn exr() -> Vec<Vec<u8>> {
    let mut image = Image::from_film(&film(), &Aov::ALL[..0], header()).unwrap();
    let plain = written(|path| write_exr(path, &image).unwrap());
    image.push_nodes(&film());
    vec![plain, written(|path| write_exr(path, &image).unwrap())]
}

/// A Radiance picture.
pub fn hdr() -> Vec<Vec<u8>> {
    let pixels: Vec<_> = (0..64).map(|i| Rgb([i as f32, 1.0, 0.25])).collect();
    let mut bytes = Vec::new();
    HdrEncoder::new(&mut bytes).encode(&pixels, 16, 4).unwrap();
    vec![bytes]
}
