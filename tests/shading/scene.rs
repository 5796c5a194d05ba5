//! Scenes made by hand for the functions that read the scene's buffers.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use etendue::gpu::{BindingKind, Buffer, Device, TexelFormat, Usage};
use etendue::layout::{self, Params};

use crate::{BIND_INPUT, BIND_OUTPUT, Kernel, groups};

const SCENE: &str = "test_shading_scene";

/// Of `shaders/tests/shading_scene.comp`.
pub const ENVIRONMENT: u32 = 0;
pub const LIGHT: u32 = 1;
pub const TEXTURE: u32 = 2;
pub const CAMERA: u32 = 3;
pub const RADIANCE: u32 = 4;

#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct Query {
    pub u: [f32; 4],
    pub index: [u32; 2],
}

#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct Answer {
    pub a: [f32; 4],
    pub b: [f32; 4],
    pub c: [f32; 4],
}

/// Contents of the buffers; what a test leaves out is empty.
#[derive(Default)]
pub struct Scene {
    pub params: Params,
    pub triangles: Vec<[u32; 4]>,
    pub vertices: Vec<[f32; 4]>,
    pub materials: Vec<layout::Material>,
    pub texture_uses: Vec<layout::TextureUse>,
    pub texels: Vec<u32>,
    pub lights: Vec<layout::Light>,
    pub env_map: Vec<[f32; 4]>,
    pub env_table: Vec<[u32; 2]>,
    pub has_environment: bool,
    pub has_area_lights: bool,
    pub has_punctual: bool,
}

impl Scene {
    /// Answers of one function to all queries.
    pub fn ask(&self, device: &Arc<Device>, kind: u32, queries: &[Query]) -> Vec<Answer> {
        use BindingKind::{Storage, Texel, Uniform};
        let bindings = [
            (layout::BIND_PARAMS, Uniform),
            (layout::BIND_INSTANCES, Texel),
            (layout::BIND_TRIANGLES, Texel),
            (layout::BIND_VERTICES, Texel),
            (layout::BIND_ATTRIBUTES, Texel),
            (layout::BIND_MATERIALS, Texel),
            (layout::BIND_TEXTURE_USES, Texel),
            (layout::BIND_TEXELS, Texel),
            (layout::BIND_LIGHTS, Texel),
            (layout::BIND_ENV_MAP, Texel),
            (layout::BIND_ENV_TABLE, Texel),
            (BIND_INPUT, Storage),
            (BIND_OUTPUT, Storage),
        ];
        // Of spec.glsl: no cut-outs, no coverage, one group in world space.
        let constants = [
            (1, 0),
            (2, 0),
            (6, self.has_environment.into()),
            (7, self.has_area_lights.into()),
            (8, self.has_punctual.into()),
            (9, 0),
        ];
        let kernel = Kernel::new(device, SCENE, &bindings, &constants, 2);
        let answers = kernel.output::<Answer>(queries.len());
        let mut buffers = self.buffers(device);
        buffers.push(kernel.storage(queries));
        buffers.push(answers.clone());
        let resources: Vec<_> = bindings.iter().map(|b| b.0).zip(&buffers).collect();
        kernel.run(
            &resources,
            &[kind, queries.len() as u32],
            groups(queries.len()),
        );
        answers.read(queries.len()).unwrap()
    }

    /// In the order of the bindings.
    fn buffers(&self, device: &Arc<Device>) -> Vec<Buffer> {
        fn new<T: Pod>(device: &Arc<Device>, usage: Usage, data: &[T]) -> Buffer {
            Buffer::from_slice(device, "scene", usage, data).unwrap()
        }
        let texel = Usage::texel;
        let none: [u32; 0] = [];
        vec![
            new(device, Usage::UNIFORM, &[self.params]),
            new(device, texel(TexelFormat::Rgba32Uint), &none),
            new(device, texel(TexelFormat::Rgba32Uint), &self.triangles),
            new(device, texel(TexelFormat::Rgba32Float), &self.vertices),
            new(device, texel(TexelFormat::Rgba32Float), &none),
            new(device, texel(TexelFormat::Rgba32Uint), &self.materials),
            new(device, texel(TexelFormat::Rgba32Uint), &self.texture_uses),
            new(device, texel(TexelFormat::R32Uint), &self.texels),
            new(device, texel(TexelFormat::Rgba32Uint), &self.lights),
            new(device, texel(TexelFormat::Rgba32Float), &self.env_map),
            new(device, texel(TexelFormat::Rg32Uint), &self.env_table),
        ]
    }
}

/// Alias table by repeatedly filling the least entry from the largest: keep, alias.
pub fn alias_table(weights: &[f64]) -> Vec<(f32, u32)> {
    let total: f64 = weights.iter().sum();
    let mut left: Vec<f64> = weights
        .iter()
        .map(|w| w / total * weights.len() as f64)
        .collect();
    let mut table: Vec<Option<(f32, u32)>> = vec![None; weights.len()];
    for _ in 0..weights.len() {
        let open = || (0..weights.len()).filter(|&i| table[i].is_none());
        let least = open().min_by(|&a, &b| left[a].total_cmp(&left[b])).unwrap();
        let most = open().max_by(|&a, &b| left[a].total_cmp(&left[b])).unwrap();
        if least == most {
            table[least] = Some((1.0, least as u32));
        } else {
            table[least] = Some((left[least] as f32, most as u32));
            left[most] -= 1.0 - left[least];
        }
    }
    table.into_iter().map(Option::unwrap).collect()
}
