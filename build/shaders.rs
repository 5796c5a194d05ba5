//! The table of shaders and how one of them becomes SPIR-V: for build.rs, and for
//! tests/mutants, which compiles changed ones.

use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Source, macros, output.
pub type Entry = (&'static str, &'static [&'static str], &'static str);

/// A macro chooses which traversal or kernel is included, or what
/// holds the arrays, and nothing else.
pub const SHADERS: &[Entry] = &[
    ("kernel.comp", &["TRAVERSE_SOFTWARE"], "path_software"),
    ("kernel.comp", &["TRAVERSE_QUERY"], "path_query"),
    // for the limit report
    (
        "kernel.comp",
        &["TRAVERSE_SOFTWARE", "TRACE_COUNTS"],
        "path_counts",
    ),
    (
        "kernel.comp",
        &["TRAVERSE_SOFTWARE", "TRACE_RECORDS"],
        "path_record",
    ),
    ("kernel.comp", &["TRAVERSE_RECALL"], "path_recall"),
    (
        "kernel.comp",
        &["TRAVERSE_SOFTWARE", "KERNEL_REPLAY"],
        "replay_software",
    ),
    (
        "kernel.comp",
        &["TRAVERSE_QUERY", "KERNEL_REPLAY"],
        "replay_query",
    ),
    (
        "kernel.comp",
        &["TRAVERSE_NOTHING", "KERNEL_REPLAY"],
        "replay_nothing",
    ),
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
    // pixels share what their paths find
    (
        "kernel.comp",
        &["TRAVERSE_SOFTWARE", "SHARE"],
        "share_software",
    ),
    ("kernel.comp", &["TRAVERSE_QUERY", "SHARE"], "share_query"),
    // traces photons
    (
        "kernel.comp",
        &["TRAVERSE_SOFTWARE", "PHOTON"],
        "photon_software",
    ),
    ("kernel.comp", &["TRAVERSE_QUERY", "PHOTON"], "photon_query"),
    // for CPUs that gather
    (
        "kernel.comp",
        &["TRAVERSE_SOFTWARE", "ADDRESSES"],
        "path_software_addresses",
    ),
    (
        "kernel.comp",
        &["TRAVERSE_QUERY", "ADDRESSES"],
        "path_query_addresses",
    ),
    (
        "kernel.comp",
        &["TRAVERSE_SOFTWARE", "ADDRESSES", "TRACE_COUNTS"],
        "path_addresses_counts",
    ),
    (
        "kernel.comp",
        &["TRAVERSE_SOFTWARE", "ADDRESSES", "SHARE"],
        "share_software_addresses",
    ),
    (
        "kernel.comp",
        &["TRAVERSE_QUERY", "ADDRESSES", "SHARE"],
        "share_query_addresses",
    ),
    (
        "kernel.comp",
        &["TRAVERSE_RECALL", "ADDRESSES"],
        "path_addresses_recall",
    ),
    (
        "kernel.comp",
        &["TRAVERSE_SOFTWARE", "ADDRESSES", "KERNEL_REPLAY"],
        "replay_software_addresses",
    ),
    (
        "kernel.comp",
        &["TRAVERSE_QUERY", "ADDRESSES", "KERNEL_REPLAY"],
        "replay_query_addresses",
    ),
    (
        "kernel.comp",
        &["TRAVERSE_NOTHING", "ADDRESSES", "KERNEL_REPLAY"],
        "replay_nothing_addresses",
    ),
    (
        "kernel.comp",
        &["TRAVERSE_SOFTWARE", "ADDRESSES", "PHOTON"],
        "photon_software_addresses",
    ),
    (
        "kernel.comp",
        &["TRAVERSE_QUERY", "ADDRESSES", "PHOTON"],
        "photon_query_addresses",
    ),
    // as path_software, with what wgpu lacks left out
    ("kernel.comp", &["TRAVERSE_SOFTWARE", "WGPU"], "path_wgpu"),
    (
        "kernel.comp",
        &["TRAVERSE_QUERY", "WGPU"],
        "path_wgpu_query",
    ),
    ("kernel.rgen", &["TRAVERSE_PIPELINE"], "path_pipeline"),
    (
        "kernel.rgen",
        &["TRAVERSE_PIPELINE", "KERNEL_PROBE"],
        "probe_pipeline",
    ),
    (
        "kernel.rgen",
        &["TRAVERSE_PIPELINE", "KERNEL_REPLAY"],
        "replay_pipeline",
    ),
    (
        "kernel.rgen",
        &["TRAVERSE_PIPELINE", "PHOTON"],
        "photon_pipeline",
    ),
    ("trace.rmiss", &[], "trace_miss"),
    ("trace.rchit", &[], "trace_closest_hit"),
    ("trace.rahit", &[], "trace_any_hit"),
    ("trace.rint", &[], "trace_intersection"),
    ("tests/resources.comp", &[], "test_resources"),
    ("tests/rays.comp", &[], "test_rays"),
    (
        "tests/rays.rgen",
        &["TRAVERSE_PIPELINE"],
        "test_rays_pipeline",
    ),
    ("tests/rays.rahit", &[], "test_rays_any_hit"),
    ("tests/rays.rint", &[], "test_rays_intersection"),
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
    ("selftest.comp", &[], "selftest"),
    ("examples/needle.comp", &[], "example_needle"),
];

/// The stage, by the suffix of the file.
fn kind(source: &str) -> shaderc::ShaderKind {
    use shaderc::ShaderKind as Kind;
    match source.rsplit('.').next() {
        Some("comp") => Kind::Compute,
        Some("rgen") => Kind::RayGeneration,
        Some("rmiss") => Kind::Miss,
        Some("rchit") => Kind::ClosestHit,
        Some("rahit") => Kind::AnyHit,
        Some("rint") => Kind::Intersection,
        _ => panic!("{source}: no stage has this suffix"),
    }
}

/// SPIR-V of entries of the table, into files `NAME.spv` of a folder: by as many threads as there are
/// processors. `read` gives the text of a file below `shaders`.
///
/// # Panics
///
/// With the compiler's message, where a shader is wrong; where a file cannot be written.
pub fn compile_all(
    entries: &[Entry],
    level: shaderc::OptimizationLevel,
    read: &(dyn Fn(&str) -> Result<String, String> + Sync),
    folder: &Path,
) {
    let next = AtomicUsize::new(0);
    let work = || {
        let compiler = shaderc::Compiler::new().expect("shaderc starts");
        while let Some((source, macros, name)) = entries.get(next.fetch_add(1, Ordering::Relaxed)) {
            let spirv = compile(&compiler, read, source, macros, level);
            std::fs::write(folder.join(format!("{name}.spv")), spirv).expect("it is writable");
        }
    };
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| (0..threads).for_each(|_| drop(scope.spawn(work))));
}

