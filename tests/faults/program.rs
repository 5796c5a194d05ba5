//! What users see: exit codes, messages, and files that are what they were or what they
//! are meant to be.

use std::fs;
use std::process::Output;

use etendue::checkpoint;
use tempfile::TempDir;

use super::is_nightly;
use super::support::{command, etendue, has_device, list, read, render, scene, stderr};

/// Runs the program with a fault.
fn with_fault(folder: &TempDir, line: &str, fault: &str) -> Output {
    let mut command = command(line, folder.path());
    command.env("ETENDUE_FAULT", fault).output().unwrap()
}

fn file(folder: &TempDir, name: &str) -> Option<Vec<u8>> {
    fs::read(folder.path().join(name)).ok()
}

/// What a failure looks like: one of the codes, with an error that is not ours.
fn check_failure(output: &Output, fault: &str, codes: &[i32]) {
    let message = stderr(output);
    let code = output.status.code();
    assert!(
        code.is_some_and(|code| codes.contains(&code)),
        "{fault}: {code:?} {message}"
    );
    assert!(message.contains("error: "), "{fault}: {message}");
    assert!(!message.contains("internal error"), "{fault}: {message}");
}

#[test]
fn calls_that_fail_leave_the_old_picture() {
    if !has_device() {
        return;
    }
    let folder = scene();
    render(&folder, "-o a.exr --width 16 --spp 2");
    let old = file(&folder, "a.exr");
    let line = "render scene.gltf -o a.exr --width 16 --spp 4 -q";
    let (mut failed, mut at) = (0, 1);
    // until there are no more calls
    loop {
        let manner = ["once", "lasting", "lost"][at % 3];
        let fault = format!("vulkan {at} {manner}");
        let output = with_fault(&folder, line, &fault);
        assert_eq!(list(folder.path()), ["a.exr", "scene.gltf"], "{fault}");
        if output.status.success() {
            assert!(file(&folder, "a.exr") != old, "{fault}");
            fs::write(folder.path().join("a.exr"), old.as_ref().unwrap()).unwrap();
            if manner == "lasting" {
                break;
            }
        } else {
            check_failure(&output, &fault, &[1]);
            assert!(file(&folder, "a.exr") == old, "{fault}");
            failed += 1;
        }
        at += if is_nightly() { 1 } else { 29 };
    }
    assert!(failed > 5, "{failed} of {at} calls failed");
}

#[test]
fn a_lost_device_loses_no_finished_sample() {
    if !has_device() {
        return;
    }
    let folder = scene();
    let all = "--width 24 --spp 300";
    render(&folder, &format!("-o whole.exr {all}"));
    fs::write(folder.path().join("a.exr"), "old").unwrap();
    let line = format!("render scene.gltf -o a.exr {all} --checkpoint c.ck");
    let mut held = 0;
    for (at, manner, says) in [
        (540, "lost", "device lost during"),
        (610, "lasting", "memory"),
    ] {
        let fault = format!("vulkan {at} {manner}");
        let output = with_fault(&folder, &format!("{line} --resume"), &fault);
        check_failure(&output, &fault, &[1]);
        let message = stderr(&output);
        assert!(
            message.contains(says) && message.contains("finished samples are in c.ck"),
            "{message}"
        );
        assert_eq!(file(&folder, "a.exr").unwrap(), b"old");
        assert_eq!(
            list(folder.path()),
            ["a.exr", "c.ck", "scene.gltf", "whole.exr"]
        );
        let (_, film) = checkpoint::read(&folder.path().join("c.ck")).unwrap();
        assert!(
            (held + 1..300).contains(&film.samples()),
            "{}",
            film.samples()
        );
        held = film.samples();
    }
    let output = etendue(&format!("{line} --resume"), folder.path());
    assert!(output.status.success(), "{}", stderr(&output));
    let (whole, a) = (read(&folder, "whole.exr"), read(&folder, "a.exr"));
    assert!(whole.channels == a.channels);
    for (name, value) in &whole.metadata {
        let is_time = name.starts_with("times.");
        assert!(is_time || a.metadata.get(name) == Some(value), "{name}");
    }
}

/// One of two devices goes, while the other goes on.
#[test]
fn the_loss_of_one_of_two_devices_is_survived() {
    if !has_device() {
        return;
    }
    let folder = scene();
    // so many that each of them has its share of calls
    let all = "--width 24 --spp 20000";
    render(&folder, &format!("-o whole.exr {all}"));
    let line = format!("render scene.gltf -o a.exr {all} --device 0,0");
    for fault in ["vulkan 790 lost", "vulkan 817 lasting", "vulkan 940 lost"] {
        let output = with_fault(&folder, &line, fault);
        let message = stderr(&output);
        assert!(output.status.success(), "{fault}: {message}");
        assert!(message.contains("others go on"), "{fault}: {message}");
        assert!(read(&folder, "a.exr").channels == read(&folder, "whole.exr").channels);
    }
}

/// All outputs are there from before, and a checkpoint is written after every pass.
#[test]
fn steps_of_writing_that_fail_leave_whole_files() {
    if !has_device() {
        return;
    }
    let folder = scene();
    let outputs = ["a.exr", "a.png", "s.json"];
    let line =
        "-o a.exr -o a.png --stats s.json --width 16 --checkpoint c.ck --checkpoint-interval 0";
    render(&folder, &format!("{line} --spp 3"));
    let names = ["a.exr", "a.png", "c.ck", "s.json", "scene.gltf"];
    let old: Vec<_> = names
        .iter()
        .map(|name| file(&folder, name).unwrap())
        .collect();
    let samples = || {
        checkpoint::read(&folder.path().join("c.ck"))
            .unwrap()
            .1
            .samples()
    };
    let (mut failed, mut at) = (0, 1);
    loop {
        let manner = ["once", "lasting"][at % 2];
        let fault = format!("file {at} {manner}");
        let output = with_fault(
            &folder,
            &format!("render scene.gltf {line} --spp 9 --resume"),
            &fault,
        );
        let message = stderr(&output);
        assert_eq!(list(folder.path()), names, "{fault}: {message}");
        let held = samples();
        assert!((3..=9).contains(&held), "{fault}: {held}");
        let is_new = |name| {
            file(&folder, name) != Some(old[names.iter().position(|n| *n == name).unwrap()].clone())
        };
        let written = outputs.map(is_new);
        if output.status.success() {
            // a checkpoint on the way may fail; what matters is the last one
            assert!(
                written == [true; 3] && held == 9,
                "{fault}: {written:?} {held}"
            );
            if manner == "lasting" {
                break;
            }
        } else {
            check_failure(&output, &fault, &[1, 2]);
            failed += 1;
            // one of the files is named
            let is_named = outputs
                .iter()
                .chain(&["c.ck"])
                .any(|name| message.contains(name));
            assert!(is_named, "{fault}: {message}");
        }
        for name in outputs.iter().filter(|name| is_new(name)) {
            match *name {
                "a.exr" => drop(read(&folder, name)),
                "a.png" => drop(image::open(folder.path().join(name)).unwrap()),
                _ => drop(
                    serde_json::from_slice::<serde_json::Value>(&file(&folder, name).unwrap())
                        .unwrap(),
                ),
            }
        }
        for (name, bytes) in names.iter().zip(&old) {
            fs::write(folder.path().join(name), bytes).unwrap();
        }
        at += if is_nightly() { 1 } else { 7 };
    }
    assert!(failed > 2, "{failed} of {at} steps failed");
}
