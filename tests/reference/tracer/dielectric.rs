//! Interfaces between transparent bodies, and thin sheets. Directions point away
//! from the surface; `wo` is on the side of the normals.
//!
//! [Born99] Born, Wolf, Principles of Optics, §1.5 (Fresnel's formulae).
//! [Walter07] Walter et al., Microfacet Models for Refraction.

use glam::DVec3;

use super::microfacet::{g1, g2, mirrored, visible_normal};
use super::rng::{Rng, tangents};

/// Indices that differ by less, relatively, do not bend light into a lobe: the
/// interface counts as smooth. Part of the model.
const MATCHED: f64 = 1e-4;

/// Reflectance of unpolarised light and the cosine of refraction, 0 at total
/// reflection. `eta` is the index beyond over the index on this side. [Born99] §1.5.2
pub fn fresnel(cosine: f64, eta: f64) -> (f64, f64) {
    if eta.is_infinite() {
        return (1.0, 1.0);
    }
    let sin2 = (1.0 - cosine * cosine) / (eta * eta);
    if sin2 >= 1.0 {
        return (1.0, 0.0);
    }
    let beyond = (1.0 - sin2).sqrt();
    let s = (cosine - eta * beyond) / (cosine + eta * beyond);
    let p = (eta * cosine - beyond) / (eta * cosine + beyond);
    (0.5 * (s * s + p * p), beyond)
}

/// Direction of refraction about the normal `m`; `beyond` is the cosine from [`fresnel`].
pub fn refracted(wo: DVec3, m: DVec3, eta: f64, beyond: f64) -> DVec3 {
    -wo / eta + (wo.dot(m) / eta - beyond) * m
}

/// What an interface does, in one channel.
#[derive(Clone, Copy)]
pub struct Interface {
    /// Index beyond over index on this side.
    pub eta: f64,
    /// Microfacet α; 0 is smooth.
    pub alpha: f64,
    /// Factor on Fresnel's reflectance.
    pub strength: f64,
    /// Factor on transmitted light.
    pub tint: f64,
}

/// Where light goes, and with what weight. A crossing is on the other side of the surface.
pub struct Way {
    pub wi: DVec3,
    pub weight: f64,
    pub crosses: bool,
}

impl Interface {
    /// Reflected fraction. Total reflection and an infinite index leave no choice.
    fn reflectance(&self, fresnel: f64) -> f64 {
        if fresnel >= 1.0 {
            1.0
        } else {
            (fresnel * self.strength).min(1.0)
        }
    }

    /// Reflected fraction of a sheet: 2r/(1 + r) is the sum of all reflections between its faces.
    fn sheet_reflectance(&self, cosine: f64) -> f64 {
        let r = fresnel(cosine, self.eta).0;
        self.reflectance(2.0 * r / (1.0 + r))
    }
}

/// A direction in and its place relative to the shading normal.
struct Frame {
    x: DVec3,
    y: DVec3,
    z: DVec3,
}

impl Frame {
    fn new(z: DVec3) -> Self {
        let (x, y) = tangents(z);
        Self { x, y, z }
    }

    fn local(&self, w: DVec3) -> DVec3 {
        DVec3::new(self.x.dot(w), self.y.dot(w), self.z.dot(w))
    }

    fn world(&self, w: DVec3) -> DVec3 {
        w.x * self.x + w.y * self.y + w.z * self.z
    }
}

/// Light at the boundary of a solid. `ns` is the shading normal, `ng` the geometric one.
pub fn solid(wo: DVec3, ns: DVec3, ng: DVec3, i: &Interface, rng: &mut Rng) -> Option<Way> {
    if i.alpha > 0.0 && (i.eta - 1.0).abs() >= MATCHED {
        return rough_solid(wo, ns, ng, i, rng);
    }
    let (mut n, (mut f, mut beyond)) = (ns, fresnel(wo.dot(ns), i.eta));
    if f < 1.0 && refracted(wo, ns, i.eta, beyond).dot(ng) >= 0.0 {
        // The shading normal would send light back: the geometric one decides everything.
        n = ng;
        (f, beyond) = fresnel(wo.dot(ng), i.eta);
    }
    let crosses = !rng.happens(i.reflectance(f));
    let (wi, weight) = if crosses {
        (refracted(wo, n, i.eta, beyond), i.tint)
    } else {
        (mirrored(wo, n), 1.0)
    };
    let way = Way {
        wi,
        weight,
        crosses,
    };
    on_its_side(way, ng)
}

/// [Walter07] §4 and §5, with normals drawn as `wo` sees them: the weight of a
/// reflection is G₂/G₁(wo), of a refraction G₁(wi).
fn rough_solid(wo: DVec3, ns: DVec3, ng: DVec3, i: &Interface, rng: &mut Rng) -> Option<Way> {
    let frame = Frame::new(ns);
    let local = frame.local(wo);
    let m = visible_normal(local, i.alpha, rng);
    let (f, beyond) = fresnel(local.dot(m).min(1.0), i.eta);
    let way = if rng.happens(i.reflectance(f)) {
        let wi = mirrored(local, m);
        if wi.z <= 0.0 {
            return None;
        }
        Way {
            wi: frame.world(wi),
            weight: g2(local, wi, i.alpha) / g1(local, i.alpha),
            crosses: false,
        }
    } else {
        let wi = refracted(local, m, i.eta, beyond);
        if wi.z >= 0.0 {
            return None;
        }
        Way {
            wi: frame.world(wi),
            weight: g1(wi, i.alpha) * i.tint,
            crosses: true,
        }
    };
    on_its_side(way, ng)
}

/// Light at an infinitely thin sheet: the sum of the reflections between its two
/// faces, R = 2r/(1 + r) and T = (1 − r)/(1 + r), passes straight on.
pub fn thin(wo: DVec3, ns: DVec3, ng: DVec3, i: &Interface, rng: &mut Rng) -> Option<Way> {
    if i.alpha == 0.0 {
        let reflects = rng.happens(i.sheet_reflectance(wo.dot(ns)));
        let wi = if reflects { mirrored(wo, ns) } else { -wo };
        let way = Way {
            wi,
            weight: if reflects { 1.0 } else { i.tint },
            crosses: !reflects,
        };
        return on_its_side(way, ng);
    }
    let frame = Frame::new(ns);
    let local = frame.local(wo);
    let m = visible_normal(local, i.alpha, rng);
    let crosses = !rng.happens(i.sheet_reflectance(local.dot(m).min(1.0)));
    let wi = mirrored(local, m);
    if wi.z <= 0.0 {
        return None;
    }
    let weight = g2(local, wi, i.alpha) / g1(local, i.alpha);
    // What goes through is the mirror image of the reflected lobe.
    let way = if crosses {
        Way {
            wi: frame.world(DVec3::new(wi.x, wi.y, -wi.z)),
            weight: weight * i.tint,
            crosses,
        }
    } else {
        Way {
            wi: frame.world(wi),
            weight,
            crosses,
        }
    };
    on_its_side(way, ng)
}

/// A lobe about the shading normal that the geometric one contradicts carries nothing.
fn on_its_side(way: Way, ng: DVec3) -> Option<Way> {
    let height = way.wi.dot(ng);
    (if way.crosses {
        height < 0.0
    } else {
        height > 0.0
    })
    .then_some(Way {
        wi: way.wi.normalize(),
        ..way
    })
}
