//! Scenes as JSON text, with their buffers in data URIs.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    etendue_fuzz::load(&etendue_fuzz::file("scene.gltf", bytes));
});
