//! Materials, textures and the environment.

use etendue::Error;
use etendue::scene::gltf::{Limits, load, load_cached};
use etendue::scene::{
    AlphaMode, Environment, Filter, Scene, Texels, TextureRef, Wrap, load_environment,
};
use glam::{Vec3, Vec4};
use serde_json::{Value, json};

use super::builder::*;

/// A triangle with one material and textures 0 and 1 on one 2 × 1 image.
pub fn textured(material: Value) -> Asset {
    let mut asset = Asset::triangle();
    let uvs = asset.floats("VEC2", &[0., 0., 1., 0., 0., 1.]);
    asset.attribute("TEXCOORD_0", uvs);
    asset.attribute("TEXCOORD_1", uvs);
    let png = png(2, 1, &[255, 128, 0, 64, 1, 2, 3, 255]);
    asset.set(
        "/images",
        json!([{ "name": "two", "uri": data_uri(&png).replace("application/octet-stream", "image/png") }]),
    );
    asset.set(
        "/samplers",
        json!([{ "magFilter": 9728, "minFilter": 9987, "wrapS": 33071, "wrapT": 33648 }]),
    );
    asset.set(
        "/textures",
        json!([{ "source": 0 }, { "source": 0, "sampler": 0 }]),
    );
    asset.set("/materials", json!([material]));
    asset.set("/meshes/0/primitives/0/material", json!(0));
    asset
}

const IDENTITY: [[f32; 3]; 2] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

#[test]
fn every_factor_of_a_material_is_read() {
    let asset = textured(json!({
        "name": "all",
        "pbrMetallicRoughness": {
            "baseColorFactor": [0.1, 0.2, 0.3, 0.4], "metallicFactor": 0.5, "roughnessFactor": 0.6,
            "baseColorTexture": { "index": 0 }, "metallicRoughnessTexture": { "index": 0, "texCoord": 1 } },
        "normalTexture": { "index": 0, "scale": 0.7 },
        "occlusionTexture": { "index": 0, "strength": 0.5 },
        "emissiveTexture": { "index": 1 }, "emissiveFactor": [1, 0.5, 0],
        "alphaMode": "MASK", "alphaCutoff": 0.8, "doubleSided": true,
        "extensions": {
            "KHR_materials_emissive_strength": { "emissiveStrength": 100 },
            "KHR_materials_ior": { "ior": 1.33 },
            "KHR_materials_specular": { "specularFactor": 0.9, "specularColorFactor": [2, 1, 0],
                "specularTexture": { "index": 0 }, "specularColorTexture": { "index": 0 } },
            "KHR_materials_unlit": {}
        }
    }));
    let scene = asset.load().unwrap();
    assert_eq!(scene.warnings, [""; 0]);
    let m = &scene.materials[0];
    assert_eq!(m.base_color, Vec4::new(0.1, 0.2, 0.3, 0.4));
    assert_eq!((m.metallic, m.roughness, m.normal_scale), (0.5, 0.6, 0.7));
    assert_eq!(m.emission, Vec3::new(100.0, 50.0, 0.0));
    assert_eq!((m.ior, m.specular), (1.33, 0.9));
    assert_eq!(m.specular_color, Vec3::new(2.0, 1.0, 0.0));
    assert_eq!(m.alpha_mode, AlphaMode::Mask { cutoff: 0.8 });
    assert!(m.double_sided && m.unlit);

    // Three textures: sRGB and linear of the plain sampler, sRGB of the other.
    let at = |texture, uv_set| {
        Some(TextureRef {
            texture,
            uv_set,
            uv_transform: IDENTITY,
        })
    };
    assert_eq!(m.base_color_texture, at(0, 0));
    assert_eq!(m.metallic_roughness_texture, at(1, 1));
    assert_eq!(m.normal_texture, at(1, 0));
    assert_eq!(m.emission_texture, at(2, 0));
    assert_eq!(m.specular_texture, at(1, 0));
    assert_eq!(m.specular_color_texture, at(0, 0));
    let srgb: Vec<bool> = scene
        .textures
        .iter()
        .map(|t| {
            let Texels::Rgba8 { data, srgb } = &t.texels else {
                panic!("eight bits");
            };
            assert_eq!(data, &[255, 128, 0, 64, 1, 2, 3, 255], "bytes as they are");
            *srgb
        })
        .collect();
    assert_eq!(srgb, [true, false, true]);
    let last = &scene.textures[2];
    assert_eq!((last.width, last.height, last.name.as_str()), (2, 1, "two"));
    assert_eq!(last.wrap, [Wrap::Clamp, Wrap::Mirror]);
    assert_eq!(last.filter, Filter::Nearest);
    assert_eq!(scene.textures[0].wrap, [Wrap::Repeat; 2]);
    assert_eq!(scene.textures[0].filter, Filter::Linear);
}

