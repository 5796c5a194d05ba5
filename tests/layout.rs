//! The structs, bindings and constants that Rust and GLSL share, compared name by
//! name. The SPIR-V of shaders/tests/layout_probe.comp says what the compiler
//! made of the GLSL; no device is needed.
#![allow(
    clippy::unwrap_used,
    reason = "the lint's exception for tests does not reach their helpers"
)]
#![allow(clippy::print_stdout, reason = "a skipped test says why")]

#[path = "layout/specialisation.rs"]
mod specialisation;
#[path = "layout/spirv.rs"]
mod spirv;

use etendue::layout::{CONSTANTS, STRUCTS};
use etendue::settings::{Settings, Strategy};
use etendue::spec::Spec;

use spirv::Module;

/// The kernels that render and probe; test kernels have bindings of their own.
const KERNELS: [&str; 11] = [
    "path_software",
    "path_query",
    "path_pipeline",
    "probe_software",
    "probe_query",
    "probe_pipeline",
    "path_record",
    "replay_software",
    "replay_nothing",
    "photon_software",
    "trace_any_hit",
];

fn shader(name: &str) -> String {
    let path = format!("{}/shaders/{name}", env!("CARGO_MANIFEST_DIR"));
    std::fs::read_to_string(path).unwrap()
}

/// Name and value of each `const uint NAME = VALUE;` line, in order.
fn constants(text: &str) -> Vec<(&str, u32)> {
    text.lines()
        .filter_map(|line| {
            let (name, rest) = line.strip_prefix("const uint ")?.split_once(" = ")?;
            let value = rest.split_once("u;").unwrap().0;
            let value = match value.strip_prefix("0x") {
                Some(digits) => u32::from_str_radix(digits, 16),
                None => value.parse(),
            };
            Some((name, value.unwrap()))
        })
        .collect()
}

/// As `assert_eq`, but shows the first difference only.
fn compare<T: PartialEq + std::fmt::Debug>(found: &[T], expected: &[T], what: &str) {
    for (a, b) in found.iter().zip(expected) {
        assert_eq!(a, b, "{what}");
    }
    assert_eq!(found.len(), expected.len(), "{what}: one is longer");
}

#[test]
fn structs_are_the_same_in_rust_and_glsl() {
    let probe = Module::read("layout_probe");
    let declared = shader("layout.glsl")
        .lines()
        .filter_map(|line| line.strip_prefix("struct ")?.strip_suffix(" {"))
        .map(str::to_owned)
        .collect::<Vec<_>>();
    let names: Vec<_> = STRUCTS.iter().map(|s| s.name).collect();
    assert_eq!(declared, names, "structs of layout.glsl, and of layout.rs");
    for rust in STRUCTS {
        let glsl = probe.structure(rust.name);
        let fields: Vec<_> = glsl
            .fields
            .iter()
            .map(|(n, at)| (n.as_str(), *at))
            .collect();
        compare(
            &fields,
            rust.fields,
            &format!("{}: GLSL, then Rust", rust.name),
        );
        assert_eq!(
            glsl.stride, rust.size,
            "size of {}: GLSL, then Rust",
            rust.name
        );
    }
}

#[test]
fn constants_are_the_same_in_rust_and_glsl() {
    let text = shader("layout.glsl");
    compare(&constants(&text), CONSTANTS, "GLSL, then Rust");
}

