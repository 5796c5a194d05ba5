//! A feature that a scene does not need leaves nothing behind: the path kernels
//! are frozen by `spirv-opt` as a driver would, and their code is looked at.
use std::io::ErrorKind;
use std::process::Command;

use etendue::layout;
use etendue::spec::Spec;

use crate::spirv::{self, Module};

/// The kernel with its constants set to the spec's, after these passes of `spirv-opt`;
/// `None`, after saying why, where it is not installed.
fn optimised(kernel: &str, spec: &Spec, passes: &[&str]) -> Option<Module> {
    // the constants between the features and the later switches are numbers
    let numbers = spec.features().len()..25;
    let values: Vec<String> = spec
        .constants()
        .iter()
        .enumerate()
        .map(|(i, (id, value))| match numbers.contains(&i) {
            true => format!("{id}:{value}"),
            false => format!("{id}:{}", *value != 0),
        })
        .collect();
    let output = tempfile::NamedTempFile::new().unwrap();
    let mut command = Command::new("spirv-opt");
    command
        .arg("--set-spec-const-default-value")
        .arg(values.join(" "))
        .args(["--freeze-spec-const", "--fold-spec-const-op-composite"])
        .args(passes)
        .arg(spirv::path(kernel))
        .arg("-o")
        .arg(output.path());
    run(&mut command, kernel)?;
    Some(Module::parse(&std::fs::read(output.path()).unwrap()))
}

/// Runs a tool of the package; `None`, after saying why, where it is not installed.
fn run(command: &mut Command, kernel: &str) -> Option<()> {
    let run = match command.output() {
        Err(error) if error.kind() == ErrorKind::NotFound => {
            let must_run = std::env::var_os("ETENDUE_REQUIRE_DEVICE").is_some();
            assert!(
                !must_run,
                "{:?} is not installed, and nothing may be skipped",
                command.get_program()
            );
            println!("skipped: spirv-tools are not installed (Debian package spirv-tools)");
            return None;
        }
        run => run.unwrap(),
    };
    let said = String::from_utf8_lossy(&run.stderr);
    assert!(run.status.success(), "{kernel}: {said}");
    Some(())
}

/// The kernel with its constants set and everything dead removed.
fn frozen(kernel: &str, spec: &Spec) -> Option<Module> {
    optimised(kernel, spec, &["-O"])
}

const KERNELS: [&str; 3] = ["path_software", "path_query", "path_pipeline"];

/// Everything on, the features that only a scene settles included.
fn everything() -> Spec {
    Spec {
        environment: true,
        instances: true,
        nested: true,
        equiangular: true,
        sensor: true,
        aovs: true,
        strata: true,
        light_tree: true,
        guide: true,
        ..Spec::default().with_everything()
    }
}

/// What the library hands to drivers is valid, and hardly longer than what is left by `spirv-opt`, which computes with floats as well.
#[test]
fn what_constants_rule_out_is_left_out() {
    let kernels = [
        "path_software_addresses",
        "photon_software",
        "share_software",
        "path_pipeline",
    ];
    // without lights it is known that no photon arrives
    let bare = Spec {
        area_lights: true,
        ..Spec::default()
    };
    let glass = Spec {
        nested: false,
        scattering: false,
        equiangular: false,
        textures: false,
        ..everything()
    };
    for kernel in kernels {
        for spec in [bare, everything(), glass] {
            let words: Vec<u32> =
                bytemuck::pod_collect_to_vec(&std::fs::read(spirv::path(kernel)).unwrap());
            let left = etendue::spirv::specialised(&words, &spec.constants());
            let bytes: &[u8] = bytemuck::cast_slice(&left);
            let file = tempfile::NamedTempFile::new().unwrap();
            std::fs::write(file.path(), bytes).unwrap();
            let mut check = Command::new("spirv-val");
            check
                .args(["--target-env", "vulkan1.2", "--scalar-block-layout"])
                .arg(file.path());
            let passes = ["--ccp", "--eliminate-dead-branches"];
            let (Some(()), Some(other)) =
                (run(&mut check, kernel), optimised(kernel, &spec, &passes))
            else {
                return;
            };
            let (ours, others) = (Module::parse(bytes).blocks(), other.blocks());
            println!(
                "{kernel}: {ours} blocks, by spirv-opt {others}, of {}",
                Module::read(kernel).blocks()
            );
            assert!(
                ours as f64 <= 1.2 * others as f64,
                "{kernel}: {ours} blocks, by spirv-opt {others}"
            );
        }
    }
}

