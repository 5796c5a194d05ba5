//! The scattering model in double precision, written from the formulas and not
//! from the shaders: glTF 2.0, appendix B (GGX, Schlick, height-correlated Smith), and
//! the coupling base · (1 − F(n·v)) (1 − F(n·l)) / (1 − F0) of coat and base.

use std::f64::consts::PI;

use glam::DVec3;

use crate::fixture::Case;

/// Below this the renderer has a mirror instead of a lobe.
const MIN_ALPHA: f64 = 1e-3;

/// GGX, glTF appendix B.3.2.
pub fn distribution(cos_m: f64, sin2_m: f64, alpha: f64) -> f64 {
    if cos_m <= 0.0 {
        return 0.0;
    }
    // tan form, since (n·m)² (α² − 1) + 1 cancels for small α.
    let tan2 = sin2_m / (cos_m * cos_m);
    let a2 = alpha * alpha;
    a2 / (PI * cos_m.powi(4) * (a2 + tan2).powi(2))
}

/// Smith's Λ of GGX.
fn lambda(cosine: f64, alpha: f64) -> f64 {
    let tan2 = (1.0 - cosine * cosine).max(0.0) / (cosine * cosine);
    0.5 * ((1.0 + alpha * alpha * tan2).sqrt() - 1.0)
}

/// Height-correlated G₂ over 4 cosθo cosθi.
pub fn visibility(cos_o: f64, cos_i: f64, alpha: f64) -> f64 {
    1.0 / ((1.0 + lambda(cos_o, alpha) + lambda(cos_i, alpha)) * 4.0 * cos_o * cos_i)
}

pub fn schlick(f0: f64, f90: f64, cosine: f64) -> f64 {
    f0 + (f90 - f0) * (1.0 - cosine).clamp(0.0, 1.0).powi(5)
}

/// Density of directions reflected about visible normals: G₁ D max(wo·m, 0) / cosθo / (4 wo·m).
pub fn reflected_pdf(wo: DVec3, m: DVec3, alpha: f64) -> f64 {
    let d = distribution(m.z, m.x * m.x + m.y * m.y, alpha);
    d / ((1.0 + lambda(wo.z, alpha)) * 4.0 * wo.z)
}

/// A material seen from one direction.
pub struct Bsdf {
    wo: DVec3,
    diffuse: DVec3,
    coat: (f64, f64),
    f0: DVec3,
    f90: f64,
    pub alpha: f64,
    /// Probability of the specular lobe: its share of what both reflect at wo.
    pub p_specular: f64,
    has_specular: bool,
}

impl Bsdf {
    pub fn new(case: &Case, has_specular: bool) -> Self {
        let wide = |v: [f32; 3]| glam::Vec3::from(v).as_dvec3();
        let wo = wide(case.wo);
        let (base, metallic) = (wide(case.base_color), f64::from(case.metallic));
        let (f0, f90) = (wide(case.f0), f64::from(case.f90));
        let alpha = f64::from(case.roughness).powi(2);
        let mut bsdf = Self {
            wo,
            diffuse: base * (1.0 - metallic),
            coat: (f0.max_element(), f90),
            f0: f0 * (1.0 - metallic) + base * metallic,
            f90: f90 * (1.0 - metallic) + metallic,
            alpha: if alpha < MIN_ALPHA { 0.0 } else { alpha },
            p_specular: 0.0,
            has_specular,
        };
        if !has_specular {
            bsdf.diffuse = base;
            return bsdf;
        }
        let specular = bsdf.fresnel(wo.z).element_sum();
        let through = (bsdf.diffuse * bsdf.transmission(wo.z)).element_sum();
        if specular + through > 0.0 {
            bsdf.p_specular = specular / (specular + through);
        }
        bsdf
    }

    pub fn fresnel(&self, cosine: f64) -> DVec3 {
        self.f0.map(|f0| schlick(f0, self.f90, cosine))
    }

    fn transmission(&self, cosine: f64) -> f64 {
        1.0 - schlick(self.coat.0, self.coat.1, cosine)
    }

