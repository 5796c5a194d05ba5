//! The program as its users meet it: exit codes, messages, files.
#![allow(clippy::unwrap_used, reason = "a step that fails fails the test")]
#![allow(clippy::print_stderr, reason = "a test that is skipped says so")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use base64::Engine;
use etendue::image_io::{Image, Value, read_exr};
use serde_json::{Value as Json, json};
use tempfile::TempDir;

fn etendue(arguments: &str, folder: &Path) -> Output {
    command(arguments, folder).output().unwrap()
}

fn command(arguments: &str, folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_etendue"));
    command
        .args(arguments.split_whitespace())
        .current_dir(folder)
        .env_remove("RUST_LOG")
        .env_remove("RUST_BACKTRACE");
    command
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

/// Names in a folder.
fn list(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<_> = entries
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

// --- without a device ---------------------------------------------------------

#[test]
fn what_cannot_be_meant_is_a_usage_error() {
    let folder = tempfile::tempdir().unwrap();
    let cases = [
        ("", "Usage"),
        ("paint scene.gltf", "paint"),
        ("render scene.gltf", "--output"),
        ("render -o a.exr", "<SCENE>"),
        ("render s.gltf -o a.exr --spp 0", "--spp"),
        ("render s.gltf -o a.exr --spp 4 --samples 0..4", "--samples"),
        ("render s.gltf -o a.exr --samples 4..4", "A must be below B"),
        ("render s.gltf -o a.exr --samples 4", "two sample indices"),
        ("render s.gltf -o a.exr --time 0", "above 0"),
        ("render s.gltf -o a.exr --time nan", "above 0"),
        ("render s.gltf -o a.exr --noise -1", "above 0"),
        ("render s.gltf -o a.exr --width 0", "--width"),
        ("render s.gltf -o a.exr --height 65537", "--height"),
        ("render s.gltf -o a.exr --crop 0,0,5", "four pixel"),
        ("render s.gltf -o a.exr --crop 5,0,5,5", "X0 must be"),
        ("render s.gltf -o a.exr --aov beauty", "albedo"),
        ("render s.gltf -o a.png --aov albedo", "PNG has no layers"),
        ("render s.gltf -o a.exr --tonemap filmic", "pbr-neutral"),
        ("render s.gltf -o a.exr --backend metal", "ray-query"),
        ("render s.gltf -o a.exr --estimator half", "textbook"),
        ("render s.gltf -o a.exr --progress loud", "json"),
        ("render s.gltf -o a.exr --env-rotation 5", "--env"),
        ("render s.gltf -o a.exr -q -v", "--quiet"),
        ("render s.gltf -o a.jpg", ".exr or .png"),
        ("render s.gltf -o exr", ".exr or .png"),
        ("render s.gltf -o missing/a.exr", "missing/a.exr"),
        ("render s.gltf -o a.exr --stats no/a.json", "no/a.json"),
    ];
    for (line, part) in cases {
        let output = etendue(line, folder.path());
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{line}: {message}");
        assert!(message.contains(part), "{line}: {message}");
        assert!(output.stdout.is_empty(), "{line}");
        assert!(!message.contains("panicked"), "{line}: {message}");
    }
    assert!(list(folder.path()).is_empty());
}

#[test]
fn help_and_version_are_data() {
    let folder = tempfile::tempdir().unwrap();
    for (line, part) in [
        ("--version", env!("CARGO_PKG_VERSION")),
        ("--help", "render"),
        ("render --help", "--env-rotation"),
    ] {
        let output = etendue(line, folder.path());
        assert_eq!(output.status.code(), Some(0), "{line}");
        assert!(stdout(&output).contains(part), "{line}");
        assert!(output.stderr.is_empty(), "{line}");
    }
}

#[test]
fn a_bad_scene_has_its_own_code_and_one_line_per_cause() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("broken.gltf"), "{ \"asset\": ").unwrap();
    for name in ["missing.gltf", "broken.gltf"] {
        for line in [
            format!("render {name} -o a.exr -o a.png --stats a.json"),
            format!("info {name}"),
        ] {
            let output = etendue(&line, folder.path());
            let message = stderr(&output);
            assert_eq!(output.status.code(), Some(3), "{line}: {message}");
            assert!(message.starts_with("error: "), "{message}");
            assert!(message.contains(name), "{message}");
            for line in message.lines() {
                let known = ["error: ", "caused by: "];
                assert!(known.iter().any(|k| line.starts_with(k)), "{message}");
            }
            assert!(output.stdout.is_empty());
        }
    }
    assert_eq!(list(folder.path()), ["broken.gltf"]);
}

