//! Nothing finished is lost, and any split of the work gives the same picture:
//! checkpoints, shards, and renders that are repeated. With `ETENDUE_NIGHTLY=1`
//! the random parts run more often.
#![allow(clippy::unwrap_used, reason = "a step that fails fails the test")]
#![allow(clippy::print_stderr, reason = "a test that is skipped says so")]

mod cost;
mod damage;
mod disk;
mod growth;
mod guard;
mod memory;
mod refusals;
mod rerender;
mod resume;
mod shards;
#[allow(dead_code, reason = "shared with the tests of the program")]
#[path = "../cli/support.rs"]
mod support;
mod team;

use etendue::film::Film;
use etendue::render::{DeviceOptions, Renderer, Tuning};
use etendue::scene::gltf;
use etendue::settings::Settings;

/// How often the random parts run: by day, or at night.
fn rounds(day: u64, night: u64) -> u64 {
    let is_night = std::env::var_os("ETENDUE_NIGHTLY").is_some_and(|value| value == "1");
    if is_night { night } else { day }
}

/// splitmix64: enough for test data, and the same on every machine.
fn hash(mut x: u64) -> u64 {
    x = x.wrapping_add(0x9E37_79B9_7F4A_7C15);
    x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    x ^ (x >> 31)
}

/// A scene of the project.
fn example(name: &str) -> String {
    format!("{}/scenes/{name}.gltf", env!("CARGO_MANIFEST_DIR"))
}

/// A renderer in small steps, and its settings: 100 samples from the third on.
fn renderer(scene: &str) -> (Renderer, Settings) {
    let scene = gltf::load(scene.as_ref()).unwrap();
    let settings = Settings {
        width: 24,
        height: 20,
        samples: 3..103,
        max_depth: 4,
        aovs: true,
        ..Settings::default()
    };
    let tuning = Tuning {
        max_tiles: 2,
        ..Tuning::default()
    };
    let options = DeviceOptions::default();
    let renderer = Renderer::tuned(&scene, &settings, &options, tuning).unwrap();
    (renderer, settings)
}

/// All sums of a film, as bits.
fn bits(film: &Film) -> Vec<(u64, u32, Vec<u32>)> {
    let bits = |values: &[f32]| values.iter().map(|v| v.to_bits()).collect();
    film.nodes()
        .map(|(first, level, values)| (first, level, bits(values)))
        .collect()
}
