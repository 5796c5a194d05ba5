//! Broken files: each is one change to a file that loads, and each is refused
//! with [`etendue::Error::Scene`] and a message that names where and what.

use serde_json::{Value, json};

use super::builder::*;
use super::shading::textured;

/// A file that uses everything the cases below break, and loads without warnings.
pub fn whole() -> Asset {
    let mut asset = textured(json!({
        "pbrMetallicRoughness": { "baseColorTexture": { "index": 1 } },
        "emissiveFactor": [1, 1, 1],
        "alphaMode": "MASK",
        "extensions": {
            "KHR_materials_emissive_strength": { "emissiveStrength": 5 },
            "KHR_materials_ior": { "ior": 1.5 },
            "KHR_materials_specular": { "specularColorFactor": [1, 1, 1] },
            "KHR_materials_transmission": { "transmissionFactor": 1 },
            "KHR_materials_volume": { "thicknessFactor": 1, "attenuationDistance": 2 },
            "ETENDUE_medium": { "phase": "henyey-greenstein", "g": 0.5 }
        }
    }));
    let indices = asset.accessor(U16, "SCALAR", 3, &[0, 0, 1, 0, 2, 0]);
    asset.set("/meshes/0/primitives/0/indices", json!(indices));
    let normals = asset.floats("VEC3", &[0., 0., 1., 0., 0., 1., 0., 0., 1.]);
    asset.attribute("NORMAL", normals);
    let sparse_indices = asset.view(&[0, 2]);
    let sparse_values = asset.view(&le_bytes(&[1.0; 8]));
    let colors = asset.floats("VEC4", &[1.0; 12]);
    asset.set(
        &format!("/accessors/{colors}/sparse"),
        json!({ "count": 2, "indices": { "bufferView": sparse_indices, "componentType": U8 },
                "values": { "bufferView": sparse_values } }),
    );
    asset.attribute("COLOR_0", colors);
    asset.set(
        "/cameras",
        json!([
            { "type": "perspective", "perspective": { "yfov": 1, "aspectRatio": 1, "znear": 0.1, "zfar": 10 } },
            { "type": "orthographic", "orthographic": { "xmag": 1, "ymag": 1, "znear": 0, "zfar": 10 } },
        ]),
    );
    asset.push("/nodes", json!({ "camera": 0, "children": [2] }));
    asset.push("/nodes", json!({ "camera": 1, "rotation": [0, 0, 0, 1] }));
    asset.set("/scenes/0/nodes", json!([0, 1]));
    asset.set(
        "/scenes/0/extensions",
        json!({ "ETENDUE_medium": { "scattering": [1, 1, 1] } }),
    );
    asset
}

/// Positions, texture coordinates, indices, normals and colours are these accessors.
const POSITION: usize = 0;
const COORDINATES: usize = 1;
const INDICES: usize = 2;
const NORMALS: usize = 3;
const COLORS: usize = 4;

#[test]
fn the_file_to_break_is_whole() {
    let scene = whole().load().unwrap();
    assert_eq!(scene.warnings, [""; 0]);
    assert_eq!(scene.cameras.len(), 2);
    let accessor = |name: &str| {
        let pointer = format!("/meshes/0/primitives/0/{name}");
        whole().json.pointer(&pointer).unwrap().as_u64().unwrap() as usize
    };
    assert_eq!(accessor("attributes/POSITION"), POSITION);
    assert_eq!(accessor("attributes/TEXCOORD_0"), COORDINATES);
    assert_eq!(accessor("indices"), INDICES);
    assert_eq!(accessor("attributes/NORMAL"), NORMALS);
    assert_eq!(accessor("attributes/COLOR_0"), COLORS);
}

/// Each row: where, what is put there, and what the message must hold.
pub fn assert_all_refused(rows: &[(&str, Value, &[&str])]) {
    for (pointer, value, fragments) in rows {
        let mut asset = whole();
        asset.set(pointer, value.clone());
        let case = format!("{pointer} = {value}");
        let what = refusal(asset.load(), &case);
        for fragment in *fragments {
            assert!(
                what.contains(fragment),
                "{case}: no {fragment:?} in {what:?}"
            );
        }
    }
}

