//! Compiles the table of shaders to SPIR-V, which `src/spec.rs` embeds.

use std::path::{Path, PathBuf};
use std::{env, fs};

/// (source, macros, output). A macro chooses which traversal or kernel is included and nothing else.
const SHADERS: &[(&str, &[&str], &str)] = &[
    ("kernel.comp", &["TRAVERSE_SOFTWARE"], "path_software"),
    ("kernel.comp", &["TRAVERSE_QUERY"], "path_query"),
    (
        "kernel.comp",
        &["TRAVERSE_SOFTWARE", "KERNEL_PROBE"],
        "probe_software",
    ),
    (
        "kernel.comp",
        &["TRAVERSE_QUERY", "KERNEL_PROBE"],
        "probe_query",
    ),
    ("tests/resources.comp", &[], "test_resources"),
    ("tests/rays.comp", &[], "test_rays"),
    ("tests/shading_samplers.comp", &[], "test_shading_samplers"),
    ("tests/shading_values.comp", &[], "test_shading_values"),
    ("tests/shading_random.comp", &[], "test_shading_random"),
    ("tests/shading_scene.comp", &[], "test_shading_scene"),
    (
        "tests/shading_interface.comp",
        &[],
        "test_shading_interface",
    ),
    ("tests/shading_media.comp", &[], "test_shading_media"),
    ("examples/needle.comp", &[], "example_needle"),
];

fn main() {
    println!("cargo::rerun-if-changed=shaders");
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    let compiler = shaderc::Compiler::new().expect("shaderc starts");
    for (source, macros, name) in SHADERS {
        let spirv = compile(
            &compiler,
            source,
            macros,
            shaderc::OptimizationLevel::Performance,
        );
        fs::write(out.join(format!("{name}.spv")), spirv).expect("OUT_DIR is writable");
    }
    // Unoptimised: names survive for tests/layout.rs to read, whatever is unused.
    let probe = compile(
        &compiler,
        "tests/layout_probe.comp",
        &[],
        shaderc::OptimizationLevel::Zero,
    );
    fs::write(out.join("layout_probe.spv"), probe).expect("OUT_DIR is writable");
    // OUT_DIR is unknown where integration tests are compiled; this reaches them.
    println!("cargo::rustc-env=ETENDUE_SHADER_DIR={}", out.display());
}

/// SPIR-V of one entry, or a build failure that shows the compiler's message.
fn compile(
    compiler: &shaderc::Compiler,
    source: &str,
    macros: &[&str],
    level: shaderc::OptimizationLevel,
) -> Vec<u8> {
    let path = Path::new("shaders").join(source);
    let text = fs::read_to_string(&path).expect("the shader table names files that exist");
    let mut options = shaderc::CompileOptions::new().expect("shaderc starts");
    options.set_target_env(
        shaderc::TargetEnv::Vulkan,
        shaderc::EnvVersion::Vulkan1_2 as u32,
    );
    options.set_target_spirv(shaderc::SpirvVersion::V1_5);
    options.set_optimization_level(level);
    options.set_warnings_as_errors();
    for name in macros {
        options.add_macro_definition(name, None);
    }
    options.set_include_callback(|name, _, from, _| {
        let path = Path::new("shaders").join(name);
        match fs::read_to_string(&path) {
            Ok(content) => Ok(shaderc::ResolvedInclude {
                resolved_name: path.display().to_string(),
                content,
            }),
            Err(error) => Err(format!("{name}, included from {from}: {error}")),
        }
    });
    match compiler.compile_into_spirv(
        &text,
        shaderc::ShaderKind::Compute,
        &path.display().to_string(),
        "main",
        Some(&options),
    ) {
        Ok(artifact) => artifact.as_binary_u8().to_vec(),
        Err(error) => panic!("{source} {macros:?}\n{error}"),
    }
}
