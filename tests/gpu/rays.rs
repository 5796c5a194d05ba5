//! Acceleration structures and `traverse_query.glsl`.

use std::sync::Arc;

use etendue::gpu::{
    BindSet, BindingKind, Blas, BlasGeometry, Buffer, ComputePipeline, Device, Memory,
    PipelineDesc, Resource, Tlas, TlasInstance, Usage,
};
use etendue::layout::{BIND_PROBE_HITS, BIND_PROBE_RAYS, BIND_SCENE, NONE, ProbeHit, ProbeRay};

use crate::{GROUP, finish, open};

const RAYS: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/test_rays.spv"));

/// Constant of `spec.glsl` that switches candidates on.
const HAS_ALPHA: u32 = 1;
const HAS_NESTED: u32 = 13;

/// Two triangles a group, one behind the other: z = 0 and z = -1, seen from +z.
/// Vertices have the renderer's stride of 32 bytes.
const VERTICES: [[f32; 8]; 6] = [
    [0.0, 0.0, 0.0, 9.0, 9.0, 9.0, 9.0, 9.0],
    [1.0, 0.0, 0.0, 9.0, 9.0, 9.0, 9.0, 9.0],
    [0.0, 1.0, 0.0, 9.0, 9.0, 9.0, 9.0, 9.0],
    [0.0, 0.0, -1.0, 9.0, 9.0, 9.0, 9.0, 9.0],
    [1.0, 0.0, -1.0, 9.0, 9.0, 9.0, 9.0, 9.0],
    [0.0, 1.0, -1.0, 9.0, 9.0, 9.0, 9.0, 9.0],
];

fn group(device: &Arc<Device>, triangles: &[[u32; 3]], opaque: bool) -> Blas {
    let vertices =
        Buffer::from_slice(device, "vertices", Usage::ACCELERATION_INPUT, &VERTICES).unwrap();
    let geometry = BlasGeometry {
        vertices: &vertices,
        vertex_stride: 32,
        vertex_count: 6,
        triangles,
        opaque,
    };
    let blas = Blas::build(device, "group", &geometry).unwrap();
    assert!(blas.bytes() > 0);
    blas
}

/// What the rays meet in the scene.
fn trace(device: &Arc<Device>, scene: &Tlas, alpha: bool, rays: &[ProbeRay]) -> Vec<ProbeHit> {
    let pipeline = ComputePipeline::new(
        device,
        &PipelineDesc {
            name: "rays",
            spirv: &bytemuck::pod_collect_to_vec::<u8, u32>(RAYS),
            bindings: &[
                (BIND_SCENE, BindingKind::AccelerationStructure),
                (BIND_PROBE_RAYS, BindingKind::Storage),
                (BIND_PROBE_HITS, BindingKind::Storage),
            ],
            constants: &[(HAS_ALPHA, alpha.into()), (HAS_NESTED, 0)],
            push_bytes: 4,
        },
    )
    .unwrap();
    let bytes = size_of_val(rays) as u64;
    let input = Buffer::from_slice(device, "rays", Usage::STORAGE, rays).unwrap();
    let output = Buffer::new(device, "hits", bytes, Usage::STORAGE, Memory::Readback).unwrap();
    let resources = [
        (BIND_SCENE, Resource::Acceleration(scene)),
        (BIND_PROBE_RAYS, Resource::Buffer(&input)),
        (BIND_PROBE_HITS, Resource::Buffer(&output)),
    ];
    let set = BindSet::new(&pipeline, "rays", &resources).unwrap();
    let push = (rays.len() as u32).to_ne_bytes();
    let groups = [rays.len().div_ceil(GROUP) as u32, 1, 1];
    device
        .run("rays", |commands| {
            commands.dispatch(&pipeline, &set, &push, groups);
        })
        .unwrap();
    output.read(rays.len()).unwrap()
}

fn ray(origin: [f32; 3], direction: [f32; 3], t_max: f32) -> ProbeRay {
    ProbeRay {
        origin,
        t_min: 0.0,
        direction,
        t_max,
        from: NONE,
    }
}

/// Arithmetic of a few single-precision operations on values near 1.
const ROUNDING: f32 = 1e-5;

fn assert_hit(hit: &ProbeHit, t: f32, bary: [f32; 2], instance: u32, primitive: u32) {
    assert!((hit.t - t).abs() < ROUNDING, "{hit:?}");
    assert!((hit.bary[0] - bary[0]).abs() < ROUNDING, "{hit:?}");
    assert!((hit.bary[1] - bary[1]).abs() < ROUNDING, "{hit:?}");
    assert_eq!(
        (hit.instance, hit.primitive, hit.occluded),
        (instance, primitive, 1)
    );
}

fn assert_miss(hit: &ProbeHit) {
    assert_eq!(
        (hit.t, hit.instance, hit.primitive, hit.occluded),
        (-1.0, NONE, NONE, 0)
    );
}

const IDENTITY: [[f32; 3]; 4] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0; 3]];
/// x → y, y → −x, z doubled; then moved to (10, 0, 0). No entry equals its transpose's.
const TURNED: [[f32; 3]; 4] = [
    [0.0, 1.0, 0.0],
    [-1.0, 0.0, 0.0],
    [0.0, 0.0, 2.0],
    [10.0, 0.0, 0.0],
];

