//! Many renders in one process need no more memory than one.
#![cfg(target_os = "linux")]

use std::fs;

use etendue::render::{Control, DeviceOptions, Renderer};
use etendue::scene::{Scene, gltf};
use etendue::settings::{BackendChoice, Settings};

use super::support::{has_device, scene};
use super::{example, rounds};

/// Resident memory of this process, bytes.
fn resident() -> f64 {
    let text = fs::read_to_string("/proc/self/statm").unwrap();
    let pages: f64 = text.split(' ').nth(1).unwrap().parse().unwrap();
    pages * 4096.0
}

/// Slope of the line of least squares through the values at 0, 1, 2 …
fn slope(values: &[f64]) -> f64 {
    let count = values.len() as f64;
    let (middle, mean) = ((count - 1.0) / 2.0, values.iter().sum::<f64>() / count);
    let at = |i: usize| i as f64 - middle;
    let product = |(i, value): (usize, &f64)| at(i) * (value - mean);
    let products: f64 = values.iter().enumerate().map(product).sum();
    products / (0..values.len()).map(|i| at(i) * at(i)).sum::<f64>()
}

#[test]
fn slopes_are_those_of_lines() {
    let line: Vec<f64> = (0..20).map(|i| 7.0 - 3.0 * f64::from(i)).collect();
    assert!((slope(&line) + 3.0).abs() < 1e-12);
}

fn open(scene: &Scene, backend: BackendChoice) -> Renderer {
    let settings = Settings {
        width: 16,
        height: 16,
        samples: 0..2,
        backend,
        ..Settings::default()
    };
    Renderer::new(scene, &settings, &DeviceOptions::default()).unwrap()
}

/// Resident memory, bytes, and device memory after renders, of which the first are left
/// out: until then the allocator of the process and the driver's compiler grow.
fn growth(first: u64, count: u64, render: &mut dyn FnMut() -> (u64, u64)) -> (f64, f64) {
    let device = render();
    let mut held = Vec::new();
    for round in 1..first + count {
        assert_eq!(render(), device, "device memory of render {round}");
        if round >= first {
            held.push(resident());
        }
    }
    let range = held
        .iter()
        .fold((f64::MAX, 0.0_f64), |(low, high), &bytes| {
            (low.min(bytes), high.max(bytes))
        });
    (slope(&held), range.1 - range.0)
}

/// A device of its own for each: opened, a kernel compiled, closed.
#[test]
fn devices_that_come_and_go_leave_nothing() {
    if !has_device() {
        return;
    }
    let folder = scene();
    let scene = gltf::load(&folder.path().join("scene.gltf")).unwrap();
    let (first, count) = (rounds(12, 500), rounds(16, 1000));
    // What is left of a device or a pipeline is some hundred KiB; by day the process is
    // still growing into its memory, which takes it up to 500 rounds. A night's bound is 1 MiB in a thousand renders.
    let bound = if count < 1000 { 512e3 } else { 1e3 };
    let (slope, range) = growth(first, count, &mut || {
        let mut renderer = open(&scene, BackendChoice::Auto);
        renderer.render(&mut |_| Control::Continue).unwrap();
        renderer.device_memory()
    });
    eprintln!("{count} devices: {slope:.0} bytes a render, range {range:.0} bytes");
    assert!(slope < bound, "{slope} bytes a render");
}

/// One device, many renders.
#[test]
fn renders_leave_nothing() {
    if !has_device() {
        return;
    }
    let scene = gltf::load(example("cornell").as_ref()).unwrap();
    let mut renderer = open(&scene, BackendChoice::Bvh);
    let mut seed = 0;
    let (slope, range) = growth(100, rounds(400, 2000), &mut || {
        seed += 1;
        renderer.restart(0..2, seed).unwrap();
        renderer.render(&mut |_| Control::Continue).unwrap();
        renderer.device_memory()
    });
    eprintln!("one device: {slope:.1} bytes a render, range {range:.0} bytes");
    // a page more in so many renders
    assert!(slope < 64.0, "{slope} bytes a render");
}
