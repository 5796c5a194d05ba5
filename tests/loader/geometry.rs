//! Accessors, topologies and attributes: every number that comes out is known.

use etendue::scene::gltf::Limits;
use glam::{Vec2, Vec3, Vec4};
use serde_json::json;

use super::builder::*;

/// Six points in general position (no three on a line), as x, y, z.
fn fan_of_points(asset: &mut Asset) {
    let points: Vec<f32> = (0..6_u8)
        .flat_map(|i| [f32::from(i), f32::from(i) * f32::from(i), 1.0])
        .collect();
    let positions = asset.floats("VEC3", &points);
    asset.attribute("POSITION", positions);
}

#[test]
fn indices_of_every_type_are_read() {
    let wanted = [[0, 1, 2], [2, 3, 0], [5, 4, 1]];
    let flat: Vec<u32> = wanted.into_iter().flatten().collect();
    for component in [U8, U16, U32] {
        let bytes: Vec<u8> = flat
            .iter()
            .flat_map(|i| match component {
                U8 => vec![*i as u8],
                U16 => (*i as u16).to_le_bytes().to_vec(),
                _ => i.to_le_bytes().to_vec(),
            })
            .collect();
        let mut asset = Asset::new();
        fan_of_points(&mut asset);
        let indices = asset.accessor(component, "SCALAR", flat.len(), &bytes);
        asset.set("/meshes/0/primitives/0/indices", json!(indices));
        let scene = asset.load().unwrap();
        assert_eq!(scene.meshes[0].triangles, wanted, "{component}");
        assert_eq!(scene.warnings, [""; 0]);
    }
}

#[test]
fn strips_and_fans_keep_the_winding_of_the_specification() {
    let strip = [[0, 1, 2], [1, 3, 2], [2, 3, 4], [3, 5, 4]];
    let fan = [[1, 2, 0], [2, 3, 0], [3, 4, 0], [4, 5, 0]];
    let list = [[0, 1, 2], [3, 4, 5]];
    for (mode, wanted) in [(4, &list[..]), (5, &strip[..]), (6, &fan[..])] {
        let mut asset = Asset::new();
        fan_of_points(&mut asset);
        asset.set("/meshes/0/primitives/0/mode", json!(mode));
        assert_eq!(asset.load().unwrap().meshes[0].triangles, wanted, "{mode}");
    }
}

#[test]
fn interleaved_and_offset_attributes_are_read() {
    // position, two bytes of colour padding, uv: stride 24, first element at 4.
    let mut bytes = vec![0xFF; 4];
    for i in 0..3_u8 {
        let x = f32::from(i);
        bytes.extend(le_bytes(&[x, x * x, -1.0]));
        bytes.extend([i * 10, i * 20, 255, 0]);
        bytes.extend(le_bytes(&[x / 2.0, 0.25]));
    }
    let mut asset = Asset::new();
    let view = asset.view(&bytes);
    asset.set(&format!("/bufferViews/{view}/byteStride"), json!(24));
    for (name, offset, component, shape) in [
        ("POSITION", 4, F32, "VEC3"),
        ("COLOR_0", 16, U8, "VEC3"),
        ("TEXCOORD_0", 20, F32, "VEC2"),
    ] {
        let accessor = asset.push(
            "/accessors",
            json!({ "bufferView": view, "byteOffset": offset, "componentType": component,
                    "type": shape, "count": 3, "normalized": component == U8 }),
        );
        asset.attribute(name, accessor);
    }
    let scene = asset.load().unwrap();
    let mesh = &scene.meshes[0];
    assert_eq!(
        mesh.positions,
        [
            Vec3::new(0., 0., -1.),
            Vec3::new(1., 1., -1.),
            Vec3::new(2., 4., -1.)
        ]
    );
    assert_eq!(
        mesh.uvs[0],
        [
            Vec2::new(0., 0.25),
            Vec2::new(0.5, 0.25),
            Vec2::new(1., 0.25)
        ]
    );
    assert_eq!(
        mesh.colors[2],
        Vec4::new(20.0 / 255.0, 40.0 / 255.0, 1.0, 1.0)
    );
    assert!(mesh.normals.is_empty() && mesh.tangents.is_empty() && mesh.uvs[1].is_empty());
}

