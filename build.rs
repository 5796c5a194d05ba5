//! Compiles the table of shaders to SPIR-V, which `src/spec.rs` embeds.

#[path = "build/shaders.rs"]
mod shaders;

use std::path::{Path, PathBuf};
use std::{env, fs};

use shaders::{SHADERS, compile};

fn main() {
    println!("cargo::rerun-if-changed=shaders");
    println!("cargo::rerun-if-changed=build");
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    let compiler = shaderc::Compiler::new().expect("shaderc starts");
    let read =
        |name: &str| fs::read_to_string(Path::new("shaders").join(name)).map_err(|e| e.to_string());
    for (source, macros, name) in SHADERS {
        let level = shaderc::OptimizationLevel::Performance;
        let spirv = compile(&compiler, &read, source, macros, level);
        fs::write(out.join(format!("{name}.spv")), spirv).expect("OUT_DIR is writable");
    }
    // Unoptimised: names survive for tests/layout.rs to read, whatever is unused.
    let level = shaderc::OptimizationLevel::Zero;
    let probe = compile(&compiler, &read, "tests/layout_probe.comp", &[], level);
    fs::write(out.join("layout_probe.spv"), probe).expect("OUT_DIR is writable");
    // OUT_DIR is unknown where integration tests are compiled; this reaches them.
    println!("cargo::rustc-env=ETENDUE_SHADER_DIR={}", out.display());
}