#[test]
fn absent_properties_have_the_defaults_of_the_specification() {
    let scene = textured(json!({})).load().unwrap();
    let m = &scene.materials[0];
    assert_eq!(
        (m.base_color, m.metallic, m.roughness),
        (Vec4::ONE, 1.0, 1.0)
    );
    assert_eq!((m.emission, m.ior, m.specular), (Vec3::ZERO, 1.5, 1.0));
    assert_eq!(m.alpha_mode, AlphaMode::Opaque);
    assert!(!m.double_sided && !m.unlit);
    assert!(scene.textures.is_empty(), "images that nothing uses");
    let masked = textured(json!({ "alphaMode": "MASK" })).load().unwrap();
    assert_eq!(
        masked.materials[0].alpha_mode,
        AlphaMode::Mask { cutoff: 0.5 }
    );
    let blend = textured(json!({ "alphaMode": "BLEND" })).load().unwrap();
    assert_eq!(blend.materials[0].alpha_mode, AlphaMode::Blend);
}

#[test]
fn factors_that_would_create_energy_are_clamped_with_a_warning() {
    let scene = textured(json!({
        "pbrMetallicRoughness": { "baseColorFactor": [1.5, -1, 0.5, 1], "metallicFactor": 2, "roughnessFactor": -0.1 },
        "extensions": { "KHR_materials_specular": { "specularFactor": 3 }, "KHR_materials_ior": { "ior": 0 } }
    }))
    .load()
    .unwrap();
    let m = &scene.materials[0];
    assert_eq!(m.base_color, Vec4::new(1.0, 0.0, 0.5, 1.0));
    assert_eq!((m.metallic, m.roughness, m.specular), (1.0, 0.0, 1.0));
    assert_eq!(m.ior, 0.0, "0 is an infinite index");
    assert_eq!(scene.warnings.len(), 5);
    assert!(scene.warnings[0].contains("baseColorFactor 1.5 is clamped to 1"));
}

#[test]
fn texture_transform_is_translation_times_rotation_times_scale() {
    let angle = 0.5_f64;
    let scene = textured(json!({ "emissiveTexture": { "index": 0, "extensions": {
        "KHR_texture_transform": { "offset": [0.25, -1], "rotation": angle, "scale": [2, 3], "texCoord": 1 } } } }))
    .load()
    .unwrap();
    let t = scene.materials[0].emission_texture.unwrap();
    let (s, c) = angle.sin_cos();
    assert_eq!(t.uv_set, 1, "overridden");
    let wanted = [[2.0 * c, 3.0 * s, 0.25], [-2.0 * s, 3.0 * c, -1.0]];
    assert_eq!(t.uv_transform, wanted.map(|row| row.map(|x| x as f32)));

    // The extension's own example: the lower left quadrant of the image, turned.
    let scene = textured(json!({ "emissiveTexture": { "index": 0, "extensions": {
        "KHR_texture_transform": { "offset": [0, 1], "rotation": std::f64::consts::FRAC_PI_2, "scale": [0.5, 0.5] } } } }))
    .load()
    .unwrap();
    let m = scene.materials[0].emission_texture.unwrap().uv_transform;
    for (u, v) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
        let [x, y] = m.map(|row| row[0] * u + row[1] * v + row[2]);
        // Lower left: u in 0 … ½, v in ½ … 1, but for rounding.
        assert!((-1e-6..=0.500_001).contains(&x), "u {x}");
        assert!((0.499_999..=1.000_001).contains(&y), "v {y}");
    }
}

