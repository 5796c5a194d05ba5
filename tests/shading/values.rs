//! Values of the scattering functions: against the formulas, under exchange of
//! directions, and summed to albedos.

use std::f64::consts::FRAC_PI_2;

use bytemuck::{Pod, Zeroable};
use etendue::gpu::{BindingKind, Device};
use glam::{DVec3, Vec3};

use crate::cells::Grid;
use crate::fixture::{ANGLES, Case, ROUGHNESS, Rng, coated, direction, metal, seen};
use crate::oracle::{Bsdf, distribution, reflected_pdf, schlick, visibility};
use crate::{BIND_CASES, BIND_INPUT, BIND_OUTPUT, Kernel, finish, groups, open};

const VALUES: &str = "test_shading_values";

/// Of `shaders/tests/shading_values.comp`.
const BSDF: u32 = 0;
const MICROFACET: u32 = 1;
const FRESNEL: u32 = 2;
const MIS: u32 = 3;

/// Constant of `spec.glsl`.
const HAS_SPECULAR: u32 = 3;

/// Unit roundoff of single precision.
const ROUNDING: f64 = 5.960_464_5e-8;

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Query {
    a: [f32; 3],
    index: u32,
    b: [f32; 3],
}

fn kernel(device: &std::sync::Arc<Device>, has_specular: bool) -> Kernel {
    let bindings = [BIND_CASES, BIND_INPUT, BIND_OUTPUT].map(|b| (b, BindingKind::Storage));
    let constants = [(HAS_SPECULAR, u32::from(has_specular))];
    Kernel::new(device, VALUES, &bindings, &constants, 2)
}

fn evaluate(kernel: &Kernel, kind: u32, cases: &[Case], queries: &[Query]) -> Vec<[f32; 4]> {
    let inputs = (kernel.storage(cases), kernel.storage(queries));
    let values = kernel.output::<[f32; 4]>(queries.len());
    kernel.run(
        &[
            (BIND_CASES, &inputs.0),
            (BIND_INPUT, &inputs.1),
            (BIND_OUTPUT, &values),
        ],
        &[kind, queries.len() as u32],
        groups(queries.len()),
    );
    values.read(queries.len()).unwrap()
}

fn wide(v: [f32; 3]) -> DVec3 {
    Vec3::from(v).as_dvec3()
}

/// A dielectric of this F0 and specular strength over a white base.
fn dielectric(roughness: f32, f0: [f32; 3], specular: f32) -> Case {
    Case {
        roughness,
        base_color: [1.0; 3],
        metallic: 0.0,
        f0: f0.map(|f| f * specular),
        f90: specular,
        ..Case::default()
    }
}

/// White surfaces that must not gain energy, with names for the table.
fn white(roughness: f32) -> Vec<(&'static str, Case)> {
    let of = |f0, specular| dielectric(roughness, f0, specular);
    let white_metal = Case {
        base_color: [1.0; 3],
        ..metal(roughness)
    };
    let half = Case {
        metallic: 0.5,
        ..of([0.04; 3], 1.0)
    };
    vec![
        ("metal", white_metal),
        ("F0 .04", of([0.04; 3], 1.0)),
        ("F0 0", of([0.0; 3], 1.0)),
        ("F0 .5", of([0.5; 3], 1.0)),
        ("F0 1", of([1.0; 3], 1.0)),
        ("red F0", of([1.0, 0.04, 0.0], 1.0)),
        ("half .04", of([0.04; 3], 0.5)),
        ("half 1", of([1.0; 3], 0.5)),
        ("none", of([0.04; 3], 0.0)),
        ("½ metal", half),
    ]
}

/// Every kind of surface for values and reciprocity.
fn surfaces() -> Vec<Case> {
    let of = |&r: &f32| {
        let mut cases: Vec<Case> = white(r).into_iter().map(|(_, case)| case).collect();
        cases.extend([
            coated(r),
            metal(r),
            Case {
                metallic: 0.3,
                ..coated(r)
            },
        ]);
        cases
    };
    ROUGHNESS.iter().flat_map(of).collect()
}

