//! Files that mean harm: paths out of the folder, headers that lie, depth and size.

use std::io::Write;
use std::path::Path;
use std::time::{Duration, Instant};

use etendue::scene::gltf::{Limits, load};
use glam::DVec3;
use serde_json::json;

use super::builder::*;

/// Far above what a refusal takes, far below what giving in would.
const AT_ONCE: Duration = Duration::from_secs(5);

/// Measures the time that this thread has worked, which a busy machine does not
/// stretch; the time that passed where the system does not tell.
struct Stopwatch(Duration, Instant);

impl Stopwatch {
    fn start() -> Self {
        Self(Self::worked().unwrap_or_default(), Instant::now())
    }

    fn elapsed(&self) -> Duration {
        match Self::worked() {
            Some(worked) => worked - self.0,
            None => self.1.elapsed(),
        }
    }

    /// Linux: nanoseconds on a processor are the first number.
    fn worked() -> Option<Duration> {
        let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
        let nanoseconds = text.split_whitespace().next()?.parse().ok()?;
        Some(Duration::from_nanos(nanoseconds))
    }
}

/// A scene in `folder` whose buffer is at `uri`.
fn write_scene(folder: &Path, uri: &str) -> std::path::PathBuf {
    let mut asset = Asset::triangle();
    let length = asset.bytes.len();
    asset.set("/buffers", json!([{ "uri": uri, "byteLength": length }]));
    let path = folder.join("scene.gltf");
    std::fs::write(&path, asset.to_gltf()).unwrap();
    path
}

#[test]
fn files_in_the_folder_are_read_and_decide_the_hash() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = Asset::triangle().bytes;
    let sub = folder.path().join("sub dir");
    std::fs::create_dir(&sub).unwrap();
    std::fs::write(sub.join("büffer%.bin"), &bytes).unwrap();
    let mut hashes = Vec::new();
    for uri in [
        "sub dir/büffer%25.bin",
        "./sub%20dir/b%C3%BCffer%25.bin",
        "%73ub%20dir/./büffer%25.bin",
    ] {
        let path = write_scene(folder.path(), uri);
        let scene = load(&path).unwrap();
        assert_eq!(scene.meshes[0].positions.len(), 3, "{uri}");
        let mut digest = <sha2::Sha256 as sha2::Digest>::new();
        sha2::Digest::update(&mut digest, std::fs::read(&path).unwrap());
        sha2::Digest::update(&mut digest, &bytes);
        let wanted: String = sha2::Digest::finalize(digest)
            .iter()
            .map(|b| format!("{b:02x}"))
            .collect();
        assert_eq!(scene.hash, wanted);
        hashes.push(scene.hash);
    }
    hashes.dedup();
    assert_eq!(hashes.len(), 3);
}

#[test]
fn hostile_uris_are_refused() {
    // The target exists outside the folder, so that a slip would load it.
    let outer = tempfile::tempdir().unwrap();
    let folder = outer.path().join("scene");
    std::fs::create_dir(&folder).unwrap();
    std::fs::create_dir(folder.join("sub")).unwrap();
    let secret = outer.path().join("secret.bin");
    std::fs::write(&secret, Asset::triangle().bytes).unwrap();
    let absolute = secret.to_str().unwrap();
    let file_uri = format!("file://{absolute}");
    let short_file_uri = format!("file:{absolute}");
    let escaped = absolute.replace('/', "%2F");
    let double = format!("/{absolute}");
    let cases = [
        ("../secret.bin", "uses .."),
        ("./../secret.bin", "uses .."),
        ("sub/../../secret.bin", "uses .."),
        ("sub/../scene.gltf", "uses .."),
        ("..", "uses .."),
        ("%2e%2e/secret.bin", "uses .."),
        ("%2E./secret.bin", "uses .."),
        (".%2e%2fsecret.bin", "uses .."),
        ("..%2Fsecret.bin", "uses .."),
        ("sub%2f..%2f..%2fsecret.bin", "uses .."),
        ("..\\secret.bin", "backslash"),
        ("..%5Csecret.bin", "backslash"),
        ("%5C%5Chost%5Cshare", "backslash"),
        (absolute, "is absolute"),
        (&escaped, "is absolute"),
        (&double, "is absolute"),
        ("//host/share/x.bin", "is absolute"),
        ("/etc/passwd", "is absolute"),
        ("/dev/zero", "is absolute"),
        (&file_uri, "scheme \"file\""),
        (&short_file_uri, "scheme \"file\""),
        ("FILE:///etc/passwd", "scheme \"FILE\""),
        ("http://127.0.0.1/x.bin", "scheme \"http\""),
        ("https://example.org/x.bin", "scheme \"https\""),
        ("ftp://example.org/x.bin", "scheme \"ftp\""),
        ("C:/secret.bin", "scheme \"C\""),
        ("C%3A/secret.bin", "colon"),
        ("%66ile:///etc/passwd", "colon"),
        ("file%3A%2Fetc", "colon"),
        ("javascript:alert(1)", "scheme"),
        ("secret.bin%00.png", "NUL"),
        ("a\u{0}b", "NUL"),
        ("a%0Ab", "control character"),
        ("%", "bad percent escape"),
        ("%4", "bad percent escape"),
        ("%GG", "bad percent escape"),
        ("a%2", "bad percent escape"),
        ("%+1", "bad percent escape"),
        ("%FF", "UTF-8"),
        ("%C3%28", "UTF-8"),
        ("%c0%ae%c0%ae/secret.bin", "UTF-8"),
        ("", "is empty"),
        ("sub//x.bin", "empty path segment"),
        ("sub/", "empty path segment"),
        ("x.bin?y", "query or fragment"),
        ("x.bin#y", "query or fragment"),
        ("~/secret.bin", "is missing"),
        ("$HOME/secret.bin", "is missing"),
        ("sub", "not a regular file"),
        (".", "not a regular file"),
        ("data:;base64,%%%", "not valid base64"),
        ("data:;base64", "no comma"),
    ];
    for (uri, fragment) in cases {
        assert_refused_uri(&write_scene(&folder, uri), uri, fragment);
    }
}

