//! The files: paths out of the folder, links, containers and numbers that lie, texts that swell.

use std::fs::{self, File};
use std::os::unix::fs::symlink;
use std::os::unix::net::UnixListener;
use std::path::Path;

use serde_json::{Value, json};

use super::builder::{Asset, U8, data_uri, glb, png};
use super::pictures::pictures;

/// A word in a file outside, which no message may hold.
pub const SECRET: &str = "correcthorsebatterystaple";

/// Writes a case: into the scene's folder, and beside it.
type Write = dyn Fn(&Path, &Path);

pub struct Case {
    pub name: &'static str,
    /// What the message holds.
    pub says: &'static str,
    /// Writes `scene.gltf` and what it needs into the first folder; the second is outside.
    pub write: Box<Write>,
}

/// A 2 × 1 map in Radiance format.
const HDR: &[u8] =
    b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n\x80\x40\x00\x81\x00\x00\x80\x82";

/// Files outside, good enough for a slip to load them.
pub fn plant(secrets: &Path) {
    fs::write(secrets.join("secret.bin"), Asset::triangle().bytes).unwrap();
    fs::write(secrets.join("secret.png"), png(1, 1, &[255; 4])).unwrap();
    fs::write(secrets.join("secret.hdr"), HDR).unwrap();
    fs::write(secrets.join("secret.gltf"), Asset::triangle().to_gltf()).unwrap();
    fs::write(secrets.join("secret.txt"), SECRET).unwrap();
    fs::write(secrets.join("broken.hdr"), &HDR[..HDR.len() - 1]).unwrap();
}

/// A scene that is whole, with a buffer beside it.
pub fn write_whole(scene: &Path) {
    fs::write(scene.join("inside.bin"), Asset::triangle().bytes).unwrap();
    fs::write(
        scene.join("scene.gltf"),
        with_buffer("inside.bin").to_gltf(),
    )
    .unwrap();
}

fn with_buffer(uri: &str) -> Asset {
    let mut asset = Asset::triangle();
    let length = asset.bytes.len();
    asset.set("/buffers", json!([{ "uri": uri, "byteLength": length }]));
    asset
}

/// A triangle with a texture.
pub fn with_image(uri: &str) -> Asset {
    let mut asset = Asset::triangle();
    let uvs = asset.floats("VEC2", &[0., 0., 1., 0., 0., 1.]);
    asset.attribute("TEXCOORD_0", uvs);
    asset.set("/images", json!([{ "uri": uri }]));
    asset.set("/textures", json!([{ "source": 0 }]));
    asset.set(
        "/materials",
        json!([{ "emissiveTexture": { "index": 0 }, "emissiveFactor": [1, 1, 1] }]),
    );
    asset.set("/meshes/0/primitives/0/material", json!(0));
    asset
}

pub fn with_environment(uri: &str) -> Asset {
    let mut asset = Asset::triangle();
    asset.set(
        "/scenes/0/extensions",
        json!({ "ETENDUE_environment": { "uri": uri } }),
    );
    asset
}

pub fn case(
    name: &'static str,
    says: &'static str,
    write: impl Fn(&Path, &Path) + 'static,
) -> Case {
    Case {
        name,
        says,
        write: Box::new(write),
    }
}

/// A text of a scene.
pub fn text(name: &'static str, says: &'static str, text: impl Fn() -> Vec<u8> + 'static) -> Case {
    case(name, says, move |scene, _| {
        fs::write(scene.join("scene.gltf"), text()).unwrap();
    })
}

/// A triangle with a change.
fn changed(name: &'static str, says: &'static str, pointer: &'static str, value: Value) -> Case {
    text(name, says, move || {
        let mut asset = Asset::triangle();
        let length = asset.bytes.len();
        asset.set(
            "/buffers",
            json!([{ "uri": data_uri(&asset.bytes), "byteLength": length }]),
        );
        asset.set(pointer, value.clone());
        asset.to_gltf().into_bytes()
    })
}

/// A triangle in a container with a word of its header changed.
fn container(name: &'static str, says: &'static str, at: usize, value: u32) -> Case {
    text(name, says, move || {
        let mut bytes = Asset::triangle().to_glb();
        bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
        bytes
    })
}

/// Something that refers to a URI, in which `{}` is the folder outside.
type Refers = fn(&str) -> Asset;

const BUFFER: Refers = with_buffer;
const IMAGE: Refers = with_image;
const ENVIRONMENT: Refers = with_environment;

