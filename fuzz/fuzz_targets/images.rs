//! PNG and JPEG; the scene around them is whole.
#![no_main]

use std::path::PathBuf;
use std::sync::OnceLock;

use etendue_fuzz::{file, load, seeds};
use serde_json::json;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    static SCENE: OnceLock<PathBuf> = OnceLock::new();
    file("image", bytes);
    load(SCENE.get_or_init(|| {
        let mut asset = seeds::asset();
        asset.set("/images", json!([{ "uri": "image" }]));
        file("scene.gltf", asset.to_gltf().as_bytes())
    }));
});
