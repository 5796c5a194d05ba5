//! Disks that are full, folders that take no files, names that are too long.
#![cfg(unix)]

use std::fs;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::process::{Command, Stdio};

use etendue::checkpoint;

use super::support::{etendue, has_device, list, read, render, scene, stderr, wait_for_samples};

/// What cannot be written is known before the first sample.
#[test]
fn places_that_take_no_files_are_refused_at_the_start() {
    if !has_device() {
        return;
    }
    let folder = scene();
    let long = "n".repeat(300);
    let closed = folder.path().join("closed");
    fs::create_dir(&closed).unwrap();
    fs::set_permissions(&closed, fs::Permissions::from_mode(0o555)).unwrap();
    let mut places = vec![
        String::from("none"),
        long.clone(),
        String::from("scene.gltf"),
    ];
    // permissions do not hold for root
    match fs::write(closed.join("probe"), "") {
        Ok(()) => eprintln!("skipped: a read-only folder, as root"),
        Err(_) => places.push(String::from("closed")),
    }
    if cfg!(target_os = "linux") {
        places.push(String::from("/proc"));
    }
    for place in places
        .iter()
        .map(|place| format!("{place}/a"))
        .chain([long])
    {
        for option in [
            format!("-o {place}.exr"),
            format!("-o {place}.png"),
            format!("-o b.exr --stats {place}.json"),
            format!("-o b.exr --checkpoint {place}.ck"),
        ] {
            // so many that it would not end
            let line = format!("render scene.gltf {option} --spp 100000000");
            let output = etendue(&line, folder.path());
            let message = stderr(&output);
            assert_eq!(output.status.code(), Some(2), "{option}: {message}");
            assert!(message.contains(&place), "{option}: {message}");
        }
    }
    fs::set_permissions(&closed, fs::Permissions::from_mode(0o755)).unwrap();
    assert_eq!(list(folder.path()), ["closed", "scene.gltf"]);
}

/// As long as the system allows.
#[test]
fn long_names_are_written() {
    if !has_device() {
        return;
    }
    let folder = scene();
    let name = |suffix: &str| format!("{}.{suffix}", "é".repeat(125));
    let (exr, ck) = (name("exr"), name("ck"));
    render(
        &folder,
        &format!("-o {exr} --checkpoint {ck} --width 8 --spp 1"),
    );
    read(&folder, &exr);
    checkpoint::read(&folder.path().join(ck)).unwrap();
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_at_the_end_keeps_the_checkpoint() {
    if !has_device() {
        return;
    }
    let folder = scene();
    for name in ["full.exr", "full.png", "full.json"] {
        symlink("/dev/full", folder.path().join(name)).unwrap();
    }
    for (number, outputs) in [
        (0, "-o full.exr"),
        (1, "-o full.png"),
        (2, "-o a.exr --stats full.json"),
    ] {
        let line = format!("{outputs} --width 16 --spp 3 --checkpoint c{number}.ck");
        let output = etendue(&format!("render scene.gltf {line}"), folder.path());
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(1), "{outputs}: {message}");
        assert!(message.contains("error: write full."), "{message}");
        let (_, film) = checkpoint::read(&folder.path().join(format!("c{number}.ck"))).unwrap();
        assert_eq!(film.samples(), 3);
    }
    // what else was asked for is there
    assert_eq!(read(&folder, "a.exr").channels.len(), 3);
}

/// A limit on the size of files, set while it renders, stands for a disk that fills up.
#[cfg(target_os = "linux")]
#[test]
fn a_disk_that_fills_up_leaves_what_was_there() {
    if !has_device() {
        return;
    }
    let folder = scene();
    let all = "-o a.exr --width 128 --checkpoint c.ck --checkpoint-interval 0 --resume";
    render(&folder, &format!("{all} --spp 2"));
    let picture = fs::read(folder.path().join("a.exr")).unwrap();
    let saved = || checkpoint::read(&folder.path().join("c.ck")).unwrap().1;
    let line = format!("render scene.gltf {all} --spp 100000000 --time 2 --progress json");
    let mut child = Command::new("sh")
        .args(["-c", "trap '' XFSZ; exec \"$@\"", "sh"])
        .arg(env!("CARGO_BIN_EXE_etendue"))
        .args(line.split(' '))
        .current_dir(folder.path())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    wait_for_samples(&mut child);
    let limit = ["--fsize=10000", "--pid", &child.id().to_string()].map(String::from);
    assert!(
        Command::new("prlimit")
            .args(limit)
            .status()
            .unwrap()
            .success()
    );
    let held = saved().samples();
    let output = child.wait_with_output().unwrap();
    let message = stderr(&output);
    assert_eq!(output.status.code(), Some(1), "{message}");
    // those on the way are warned of; the last one and the picture are errors
    assert!(
        message.contains("\"warning\"") && message.contains("error: write c.ck"),
        "{message}"
    );
    // what was written while the limit was set is newer
    assert!(saved().samples() >= held && held >= 2);
    assert!(fs::read(folder.path().join("a.exr")).unwrap() == picture);
    assert_eq!(list(folder.path()), ["a.exr", "c.ck", "scene.gltf"]);
}
