//! `etendue info`: devices, and what a scene holds and needs.

use std::fmt::Write;
use std::path::Path;

use etendue::render::{self, DeviceInfo, Memory, SceneModel};
use etendue::scene::{Instance, LightKind, Material, Scene, gltf};
use etendue::settings::Settings;
use serde_json::{Map, Value as Json, json};

use super::args::InfoArgs;
use super::failure::{Failure, Outcome};
use super::stats;
use super::write_stdout;

/// Prints the devices and, with a scene, its description. Without a scene, having
/// no device is a failure; with one it is part of the answer.
pub fn run(args: &InfoArgs) -> Result<Outcome, Failure> {
    let scene = match &args.scene {
        Some(path) => Some(load(path)?),
        None => None,
    };
    let devices = render::devices();
    let text = if args.json {
        let mut root = json!({ "version": env!("CARGO_PKG_VERSION") });
        match &devices {
            Ok(devices) => root["devices"] = devices.iter().map(device_json).collect(),
            Err(error) => {
                root["devices"] = json!([]);
                root["devices_error"] = error.to_string().into();
            }
        }
        if let (Some(path), Some((scene, model))) = (&args.scene, &scene) {
            root["scene"] = scene_json(path, scene, model);
        }
        format!("{root:#}\n")
    } else {
        let mut text = String::new();
        if let (Some(path), Some((scene, model))) = (&args.scene, &scene) {
            write_scene(&mut text, path, scene, model);
        }
        match &devices {
            Ok(devices) => devices.iter().for_each(|d| write_device(&mut text, d)),
            Err(error) => line(&mut text, &format!("no device: {error}")),
        }
        text
    };
    match devices {
        Err(error) if scene.is_none() => {
            if args.json {
                write_stdout(&text)?;
            }
            Err(error.into())
        }
        _ => {
            write_stdout(&text)?;
            Ok(Outcome::Done)
        }
    }
}

fn load(path: &Path) -> Result<(Scene, SceneModel), Failure> {
    let scene = gltf::load(path).map_err(Failure::scene)?;
    let model = render::model(&scene, &Settings::default())?;
    Ok((scene, model))
}

