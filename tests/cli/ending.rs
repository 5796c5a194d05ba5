//! How a render ends: limits, signals, failures; and what is said on the way.

use std::fs;
use std::process::{Command, Stdio};

use serde_json::{Value as Json, json};

use super::support::{
    command, etendue, has_device, list, number, read, render, scene, stderr, text, wait_for_samples,
};

#[test]
fn limits_end_a_render_and_stand_in_the_header() {
    if !has_device() {
        return;
    }
    let folder = scene();
    let many = "--spp 100000000 --width 16";
    render(&folder, &format!("-o time.exr {many} --time 0.3"));
    let image = read(&folder, "time.exr");
    assert_eq!(text(&image, "ledger.stop"), "time 0.3");
    let spp = number(&image, "spp");
    assert!((1.0..1e8).contains(&spp), "{spp}");
    assert_eq!(text(&image, "settings.samples"), "0..100000000");

    // the noise of one sample here is below the signal: the fewest samples are enough, two nets
    let options = "-o noise.exr --noise 1 --aov stderr";
    render(&folder, &format!("{options} {many}"));
    let image = read(&folder, "noise.exr");
    assert_eq!(text(&image, "ledger.stop"), "noise 1");
    let spp = number(&image, "spp");
    assert_eq!(spp, 32.0);
    let square = |name: &str| -> f64 {
        let values = image.channel(name).unwrap().iter();
        values.map(|&v| f64::from(v) * f64::from(v)).sum()
    };
    let noise: f64 = ["stderr.R", "stderr.G", "stderr.B"]
        .map(square)
        .iter()
        .sum();
    let signal: f64 = ["R", "G", "B"].map(square).iter().sum();
    assert!(noise <= signal, "{noise} {signal}");

    // they are those of `--spp`: what decided their number is no part of the picture
    render(&folder, "-o spp.exr --aov stderr --width 16 --spp 32");
    let plain = read(&folder, "spp.exr");
    for name in ["R", "G", "B", "stderr.G"] {
        assert!(image.channel(name) == plain.channel(name), "{name}");
    }

    let output = render(&folder, "-o a.exr --width 8 --time 1000 --height 8");
    assert!(stderr(&output).contains("--spp raises it"));
    assert_eq!(number(&read(&folder, "a.exr"), "spp"), 128.0);
}

#[test]
fn progress_for_programs_is_json_and_quiet_is_quiet() {
    if !has_device() {
        return;
    }
    let folder = scene();
    let output = render(&folder, "-o a.exr --spp 4 --width 16 --progress json");
    let messages = stderr(&output);
    let events: Vec<Json> = messages
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    let last = |event: &str| events.iter().rfind(|e| e["event"] == event).unwrap();
    assert_eq!(last("progress")["samples"], 4);
    assert_eq!(last("progress")["fraction"], 1.0);
    assert_eq!(last("done")["outputs"], json!(["a.exr"]));

    let output = render(&folder, "-o a.exr --spp 4 --width 16 -q");
    assert_eq!(stderr(&output), "");
}

#[test]
fn a_failing_output_fails_the_render_but_not_the_others() {
    if !has_device() {
        return;
    }
    let folder = scene();
    // writable at the start, a folder at the end
    let mut child = command(
        "render scene.gltf -o a.exr -o b.png --spp 100000000 --time 2 --width 16 --progress json",
        folder.path(),
    )
    .stderr(Stdio::piped())
    .spawn()
    .unwrap();
    wait_for_samples(&mut child);
    fs::create_dir(folder.path().join("a.exr")).unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert_eq!(list(folder.path()), ["a.exr", "b.png", "scene.gltf"]);
    assert!(stderr(&output).contains("error: write a.exr"));
}

#[cfg(unix)]
#[test]
fn signals_stop_at_a_pass_and_keep_what_is_finished() {
    if !has_device() {
        return;
    }
    for signal in ["INT", "TERM"] {
        let folder = scene();
        let mut child = command(
            "render scene.gltf -o a.exr --spp 100000000 --width 16 --progress json --stats s.json",
            folder.path(),
        )
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
        wait_for_samples(&mut child);
        let sent = Command::new("sh")
            .args(["-c", &format!("kill -{signal} {}", child.id())])
            .status()
            .unwrap();
        assert!(sent.success());
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(130), "{}", stderr(&output));
        assert_eq!(list(folder.path()), ["a.exr", "s.json", "scene.gltf"]);
        let image = read(&folder, "a.exr");
        assert_eq!(text(&image, "ledger.stop"), "interrupt");
        let spp = number(&image, "spp");
        assert!((1.0..1e8).contains(&spp), "{spp}");
    }
}

