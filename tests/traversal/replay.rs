//! The kernels of the limit report: they render, trace and meet what the kernel does that everybody uses.

use std::path::Path;

use etendue::render::{Stream, Study, Tuning};
use etendue::scene::{Scene, gltf};
use etendue::settings::{BackendChoice, Settings};

use crate::backends::offered;
use crate::{finish, open_tuned, probing};

/// log₂ of the samples of a pass.
const LEVEL: u32 = 2;
/// Rays that may meet something else by another traversal, as a share: those at edges. Shadow rays of tessellated lamps
/// meet these or what is beside them.
const MOST_DIFFERENT: f64 = 1e-4;
/// The compiler may round a kernel without a walk otherwise, relative: 3e-6 under a sky, nothing in the other scenes.
const ROUNDING: f32 = 1e-5;

fn scene(name: &str) -> Scene {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{name}.gltf"));
    gltf::load(&file).unwrap()
}

fn settings(backend: BackendChoice) -> Settings {
    Settings {
        // tiles that reach beyond the picture
        width: 28,
        height: 20,
        ..probing(backend)
    }
}

/// A recording, the rays that the ledger counted, and the film that the kernel made that kept them.
fn record(scene: &Scene) -> Option<(Stream, u64, Vec<f32>)> {
    let tuning = Tuning {
        study: Study::Record,
        ..Tuning::default()
    };
    let mut recorder = open_tuned(scene, &settings(BackendChoice::Bvh), tuning)?;
    let stream = recorder.record(LEVEL).unwrap();
    let pass = recorder.study(LEVEL).unwrap();
    finish(&recorder);
    Some((stream, pass.counts.rays, pass.film))
}

#[test]
fn a_replay_meets_what_the_render_met() {
    // planes without a walk, solids, media, placements, cut-outs and partial coverage, lights by a tree, a sky
    for name in ["cornell", "glass", "fog", "instances", "lights", "sun"] {
        let scene = scene(name);
        let Some((stream, rays, film)) = record(&scene) else {
            return;
        };
        assert_eq!(stream.len() as u64, rays, "{name}: not every ray is kept");
        assert!(rays > 28 * 20 * 4, "{name}: {rays} rays");
        // where arrays lie is asked of two scenes
        let texels = matches!(name, "cornell" | "lights").then_some(false);
        for addresses in texels.into_iter().chain([true]) {
            let study = |study, stream: Option<&Stream>| {
                let tuning = Tuning {
                    addresses: Some(addresses),
                    study,
                    ..Tuning::default()
                };
                let mut renderer =
                    open_tuned(&scene, &settings(BackendChoice::Bvh), tuning).unwrap();
                stream.iter().for_each(|s| renderer.hold(s).unwrap());
                let pass = renderer.study(LEVEL).unwrap();
                finish(&renderer);
                pass
            };
            let plain = study(Study::None, None);
            assert_eq!(plain.counts.rays, rays, "{name}");
            assert!(plain.film == film, "{name}: the film of a recorder");
            let recalled = study(Study::Recall, Some(&stream));
            for (a, b) in recalled.film.iter().zip(&film) {
                let off = (a - b).abs() / (b.abs() + 1e-3);
                assert!(
                    off <= ROUNDING,
                    "{name}: {a} without traversal, {b} with it"
                );
            }
            for stream in [&stream, &stream.sorted()] {
                let replayed = study(Study::Replay, Some(stream)).counts;
                assert_eq!(replayed.rays, rays, "{name}: rays of a replay");
                assert_eq!(replayed.different, 0, "{name}: what they meet");
            }
            // the same rays, of which none meets anything
            let met = stream.rays_met() as u64;
            let read = study(Study::Read, Some(&stream)).counts;
            assert_eq!((read.rays, read.different), (rays, met), "{name}");
        }
    }
}

#[test]
fn a_replay_notices_what_is_met_otherwise() {
    let tuning = Tuning {
        study: Study::Replay,
        ..Tuning::default()
    };
    let recorded = scene("cornell");
    let Some((stream, ..)) = record(&recorded) else {
        return;
    };
    for backend in offered() {
        let different = |scene: &Scene| {
            let mut renderer = open_tuned(scene, &settings(backend), tuning).unwrap();
            renderer.hold(&stream).unwrap();
            let counts = renderer.study(LEVEL).unwrap().counts;
            finish(&renderer);
            assert_eq!(counts.rays, stream.len() as u64);
            counts.different as f64 / counts.rays as f64
        };
        let same = different(&recorded);
        assert!(same <= MOST_DIFFERENT, "{backend:?}: {same:.1e} differ");
        let other = different(&scene("glass"));
        assert!(other > 0.5, "{backend:?}: in another scene {other} differ");
    }
}