#[test]
fn sixteen_bit_colors_are_made_linear_and_data_is_kept() {
    let pixel = image::Rgba([65535_u16, 32768, 1000, 12345]);
    let image = image::ImageBuffer::from_pixel(1, 1, pixel);
    let png = encode(&image::DynamicImage::ImageRgba16(image));
    let mut asset = textured(json!({
        "emissiveTexture": { "index": 0 }, "normalTexture": { "index": 0 } }));
    let view = asset.view(&png);
    asset.set(
        "/images/0",
        json!({ "bufferView": view, "mimeType": "image/png" }),
    );
    let scene = asset.load().unwrap();
    let texels = |texture: Option<TextureRef>| {
        let Texels::Rgba16(data) = &scene.textures[texture.unwrap().texture as usize].texels else {
            panic!("sixteen bits");
        };
        data.clone()
    };
    let material = &scene.materials[0];
    assert_eq!(texels(material.normal_texture), [65535, 32768, 1000, 12345]);
    // By the sRGB curve: ((32768/65535 + 0.055)/1.055)^2.4 = 0.214049; 1000/65535/12.92 = 0.00118105.
    assert_eq!(
        texels(material.emission_texture),
        [65535, 14028, 77, 12345],
        "alpha is linear already"
    );
}

#[test]
fn missing_coordinates_and_unknown_sets_are_reported() {
    let mut asset = textured(json!({ "emissiveTexture": { "index": 0, "texCoord": 1 } }));
    asset.remove("/meshes/0/primitives/0/attributes/TEXCOORD_1");
    let scene = asset.load().unwrap();
    assert!(scene.warnings[0].contains("has no TEXCOORD_1"));
    asset.set("/materials/0/emissiveTexture/texCoord", json!(2));
    assert!(refusal(asset.load(), "set 2").contains("texCoord 2 is not supported"));
}

#[test]
fn optional_extensions_are_named_and_required_ones_refused() {
    let mut asset = Asset::triangle();
    let names = json!([
        "KHR_materials_clearcoat",
        "VENDOR_thing",
        "KHR_materials_ior"
    ]);
    asset.set("/extensionsUsed", names.clone());
    let scene = asset.load().unwrap();
    assert_eq!(scene.warnings.len(), 2);
    assert!(scene.warnings[0].contains("KHR_materials_clearcoat"));
    assert!(scene.warnings[1].contains("VENDOR_thing"));
    asset.set("/extensionsRequired", names);
    let what = refusal(asset.load(), "required");
    assert!(what.contains("\"KHR_materials_clearcoat\", \"VENDOR_thing\""));
    assert!(!what.contains("ior"), "supported");
}

fn with_environment(environment: Value, files: &[(&str, &[u8])]) -> etendue::Result<Scene> {
    let mut asset = Asset::triangle();
    asset.set(
        "/scenes/0/extensions",
        json!({ "ETENDUE_environment": environment }),
    );
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    let path = folder.path().join("scene.gltf");
    std::fs::write(&path, asset.to_gltf()).unwrap();
    load(&path)
}

/// A 2 × 1 map in Radiance format: 128/256·2^(129−128) = 1 in red, half of it in green.
const HDR: &[u8] =
    b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n\x80\x40\x00\x81\x00\x00\x80\x82";

