//! Scenes in GLB containers.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    etendue_fuzz::load(&etendue_fuzz::file("scene.glb", bytes));
});