#[test]
fn sparse_accessors_replace_values_with_and_without_a_base() {
    for has_base in [true, false] {
        let mut asset = Asset::new();
        let indices = asset.view(&[1, 2]);
        let values = asset.view(&le_bytes(&[5., 0., 0., 0., 7., 0.]));
        let base = asset.view(&le_bytes(&[1., 1., 1., 2., 2., 2., 3., 3., 3.]));
        let mut accessor = json!({
            "componentType": F32, "type": "VEC3", "count": 3,
            "sparse": { "count": 2, "indices": { "bufferView": indices, "componentType": U8 },
                        "values": { "bufferView": values } }
        });
        if has_base {
            accessor["bufferView"] = json!(base);
        }
        let accessor = asset.push("/accessors", accessor);
        asset.attribute("POSITION", accessor);
        let first = if has_base { Vec3::ONE } else { Vec3::ZERO };
        assert_eq!(
            asset.load().unwrap().meshes[0].positions,
            [first, Vec3::new(5., 0., 0.), Vec3::new(0., 7., 0.)]
        );
    }
}

#[test]
fn quantized_positions_of_every_type_are_read() {
    // (component, normalized, bytes of one number, the number)
    let cases: [(u32, bool, &[u8], f32); 8] = [
        (I8, false, &[0x80], -128.0),
        (I8, true, &[0x80], -1.0),
        (U8, false, &[200], 200.0),
        (U8, true, &[51], 0.2),
        (I16, false, &[0x00, 0x80], -32768.0),
        (I16, true, &[0xFF, 0x7F], 1.0),
        (U16, false, &[0xFF, 0xFF], 65535.0),
        (U16, true, &[0x33, 0x33], 0.2),
    ];
    for (component, normalized, number, wanted) in cases {
        let zero = vec![0; number.len()];
        // (n, 0, 0), (0, n, 0), (0, 0, n), each padded to a multiple of four bytes.
        let mut bytes = Vec::new();
        for axis in 0..3 {
            for k in 0..4 {
                bytes.extend(if k == axis { number } else { &zero });
            }
        }
        let mut asset = Asset::new();
        let accessor = asset.accessor(component, "VEC3", 3, &bytes);
        asset.set(
            &format!("/accessors/{accessor}/normalized"),
            json!(normalized),
        );
        asset.set("/bufferViews/0/byteStride", json!(4 * number.len()));
        asset.attribute("POSITION", accessor);
        assert!(
            refusal(asset.load(), "no extension").contains("not allowed"),
            "integers need KHR_mesh_quantization"
        );
        asset.set("/extensionsUsed", json!(["KHR_mesh_quantization"]));
        asset.set("/extensionsRequired", json!(["KHR_mesh_quantization"]));
        assert_eq!(
            asset.load().unwrap().meshes[0].positions,
            [Vec3::X * wanted, Vec3::Y * wanted, Vec3::Z * wanted],
            "{component} {normalized}"
        );
    }
}