#[test]
fn rays_meet_placed_triangles() {
    let Some(device) = open(true) else { return };
    let blas = group(&device, &[[0, 1, 2], [3, 4, 5]], true);
    let place = |world_from_object| TlasInstance {
        blas: &blas,
        world_from_object,
    };
    let scene = Tlas::build(&device, "scene", &[place(IDENTITY), place(TURNED)]).unwrap();
    assert!(scene.bytes() > 0);
    // The scene keeps its groups: were their memory free, these buffers would overwrite it.
    let zeros = vec![0u8; blas.bytes() as usize];
    drop(blas);
    let overwrite: Vec<_> = (0..64)
        .map(|_| Buffer::from_slice(&device, "overwrite", Usage::TRANSFER, &zeros).unwrap())
        .collect();
    let down = [0.0, 0.0, -1.0];
    let up = [0.0, 0.0, 1.0];
    let rays = [
        ray([0.25, 0.5, 3.0], down, 10.0),
        ray([0.25, 0.5, -3.0], up, 10.0),
        ray([0.25, 0.5, 3.0], down, 2.5),
        ray([0.75, 0.75, 3.0], down, 10.0),
        ray([9.5, 0.25, 3.0], down, 10.0),
        ray([9.5, 0.25, -3.0], up, 10.0),
        ProbeRay {
            t_min: 3.5,
            ..ray([0.25, 0.5, 3.0], down, 10.0)
        },
        ray([0.25, 0.5, 3.0], down, -1.0),
        ray([0.25, 0.5, 3.0], down, f32::NAN),
    ];
    let hits = trace(&device, &scene, false, &rays);
    assert_hit(&hits[0], 3.0, [0.25, 0.5], 0, 0);
    assert_hit(&hits[1], 2.0, [0.25, 0.5], 0, 1);
    assert_miss(&hits[2]);
    assert_miss(&hits[3]);
    // In the turned instance world (9.5, 0.25) is object (0.25, 0.5), and z = -1 lies at -2.
    assert_hit(&hits[4], 3.0, [0.25, 0.5], 1, 0);
    assert_hit(&hits[5], 1.0, [0.25, 0.5], 1, 1);
    assert_hit(&hits[6], 4.0, [0.25, 0.5], 0, 1);
    assert_miss(&hits[7]);
    assert_miss(&hits[8]);
    drop((scene, overwrite));
    finish(device);
}

#[test]
fn cut_out_triangles_are_passed() {
    let Some(device) = open(true) else { return };
    let down = [0.0, 0.0, -1.0];
    let rays = [ray([0.25, 0.5, 3.0], down, 10.0)];
    let up = [ray([0.25, 0.5, -3.0], [0.0, 0.0, 1.0], 10.0)];
    let scene_of = |triangles: &[[u32; 3]], opaque| {
        let blas = group(&device, triangles, opaque);
        let instance = TlasInstance {
            blas: &blas,
            world_from_object: IDENTITY,
        };
        Tlas::build(&device, "scene", &[instance]).unwrap()
    };
    let masked = scene_of(&[[0, 1, 2], [3, 4, 5]], false);
    // Primitive 1 lies behind from above, and in front from below, where it is passed.
    assert_hit(
        &trace(&device, &masked, true, &rays)[0],
        3.0,
        [0.25, 0.5],
        0,
        0,
    );
    assert_hit(
        &trace(&device, &masked, true, &up)[0],
        3.0,
        [0.25, 0.5],
        0,
        0,
    );
    // Without the feature the ray's flag makes everything opaque.
    assert_hit(
        &trace(&device, &masked, false, &up)[0],
        2.0,
        [0.25, 0.5],
        0,
        1,
    );
    // An opaque group is not asked.
    let opaque = scene_of(&[[0, 1, 2], [3, 4, 5]], true);
    assert_hit(
        &trace(&device, &opaque, true, &up)[0],
        2.0,
        [0.25, 0.5],
        0,
        1,
    );
    // Nothing is left where every candidate is cut out: primitive 0 is out of the ray's way.
    let passed = scene_of(&[[0, 0, 0], [3, 4, 5]], false);
    assert_miss(&trace(&device, &passed, true, &rays)[0]);
    drop((masked, opaque, passed));
    finish(device);
}

#[test]
fn empty_scenes_are_missed() {
    let Some(device) = open(true) else { return };
    let rays = [ray([0.25, 0.5, 3.0], [0.0, 0.0, -1.0], 10.0)];
    let nothing = Tlas::build(&device, "nothing", &[]).unwrap();
    assert_miss(&trace(&device, &nothing, false, &rays)[0]);
    let blas = group(&device, &[], true);
    let instance = TlasInstance {
        blas: &blas,
        world_from_object: IDENTITY,
    };
    let hollow = Tlas::build(&device, "hollow", &[instance]).unwrap();
    assert_miss(&trace(&device, &hollow, true, &rays)[0]);
    drop((nothing, blas, hollow));
    finish(device);
}
