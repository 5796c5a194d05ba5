//! Which parts of the model a scene needs, frozen into the kernels as
//! specialisation constants: the twin of `shaders/spec.glsl`. What is off leaves
//! no instruction behind.

use crate::scene::{AlphaMode, Material, Scene};
use crate::settings::{Estimator, Settings, Strategy};

/// The features in the order of their constants' ids.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Spec {
    /// Any texture.
    pub textures: bool,
    /// Alpha-tested cut-outs.
    pub alpha: bool,
    /// Partial coverage.
    pub blend: bool,
    /// Any surface that is not pure Lambert.
    pub specular: bool,
    /// Shading normals, interpolated or mapped.
    pub normals: bool,
    /// Tangents, vertex colours or a second set of coordinates.
    pub attributes: bool,
    /// An environment map; a constant needs nothing.
    pub environment: bool,
    /// Emissive triangles.
    pub area_lights: bool,
    /// Point, spot and directional lights.
    pub punctual: bool,
    /// Meshes that are kept once and placed often.
    pub instances: bool,
    /// Layers of the first hit.
    pub aovs: bool,
    /// Any material that transmits.
    pub dielectric: bool,
    /// Shadow rays go through surfaces that let light straight through: partial coverage, smooth sheets, matched boundaries.
    pub passage: bool,
    /// Solids that may overlap or touch.
    pub nested: bool,
    /// The camera may be inside a solid.
    pub inside: bool,
    /// Anything that absorbs or scatters.
    pub media: bool,
    /// Media that scatter.
    pub scattering: bool,
    /// Distances in them are also sampled by the lights.
    pub equiangular: bool,
    /// A light meter that is no camera.
    pub sensor: bool,
    /// Samples of a block are a net, not independent.
    pub strata: bool,
    /// Lights are chosen by where they are needed.
    pub light_tree: bool,
    /// How direct light is found.
    pub strategy: Strategy,
    /// Flat pieces that are all tested before the own tree is walked: parallelograms …
    pub parallelograms: u32,
    /// … and triangles.
    pub triangles: u32,
    /// Of their normals and the gradients of their coordinates, for each component the pieces where it is 0, a bit each.
    pub without: [u32; 9],
    /// Which slots of materials are filled, and with what: bits `TEXTURE_KIND_*`.
    pub texture_kinds: u32,
    /// The device's structures hold boxes, and shaders test the triangles.
    pub boxes: bool,
    /// All nodes of our own tree fit a uniform buffer …
    pub small_nodes: bool,
    /// … and so do its records.
    pub small_records: bool,
    /// Pixels may take different numbers of samples.
    pub allotment: bool,
    /// Photons tell where light comes from that mirrors and interfaces have bent, where any of it arrives.
    pub guide: bool,
    /// Pixels share what their paths find, where the scene allows it: no constant, but a kernel of its own.
    pub share: bool,
}

/// Features that kernels of pixels that share are compiled without (`SHARE` in `shaders/spec.glsl`).
#[doc(hidden)]
pub const NOT_SHARED: [&str; 7] = [
    "dielectric",
    "nested",
    "inside",
    "media",
    "scattering",
    "equiangular",
    "sensor",
];

impl Spec {
    /// What the scene needs, before geometry is uploaded. `normals`, `attributes`,
    /// `instances`, `nested`, `inside`, `equiangular` and `light_tree` are settled by the upload,
    /// which sees the meshes and the lights; so is `texture_kinds`.
    pub fn for_scene(scene: &Scene, settings: &Settings) -> Self {
        let mut spec = Self {
            aovs: settings.aovs,
            sensor: settings.sensor.is_some_and(|s| s.needs_kernel()),
            strata: settings.block_level() > 0,
            strategy: settings.strategy,
            allotment: settings.adaptive,
            share: settings.share,
            punctual: scene.lights.iter().any(|l| l.intensity.max_element() > 0.0),
            environment: matches!(
                &scene.environment,
                Some(crate::scene::Environment::Map { .. })
            ),
            ..Self::default()
        };
        let mut used: Vec<u32> = scene
            .instances
            .iter()
            .map(|i| scene.meshes[i.mesh as usize].material)
            .collect();
        used.sort_unstable();
        used.dedup();
        for material in used.iter().map(|&m| &scene.materials[m as usize]) {
            spec.textures |= has_textures(material);
            spec.alpha |= matches!(material.alpha_mode, AlphaMode::Mask { .. });
            spec.blend |= material.alpha_mode == AlphaMode::Blend;
            spec.specular |= is_specular(material);
            spec.area_lights |= is_emissive(material);
            spec.dielectric |= is_transmissive(material);
            spec.passage |= spec.blend || (is_transmissive(material) && may_pass(material));
            let inside = material.volume.as_ref().map(|v| &v.medium);
            spec.media |= inside.is_some_and(|m| !m.is_clear());
            spec.scattering |= inside.is_some_and(|m| m.scattering != glam::Vec3::ZERO);
        }
        if let Some(outside) = &scene.medium {
            spec.media |= !outside.is_clear();
            spec.scattering |= outside.scattering != glam::Vec3::ZERO;
        }
        spec.guide = spec.specular
            && !spec.scattering
            && !spec.shares()
            && settings.estimator == Estimator::Full
            && settings.strategy == Strategy::Mis;
        spec
    }