#[test]
fn normals_and_tangents_are_unit_and_bad_normals_are_rebuilt() {
    let mut asset = Asset::triangle();
    let normals = asset.floats("VEC3", &[0., 0., 2., 0., 0., 0., f32::NAN, 0., 1.]);
    asset.attribute("NORMAL", normals);
    let tangents = asset.floats("VEC4", &[3., 0., 0., 1., 0., 1., 0., -1., 1., 0., 0., 1.]);
    asset.attribute("TANGENT", tangents);
    let scene = asset.load().unwrap();
    // The triangle lies in the plane z = 0, counter-clockwise from +z.
    assert_eq!(scene.meshes[0].normals, [Vec3::Z; 3]);
    assert_eq!(
        scene.meshes[0].tangents,
        [
            Vec4::new(1., 0., 0., 1.),
            Vec4::new(0., 1., 0., -1.),
            Vec4::new(1., 0., 0., 1.)
        ]
    );
    assert!(scene.warnings[0].contains("2 normals are zero or not finite"));

    // Without normals tangents are ignored; a zero tangent drops them all.
    asset.remove("/meshes/0/primitives/0/attributes/NORMAL");
    assert!(asset.load().unwrap().meshes[0].tangents.is_empty());
    asset.attribute("NORMAL", normals);
    let zero = asset.floats("VEC4", &[0.0; 12]);
    asset.attribute("TANGENT", zero);
    let scene = asset.load().unwrap();
    assert!(scene.meshes[0].tangents.is_empty());
    assert!(scene.warnings[1].contains("tangents of this mesh are left out"));
}

#[test]
fn degenerate_triangles_are_dropped_and_unused_vertices_with_them() {
    let mut asset = Asset::new();
    fan_of_points(&mut asset);
    // A repeated index, a triangle on a line (vertex 6, 7 and 0), and two good ones around it.
    let points = [
        0., 0., 1., 1., 1., 1., 2., 4., 1., 9., 9., 9., 4., 16., 1., 5., 25., 1., 0., 0., 2., 0.,
        0., 3.,
    ];
    let positions = asset.floats("VEC3", &points);
    asset.attribute("POSITION", positions);
    let indices = [5, 4, 1, 1, 1, 2, 0, 6, 7, 0, 1, 2];
    let indices = asset.accessor(U8, "SCALAR", 12, &indices);
    asset.set("/meshes/0/primitives/0/indices", json!(indices));
    let scene = asset.load().unwrap();
    let mesh = &scene.meshes[0];
    // Vertices 3, 6 and 7 are used by no triangle that is left: 4 and 5 move up.
    assert_eq!(mesh.triangles, [[4, 3, 1], [0, 1, 2]]);
    assert_eq!(mesh.positions.len(), 5);
    assert_eq!(mesh.positions[3], Vec3::new(4., 16., 1.));
    assert_eq!(scene.warnings.len(), 1);
    assert!(scene.warnings[0].contains("2 of 4 triangles without area"));
}

#[test]
fn colors_above_one_are_clamped() {
    let mut asset = Asset::triangle();
    let colors = asset.floats("VEC4", &[1., 0.5, 0., 0.25, 2., 0., 0., 1., 0., 0., 0., 1.]);
    asset.attribute("COLOR_0", colors);
    let scene = asset.load().unwrap();
    let wanted = [
        Vec4::new(1., 0.5, 0., 0.25),
        Vec4::new(1., 0., 0., 1.),
        Vec4::new(0., 0., 0., 1.),
    ];
    assert_eq!(scene.meshes[0].colors, wanted);
    assert!(scene.warnings[0].contains("1 colours are clamped"));
}

#[test]
fn points_and_missing_positions_are_skipped_with_a_warning() {
    let mut asset = Asset::triangle();
    let line = json!({ "attributes": { "POSITION": 0 }, "mode": 1 });
    asset.push("/meshes/0/primitives", line);
    asset.push("/meshes/0/primitives", json!({ "attributes": {} }));
    let scene = asset.load().unwrap();
    assert_eq!((scene.meshes.len(), scene.instances.len()), (1, 1));
    assert!(scene.warnings[0].contains("points and lines"));
    assert!(scene.warnings[1].contains("no POSITION"));
}

#[test]
fn glb_and_gltf_give_the_same_scene_and_different_hashes() {
    let asset = Asset::triangle();
    let text = asset.load().unwrap();
    let binary = load_bytes(&asset.to_glb(), &Limits::default()).unwrap();
    assert_eq!(text.meshes[0].positions, binary.meshes[0].positions);
    assert_ne!(text.hash, binary.hash);
    assert_eq!(text.hash.len(), 64);
}