/// What a scene holds, by name.
fn counts(scene: &Scene) -> [(&'static str, u64); 13] {
    let of = |i: &Instance| &scene.materials[scene.meshes[i.mesh as usize].material as usize];
    let placed = |is: fn(&Material) -> bool| scene.instances.iter().filter(|i| is(of(i))).count();
    let inside = scene.materials.iter().filter_map(|m| m.volume);
    let media = inside.map(|v| v.medium).chain(scene.medium);
    let lights = |is: fn(&LightKind) -> bool| scene.lights.iter().filter(|l| is(&l.kind)).count();
    [
        ("meshes", scene.meshes.len()),
        ("instances", scene.instances.len()),
        ("triangles", scene.triangle_count() as usize),
        ("materials", scene.materials.len()),
        ("textures", scene.textures.len()),
        ("solids", placed(|m| m.volume.is_some())),
        (
            "thin_sheets",
            placed(|m| m.volume.is_none() && m.transmission > 0.0),
        ),
        ("media", media.filter(|m| !m.is_clear()).count()),
        ("lights", scene.lights.len()),
        ("point_lights", lights(|k| matches!(k, LightKind::Point))),
        (
            "spot_lights",
            lights(|k| matches!(k, LightKind::Spot { .. })),
        ),
        (
            "directional_lights",
            lights(|k| matches!(k, LightKind::Directional)),
        ),
        ("cameras", scene.cameras.len()),
    ]
    .map(|(name, count)| (name, count as u64))
}

fn device_json(device: &DeviceInfo) -> Json {
    let mut backends = Map::new();
    for (backend, support) in &device.backends {
        let object = match support {
            Ok(()) => json!({ "available": true }),
            Err(lacks) => json!({ "available": false, "lacks": lacks }),
        };
        backends.insert(backend.name().to_owned(), object);
    }
    json!({
        "index": device.index,
        "name": device.name,
        "kind": device.kind,
        "driver": device.driver,
        "api_version": device.api_version,
        "subgroup": device.subgroup,
        "backends": backends,
    })
}

fn scene_json(path: &Path, scene: &Scene, model: &SceneModel) -> Json {
    let counts: Map<_, _> = counts(scene)
        .into_iter()
        .map(|(name, count)| (name.to_owned(), count.into()))
        .collect();
    let features: Map<_, _> = model
        .features
        .iter()
        .map(|f| (f.name.to_owned(), f.on.into()))
        .collect();
    let cameras: Vec<_> = scene.cameras.iter().map(|c| c.name.as_str()).collect();
    let bounds = scene
        .bounds()
        .map(|(low, high)| json!([low.to_array(), high.to_array()]));
    json!({
        "path": path.to_string_lossy(),
        "hash": scene.hash,
        "counts": counts,
        "cameras": cameras,
        "bounds": bounds,
        "bytes_per_triangle": model.bytes_per_triangle,
        "memory": stats::memory(&model.memory),
        "features": features,
        "warnings": scene.warnings,
    })
}

fn write_device(text: &mut String, device: &DeviceInfo) {
    line(
        text,
        &format!(
            "device {}: {}, {}, Vulkan {}, subgroups of {}",
            device.index, device.name, device.kind, device.api_version, device.subgroup
        ),
    );
    line(text, &format!("  driver       {}", device.driver));
    for (backend, support) in &device.backends {
        let support = match support {
            Ok(()) => String::from("yes"),
            Err(lacks) => format!("no: {lacks}"),
        };
        line(text, &format!("  {:12} {support}", backend.name()));
    }
}

fn write_scene(text: &mut String, path: &Path, scene: &Scene, model: &SceneModel) {
    line(text, &format!("scene {}", path.display()));
    for (name, count) in counts(scene) {
        if count > 0 {
            line(text, &format!("  {:19} {count}", name.replace('_', " ")));
        }
    }
    for (index, camera) in scene.cameras.iter().enumerate() {
        line(text, &format!("  camera {index:<12} {}", camera.name));
    }
    if let Some((low, high)) = scene.bounds() {
        line(text, &format!("  bounds              {low} … {high} m"));
    }
    let memory = memory_text(&model.memory);
    line(text, &format!("  memory estimate     {memory}"));
    let per_triangle = model.bytes_per_triangle;
    line(text, &format!("  bytes per triangle  {per_triangle:.1}"));
    for (title, on) in [("model", true), ("compiled out", false)] {
        let features = model.features.iter().filter(|f| f.on == on);
        let names: Vec<_> = features.map(|f| f.name).collect();
        line(text, &format!("  {title:19} {}", names.join(", ")));
    }
    for warning in &scene.warnings {
        line(text, &format!("  warning             {warning}"));
    }
}

fn line(text: &mut String, line: &str) {
    writeln!(text, "{}", line.trim_end()).expect("writing to a string cannot fail");
}

/// Device memory by purpose.
pub fn memory_text(memory: &Memory) -> String {
    format!(
        "{}: geometry {}, acceleration {}, textures {}, tables {}, film {}",
        bytes(memory.total()),
        bytes(memory.geometry),
        bytes(memory.acceleration),
        bytes(memory.textures),
        bytes(memory.tables),
        bytes(memory.film)
    )
}

/// Bytes in the largest binary unit that leaves a whole part.
pub fn bytes(bytes: u64) -> String {
    let mut value = bytes as f64;
    for unit in ["B", "KiB", "MiB", "GiB"] {
        if value < 1024.0 {
            return match unit {
                "B" => format!("{bytes} B"),
                _ => format!("{value:.1} {unit}"),
            };
        }
        value /= 1024.0;
    }
    format!("{value:.1} TiB")
}

#[cfg(test)]
mod tests {
    use etendue::scene::{Medium, Mesh, Volume};

    use super::*;

    #[test]
    fn solids_and_sheets_count_as_often_as_they_are_placed_and_clear_media_not() {
        let transmitting = |volume| Material {
            transmission: 1.0,
            volume,
            ..Material::default()
        };
        let fog = Medium {
            scattering: glam::Vec3::ONE,
            ..Medium::default()
        };
        let volume = |medium| {
            Some(Volume {
                medium,
                priority: 0,
            })
        };
        let mesh = |material| Mesh {
            material,
            ..Mesh::default()
        };
        let placed = |mesh| Instance {
            name: String::new(),
            mesh,
            world_from_object: glam::DAffine3::IDENTITY,
        };
        let scene = Scene {
            materials: vec![
                Material::default(),
                transmitting(None),
                transmitting(volume(Medium::default())),
                transmitting(volume(fog)),
            ],
            meshes: (0..4).map(mesh).collect(),
            instances: [0, 1, 1, 1, 2, 3].map(placed).into(),
            medium: Some(fog),
            ..Scene::default()
        };
        for wanted in [("thin_sheets", 3), ("solids", 2), ("media", 2)] {
            assert!(counts(&scene).contains(&wanted), "{wanted:?}");
        }
    }

    #[test]
    fn bytes_have_fitting_units() {
        let cases = [
            (0, "0 B"),
            (1023, "1023 B"),
            (1536, "1.5 KiB"),
            (5 << 40, "5.0 TiB"),
        ];
        for (count, text) in cases {
            assert_eq!(bytes(count), text);
        }
    }
}
