//! Files of another render are refused, and the message names what differs.

use etendue::checkpoint;
use etendue::image_io::{Image, Value, read_exr, write_exr};
use tempfile::TempDir;

use super::support::{etendue, has_device, list, read, render, scene, stderr};

const JOB: [&str; 14] = [
    "version",
    "build",
    "scene_hash",
    "settings.width",
    "settings.height",
    "settings.crop",
    "settings.seed",
    "settings.max_depth",
    "settings.estimator",
    "settings.strategy",
    "settings.camera",
    "settings.env_hash",
    "settings.env_intensity",
    "settings.env_rotation",
];
const DEVICE: [&str; 3] = ["backend", "device", "driver"];

/// Runs what must be refused with code 2, by a message that has all the words.
fn refused(folder: &TempDir, line: &str, words: &[&str]) {
    let output = etendue(line, folder.path());
    let message = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{line}: {message}");
    for word in words {
        assert!(message.contains(word), "{line}: {word} in {message}");
    }
    assert!(
        !list(folder.path()).contains(&String::from("m.exr")),
        "{line}"
    );
}

/// Writes an image after a change.
fn change(folder: &TempDir, from: &str, to: &str, change: &dyn Fn(&mut Image)) {
    let mut image = read(folder, from);
    change(&mut image);
    write_exr(&folder.path().join(to), &image).unwrap();
}

#[test]
fn merge_names_what_differs() {
    if !has_device() {
        return;
    }
    let folder = scene();
    let all = "--width 16 --aov stderr";
    render(&folder, &format!("-o a.exr --samples 0..3 {all}"));
    render(&folder, &format!("-o b.exr --samples 3..8 {all}"));
    for field in JOB.into_iter().chain(DEVICE).chain(["settings.aov"]) {
        change(&folder, "b.exr", "x.exr", &|image| {
            let value = Value::from("something else");
            image.metadata.insert(field.to_owned(), value);
        });
        refused(
            &folder,
            "merge a.exr x.exr -o m.exr",
            &["x.exr", field, "something else"],
        );
    }
    // real ones, not only their headers
    for (option, field) in [
        ("--seed 2", "settings.seed"),
        ("--max-depth 1", "settings.max_depth"),
        ("--height 9", "settings.height"),
        ("--crop 0,0,8,8", "settings.crop"),
        ("--camera wide", "settings.camera"),
    ] {
        render(&folder, &format!("-o x.exr --samples 3..8 {all} {option}"));
        refused(&folder, "merge a.exr x.exr -o m.exr", &["x.exr", field]);
    }

    refused(
        &folder,
        "merge a.exr b.exr a.exr -o m.exr",
        &["samples", "0..3", "a.exr"],
    );
    change(&folder, "b.exr", "x.exr", &|image| {
        image.metadata.insert("samples".into(), "4..8".into());
    });
    refused(
        &folder,
        "merge a.exr x.exr -o m.exr",
        &["x.exr", "3..8", "4..8"],
    );
    change(&folder, "b.exr", "x.exr", &|image| {
        image.channels[0].values[5] += 0.5;
    });
    refused(&folder, "merge a.exr x.exr -o m.exr", &["x.exr", "R, G, B"]);
    change(&folder, "b.exr", "x.exr", &|image| {
        image.channels.retain(|c| c.name != "node.4.2.deviations.G");
    });
    refused(
        &folder,
        "merge a.exr x.exr -o m.exr",
        &["node.4.2.deviations.G"],
    );
    for name in [
        "node.3.1.sum.R",
        "node.4.70.sum.R",
        "node.x.0.sum.R",
        "node.5.0.other",
    ] {
        change(&folder, "b.exr", "x.exr", &|image| {
            let mut channel = image.channels[0].clone();
            channel.name = name.to_owned();
            image.channels.push(channel);
        });
        refused(&folder, "merge a.exr x.exr -o m.exr", &["x.exr"]);
    }

    render(&folder, &format!("-o x.exr --spp 3 {all}"));
    refused(
        &folder,
        "merge x.exr b.exr -o m.exr",
        &["x.exr", "--samples"],
    );
    refused(&folder, "merge b.exr none.exr -o m.exr", &["none.exr"]);
    refused(&folder, "merge b.exr scene.gltf -o m.exr", &["scene.gltf"]);
    refused(&folder, "merge b.exr -o m.png", &["m.png"]);
    // only two of three
    render(&folder, &format!("-o c.exr --samples 20..21 {all}"));
    refused(
        &folder,
        "merge c.exr a.exr -o m.exr",
        &["samples", "3..20", "--partial"],
    );
}

#[test]
fn resume_names_what_differs() {
    if !has_device() {
        return;
    }
    let folder = scene();
    let line = "render scene.gltf -o m.exr --width 16 --checkpoint x.ck --resume";
    render(
        &folder,
        "-o a.exr --width 16 --samples 4..9 --checkpoint c.ck",
    );
    let path = |name: &str| folder.path().join(name);
    let (header, film) = checkpoint::read(&path("c.ck")).unwrap();
    for field in JOB.into_iter().chain(DEVICE) {
        let mut header = header.clone();
        header.insert(field.to_owned(), "something else".into());
        checkpoint::write(&path("x.ck"), &header, &film).unwrap();
        let before = std::fs::read(path("x.ck")).unwrap();
        refused(&folder, line, &["x.ck", field, "something else"]);
        assert!(std::fs::read(path("x.ck")).unwrap() == before, "{field}");
    }
    checkpoint::write(&path("x.ck"), &header, &film).unwrap();
    let with = |option: &str| format!("{line} {option}");
    refused(
        &folder,
        &with("--samples 5..20"),
        &["samples", "4..9", "5..20"],
    );
    refused(&folder, &with("--aov albedo"), &["settings.aov"]);
    refused(
        &folder,
        &with("--max-depth 3"),
        &["settings.max_depth", "0", "3"],
    );
    refused(
        &folder,
        "render scene.gltf -o m.exr --resume",
        &["--checkpoint"],
    );
    let elsewhere = "render scene.gltf -o m.exr --checkpoint none/c.ck";
    refused(&folder, elsewhere, &["none/c.ck"]);
    assert!(read_exr(&path("a.exr")).unwrap().film().is_ok());
}
