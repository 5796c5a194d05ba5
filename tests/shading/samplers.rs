//! Samples against densities (χ²), and weights against albedos.

use std::f64::consts::{FRAC_PI_2, PI};

use etendue::gpu::{BindingKind, Device};
use glam::{DVec3, Vec3};

use crate::cells::{CELLS, Grid, PHI, THETA};
use crate::fixture::{ANGLES, Case, ROUGHNESS, coated, direction, metal, seen};
use crate::oracle::{Bsdf, reflected_pdf};
use crate::statistics::{Family, chi_square};
use crate::{BIND_CASES, BIND_COUNTS, BIND_INPUT, BIND_OUTPUT, GROUP, Kernel, finish, open};

const SAMPLERS: &str = "test_shading_samplers";

/// Of `shaders/tests/shading_samplers.comp`.
const COSINE: u32 = 0;
const GGX: u32 = 1;
pub const BSDF: u32 = 2;
const TRIANGLE: u32 = 3;

/// Constant of `spec.glsl`.
const HAS_SPECULAR: u32 = 3;

/// 2²⁰ samples of each case.
const INVOCATIONS: usize = 1 << 14;
const SAMPLES: usize = 1 << 6;

pub struct Sampler {
    kernel: Kernel,
}

pub struct Drawn {
    /// Of each case: [`CELLS`] counts.
    pub counts: Vec<u32>,
    /// Of each case: mean weight.
    pub weights: Vec<DVec3>,
}

impl Sampler {
    pub fn new(device: &std::sync::Arc<Device>, has_specular: bool) -> Self {
        let bindings = [BIND_CASES, BIND_INPUT, BIND_OUTPUT, BIND_COUNTS];
        let bindings = bindings.map(|b| (b, BindingKind::Storage));
        let constants = [(HAS_SPECULAR, u32::from(has_specular))];
        let kernel = Kernel::new(device, SAMPLERS, &bindings, &constants, 4);
        Self { kernel }
    }

    /// Draws from every case; `edges` one after the other, unused by a lattice.
    pub fn draw(&self, kind: u32, cases: &[Case], edges: &[f32], is_lattice: bool) -> Drawn {
        const SEED: u32 = 20_240_607;
        let inputs = (self.kernel.storage(cases), self.kernel.storage(edges));
        let sums = self.kernel.output::<[f32; 4]>(cases.len() * INVOCATIONS);
        let counts = self.kernel.storage(&vec![0u32; cases.len() * CELLS]);
        self.kernel.run(
            &[
                (BIND_CASES, &inputs.0),
                (BIND_INPUT, &inputs.1),
                (BIND_OUTPUT, &sums),
                (BIND_COUNTS, &counts),
            ],
            &[kind, SAMPLES as u32, SEED + kind, is_lattice.into()],
            [(INVOCATIONS / GROUP) as u32, cases.len() as u32, 1],
        );
        let sums: Vec<[f32; 4]> = sums.read(cases.len() * INVOCATIONS).unwrap();
        let mean = |of_case: &[[f32; 4]]| {
            let sum: DVec3 = of_case
                .iter()
                .map(|s| Vec3::new(s[0], s[1], s[2]).as_dvec3())
                .sum();
            sum / (INVOCATIONS * SAMPLES) as f64
        };
        Drawn {
            counts: counts.read(cases.len() * CELLS).unwrap(),
            weights: sums.chunks(INVOCATIONS).map(mean).collect(),
        }
    }
}

fn wide(v: [f32; 3]) -> DVec3 {
    Vec3::from(v).as_dvec3()
}

fn alpha(case: &Case) -> f64 {
    f64::from(case.roughness).powi(2)
}

/// Every roughness from every angle.
fn cases(of: impl Fn(f32) -> Case) -> Vec<Case> {
    let all = |&r| ANGLES.map(|degrees| seen(of(r), degrees));
    ROUGHNESS.iter().flat_map(all).collect()
}

pub fn name(what: &str, case: &Case) -> String {
    let angle = f64::from(case.wo[2]).min(1.0).acos().to_degrees();
    format!("{what}, roughness {}, {angle:.0}°", case.roughness)
}

/// Lambert without the specular code from every angle.
fn lambert() -> Vec<Case> {
    ANGLES
        .iter()
        .map(|&degrees| seen(coated(1.0), degrees))
        .collect()
}

