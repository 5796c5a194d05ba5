//! Scene → the arrays that the kernels read: the only writer of the shared
//! structs, apart from the batches.

use glam::{DVec3, Vec3};

use super::environment::SampledMap;
use super::geometry::Geometry;
use super::lights;
use super::media;
use super::solids::Solids;
use super::view::{camera_origins, params};
use crate::layout;
use crate::scene::{
    AlphaMode, Environment, Filter, Material, Scene, Texels, Texture, TextureRef, Wrap,
};
use crate::settings::{Estimator, Settings, Strategy};
use crate::spec::{self, Spec};

/// Host copies of everything but the acceleration structures.
pub(crate) struct SceneData {
    pub spec: Spec,
    pub geometry: Geometry,
    pub params: layout::Params,
    pub instances: Vec<layout::Instance>,
    pub materials: Vec<layout::Material>,
    pub media: Vec<layout::Medium>,
    pub texture_uses: Vec<layout::TextureUse>,
    pub texels: Vec<u32>,
    /// The light table as texels, then the nodes and the keys of the tree.
    pub lights: Vec<[u32; 4]>,
    pub env_map: Vec<[f32; 4]>,
    pub env_table: Vec<[u32; 2]>,
}

impl SceneData {
    /// Prepares the scene for the settings; `copy_limit` as in [`super::geometry::DEFAULT_COPY_LIMIT`].
    pub fn new(scene: &Scene, settings: &Settings, copy_limit: usize) -> Self {
        let solids = Solids::of(scene);
        let geometry = Geometry::new(scene, &solids, copy_limit);
        let mut spec = Spec::for_scene(scene, settings);
        spec.normals =
            geometry.has_normals || scene.materials.iter().any(|m| m.normal_texture.is_some());
        spec.attributes = !geometry.attributes.is_empty();
        spec.instances = geometry.has_instances();
        spec.inside = solids.may_hold(camera_origins(scene, settings));
        if solids.are_nested {
            (spec.nested, spec.passage) = (true, true);
        }

        let (texels, first_texels) = texels(&scene.textures);
        let mut data = Self {
            spec,
            params: params(scene, settings, &geometry),
            instances: instances(&geometry),
            materials: Vec::new(),
            media: media::table(scene, &solids),
            texture_uses: Vec::new(),
            texels,
            lights: Vec::new(),
            env_map: Vec::new(),
            env_table: Vec::new(),
            geometry,
        };
        let emissions: Vec<f64> = solids
            .materials(scene)
            .map(|m| mean_emission(m, &scene.textures))
            .collect();
        data.add_materials(scene, &solids, &first_texels);
        let env_power = data.add_environment(scene, settings);
        data.add_lights(scene, settings, &solids, &emissions, env_power);
        data
    }

    /// Bytes of textures and environment maps on the device.
    pub fn texture_bytes(&self) -> u64 {
        (4 * self.texels.len() + 16 * self.env_map.len() + 8 * self.env_table.len()) as u64
    }

    /// Pixels that each have an exponent of their own.
    pub fn allotted_pixels(&self) -> usize {
        match self.spec.allotment {
            true => self.params.window_width as usize * self.params.window_height as usize,
            false => 0,
        }
    }

    /// Bytes of the lists that are neither geometry nor textures.
    pub fn table_bytes(&self) -> u64 {
        let bytes = size_of_val(&self.params)
            + size_of_val(self.instances.as_slice())
            + size_of_val(self.materials.as_slice())
            + size_of_val(self.media.as_slice())
            + size_of_val(self.texture_uses.as_slice())
            + size_of_val(self.lights.as_slice())
            + size_of::<u32>() * self.allotted_pixels();
        bytes as u64
    }

    fn add_materials(&mut self, scene: &Scene, solids: &Solids, first_texels: &[u32]) {
        for m in solids.materials(scene) {
            let mut record = material(m);
            if spec::has_textures(m) {
                record.flags |= layout::MATERIAL_HAS_TEXTURES;
                record.first_texture = self.texture_uses.len() as u32;
                let emission = if m.unlit {
                    m.base_color_texture
                } else {
                    m.emission_texture
                };
                let slots = [
                    m.base_color_texture,
                    m.metallic_roughness_texture,
                    m.normal_texture,
                    emission,
                    m.specular_texture,
                    m.specular_color_texture,
                    m.transmission_texture,
                ];
                self.spec.texture_kinds |= texture_kinds(&slots, &scene.textures);
                self.texture_uses
                    .extend(slots.map(|slot| texture_use(slot, &scene.textures, first_texels)));
            }
            self.materials.push(record);
        }
    }