    /// f cosθ without mirrors, and the density of both lobes.
    pub fn eval(&self, wi: DVec3) -> (DVec3, f64) {
        if wi.z <= 0.0 {
            return (DVec3::ZERO, 0.0);
        }
        let coupling = if self.has_specular {
            let inner = (1.0 - self.coat.0).max(1e-6);
            self.transmission(self.wo.z) * self.transmission(wi.z) / inner
        } else {
            1.0
        };
        let mut f_cos = self.diffuse * (coupling * wi.z / PI);
        let mut pdf = (1.0 - self.p_specular) * wi.z / PI;
        if self.has_specular && self.alpha > 0.0 && self.p_specular > 0.0 {
            let m = (self.wo + wi).normalize();
            let d = distribution(m.z, m.x * m.x + m.y * m.y, self.alpha);
            let v = visibility(self.wo.z, wi.z, self.alpha);
            f_cos += self.fresnel(self.wo.dot(m)) * (d * v * wi.z);
            pdf += self.p_specular * reflected_pdf(self.wo, m, self.alpha);
        }
        (f_cos, pdf)
    }
}

/// Fresnel's factors (r, T) of unpolarised light, n the far index over the near one. The sum of
/// squares s − g of the textbook's (c − g)/(c + g) is written as their known difference.
pub fn fresnel(c: f64, n: f64) -> (f64, f64) {
    let g2 = (n - 1.0) * (n + 1.0) + c * c;
    if n == 0.0 || g2 <= 0.0 {
        return (1.0, 0.0);
    }
    let g = g2.sqrt();
    // n⁴c² − g² = (n² − 1) ((n² + 1) c² − 1)
    let m = (n - 1.0) * (n + 1.0);
    let (s, p) = (c + g, n * n * c + g);
    let r_s = m / (s * s);
    let r_p = m * ((n * n + 1.0) * c * c - 1.0) / (p * p);
    let t = 2.0 * c * g * (1.0 / (s * s) + n * n / (p * p));
    (0.5 * (r_s * r_s + r_p * r_p), t)
}

/// A dielectric interface or sheet; [Walter07] in double precision.
#[derive(Clone, Copy, Debug)]
pub struct Interface {
    pub eta: f64,
    pub alpha: f64,
    pub tint: DVec3,
    pub strength: DVec3,
    pub is_thin: bool,
}

impl Interface {
    /// What is reflected and what transmitted.
    pub fn split(&self, c: f64) -> (DVec3, DVec3) {
        let (mut r, mut t) = fresnel(c, self.eta);
        if t == 0.0 {
            return (DVec3::ONE, DVec3::ZERO);
        }
        if self.is_thin {
            (r, t) = (2.0 * r / (1.0 + r), t / (1.0 + r));
        }
        (
            r * self.strength,
            self.tint * (t + r * (1.0 - self.strength)),
        )
    }

    /// f cosθ, without radiance's n², and the density.
    pub fn eval(&self, wo: DVec3, wi: DVec3) -> (DVec3, f64) {
        let none = (DVec3::ZERO, 0.0);
        let is_reflected = wi.z > 0.0;
        let g1 = |c: f64| 1.0 / (1.0 + lambda(c.abs(), self.alpha));
        let of = |m: DVec3| distribution(m.z, m.x * m.x + m.y * m.y, self.alpha);
        let share = |c: f64| {
            let (r, t) = self.split(c);
            let p = r.element_sum() / (r.element_sum() + t.element_sum());
            if is_reflected { (r, p) } else { (t, 1.0 - p) }
        };
        if is_reflected || self.is_thin {
            let mirrored = DVec3::new(wi.x, wi.y, wi.z.abs());
            let m = (wo + mirrored).normalize();
            let (share, p) = share(wo.dot(m));
            let v = visibility(wo.z, mirrored.z, self.alpha);
            return (
                share * of(m) * v * mirrored.z,
                p * reflected_pdf(wo, m, self.alpha),
            );
        }
        let mut m = (wo + self.eta * wi).normalize_or_zero();
        if m.z < 0.0 {
            m = -m;
        }
        let (cos_o, cos_i) = (wo.dot(m), wi.dot(m));
        if cos_o <= 0.0 || cos_i >= 0.0 {
            return none;
        }
        let (share, p) = share(cos_o);
        // Eq. 17 and 21 with the indices 1 and eta, in which radiance's eta² is left out.
        let jacobian = self.eta.powi(2) * cos_i.abs() / (cos_o + self.eta * cos_i).powi(2);
        let visible = g1(wo.z) * cos_o * of(m) / wo.z;
        let f_cos = share * (visible * g1(wi.z) * jacobian);
        (f_cos, p * visible * jacobian)
    }
}