/// URIs that lead out.
const URIS: [(&str, Refers, &str); 26] = [
    ("../secrets/secret.bin", BUFFER, "uses .."),
    ("sub/../../secrets/secret.bin", BUFFER, "uses .."),
    ("%2e%2e/secrets/secret.bin", BUFFER, "uses .."),
    ("..%2Fsecrets%2Fsecret.bin", BUFFER, "uses .."),
    ("%252e%252e/secrets/secret.bin", BUFFER, "is missing"),
    ("%c0%ae%c0%ae/secrets/secret.bin", BUFFER, "UTF-8"),
    ("..\\secrets\\secret.bin", BUFFER, "backslash"),
    ("{}/secret.bin", BUFFER, "is absolute"),
    ("/{}/secret.bin", BUFFER, "is absolute"),
    ("file://{}/secret.bin", BUFFER, "scheme \"file\""),
    ("file:{}/secret.bin", BUFFER, "scheme \"file\""),
    ("FILE:///etc/passwd", BUFFER, "scheme \"FILE\""),
    ("%66ile://{}/secret.bin", BUFFER, "colon"),
    ("http://127.0.0.1/secret.bin", BUFFER, "scheme \"http\""),
    ("/dev/zero", BUFFER, "is absolute"),
    ("/proc/self/environ", BUFFER, "is absolute"),
    ("~/secret.bin", BUFFER, "is missing"),
    ("inside.bin%00.png", BUFFER, "NUL"),
    ("../secrets/secret.png", IMAGE, "uses .."),
    ("%2e%2e%2fsecrets%2fsecret.png", IMAGE, "uses .."),
    ("{}/secret.png", IMAGE, "is absolute"),
    ("file://{}/secret.png", IMAGE, "scheme \"file\""),
    ("../secrets/secret.hdr", ENVIRONMENT, "uses .."),
    ("{}/secret.hdr", ENVIRONMENT, "is absolute"),
    ("file://{}/secret.hdr", ENVIRONMENT, "scheme \"file\""),
    ("..%5csecrets%5csecret.hdr", ENVIRONMENT, "backslash"),
];

fn uris() -> impl Iterator<Item = Case> {
    URIS.into_iter().map(|(uri, refers, says)| {
        case(uri, says, move |scene, secrets| {
            fs::create_dir(scene.join("sub")).unwrap();
            write_whole(scene);
            let uri = uri.replace("{}", secrets.to_str().unwrap());
            fs::write(scene.join("scene.gltf"), refers(&uri).to_gltf()).unwrap();
        })
    })
}

/// Where `inside.bin` leads, which the scene refers to; `{}` is the folder outside.
const LINKS: [(&str, &str, &str); 7] = [
    (
        "a link to a file outside",
        "{}/secret.bin",
        "out of the scene's folder",
    ),
    (
        "a relative link out",
        "../secrets/secret.bin",
        "out of the scene's folder",
    ),
    (
        "a link by way of a link",
        "far/secret.bin",
        "out of the scene's folder",
    ),
    (
        "a link to a text outside",
        "{}/secret.txt",
        "out of the scene's folder",
    ),
    (
        "a link to the environment of the process",
        "/proc/self/environ",
        "out of the scene's folder",
    ),
    (
        "a link to a device without end",
        "/dev/zero",
        "out of the scene's folder",
    ),
    ("a link to itself", "inside.bin", "is missing"),
];

fn links() -> Vec<Case> {
    let link = |(name, target, says): (&'static str, &'static str, &'static str)| {
        case(name, says, move |scene, secrets| {
            symlink(secrets, scene.join("far")).unwrap();
            let target = target.replace("{}", secrets.to_str().unwrap());
            symlink(target, scene.join("inside.bin")).unwrap();
            fs::write(
                scene.join("scene.gltf"),
                with_buffer("inside.bin").to_gltf(),
            )
            .unwrap();
        })
    };
    let mut cases: Vec<Case> = LINKS.into_iter().map(link).collect();
    let says = "out of the scene's folder";
    cases.push(case("a folder that is a link", says, |scene, secrets| {
        symlink(secrets, scene.join("sub")).unwrap();
        fs::write(
            scene.join("scene.gltf"),
            with_image("sub/secret.png").to_gltf(),
        )
        .unwrap();
    }));
    cases.push(case("a sky that is a link", says, |scene, secrets| {
        symlink(secrets.join("secret.hdr"), scene.join("sky.hdr")).unwrap();
        fs::write(
            scene.join("scene.gltf"),
            with_environment("sky.hdr").to_gltf(),
        )
        .unwrap();
    }));
    cases
}

/// Places that hold no file.
fn special() -> Vec<Case> {
    let says = "not a regular file";
    vec![
        case("a pipe as buffer", says, |scene, _| {
            make_pipe(&scene.join("pipe"));
            fs::write(scene.join("scene.gltf"), with_buffer("pipe").to_gltf()).unwrap();
        }),
        case("a socket as buffer", says, |scene, _| {
            UnixListener::bind(scene.join("socket")).unwrap();
            fs::write(scene.join("scene.gltf"), with_buffer("socket").to_gltf()).unwrap();
        }),
        case("a pipe as scene", says, |scene, _| {
            make_pipe(&scene.join("scene.gltf"));
        }),
        case("a folder as scene", says, |scene, _| {
            fs::create_dir(scene.join("scene.gltf")).unwrap();
        }),
        case(
            "a sparse buffer of 5 GiB",
            "cap of 4294967296 bytes a file",
            |scene, _| {
                File::create(scene.join("large.bin"))
                    .unwrap()
                    .set_len(5 << 30)
                    .unwrap();
                fs::write(scene.join("scene.gltf"), with_buffer("large.bin").to_gltf()).unwrap();
            },
        ),
    ]
}

