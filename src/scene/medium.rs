//! What fills space: absorption and scattering, and the solids that bound it.

use glam::Vec3;

/// Angular distribution of scattered light.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Phase {
    /// The same in every direction.
    #[default]
    Isotropic,
    /// 3/(16π) (1 + cos²θ).
    Rayleigh,
    /// Henyey–Greenstein with the mean cosine `g`, −1 < g < 1.
    HenyeyGreenstein {
        /// Mean cosine of the angle of deflection.
        g: f32,
    },
}

/// A homogeneous medium; coefficients for each channel in 1/m, finite.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Medium {
    /// Absorption coefficient σ_a, 1/m.
    pub absorption: Vec3,
    /// Scattering coefficient σ_s, 1/m.
    pub scattering: Vec3,
    /// Where scattered light goes.
    pub phase: Phase,
}

impl Medium {
    /// Whether light passes as through nothing.
    pub fn is_clear(&self) -> bool {
        self.absorption == Vec3::ZERO && self.scattering == Vec3::ZERO
    }
}

/// Absorption coefficient, 1/m, that leaves the fraction `color` of the light after `distance` metres.
/// An infinite distance absorbs nothing; where a channel of the colour is 0, or the result too
/// large for fp32, it is `f32::MAX`: nothing is left after any distance, everything after none.
pub fn absorption_of(color: Vec3, distance: f32) -> Vec3 {
    let one = |c: f32| {
        if distance == f32::INFINITY || c == 1.0 {
            0.0
        } else {
            (-f64::from(c).ln() / f64::from(distance)).min(f64::from(f32::MAX)) as f32
        }
    };
    Vec3::new(one(color.x), one(color.y), one(color.z))
}

/// The inside of a closed mesh (KHR_materials_volume with a thickness above 0). Its
/// index of refraction is [`super::Material::ior`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Volume {
    /// What fills it.
    pub medium: Medium,
    /// Where closed meshes overlap the higher priority fills the space; among equal ones the smaller mesh.
    pub priority: i32,
}
