//! `etendue info`.

use serde_json::{Value as Json, json};

use super::support::{command, etendue, has_device, scene, stderr, stdout};

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
    for backend in ["ray-query", "ray-pipeline", "bvh"] {
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
        ("solids", 0),
        ("thin_sheets", 0),
        ("media", 0),
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

/// The Vulkan loader is told of a driver that does not exist.
#[test]
fn without_a_driver_the_code_says_so_and_scenes_are_still_described() {
    let folder = scene();
    let run = |line: &str| {
        command(line, folder.path())
            .env("VK_DRIVER_FILES", "/nonexistent.json")
            .env("VK_ICD_FILENAMES", "/nonexistent.json")
            .output()
            .unwrap()
    };
    for line in ["info", "info --json", "render scene.gltf -o a.exr"] {
        let output = run(line);
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(4), "{line}: {message}");
        let last = message.lines().last().unwrap();
        assert!(last.starts_with("error: "), "{line}: {message}");
    }
    let output = run("info scene.gltf --json");
    assert!(output.status.success(), "{}", stderr(&output));
    let info: Json = serde_json::from_str(&stdout(&output)).unwrap();
    assert_eq!(info["devices"], json!([]));
    assert!(info["devices_error"].is_string());
    assert_eq!(info["scene"]["counts"]["triangles"], 2);
}
