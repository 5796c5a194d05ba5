//! `etendue measure`.

use serde_json::Value as Json;

use super::support::{SKY, etendue, has_device, scene, stderr, stdout};

#[test]
fn wrong_meters_are_usage_errors() {
    let folder = scene();
    let cases = [
        ("", "--irradiance"),
        ("--irradiance 0,0,0,0,0", "5 numbers, not 6"),
        ("--irradiance 0,0,0,0,0,nan", "not finite"),
        ("--radiance 0,0,0,0,0,0", "must have a length"),
        ("--intensity square,0,0,0", "must have a length"),
        ("--intensity square,0,1", "is not NODE,DX,DY,DZ"),
        (
            "--intensity sqare,0,1,0",
            "there is no node \"sqare\"; nodes with meshes or lights: square",
        ),
        ("--flux 3", "there is no node \"3\""),
        (
            "--flux square --radiance 0,0,0,0,0,1",
            "cannot be used with",
        ),
        ("--flux square --spp 1", "--spp"),
        ("--flux square --wavelength 0", "above 0"),
    ];
    for (line, part) in cases {
        let output = etendue(&format!("measure scene.gltf {line}"), folder.path());
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{line}: {message}");
        assert!(message.contains(part), "{line}: {message}");
        assert!(output.stdout.is_empty(), "{line}");
    }
    let output = etendue("measure missing.gltf --flux a", folder.path());
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
}

#[test]
fn a_reading_is_data_on_stdout() {
    if !has_device() {
        return;
    }
    let folder = scene();
    // Past the square, straight into the sky; negative numbers come first.
    let line = "measure scene.gltf --radiance -5,0,1,0,0,1 --spp 2 -q --wavelength 555";
    let output = etendue(line, folder.path());
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(output.stderr.is_empty(), "{}", stderr(&output));
    let text = stdout(&output);
    assert!(
        text.contains("W/(m²·sr)") && text.contains("photons/(s·m²·sr)"),
        "{text}"
    );

    let output = etendue(&format!("{line} --json"), folder.path());
    let json: Json = serde_json::from_str(&stdout(&output)).unwrap();
    assert_eq!(json["unit"], "W/(m²·sr)");
    for c in 0..3 {
        let value = json["value"][c].as_f64().unwrap();
        assert!((value - f64::from(SKY[c])).abs() < 1e-6, "{json}");
        // hν of 555 nm is 3.579e-19 J
        let rate = json["photons"][c].as_f64().unwrap();
        assert!((rate * 3.579_2e-19 / value - 1.0).abs() < 1e-4, "{json}");
    }
}

#[test]
fn nodes_without_light_send_none() {
    if !has_device() {
        return;
    }
    let folder = scene();
    // The sky does not light a luminaire; a camera's node holds nothing at all.
    for line in ["--intensity square,0,0,1", "--flux 0", "--flux wide"] {
        let output = etendue(
            &format!("measure scene.gltf {line} --json -q --spp 2"),
            folder.path(),
        );
        assert!(output.status.success(), "{line}: {}", stderr(&output));
        let json: Json = serde_json::from_str(&stdout(&output)).unwrap();
        assert_eq!(json["luminance"], 0.0, "{line}");
    }
}