// --- with a device ------------------------------------------------------------

/// Whether a device can render; where there is none, says so, or fails if one is required.
fn has_device() -> bool {
    let output = etendue("info", Path::new("."));
    match output.status.code() {
        Some(0) => true,
        Some(4) => {
            let required = std::env::var_os("ETENDUE_REQUIRE_DEVICE");
            let required = required.is_some_and(|value| value == "1");
            assert!(!required, "no device: {}", stderr(&output));
            eprintln!("skipped: {}", stderr(&output));
            false
        }
        _ => panic!("info fails: {}", stderr(&output)),
    }
}

/// Radiance of the surroundings.
const SKY: [f32; 3] = [0.5, 0.625, 0.75];

/// A white square of 2 m in a constant surrounding, seen by two cameras: `wide`
/// (2:1), which also sees past it, and `close`, which sees nothing but the square.
fn scene() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let mut bytes = Vec::new();
    for corner in [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0_f32]] {
        for value in [corner[0], corner[1], 0.0] {
            bytes.extend(value.to_le_bytes());
        }
    }
    for index in [0, 1, 2, 0, 2, 3_u16] {
        bytes.extend(index.to_le_bytes());
    }
    let data = base64::engine::general_purpose::STANDARD.encode(&bytes);
    let camera = |yfov: f32, aspect: f32| {
        json!({
            "type": "perspective",
            "perspective": { "yfov": yfov, "aspectRatio": aspect, "znear": 0.01 }
        })
    };
    let scene = json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "extensionsUsed": ["ETENDUE_environment", "VENDOR_unknown"],
        "scenes": [{
            "nodes": [0, 1, 2],
            "extensions": { "ETENDUE_environment": { "radiance": SKY } }
        }],
        "nodes": [
            { "name": "square", "mesh": 0 },
            { "name": "wide", "camera": 0, "translation": [0, 0, 3] },
            { "name": "close", "camera": 1, "translation": [0, 0, 1] }
        ],
        "cameras": [camera(1.0, 2.0), camera(0.5, 1.0)],
        "meshes": [{ "primitives": [{
            "attributes": { "POSITION": 0 }, "indices": 1, "material": 0
        }] }],
        "materials": [{ "pbrMetallicRoughness": {
            "baseColorFactor": [0.5, 0.5, 0.5, 1], "metallicFactor": 0, "roughnessFactor": 1
        } }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3",
              "min": [-1, -1, 0], "max": [1, 1, 0] },
            { "bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR" }
        ],
        "bufferViews": [
            { "buffer": 0, "byteLength": 48 },
            { "buffer": 0, "byteOffset": 48, "byteLength": 12 }
        ],
        "buffers": [{
            "byteLength": 60,
            "uri": format!("data:application/octet-stream;base64,{data}")
        }]
    });
    fs::write(folder.path().join("scene.gltf"), scene.to_string()).unwrap();
    folder
}

/// Renders the scene; fails the test unless that works.
fn render(folder: &TempDir, options: &str) -> Output {
    let line = format!("render scene.gltf {options}");
    let output = etendue(&line, folder.path());
    assert!(output.status.success(), "{line}: {}", stderr(&output));
    assert!(output.stdout.is_empty(), "{line} writes to stdout");
    output
}

fn read(folder: &TempDir, name: &str) -> Image {
    read_exr(&folder.path().join(name)).unwrap()
}

fn text<'a>(image: &'a Image, name: &str) -> &'a str {
    match &image.metadata[name] {
        Value::Text(text) => text,
        Value::Number(number) => panic!("{name} is the number {number}"),
    }
}