fn assert_refused_uri(path: &Path, uri: &str, fragment: &str) {
    let what = refusal(load(path), uri);
    assert!(what.contains("buffers[0]"), "{uri}: {what}");
    assert!(
        what.contains(fragment),
        "{uri}: no {fragment:?} in {what:?}"
    );
}

#[cfg(unix)]
#[test]
fn links_out_of_the_folder_are_refused_and_links_inside_followed() {
    use std::os::unix::fs::symlink;
    let outer = tempfile::tempdir().unwrap();
    let folder = outer.path().join("scene");
    std::fs::create_dir(&folder).unwrap();
    let secret = outer.path().join("secret.bin");
    std::fs::write(&secret, Asset::triangle().bytes).unwrap();
    symlink(&secret, folder.join("link.bin")).unwrap();
    symlink(outer.path(), folder.join("up")).unwrap();
    std::fs::write(folder.join("inside.bin"), Asset::triangle().bytes).unwrap();
    symlink("inside.bin", folder.join("alias.bin")).unwrap();
    // A folder whose name begins like the scene's is still another folder.
    let sibling = outer.path().join("scene2");
    std::fs::create_dir(&sibling).unwrap();
    std::fs::write(sibling.join("b.bin"), Asset::triangle().bytes).unwrap();
    symlink(sibling.join("b.bin"), folder.join("sibling.bin")).unwrap();
    for uri in ["link.bin", "up/secret.bin", "sibling.bin"] {
        assert_refused_uri(&write_scene(&folder, uri), uri, "out of the scene's folder");
    }
    assert!(load(&write_scene(&folder, "alias.bin")).is_ok());
    // The folder itself may be reached through a link.
    let detour = outer.path().join("detour");
    symlink(&folder, &detour).unwrap();
    assert!(load(&detour.join("scene.gltf")).is_ok());
}

#[test]
fn unreadable_scenes_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    assert_refused(&folder.path().join("absent.gltf"), "cannot be read");
    assert_refused(&folder.path().join("no/folder.gltf"), "cannot be read");
    assert_refused(folder.path(), "not a regular file");
    for (text, fragment) in [
        ("", "EOF"),
        ("{", "EOF"),
        ("[]", "asset is missing"),
        ("{\"asset\":{\"version\":\"2.0\"}}", "nothing to render"),
        ("{\"asset\":{\"version\":\"2.0\"}} x", "trailing characters"),
        ("{\"asset\":{},\"asset\":{}}", "duplicate field"),
        ("{\"scene\": NaN}", "not valid glTF JSON"),
        ("{\"nodes\":[{\"scale\":[1e999,1,1]}]}", "out of range"),
    ] {
        let what = refusal(load_bytes(text.as_bytes(), &Limits::default()), text);
        assert!(what.contains(fragment), "{text}: {what}");
    }
    let what = refusal(load_bytes(b"\xFF\xFE{}", &Limits::default()), "bytes");
    assert!(what.contains("not valid glTF JSON"), "{what}");
}

#[test]
fn truncated_and_lying_glb_are_refused() {
    let whole = Asset::triangle().to_glb();
    for length in (4..whole.len()).step_by(3) {
        let what = refusal(load_bytes(&whole[..length], &Limits::default()), "cut");
        assert!(what.contains("truncated GLB"), "{length}: {what}");
    }
    let with = |at: usize, value: u32| {
        let mut bytes = whole.clone();
        bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
        refusal(load_bytes(&bytes, &Limits::default()), "lie")
    };
    let start = Stopwatch::start();
    assert!(with(8, u32::MAX).contains("claims 4294967295 bytes"));
    assert!(with(12, u32::MAX).contains("chunk 0 claims 4294967295 bytes"));
    assert!(with(8, 0).contains("less than itself"));
    assert!(with(8, 12).contains("first chunk is not JSON"));
    assert!(with(4, 1).contains("version 1"));
    assert!(with(16, 7).contains("first chunk is not JSON"));
    let mut header = b"glTF".to_vec();
    header.extend(2_u32.to_le_bytes());
    header.extend(u32::MAX.to_le_bytes());
    let what = refusal(load_bytes(&header, &Limits::default()), "12 bytes");
    assert!(
        what.contains("claims 4294967295 bytes, the file has 12"),
        "{what}"
    );
    assert!(start.elapsed() < AT_ONCE);

    // Without the binary chunk its buffer is missing.
    let text = &whole[20..20 + u32::from_le_bytes(whole[12..16].try_into().unwrap()) as usize];
    let what = refusal(
        load_bytes(&glb(&[(0x4E4F_534A, text)]), &Limits::default()),
        "no BIN",
    );
    assert!(what.contains("data is missing"), "{what}");
}

