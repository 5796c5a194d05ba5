//! Broken cameras, materials and textures, and every limit. As in the module
//! `broken`, each case is one change to a file that loads.

use etendue::scene::gltf::Limits;
use serde_json::{Value, json};

use super::broken::{assert_all_refused, whole};
use super::builder::*;

#[test]
fn broken_cameras_are_refused() {
    let p = "/cameras/0/perspective";
    let o = "/cameras/1/orthographic";
    let at = |camera: &str, key: &str| format!("{camera}/{key}");
    let first: &[&str] = &["cameras[0].perspective: yfov"];
    assert_all_refused(&[
        (
            "/cameras/0/type",
            json!("fisheye"),
            &["cameras[0]: type \"fisheye\""],
        ),
        ("/cameras/0", json!({}), &["cameras[0]: type is missing"]),
        (
            "/cameras/0",
            json!({ "type": "perspective" }),
            &["cameras[0]: perspective is missing"],
        ),
        (&at(p, "yfov"), json!(0), first),
        (&at(p, "yfov"), json!(-1), first),
        (&at(p, "yfov"), json!(std::f64::consts::PI), first),
        (&at(p, "yfov"), json!(1e-60), first),
        (&at(p, "yfov"), Value::Null, first),
        (
            &at(p, "aspectRatio"),
            json!(0),
            &["aspectRatio 0 is not positive"],
        ),
        (&at(p, "aspectRatio"), json!(-1), &["aspectRatio -1"]),
        (&at(p, "znear"), json!(0), &["znear 0 is not positive"]),
        (
            &at(p, "zfar"),
            json!(0.1),
            &["zfar 0.1 is not beyond znear 0.1"],
        ),
        (
            &at(o, "xmag"),
            json!(0),
            &["cameras[1].orthographic: xmag 0"],
        ),
        (
            &at(o, "ymag"),
            json!(1e39),
            &["cameras[1].orthographic: ymag"],
        ),
        (&at(o, "znear"), json!(-1), &["znear -1 is negative"]),
        (&at(o, "zfar"), json!(0), &["zfar 0 is not beyond znear 0"]),
        (&at(o, "zfar"), Value::Null, &["zfar is missing"]),
    ]);
}

#[test]
fn broken_materials_and_textures_are_refused() {
    let extensions = "/materials/0/extensions";
    let strength = &format!("{extensions}/KHR_materials_emissive_strength/emissiveStrength");
    let ior = &format!("{extensions}/KHR_materials_ior/ior");
    let specular = &format!("{extensions}/KHR_materials_specular/specularColorFactor");
    let base = "/materials/0/pbrMetallicRoughness/baseColorTexture";
    let transform = |t: Value| json!({ "KHR_texture_transform": t });
    let broken_png = data_uri(&png(1, 1, &[0; 4])[..40]);
    assert_all_refused(&[
        (
            "/materials/0/emissiveFactor",
            json!([1, -1, 1]),
            &["materials[0]", "not negative"],
        ),
        (
            "/materials/0/emissiveFactor",
            json!([1, 1e39, 1]),
            &["materials[0]", "finite"],
        ),
        (strength, json!(-5), &["materials[0]", "emissiveStrength"]),
        (strength, json!(1e39), &["materials[0]", "finite"]),
        (
            ior,
            json!(0.5),
            &["materials[0]: ior 0.5 is neither 0 nor ≥ 1"],
        ),
        (ior, json!(-1.5), &["ior -1.5"]),
        (ior, json!(1e39), &["ior"]),
        (specular, json!([-1, 0, 0]), &["specularColorFactor"]),
        (
            "/materials/0/alphaMode",
            json!("ADD"),
            &["materials[0]: alphaMode \"ADD\""],
        ),
        ("/materials/0/alphaCutoff", json!(-1), &["alphaCutoff"]),
        (
            "/materials/0/normalTexture",
            json!({ "index": 0, "scale": 1e39 }),
            &["materials[0].normalTexture: scale"],
        ),
        (
            "/materials/0/normalTexture",
            json!({}),
            &["normalTexture: index is missing"],
        ),
        (
            &format!("{base}/index"),
            json!(2),
            &["materials[0].baseColorTexture", "textures[2]"],
        ),
        (
            &format!("{base}/extensions"),
            transform(json!({ "scale": [1e39, 1] })),
            &["KHR_texture_transform is not finite"],
        ),
        (
            &format!("{base}/extensions"),
            transform(json!({ "texCoord": 3 })),
            &["texCoord 3"],
        ),
        (
            "/textures/1/source",
            json!(1),
            &["textures[1]", "images[1]"],
        ),
        (
            "/textures/1/sampler",
            json!(1),
            &["textures[1]", "samplers[1]"],
        ),
        ("/samplers/0/wrapS", json!(1), &["samplers[0]: wrapS 1"]),
        (
            "/samplers/0/magFilter",
            json!(9987),
            &["samplers[0]: magFilter 9987"],
        ),
        (
            "/samplers/0/minFilter",
            json!(1),
            &["samplers[0]: minFilter 1"],
        ),
        (
            "/images/0",
            json!({}),
            &["images[0]: needs exactly one of uri and bufferView"],
        ),
        (
            "/images/0/uri",
            json!("gone.png"),
            &["images[0]", "\"gone.png\" is missing"],
        ),
        (
            "/images/0/uri",
            json!("data:,GIF89a"),
            &["images[0]", "neither a PNG nor a JPEG"],
        ),
        (
            "/images/0/uri",
            json!(broken_png),
            &["images[0]", "cannot be decoded"],
        ),
        (
            "/images/0/mimeType",
            json!("image/ktx2"),
            &["images[0]: \"image/ktx2\" is not supported"],
        ),
        (
            "/images/0",
            json!({ "bufferView": 77 }),
            &["images[0]", "bufferViews[77]"],
        ),
    ]);
}

#[test]
fn every_limit_is_enforced_and_named() {
    let whole = whole().to_gltf();
    type Change = fn(&mut Limits);
    let cases: [(Change, &str); 7] = [
        (
            |l| l.file_bytes = 100,
            "cap of 100 bytes a file (Limits::file_bytes)",
        ),
        (
            |l| l.total_bytes = 2000,
            "cap of 2000 bytes in total (Limits::total_bytes)",
        ),
        (|l| l.json_bytes = 50, "cap of 50 (Limits::json_bytes)"),
        (
            |l| l.nodes = 2,
            "3 nodes are more than the cap of 2 (Limits::nodes)",
        ),
        (|l| l.instances = 0, "cap of 0 (Limits::instances)"),
        (|l| l.triangles = 0, "cap of 0 (Limits::triangles)"),
        (|l| l.image_side = 1, "cap of 1 × 1 (Limits::image_side)"),
    ];
    for (change, fragment) in cases {
        let mut limits = Limits::default();
        change(&mut limits);
        let what = refusal(load_bytes(whole.as_bytes(), &limits), fragment);
        assert!(what.contains(fragment), "{fragment}: {what}");
    }
}
