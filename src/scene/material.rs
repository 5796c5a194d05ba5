//! Surface descriptions: glTF's metallic-roughness model and its extensions.

use glam::{Vec3, Vec4};

use super::{TextureRef, Volume};

/// How the alpha of the base colour is read.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum AlphaMode {
    /// Alpha is ignored.
    #[default]
    Opaque,
    /// The surface exists where alpha ≥ cutoff.
    Mask {
        /// Threshold.
        cutoff: f32,
    },
    /// The surface covers the fraction alpha of the light that meets it.
    Blend,
}

/// One glTF material. Colours are linear Rec. 709.
#[derive(Clone, Debug)]
pub struct Material {
    /// Name in the file, or `material N`.
    pub name: String,
    /// Base colour and alpha.
    pub base_color: Vec4,
    /// Factor on `base_color`, RGBA.
    pub base_color_texture: Option<TextureRef>,
    /// 0 dielectric … 1 metal.
    pub metallic: f32,
    /// Perceptual roughness; the microfacet α is its square.
    pub roughness: f32,
    /// Factors: roughness in G, metallic in B.
    pub metallic_roughness_texture: Option<TextureRef>,
    /// Tangent-space normal map.
    pub normal_texture: Option<TextureRef>,
    /// Factor on the map's x and y.
    pub normal_scale: f32,
    /// Emitted radiance, cd/m² per channel (factor × strength).
    pub emission: Vec3,
    /// Factor on `emission`.
    pub emission_texture: Option<TextureRef>,
    /// KHR_materials_ior: index of refraction; 0 stands for an infinite index.
    pub ior: f32,
    /// KHR_materials_specular: strength of the dielectric reflection; 0 leaves pure Lambert.
    pub specular: f32,
    /// Factor on `specular`, in A.
    pub specular_texture: Option<TextureRef>,
    /// KHR_materials_specular: tint of F0; may exceed 1.
    pub specular_color: Vec3,
    /// Factor on `specular_color`, RGB.
    pub specular_color_texture: Option<TextureRef>,
    /// KHR_materials_transmission: fraction of the light through the coat that goes on instead of being scattered by the base.
    pub transmission: f32,
    /// Factor on `transmission`, in R.
    pub transmission_texture: Option<TextureRef>,
    /// What the closed mesh encloses; none with transmission is an infinitely thin sheet.
    pub volume: Option<Volume>,
    /// How alpha is read.
    pub alpha_mode: AlphaMode,
    /// Emits from both sides. (Reflection never depends on it: nothing is culled.)
    pub double_sided: bool,
    /// KHR_materials_unlit: shows its base colour as emitted radiance and reflects nothing.
    pub unlit: bool,
}

impl Default for Material {
    /// glTF's default material.
    fn default() -> Self {
        Self {
            name: String::from("default"),
            base_color: Vec4::ONE,
            base_color_texture: None,
            metallic: 1.0,
            roughness: 1.0,
            metallic_roughness_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
            emission: Vec3::ZERO,
            emission_texture: None,
            ior: 1.5,
            specular: 1.0,
            specular_texture: None,
            specular_color: Vec3::ONE,
            specular_color_texture: None,
            transmission: 0.0,
            transmission_texture: None,
            volume: None,
            alpha_mode: AlphaMode::Opaque,
            double_sided: false,
            unlit: false,
        }
    }
}

impl Material {
    /// Every texture that the material uses.
    pub fn textures(&self) -> impl Iterator<Item = TextureRef> {
        [
            self.base_color_texture,
            self.metallic_roughness_texture,
            self.normal_texture,
            self.emission_texture,
            self.specular_texture,
            self.specular_color_texture,
            self.transmission_texture,
        ]
        .into_iter()
        .flatten()
    }
}