    /// Everything switched on that needs no other data or numbers: must give the same picture.
    pub fn with_everything(self) -> Self {
        Self {
            textures: true,
            alpha: true,
            blend: true,
            specular: true,
            normals: true,
            attributes: true,
            environment: self.environment,
            area_lights: true,
            punctual: true,
            instances: self.instances,
            aovs: self.aovs,
            dielectric: true,
            passage: true,
            nested: self.nested,
            inside: true,
            media: true,
            scattering: true,
            equiangular: self.equiangular,
            sensor: self.sensor,
            strata: self.strata,
            light_tree: self.light_tree,
            strategy: self.strategy,
            parallelograms: self.parallelograms,
            triangles: self.triangles,
            without: self.without,
            texture_kinds: u32::MAX,
            boxes: self.boxes,
            small_nodes: self.small_nodes,
            small_records: self.small_records,
            allotment: self.allotment,
            guide: self.guide,
            share: self.share,
        }
    }

    /// Whether traversals ask of some triangles if they are there: `HAS_CANDIDATES`.
    pub(crate) fn has_candidates(&self) -> bool {
        self.alpha || self.nested
    }

    /// Whether pixels share: that is asked for, and shadow rays tell all of what is between two surfaces.
    pub(crate) fn shares(&self) -> bool {
        let mut on = self.features().into_iter().filter(|(_, on)| *on);
        self.share && !self.passage && !on.any(|(name, _)| NOT_SHARED.contains(&name))
    }

    /// Names of the features with their state, for people and files.
    pub fn features(&self) -> [(&'static str, bool); 21] {
        [
            ("textures", self.textures),
            ("alpha", self.alpha),
            ("blend", self.blend),
            ("specular", self.specular),
            ("normals", self.normals),
            ("attributes", self.attributes),
            ("environment", self.environment),
            ("area-lights", self.area_lights),
            ("punctual", self.punctual),
            ("instances", self.instances),
            ("aovs", self.aovs),
            ("dielectric", self.dielectric),
            ("passage", self.passage),
            ("nested", self.nested),
            ("inside", self.inside),
            ("media", self.media),
            ("scattering", self.scattering),
            ("equiangular", self.equiangular),
            ("sensor", self.sensor),
            ("strata", self.strata),
            ("light-tree", self.light_tree),
        ]
    }

    /// Pairs of constant id and value.
    pub fn constants(&self) -> Vec<(u32, u32)> {
        let strategy = match self.strategy {
            Strategy::Mis => 0,
            Strategy::LightOnly => 1,
            Strategy::BsdfOnly => 2,
        };
        let flags = self.features().map(|(_, on)| u32::from(on));
        (0..)
            .zip(
                flags
                    .into_iter()
                    .chain([strategy, self.parallelograms, self.triangles])
                    .chain([self.texture_kinds])
                    .chain([self.boxes, self.small_nodes, self.small_records].map(u32::from))
                    .chain([self.allotment, self.guide].map(u32::from))
                    .chain(self.without),
            )
            .collect()
    }
}

/// Whether any slot of the material holds a texture.
pub(crate) fn has_textures(m: &Material) -> bool {
    [
        m.base_color_texture,
        m.metallic_roughness_texture,
        m.normal_texture,
        m.emission_texture,
        m.specular_texture,
        m.specular_color_texture,
        m.transmission_texture,
    ]
    .iter()
    .any(Option::is_some)
}

/// Whether light that the material emits can be other than zero.
pub(crate) fn is_emissive(m: &Material) -> bool {
    if m.unlit {
        m.base_color.truncate().max_element() > 0.0
    } else {
        m.emission.max_element() > 0.0
    }
}

/// Whether the material reflects other than as pure Lambert.
fn is_specular(m: &Material) -> bool {
    !m.unlit && (m.metallic > 0.0 || m.specular > 0.0 || m.transmission > 0.0)
}

/// Whether light can go through the surface.
pub(crate) fn is_transmissive(m: &Material) -> bool {
    !m.unlit && m.metallic < 1.0 && m.transmission > 0.0
}

/// Whether light may go straight through a transmissive surface: a smooth sheet, or a boundary without an index.
fn may_pass(m: &Material) -> bool {
    let is_smooth = m.roughness < 0.04 || m.metallic_roughness_texture.is_some();
    match m.volume {
        None => is_smooth,
        Some(_) => (m.ior - 1.0).abs() < 1e-3,
    }
}

/// SPIR-V of a kernel, embedded.
#[derive(Clone, Copy)]
pub(crate) struct Kernel {
    name: &'static str,
    spirv: &'static [u8],
}

impl Kernel {
    /// The words of the module.
    pub(crate) fn words(self) -> Vec<u32> {
        let planted = crate::mutant::spirv(self.name);
        bytemuck::pod_collect_to_vec(planted.as_deref().unwrap_or(self.spirv))
    }
}

macro_rules! kernel {
    ($name:literal) => {
        super::Kernel {
            name: $name,
            spirv: include_bytes!(concat!(env!("OUT_DIR"), "/", $name, ".spv")),
        }
    };
}

/// The kernels, one for each traversal.
pub(crate) mod kernels {
    use super::Kernel;

