//! GGX microfacets. Local frame: +Z is the normal; wo, wi and m point away from the surface.
//!
//! [Walter07] Walter et al., Microfacet Models for Refraction.
//! [Heitz14] Heitz, Understanding the Masking-Shadowing Function.
//! [Heitz18] Heitz, Sampling the GGX Distribution of Visible Normals.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::rng::Rng;

/// Surfaces with a smaller α are perfectly smooth: part of the model.
const SMOOTH: f64 = 1e-3;

/// Microfacet α of a perceptual roughness; 0 is perfectly smooth.
pub fn alpha(roughness: f32) -> f64 {
    let alpha = f64::from(roughness).powi(2);
    if alpha < SMOOTH { 0.0 } else { alpha }
}

/// Density of normals, 1/sr. [Walter07] Eq. 33
pub fn density(m: DVec3, alpha: f64) -> f64 {
    let cos2 = m.z * m.z;
    let tan2 = (1.0 - cos2) / cos2;
    alpha.powi(2) / (PI * cos2 * cos2 * (alpha.powi(2) + tan2).powi(2))
}

/// Smith's Λ of a direction. [Heitz14] Eq. 72
fn lambda(w: DVec3, alpha: f64) -> f64 {
    let cos2 = w.z * w.z;
    let tan2 = (1.0 - cos2).max(0.0) / cos2;
    0.5 * ((1.0 + alpha * alpha * tan2).sqrt() - 1.0)
}

/// Masking of one direction, on either side. [Heitz14] Eq. 43
pub fn g1(w: DVec3, alpha: f64) -> f64 {
    1.0 / (1.0 + lambda(w, alpha))
}

/// Masking and shadowing with correlated heights, both on one side. [Heitz14] Eq. 99
pub fn g2(wo: DVec3, wi: DVec3, alpha: f64) -> f64 {
    1.0 / (1.0 + lambda(wo, alpha) + lambda(wi, alpha))
}

/// A normal with the density in which `wo` sees them: projected disk. [Heitz18] Appendix A
pub fn visible_normal(wo: DVec3, alpha: f64, rng: &mut Rng) -> DVec3 {
    let v = DVec3::new(alpha * wo.x, alpha * wo.y, wo.z).normalize();
    let t1 = DVec3::new(-v.y, v.x, 0.0).normalize_or(DVec3::X);
    let t2 = v.cross(t1);
    let (r, phi) = (rng.uniform().sqrt(), TAU * rng.uniform());
    let (x, y) = (r * phi.cos(), r * phi.sin());
    let s = 0.5 * (1.0 + v.z);
    let y = (1.0 - s) * (1.0 - x * x).max(0.0).sqrt() + s * y;
    let h = x * t1 + y * t2 + (1.0 - x * x - y * y).max(0.0).sqrt() * v;
    DVec3::new(alpha * h.x, alpha * h.y, h.z.max(1e-12)).normalize()
}

/// The mirror image of `wo` about the unit vector `m`.
pub fn mirrored(wo: DVec3, m: DVec3) -> DVec3 {
    2.0 * wo.dot(m) * m - wo
}
