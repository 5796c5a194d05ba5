//! Solids of glass and media, for the tests of whole pictures.

use etendue::scene::{Material, Medium, Mesh, Phase, Volume};
use glam::Vec3;

use crate::common::room;

/// A solid of index `ior` with a smooth surface, filled with `medium`.
pub fn glass(ior: f32, medium: Medium) -> Material {
    Material {
        name: String::from("glass"),
        metallic: 0.0,
        roughness: 0.0,
        transmission: 1.0,
        ior,
        volume: Some(Volume {
            medium,
            priority: 0,
        }),
        ..Material::default()
    }
}

/// A smooth sheet without thickness.
pub fn sheet(ior: f32) -> Material {
    Material {
        volume: None,
        ..glass(ior, Medium::default())
    }
}

/// The same absorption and scattering in all channels, 1/m.
pub fn grey(absorption: f32, scattering: f32, phase: Phase) -> Medium {
    Medium {
        absorption: Vec3::splat(absorption),
        scattering: Vec3::splat(scattering),
        phase,
    }
}

/// A closed box with its fronts outside.
pub fn block(low: Vec3, high: Vec3) -> Mesh {
    let mut mesh = room(1.0);
    for p in &mut mesh.positions {
        *p = 0.5 * (low + high) + 0.5 * (high - low) * *p;
    }
    for t in &mut mesh.triangles {
        t.swap(1, 2);
    }
    mesh
}

/// Power reflectance of a smooth interface for unpolarised light, textbook form in f64.
pub fn fresnel(cos_i: f64, n: f64) -> f64 {
    let sin2 = (1.0 - cos_i * cos_i) / (n * n);
    if sin2 >= 1.0 {
        return 1.0;
    }
    let cos_t = (1.0 - sin2).sqrt();
    let s = (cos_i - n * cos_t) / (cos_i + n * cos_t);
    let p = (n * cos_i - cos_t) / (n * cos_i + cos_t);
    0.5 * (s * s + p * p)
}