fn number(image: &Image, name: &str) -> f64 {
    match &image.metadata[name] {
        Value::Number(number) => *number,
        Value::Text(text) => panic!("{name} is the text {text}"),
    }
}

#[test]
fn a_render_writes_every_output_with_its_header() {
    if !has_device() {
        return;
    }
    let folder = scene();
    let options = "-o a.exr -o a.png --spp 16 --width 32 --seed 18446744073709551615 \
                   --aov albedo,normal,depth,coverage,stderr,samples --exposure -1 --max-depth 2";
    let output = render(&folder, options);
    assert_eq!(list(folder.path()), ["a.exr", "a.png", "scene.gltf"]);
    // piped, progress is plain lines
    let messages = stderr(&output);
    assert!(!messages.contains('\r') && !messages.contains('\u{1b}'));
    assert!(messages.contains("16/16 samples (100 %)"), "{messages}");
    // what the file asks for and does not get is said once
    assert_eq!(messages.matches("VENDOR_unknown").count(), 1, "{messages}");

    let image = read(&folder, "a.exr");
    assert_eq!((image.full, image.size()), ((32, 16), (32, 16)));
    assert_eq!(text(&image, "version"), env!("CARGO_PKG_VERSION"));
    assert_eq!(text(&image, "scene"), "scene.gltf");
    assert_eq!(text(&image, "scene_hash").len(), 64);
    assert_eq!(text(&image, "settings.seed"), "18446744073709551615");
    assert_eq!(number(&image, "settings.max_depth"), 2.0);
    assert_eq!(text(&image, "settings.estimator"), "full");
    assert_eq!(text(&image, "samples"), "0..16");
    assert_eq!(number(&image, "spp"), 16.0);
    assert_eq!(text(&image, "ledger.stop"), "samples");
    assert_eq!(number(&image, "ledger.non_finite"), 0.0);
    assert!(number(&image, "times.render") > 0.0);
    for name in ["backend", "device", "driver", "settings.backend"] {
        assert!(!text(&image, name).is_empty(), "{name}");
    }

    // the first pixel sees the surroundings and nothing else
    let first = |name: &str| image.channel(name).unwrap()[0];
    assert_eq!(["R", "G", "B"].map(first), SKY);
    assert_eq!(first("stderr.R"), 0.0);
    assert_eq!(first("coverage"), 0.0);
    assert_eq!(first("depth.Z"), f32::INFINITY);
    assert_eq!(first("samples"), 16.0);
    // the middle sees the square from 3 m, within a pixel's width of the axis
    let middle = |name: &str| image.channel(name).unwrap()[8 * 32 + 16];
    assert_eq!(middle("coverage"), 1.0);
    assert!((middle("depth.Z") - 3.0).abs() < 0.05);
    assert!((middle("normal.Z") - 1.0).abs() < 1e-4);
    assert!(middle("stderr.G") > 0.0);

    let png = image::open(folder.path().join("a.png")).unwrap().to_rgb8();
    assert_eq!(png.dimensions(), (32, 16));
    // half of 0.5, 0.625, 0.75 in sRGB: 0.5371, 0.5948, 0.6461
    assert_eq!(png.get_pixel(0, 0).0, [137, 152, 165]);
}

#[test]
fn a_crop_has_the_pixels_of_the_frame() {
    if !has_device() {
        return;
    }
    let folder = scene();
    render(&folder, "-o full.exr --spp 8 --width 40 --height 20");
    let crop = "--crop 13,3,30,19";
    render(
        &folder,
        &format!("-o crop.exr --spp 8 --width 40 --height 20 {crop}"),
    );
    let (full, crop) = (read(&folder, "full.exr"), read(&folder, "crop.exr"));
    let window = crop.window;
    assert_eq!(
        (window.x0, window.y0, window.x1, window.y1),
        (13, 3, 30, 19)
    );
    assert_eq!(crop.full, (40, 20));
    assert_eq!(text(&crop, "settings.crop"), "13,3,30,19");
    let (full, crop) = (full.rgb().unwrap(), crop.rgb().unwrap());
    for y in 3..19 {
        for x in 13..30 {
            assert_eq!(full[y * 40 + x], crop[(y - 3) * 17 + x - 13], "{x}, {y}");
        }
    }
    let output = etendue(
        "render scene.gltf -o a.exr --width 40 --crop 0,0,41,1",
        folder.path(),
    );
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("--crop"));
}

