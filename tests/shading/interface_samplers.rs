//! Samples of rough interfaces over the whole sphere against densities (χ²), and weights against albedos.

use glam::{DVec3, Vec3};

use crate::cells::{CELLS, Grid};
use crate::fixture::{Case, direction};
use crate::oracle::{Bsdf, Interface};
use crate::samplers::{BSDF, Sampler, name};
use crate::statistics::{Family, chi_square};
use crate::{finish, open};

const ROUGHNESS: [f32; 6] = [0.05, 0.1, 0.2, 0.4, 0.7, 1.0];
const ANGLES: [f64; 5] = [0.0, 30.0, 60.0, 80.0, 88.0];

fn glass(roughness: f32, degrees: f64, eta: f32) -> Case {
    Case {
        wo: direction(degrees),
        roughness,
        base_color: [1.0, 0.8, 0.5],
        f0: [0.04; 3],
        f90: 1.0,
        transmission: 1.0,
        eta,
        strength: 1.0,
        is_solid: 1,
        ..Case::default()
    }
}

/// Every second roughness and angle.
fn few(of: impl Fn(f32, f64) -> Case) -> Vec<Case> {
    let all = |&r: &f32| [30.0, 60.0, 88.0].map(|degrees| of(r, degrees));
    [0.05, 0.2, 0.7].iter().flat_map(all).collect()
}

/// The whole surface in double precision: the interface beside coat, base and metal.
struct Surface {
    wo: DVec3,
    glass: f64,
    opaque: Bsdf,
    interface: Interface,
}

impl Surface {
    fn new(case: &Case) -> Self {
        let glass = f64::from(case.transmission);
        // `metallic` of a case is the whole surface's share; of what is not glass it is more.
        let metallic = if case.transmission < 1.0 {
            (case.metallic / (1.0 - case.transmission)).min(1.0)
        } else {
            0.0
        };
        Self {
            wo: Vec3::from(case.wo).as_dvec3(),
            glass,
            opaque: Bsdf::new(&Case { metallic, ..*case }, true),
            interface: Interface {
                eta: case.eta.into(),
                alpha: f64::from(case.roughness).powi(2),
                tint: Vec3::from(case.base_color).as_dvec3(),
                strength: DVec3::splat(case.strength.into()),
                is_thin: case.is_solid == 0,
            },
        }
    }

    fn eval(&self, wi: DVec3) -> [f64; 4] {
        let (f_cos, pdf) = self.interface.eval(self.wo, wi);
        let (mut f_cos, mut pdf) = (f_cos * self.glass, pdf * self.glass);
        if self.glass < 1.0 {
            let (f, p) = self.opaque.eval(wi);
            f_cos += f * (1.0 - self.glass);
            pdf += p * (1.0 - self.glass);
        }
        [pdf, f_cos.x, f_cos.y, f_cos.z]
    }

    fn grid(&self) -> Grid {
        let width = (2.0 * self.interface.alpha).min(1.0);
        let eta = self.interface.eta;
        let c = self.wo.z.min(1.0);
        let below = if self.interface.is_thin {
            c
        } else {
            ((eta - 1.0) * (eta + 1.0) + c * c).max(0.0).sqrt() / eta
        };
        Grid::of_interface(self.wo, width, below)
    }
}

/// χ² of `bsdf_sample` over the sphere, and E[f cosθ/pdf] against the albedo.
fn check(what: &str, cases: &[Case]) {
    /// The requirement on the mean weight.
    const WEIGHT_ERROR: f64 = 1e-3;
    /// Of the integral over a cell: a tenth of a sample in a million.
    const CELL_ERROR: f64 = 1e-7;
    let Some(device) = open() else { return };
    let sampler = Sampler::new(&device, true);
    let mut family = Family::default();
    let surfaces: Vec<Surface> = cases.iter().map(Surface::new).collect();
    let grids: Vec<Grid> = surfaces.iter().map(Surface::grid).collect();
    let edges: Vec<f32> = grids.iter().flat_map(Grid::edges).collect();
    let drawn = sampler.draw(BSDF, cases, &edges, false);
    let lattice = sampler.draw(BSDF, cases, &edges, true);
    let (mut worst, mut brightest) = (0.0_f64, 0.0_f64);
    for (i, case) in cases.iter().enumerate() {
        let integrals = grids[i].integrate_to(CELL_ERROR, &|wi| surfaces[i].eval(wi));
        let albedo: DVec3 = integrals.iter().map(|v| DVec3::new(v[1], v[2], v[3])).sum();
        let error = (lattice.weights[i] / albedo - 1.0).abs().max_element();
        worst = worst.max(error);
        assert!(
            error < WEIGHT_ERROR,
            "{}: mean weight {} instead of {albedo}",
            name(what, case),
            lattice.weights[i]
        );
        brightest = brightest.max(lattice.weights[i].max_element());
        let mut p: Vec<f64> = integrals.iter().map(|v| v[0]).collect();
        // What the microfacets send to the wrong side has no direction.
        let lost = 1.0 - p.iter().sum::<f64>();
        assert!(lost > -1e-4, "{}: pdf of {}", name(what, case), 1.0 - lost);
        p.push(lost.max(0.0));
        let counts = &drawn.counts[i * CELLS..(i + 1) * CELLS];
        family.add(name(what, case), chi_square(counts, &p));
    }
    println!("{what}: mean weight off by {worst:.1e} at most, albedo at most {brightest:.6}");
    assert!(brightest <= 1.0 + 1e-4, "{what}: {brightest}");
    family.assert(what);
    drop(sampler);
    finish(device);
}

#[test]
fn rough_glass_has_its_density_and_albedo() {
    let all = |&r: &f32| ANGLES.map(|degrees| glass(r, degrees, 1.5));
    let cases: Vec<Case> = ROUGHNESS.iter().flat_map(all).collect();
    check("rough glass", &cases);
}

#[test]
fn rough_glass_from_inside_has_its_density_and_albedo() {
    check(
        "rough glass from inside",
        &few(|r, degrees| glass(r, degrees, 1.0 / 1.5)),
    );
}

#[test]
fn rough_sheets_have_their_density_and_albedo() {
    let sheet = |r, degrees| Case {
        is_solid: 0,
        strength: 0.5,
        ..glass(r, degrees, 1.5)
    };
    check("rough sheet", &few(sheet));
}

#[test]
fn mixed_surfaces_have_their_density_and_albedo() {
    let mixed = |r, degrees| Case {
        transmission: 0.5,
        metallic: 0.3,
        f0: [0.02; 3],
        f90: 0.5,
        strength: 0.5,
        ..glass(r, degrees, 1.5)
    };
    check("mixed surface", &few(mixed));
}