/// Light near the end of fp32 reflects beyond it: such samples are dropped, counted in the header and in the statistics,
/// and too many of them fail the render, after its files are written.
#[test]
fn too_many_samples_that_are_not_finite_fail_the_render() {
    if !has_device() {
        return;
    }
    let folder = scene();
    let path = folder.path().join("scene.gltf");
    let mut scene: Json = serde_json::from_str(&fs::read_to_string(&path).unwrap()).unwrap();
    scene["scenes"][0]["extensions"]["ETENDUE_environment"]["radiance"] = json!([3e38, 0, 0]);
    scene["materials"][0]["emissiveFactor"] = json!([1, 1, 1]);
    let strength = json!({ "KHR_materials_emissive_strength": { "emissiveStrength": 3e38 } });
    scene["materials"][0]["extensions"] = strength;
    fs::write(&path, scene.to_string()).unwrap();
    let line =
        "render scene.gltf -o a.exr --stats a.json --spp 1 --width 16 --height 8 --camera wide";
    let failed = etendue(line, folder.path());
    let message = stderr(&failed);
    assert_eq!(failed.status.code(), Some(1), "{message}");
    assert!(message.contains("--max-dropped") && message.contains("not finite"));
    let image = read(&folder, "a.exr");
    let dropped = number(&image, "ledger.non_finite");
    // The square is in view, and not everywhere.
    assert!((1.0..128.0).contains(&dropped), "{dropped}");
    let red = image.channel("R").unwrap();
    assert!(red.iter().all(|v| v.is_finite()) && red.contains(&0.0));
    let statistics: Json =
        serde_json::from_str(&fs::read_to_string(folder.path().join("a.json")).unwrap()).unwrap();
    assert_eq!(statistics["ledger"]["non_finite"], json!(dropped as u64));

    // Whoever knows of them may allow them; they are still told.
    let allowed = etendue(&format!("{line} --max-dropped 1"), folder.path());
    assert_eq!(allowed.status.code(), Some(0));
    assert!(stderr(&allowed).contains("not finite"));
    println!("{dropped} of 128 samples dropped: exit code 1");

    // Pixel by pixel, whether in one go, from a checkpoint or from shards.
    let line = "render scene.gltf --width 16 --height 8 --camera wide --max-dropped 1 --aov dropped,samples -q";
    for run in [
        format!("{line} -o whole.exr --samples 0..12"),
        format!("{line} -o half.exr --spp 5 --checkpoint c"),
        format!("{line} -o resumed.exr --spp 12 --checkpoint c --resume"),
        format!("{line} -o a.exr --samples 0..5"),
        format!("{line} -o b.exr --samples 5..12"),
        String::from("merge b.exr a.exr -o merged.exr"),
    ] {
        let output = etendue(&run, folder.path());
        assert_eq!(output.status.code(), Some(0), "{run}: {}", stderr(&output));
    }
    let whole = read(&folder, "whole.exr");
    let counts = whole.channel("dropped").unwrap();
    for (count, mean) in counts.iter().zip(whole.channel("R").unwrap()) {
        assert!(
            *count < 12.0 || *mean == 0.0,
            "{count} of 12 dropped, mean {mean}"
        );
        assert!(*count >= 0.0 && *count <= 12.0 && count.fract() == 0.0);
    }
    assert!(counts.contains(&0.0) && counts.iter().any(|c| *c > 0.0));
    let total: f32 = counts.iter().sum();
    assert_eq!(f64::from(total), number(&whole, "ledger.non_finite"));
    for other in ["resumed.exr", "merged.exr"] {
        assert_eq!(read(&folder, other).channel("dropped").unwrap(), counts);
    }
    println!(
        "{total} of 1536 samples dropped, {} of 128 pixels",
        counts.iter().filter(|c| **c > 0.0).count()
    );
}

#[test]
fn an_unknown_device_is_named() {
    if !has_device() {
        return;
    }
    let folder = scene();
    let output = etendue(
        "render scene.gltf -o a.exr --device no-such-device",
        folder.path(),
    );
    assert!(
        matches!(output.status.code(), Some(2 | 4)),
        "{}",
        stderr(&output)
    );
    assert!(stderr(&output).contains("no-such-device"));
    assert_eq!(list(folder.path()), ["scene.gltf"]);
}