#[test]
fn the_seed_decides_the_pixels() {
    if !has_device() {
        return;
    }
    let folder = scene();
    for (name, seed) in [("a", 1), ("b", 1), ("c", 2)] {
        let options = format!("-o {name}.exr --spp 8 --width 16 --seed {seed} --camera close");
        render(&folder, &options);
    }
    let pixels = |name: &str| read(&folder, name).channels;
    assert!(pixels("a.exr") == pixels("b.exr"));
    assert!(pixels("a.exr") != pixels("c.exr"));
}

#[test]
fn cameras_are_found_by_name_and_index() {
    if !has_device() {
        return;
    }
    let folder = scene();
    for (name, camera) in [("a", "close"), ("b", "1"), ("c", "0")] {
        render(
            &folder,
            &format!("-o {name}.exr --spp 1 --width 16 --camera {camera}"),
        );
    }
    let (a, b, c) = (
        read(&folder, "a.exr"),
        read(&folder, "b.exr"),
        read(&folder, "c.exr"),
    );
    assert_eq!((a.full, c.full), ((16, 16), (16, 8)));
    assert!(a.channels == b.channels);
    let output = etendue("render scene.gltf -o d.exr --camera far", folder.path());
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("wide, close"));
}

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

    // the noise of one sample here is below the signal: 16 samples are enough, and needed
    let options = "-o noise.exr --camera close --noise 1 --aov stderr";
    render(&folder, &format!("{options} {many}"));
    let image = read(&folder, "noise.exr");
    assert_eq!(text(&image, "ledger.stop"), "noise 1");
    let spp = number(&image, "spp");
    assert!((16.0..1e6).contains(&spp), "{spp}");
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

    let output = render(&folder, "-o a.exr --width 8 --time 1000 --height 8");
    assert!(stderr(&output).contains("--spp raises it"));
    assert_eq!(number(&read(&folder, "a.exr"), "spp"), 128.0);
}

