//! Environment maps: Radiance and OpenEXR.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let _ = etendue::scene::load_environment(&etendue_fuzz::file("map", bytes));
});