#[test]
fn specialisation_constants_are_the_same_in_rust_and_glsl() {
    let probe = Module::read("layout_probe");
    let spec = Spec::default();
    let mut names: Vec<String> = spec
        .features()
        .map(|(name, _)| format!("HAS_{}", name.to_uppercase().replace('-', "_")))
        .to_vec();
    names.extend(
        [
            "STRATEGY",
            "PARALLELOGRAM_COUNT",
            "TRIANGLE_COUNT",
            "TEXTURE_KINDS",
            "HAS_BOXES",
            "HAS_SMALL_NODES",
            "HAS_SMALL_RECORDS",
            "HAS_ALLOTMENT",
            "HAS_GUIDE",
            "NORMAL_WITHOUT_X",
            "NORMAL_WITHOUT_Y",
            "NORMAL_WITHOUT_Z",
            "U_WITHOUT_X",
            "U_WITHOUT_Y",
            "U_WITHOUT_Z",
            "V_WITHOUT_X",
            "V_WITHOUT_Y",
            "V_WITHOUT_Z",
        ]
        .map(String::from),
    );
    let ids: Vec<u32> = spec.constants().iter().map(|(id, _)| *id).collect();
    let rust: Vec<_> = ids.into_iter().zip(names).collect();
    assert_eq!(probe.spec_ids(), rust, "GLSL, then Rust");
}

#[test]
fn features_switch_the_constant_of_their_name() {
    let everything = Spec::default().with_everything().features();
    for (position, (name, _)) in everything.into_iter().enumerate() {
        let mut spec = Spec::default();
        match name {
            "textures" => spec.textures = true,
            "alpha" => spec.alpha = true,
            "blend" => spec.blend = true,
            "specular" => spec.specular = true,
            "normals" => spec.normals = true,
            "attributes" => spec.attributes = true,
            "environment" => spec.environment = true,
            "area-lights" => spec.area_lights = true,
            "punctual" => spec.punctual = true,
            "instances" => spec.instances = true,
            "aovs" => spec.aovs = true,
            "dielectric" => spec.dielectric = true,
            "passage" => spec.passage = true,
            "nested" => spec.nested = true,
            "inside" => spec.inside = true,
            "media" => spec.media = true,
            "scattering" => spec.scattering = true,
            "equiangular" => spec.equiangular = true,
            "sensor" => spec.sensor = true,
            "strata" => spec.strata = true,
            "light-tree" => spec.light_tree = true,
            _ => panic!("{name} is not a field of Spec that this test knows"),
        }
        let on: Vec<u32> = spec
            .constants()
            .into_iter()
            .filter_map(|(id, value)| (value == 1).then_some(id))
            .collect();
        assert_eq!(on, [position as u32], "{name}");
    }
}

/// What kernels of pixels that share leave out is what makes a scene take the other ones.
#[test]
fn sharing_kernels_leave_out_solids_media_and_meters() {
    for kernel in ["software", "query"] {
        let of = |name: &str| Module::read(&format!("{name}_{kernel}")).spec_numbers();
        let (whole, shared) = (of("path"), of("share"));
        let features = Spec::default().features();
        let missing = whole.iter().filter(|id| !shared.contains(id));
        let missing = missing.filter_map(|&id| Some(features.get(id as usize)?.0));
        let missing: Vec<_> = missing.collect();
        assert_eq!(missing, etendue::spec::NOT_SHARED, "{kernel}");
    }
}

#[test]
fn strategies_are_the_same_in_rust_and_glsl() {
    let text = shader("spec.glsl");
    let rust = [
        ("STRATEGY_MIS", Strategy::Mis),
        ("STRATEGY_LIGHT_ONLY", Strategy::LightOnly),
        ("STRATEGY_BSDF_ONLY", Strategy::BsdfOnly),
    ]
    .map(|(name, strategy)| {
        let settings = Settings {
            strategy,
            ..Default::default()
        };
        let spec = Spec::for_scene(&etendue::scene::Scene::default(), &settings);
        (name, spec.constants()[spec.features().len()].1)
    });
    assert_eq!(constants(&text), rust);
}

#[test]
fn kernels_use_the_bindings_of_the_table() {
    let table: Vec<u32> = CONSTANTS
        .iter()
        .filter_map(|(name, value)| name.starts_with("BIND_").then_some(*value))
        .collect();
    let mut used: Vec<u32> = KERNELS
        .iter()
        .chain(&["path_software_addresses"])
        .flat_map(|name| Module::read(name).bindings_in_use())
        .collect();
    used.sort_unstable();
    used.dedup();
    // Both ways: nothing unknown is bound, and nothing in the table is dead.
    assert_eq!(used, table);
}