/// SPIR-V of one entry of the table. `read` gives the text of a file below `shaders`.
///
/// # Panics
///
/// With the compiler's message, where the shader is wrong.
fn compile(
    compiler: &shaderc::Compiler,
    read: &dyn Fn(&str) -> Result<String, String>,
    source: &str,
    macros: &[&str],
    level: shaderc::OptimizationLevel,
) -> Vec<u8> {
    let text = read(source).expect("the shader table names files that exist");
    let mut options = shaderc::CompileOptions::new().expect("shaderc starts");
    // naga knows no OpCopyLogical, by which newer SPIR-V copies structs, and refuses the
    // control flow that the optimiser makes (docs/decisions.md). It reads no ray queries.
    let is_for_naga = macros.contains(&"WGPU") && !macros.contains(&"TRAVERSE_QUERY");
    let (vulkan, spirv, level) = if is_for_naga {
        let plain = shaderc::OptimizationLevel::Zero;
        (
            shaderc::EnvVersion::Vulkan1_1,
            shaderc::SpirvVersion::V1_3,
            plain,
        )
    } else {
        (
            shaderc::EnvVersion::Vulkan1_2,
            shaderc::SpirvVersion::V1_5,
            level,
        )
    };
    options.set_target_env(shaderc::TargetEnv::Vulkan, vulkan as u32);
    options.set_target_spirv(spirv);
    options.set_optimization_level(level);
    options.set_warnings_as_errors();
    for name in macros {
        options.add_macro_definition(name, None);
    }
    options.set_include_callback(|name, _, from, _| match read(name) {
        Ok(content) => Ok(shaderc::ResolvedInclude {
            resolved_name: format!("shaders/{name}"),
            content,
        }),
        Err(error) => Err(format!("{name}, included from {from}: {error}")),
    });
    let kind = kind(source);
    let path = format!("shaders/{source}");
    match compiler.compile_into_spirv(&text, kind, &path, "main", Some(&options)) {
        Ok(artifact) => artifact.as_binary_u8().to_vec(),
        Err(error) => panic!("{source} {macros:?}\n{error}"),
    }
}