/// Pairs above the horizon: half of them anywhere, half of them near reflection.
fn pairs(cases: &[Case], each: usize, rng: &mut Rng) -> Vec<Query> {
    let mut queries = Vec::new();
    for (index, case) in cases.iter().enumerate() {
        while queries.len() < (index + 1) * each {
            let mut wo = rng.unit();
            let mut wi = rng.unit();
            wo.z = wo.z.abs();
            if queries.len() % 2 == 0 {
                wi = Vec3::new(-wo.x, -wo.y, wo.z) + wi * 2.0 * case.roughness.powi(2);
            }
            wi = wi.normalize();
            wi.z = wi.z.abs();
            if wo.z > 0.0 && wi.z > 0.0 {
                queries.push(Query {
                    a: wo.to_array(),
                    index: index as u32,
                    b: wi.to_array(),
                });
            }
        }
    }
    queries
}

/// f cosθ and pdf against the reference, and f against itself with the directions exchanged.
fn check_values(has_specular: bool, cases: &[Case], each: usize) {
    let Some(device) = open() else { return };
    let kernel = kernel(&device, has_specular);
    let queries = pairs(cases, each, &mut Rng(1));
    let swapped: Vec<Query> = queries
        .iter()
        .map(|q| Query {
            a: q.b,
            b: q.a,
            ..*q
        })
        .collect();
    let values = evaluate(&kernel, BSDF, cases, &queries);
    let back = evaluate(&kernel, BSDF, cases, &swapped);
    let (mut worst, mut worst_swap) = (0.0_f64, 0.0_f64);
    for ((q, v), b) in queries.iter().zip(&values).zip(&back) {
        let case = Case {
            wo: q.a,
            ..cases[q.index as usize]
        };
        let (wo, wi) = (wide(q.a), wide(q.b));
        let bsdf = Bsdf::new(&case, has_specular);
        let (f_cos, pdf) = bsdf.eval(wi);
        // Two dozen operations; then the normal of the facet, whose error of two roundings,
        // more where wo + wi cancels, counts against the width of the lobe: D ∝ x⁻⁴.
        // 1 − F of the coat cancels where it lets little through.
        let lobe = 8.0 * ROUNDING / (bsdf.alpha * (wo + wi).length());
        let tolerance = 40.0 * ROUNDING + if has_specular { lobe } else { 0.0 };
        let got = wide([v[0], v[1], v[2]]);
        for k in 0..3 {
            let through = if has_specular {
                4.0 * ROUNDING * wi.z
            } else {
                0.0
            };
            let error = (got[k] - f_cos[k]).abs() - through;
            assert!(
                error <= tolerance * f_cos[k],
                "{case:?} {wi}: {got} instead of {f_cos}"
            );
            worst = worst.max(error / f_cos[k].max(1e-30) / tolerance);
            let exchanged = f64::from(b[k]) / wo.z;
            let f = got[k] / wi.z;
            // Sums may round differently, and 1 − F as above. Directions are unit to a rounding
            // and a dot product takes two more, so wo·m and wi·m differ by six over |wo + wi|:
            // much where both directions graze, five-fold in Schlick's power.
            let off = ((f - exchanged).abs() - 4.0 * ROUNDING).max(0.0) / f.max(1e-30);
            let grazing = if has_specular {
                30.0 * ROUNDING / (wo + wi).length()
            } else {
                0.0
            };
            worst_swap = worst_swap.max(off - grazing);
            assert!(
                off <= 1e-5 + grazing,
                "{case:?} {wi}: {f} there, {exchanged} back"
            );
        }
        let error = (f64::from(v[3]) / pdf - 1.0).abs();
        assert!(
            error <= tolerance,
            "{case:?} {wi}: pdf {} instead of {pdf}",
            v[3]
        );
    }
    println!("values: {worst:.2} of the tolerance; reciprocal to {worst_swap:.1e}");
    drop(kernel);
    finish(device);
}

#[test]
fn lambert_is_right_and_reciprocal() {
    check_values(false, &[coated(1.0)], 100_000);
}