fn make_pipe(path: &Path) {
    let status = std::process::Command::new("mkfifo").arg(path).status();
    assert!(status.unwrap().success());
}

fn containers() -> Vec<Case> {
    vec![
        container(
            "a container larger than its file",
            "claims 4294967295 bytes",
            8,
            u32::MAX,
        ),
        container("a container smaller than itself", "less than itself", 8, 0),
        container(
            "a chunk larger than its file",
            "chunk 0 claims 4294967295",
            12,
            u32::MAX,
        ),
        container("a chunk of unknown kind", "first chunk is not JSON", 16, 7),
        container("a container of another version", "version 1", 4, 1),
        text("a container that ends early", "truncated GLB", || {
            let mut bytes = Asset::triangle().to_glb();
            bytes.truncate(bytes.len() - 5);
            bytes
        }),
        text("a container without its buffer", "data is missing", || {
            let whole = Asset::triangle().to_glb();
            let length = u32::from_le_bytes(whole[12..16].try_into().unwrap()) as usize;
            glb(&[(0x4E4F_534A, &whole[20..20 + length])])
        }),
    ]
}

/// Texts that swell.
fn texts() -> Vec<Case> {
    let deep = || "[".repeat(10_000_000);
    vec![
        text("an empty file", "EOF", Vec::new),
        text("ten million brackets", "not valid glTF JSON", move || {
            deep().into_bytes()
        }),
        text(
            "brackets where nothing is read",
            "not valid glTF JSON",
            move || format!("{{\"extras\":{}", deep()).into_bytes(),
        ),
        text("three million nodes", "more than 2097152 entries", || {
            format!("{{\"nodes\":[{}{{}}]}}", "{},".repeat(3_000_000)).into_bytes()
        }),
        text("a number beyond all", "out of range", || {
            b"{\"nodes\":[{\"scale\":[1e999,1,1]}]}".to_vec()
        }),
        text("a ring of nodes", "cycle", || {
            let mut asset = Asset::triangle();
            asset.set("/nodes/0", json!({ "mesh": 0, "children": [0] }));
            asset.to_gltf().into_bytes()
        }),
        text("another encoding", "not valid glTF JSON", || {
            b"\xFF\xFE{}".to_vec()
        }),
        text("a name without end", "are not supported", || {
            let mut asset = Asset::triangle();
            asset.set("/extensionsRequired", json!(["x".repeat(100_000)]));
            asset.to_gltf().into_bytes()
        }),
    ]
}

/// Numbers that lie.
fn numbers() -> Vec<Case> {
    vec![
        text("2⁴⁰ vertices without data", "cap of 134217728", || {
            let mut asset = Asset::triangle();
            asset.remove("/accessors/0/bufferView");
            asset.set("/accessors/0/count", json!(1_u64 << 40));
            asset.to_gltf().into_bytes()
        }),
        changed(
            "2⁴⁰ vertices in 36 bytes",
            "accessors[0]",
            "/accessors/0/count",
            json!(1_u64 << 40),
        ),
        changed(
            "a view that wraps around",
            "bufferViews[0]",
            "/bufferViews/0/byteOffset",
            json!(u64::MAX),
        ),
        changed(
            "a view beyond its buffer",
            "bufferViews[0]",
            "/bufferViews/0/byteLength",
            json!(1_u64 << 40),
        ),
        changed(
            "a stride without end",
            "bufferViews[0]",
            "/bufferViews/0/byteStride",
            json!(u64::MAX),
        ),
        changed(
            "a buffer larger than its data",
            "buffers[0]",
            "/buffers/0/byteLength",
            json!(1_u64 << 40),
        ),
        changed(
            "2⁴⁰ replaced values",
            "accessors[0]",
            "/accessors/0/sparse",
            json!({ "count": 1_u64 << 40, "indices": { "bufferView": 0, "componentType": U8 },
                    "values": { "bufferView": 0 } }),
        ),
        changed(
            "data that is no base64",
            "not valid base64",
            "/buffers/0/uri",
            json!("data:;base64,%%%"),
        ),
        changed(
            "data without data",
            "no comma",
            "/buffers/0/uri",
            json!("data:;base64"),
        ),
        changed(
            "instances that are not there",
            "EXT_mesh_gpu_instancing",
            "/nodes/0/extensions",
            json!({ "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": 7 } } }),
        ),
    ]
}

pub fn corpus() -> Vec<Case> {
    let mut cases: Vec<Case> = uris().collect();
    for more in [
        links(),
        special(),
        containers(),
        texts(),
        numbers(),
        pictures(),
    ] {
        cases.extend(more);
    }
    cases
}
