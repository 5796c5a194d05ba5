//! Opaque surfaces: a Lambert base under a GGX coat, mixed with a GGX metal.
//! Local frame: +Z is the shading normal.
//!
//! [glTF] appendix B for the specular part. Base and coat are coupled by
//! (1 − F(n·v)) (1 − F(n·l)) / (1 − F0), see docs/decisions.md.

use etendue::scene::Material;
use glam::DVec3;

use super::geometry::{Hit, Triangle};
use super::microfacet::{self, g1, g2, mirrored, visible_normal};
use super::rng::{Rng, tangents};

/// Smallest cosine of the viewer to the shading normal and of its mirror image
/// to the geometric one; part of the model.
const LEAST_COSINE: f64 = 1e-3;

/// Schlick's F0 + (F90 − F0)(1 − cosθ)⁵.
fn schlick(f0: f64, f90: f64, cosine: f64) -> f64 {
    f0 + (f90 - f0) * (1.0 - cosine).clamp(0.0, 1.0).powi(5)
}

/// The opaque model in one channel.
#[derive(Clone, Copy, Debug)]
pub struct Opaque {
    /// Albedo of the base, before the coat takes its part.
    pub diffuse: f64,
    /// Largest channel of the coat's F0, and F90: what the coat keeps from the base.
    pub coat: [f64; 2],
    /// F0 and F90 of coat and metal together.
    pub specular: [f64; 2],
    /// Microfacet α; 0 is a mirror.
    pub alpha: f64,
}

/// The share of the light that meets the dielectric interface instead of the opaque model.
pub fn transmitting_share(m: &Material) -> f64 {
    f64::from(1.0 - m.metallic) * f64::from(m.transmission)
}

impl Opaque {
    /// The opaque part of a material, which is seen by 1 − [`transmitting_share`] of the light.
    pub fn new(m: &Material, channel: usize) -> Self {
        // Metals keep their amount within the smaller share.
        let rest = 1.0 - transmitting_share(m);
        let metallic = if rest > 0.0 {
            (f64::from(m.metallic) / rest).min(1.0)
        } else {
            0.0
        };
        let base = f64::from(m.base_color[channel]);
        let ior = f64::from(m.ior);
        let normal = if m.ior == 0.0 {
            1.0
        } else {
            ((ior - 1.0) / (ior + 1.0)).powi(2)
        };
        let f90 = f64::from(m.specular);
        let f0 = |c: usize| (normal * f64::from(m.specular_color[c])).min(1.0) * f90;
        let mix = |dielectric: f64, metal: f64| dielectric + metallic * (metal - dielectric);
        Self {
            diffuse: base * (1.0 - metallic),
            coat: [f0(0).max(f0(1)).max(f0(2)), f90],
            specular: [mix(f0(channel), base), mix(f90, 1.0)],
            alpha: microfacet::alpha(m.roughness),
        }
    }

    /// What the coat lets through to the base or back, one direction.
    fn passes(&self, cosine: f64) -> f64 {
        1.0 - schlick(self.coat[0], self.coat[1], cosine)
    }

    /// Value of the base, 1/sr.
    pub fn base(&self, cos_o: f64, cos_i: f64) -> f64 {
        let once = (1.0 - self.coat[0]).max(1e-6);
        self.diffuse * self.passes(cos_o) * self.passes(cos_i) / (once * std::f64::consts::PI)
    }

    /// Value of coat and metal, 1/sr; α > 0.
    pub fn glossy(&self, wo: DVec3, wi: DVec3) -> f64 {
        let m = (wo + wi).normalize();
        schlick(self.specular[0], self.specular[1], wo.dot(m))
            * microfacet::density(m, self.alpha)
            * g2(wo, wi, self.alpha)
            / (4.0 * wo.z * wi.z)
    }

    /// A direction that light came from and its weight f cosθ / density.
    pub fn scatter(&self, wo: DVec3, rng: &mut Rng) -> Option<(DVec3, f64)> {
        let glossy = schlick(self.specular[0], self.specular[1], wo.z);
        let base = self.diffuse * self.passes(wo.z);
        if glossy + base <= 0.0 {
            return None;
        }
        // The lobes in proportion to what they are worth, roughly: any choice is right.
        let p = glossy / (glossy + base);
        if rng.happens(p) {
            if self.alpha == 0.0 {
                return Some((DVec3::new(-wo.x, -wo.y, wo.z), glossy / p));
            }
            let m = visible_normal(wo, self.alpha, rng);
            let wi = mirrored(wo, m);
            if wi.z <= 0.0 {
                return None;
            }
            let f = schlick(self.specular[0], self.specular[1], wo.dot(m));
            let weight = f * g2(wo, wi, self.alpha) / g1(wo, self.alpha);
            Some((wi, weight / p))
        } else {
            let wi = rng.cosine();
            let weight = self.base(wo.z, wi.z) * std::f64::consts::PI;
            Some((wi, weight / (1.0 - p)))
        }
    }
}

/// Scatters at an opaque surface. `ns` and `ng` are on the side of `wo`.
pub fn opaque(wo: DVec3, ns: DVec3, ng: DVec3, o: &Opaque, rng: &mut Rng) -> Option<(DVec3, f64)> {
    let (x, y) = tangents(ns);
    let local = DVec3::new(x.dot(wo), y.dot(wo), ns.dot(wo));
    let (wi, weight) = o.scatter(local, rng)?;
    let wi = (wi.x * x + wi.y * y + wi.z * ns).normalize();
    // A shading normal can send light through the surface: such light is lost.
    (wi.dot(ng) > 0.0).then_some((wi, weight))
}

/// Geometric and shading normal on the side of `wo`, and whether that is the front.
pub fn normals(triangle: &Triangle, hit: &Hit, wo: DVec3) -> (DVec3, DVec3, bool) {
    let is_front = triangle.front.dot(wo) >= 0.0;
    let side = if is_front { 1.0 } else { -1.0 };
    let ng = side * triangle.front;
    let Some([a, b, c]) = triangle.normals else {
        return (ng, ng, is_front);
    };
    let [u, v] = hit.bary;
    let n = ((1.0 - u - v) * a + u * b + v * c).normalize_or(triangle.front);
    (ng, bent(side * n, ng, wo), is_front)
}

/// The shading normal turned until it is visible and mirrors `wo` to above the surface.
fn bent(n: DVec3, ng: DVec3, wo: DVec3) -> DVec3 {
    let least = LEAST_COSINE.min(0.9 * ng.dot(wo));
    let short = least - n.dot(wo);
    let n = if short > 0.0 {
        (n + short * wo).normalize()
    } else {
        n
    };
    let image = mirrored(wo, n);
    let short = least - image.dot(ng);
    if short <= 0.0 {
        return n;
    }
    // Half way between the viewer and the lifted image.
    (wo + (image + short * ng).normalize()).normalize()
}
