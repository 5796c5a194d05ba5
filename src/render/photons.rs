//! Photons: light that mirrors and interfaces bend, traced before the render. What they find is a guide (`guide.rs`).
//!
//! [Roberts18] Roberts, The Unreasonable Effectiveness of Quasirandom Sequences.

use std::panic::resume_unwind;
use std::sync::Arc;
use std::thread;

use glam::DVec3;

use super::traversal::{GROUP, Traversal};
use super::upload::SceneData;
use super::vulkan::{Input, bind, find, note_address, upload};
use crate::error::Result;
use crate::gpu::{BindingKind, Buffer, Device, Memory, Pipeline, Usage};
use crate::guide;
use crate::layout::{self, Photon, PhotonStart};
use crate::spec::Spec;

/// Photons that are traced.
const COUNT: usize = 1 << 16;
/// Triangles that are looked at, at most; of more, every so many.
const TRIANGLES: usize = 1 << 20;
/// Surfaces of a roughness up to this bend light. What rougher ones send on is found by chance soon enough.
const SMOOTH: f32 = 0.3;

/// The guide's texels, by photons that the scene's traversal traces, and the kernel that renders with them, which `compile`
/// makes meanwhile: a driver takes one core for one kernel. `None` where nothing bends light, or none of it arrives.
pub(super) fn guide(
    device: &Arc<Device>,
    traversal: &Traversal,
    spec: &Spec,
    shared: &[Input],
    data: &SceneData,
    compile: impl Fn(&Spec) -> Result<Pipeline> + Sync,
) -> Result<Option<(Vec<guide::Texel>, Pipeline)>> {
    let starts = starts(data);
    if starts.is_empty() {
        return Ok(None);
    }
    let (texels, pipeline) = thread::scope(|scope| {
        let pipeline = scope.spawn(|| compile(spec));
        let texels = trace(device, traversal, spec, shared, &starts);
        (texels, pipeline.join())
    });
    let pipeline = pipeline.unwrap_or_else(|panic| resume_unwind(panic));
    match texels? {
        Some(texels) => Ok(Some((texels, pipeline?))),
        None => Ok(None),
    }
}

/// Traces the photons.
fn trace(
    device: &Arc<Device>,
    traversal: &Traversal,
    spec: &Spec,
    shared: &[Input],
    starts: &[PhotonStart],
) -> Result<Option<Vec<guide::Texel>>> {
    let spec = Spec {
        guide: false,
        ..*spec
    };
    let table = find(shared, layout::BIND_ADDRESSES);
    let (usage, storage) = match table {
        Some(_) => (Usage::STORAGE | Usage::ADDRESS, BindingKind::Address),
        None => (Usage::STORAGE, BindingKind::Storage),
    };
    let mut bindings: Vec<_> = shared.iter().map(|(at, kind, _)| (*at, *kind)).collect();
    bindings.extend([
        (layout::BIND_PHOTON_STARTS, storage),
        (layout::BIND_PHOTONS, storage),
    ]);
    bindings.extend(traversal.bindings(table.is_some()));
    let pipeline = traversal.photon_pipeline(device, &spec, &bindings, table.is_some())?;
    let input = upload(device, "photon starts", starts, usage)?;
    let output = Buffer::new(
        device,
        "photons",
        (starts.len() * size_of::<Photon>()) as u64,
        usage,
        Memory::DeviceLocal,
    )?;
    let others = [
        (layout::BIND_PHOTON_STARTS, &input),
        (layout::BIND_PHOTONS, &output),
    ];
    for (at, buffer) in others {
        note_address(shared, at, buffer)?;
    }
    let set = bind(&pipeline, "photons", shared, &others, traversal)?;
    let push = layout::Batch {
        sample_count: starts.len() as u32,
        ..Default::default()
    };
    let groups = (starts.len() as u32).div_ceil(GROUP);
    device.run("photons", |commands| {
        traversal.launch(commands, &pipeline, &set, &push, groups);
    })?;
    Ok(guide::build(&output.read::<Photon>(starts.len())?))
}

/// Points of surfaces that bend light, spread evenly over their area; none without lights that paths can meet.
fn starts(data: &SceneData) -> Vec<PhotonStart> {
    let geometry = &data.geometry;
    let bends: Vec<bool> = data
        .materials
        .iter()
        .map(|m| bends_light(m, data))
        .collect();
    let is_lit = data.spec.environment || data.spec.area_lights;
    if !is_lit || !bends.contains(&true) {
        return Vec::new();
    }
    let ranges = geometry.placements.iter().map(|placement| {
        let range = geometry.groups[placement.group].triangles.clone();
        (placement, range)
    });
    let count: usize = ranges.clone().map(|(_, range)| range.len()).sum();
    let stride = count.div_ceil(TRIANGLES).max(1);
    let mut triangles = Vec::new();
    let mut total = 0.0;
    // triangles that are passed over before the next one
    let mut skipped = 0;
    for (placement, range) in ranges {
        let end = range.end;
        let mut triangle = range.start + skipped;
        while triangle < end {
            let material = geometry.triangles[triangle][3] & layout::TRIANGLE_MATERIAL_MASK;
            if bends[material as usize] {
                let corners = geometry
                    .corners(triangle)
                    .map(|p| placement.world_from_object.transform_point3(p.as_dvec3()));
                total += 0.5 * doubled_area(&corners).length();
                triangles.push((total, corners));
            }
            triangle += stride;
        }
        skipped = triangle - end;
    }
    if total <= 0.0 || !total.is_finite() {
        return Vec::new();
    }
    let step = total / COUNT as f64;
    let mut place = 0;
    let start = |k: usize| {
        let at = (k as f64 + 0.5) * step;
        while place + 1 < triangles.len() && triangles[place].0 <= at {
            place += 1;
        }
        start_on(&triangles[place].1, k, step * stride as f64)
    };
    (0..COUNT).map(start).collect()
}

/// Twice the area, along the normal.
fn doubled_area([a, b, c]: &[DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}

/// The point of the triangle that has the number k.
fn start_on(corners: &[DVec3; 3], k: usize, area: f64) -> PhotonStart {
    // steps of the plastic ratio [Roberts18]
    let turn = |step: f64| (0.5 + step * k as f64).fract();
    let (mut u, mut v) = (turn(0.754_877_666_246_693), turn(0.569_840_290_998_053));
    if u + v > 1.0 {
        (u, v) = (1.0 - u, 1.0 - v);
    }
    let [a, b, c] = *corners;
    let point = a + u * (b - a) + v * (c - a);
    let edge = (b - a).abs().max((c - a).abs()).max_element();
    PhotonStart {
        point: point.as_vec3().to_array(),
        weight: area as f32,
        normal: doubled_area(corners)
            .normalize_or_zero()
            .as_vec3()
            .to_array(),
        offset: (1e-5 * (point.abs().max_element() + edge)) as f32,
    }
}

/// Whether light that meets the material goes on in few directions.
fn bends_light(m: &layout::Material, data: &SceneData) -> bool {
    let is_textured = m.flags & layout::MATERIAL_HAS_TEXTURES != 0 && {
        let slot = m.first_texture + layout::TEXTURE_METALLIC_ROUGHNESS;
        data.texture_uses[slot as usize].first_texel != layout::NONE
    };
    let has_lobe = m.metallic > 0.0 || m.specular > 0.0 || m.transmission > 0.0;
    has_lobe && m.roughness <= SMOOTH && !is_textured
}