#[test]
fn claims_without_data_take_no_memory() {
    // 2⁴⁰ vertices of zeros: no bufferView, so nothing contradicts the count.
    let mut asset = Asset::triangle();
    asset.remove("/accessors/0/bufferView");
    asset.set("/accessors/0/count", json!(1_u64 << 40));
    let start = Stopwatch::start();
    let what = refusal(asset.load(), "implicit");
    assert!(
        what.contains("cap of 134217728 (Limits::triangles)"),
        "{what}"
    );
    // The same with three indices: all corners coincide, so no triangle is left.
    let indices = asset.accessor(U8, "SCALAR", 3, &[0, 1, 2]);
    asset.set("/meshes/0/primitives/0/indices", json!(indices));
    let what = refusal(asset.load(), "indexed");
    assert!(what.contains("nothing to render"), "{what}");
    assert!(start.elapsed() < AT_ONCE);
}

#[test]
fn a_chain_of_a_million_nodes_loads() {
    const COUNT: usize = 1_000_000;
    let mut asset = Asset::triangle();
    asset.set("/nodes", json!("NODES"));
    let mut nodes = String::from("[");
    for i in 1..COUNT {
        nodes += &format!("{{\"children\":[{i}],\"translation\":[1,0,0]}},");
    }
    nodes += "{\"mesh\":0}]";
    let text = asset.to_gltf().replace("\"NODES\"", &nodes);
    let start = Stopwatch::start();
    let scene = load_bytes(text.as_bytes(), &Limits::default()).unwrap();
    assert!(start.elapsed() < AT_ONCE, "{:?}", start.elapsed());
    let place = scene.instances[0].world_from_object.translation;
    assert_eq!(place, DVec3::new((COUNT - 1) as f64, 0.0, 0.0));

    // Closed to a ring it is refused.
    let ring = text.replace("{\"mesh\":0}]", "{\"mesh\":0,\"children\":[0]}]");
    let what = refusal(load_bytes(ring.as_bytes(), &Limits::default()), "ring");
    assert!(what.contains("cycle"), "{what}");
}

#[test]
fn json_bombs_are_refused_at_once() {
    let start = Stopwatch::start();
    let deep = "[".repeat(10_000_000);
    let many = format!("{{\"nodes\":[{}{{}}]}}", "{},".repeat(3_000_000));
    for (text, fragment) in [
        (deep.clone(), "not valid glTF JSON"),
        (format!("{{\"nodes\":{deep}"), "not valid glTF JSON"),
        (format!("{{\"extras\":{deep}"), "not valid glTF JSON"),
        (many, "more than 2097152 entries (the cap)"),
    ] {
        let what = refusal(load_bytes(text.as_bytes(), &Limits::default()), fragment);
        assert!(what.contains(fragment), "{what}");
    }
    assert!(start.elapsed() < AT_ONCE, "{:?}", start.elapsed());
}

#[test]
fn messages_and_warnings_stay_short() {
    let name = "x".repeat(100_000);
    let mut asset = Asset::triangle();
    asset.set("/extensionsRequired", json!([name]));
    assert!(refusal(asset.load(), "long name").len() < 300);

    let mut asset = Asset::triangle();
    let roots: Vec<usize> = (0..1000).collect();
    for _ in 1..1000 {
        asset.push(
            "/nodes",
            json!({ "mesh": 0, "scale": [0, 0, 0], "name": "\u{1b}[31m" }),
        );
    }
    asset.set("/scenes/0/nodes", json!(roots));
    let warnings = asset.load().unwrap().warnings;
    assert_eq!(warnings.len(), 101);
    assert_eq!(warnings[100], "899 more warnings are not shown");
    assert!(
        !warnings[0].contains('\u{1b}'),
        "control characters are escaped"
    );
}

#[test]
fn special_files_are_refused() {
    // A sparse file of 5 GiB: over the cap by its size alone.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("large.bin");
    let mut file = std::fs::File::create(&path).unwrap();
    file.write_all(b"x").unwrap();
    file.set_len(5 << 30).unwrap();
    let start = Stopwatch::start();
    let scene = write_scene(folder.path(), "large.bin");
    assert_refused_uri(&scene, "large.bin", "cap of 4294967296 bytes a file");
    assert!(start.elapsed() < AT_ONCE);
}
