//! Transmission, volumes and media.

use etendue::scene::{Material, Medium, Phase, Scene, Volume};
use glam::Vec3;
use serde_json::{Value, json};

use super::broken::assert_all_refused;
use super::builder::*;
use super::shading::textured;

/// Loads one material with these extensions.
fn load(extensions: Value) -> Scene {
    textured(json!({ "extensions": extensions }))
        .load()
        .unwrap()
}

/// The same, and asserts that nothing was worth a warning.
fn material(extensions: Value) -> Material {
    let mut scene = load(extensions);
    assert_eq!(scene.warnings, [""; 0]);
    scene.materials.remove(0)
}

/// A solid that is filled with an ETENDUE_medium.
fn filled(medium: Value) -> Volume {
    let extensions = json!({
        "KHR_materials_transmission": { "transmissionFactor": 1 },
        "KHR_materials_volume": { "thicknessFactor": 1 },
        "ETENDUE_medium": medium
    });
    material(extensions).volume.unwrap()
}

fn with_medium(medium: Value) -> Asset {
    let mut asset = Asset::triangle();
    let extensions = json!({ "ETENDUE_medium": medium });
    asset.set("/scenes/0/extensions", extensions);
    asset
}

/// Roundings of a logarithm, a power and two conversions to fp32.
const ROUNDING: f32 = 1e-6;

#[test]
fn transmission_is_thin_until_a_volume_has_a_thickness() {
    let m = material(json!({}));
    assert_eq!((m.transmission, m.volume), (0.0, None));
    assert!(m.transmission_texture.is_none());

    let transmission =
        json!({ "transmissionFactor": 0.75, "transmissionTexture": { "index": 1, "texCoord": 1 } });
    let scene = load(json!({ "KHR_materials_transmission": transmission }));
    assert_eq!(scene.warnings, [""; 0]);
    let m = &scene.materials[0];
    assert_eq!((m.transmission, m.volume), (0.75, None));
    let texture = m.transmission_texture.unwrap();
    assert_eq!(texture.uv_set, 1);
    let texels = &scene.textures[texture.texture as usize].texels;
    assert!(format!("{texels:?}").contains("srgb: false"), "linear");

    for (volume, wanted) in [
        (json!({}), None),
        (
            json!({ "thicknessFactor": 0, "attenuationDistance": 1 }),
            None,
        ),
        (
            json!({ "thicknessFactor": 1e-3, "thicknessTexture": { "index": 0 } }),
            Some(Volume::default()),
        ),
    ] {
        let m = material(json!({
            "KHR_materials_transmission": { "transmissionFactor": 1 },
            "KHR_materials_volume": volume
        }));
        assert_eq!(m.volume, wanted, "{volume}");
    }
}

#[test]
fn attenuation_is_what_is_left_after_a_distance() {
    let absorption = |volume: Value| {
        let m = material(json!({
            "KHR_materials_transmission": { "transmissionFactor": 1 },
            "KHR_materials_volume": volume
        }));
        m.volume.unwrap().medium.absorption
    };
    let color = json!([0.25, 1, 0.5]);
    let got = absorption(
        json!({ "thicknessFactor": 1, "attenuationColor": color, "attenuationDistance": 0.5 }),
    );
    // c^(x/d) = exp(−σ x): σ = −ln c / d.
    let ln_2 = std::f32::consts::LN_2;
    let wanted = Vec3::new(4.0 * ln_2, 0.0, 2.0 * ln_2);
    assert!((got - wanted).abs().max_element() < ROUNDING * 4.0, "{got}");
    // Without a distance it is infinite, as it is where fp32 ends.
    for volume in [
        json!({ "thicknessFactor": 1, "attenuationColor": color }),
        json!({ "thicknessFactor": 1, "attenuationColor": color, "attenuationDistance": 1e39 }),
    ] {
        assert_eq!(absorption(volume), Vec3::ZERO);
    }
    let black = absorption(
        json!({ "thicknessFactor": 1, "attenuationColor": [0, 0, 1], "attenuationDistance": 1 }),
    );
    assert_eq!(black, Vec3::new(f32::MAX, f32::MAX, 0.0));
}