fn exr(texels: [[f32; 3]; 2]) -> Vec<u8> {
    use exr::prelude::{SpecificChannels, WritableImage};
    let channels = SpecificChannels::rgb(|at: exr::math::Vec2<usize>| {
        let [r, g, b] = texels[at.x()];
        (r, g, b)
    });
    let image = exr::prelude::Image::from_channels((2, 1), channels);
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

#[test]
fn environments_are_constant_or_maps() {
    let scene = with_environment(json!({ "radiance": [1, 2, 3] }), &[]).unwrap();
    let Some(Environment::Constant(radiance)) = scene.environment else {
        panic!("constant");
    };
    assert_eq!(radiance, Vec3::new(1.0, 2.0, 3.0));

    let data = [[0.5, 100_000.0, 0.0], [-1.0, 0.25, 3.0]];
    for (name, bytes, wanted, warnings) in [
        (
            "sky.hdr",
            HDR.to_vec(),
            [[1.0, 0.5, 0.0], [0.0, 0.0, 2.0]],
            0,
        ),
        ("sky.exr", exr(data), [data[0], [0.0, 0.25, 3.0]], 1),
    ] {
        let files: [(&str, &[u8]); 1] = [(name, &bytes)];
        let given = json!({ "uri": name, "intensity": 7, "rotation": 0.5 });
        let scene = with_environment(given, &files).unwrap();
        let Some(Environment::Map {
            width,
            height,
            texels,
            intensity,
            rotation,
        }) = scene.environment
        else {
            panic!("map");
        };
        assert_eq!((width, height, intensity, rotation), (2, 1, 7.0, 0.5));
        assert_eq!(*texels, wanted, "{name}");
        assert_eq!(scene.warnings.len(), warnings, "negative texels become 0");
    }
}

#[test]
fn broken_environments_are_refused() {
    let nan = exr([[f32::NAN, 0.0, 0.0], [0.0; 3]]);
    let whole = exr([[1.0; 3]; 2]);
    let huge = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 30000 +X 30000\n";
    let files: [(&str, &[u8]); 5] = [
        ("nan.exr", &nan),
        ("cut.exr", &whole[..whole.len() - 3]),
        ("cut.hdr", &HDR[..HDR.len() - 1]),
        ("huge.hdr", huge),
        ("text.exr", b"no image"),
    ];
    for (given, fragment) in [
        (json!({}), "exactly one of radiance and uri"),
        (
            json!({ "radiance": [1, 1, 1], "uri": "sky.hdr" }),
            "exactly one",
        ),
        (json!({ "radiance": [1, -1, 1] }), "not negative"),
        (json!({ "radiance": [1, 1e39, 1] }), "finite"),
        (json!({ "uri": "nan.exr", "intensity": -1 }), "intensity"),
        (json!({ "uri": "nan.exr", "rotation": 1e39 }), "rotation"),
        (json!({ "uri": "nan.exr" }), "texel (0, 0) is not finite"),
        (json!({ "uri": "cut.exr" }), "cannot be decoded"),
        (json!({ "uri": "cut.hdr" }), "cannot be decoded"),
        (json!({ "uri": "huge.hdr" }), "cap of 16384"),
        (json!({ "uri": "text.exr" }), "neither"),
        (json!({ "uri": "../sky.exr" }), ".."),
        (json!({ "uri": "sky.hdr" }), "is missing"),
    ] {
        let case = given.to_string();
        let what = refusal(with_environment(given, &files), &case);
        assert!(what.contains("ETENDUE_environment"), "{what}");
        assert!(what.contains(fragment), "{case}: {what}");
    }
}

#[test]
fn an_environment_file_is_loaded_on_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("sky.hdr");
    std::fs::write(&path, HDR).unwrap();
    let loaded = load_environment(&path).unwrap();
    let Environment::Map {
        texels, intensity, ..
    } = loaded.environment
    else {
        panic!("map");
    };
    assert_eq!((texels[0], intensity), ([1.0, 0.5, 0.0], 1.0));
    std::fs::write(&path, b"#?RADIANCE\n").unwrap();
    assert!(matches!(load_environment(&path), Err(Error::Image { .. })));
    let absent = folder.path().join("absent.hdr");
    assert!(matches!(load_environment(&absent), Err(Error::Io { .. })));
}

