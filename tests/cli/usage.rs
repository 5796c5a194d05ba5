//! What can be said without rendering.

use std::fs;

use super::support::{etendue, list, stderr, stdout};

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
        ("render s.gltf -o a.exr --adaptive --noise 0.1", "--noise"),
        (
            "render s.gltf -o a.exr --adaptive --samples 0..64",
            "--samples",
        ),
        ("render s.gltf -o a.exr --share --adaptive", "--adaptive"),
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