#[test]
fn media_are_read_with_their_defaults() {
    assert_eq!(filled(json!({})), Volume::default());
    let volume =
        filled(json!({ "absorption": [1, 2, 3], "scattering": [4, 5, 6], "priority": -7 }));
    assert_eq!(volume.priority, -7);
    let medium = Medium {
        absorption: Vec3::new(1.0, 2.0, 3.0),
        scattering: Vec3::new(4.0, 5.0, 6.0),
        phase: Phase::Isotropic,
    };
    assert_eq!(volume.medium, medium);
    for (given, wanted) in [
        (json!({ "phase": "isotropic" }), Phase::Isotropic),
        (json!({ "phase": "rayleigh" }), Phase::Rayleigh),
        (json!({ "rayleigh550": 1 }), Phase::Rayleigh),
        (
            json!({ "rayleigh550": 1, "phase": "isotropic" }),
            Phase::Isotropic,
        ),
        (
            json!({ "phase": "henyey-greenstein" }),
            Phase::HenyeyGreenstein { g: 0.0 },
        ),
        (
            json!({ "phase": "henyey-greenstein", "g": -0.75 }),
            Phase::HenyeyGreenstein { g: -0.75 },
        ),
    ] {
        assert_eq!(filled(given.clone()).medium.phase, wanted, "{given}");
    }
    // (550/611.4)⁴, (550/549.1)⁴ and (550/464.2)⁴, by hand.
    let got = filled(json!({ "rayleigh550": 2 })).medium.scattering / 2.0;
    let wanted = Vec3::new(0.654_860_84, 1.006_572_3, 1.970_744);
    assert!((got - wanted).abs().max_element() < ROUNDING * 2.0, "{got}");
}

#[test]
fn a_medium_adds_to_the_attenuation_and_stays_finite() {
    let both = |color: Value| {
        let m = material(json!({
            "KHR_materials_transmission": { "transmissionFactor": 1 },
            "KHR_materials_volume": { "thicknessFactor": 1, "attenuationColor": color, "attenuationDistance": 1 },
            "ETENDUE_medium": { "absorption": [1, 0, 3e38] }
        }));
        m.volume.unwrap().medium.absorption
    };
    let got = both(json!([0.5, 0.5, 1]));
    let wanted = Vec3::new(1.0 + std::f32::consts::LN_2, std::f32::consts::LN_2, 3e38);
    assert!((got - wanted).abs().max_element() < ROUNDING * 2.0, "{got}");
    assert_eq!(both(json!([1, 1, 0])).z, f32::MAX);
}

#[test]
fn a_scene_is_filled_with_its_medium() {
    assert_eq!(Asset::triangle().load().unwrap().medium, None);
    let given = json!({ "scattering": [0.1, 0.2, 0.3], "phase": "henyey-greenstein", "g": 0.5 });
    let scene = with_medium(given).load().unwrap();
    assert_eq!(scene.warnings, [""; 0]);
    let medium = Medium {
        absorption: Vec3::ZERO,
        scattering: Vec3::new(0.1, 0.2, 0.3),
        phase: Phase::HenyeyGreenstein { g: 0.5 },
    };
    assert_eq!(scene.medium, Some(medium));
}

#[test]
fn what_has_no_effect_is_reported() {
    let transmission = json!({ "transmissionFactor": 1 });
    let solid = json!({ "thicknessFactor": 1 });
    for (extensions, fragment) in [
        (
            json!({ "KHR_materials_volume": solid }),
            "materials[0]: KHR_materials_volume is ignored",
        ),
        (
            json!({ "KHR_materials_transmission": {}, "KHR_materials_volume": solid }),
            "materials[0]: KHR_materials_volume is ignored",
        ),
        (
            json!({ "KHR_materials_transmission": transmission, "ETENDUE_medium": {} }),
            "materials[0]: ETENDUE_medium is ignored",
        ),
        (
            json!({ "KHR_materials_transmission": transmission, "KHR_materials_volume": {}, "ETENDUE_medium": {} }),
            "materials[0]: ETENDUE_medium is ignored",
        ),
    ] {
        let scene = load(extensions.clone());
        assert_eq!(scene.warnings.len(), 1, "{extensions}");
        assert!(scene.warnings[0].contains(fragment), "{:?}", scene.warnings);
        assert_eq!(scene.materials[0].volume, None, "{extensions}");
    }
    let scene = with_medium(json!({ "priority": 1 })).load().unwrap();
    assert!(scene.warnings[0].contains("scenes[0]: ETENDUE_medium: priority is ignored"));
    assert_eq!(scene.medium, Some(Medium::default()));

    let scene = load(json!({
        "KHR_materials_transmission": { "transmissionFactor": 1.5 },
        "KHR_materials_volume": { "thicknessFactor": 1, "attenuationColor": [2, -1, 1], "attenuationDistance": 1 }
    }));
    let m = &scene.materials[0];
    assert_eq!(m.transmission, 1.0);
    let absorption = m.volume.unwrap().medium.absorption;
    assert_eq!(absorption, Vec3::new(0.0, f32::MAX, 0.0));
    for (warning, fragment) in scene.warnings.iter().zip([
        "transmissionFactor 1.5 is clamped to 1",
        "attenuationColor 2 is clamped to 1",
        "attenuationColor -1 is clamped to 0",
    ]) {
        assert!(warning.contains(fragment), "{warning}");
    }
    assert_eq!(scene.warnings.len(), 3);
}

