//! Materials: metallic-roughness and the extensions on it.

use glam::{DVec3, Vec3, Vec4};

use super::json::{self, Root, TextureInfo};
use super::resolve::Files;
use super::texture::{ColorSpace, Textures, material_label};
use super::{Check, Warnings, quote};
use crate::scene::{AlphaMode, Material, TextureRef};

/// Loads every material of the file, in its order.
pub(super) fn load(
    root: &Root,
    textures: &mut Textures,
    files: &mut Files,
    warnings: &mut Warnings,
) -> Check<Vec<Material>> {
    let mut materials = Vec::new();
    for (index, from) in root.materials.iter().enumerate() {
        let mut loader = Loader {
            user: material_label(index, from.name.as_ref()),
            textures,
            files,
            warnings,
        };
        let mut material = Material {
            name: from
                .name
                .clone()
                .unwrap_or_else(|| format!("material {index}")),
            double_sided: from.double_sided,
            unlit: from.extensions.unlit.is_some(),
            alpha_mode: loader.alpha_mode(from)?,
            ..Material::default()
        };
        loader.metallic_roughness(&from.pbr_metallic_roughness, &mut material)?;
        loader.surface(from, &mut material)?;
        loader.emission(from, &mut material)?;
        loader.dielectric(&from.extensions, &mut material)?;
        materials.push(material);
    }
    Ok(materials)
}

struct Loader<'a, 'b> {
    user: String,
    textures: &'a mut Textures<'b>,
    files: &'a mut Files,
    warnings: &'a mut Warnings,
}

impl Loader<'_, '_> {
    fn texture(
        &mut self,
        info: Option<&TextureInfo>,
        color_space: ColorSpace,
        name: &str,
    ) -> Check<Option<TextureRef>> {
        let user = format!("{}.{name}", self.user);
        self.textures
            .reference(info, color_space, &user, self.files, self.warnings)
    }

    /// A factor that would create energy, or is none, outside 0 … 1.
    fn fraction(&mut self, value: Option<f64>, default: f32, name: &str) -> f32 {
        let Some(value) = value else {
            return default;
        };
        let valid = value.clamp(0.0, 1.0);
        if valid != value {
            self.warnings.push(format!(
                "{}: {name} {value} is clamped to {valid}",
                self.user
            ));
        }
        valid as f32
    }

    /// A colour that may exceed 1 but not be negative or infinite.
    fn color(
        &self,
        value: Option<[f64; 3]>,
        default: Vec3,
        factor: f64,
        name: &str,
    ) -> Check<Vec3> {
        let value = value.map_or(default.as_dvec3(), DVec3::from);
        let product = (value * factor).as_vec3();
        if value.min_element() >= 0.0 && factor >= 0.0 && product.is_finite() {
            Ok(product)
        } else {
            Err(format!(
                "{}: {name} must be finite and not negative",
                self.user
            ))
        }
    }

    fn metallic_roughness(
        &mut self,
        from: &json::MetallicRoughness,
        material: &mut Material,
    ) -> Check<()> {
        if let Some(color) = from.base_color_factor {
            let mut clamped = [1.0; 4];
            for (channel, value) in clamped.iter_mut().zip(color) {
                *channel = self.fraction(Some(value), 1.0, "baseColorFactor");
            }
            material.base_color = Vec4::from(clamped);
        }
        material.metallic = self.fraction(from.metallic_factor, 1.0, "metallicFactor");
        material.roughness = self.fraction(from.roughness_factor, 1.0, "roughnessFactor");
        material.base_color_texture = self.texture(
            from.base_color_texture.as_ref(),
            ColorSpace::Srgb,
            "baseColorTexture",
        )?;
        material.metallic_roughness_texture = self.texture(
            from.metallic_roughness_texture.as_ref(),
            ColorSpace::Linear,
            "metallicRoughnessTexture",
        )?;
        Ok(())
    }

    fn surface(&mut self, from: &json::Material, material: &mut Material) -> Check<()> {
        let info = from.normal_texture.as_ref();
        material.normal_texture = self.texture(info, ColorSpace::Linear, "normalTexture")?;
        material.normal_scale = info.and_then(|i| i.scale).unwrap_or(1.0) as f32;
        if !material.normal_scale.is_finite() {
            return Err(format!("{}.normalTexture: scale must be finite", self.user));
        }
        Ok(())
    }

    fn emission(&mut self, from: &json::Material, material: &mut Material) -> Check<()> {
        let strength = from.extensions.emissive_strength.as_ref();
        let strength = strength.and_then(|s| s.emissive_strength).unwrap_or(1.0);
        material.emission = self.color(
            from.emissive_factor,
            Vec3::ZERO,
            strength,
            "emissiveFactor × emissiveStrength",
        )?;
        material.emission_texture = self.texture(
            from.emissive_texture.as_ref(),
            ColorSpace::Srgb,
            "emissiveTexture",
        )?;
        Ok(())
    }

    fn dielectric(
        &mut self,
        from: &json::MaterialExtensions,
        material: &mut Material,
    ) -> Check<()> {
        if let Some(ior) = from.ior.as_ref().and_then(|i| i.ior) {
            material.ior = ior as f32;
            // 0 stands for an infinite index (KHR_materials_ior).
            let is_valid = material.ior.is_finite() && (ior == 0.0 || ior >= 1.0);
            if !is_valid {
                return Err(format!("{}: ior {ior} is neither 0 nor ≥ 1", self.user));
            }
        }
        let Some(specular) = &from.specular else {
            return Ok(());
        };
        material.specular = self.fraction(specular.specular_factor, 1.0, "specularFactor");
        material.specular_color = self.color(
            specular.specular_color_factor,
            Vec3::ONE,
            1.0,
            "specularColorFactor",
        )?;
        material.specular_texture = self.texture(
            specular.specular_texture.as_ref(),
            ColorSpace::Linear,
            "specularTexture",
        )?;
        material.specular_color_texture = self.texture(
            specular.specular_color_texture.as_ref(),
            ColorSpace::Srgb,
            "specularColorTexture",
        )?;
        Ok(())
    }

    fn alpha_mode(&self, from: &json::Material) -> Check<AlphaMode> {
        match from.alpha_mode.as_deref() {
            None | Some("OPAQUE") => Ok(AlphaMode::Opaque),
            Some("BLEND") => Ok(AlphaMode::Blend),
            Some("MASK") => {
                let cutoff = from.alpha_cutoff.unwrap_or(0.5) as f32;
                if cutoff >= 0.0 && cutoff.is_finite() {
                    Ok(AlphaMode::Mask { cutoff })
                } else {
                    Err(format!(
                        "{}: alphaCutoff must be finite and not negative",
                        self.user
                    ))
                }
            }
            Some(other) => Err(format!(
                "{}: alphaMode {} is not known, only OPAQUE, MASK and BLEND",
                self.user,
                quote(other)
            )),
        }
    }
}
