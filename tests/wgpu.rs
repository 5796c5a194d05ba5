//! Through wgpu: the same pictures as by our own Vulkan code, by each of the four ways.
//! Only in builds with the feature `wgpu`.
#![allow(
    clippy::unwrap_used,
    reason = "the lint's exception for tests does not reach their helpers"
)]
#![allow(clippy::print_stdout, reason = "a skipped test says why")]

use std::path::Path;

use etendue::Error;
use etendue::film::Film;
use etendue::render::{Control, DeviceOptions, Renderer, Tuning};
use etendue::scene::gltf;
use etendue::settings::{BackendChoice, Settings};

const SIDE: u32 = 40;
const SAMPLES: u64 = 16;
/// Rounding of other code for the same expressions, through a path of some twenty events.
const RELATIVE: f32 = 1e-4;
/// Share of pixels that may differ by more: a rounding that turns a choice sends a path elsewhere.
const TURNED: f64 = 0.01;

/// A renderer of one of `scenes/`; `None` and a printed reason, or a failure where
/// `ETENDUE_REQUIRE_DEVICE` is 1, without a device that can do it.
fn renderer(scene: &str, backend: BackendChoice) -> Option<Renderer> {
    tuned(scene, backend, Tuning::default())
}

fn tuned(scene: &str, backend: BackendChoice, tuning: Tuning) -> Option<Renderer> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let scene = gltf::load(&folder.join(format!("{scene}.gltf"))).unwrap();
    let settings = Settings {
        width: SIDE,
        height: SIDE,
        samples: 0..SAMPLES,
        backend,
        aovs: true,
        ..Settings::default()
    };
    let required = std::env::var_os("ETENDUE_REQUIRE_DEVICE").is_some();
    match Renderer::tuned(&scene, &settings, &DeviceOptions::default(), tuning) {
        Ok(renderer) => Some(renderer),
        Err(error @ Error::Unsupported { .. }) if !required => {
            println!("skipped: {error}");
            None
        }
        Err(error) => panic!("{}: {error}", backend.name()),
    }
}

fn film(renderer: &mut Renderer) -> Film {
    let film = renderer.render(&mut |_| Control::Continue).unwrap();
    assert_eq!(
        renderer.report().ledger.non_finite,
        0,
        "samples were dropped"
    );
    film
}

/// Same samples, so the same picture but for rounding.
fn assert_same_picture(ours: &Film, other: &Film, what: &str) {
    let pairs: Vec<(f32, f32)> = ours
        .mean()
        .into_iter()
        .zip(other.mean())
        .flat_map(|(a, b)| a.into_iter().zip(b))
        .collect();
    let differ = |&&(a, b): &&(f32, f32)| (a - b).abs() > RELATIVE * a.abs().max(b.abs());
    let share = pairs.iter().filter(differ).count() as f64 / pairs.len() as f64;
    assert!(share <= TURNED, "{what}: {share} of the values differ");
    let sum = |side: fn(&(f32, f32)) -> f32| pairs.iter().map(side).map(f64::from).sum::<f64>();
    let (a, b) = (sum(|p| p.0), sum(|p| p.1));
    assert!(a > 0.0, "{what}: black");
    assert!(
        (a - b).abs() <= TURNED * a,
        "{what}: {a} against {b} in all"
    );
    assert_eq!(ours.coverage(), other.coverage(), "{what}");
}

fn assert_same_by_all_ways(scene: &str) {
    let own_tree = BackendChoice::WGPU
        .iter()
        .filter(|way| **way != BackendChoice::WgpuRayQuery);
    for way in own_tree {
        assert_same(scene, BackendChoice::Bvh, *way, Tuning::default());
    }
    // the structures of wgpu's making hold what ours hold: boxes, or triangles
    for boxes in [true, false] {
        let tuning = Tuning {
            boxes: Some(boxes),
            ..Tuning::default()
        };
        let (native, way) = (BackendChoice::RayQuery, BackendChoice::WgpuRayQuery);
        assert_same(scene, native, way, tuning);
    }
}

fn assert_same(scene: &str, native: BackendChoice, way: BackendChoice, tuning: Tuning) {
    // no photons are traced through wgpu
    let tuning = Tuning {
        guide: false,
        ..tuning
    };
    let Some(mut native) = tuned(scene, native, tuning) else {
        return;
    };
    let ours = film(&mut native);
    let rays = native.report().rays as f64;
    let mut through = tuned(scene, way, tuning).expect("wgpu offers what Vulkan does");
    let what = format!("{scene} by {}", way.name());
    assert_same_picture(&ours, &film(&mut through), &what);
    let deviation = through.report().rays as f64 / rays - 1.0;
    assert!(deviation.abs() < TURNED, "{what}: rays off by {deviation}");
    assert_eq!(through.report().backend, way);
}

#[test]
fn cornell_box_is_the_same() {
    assert_same_by_all_ways("cornell");
}

#[test]
fn glass_is_the_same() {
    assert_same_by_all_ways("glass");
}

#[test]
fn instances_are_the_same() {
    assert_same_by_all_ways("instances");
}

#[test]
fn cut_outs_are_the_same() {
    assert_same_by_all_ways("lights");
}

#[test]
fn fog_is_the_same() {
    assert_same_by_all_ways("fog");
}

#[test]
fn environment_map_is_the_same() {
    assert_same_by_all_ways("sun");
}

#[test]
fn another_seed_takes_effect() {
    let Some(mut native) = renderer("cornell", BackendChoice::Bvh) else {
        return;
    };
    let first = film(&mut native);
    native.restart(8..24, 7).unwrap();
    let ours = film(&mut native);
    assert_ne!(first.mean(), ours.mean());
    let mut through = renderer("cornell", BackendChoice::WgpuSpirv).unwrap();
    film(&mut through);
    through.restart(8..24, 7).unwrap();
    assert_same_picture(&ours, &film(&mut through), "after a restart");
}