fn grid_of(case: &Case, bottom: f64) -> Grid {
    Grid::new(wide(case.wo), (2.0 * alpha(case)).min(1.0), bottom)
}

#[test]
fn warps_of_the_square_have_their_density() {
    let Some(device) = open() else { return };
    let sampler = Sampler::new(&device, true);
    let mut family = Family::default();

    // Equal steps: cells of the unit square, half of which hold the triangle.
    let steps = |n: usize| (0..=n).map(move |i| i as f32 / n as f32);
    let edges: Vec<f32> = steps(THETA).chain(steps(PHI)).collect();
    let drawn = sampler.draw(TRIANGLE, &[coated(1.0)], &edges, false);
    let mut areas: Vec<f64> = Vec::new();
    for i in 0..THETA {
        for j in 0..PHI {
            areas.push(2.0 * area_below_diagonal(i, j));
        }
    }
    areas.push(0.0);
    family.add(String::from("triangle"), chi_square(&drawn.counts, &areas));

    let case = seen(coated(1.0), 30.0);
    let grid = grid_of(&case, FRAC_PI_2);
    let drawn = sampler.draw(COSINE, &[case], &grid.edges(), false);
    let p = grid.integrate(&|d| [d.z.max(0.0) / PI, 0.0, 0.0, 0.0]);
    let p: Vec<f64> = p.iter().map(|v| v[0]).chain([0.0]).collect();
    family.add(String::from("cosine"), chi_square(&drawn.counts, &p));
    family.assert("warps");
    drop(sampler);
    finish(device);
}

/// Area of the cell (i, j) of the unit square below x + y = 1.
fn area_below_diagonal(i: usize, j: usize) -> f64 {
    let (w, h) = (1.0 / THETA as f64, 1.0 / PHI as f64);
    let (x, y) = (i as f64 * w, j as f64 * h);
    // ∫ clamp(1 − s − y, 0, h) ds over the cell's width, piecewise linear.
    let primitive = |s: f64| {
        let full = (1.0 - y - h).clamp(0.0, s);
        let end = (1.0 - y).clamp(0.0, s);
        h * full + (1.0 - y) * (end - full) - 0.5 * (end * end - full * full)
    };
    primitive(x + w) - primitive(x)
}

#[test]
fn visible_normals_have_their_density() {
    let Some(device) = open() else { return };
    let sampler = Sampler::new(&device, true);
    let mut family = Family::default();
    let cases = cases(metal);
    // A direction below −wo would need a normal below the surface.
    let grids: Vec<Grid> = cases
        .iter()
        .map(|c| grid_of(c, PI - f64::from(c.wo[2]).min(1.0).acos()))
        .collect();
    let edges: Vec<f32> = grids.iter().flat_map(Grid::edges).collect();
    let drawn = sampler.draw(GGX, &cases, &edges, false);
    for ((case, grid), counts) in cases.iter().zip(&grids).zip(drawn.counts.chunks(CELLS)) {
        let wo = wide(case.wo);
        let density = |wi: DVec3| reflected_pdf(wo, (wo + wi).normalize_or_zero(), alpha(case));
        let p = grid.integrate(&|wi| [density(wi), 0.0, 0.0, 0.0]);
        let p: Vec<f64> = p.iter().map(|v| v[0]).chain([0.0]).collect();
        // The density is one of all directions. 2048 cells, each to 1e-8.
        let total: f64 = p.iter().sum();
        assert!((total - 1.0).abs() < 2e-5, "{}: {total}", name("ggx", case));
        family.add(name("ggx", case), chi_square(counts, &p));
        // The test has teeth: a lobe that is 3 % too wide does not pass.
        let wider = grid.integrate(&|wi| {
            let m = (wo + wi).normalize_or_zero();
            [reflected_pdf(wo, m, 1.03 * alpha(case)), 0.0, 0.0, 0.0]
        });
        let wider: Vec<f64> = wider.iter().map(|v| v[0]).chain([0.0]).collect();
        let p = chi_square(counts, &wider);
        assert!(p < 1e-9, "{}: a wrong lobe has p = {p}", name("ggx", case));
    }
    family.assert("visible normals");
    drop(sampler);
    finish(device);
}

