//! An image from the header of another.

use std::fs;

use etendue::image_io::{Image, write_exr};

use super::support::{etendue, has_device, read, render, scene, stderr, text};

#[test]
fn images_are_rendered_again_from_their_headers() {
    if !has_device() {
        return;
    }
    let folder = scene();
    let window = etendue::settings::Crop {
        x0: 0,
        y0: 0,
        x1: 4,
        y1: 2,
    };
    let channel = |name: &str| etendue::image_io::Channel {
        name: name.to_owned(),
        values: (0..8).map(|i| 0.1 * i as f32).collect(),
    };
    let sky = Image {
        window,
        full: (4, 2),
        channels: ["R", "G", "B"].map(channel).to_vec(),
        metadata: Default::default(),
    };
    write_exr(&folder.path().join("sky.exr"), &sky).unwrap();
    for options in [
        "--spp 9 --width 24",
        "--samples 5..12 --width 24 --height 10 --crop 3,1,9,8 --seed 18446744073709551615",
        "--spp 6 --width 16 --camera close --max-depth 2 --aov stderr,albedo --estimator textbook",
        "--spp 70 --width 16 --adaptive --aov stderr,samples --seed 3",
        "--spp 5 --width 16 --share --crop 4,2,9,8",
        // the pilot has no time for more than a few samples
        "--spp 100000000 --width 64 --adaptive --time 0.001",
        "--spp 6 --width 16 --env sky.exr --env-intensity 0.3 --env-rotation -77.7",
        "--spp 100000000 --width 16 --time 0.2 --backend bvh",
    ] {
        render(&folder, &format!("-o a.exr {options}"));
        let output = etendue("rerender a.exr -o b.exr", folder.path());
        assert!(output.status.success(), "{options}: {}", stderr(&output));
        assert!(!stderr(&output).contains("differs"), "{}", stderr(&output));
        let (a, b) = (read(&folder, "a.exr"), read(&folder, "b.exr"));
        assert!(a.channels == b.channels, "{options}");
        assert_eq!((a.window, a.full), (b.window, b.full));
        for name in ["samples", "ledger.stop", "settings.seed", "scene"] {
            assert_eq!(text(&a, name), text(&b, name), "{options}: {name}");
        }
        assert_eq!(a.metadata["spp"], b.metadata["spp"]);
    }

    // gaps are repeated as well
    render(&folder, "-o a.exr --samples 0..3 --width 16");
    render(&folder, "-o c.exr --samples 7..9 --width 16");
    let merged = etendue("merge a.exr c.exr --partial -o a.exr", folder.path());
    assert!(merged.status.success());
    assert!(
        etendue("rerender a.exr -o b.exr", folder.path())
            .status
            .success()
    );
    let (a, b) = (read(&folder, "a.exr"), read(&folder, "b.exr"));
    assert!(a.channels == b.channels);
    assert_eq!(text(&b, "samples"), "0..3,7..9");
}

#[test]
fn what_differs_is_refused_or_said() {
    if !has_device() {
        return;
    }
    let folder = scene();
    render(&folder, "-o a.exr --spp 2 --width 16");
    let path = |name: &str| folder.path().join(name);
    for field in ["build", "driver"] {
        let mut image = read(&folder, "a.exr");
        image.metadata.insert(field.to_owned(), "other".into());
        write_exr(&path("x.exr"), &image).unwrap();
        let output = etendue("rerender x.exr -o b.exr", folder.path());
        assert!(output.status.success(), "{}", stderr(&output));
        let message = stderr(&output);
        assert!(
            message.contains(&format!("warning: {field} differs: other")),
            "{message}"
        );
    }
    for (field, words) in [("samples", "samples"), ("settings.seed", "--seed")] {
        let mut image = read(&folder, "a.exr");
        image.metadata.insert(field.to_owned(), "x".into());
        write_exr(&path("x.exr"), &image).unwrap();
        let output = etendue("rerender x.exr -o c.exr", folder.path());
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        assert!(stderr(&output).contains(words), "{}", stderr(&output));
    }

    // a comment is enough for another hash
    let text = fs::read_to_string(path("scene.gltf")).unwrap();
    fs::write(path("moved.gltf"), &text).unwrap();
    let output = etendue("rerender a.exr -o b.exr --scene moved.gltf", folder.path());
    assert!(output.status.success(), "{}", stderr(&output));
    fs::write(path("scene.gltf"), format!("{text} ")).unwrap();
    let output = etendue("rerender a.exr -o c.exr", folder.path());
    assert!(
        stderr(&output).contains("scene_hash"),
        "{}",
        stderr(&output)
    );
    assert_eq!(output.status.code(), Some(2));
    assert!(!path("c.exr").exists());
}
