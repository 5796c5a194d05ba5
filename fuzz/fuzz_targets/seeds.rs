//! Writes the seeds of every target: `ETENDUE_SEEDS=FOLDER seeds -runs=0` makes FOLDER/TARGET/0, …. As code with coverage
//! links to libFuzzer only, this looks like a target.
#![no_main]

use std::path::Path;

use etendue_fuzz::seeds;

fn write() {
    let folder = std::env::var_os("ETENDUE_SEEDS").expect("ETENDUE_SEEDS: a folder");
    let texts = [
        "0..64",
        "1,2,3,4",
        "-1e-3",
        "0.5,nan,inf",
        "64,4096",
        "1, 2,3 ,4,5e9,6",
    ];
    let environments = seeds::exr().into_iter().take(1).chain(seeds::hdr());
    let targets = [
        ("gltf", seeds::gltf()),
        ("glb", seeds::glb()),
        ("images", seeds::images()),
        ("exr", seeds::exr()),
        ("checkpoint", seeds::checkpoints()),
        ("environment", environments.collect()),
        ("numbers", texts.map(|text| text.as_bytes().to_vec()).into()),
    ];
    for (target, seeds) in targets {
        let folder = Path::new(&folder).join(target);
        std::fs::create_dir_all(&folder).expect("a folder");
        for (i, seed) in seeds.iter().enumerate() {
            std::fs::write(folder.join(i.to_string()), seed).expect("a file");
        }
    }
}

libfuzzer_sys::fuzz_target!(init: write(), |_bytes: &[u8]| {});
