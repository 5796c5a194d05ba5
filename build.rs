//! Compiles the table of shaders to SPIR-V, which `src/spec.rs` embeds.

#[path = "build/shaders.rs"]
mod shaders;

use std::path::{Path, PathBuf};
use std::{env, fs};

use shaders::{Entry, SHADERS, compile_all};

fn main() {
    println!("cargo::rerun-if-changed=shaders");
    println!("cargo::rerun-if-changed=build");
    println!("cargo::rerun-if-changed=src");
    println!("cargo::rerun-if-changed=Cargo.lock");
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    // OUT_DIR is unknown where integration tests are compiled; this reaches them.
    println!("cargo::rustc-env=ETENDUE_SHADER_DIR={}", out.display());
    // Names the sources, so that files can say which build made them.
    let sources = fingerprint(&["src", "shaders", "build", "build.rs", "Cargo.lock"]);
    println!("cargo::rustc-env=ETENDUE_BUILD={sources:016x}");
    let shaders = format!("{:016x}", fingerprint(&["shaders", "build", "build.rs"]));
    let stamp = out.join("shaders.stamp");
    if fs::read_to_string(&stamp).is_ok_and(|old| old == shaders) {
        return;
    }
    let read =
        |name: &str| fs::read_to_string(Path::new("shaders").join(name)).map_err(|e| e.to_string());
    compile_all(
        SHADERS,
        shaderc::OptimizationLevel::Performance,
        &read,
        &out,
    );
    // Unoptimised: names survive for tests/layout.rs to read, whatever is unused.
    let probe: Entry = ("tests/layout_probe.comp", &[], "layout_probe");
    compile_all(&[probe], shaderc::OptimizationLevel::Zero, &read, &out);
    fs::write(stamp, shaders).expect("OUT_DIR is writable");
}

/// FNV-1a over the paths and contents of files and of what folders hold.
fn fingerprint(roots: &[&str]) -> u64 {
    let mut pending: Vec<PathBuf> = roots.iter().map(PathBuf::from).collect();
    let mut files = Vec::new();
    while let Some(path) = pending.pop() {
        match fs::read_dir(&path) {
            Ok(entries) => pending.extend(entries.flatten().map(|entry| entry.path())),
            Err(_) => files.push(path),
        }
    }
    files.sort();
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    for path in files {
        let name = path.to_string_lossy().replace('\\', "/").into_bytes();
        // published packages may lack some of the roots
        let content = fs::read(&path).unwrap_or_default();
        for byte in name.into_iter().chain([0]).chain(content).chain([0]) {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }
    hash
}
