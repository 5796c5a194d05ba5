//! Memory is known before it is taken.

use etendue::Error;
use etendue::render::{self, DeviceOptions, Renderer, Tuning};
use etendue::scene::{Scene, gltf};
use etendue::settings::{BackendChoice, Settings};

use super::example;
use super::support::{etendue, has_device, scene, stderr, stdout};

fn settings(backend: BackendChoice) -> Settings {
    Settings {
        width: 320,
        height: 180,
        samples: 0..1,
        backend,
        ..Settings::default()
    }
}

fn open(
    scene: &Scene,
    settings: &Settings,
    device_bytes: Option<u64>,
) -> etendue::Result<Renderer> {
    let tuning = Tuning {
        device_bytes,
        ..Tuning::default()
    };
    Renderer::tuned(scene, settings, &DeviceOptions::default(), tuning)
}

fn assert_close(estimate: u64, taken: u64, about: &str) {
    let ratio = estimate as f64 / taken as f64;
    eprintln!("{about}: {estimate} of {taken} bytes, {ratio:.4}");
    assert!((ratio - 1.0).abs() <= 0.15, "{about}: {estimate} {taken}");
}

#[test]
fn estimates_are_what_is_taken() {
    if !has_device() {
        return;
    }
    // an environment map, many instances, many triangles that emit
    for name in ["sun", "instances", "veach"] {
        let scene = gltf::load(example(name).as_ref()).unwrap();
        let own = settings(BackendChoice::Bvh);
        let taken = open(&scene, &own, None).unwrap().device_memory().0;
        let model = render::model(&scene, &own).unwrap();
        assert_close(model.memory.total(), taken, name);
        let plan = render::plan(&scene, &own, &DeviceOptions::default()).unwrap();
        assert_close(plan.memory.total(), taken, name);
        assert!(plan.free > 0);
        // what the statistics say, with the device's structures
        let device = settings(BackendChoice::RayQuery);
        match open(&scene, &device, None) {
            Ok(renderer) => {
                let taken = renderer.device_memory().0;
                assert_close(renderer.report().memory.total(), taken, name);
            }
            Err(Error::Unsupported { what, missing }) => eprintln!("skipped: {what}: {missing}"),
            Err(error) => panic!("{error}"),
        }
    }
}

#[test]
fn what_has_no_room_is_refused_with_the_figure() {
    if !has_device() {
        return;
    }
    let scene = gltf::load(example("veach").as_ref()).unwrap();
    let settings = settings(BackendChoice::Bvh);
    let plan = render::plan(&scene, &settings, &DeviceOptions::default());
    let needed = plan.unwrap().memory.total();
    assert!(open(&scene, &settings, Some(needed)).is_ok());
    match open(&scene, &settings, Some(needed - 1)).map(drop) {
        Err(Error::OutOfMemory { what, bytes }) => {
            assert_eq!(bytes, needed);
            assert!(what.contains(&(needed - 1).to_string()), "{what}");
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_dry_run_says_what_a_render_takes() {
    if !has_device() {
        return;
    }
    let folder = scene();
    let output = etendue(
        "render scene.gltf -o a.exr --width 64 --dry-run",
        folder.path(),
    );
    assert!(output.status.success(), "{}", stderr(&output));
    let text = stdout(&output);
    for part in [
        "device memory",
        "film 72.0 KiB",
        "film on host",
        "samples        0..128",
    ] {
        assert!(text.contains(part), "{part} is not in {text}");
    }
    assert!(!folder.path().join("a.exr").exists());
    // 65536² pixels: more than a hundred gigabytes on the host
    if cfg!(target_os = "linux") {
        let line = "render scene.gltf -o a.exr --width 65536 --height 65536 --aov albedo --spp 1";
        let output = etendue(line, folder.path());
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(1), "{message}");
        assert!(
            message.contains("host memory free, needs 927712935936 bytes"),
            "{message}"
        );
    }
}