#[test]
fn kept_images_are_the_images() {
    // One image of 16 bits as colours and as data, and one of 8.
    let wide = image::Rgba([65535_u16, 32768, 1000, 12345]);
    let wide =
        image::ImageBuffer::from_fn(3, 2, |x, _| if x == 1 { wide } else { image::Rgba([9; 4]) });
    let mut asset = textured(json!({
        "pbrMetallicRoughness": { "baseColorTexture": { "index": 1 }, "metallicRoughnessTexture": { "index": 2 } },
        "emissiveTexture": { "index": 0 }, "normalTexture": { "index": 0 } }));
    let png = data_uri(&encode(&image::DynamicImage::ImageRgba16(wide)));
    let narrow = asset.json["images"][0].clone();
    asset.set("/images", json!([{ "uri": png }, narrow]));
    asset.set(
        "/textures",
        json!([{ "source": 0 }, { "source": 1 }, { "source": 1, "sampler": 0 }]),
    );
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.gltf");
    std::fs::write(&path, asset.to_gltf()).unwrap();
    let cache = folder.path().join("kept");
    let load = |cache| {
        let scene = load_cached(&path, &Limits::default(), cache).unwrap();
        format!("{:?}", scene.textures)
    };
    let plain = load(None);
    assert!(
        plain.contains("Rgba16") && plain.contains("Rgba8"),
        "{plain}"
    );
    assert_eq!(load(Some(&cache)), plain);
    let files = || {
        std::fs::read_dir(&cache)
            .unwrap()
            .map(|file| file.unwrap().path())
    };
    assert_eq!(files().count(), 3);
    assert_eq!(load(Some(&cache)), plain);
    // What is damaged is decoded; what is exchanged does not fit its image.
    let paths: Vec<_> = files().collect();
    std::fs::write(&paths[0], b"damaged").unwrap();
    assert_eq!(load(Some(&cache)), plain);
    let contents: Vec<_> = paths
        .iter()
        .map(|path| std::fs::read(path).unwrap())
        .collect();
    let sizes: Vec<_> = contents.iter().map(Vec::len).collect();
    let other = sizes.iter().position(|&size| size != sizes[0]).unwrap();
    std::fs::write(&paths[0], &contents[other]).unwrap();
    assert_eq!(load(Some(&cache)), plain);
    assert_eq!(std::fs::read(&paths[0]).unwrap(), contents[0]);
}

#[test]
fn image_bombs_are_refused_by_their_header() {
    // A valid PNG header that claims 60000 × 60000; the rest is never looked at.
    let mut bomb = png(1, 1, &[0; 4]);
    let side = 60_000_u32.to_be_bytes();
    bomb[16..20].copy_from_slice(&side);
    bomb[20..24].copy_from_slice(&side);
    let crc = crc32(&bomb[12..29]);
    bomb[29..33].copy_from_slice(&crc.to_be_bytes());
    let mut asset = textured(json!({ "emissiveTexture": { "index": 0 } }));
    asset.set("/images/0/uri", json!(data_uri(&bomb)));
    let what = refusal(asset.load(), "bomb");
    assert!(
        what.contains("images[0]") && what.contains("cap of 16384 × 16384"),
        "{what}"
    );

    // Two textures of two texels each, three allowed: the second one is refused.
    let asset =
        textured(json!({ "emissiveTexture": { "index": 0 }, "normalTexture": { "index": 0 } }));
    let limits = Limits {
        texels: 3,
        ..Limits::default()
    };
    let what = refusal(load_bytes(asset.to_gltf().as_bytes(), &limits), "texels");
    assert!(
        what.contains("cap of 3 texels in total (Limits::texels)"),
        "{what}"
    );
}

/// Pictures that end early, at every 64th byte and near their end, are errors that name them.
#[test]
fn truncated_images_are_refused() {
    let mut noise = 1u32;
    let mut texel = |_, _| {
        noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        image::Rgb(noise.to_le_bytes()[1..].try_into().unwrap())
    };
    let picture = image::DynamicImage::ImageRgb8(image::RgbImage::from_fn(24, 24, &mut texel));
    let mut jpeg = std::io::Cursor::new(Vec::new());
    picture
        .write_to(&mut jpeg, image::ImageFormat::Jpeg)
        .unwrap();
    let mut cuts = 0;
    for (name, whole) in [("PNG", encode(&picture)), ("JPEG", jpeg.into_inner())] {
        let ends = (0..whole.len()).step_by(64).chain([whole.len() - 14]);
        for end in ends {
            let mut asset = textured(json!({ "emissiveTexture": { "index": 0 } }));
            asset.set("/images/0/uri", json!(data_uri(&whole[..end])));
            let what = refusal(asset.load(), &format!("{name} cut at {end}"));
            assert!(what.contains("images[0]"), "{name} cut at {end}: {what}");
            cuts += 1;
        }
    }
    println!("{cuts} cuts refused");
}

/// CRC-32 of PNG chunks.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0_u32, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |c, _| {
            if c & 1 == 1 {
                c >> 1 ^ 0xEDB8_8320
            } else {
                c >> 1
            }
        })
    })
}