#[test]
fn coats_and_metals_are_right_and_reciprocal() {
    // 78 surfaces: more than 10⁵ pairs of each kind over its six roughnesses.
    check_values(true, &surfaces(), 17_000);
}

#[test]
fn no_surface_gains_energy() {
    /// The requirement.
    const GAIN: f64 = 1e-4;
    let Some(device) = open() else { return };
    let kernel = kernel(&device, true);
    let names: Vec<_> = white(1.0).iter().map(|w| w.0).collect();
    println!(
        "directional albedo, largest channel\nrough  angle  {}",
        names.join("  ")
    );
    let angles = ANGLES.into_iter().chain([45.0, 70.0, 85.0]);
    for (roughness, degrees) in ROUGHNESS
        .iter()
        .flat_map(|&r| angles.clone().map(move |a| (r, a)))
    {
        let cases: Vec<Case> = white(roughness)
            .iter()
            .map(|w| seen(w.1, degrees))
            .collect();
        let wo = direction(degrees);
        let width = (2.0 * f64::from(roughness).powi(2)).min(1.0);
        let grid = Grid::new(wide(wo), width, FRAC_PI_2);
        let nodes = grid.nodes();
        let queries: Vec<Query> = (0..cases.len() as u32)
            .flat_map(|index| nodes.iter().map(move |n| (index, n.0.as_vec3())))
            .map(|(index, wi)| Query {
                a: wo,
                index,
                b: wi.to_array(),
            })
            .collect();
        let values = evaluate(&kernel, BSDF, &cases, &queries);
        let albedo = |values: &[[f32; 4]]| -> DVec3 {
            let terms = values.iter().zip(&nodes);
            terms.map(|(v, n)| wide([v[0], v[1], v[2]]) * n.1).sum()
        };
        let albedos: Vec<DVec3> = values.chunks(nodes.len()).map(albedo).collect();
        let row: Vec<String> = albedos
            .iter()
            .map(|a| format!("{:.4}", a.max_element()))
            .collect();
        println!("{roughness:5}  {degrees:5}  {}", row.join("  "));
        for (name, a) in names.iter().zip(&albedos) {
            assert!(
                a.max_element() <= 1.0 + GAIN,
                "{name}, {roughness}, {degrees}°: {a}"
            );
        }
        // The nodes are good for that: the metal's integral, adaptively.
        let bsdf = Bsdf::new(&cases[0], true);
        let exact = grid.integrate(&|wi| [bsdf.eval(wi).0.x, 0.0, 0.0, 0.0]);
        let exact: f64 = exact.iter().map(|v| v[0]).sum();
        let error = albedos[0].x - exact;
        assert!(
            error.abs() < GAIN,
            "{roughness}, {degrees}°: off by {error}"
        );
    }
    drop(kernel);
    finish(device);
}

#[test]
fn microfacet_functions_match_the_formulas() {
    /// A dozen operations and two divisions of 2.5 ulp, doubled.
    const TOLERANCE: f64 = 60.0 * ROUNDING;
    let Some(device) = open() else { return };
    let kernel = kernel(&device, true);
    let mut rng = Rng(2);
    let alphas = [1e-3, 3e-3, 1e-2, 0.04, 0.16, 0.36, 0.64, 1.0];
    let cases = alphas.map(|alpha| Case {
        roughness: alpha,
        ..Case::default()
    });
    let mut queries = Vec::new();
    for i in 0..160_000 {
        let index = i % cases.len();
        let mut m = rng.unit();
        if i % 16 >= 8 {
            m = (Vec3::Z + 3.0 * alphas[index] * m).normalize();
        }
        m.z = m.z.abs().max(1e-6);
        // Cosines down to 1e-6, evenly in their logarithm for a half of them.
        let mut cosine = || {
            let u = rng.uniform();
            (if i % 3 == 0 {
                10f64.powf(-6.0 * u)
            } else {
                1.0 - u
            }) as f32
        };
        let a = [cosine(), 0.0, cosine()];
        queries.push(Query {
            a,
            index: index as u32,
            b: m.to_array(),
        });
    }
    let values = evaluate(&kernel, MICROFACET, &cases, &queries);
    let mut worst = [0.0_f64; 4];
    for (q, v) in queries.iter().zip(&values) {
        let alpha = f64::from(cases[q.index as usize].roughness);
        let (cos_o, cos_i, m) = (f64::from(q.a[2]), f64::from(q.a[0]), wide(q.b));
        let expected = [
            distribution(m.z, m.x * m.x + m.y * m.y, alpha),
            visibility(cos_o, cos_i, alpha),
            reflected_pdf(DVec3::new(0.0, 0.0, cos_o), m, alpha),
            (alpha * alpha + (1.0 - alpha * alpha) * cos_o * cos_o).sqrt(),
        ];
        for k in 0..4 {
            let error = (f64::from(v[k]) / expected[k] - 1.0).abs();
            worst[k] = worst[k].max(error);
            assert!(
                error < TOLERANCE,
                "α {alpha}, {:?} {m}: {v:?} instead of {expected:?}",
                q.a
            );
        }
    }
    println!("D, visibility, pdf, root off by {worst:?}");
    drop(kernel);
    finish(device);
}