#[test]
fn statistics_have_the_promised_names() {
    if !has_device() {
        return;
    }
    let folder = scene();
    let options = "-o a.exr --spp 4 --width 16 --stats s.json --seed 18446744073709551615 \
                   --samples 5..9";
    render(&folder, &options.replace("--spp 4 ", ""));
    let stats = fs::read(folder.path().join("s.json")).unwrap();
    let stats: Json = serde_json::from_slice(&stats).unwrap();
    assert_eq!(stats["schema"], 1);
    assert_eq!(stats["version"], env!("CARGO_PKG_VERSION"));
    assert_eq!(stats["scene"], "scene.gltf");
    assert_eq!(stats["spp"], 4);
    assert_eq!(stats["samples"], "5..9");
    assert_eq!(stats["settings"]["seed"], u64::MAX);
    assert_eq!(stats["settings"]["width"], 16);
    assert!(stats["features"].is_array());
    for name in ["backend", "device", "driver"] {
        assert!(stats[name].is_string(), "{name}");
    }
    let mut parts = 0.0;
    for name in ["load", "build", "compile", "render", "write"] {
        let seconds = stats["times"][name].as_f64().unwrap();
        assert!(seconds >= 0.0, "{name}");
        parts += seconds;
    }
    let total = stats["times"]["total"].as_f64().unwrap();
    assert!(parts <= total, "{parts} s of {total} s");
    let render = stats["times"]["render"].as_f64().unwrap();
    let paths = stats["paths_per_second"].as_f64().unwrap() * render;
    assert!((paths - 4.0 * 16.0 * 8.0).abs() < 0.5, "{paths} paths");
    assert!(stats["rays_per_second"].as_f64().unwrap() > 0.0);
    for name in ["geometry", "acceleration", "textures", "film"] {
        assert!(stats["memory"][name].is_u64(), "{name}");
    }
    for name in ["non_finite", "truncated_paths"] {
        assert_eq!(stats["ledger"][name], 0, "{name}");
    }
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

/// Reads progress until a sample is finished.
fn wait_for_samples(child: &mut std::process::Child) {
    use std::io::{BufRead, BufReader};
    let mut lines = BufReader::new(child.stderr.take().unwrap());
    loop {
        let mut line = String::new();
        assert!(lines.read_line(&mut line).unwrap() > 0, "ended early");
        let event: Json = serde_json::from_str(&line).unwrap();
        if event["event"] == "progress" && event["samples"].as_u64().unwrap() > 0 {
            break;
        }
    }
    child.stderr = Some(lines.into_inner());
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

#[test]
fn info_describes_devices_and_scenes() {
    if !has_device() {
        return;
    }
    let folder = scene();
    let output = etendue("info scene.gltf --json", folder.path());
    assert!(output.status.success(), "{}", stderr(&output));
    let info: Json = serde_json::from_str(&stdout(&output)).unwrap();
    let device = &info["devices"][0];
    assert_eq!(device["index"], 0);
    for name in ["name", "kind", "driver", "api_version"] {
        assert!(!device[name].as_str().unwrap().is_empty(), "{name}");
    }
    for backend in ["ray-query", "bvh"] {
        let support = &device["backends"][backend];
        // what is not available says why
        assert_eq!(
            support["available"].as_bool().unwrap(),
            support["lacks"].is_null(),
            "{backend}"
        );
    }
    let scene = &info["scene"];
    let counts = [
        ("meshes", 1),
        ("instances", 1),
        ("triangles", 2),
        ("materials", 1),
        ("textures", 0),
        ("lights", 0),
        ("cameras", 2),
    ];
    for (name, count) in counts {
        assert_eq!(scene["counts"][name], count, "{name}");
    }
    assert_eq!(scene["cameras"], json!(["wide", "close"]));
    assert_eq!(scene["bounds"], json!([[-1.0, -1.0, 0.0], [1.0, 1.0, 0.0]]));
    assert!(scene["features"].as_object().unwrap().len() > 1);
    assert!(scene["bytes_per_triangle"].as_f64().unwrap() > 0.0);
    assert!(scene["memory"]["film"].is_u64());

    let output = etendue("info scene.gltf", folder.path());
    for part in ["scene.gltf", "triangles", "wide", "device 0", "bvh"] {
        assert!(stdout(&output).contains(part), "{part}");
    }
}

/// `--env` replaces what the scene has, scaled and turned.
#[test]
fn an_environment_file_lights_the_scene() {
    if !has_device() {
        return;
    }
    let folder = scene();
    // 4 × 2 texels, constant: the background must be intensity times value
    let window = etendue::settings::Crop {
        x0: 0,
        y0: 0,
        x1: 4,
        y1: 2,
    };
    let channels = ["R", "G", "B"].iter().zip([1.0, 2.0, 4.0]);
    let sky = Image {
        window,
        full: (4, 2),
        channels: channels
            .map(|(name, value)| etendue::image_io::Channel {
                name: (*name).to_owned(),
                values: vec![value; 8],
            })
            .collect(),
        metadata: etendue::image_io::Metadata::new(),
    };
    let path: PathBuf = folder.path().join("sky.exr");
    etendue::image_io::write_exr(&path, &sky).unwrap();
    let options =
        "-o a.exr --spp 2 --width 16 --env sky.exr --env-intensity 0.5 --env-rotation -90";
    render(&folder, options);
    let image = read(&folder, "a.exr");
    let first = ["R", "G", "B"].map(|name| image.channel(name).unwrap()[0]);
    assert_eq!(first, [0.5, 1.0, 2.0]);
    assert_eq!(number(&image, "settings.env_rotation"), -90.0);
    assert_eq!(text(&image, "settings.env_hash").len(), 64);

    let output = etendue("render scene.gltf -o b.exr --env none.exr", folder.path());
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    assert!(stderr(&output).contains("none.exr"));
}
