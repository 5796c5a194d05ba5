//! OpenEXR as an image, with the sums of a shard if it has any.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    if let Ok(image) = etendue::image_io::read_exr(&etendue_fuzz::file("a.exr", bytes)) {
        let _ = image.film();
    }
});