#[test]
fn broken_structure_is_refused() {
    assert_all_refused(&[
        ("/asset", json!({}), &["asset.version is missing"]),
        (
            "/asset/version",
            json!("1.0"),
            &["version \"1.0\" is not supported"],
        ),
        (
            "/asset/minVersion",
            json!("2.1"),
            &["version \"2.1\" is not supported"],
        ),
        ("/scene", json!(1), &["scenes[1]", "there are 1"]),
        ("/scene", json!(-1), &["not valid glTF JSON", "line 1"]),
        ("/scene", json!(0.5), &["not valid glTF JSON"]),
        ("/scenes/0/nodes", json!([]), &["nothing to render"]),
        (
            "/scenes/0/nodes",
            json!([7]),
            &["scenes[0].nodes", "nodes[7]"],
        ),
        (
            "/scenes/0/nodes",
            json!([0, 0]),
            &["nodes[0] is listed twice"],
        ),
        ("/scenes/0/nodes", json!([0, 2]), &["nodes[2] is no root"]),
        ("/meshes", json!([]), &["nodes[0].mesh", "meshes[0]"]),
        ("/meshes/0/primitives", json!([]), &["nothing to render"]),
        (
            "/meshes/0/primitives",
            json!([{}]),
            &["missing field `attributes`"],
        ),
        ("/nodes/0/mesh", json!(1), &["nodes[0].mesh", "meshes[1]"]),
        (
            "/nodes/1/children",
            json!([9]),
            &["nodes[1].children", "nodes[9]"],
        ),
        (
            "/nodes/0/children",
            json!([2]),
            &["nodes[2] has two parents, nodes[0] and nodes[1]"],
        ),
        (
            "/nodes/1/children",
            json!([2, 2]),
            &["nodes[2] has two parents"],
        ),
        ("/nodes/1/children", json!([1]), &["cycle"]),
        ("/nodes/2/children", json!([1]), &["cycle"]),
        (
            "/nodes/2/rotation",
            json!([0, 0, 0, 0]),
            &["nodes[2]", "unit quaternion"],
        ),
        (
            "/nodes/2/matrix",
            json!(vec![1; 16]),
            &["nodes[2] has both"],
        ),
        (
            "/nodes/0/matrix",
            json!([1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]),
            &["nodes[0]", "last row"],
        ),
        (
            "/nodes/0/matrix",
            json!([1, 0, 0]),
            &["not valid glTF JSON"],
        ),
        (
            "/nodes/0/translation",
            json!([1e300, 0, 0]),
            &["nodes[0]", "not finite or beyond 1e18"],
        ),
        (
            "/nodes/0/scale",
            json!([1e19, 1e19, 1e19]),
            &["nodes[0] places vertices farther out"],
        ),
        (
            "/nodes/1/scale",
            json!([1, 1, 0]),
            &["nodes[1]", "no direction"],
        ),
        (
            "/nodes/1/camera",
            json!(2),
            &["nodes[1].camera", "cameras[2]"],
        ),
        (
            "/meshes/0/primitives/0/material",
            json!(1),
            &["meshes[0].primitives[0].material", "materials[1]"],
        ),
        (
            "/meshes/0/primitives/0/mode",
            json!(7),
            &["meshes[0].primitives[0]: mode 7"],
        ),
    ]);
}