#[test]
fn bare_kernels_touch_only_what_every_scene_has() {
    for kernel in KERNELS {
        let Some(bare) = frozen(kernel, &Spec::default()) else {
            return;
        };
        let mut expected = vec![
            layout::BIND_PARAMS,
            layout::BIND_FILM,
            layout::BIND_LEDGER,
            layout::BIND_TRIANGLES,
            layout::BIND_VERTICES,
            layout::BIND_MATERIALS,
        ];
        expected.extend(match kernel {
            "path_query" | "path_pipeline" => vec![layout::BIND_SCENE],
            _ => vec![layout::BIND_BVH_NODES, layout::BIND_BVH_TRIANGLES],
        });
        assert_eq!(bare.bindings_in_use(), expected, "{kernel}");
    }
}

/// A feature, how it is switched off, and the bindings that only it uses. `passage` is not among them: it
/// exchanges one way to look for a light for another, and is there for speed.
type Switch = (&'static str, fn(&mut Spec), &'static [u32]);

#[test]
fn each_feature_removes_code_and_its_buffers() {
    let off: [Switch; 21] = [
        (
            "textures",
            |s| s.textures = false,
            &[layout::BIND_TEXTURE_USES, layout::BIND_TEXELS],
        ),
        (
            "normal maps",
            |s| s.texture_kinds &= !(1 << layout::TEXTURE_NORMAL),
            &[],
        ),
        (
            "textures of 16 bits",
            |s| s.texture_kinds &= !(1 << layout::TEXTURE_KIND_RGBA16),
            &[],
        ),
        ("alpha", |s| s.alpha = false, &[]),
        ("blend", |s| s.blend = false, &[]),
        ("specular", |s| s.specular = false, &[]),
        ("normals", |s| s.normals = false, &[]),
        (
            "attributes",
            |s| s.attributes = false,
            &[layout::BIND_ATTRIBUTES],
        ),
        (
            "environment",
            |s| s.environment = false,
            &[layout::BIND_ENV_MAP, layout::BIND_ENV_TABLE],
        ),
        ("area-lights", |s| s.area_lights = false, &[]),
        ("punctual", |s| s.punctual = false, &[]),
        (
            "instances",
            |s| s.instances = false,
            &[layout::BIND_INSTANCES],
        ),
        ("aovs", |s| s.aovs = false, &[]),
        ("dielectric", |s| s.dielectric = false, &[]),
        ("nested", |s| s.nested = false, &[]),
        ("inside", |s| s.inside = false, &[]),
        ("media", |s| s.media = false, &[]),
        ("scattering", |s| s.scattering = false, &[]),
        ("equiangular", |s| s.equiangular = false, &[]),
        ("sensor", |s| s.sensor = false, &[]),
        ("guide", |s| s.guide = false, &[layout::BIND_GUIDE]),
    ];
    // One kernel is enough: what is switched is the same in all.
    let kernel = KERNELS[0];
    let Some(full) = frozen(kernel, &everything()) else {
        return;
    };
    for (name, switch_off, buffers) in off {
        let mut spec = everything();
        switch_off(&mut spec);
        let without = frozen(kernel, &spec).unwrap();
        assert!(
            without.code_size() < full.code_size(),
            "without {name}: {} instructions, with it {}",
            without.code_size(),
            full.code_size()
        );
        let gone: Vec<u32> = full
            .bindings_in_use()
            .into_iter()
            .filter(|b| !without.bindings_in_use().contains(b))
            .collect();
        assert_eq!(gone, buffers, "without {name}");
    }
}

/// Numbers of GLSL.std.450.
const TAN: u32 = 15;
const EXP: u32 = 27;
const LOG: u32 = 28;

/// Exponentials are absorption, logarithms free flights, tangents equiangular distances: nothing else has any but a guide, whose lobes are
/// exponential.
#[test]
fn kernels_without_media_hold_no_instruction_of_them() {
    for kernel in KERNELS {
        let count = |spec: &Spec| {
            let module = frozen(kernel, spec)?;
            Some([EXP, LOG, TAN].map(|instruction| module.extended(instruction)))
        };
        let Some(full) = count(&everything()) else {
            return;
        };
        let clear = Spec {
            media: false,
            guide: false,
            ..everything()
        };
        assert!(full.iter().all(|n| *n > 0), "{kernel}: {full:?}");
        assert_eq!(count(&clear), Some([0, 0, 0]), "{kernel}");
    }
}
