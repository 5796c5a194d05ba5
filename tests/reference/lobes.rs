//! Lobes: what is sampled is what the formulas say, by quadrature over directions.

use std::f64::consts::{PI, TAU};

use etendue::scene::Material;
use glam::{DVec3, Vec4};

use crate::assert_is;
use crate::common::{lambert, metal};
use crate::statistics::Estimate;
use crate::tracer::dielectric::{Interface, fresnel, solid, thin};
use crate::tracer::microfacet::{density, g1, g2};
use crate::tracer::rng::Rng;
use crate::tracer::surface::{Opaque, opaque};

/// Functions of the direction whose integrals against a lobe are compared.
const PROBES: [fn(DVec3) -> f64; 4] = [|_| 1.0, |w| w.x, |w| w.z, |w| w.x * w.x];

/// Random directions per lobe.
const DRAWS: u32 = 400_000;

/// ∫ f(w) dω over the sphere, midpoint rule in cosine and azimuth.
fn integral(f: impl Fn(DVec3) -> f64) -> f64 {
    let (rows, columns) = (2000, 1000);
    let mut sum = 0.0;
    for row in 0..rows {
        let z = -1.0 + 2.0 * (f64::from(row) + 0.5) / f64::from(rows);
        let s = (1.0 - z * z).sqrt();
        for column in 0..columns {
            let phi = TAU * (f64::from(column) + 0.5) / f64::from(columns);
            sum += f(DVec3::new(s * phi.cos(), s * phi.sin(), z));
        }
    }
    sum * 2.0 * TAU / (f64::from(rows) * f64::from(columns))
}

fn view(degrees: f64) -> DVec3 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    DVec3::new(sin, 0.0, cos)
}

/// Sampled moments of a lobe equal the integrals of its value times the cosine.
fn compare(
    what: &str,
    value: impl Fn(DVec3) -> f64,
    mut sample: impl FnMut(&mut Rng) -> Option<(DVec3, f64)>,
) {
    let mut rng = Rng::new(&[11]);
    let mut sums = [[0.0; 2]; PROBES.len()];
    for _ in 0..DRAWS {
        let Some((wi, weight)) = sample(&mut rng) else {
            continue;
        };
        for (sum, probe) in sums.iter_mut().zip(PROBES) {
            let x = weight * probe(wi);
            sum[0] += x;
            sum[1] += x * x;
        }
    }
    for (i, (sum, probe)) in sums.iter().zip(PROBES).enumerate() {
        let n = f64::from(DRAWS);
        let mean = sum[0] / n;
        let error = ((sum[1] / n - mean * mean) / n).sqrt();
        let truth = integral(|w| value(w) * probe(w));
        let seen = Estimate::new(mean, error);
        assert_is(&format!("{what}, probe {i}"), seen, truth, 1e-2);
    }
}

#[test]
fn opaque_lobes_are_sampled_as_they_are_valued() {
    let plastic = Material {
        metallic: 0.0,
        roughness: 0.5,
        base_color: Vec4::new(0.8, 0.8, 0.8, 1.0),
        ..Material::default()
    };
    for (what, m) in [
        ("Lambert", lambert(0.7)),
        ("metal", metal(0.9, 0.6)),
        ("plastic", plastic),
    ] {
        let o = Opaque::new(&m, 0);
        for degrees in [10.0, 70.0] {
            let wo = view(degrees);
            let value = |wi: DVec3| {
                if wi.z <= 0.0 {
                    return 0.0;
                }
                (o.base(wo.z, wi.z) + o.glossy(wo, wi)) * wi.z
            };
            compare(&format!("{what} at {degrees}°"), value, |rng| {
                opaque(wo, DVec3::Z, DVec3::Z, &o, rng)
            });
            // Reciprocity.
            let wi = DVec3::new(0.2, -0.5, 0.7).normalize();
            let f = |a: DVec3, b: DVec3| o.base(a.z, b.z) + o.glossy(a, b);
            assert!((f(wo, wi) - f(wi, wo)).abs() < 1e-12 * f(wo, wi).max(1.0));
        }
    }
}