#[test]
fn fresnel_matches_schlick() {
    let Some(device) = open() else { return };
    let kernel = kernel(&device, true);
    let mut rng = Rng(3);
    let mut cosines = vec![0.0, 1.0, 0.5, f32::MIN_POSITIVE, 1.0 - f32::EPSILON / 2.0];
    cosines.extend((0..100_000).map(|_| rng.uniform32()));
    let queries: Vec<Query> = cosines
        .iter()
        .map(|c| {
            let f90 = [1.0, rng.uniform32(), rng.uniform32()];
            let a = [rng.uniform32(), rng.uniform32() * f90[1], 0.0];
            Query {
                a,
                index: c.to_bits(),
                b: f90,
            }
        })
        .collect();
    let values = evaluate(&kernel, FRESNEL, &[Case::default()], &queries);
    for (q, v) in queries.iter().zip(&values) {
        let cosine = f64::from(f32::from_bits(q.index));
        for k in 0..3 {
            let expected = schlick(q.a[k].into(), q.b[k].into(), cosine);
            // Ten operations without cancellation; 1e-37 where products underflow.
            let error = (f64::from(v[k]) - expected).abs();
            assert!(
                error <= 12.0 * ROUNDING * expected + 1e-37,
                "{cosine}: {v:?}, {expected}"
            );
        }
    }
    drop(kernel);
    finish(device);
}

#[test]
fn mis_weights_sum_to_one() {
    let Some(device) = open() else { return };
    let kernel = kernel(&device, true);
    let mut rng = Rng(4);
    let queries: Vec<Query> = (0..1_000_000)
        .map(|i| {
            // Densities over all of single precision, and, for a half, of like size.
            let first = 74.0 * rng.uniform() - 37.0;
            let second = if i % 2 == 0 {
                74.0 * rng.uniform() - 37.0
            } else {
                (first + 4.0 * rng.uniform() - 2.0).clamp(-37.0, 37.0)
            };
            let [a, b] = [first, second].map(|e| 10f64.powf(e) as f32);
            Query {
                a: [a, b, 0.0],
                index: 0,
                b: [0.0; 3],
            }
        })
        .collect();
    let values = evaluate(&kernel, MIS, &[Case::default()], &queries);
    for (q, v) in queries.iter().zip(&values) {
        let [a, b] = [q.a[0], q.a[1]].map(f64::from);
        let expected = 1.0 / (1.0 + (b / a).powi(2));
        let [forth, back] = [v[0], v[1]].map(f64::from);
        // The requirement; two weights of a few roundings each.
        assert!(
            (forth + back - 1.0).abs() <= 1e-6,
            "{a:e} {b:e}: {forth} + {back}"
        );
        assert!(
            (forth - expected).abs() <= 1e-6,
            "{a:e} {b:e}: {forth} {expected}"
        );
    }
    drop(kernel);
    finish(device);
}
