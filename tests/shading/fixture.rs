//! Materials and directions that the tests share.

use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3};

/// `Case` of `shaders/tests/shading_case.glsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct Case {
    pub wo: [f32; 3],
    pub roughness: f32,
    pub base_color: [f32; 3],
    pub metallic: f32,
    pub f0: [f32; 3],
    pub f90: f32,
    pub transmission: f32,
    pub eta: f32,
    pub strength: f32,
    pub is_solid: u32,
}

/// glTF's perceptual roughness; α is its square, 1e-2 … 1.
pub const ROUGHNESS: [f32; 6] = [0.1, 0.2, 0.4, 0.6, 0.8, 1.0];
/// Degrees from the normal.
pub const ANGLES: [f64; 5] = [0.0, 30.0, 60.0, 80.0, 89.0];

/// Seen from an azimuth that is on no axis and no border of cells.
pub fn direction(degrees: f64) -> [f32; 3] {
    const AZIMUTH: f64 = 0.4;
    let (sin, cos) = degrees.to_radians().sin_cos();
    let d = DVec3::new(sin * AZIMUTH.cos(), sin * AZIMUTH.sin(), cos);
    d.as_vec3().to_array()
}

/// glTF's default: a white-ish base under a dielectric of index 1.5.
pub fn coated(roughness: f32) -> Case {
    Case {
        roughness,
        base_color: [0.8, 0.5, 0.2],
        f0: [0.04; 3],
        f90: 1.0,
        ..Case::default()
    }
}

pub fn metal(roughness: f32) -> Case {
    Case {
        roughness,
        base_color: [1.0, 0.77, 0.34],
        metallic: 1.0,
        f0: [0.04; 3],
        f90: 1.0,
        ..Case::default()
    }
}

/// The case seen from `degrees`.
pub fn seen(case: Case, degrees: f64) -> Case {
    Case {
        wo: direction(degrees),
        ..case
    }
}

/// Small fixed generator of the host (splitmix64), independent of the shaders' one.
pub struct Rng(pub u64);

impl Rng {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// In [0, 1).
    pub fn uniform(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// In (0, 1), exact in single precision.
    pub fn uniform32(&mut self) -> f32 {
        ((self.bits() >> 41) as f32 + 0.5) / 8_388_608.0
    }

    /// Uniform over the sphere.
    pub fn unit(&mut self) -> Vec3 {
        let z = 2.0 * self.uniform() - 1.0;
        let (sin, cos) = (2.0 * std::f64::consts::PI * self.uniform()).sin_cos();
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * cos, r * sin, z).as_vec3()
    }
}
