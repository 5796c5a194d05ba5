//! What a render writes.

use std::fs;

use etendue::image_io::{Channel, Image, Metadata, write_exr};
use etendue::settings::Crop;
use serde_json::Value as Json;

use super::support::{
    SKY, command, etendue, has_device, list, number, read, render, scene, stderr, text,
};

#[test]
fn a_render_writes_every_output_with_its_header() {
    if !has_device() {
        return;
    }
    let folder = scene();
    let options = "-o a.exr -o a.png --spp 16 --width 32 --seed 18446744073709551615 \
                   --aov albedo,normal,depth,coverage,stderr,samples,instance,material --exposure -1 --max-depth 2";
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
    assert_eq!(["instance", "material"].map(first), [-1.0; 2]);
    // the middle sees the square from 3 m, within a pixel's width of the axis
    let middle = |name: &str| image.channel(name).unwrap()[8 * 32 + 16];
    assert_eq!(middle("coverage"), 1.0);
    assert_eq!(["instance", "material"].map(middle), [0.0; 2]);
    assert!((middle("depth.Z") - 3.0).abs() < 0.05);
    assert!((middle("normal.Z") - 1.0).abs() < 1e-4);
    // at the edges of the square samples differ
    assert!(image.channel("stderr.G").unwrap().iter().any(|&e| e > 0.0));

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
fn a_kept_tree_changes_no_pixel() {
    if !has_device() {
        return;
    }
    let folder = scene();
    let trees = folder.path().join("kept/trees");
    let pixels = |name: &str, extra: &str| {
        render(
            &folder,
            &format!("-o {name} --spp 4 --width 16 --backend bvh {extra}"),
        );
        read(&folder, name).channels
    };
    let plain = pixels("a.exr", "");
    let line = "render scene.gltf -o b.exr --width 16 --backend bvh --cache kept/trees --dry-run";
    assert!(etendue(line, folder.path()).status.success());
    assert!(!trees.exists(), "a dry run writes nothing");
    assert!(pixels("b.exr", "--cache kept/trees") == plain);
    let [name] = &list(&trees)[..] else {
        panic!("one file: {:?}", list(&trees));
    };
    assert!(pixels("c.exr", "--cache kept/trees") == plain);
    // What is damaged is built, and what cannot be kept is said.
    fs::write(trees.join(name), "damaged").unwrap();
    assert!(pixels("d.exr", "--cache kept/trees") == plain);
    let folder_is_a_file = "-o e.exr --spp 4 --width 16 --backend bvh --cache scene.gltf";
    let output = render(&folder, folder_is_a_file);
    let messages = stderr(&output);
    assert!(
        messages.contains("not kept for later renders"),
        "{messages}"
    );
    assert!(read(&folder, "e.exr").channels == plain);
}

#[test]
fn the_seed_decides_the_pixels() {
    if !has_device() {
        return;
    }
    let folder = scene();
    for (name, seed) in [("a", 1), ("b", 1), ("c", 2)] {
        let options = format!("-o {name}.exr --spp 8 --width 16 --seed {seed}");
        render(&folder, &options);
    }
    let pixels = |name: &str| read(&folder, name).channels;
    assert!(pixels("a.exr") == pixels("b.exr"));
    assert!(pixels("a.exr") != pixels("c.exr"));
}

/// Mesa's driver for CPUs takes its width from the environment, which the program sets where it knows better. The kernels
/// of a width have a folder of their own, since the driver would mix them up.
#[test]
fn vectors_of_any_width_give_the_same_bits() {
    if !has_device() {
        return;
    }
    let folder = scene();
    let veach = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/veach.gltf");
    let run = |kernels: &str, width: Option<&str>| {
        let line = "render -o a.exr --spp 4 --width 24 --backend bvh --stats a.json";
        let mut command = command(line, folder.path());
        command
            .arg(veach)
            .env("MESA_SHADER_CACHE_DIR", folder.path().join(kernels))
            .env_remove("LP_NATIVE_VECTOR_WIDTH");
        if let Some(width) = width {
            command.env("LP_NATIVE_VECTOR_WIDTH", width);
        }
        let output = command.output().unwrap();
        assert!(output.status.success(), "{}", stderr(&output));
        let stats = fs::read(folder.path().join("a.json")).unwrap();
        let stats: Json = serde_json::from_slice(&stats).unwrap();
        let device = stats["device"].as_str().unwrap().to_owned();
        (device, read(&folder, "a.exr").channels)
    };
    let (device, pixels) = run("own", None);
    if !device.starts_with("llvmpipe") {
        eprintln!("skipped: {device} is not Mesa's driver for CPUs");
        return;
    }
    #[cfg(target_arch = "x86_64")]
    let is_wide = is_x86_feature_detected!("avx512fp16") && !is_x86_feature_detected!("sse4a");
    #[cfg(not(target_arch = "x86_64"))]
    let is_wide = false;
    assert_eq!(device.contains("512 bits"), is_wide, "{device}");
    let kept = folder.path().join("own/etendue-512-bits");
    assert_eq!(kept.exists(), is_wide, "{}", kept.display());
    for width in ["256", "512"] {
        let (device, again) = run(width, Some(width));
        assert!(device.contains(&format!("{width} bits")), "{device}");
        assert_eq!(
            list(&folder.path().join(width)).len(),
            1,
            "no folder within"
        );
        assert!(again == pixels, "{width} bits");
    }
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
    for name in ["non_finite", "truncated_paths", "truncated_throughput"] {
        assert_eq!(stats["ledger"][name].as_f64(), Some(0.0), "{name}");
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
    let window = Crop {
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
            .map(|(name, value)| Channel {
                name: (*name).to_owned(),
                values: vec![value; 8],
            })
            .collect(),
        metadata: Metadata::new(),
    };
    let path = folder.path().join("sky.exr");
    write_exr(&path, &sky).unwrap();
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
