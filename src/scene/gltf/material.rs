//! Materials: metallic-roughness and the extensions on it.

use glam::{DVec3, Vec3, Vec4};

use super::json::{self, Root, TextureInfo};
use super::resolve::Files;
use super::texture::{ColorSpace, Textures, material_label};
use super::{Check, Warnings, medium, quote};
use crate::scene::{AlphaMode, Material, TextureRef, Volume, absorption_of};

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
        loader.transmission(&from.extensions, &mut material)?;
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

    fn transmission(
        &mut self,
        from: &json::MaterialExtensions,
        material: &mut Material,
    ) -> Check<()> {
        if let Some(transmission) = &from.transmission {
            material.transmission =
                self.fraction(transmission.transmission_factor, 0.0, "transmissionFactor");
            material.transmission_texture = self.texture(
                transmission.transmission_texture.as_ref(),
                ColorSpace::Linear,
                "transmissionTexture",
            )?;
        }
        let mut volume = self.volume(from.volume.as_deref())?;
        if volume.is_some() && material.transmission == 0.0 {
            self.warnings.push(format!(
                "{}: KHR_materials_volume is ignored: no light enters without KHR_materials_transmission",
                self.user
            ));
            volume = None;
        }
        self.medium(from.medium.as_deref(), &mut volume)?;
        material.volume = volume;
        Ok(())
    }

    /// KHR_materials_volume: a solid where it has a thickness, whose value does not matter.
    fn volume(&mut self, from: Option<&json::Volume>) -> Check<Option<Volume>> {
        let Some(from) = from else {
            return Ok(None);
        };
        let thickness = from.thickness_factor.unwrap_or(0.0);
        if thickness < 0.0 {
            return Err(format!(
                "{}: thicknessFactor {thickness} is negative",
                self.user
            ));
        }
        // Absent is infinite, which JSON cannot say.
        let distance = from
            .attenuation_distance
            .map_or(f32::INFINITY, |d| d as f32);
        if distance <= 0.0 {
            return Err(format!(
                "{}: attenuationDistance must be positive",
                self.user
            ));
        }
        let color = from.attenuation_color.unwrap_or([1.0; 3]);
        let color = color.map(|c| self.fraction(Some(c), 1.0, "attenuationColor"));
        let mut volume = Volume::default();
        volume.medium.absorption = absorption_of(color.into(), distance);
        Ok((thickness > 0.0).then_some(volume))
    }

    /// ETENDUE_medium, which adds to what KHR_materials_volume absorbs.
    fn medium(&mut self, from: Option<&json::Medium>, volume: &mut Option<Volume>) -> Check<()> {
        let Some(from) = from else {
            return Ok(());
        };
        let user = format!("{}: ETENDUE_medium", self.user);
        let medium = medium::read(from, &user)?;
        let Some(volume) = volume else {
            self.warnings.push(format!(
                "{user} is ignored: the material encloses nothing, which takes KHR_materials_transmission and a thickness of KHR_materials_volume above 0"
            ));
            return Ok(());
        };
        let attenuation = volume.medium.absorption;
        volume.medium = medium;
        volume.medium.absorption = medium::sum(attenuation, medium.absorption);
        volume.priority = from.priority.unwrap_or(0);
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
