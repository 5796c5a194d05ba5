//! What checkpoints cost is counted, and is little.

use etendue::checkpoint;
use etendue::film::Film;
use etendue::image_io::Metadata;
use etendue::settings::Settings;
use serde_json::Value as Json;
use tempfile::TempDir;

use super::support::{has_device, render, scene};

/// Checkpoints written on the way, seconds that they took, seconds of the render.
fn costs(folder: &TempDir, options: &str) -> (u64, f64, f64) {
    render(folder, &format!("-o a.exr --stats s.json -q {options}"));
    let text = std::fs::read(folder.path().join("s.json")).unwrap();
    let stats: Json = serde_json::from_slice(&text).unwrap();
    let time = |name: &str| stats["times"][name].as_f64().unwrap();
    let count = stats["checkpoints"].as_u64().unwrap();
    (count, time("checkpoints"), time("render"))
}

#[test]
fn the_cost_of_checkpoints_is_counted() {
    if !has_device() {
        return;
    }
    let folder = scene();
    let line = "--width 32 --spp 255";
    assert_eq!(costs(&folder, line).0, 0);
    let (count, seconds, render) = costs(
        &folder,
        &format!("{line} --checkpoint a.ck --checkpoint-interval 0"),
    );
    // one for each pass, and there are eight at least
    assert!(count >= 7, "{count}");
    assert!(seconds > 0.0 && seconds < render, "{seconds} of {render} s");
    let rare = "--checkpoint b.ck --checkpoint-interval 1e9";
    let (count, seconds, _) = costs(&folder, &format!("{line} {rare}"));
    // that of the end is no part of the render
    assert_eq!((count, seconds), (0, 0.0));
}

/// Seconds that this thread has worked: what others do on the machine does not count.
#[cfg(target_os = "linux")]
fn worked() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap();
    let nanoseconds: f64 = text.split(' ').next().unwrap().parse().unwrap();
    nanoseconds * 1e-9
}

/// The largest checkpoint of a picture of 1280 × 720, 31 samples in five nodes. The render waits for this thread, which
/// may not take more than a hundredth of ten seconds; the checksum is another thread's.
#[cfg(target_os = "linux")]
#[test]
fn a_checkpoint_takes_a_hundredth_of_ten_seconds() {
    let settings = Settings {
        width: 1280,
        height: 720,
        samples: 0..31,
        ..Settings::default()
    };
    let mut film = Film::of(&settings);
    let values = vec![0.7; film.pixels() * film.floats_per_pixel()];
    for (first, level) in [(0, 4), (16, 3), (24, 2), (28, 1), (30, 0)] {
        film.add(first, level, values.clone()).unwrap();
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("c.ck");
    let mut least = f64::MAX;
    for _ in 0..5 {
        let start = worked();
        checkpoint::write(&path, &Metadata::new(), &film).unwrap();
        least = least.min(worked() - start);
    }
    let bytes = std::fs::metadata(&path).unwrap().len();
    assert!(bytes > 36 * 5 * 1280 * 720, "{bytes}");
    eprintln!("{bytes} bytes in {least:.3} s");
    assert!(least <= 0.1, "{least} s");
}