    /// The map with its table; returns its power into the scene, or 0 where there is none.
    fn add_environment(&mut self, scene: &Scene, settings: &Settings) -> f64 {
        self.spec.environment = false;
        match &scene.environment {
            None => 0.0,
            Some(Environment::Constant(radiance)) => {
                self.params.env_radiance = radiance.to_array();
                0.0
            }
            Some(Environment::Map {
                width,
                height,
                texels,
                intensity,
                rotation,
            }) => {
                let size = [*width as usize, *height as usize];
                let is_compensated =
                    settings.estimator == Estimator::Full && settings.strategy == Strategy::Mis;
                let Some(map) = SampledMap::new(size, texels, is_compensated) else {
                    return 0.0;
                };
                self.spec.environment = *intensity > 0.0;
                self.params.env_radiance = [*intensity; 3];
                self.params.env_width = *width;
                self.params.env_height = *height;
                self.params.env_cos_rotation = f64::from(*rotation).cos() as f32;
                self.params.env_sin_rotation = f64::from(*rotation).sin() as f32;
                self.env_map = map.texels;
                self.env_table = map.table.words;
                self.params.env_shift = map.table.shift;
                let radius = self.geometry.radius;
                4.0 * std::f64::consts::PI.powi(2)
                    * radius
                    * radius
                    * map.mean
                    * f64::from(*intensity)
            }
        }
    }
}

/// Radiance of a material averaged over its texture, as a scalar for sampling.
fn mean_emission(m: &Material, textures: &[Texture]) -> f64 {
    if !spec::is_emissive(m) {
        return 0.0;
    }
    let (factor, texture) = if m.unlit {
        (m.base_color.truncate(), m.base_color_texture)
    } else {
        (m.emission, m.emission_texture)
    };
    let mean = texture.map_or(Vec3::ONE, |t| mean_texel(&textures[t.texture as usize]));
    lights::sampling_weight(factor * mean)
}

/// Mean colour of a texture, linear.
fn mean_texel(texture: &Texture) -> Vec3 {
    let mut sum = DVec3::ZERO;
    let count = match &texture.texels {
        Texels::Rgba8 { data, srgb } => {
            let decode = |v: u8| {
                f64::from(if *srgb {
                    srgb_to_linear(v)
                } else {
                    f32::from(v) / 255.0
                })
            };
            for t in data.chunks_exact(4) {
                sum += DVec3::new(decode(t[0]), decode(t[1]), decode(t[2]));
            }
            data.len() / 4
        }
        Texels::Rgba16(data) => {
            for t in data.chunks_exact(4) {
                sum += DVec3::new(t[0].into(), t[1].into(), t[2].into()) / 65_535.0;
            }
            data.len() / 4
        }
    };
    (sum / count.max(1) as f64).as_vec3()
}

/// An sRGB byte as linear light (IEC 61966-2-1).
fn srgb_to_linear(byte: u8) -> f32 {
    let v = f64::from(byte) / 255.0;
    let linear = if v <= 0.04045 {
        v / 12.92
    } else {
        ((v + 0.055) / 1.055).powf(2.4)
    };
    linear as f32
}

fn material(m: &Material) -> layout::Material {
    let mut flags = 0;
    let mut alpha_cutoff = 0.0;
    if m.double_sided || m.unlit {
        flags |= layout::MATERIAL_DOUBLE_SIDED;
    }
    match m.alpha_mode {
        AlphaMode::Opaque => {}
        AlphaMode::Mask { cutoff } => {
            flags |= layout::MATERIAL_MASK;
            alpha_cutoff = cutoff;
        }
        AlphaMode::Blend => flags |= layout::MATERIAL_BLEND,
    }
    if m.volume.is_some() {
        flags |= layout::MATERIAL_SOLID;
    }
    let mut record = layout::Material {
        base_color: m.base_color.truncate().to_array(),
        flags,
        emission: m.emission.to_array(),
        alpha: m.base_color.w,
        alpha_cutoff,
        metallic: m.metallic,
        roughness: m.roughness,
        specular_color: m.specular_color.to_array(),
        transmission: m.transmission,
        ior: m.ior,
        specular: m.specular,
        normal_scale: m.normal_scale,
        ..Default::default()
    };
    if m.unlit {
        record.flags |= layout::MATERIAL_UNLIT;
        record.emission = record.base_color;
        record.metallic = 0.0;
        record.specular = 0.0;
        record.transmission = 0.0;
        record.flags &= !layout::MATERIAL_SOLID;
    }
    record
}