/// χ² of `bsdf_sample` with its choice of lobes, and E[f cosθ/pdf] against the albedo.
fn check_bsdf(what: &str, cases: &[Case], has_specular: bool) {
    /// Of the mean weight: the requirement. The lattice itself is off by less than a
    /// fifth of it, the integral by less than 1e-5.
    const WEIGHT_ERROR: f64 = 1e-3;
    let Some(device) = open() else { return };
    let sampler = Sampler::new(&device, has_specular);
    let mut family = Family::default();
    let grids: Vec<Grid> = cases.iter().map(|c| grid_of(c, FRAC_PI_2)).collect();
    let edges: Vec<f32> = grids.iter().flat_map(Grid::edges).collect();
    let drawn = sampler.draw(BSDF, cases, &edges, false);
    let lattice = sampler.draw(BSDF, cases, &edges, true);
    let mut worst = 0.0_f64;
    for (i, (case, grid)) in cases.iter().zip(&grids).enumerate() {
        let bsdf = Bsdf::new(case, has_specular);
        let integrals = grid.integrate(&|wi| {
            let (f_cos, pdf) = bsdf.eval(wi);
            [pdf, f_cos.x, f_cos.y, f_cos.z]
        });
        let albedo: DVec3 = integrals.iter().map(|v| DVec3::new(v[1], v[2], v[3])).sum();
        let error = (lattice.weights[i] / albedo - 1.0).abs().max_element();
        worst = worst.max(error);
        assert!(
            error < WEIGHT_ERROR,
            "{}: mean weight {} instead of {albedo}",
            name(what, case),
            lattice.weights[i]
        );
        let mut p: Vec<f64> = integrals.iter().map(|v| v[0]).collect();
        // What the microfacets reflect below the horizon has no direction.
        let lost = 1.0 - p.iter().sum::<f64>();
        assert!(lost > -2e-5, "{}: pdf of {}", name(what, case), 1.0 - lost);
        p.push(if has_specular { lost.max(0.0) } else { 0.0 });
        let counts = &drawn.counts[i * CELLS..(i + 1) * CELLS];
        family.add(name(what, case), chi_square(counts, &p));
    }
    println!("{what}: mean weight off by {worst:.1e} at most");
    family.assert(what);
    drop(sampler);
    finish(device);
}

#[test]
fn lambert_has_its_density_and_albedo() {
    check_bsdf("Lambert", &lambert(), false);
}

#[test]
fn coated_diffuse_has_its_density_and_albedo() {
    check_bsdf("coated diffuse", &cases(coated), true);
}

#[test]
fn metal_has_its_density_and_albedo() {
    check_bsdf("metal", &cases(metal), true);
}

#[test]
fn blend_of_coat_and_metal_has_its_density_and_albedo() {
    let half = |roughness| Case {
        metallic: 0.5,
        ..coated(roughness)
    };
    let few: Vec<Case> = cases(half).into_iter().step_by(3).collect();
    check_bsdf("half metal", &few, true);
}

#[test]
fn mirrors_reflect_what_fresnel_says() {
    let Some(device) = open() else { return };
    let sampler = Sampler::new(&device, true);
    // Roughness 0, and one just below the smallest lobe.
    let all: Vec<Case> = [coated(0.0), metal(0.0), coated(0.0316)]
        .into_iter()
        .flat_map(|case| {
            ANGLES.map(|degrees| Case {
                wo: direction(degrees),
                ..case
            })
        })
        .collect();
    let lattice = sampler.draw(BSDF, &all, &[], true);
    for (case, weight) in all.iter().zip(lattice.weights) {
        let bsdf = Bsdf::new(case, true);
        assert!(bsdf.alpha == 0.0, "{}", name("mirror", case));
        let grid = Grid::new(wide(case.wo), 1.0, FRAC_PI_2);
        let diffuse = grid.integrate(&|wi| {
            let (f_cos, _) = bsdf.eval(wi);
            [0.0, f_cos.x, f_cos.y, f_cos.z]
        });
        let diffuse: DVec3 = diffuse.iter().map(|v| DVec3::new(v[1], v[2], v[3])).sum();
        let albedo = diffuse + bsdf.fresnel(wide(case.wo).z);
        // The same requirement as for lobes.
        let error = (weight / albedo - 1.0).abs().max_element();
        assert!(
            error < 1e-3,
            "{}: {weight} instead of {albedo}",
            name("mirror", case)
        );
    }
    drop(sampler);
    finish(device);
}
