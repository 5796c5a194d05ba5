//! Checkpoints whose checksum is right.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let mut bytes = bytes.to_vec();
    etendue_fuzz::seeds::seal(&mut bytes);
    let _ = etendue::checkpoint::read(&etendue_fuzz::file("a.ck", &bytes));
});
