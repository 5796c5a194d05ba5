//! Acceleration structures, `traverse_query.glsl` and `traverse_pipeline.glsl`.

use std::sync::Arc;

use etendue::Error;
use etendue::gpu::{
    BindSet, BindingKind, Blas, BlasGeometry, Buffer, Device, Memory, Pipeline, PipelineDesc,
    RayStages, Resource, Tlas, TlasInstance, Usage,
};
use etendue::layout::{BIND_PROBE_HITS, BIND_PROBE_RAYS, BIND_SCENE, NONE, ProbeHit, ProbeRay};

use crate::{GROUP, Rays, finish, missing_of, open, open_for};

macro_rules! module {
    ($name:literal) => {
        bytemuck::pod_collect_to_vec::<u8, u32>(include_bytes!(concat!(
            env!("OUT_DIR"),
            "/",
            $name,
            ".spv"
        )))
    };
}

/// Constant of `spec.glsl` that switches candidates on.
const HAS_ALPHA: u32 = 1;
const HAS_NESTED: u32 = 13;
const HAS_INSTANCES: u32 = 9;
const HAS_BOXES: u32 = 25;

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

/// Those triangles, or boxes around them.
fn group(device: &Arc<Device>, triangles: &[[u32; 3]], opaque: bool, boxes: bool) -> Blas {
    if boxes {
        let around = |t: &[u32; 3]| {
            let z = VERTICES[t[0] as usize][2];
            [[0.0, 0.0, z - 0.25], [1.0, 1.0, z + 0.25]]
        };
        let boxes: Vec<_> = triangles.iter().map(around).collect();
        return Blas::build_boxes(device, "group", &boxes, opaque).unwrap();
    }
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

const BINDINGS: [(u32, BindingKind); 3] = [
    (BIND_SCENE, BindingKind::AccelerationStructure),
    (BIND_PROBE_RAYS, BindingKind::Storage),
    (BIND_PROBE_HITS, BindingKind::Storage),
];

/// Whose rays, and whether they meet boxes in which shaders find the triangles.
type Way = (Rays, bool);

const WAYS: [Way; 4] = [
    (Rays::Query, false),
    (Rays::Query, true),
    (Rays::Pipeline, false),
    (Rays::Pipeline, true),
];

/// The test kernel for the rays of the device, or why there is none.
fn kernel(device: &Arc<Device>, (by, boxes): Way, alpha: bool) -> Result<Pipeline, Error> {
    let desc = PipelineDesc {
        name: "rays",
        spirv: &match by {
            Rays::Pipeline => module!("test_rays_pipeline"),
            _ => module!("test_rays"),
        },
        bindings: &BINDINGS,
        constants: &[
            (HAS_ALPHA, alpha.into()),
            (HAS_NESTED, 0),
            (HAS_INSTANCES, 1),
            (HAS_BOXES, boxes.into()),
        ],
        push_bytes: 4,
    };
    if by != Rays::Pipeline {
        return Pipeline::compute(device, &desc);
    }
    let any_hit = module!("test_rays_any_hit");
    let intersection = module!("test_rays_intersection");
    let stages = RayStages {
        miss: &module!("trace_miss"),
        closest_hit: &module!("trace_closest_hit"),
        any_hit: alpha.then_some(&any_hit),
        intersection: boxes.then_some(&intersection),
    };
    Pipeline::rays(device, &desc, &stages)
}

/// What the rays meet in the scene.
fn trace(
    device: &Arc<Device>,
    way: Way,
    scene: &Tlas,
    alpha: bool,
    rays: &[ProbeRay],
) -> Vec<ProbeHit> {
    let pipeline = kernel(device, way, alpha).unwrap();
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
        .run("rays", |commands| match way.0 {
            Rays::Pipeline => commands.trace(&pipeline, &set, &push, rays.len() as u32),
            _ => commands.dispatch(&pipeline, &set, &push, groups),
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
    for way in WAYS {
        rays_meet_placed_triangles_by(way);
    }
}

fn rays_meet_placed_triangles_by(way: Way) {
    let Some(device) = open_for(way.0) else {
        return;
    };
    let blas = group(&device, &[[0, 1, 2], [3, 4, 5]], true, way.1);
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
    let hits = trace(&device, way, &scene, false, &rays);
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
    for way in WAYS {
        cut_out_triangles_by(way);
    }
}

fn cut_out_triangles_by(way: Way) {
    let Some(device) = open_for(way.0) else {
        return;
    };
    let down = [0.0, 0.0, -1.0];
    let rays = [ray([0.25, 0.5, 3.0], down, 10.0)];
    let up = [ray([0.25, 0.5, -3.0], [0.0, 0.0, 1.0], 10.0)];
    let scene_of = |triangles: &[[u32; 3]], opaque| {
        let blas = group(&device, triangles, opaque, way.1);
        let instance = TlasInstance {
            blas: &blas,
            world_from_object: IDENTITY,
        };
        Tlas::build(&device, "scene", &[instance]).unwrap()
    };
    let masked = scene_of(&[[0, 1, 2], [3, 4, 5]], false);
    // Primitive 1 lies behind from above, and in front from below, where it is passed.
    assert_hit(
        &trace(&device, way, &masked, true, &rays)[0],
        3.0,
        [0.25, 0.5],
        0,
        0,
    );
    assert_hit(
        &trace(&device, way, &masked, true, &up)[0],
        3.0,
        [0.25, 0.5],
        0,
        0,
    );
    // Without the feature the ray's flag makes everything opaque.
    assert_hit(
        &trace(&device, way, &masked, false, &up)[0],
        2.0,
        [0.25, 0.5],
        0,
        1,
    );
    // An opaque group is not asked.
    let opaque = scene_of(&[[0, 1, 2], [3, 4, 5]], true);
    assert_hit(
        &trace(&device, way, &opaque, true, &up)[0],
        2.0,
        [0.25, 0.5],
        0,
        1,
    );
    // Nothing is left where every candidate is cut out: primitive 0 is out of the ray's way. (What is in a box,
    // the shader says.)
    if !way.1 {
        let passed = scene_of(&[[0, 0, 0], [3, 4, 5]], false);
        assert_miss(&trace(&device, way, &passed, true, &rays)[0]);
    }
    drop((masked, opaque));
    finish(device);
}

#[test]
fn empty_scenes_are_missed() {
    for way in WAYS {
        empty_scenes_by(way);
    }
}

fn empty_scenes_by(way: Way) {
    let Some(device) = open_for(way.0) else {
        return;
    };
    let rays = [ray([0.25, 0.5, 3.0], [0.0, 0.0, -1.0], 10.0)];
    let nothing = Tlas::build(&device, "nothing", &[]).unwrap();
    assert_miss(&trace(&device, way, &nothing, false, &rays)[0]);
    let blas = group(&device, &[], true, way.1);
    let instance = TlasInstance {
        blas: &blas,
        world_from_object: IDENTITY,
    };
    let hollow = Tlas::build(&device, "hollow", &[instance]).unwrap();
    assert_miss(&trace(&device, way, &hollow, true, &rays)[0]);
    drop((nothing, blas, hollow));
    finish(device);
}

#[test]
fn launches_keep_to_what_the_device_was_opened_for() {
    let Some(device) = open(true) else { return };
    let message = missing_of(
        kernel(&device, (Rays::Pipeline, false), false)
            .err()
            .unwrap(),
    );
    assert!(message.contains("opened without"), "{message}");
    finish(device);

    let Some(device) = open_for(Rays::Pipeline) else {
        return;
    };
    let pipeline = kernel(&device, (Rays::Pipeline, false), false).unwrap();
    let scene = Tlas::build(&device, "nothing", &[]).unwrap();
    let buffer = |name| Buffer::new(&device, name, 16, Usage::STORAGE, Memory::Readback).unwrap();
    let (input, output) = (buffer("rays"), buffer("hits"));
    let resources = [
        (BIND_SCENE, Resource::Acceleration(&scene)),
        (BIND_PROBE_RAYS, Resource::Buffer(&input)),
        (BIND_PROBE_HITS, Resource::Buffer(&output)),
    ];
    let set = BindSet::new(&pipeline, "rays", &resources).unwrap();
    let count = device.caps().max_launch.checked_add(1).unwrap();
    let result = device.run("too much", |commands| {
        commands.trace(&pipeline, &set, &[0; 4], count);
    });
    assert!(missing_of(result.err().unwrap()).contains("at most"));
    drop((set, input, output, scene, pipeline));
    finish(device);
}