#[test]
fn broken_buffers_and_accessors_are_refused() {
    let at = |i: usize, key: &str| format!("/accessors/{i}/{key}");
    let huge = json!(u64::MAX);
    assert_all_refused(&[
        ("/buffers", json!([]), &["buffers[0]", "there are 0"]),
        (
            "/buffers",
            json!([{ "byteLength": 4 }]),
            &["buffers[0]: data is missing"],
        ),
        (
            "/buffers",
            json!([{ "uri": "data:,abc" }]),
            &["buffers[0]: byteLength is missing"],
        ),
        (
            "/buffers",
            json!([{ "byteLength": 4, "uri": "data:,abc" }]),
            &["byteLength is 4, but only 3"],
        ),
        (
            "/buffers",
            json!([{ "byteLength": 1, "uri": "data:;base64,A*==" }]),
            &["not valid base64"],
        ),
        (
            "/buffers",
            json!([{ "byteLength": 1, "uri": "data:,%4" }]),
            &["bad percent escape"],
        ),
        (
            "/buffers",
            json!([{ "byteLength": 1, "uri": "data:text" }]),
            &["no comma"],
        ),
        (
            "/buffers",
            json!([{ "byteLength": 1, "uri": "gone.bin" }]),
            &["buffers[0]", "\"gone.bin\" is missing"],
        ),
        (
            "/buffers",
            json!([{ "byteLength": 1, "uri": "../up.bin" }]),
            &["buffers[0]", "uses .."],
        ),
        (
            "/bufferViews/0/buffer",
            json!(1),
            &["bufferViews[0]", "buffers[1]"],
        ),
        (
            "/bufferViews/0/byteOffset",
            huge.clone(),
            &["bufferViews[0]", "reach past"],
        ),
        (
            "/bufferViews/0/byteLength",
            json!(1_u64 << 40),
            &["bufferViews[0]", "reach past"],
        ),
        (
            "/bufferViews/0/byteLength",
            json!(35),
            &["accessors[0]", "reach past the 35 bytes"],
        ),
        (
            "/bufferViews/0/byteStride",
            json!(8),
            &["byteStride 8 is less than the 12 bytes"],
        ),
        (
            "/bufferViews/0/byteStride",
            json!(256),
            &["bufferViews[0]: byteStride must be in 4 … 252"],
        ),
        (
            &at(POSITION, "bufferView"),
            json!(99),
            &[
                "accessors[0] (POSITION of meshes[0].primitives[0])",
                "bufferViews[99]",
            ],
        ),
        (
            &at(POSITION, "count"),
            json!(4),
            &["accessors[0]", "4 elements of 12 bytes"],
        ),
        (
            &at(POSITION, "count"),
            json!(0),
            &["accessors[0]", "count is missing or 0"],
        ),
        (
            &at(POSITION, "count"),
            huge.clone(),
            &["accessors[0]", "reach past"],
        ),
        (
            &at(POSITION, "count"),
            json!(u64::MAX / 12 + 2),
            &["accessors[0]", "reach past"],
        ),
        (
            &at(POSITION, "byteOffset"),
            huge.clone(),
            &["accessors[0]", "reach past"],
        ),
        (
            &at(POSITION, "type"),
            json!("VEC5"),
            &["unknown variant `VEC5`"],
        ),
        (
            &at(POSITION, "type"),
            json!("VEC2"),
            &["accessors[0]", "type Vec2 is not allowed"],
        ),
        (
            &at(POSITION, "componentType"),
            json!(U32),
            &["accessors[0]", "U32 is not allowed"],
        ),
        (
            &at(POSITION, "componentType"),
            json!(5124),
            &["accessors[0]", "componentType 5124 is not known"],
        ),
        (
            &at(POSITION, "normalized"),
            json!(true),
            &["F32 (normalized) is not allowed"],
        ),
        (
            &at(INDICES, "componentType"),
            json!(I16),
            &["accessors[2] (indices", "I16 is not allowed"],
        ),
        (
            &at(INDICES, "type"),
            json!("VEC3"),
            &["accessors[2]", "type Vec3"],
        ),
        (
            &at(COORDINATES, "componentType"),
            json!(U16),
            &["accessors[1]", "U16 is not allowed"],
        ),
        (
            &at(NORMALS, "count"),
            json!(2),
            &["accessors[3]", "count is 2, but POSITION has 3"],
        ),
        (
            &at(COLORS, "sparse/count"),
            json!(4),
            &["accessors[4]", "sparse.count must be in 1 … 3"],
        ),
        (
            &at(COLORS, "sparse/count"),
            json!(3),
            &["accessors[4]", "sparse.indices", "reach past"],
        ),
        (
            &at(COLORS, "sparse/indices/byteOffset"),
            huge,
            &["sparse.indices", "reach past"],
        ),
        (
            &at(COLORS, "sparse/indices/componentType"),
            json!(F32),
            &["sparse indices cannot be F32"],
        ),
        (
            &at(COLORS, "sparse/values"),
            json!({}),
            &["sparse.values: bufferView is missing"],
        ),
        (
            "/meshes/0/primitives/0/attributes/POSITION",
            json!(50),
            &["POSITION of meshes[0].primitives[0]", "accessors[50]"],
        ),
    ]);
}

#[test]
fn broken_numbers_are_refused() {
    let change = |view: usize, offset: usize, bytes: &[u8]| {
        let mut asset = whole();
        let start = asset.json["bufferViews"][view]["byteOffset"]
            .as_u64()
            .unwrap() as usize
            + offset;
        asset.bytes[start..start + bytes.len()].copy_from_slice(bytes);
        refusal(asset.load(), &format!("view {view} at {offset}"))
    };
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1.1e18, -1e38] {
        for component in 0..9 {
            let what = change(0, 4 * component, &bad.to_le_bytes());
            assert!(
                what.contains(&format!("vertex {} is at", component / 3)),
                "{what}"
            );
        }
    }
    let what = change(1, 8, &f32::NAN.to_le_bytes());
    assert!(
        what.contains("accessors[1]") && what.contains("element 1 is not finite"),
        "{what}"
    );
    let what = change(2, 2, &[3, 0]);
    assert!(
        what.contains("accessors[2]") && what.contains("index 3 at 1 is out of range"),
        "{what}"
    );
    let what = change(4, 1, &[3]);
    assert!(what.contains("sparse index 3 is out of range"), "{what}");
    let what = change(4, 1, &[0]);
    assert!(what.contains("do not increase"), "{what}");
    let what = change(5, 0, &f32::INFINITY.to_le_bytes());
    assert!(what.contains("accessors[4] (COLOR_0"), "{what}");
}
