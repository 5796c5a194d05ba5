//! Renders that get in each other's way, and scenes that change under them.

use std::fs;
use std::process::{Child, Stdio};

use etendue::checkpoint;
use etendue::image_io::read_exr;
use tempfile::TempDir;

use super::support::{
    command, etendue, has_device, list, read, render, scene, stderr, text, wait_for_samples,
};

/// Starts a render and returns when it has samples.
fn start(folder: &TempDir, line: &str) -> Child {
    let line = format!("render scene.gltf {line} --progress json");
    let mut command = command(&line, folder.path());
    let mut child = command.stderr(Stdio::piped()).spawn().unwrap();
    wait_for_samples(&mut child);
    child
}

#[test]
fn the_second_render_on_a_checkpoint_is_refused() {
    if !has_device() {
        return;
    }
    let folder = scene();
    let line = "-o a.exr --width 16 --checkpoint c.ck --checkpoint-interval 0 --resume";
    let mut child = start(&folder, &format!("{line} --spp 100000000"));
    let names: &[&str] = match cfg!(unix) {
        true => {
            std::os::unix::fs::symlink("c.ck", folder.path().join("other.ck")).unwrap();
            &["c.ck", "./c.ck", "other.ck"]
        }
        false => &["c.ck"],
    };
    for name in names {
        let second = format!("render scene.gltf -o b.exr --width 16 --checkpoint {name} --resume");
        let output = etendue(&second, folder.path());
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{name}: {message}");
        assert!(
            message.contains("in use") && message.contains(name),
            "{message}"
        );
    }
    assert!(!folder.path().join("b.exr").exists());
    // SIGKILL: the lock is not in the way of the next, which tidies up
    child.kill().unwrap();
    child.wait().unwrap();
    let (_, film) = checkpoint::read(&folder.path().join("c.ck")).unwrap();
    let samples = film.samples() + 1;
    render(&folder, &format!("{line} --spp {samples}"));
    let left = list(folder.path());
    assert!(!left.iter().any(|name| name.ends_with(".lock")), "{left:?}");
}

/// Under any name, by a render or a merge, at the start; what was killed is in nobody's way.
#[test]
fn the_second_render_to_one_output_is_refused() {
    if !has_device() {
        return;
    }
    let folder = scene();
    let path = |name: &str| folder.path().join(name);
    render(&folder, "-o shard.exr --width 16 --samples 0..2");
    fs::create_dir(path("sub")).unwrap();
    let mut names = vec!["a.exr", "./a.exr", "sub/../a.exr"];
    if cfg!(unix) {
        std::os::unix::fs::symlink("a.exr", path("other.exr")).unwrap();
        names.push("other.exr");
    }
    // with and without an older picture
    for old in [None, Some("old")] {
        if let Some(text) = old {
            fs::write(path("a.exr"), text).unwrap();
        }
        let line = "-o a.exr --stats s.json --width 16";
        let mut child = start(&folder, &format!("{line} --spp 100000000"));
        let refused = |line: &str, name: &str| {
            let output = etendue(line, folder.path());
            let message = stderr(&output);
            assert_eq!(output.status.code(), Some(2), "{line}: {message}");
            let is_named = message.contains("in use") && message.contains(name);
            assert!(is_named, "{line}: {message}");
        };
        for name in &names {
            refused(&format!("render scene.gltf -o b.exr -o {name}"), name);
            refused(&format!("merge shard.exr -o {name}"), name);
        }
        refused("render scene.gltf -o b.exr --stats s.json", "s.json");
        assert!(!path("b.exr").exists());
        // others are in nobody's way
        render(&folder, "-o c.exr --width 16 --spp 1");
        child.kill().unwrap();
        child.wait().unwrap();
        assert_eq!(fs::read_to_string(path("a.exr")).ok().as_deref(), old);
        render(&folder, &format!("{line} --spp 1"));
        read(&folder, "a.exr");
        let left = list(folder.path());
        assert!(!left.iter().any(|name| name.ends_with(".lock")), "{left:?}");
    }
}

/// Which of them is refused is by chance; the picture is that of the other one, whole.
#[test]
fn two_renders_to_one_output_at_once_leave_one_whole_picture() {
    if !has_device() {
        return;
    }
    let folder = scene();
    let line =
        |seed: u64| format!("render scene.gltf -o a.exr --width 32 --spp 8 --seed {seed} -q");
    let pictures = [1, 2].map(|seed| {
        assert!(etendue(&line(seed), folder.path()).status.success());
        read(&folder, "a.exr")
    });
    for _ in 0..3 {
        let quiet = |seed| {
            command(&line(seed), folder.path())
                .stderr(Stdio::null())
                .spawn()
        };
        let both = [1, 2].map(|seed| quiet(seed).unwrap());
        let codes = both.map(|mut child| child.wait().unwrap().code().unwrap());
        assert!(
            codes.contains(&0) && codes.iter().all(|c| [0, 2].contains(c)),
            "{codes:?}"
        );
        let left = read_exr(&folder.path().join("a.exr")).unwrap();
        let mut done = pictures.iter().zip(codes).filter(|(_, code)| *code == 0);
        assert!(done.any(|(picture, _)| picture.channels == left.channels));
        assert_eq!(list(folder.path()), ["a.exr", "scene.gltf"]);
    }
}

/// Files that a command line would write twice are refused; names that begin alike are others.
#[test]
fn outputs_are_named_once() {
    if !has_device() {
        return;
    }
    let folder = scene();
    for line in ["-o a.exr -o ./a.exr", "-o a.exr --checkpoint a.exr"] {
        let output = etendue(&format!("render scene.gltf {line}"), folder.path());
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{line}: {message}");
        assert!(message.contains("a.exr is named twice"), "{message}");
    }
    let long = "n".repeat(100);
    let line = format!("-o {long}1.exr -o {long}2.exr -o {long}1.png --width 8 --spp 1");
    render(&folder, &line);
}

/// The scene is read once, at the start: the picture and its header are of what was read.
#[test]
fn a_scene_that_changes_during_the_render_does_not_change_the_picture() {
    if !has_device() {
        return;
    }
    let folder = scene();
    let path = folder.path().join("scene.gltf");
    let line = "--width 64 --spp 3000";
    render(&folder, &format!("-o whole.exr {line}"));
    let child = start(&folder, &format!("-o a.exr {line} --checkpoint c.ck"));
    let old = fs::read_to_string(&path).unwrap();
    let new = old.replace("0.625", "0.5");
    assert_ne!(old, new);
    fs::write(&path, &new).unwrap();
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    let (whole, a) = (read(&folder, "whole.exr"), read(&folder, "a.exr"));
    assert!(whole.channels == a.channels);
    assert_eq!(text(&whole, "scene_hash"), text(&a, "scene_hash"));
    // and nothing of the new scene is added to it
    let line = format!("render scene.gltf -o a.exr {line} --checkpoint c.ck --resume");
    let output = etendue(&line, folder.path());
    assert_eq!(output.status.code(), Some(2));
    assert!(
        stderr(&output).contains("scene_hash"),
        "{}",
        stderr(&output)
    );
}
