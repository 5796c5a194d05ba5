//! Nodes, instances, cameras and lights.

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_3};

use etendue::scene::{LightKind, Projection};
use glam::{DMat3, DQuat, DVec3, Vec3};
use serde_json::{Value, json};

use super::builder::*;

/// Transforms are composed in double precision: a few roundings of numbers of order 10.
const ROUNDING: f64 = 1e-13;

#[test]
fn hierarchy_mirrors_and_shares_meshes() {
    let mut asset = Asset::triangle();
    asset.push(
        "/meshes/0/primitives",
        json!({ "attributes": { "POSITION": 0 }, "material": 0 }),
    );
    asset.set("/materials", json!([{ "name": "red" }]));
    asset.set(
        "/nodes",
        json!([
            { "name": "a", "mesh": 0, "translation": [1, 2, 3], "scale": [-1, 2, 1] },
            { "children": [2], "rotation": [0, FRAC_1_SQRT_2, 0, FRAC_1_SQRT_2], "translation": [10, 0, 0] },
            { "mesh": 0, "matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,5,1] },
        ]),
    );
    asset.set("/scenes/0/nodes", json!([1, 0]));
    let scene = asset.load().unwrap();
    assert_eq!(scene.meshes.len(), 2, "one mesh for each primitive");
    let meshes: Vec<u32> = scene.instances.iter().map(|i| i.mesh).collect();
    assert_eq!(meshes, [0, 1, 0, 1], "shared between the nodes");
    let names: Vec<&str> = scene.instances.iter().map(|i| i.name.as_str()).collect();
    assert_eq!(names, ["a", "a", "node 2", "node 2"]);

    let mirrored = scene.instances[0].world_from_object;
    assert_eq!(mirrored.matrix3.determinant(), -2.0);
    assert_eq!(
        mirrored.transform_point3(DVec3::ONE),
        DVec3::new(0.0, 4.0, 4.0)
    );
    // A quarter turn about +Y takes +Z to +X and +X to −Z.
    let turned = scene.instances[2].world_from_object;
    let p = turned.transform_point3(DVec3::new(1.0, 0.0, 0.0));
    assert!((p - DVec3::new(15.0, 0.0, -1.0)).length() < ROUNDING, "{p}");
    // The first primitive has no material: glTF's default follows those of the file.
    assert_eq!(scene.meshes[0].material, 1);
    assert_eq!(scene.meshes[1].material, 0);
    assert_eq!(scene.materials[1].name, "default");
}

/// A thousand nodes, each turned and scaled, and then as many that undo it.
#[test]
fn deep_hierarchies_keep_their_place() {
    const DEPTH: usize = 1000;
    let (sin, cos) = 0.35f64.sin_cos();
    let mut nodes = Vec::new();
    for i in 0..DEPTH {
        let undo = i >= DEPTH / 2;
        let (sin, scale) = if undo {
            (-sin, 1.0 / 1.01)
        } else {
            (sin, 1.01)
        };
        let mut node = json!({
            "rotation": [sin * 0.6, 0.0, sin * 0.8, cos],
            "scale": [scale, scale, scale],
        });
        if i + 1 < DEPTH {
            node["children"] = json!([i + 1]);
        } else {
            node["mesh"] = json!(0);
        }
        nodes.push(node);
    }
    let mut asset = Asset::triangle();
    asset.set("/nodes", json!(nodes));
    let placed = asset.load().unwrap().instances[0].world_from_object;
    // Rotations about one axis and uniform scales commute.
    let off = (placed.matrix3 - DMat3::IDENTITY).to_cols_array();
    let off = off.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    println!("{DEPTH} nodes: off by {off:.1e}");
    // Quaternions of the file are read in double precision; each product rounds a few times.
    assert!(off <= 1e-10, "{off}");
}

#[test]
fn gpu_instancing_multiplies_instances() {
    let mut asset = Asset::triangle();
    let translations = asset.floats("VEC3", &[0., 0., 0., 4., 0., 0.]);
    let scales = asset.floats("VEC3", &[1., 1., 1., 2., 2., 2.]);
    // A half turn about +Z, quantised.
    let rotations = asset.accessor(I8, "VEC4", 2, &[0, 0, 0, 127, 0, 0, 127, 0]);
    asset.set(&format!("/accessors/{rotations}/normalized"), json!(true));
    asset.set("/nodes/0/translation", json!([0, 0, 1]));
    asset.set(
        "/nodes/0/extensions",
        json!({ "EXT_mesh_gpu_instancing": { "attributes":
            { "TRANSLATION": translations, "SCALE": scales, "ROTATION": rotations } } }),
    );
    asset.set("/extensionsRequired", json!(["EXT_mesh_gpu_instancing"]));
    let scene = asset.load().unwrap();
    assert_eq!((scene.meshes.len(), scene.instances.len()), (1, 2));
    let second = scene.instances[1].world_from_object;
    let p = second.transform_point3(DVec3::new(1.0, 1.0, 0.0));
    assert!((p - DVec3::new(2.0, -2.0, 1.0)).length() < ROUNDING, "{p}");
}

#[test]
fn flattened_instances_are_left_out() {
    let mut asset = Asset::triangle();
    asset.push("/nodes", json!({ "mesh": 0, "scale": [1, 0, 1] }));
    asset.push("/nodes", json!({ "mesh": 0, "scale": [0, 0, 0] }));
    asset.push("/nodes", json!({ "mesh": 0, "scale": [1e-9, 1, 1e9] }));
    asset.push("/nodes", json!({ "mesh": 0, "scale": [1e-6, 1e-6, 1e-6] }));
    asset.set("/scenes/0/nodes", json!([0, 1, 2, 3, 4]));
    let scene = asset.load().unwrap();
    assert_eq!(scene.instances.len(), 2, "the plain and the small one");
    assert_eq!(scene.warnings.len(), 3);
    assert!(scene.warnings[0].contains("\"node 1\" is left out"));
}

#[test]
fn cameras_lose_scale_and_keep_direction() {
    let mut asset = Asset::triangle();
    asset.set(
        "/cameras",
        json!([
            { "type": "perspective", "perspective": { "yfov": 0.5, "aspectRatio": 2.0, "znear": 0.1, "zfar": 10 } },
            { "name": "plan", "type": "orthographic",
              "orthographic": { "xmag": 3, "ymag": 2, "znear": 0, "zfar": 1 } },
        ]),
    );
    let rotation = DQuat::from_rotation_y(FRAC_PI_3);
    asset.push("/nodes", json!({ "camera": 1, "scale": [-3, 2, 5] }));
    asset.push(
        "/nodes",
        json!({ "camera": 0, "rotation": rotation.to_array(), "scale": [4, 4, 4], "translation": [0, 1, 2] }),
    );
    asset.set("/scenes/0/nodes", json!([2, 0, 1]));
    let scene = asset.load().unwrap();
    let [plan, view] = &scene.cameras[..] else {
        panic!("two cameras");
    };
    assert_eq!(plan.name, "plan");
    assert_eq!(
        plan.projection,
        Projection::Orthographic {
            xmag: 3.0,
            ymag: 2.0
        }
    );
    assert_eq!(plan.world_from_camera.matrix3, DMat3::IDENTITY, "rigid");
    assert_eq!(view.name, "camera 1");
    assert_eq!(
        view.projection,
        Projection::Perspective {
            yfov: 0.5,
            aspect: Some(2.0)
        }
    );
    let wanted = DMat3::from_quat(rotation);
    assert!(view.world_from_camera.matrix3.abs_diff_eq(wanted, ROUNDING));
    assert_eq!(
        view.world_from_camera.translation,
        DVec3::new(0.0, 1.0, 2.0)
    );
}

#[test]
fn framing_camera_has_the_whole_box_in_view_and_fills_it() {
    for scale in [1e-6, 1.0, 1e9] {
        for aspect in [0.3, 1.0, 3.0] {
            let mut asset = Asset::triangle();
            let matrix = [
                scale,
                0.,
                0.,
                0.,
                0.,
                2. * scale,
                0.,
                0.,
                0.,
                0.,
                3. * scale,
                0.,
                5. * scale,
                0.,
                0.,
                1.,
            ];
            asset.set("/nodes/0/matrix", json!(matrix));
            let scene = asset.load().unwrap();
            let camera = scene.framing_camera(aspect);
            let Projection::Perspective { yfov, .. } = camera.projection else {
                panic!("perspective");
            };
            let tan = (f64::from(yfov) / 2.0).tan();
            let (low, high) = scene.bounds().unwrap();
            let mut widest = 0.0_f64;
            for corner in [low, high, low.with_x(high.x), low.with_y(high.y)] {
                let p = camera.world_from_camera.inverse().transform_point3(corner);
                assert!(p.z < 0.0, "in front");
                let across = (p.x / -p.z / tan / aspect).abs();
                widest = widest.max(across).max((p.y / -p.z / tan).abs());
            }
            // The box fills the view but for the margin of 5 %.
            assert!(widest <= 1.0 && widest > 0.9, "{scale} {aspect}: {widest}");
        }
    }
}

fn lit(light: Value) -> Asset {
    let mut asset = Asset::triangle();
    asset.set(
        "/extensions",
        json!({ "KHR_lights_punctual": { "lights": [light] } }),
    );
    asset.push(
        "/nodes",
        json!({ "name": "lamp", "translation": [1, 2, 3], "rotation": [FRAC_1_SQRT_2, 0, 0, FRAC_1_SQRT_2],
                "scale": [2, 2, 2], "extensions": { "KHR_lights_punctual": { "light": 0 } } }),
    );
    asset.set("/scenes/0/nodes", json!([0, 1]));
    asset.set("/extensionsUsed", json!(["KHR_lights_punctual"]));
    asset
}

#[test]
fn lights_keep_their_units_and_shine_along_minus_z() {
    let color = [0.5, 0.25, 1.0];
    let spot = json!({ "innerConeAngle": 0.25, "outerConeAngle": 0.5 });
    for (kind, spot, wanted) in [
        ("point", Value::Null, LightKind::Point),
        ("directional", Value::Null, LightKind::Directional),
        (
            "spot",
            spot,
            LightKind::Spot {
                cos_inner: 0.25_f64.cos() as f32,
                cos_outer: 0.5_f64.cos() as f32,
            },
        ),
        (
            "spot",
            json!({}),
            LightKind::Spot {
                cos_inner: 1.0,
                cos_outer: std::f64::consts::FRAC_PI_4.cos() as f32,
            },
        ),
    ] {
        let light =
            json!({ "type": kind, "color": color, "intensity": 8.0, "spot": spot, "range": 3.0 });
        let scene = lit(light).load().unwrap();
        let light = &scene.lights[0];
        assert_eq!(light.kind, wanted);
        assert_eq!(light.name, "lamp");
        assert_eq!(
            light.intensity,
            Vec3::new(4.0, 2.0, 8.0),
            "scale has no say"
        );
        assert_eq!(light.position, DVec3::new(1.0, 2.0, 3.0));
        // A quarter turn about +X takes −Z to +Y.
        assert!((light.direction - Vec3::Y).length() < 1e-6);
        assert_eq!(scene.warnings, [""; 0]);
    }
}

#[test]
fn broken_lights_are_refused() {
    for (light, fragment) in [
        (json!({ "type": "area" }), "type \"area\" is not known"),
        (json!({}), "type is missing"),
        (json!({ "type": "point", "intensity": -1 }), "not negative"),
        (json!({ "type": "point", "intensity": 1e39 }), "finite"),
        (
            json!({ "type": "point", "color": [1, -1, 1] }),
            "not negative",
        ),
        (
            json!({ "type": "spot", "spot": { "innerConeAngle": 0.5, "outerConeAngle": 0.5 } }),
            "cone angles",
        ),
        (
            json!({ "type": "spot", "spot": { "outerConeAngle": 1.6 } }),
            "cone angles",
        ),
        (
            json!({ "type": "spot", "spot": { "innerConeAngle": -0.1 } }),
            "cone angles",
        ),
    ] {
        let case = light.to_string();
        let what = refusal(lit(light).load(), &case);
        assert!(what.contains("KHR_lights_punctual.lights[0]"), "{what}");
        assert!(what.contains(fragment), "{case}: {what}");
    }
}
