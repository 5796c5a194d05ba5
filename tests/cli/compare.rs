//! `etendue compare`: verdicts, exit codes, files.

use serde_json::Value as Json;

use crate::support::*;

/// The scene's folder with a render for each (name, options).
fn rendered(renders: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = scene();
    for (name, options) in renders {
        let size = "--width 16 --height 8 --backend bvh -q --aov stderr,samples";
        render(&folder, &format!("-o {name} {size} {options}"));
    }
    folder
}

#[test]
fn verdicts_have_exit_codes() {
    if !has_device() {
        return;
    }
    let folder = rendered(&[
        ("a.exr", "--spp 64"),
        ("b.exr", "--spp 64 --seed 1"),
        ("c.exr", "--spp 64 --seed 2 --camera close"),
        ("d.exr", "--spp 128"),
        // halves of a net of 256
        ("e.exr", "--samples 512..640"),
        ("f.exr", "--samples 640..768"),
    ]);
    let compare = |line: &str| etendue(&format!("compare {line}"), folder.path());

    let output = compare("a.exr b.exr");
    let text = stdout(&output);
    assert_eq!(output.status.code(), Some(0), "{text}");
    for word in [
        "not different",
        "RMSE",
        "relMSE",
        "ε =",
        "MAPE",
        "bias",
        "image",
        "tile",
        "pixel",
    ] {
        assert!(text.contains(word), "{word}: {text}");
    }
    assert!(!text.contains("note:"), "{text}");

    let output = compare("a.exr c.exr --json --diff d.png");
    assert_eq!(output.status.code(), Some(5));
    let json: Json = serde_json::from_str(&stdout(&output)).unwrap();
    assert_eq!(json["verdict"], "different");
    assert_eq!(json["alpha"], 0.001);
    assert!(json["p"].as_f64().unwrap() < 0.001 && json["metrics"]["rmse"].as_f64().unwrap() > 0.0);
    assert_eq!(json["families"].as_array().unwrap().len(), 3);
    assert!(folder.path().join("d.png").exists());

    // Identical; the same samples and more.
    let output = compare("a.exr a.exr");
    assert!(stdout(&output).contains("identical"));
    assert_eq!(output.status.code(), Some(0));
    let output = compare("a.exr d.exr --diff difference.exr");
    assert!(
        stdout(&output).contains("samples of seed 0 in common"),
        "{}",
        stdout(&output)
    );
    assert!(stdout(&compare("e.exr f.exr")).contains("parts of the same nets"));
    assert!(!stdout(&compare("d.exr e.exr")).contains("note:"));
    let difference = read(&folder, "difference.exr");
    assert!(difference.channel("deviation.G").is_some());
    let [a, d] = ["a.exr", "d.exr"].map(|name| read(&folder, name).rgb().unwrap());
    assert_eq!(difference.rgb().unwrap()[5][1], a[5][1] - d[5][1]);
}

#[test]
fn without_standard_errors_there_is_no_verdict() {
    if !has_device() {
        return;
    }
    let folder = scene();
    let size = "--spp 2 --width 16 --height 8 --backend bvh -q";
    render(&folder, &format!("-o a.exr {size}"));
    render(&folder, &format!("-o b.exr {size} --camera close"));
    render(&folder, &format!("-o narrow.exr {size} --crop 0,0,8,8"));
    let output = etendue("compare a.exr b.exr", folder.path());
    let text = stdout(&output);
    assert_eq!(output.status.code(), Some(0), "{text}");
    assert!(
        text.contains("no verdict") && text.contains("RMSE"),
        "{text}"
    );

    let output = etendue("compare a.exr narrow.exr", folder.path());
    assert_eq!(output.status.code(), Some(2));
    assert!(
        stderr(&output).contains("16 × 8 pixels and B 8 × 8"),
        "{}",
        stderr(&output)
    );
    let output = etendue("compare a.exr missing.exr", folder.path());
    assert_eq!(output.status.code(), Some(1));
    assert!(
        stderr(&output).contains("read missing.exr"),
        "{}",
        stderr(&output)
    );
    let output = etendue("compare a.exr scene.gltf", folder.path());
    assert_eq!(output.status.code(), Some(1));
    assert!(
        stderr(&output).contains("scene.gltf"),
        "{}",
        stderr(&output)
    );
    for bad in [
        "--alpha 0",
        "--alpha 1",
        "--alpha x",
        "--spp 0",
        "--spp 1,2,3",
        "--diff a.jpg",
    ] {
        let output = etendue(&format!("compare a.exr b.exr {bad}"), folder.path());
        assert_eq!(output.status.code(), Some(2), "{bad}");
    }
}