#[test]
fn broken_volumes_and_media_are_refused() {
    let at = |name: &str| format!("/materials/0/extensions/{name}");
    let volume = |key: &str| at(&format!("KHR_materials_volume/{key}"));
    let transmission = |key: &str| at(&format!("KHR_materials_transmission/{key}"));
    assert_all_refused(&[
        (
            &transmission("transmissionTexture"),
            json!({ "index": 9 }),
            &["materials[0].transmissionTexture", "textures[9]"],
        ),
        (
            &transmission("transmissionFactor"),
            json!("all"),
            &["string \"all\"", "line"],
        ),
        (
            &volume("thicknessFactor"),
            json!(-1),
            &["materials[0]: thicknessFactor -1 is negative"],
        ),
        (
            &volume("thicknessFactor"),
            json!([1]),
            &["expected f64", "line"],
        ),
        (
            &volume("attenuationDistance"),
            json!(0),
            &["materials[0]: attenuationDistance must be positive"],
        ),
        (
            &volume("attenuationDistance"),
            json!(-2),
            &["attenuationDistance must be positive"],
        ),
        (
            &volume("attenuationDistance"),
            json!("Infinity"),
            &["expected f64", "line"],
        ),
        (
            &volume("attenuationColor"),
            json!([1, 1]),
            &["array of length 3", "line"],
        ),
    ]);
}

#[test]
fn broken_media_are_refused_on_materials_and_scenes() {
    let hg = "henyey-greenstein";
    let cases: [(Value, &str); 17] = [
        (json!({ "absorption": [1, -1, 1] }), "absorption must be"),
        (json!({ "absorption": [1, 1e39, 1] }), "absorption must be"),
        (json!({ "scattering": [-1e-9, 0, 0] }), "scattering must be"),
        (json!({ "scattering": [0, 0, 1e300] }), "scattering must be"),
        (json!({ "rayleigh550": -1 }), "rayleigh550 must be"),
        (json!({ "rayleigh550": 3e38 }), "rayleigh550 must be"),
        (
            json!({ "rayleigh550": 1, "scattering": [1, 1, 1] }),
            "only one of scattering and rayleigh550",
        ),
        (json!({ "phase": "mie" }), "phase \"mie\" is not known"),
        (json!({ "phase": hg, "g": 1 }), "g must lie between"),
        (json!({ "phase": hg, "g": -1 }), "g must lie between"),
        (json!({ "phase": hg, "g": 1e39 }), "g must lie between"),
        // Below 1, but not in fp32.
        (json!({ "phase": hg, "g": 0.999_999_999 }), "g must lie"),
        (json!({ "g": 0.5 }), "henyey-greenstein, not to isotropic"),
        (
            json!({ "rayleigh550": 1, "g": 0.5 }),
            "henyey-greenstein, not to rayleigh",
        ),
        (json!({ "scattering": 1 }), "line"),
        (json!({ "priority": 0.5 }), "line"),
        (json!({ "priority": 1_u64 << 31 }), "line"),
    ];
    for (given, fragment) in cases {
        for user in ["materials[0]", "scenes[0]"] {
            let place = user.replace('[', "/").replace(']', "");
            let pointer = format!("/{place}/extensions/ETENDUE_medium");
            let place = format!("{user}: ETENDUE_medium: ");
            // The parser names lines, the loader places.
            let place = if fragment == "line" { "" } else { &place };
            assert_all_refused(&[(&pointer, given.clone(), &[place, fragment])]);
        }
    }
}