/// What kernels have to know about the textures of a material: `TEXTURE_KIND_*`.
fn texture_kinds(slots: &[Option<TextureRef>], textures: &[Texture]) -> u32 {
    let filled = (0..).zip(slots).filter_map(|(i, slot)| Some((i, (*slot)?)));
    filled.fold(0, |kinds, (i, slot): (u32, TextureRef)| {
        let texture = &textures[slot.texture as usize];
        let format = match texture.texels {
            Texels::Rgba8 { srgb: false, .. } => 0,
            Texels::Rgba8 { srgb: true, .. } => 1 << (layout::TEXTURE_KIND_SRGB + i),
            Texels::Rgba16(_) => 1 << layout::TEXTURE_KIND_RGBA16,
        };
        let wrap = texture.wrap.map(|wrap| match wrap {
            Wrap::Repeat => 0,
            Wrap::Mirror => 1 << layout::TEXTURE_KIND_MIRROR,
            Wrap::Clamp => 1 << layout::TEXTURE_KIND_CLAMP,
        });
        let filter = match texture.filter {
            Filter::Nearest => 1 << layout::TEXTURE_KIND_NEAREST,
            Filter::Linear => 1 << layout::TEXTURE_KIND_LINEAR,
        };
        kinds | 1 << i | format | wrap[0] | wrap[1] | filter
    })
}

fn texture_use(
    slot: Option<TextureRef>,
    textures: &[Texture],
    first: &[u32],
) -> layout::TextureUse {
    let Some(slot) = slot else {
        return layout::TextureUse {
            first_texel: layout::NONE,
            ..Default::default()
        };
    };
    let texture = &textures[slot.texture as usize];
    let format = match texture.texels {
        Texels::Rgba8 { srgb: false, .. } => layout::FORMAT_RGBA8,
        Texels::Rgba8 { srgb: true, .. } => layout::FORMAT_SRGB8,
        Texels::Rgba16(_) => layout::FORMAT_RGBA16,
    };
    let wrap = texture.wrap.map(|wrap| match wrap {
        Wrap::Repeat => layout::WRAP_REPEAT,
        Wrap::Mirror => layout::WRAP_MIRROR,
        Wrap::Clamp => layout::WRAP_CLAMP,
    });
    let filter = match texture.filter {
        Filter::Nearest => layout::FILTER_NEAREST,
        Filter::Linear => layout::FILTER_LINEAR,
    };
    layout::TextureUse {
        first_texel: first[slot.texture as usize],
        width: texture.width,
        height: texture.height,
        format: format | wrap[0] << 4 | wrap[1] << 8 | filter << 12,
        uv_set: slot.uv_set,
        uv_row_u: slot.uv_transform[0],
        uv_row_v: slot.uv_transform[1],
        ..Default::default()
    }
}

/// All textures behind the table of decoded sRGB values, and where each starts.
fn texels(textures: &[Texture]) -> (Vec<u32>, Vec<u32>) {
    let mut words: Vec<u32> = (0..=255)
        .map(|byte| srgb_to_linear(byte).to_bits())
        .collect();
    let first = textures
        .iter()
        .map(|texture| {
            let start = words.len() as u32;
            match &texture.texels {
                Texels::Rgba8 { data, .. } => {
                    words.extend(
                        data.chunks_exact(4)
                            .map(|t| u32::from_le_bytes([t[0], t[1], t[2], t[3]])),
                    );
                }
                Texels::Rgba16(data) => {
                    words.extend(
                        data.chunks_exact(2)
                            .map(|t| u32::from(t[0]) | u32::from(t[1]) << 16),
                    );
                }
            }
            start
        })
        .collect();
    (words, first)
}

fn instances(geometry: &Geometry) -> Vec<layout::Instance> {
    geometry
        .placements
        .iter()
        .map(|placement| {
            let columns = |m: &glam::DAffine3| {
                let a = m.matrix3;
                [a.x_axis, a.y_axis, a.z_axis, m.translation].map(|v| v.as_vec3().to_array())
            };
            let [wx, wy, wz, wt] = columns(&placement.world_from_object);
            let [ox, oy, oz, ot] = columns(&placement.world_from_object.inverse());
            layout::Instance {
                world_from_object_x: wx,
                world_from_object_y: wy,
                world_from_object_z: wz,
                world_from_object_t: wt,
                object_from_world_x: ox,
                object_from_world_y: oy,
                object_from_world_z: oz,
                object_from_world_t: ot,
                first_triangle: geometry.groups[placement.group].triangles.start as u32,
                is_identity: u32::from(placement.group == 0),
                is_mirrored: u32::from(placement.world_from_object.matrix3.determinant() < 0.0),
                ..Default::default()
            }
        })
        .collect()
}