/// Reflection, [Walter07] Eq. 20, and refraction, Eq. 21 as power, with Smith's masking.
fn rough_interface(wo: DVec3, wi: DVec3, i: &Interface) -> f64 {
    let reflects = wi.z > 0.0;
    let m = if reflects {
        (wo + wi).normalize()
    } else {
        // Eq. 16: −(η wi + wo), turned to the side of wo.
        let h = -(i.eta * wi + wo);
        h.normalize() * h.z.signum()
    };
    let (o, w) = (wo.dot(m), wi.dot(m));
    if o <= 0.0 || m.z <= 0.0 {
        return 0.0;
    }
    let f = fresnel(o.min(1.0), i.eta).0;
    let d = density(m, i.alpha);
    if reflects {
        let r = if f >= 1.0 {
            1.0
        } else {
            (f * i.strength).min(1.0)
        };
        return r * g2(wo, wi, i.alpha) * d / (4.0 * wo.z);
    }
    if w >= 0.0 || f >= 1.0 {
        return 0.0;
    }
    let t = 1.0 - (f * i.strength).min(1.0);
    let jacobian = i.eta * i.eta * -w / (o + i.eta * w).powi(2);
    i.tint * t * g1(wo, i.alpha) * g1(wi, i.alpha) * d * o * jacobian / wo.z
}

#[test]
fn rough_glass_is_sampled_as_walter_says() {
    for eta in [1.5, 1.0 / 1.5] {
        for (degrees, alpha, strength) in [(20.0, 0.3, 1.0), (70.0, 0.3, 1.0), (40.0, 0.6, 0.5)] {
            let i = Interface {
                eta,
                alpha,
                strength,
                tint: 0.8,
            };
            let wo = view(degrees);
            compare(
                &format!("η {eta:.3}, α {alpha}, {degrees}°"),
                |wi| rough_interface(wo, wi, &i),
                |rng| solid(wo, DVec3::Z, DVec3::Z, &i, rng).map(|way| (way.wi, way.weight)),
            );
        }
    }
}

/// The lobe through a rough sheet is the mirror image of the reflected one.
#[test]
fn rough_sheet_scatters_to_both_sides() {
    let i = Interface {
        eta: 1.5,
        alpha: 0.4,
        strength: 1.0,
        tint: 0.6,
    };
    let wo = view(50.0);
    let value = |wi: DVec3| {
        let up = DVec3::new(wi.x, wi.y, wi.z.abs());
        let m = (wo + up).normalize();
        let r = fresnel(wo.dot(m).min(1.0), i.eta).0;
        let share = if wi.z > 0.0 {
            2.0 * r / (1.0 + r)
        } else {
            i.tint * (1.0 - r) / (1.0 + r)
        };
        share * g2(wo, up, i.alpha) * density(m, i.alpha) / (4.0 * wo.z)
    };
    compare("sheet", value, |rng| {
        thin(wo, DVec3::Z, DVec3::Z, &i, rng).map(|way| (way.wi, way.weight))
    });
}

/// ∫ D cosθ dω = 1, and masking as seen from a direction: ∫ G₁ D ⟨wo·m⟩ dω = cosθo. [Heitz14]
#[test]
fn microfacets_are_normalised() {
    let alpha = 0.4;
    let projected = integral(|m| {
        if m.z > 0.0 {
            density(m, alpha) * m.z
        } else {
            0.0
        }
    });
    assert!((projected - 1.0).abs() < 1e-4, "{projected}");
    let wo = view(65.0);
    let visible = integral(|m| {
        if m.z > 0.0 {
            g1(wo, alpha) * density(m, alpha) * wo.dot(m).max(0.0)
        } else {
            0.0
        }
    });
    assert!((visible - wo.z).abs() < 1e-4, "{visible}");
    // π stands in the density once: D(n) = 1/(π α²).
    assert!((density(DVec3::Z, alpha) * PI * alpha * alpha - 1.0).abs() < 1e-12);
}