    /// By texel buffers and by addresses.
    pub(crate) const PATH_SOFTWARE: [Kernel; 2] =
        [kernel!("path_software"), kernel!("path_software_addresses")];
    pub(crate) const PATH_QUERY: [Kernel; 2] =
        [kernel!("path_query"), kernel!("path_query_addresses")];
    /// As `PATH_SOFTWARE`, and counts what traversal does.
    pub(crate) const PATH_COUNTS: [Kernel; 2] =
        [kernel!("path_counts"), kernel!("path_addresses_counts")];
    /// The same, and keeps every ray with what it met; by texel buffers alone.
    pub(crate) const PATH_RECORD: Kernel = kernel!("path_record");
    /// The same, and looks up what rays meet.
    pub(crate) const PATH_RECALL: [Kernel; 2] =
        [kernel!("path_recall"), kernel!("path_addresses_recall")];
    /// Pixels share what their paths find.
    pub(crate) const SHARE_SOFTWARE: [Kernel; 2] = [
        kernel!("share_software"),
        kernel!("share_software_addresses"),
    ];
    pub(crate) const SHARE_QUERY: [Kernel; 2] =
        [kernel!("share_query"), kernel!("share_query_addresses")];
    /// Traces recorded rays and shades nothing.
    pub(crate) const REPLAY_SOFTWARE: [Kernel; 2] = [
        kernel!("replay_software"),
        kernel!("replay_software_addresses"),
    ];
    pub(crate) const REPLAY_QUERY: [Kernel; 2] =
        [kernel!("replay_query"), kernel!("replay_query_addresses")];
    /// Reads them and traces nothing.
    pub(crate) const REPLAY_NOTHING: [Kernel; 2] = [
        kernel!("replay_nothing"),
        kernel!("replay_nothing_addresses"),
    ];
    pub(crate) const REPLAY_PIPELINE: Kernel = kernel!("replay_pipeline");
    pub(crate) const PROBE_SOFTWARE: Kernel = kernel!("probe_software");
    pub(crate) const PROBE_QUERY: Kernel = kernel!("probe_query");
    #[cfg(feature = "wgpu")]
    pub(crate) const PATH_WGPU: Kernel = kernel!("path_wgpu");
    #[cfg(feature = "wgpu")]
    pub(crate) const PATH_WGPU_QUERY: Kernel = kernel!("path_wgpu_query");
    /// Traces photons.
    pub(crate) const PHOTON_SOFTWARE: [Kernel; 2] = [
        kernel!("photon_software"),
        kernel!("photon_software_addresses"),
    ];
    pub(crate) const PHOTON_QUERY: [Kernel; 2] =
        [kernel!("photon_query"), kernel!("photon_query_addresses")];
    pub(crate) const PHOTON_PIPELINE: Kernel = kernel!("photon_pipeline");
    pub(crate) const PATH_PIPELINE: Kernel = kernel!("path_pipeline");
    pub(crate) const PROBE_PIPELINE: Kernel = kernel!("probe_pipeline");
    /// What the ray generation shaders call.
    pub(crate) const TRACE_MISS: Kernel = kernel!("trace_miss");
    pub(crate) const TRACE_CLOSEST_HIT: Kernel = kernel!("trace_closest_hit");
    pub(crate) const TRACE_ANY_HIT: Kernel = kernel!("trace_any_hit");
    pub(crate) const TRACE_INTERSECTION: Kernel = kernel!("trace_intersection");
}
