//! Interfaces between dielectrics: sheets, refraction, and exchange of directions.

use bytemuck::{Pod, Zeroable};
use etendue::gpu::{BindingKind, Device};
use glam::{DVec3, Vec3};

use crate::fixture::Rng;
use crate::oracle::Interface;
use crate::{BIND_INPUT, BIND_OUTPUT, Kernel, finish, groups, open};

const INTERFACE: &str = "test_shading_interface";

/// Of `shaders/tests/shading_interface.comp`.
pub const FRESNEL: u32 = 0;
const SPLIT: u32 = 1;
const EVAL: u32 = 2;
const SAMPLE: u32 = 3;

/// Unit roundoff of single precision.
pub const ROUNDING: f64 = 5.960_464_5e-8;

#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Query {
    pub a: [f32; 3],
    pub eta: f32,
    b: [f32; 3],
    alpha: f32,
    tint: [f32; 3],
    is_thin: u32,
    strength: [f32; 3],
    reserved: u32,
}

pub fn query(a: [f32; 3], eta: f32) -> Query {
    Query {
        a,
        eta,
        tint: [1.0; 3],
        strength: [1.0; 3],
        ..Query::zeroed()
    }
}

pub fn kernel(device: &std::sync::Arc<Device>) -> Kernel {
    let bindings = [BIND_INPUT, BIND_OUTPUT].map(|b| (b, BindingKind::Storage));
    Kernel::new(device, INTERFACE, &bindings, &[], 2)
}

pub fn evaluate(kernel: &Kernel, kind: u32, queries: &[Query]) -> Vec<[f32; 8]> {
    let input = kernel.storage(queries);
    let output = kernel.output::<[f32; 8]>(queries.len());
    kernel.run(
        &[(BIND_INPUT, &input), (BIND_OUTPUT, &output)],
        &[kind, queries.len() as u32],
        groups(queries.len()),
    );
    output.read(queries.len()).unwrap()
}

fn wide(v: &[f32]) -> DVec3 {
    Vec3::from_slice(v).as_dvec3()
}

/// Error of r and T that follows from the rounding of g² = (n² − 1) + cos²: much where it cancels,
/// which is about the critical angle. There T = 2 g/c (1 + 1/n²).
pub fn conditioning(c: f64, eta: f64) -> f64 {
    let m = (eta - 1.0) * (eta + 1.0);
    let g2 = m + c * c;
    let largest = m.abs().max(c * c);
    if largest <= 4.0 * g2.abs() {
        return 0.0;
    }
    let of_g2 = 2.0 * ROUNDING * largest;
    let of_g = of_g2.sqrt().min(of_g2 / g2.abs().sqrt());
    (2.0 / c * (1.0 + 1.0 / (eta * eta)) * of_g).min(1.0)
}

#[test]
fn sheets_and_weak_reflection_share_all_power() {
    let Some(device) = open() else { return };
    let kernel = kernel(&device);
    let mut rng = Rng(3);
    let mut queries = Vec::new();
    for i in 0..20_000_u32 {
        let n = [1.000_001, 1.33, 1.5, 2.4, 10.0][rng.bits() as usize % 5];
        let eta = if i % 4 == 3 { 1.0 / n } else { n };
        queries.push(Query {
            is_thin: i % 2,
            strength: [1.0, 0.5, if i % 8 < 4 { 0.0 } else { 1.0 }],
            tint: if i % 3 == 0 {
                [1.0, 0.5, 0.0]
            } else {
                [1.0; 3]
            },
            ..query([(0.01 + 0.99 * rng.uniform()) as f32, 0.0, 0.0], eta)
        });
    }
    let (mut worst, mut worst_sum) = (0.0_f64, 0.0_f64);
    for (q, got) in queries.iter().zip(evaluate(&kernel, SPLIT, &queries)) {
        let interface = Interface {
            eta: q.eta.into(),
            alpha: 0.0,
            tint: wide(&q.tint),
            strength: wide(&q.strength),
            is_thin: q.is_thin != 0,
        };
        let c = f64::from(q.a[0]);
        let (r, t) = interface.split(c);
        let allowed = 2e-6 + 4.0 * conditioning(c, q.eta.into());
        let (got_r, got_t) = (wide(&got[..3]), wide(&got[4..7]));
        let off = (got_r - r)
            .abs()
            .max_element()
            .max((got_t - t).abs().max_element());
        assert!(off <= allowed, "{q:?}: {got:?} instead of {r} {t}");
        worst = worst.max(off / allowed);
        if q.tint == [1.0; 3] {
            worst_sum = worst_sum.max((got_r + got_t - 1.0).abs().max_element());
        }
        let p = r.element_sum() / (r.element_sum() + t.element_sum());
        assert!(
            (f64::from(got[3]) - p).abs() <= allowed,
            "{q:?}: p {} instead of {p}",
            got[3]
        );
    }
    println!("split: {worst:.2} of what is allowed, R + T − 1 {worst_sum:.1e}");
    assert!(worst_sum < 1e-6);
    drop(kernel);
    finish(device);
}

#[test]
fn smooth_interfaces_refract_by_snell_and_lose_nothing() {
    let Some(device) = open() else { return };
    let kernel = kernel(&device);
    let mut rng = Rng(4);
    let mut queries = Vec::new();
    for _ in 0..100_000 {
        let mut wo = rng.unit();
        wo.z = wo.z.abs().max(1e-6);
        let n = [1.0, 1.33, 1.5, 2.4, 1.0 / 1.33, 1.0 / 1.5, 1.0 / 2.4][rng.bits() as usize % 7];
        queries.push(Query {
            b: [rng.uniform32(), rng.uniform32(), rng.uniform32()],
            is_thin: u32::from(rng.bits() % 4 == 0),
            ..query(wo.to_array(), n)
        });
    }
    let split_of: Vec<Query> = queries
        .iter()
        .map(|q| Query {
            a: [q.a[2], 0.0, 0.0],
            ..*q
        })
        .collect();
    let splits = evaluate(&kernel, SPLIT, &split_of);
    let (mut snell, mut length, mut weight, mut unequal) = (0.0_f64, 0.0_f64, 0.0_f64, 0);
    for ((q, s), split) in queries
        .iter()
        .zip(evaluate(&kernel, SAMPLE, &queries))
        .zip(splits)
    {
        let (wo, wi) = (wide(&q.a), wide(&s[..3]));
        assert_eq!(s[3] == 1.0, q.b[0] >= split[3], "{q:?}: {s:?}");
        let p = f64::from(if s[3] == 1.0 {
            1.0 - split[3]
        } else {
            split[3]
        });
        let share = if s[3] == 1.0 { split[4] } else { split[0] };
        // Both branches together: E[weight] = r + t = 1.
        assert!(
            (wide(&s[4..7]) * p - f64::from(share)).abs().max_element() < 1e-6,
            "{q:?}: {s:?}"
        );
        weight = weight.max((wide(&s[4..7]) - 1.0).abs().max_element());
        if s[3] == 0.0 {
            assert_eq!([s[0], s[1], s[2]], [-q.a[0], -q.a[1], q.a[2]], "{q:?}");
        } else if q.is_thin != 0 || q.eta == 1.0 {
            assert_eq!([s[0], s[1]], [-q.a[0], -q.a[1]], "{q:?}");
            if s[2] != -q.a[2] {
                unequal += 1;
                assert!(
                    q.is_thin == 0 && (wo + wi).length() <= 4.0 * ROUNDING,
                    "{q:?}: {s:?}"
                );
            }
        } else {
            let eta = f64::from(q.eta);
            snell = snell.max((wi.truncate() * eta + wo.truncate()).abs().max_element());
            length = length.max((wi.length() - 1.0).abs());
            assert!(wi.z <= 0.0, "{q:?}: {s:?}");
        }
    }
    println!(
        "Snell to {snell:.1e}, length to {length:.1e}, weights to {weight:.1e}; straight at n = 1 rounded: {unequal}"
    );
    assert!(snell < 1e-6 && length < 1e-6);
    // 1 − p is rounded to 6e-8 of 1 where p is near 1, in the branch that is then hardly drawn.
    assert!(weight < 1e-4);
    drop(kernel);
    finish(device);
}

/// Pairs of directions near reflection, near refraction, or anywhere.
fn rough_pairs(count: usize) -> Vec<Query> {
    let mut rng = Rng(5);
    let mut queries = Vec::new();
    while queries.len() < count {
        let n = [1.01, 1.33, 1.5, 2.4, 1.0 / 1.33, 1.0 / 1.5, 1.0 / 2.4][rng.bits() as usize % 7];
        let roughness = [0.05_f32, 0.1, 0.2, 0.4, 0.7, 1.0][rng.bits() as usize % 6];
        let is_thin = u32::from(rng.bits() % 5 == 0);
        let mut wo = rng.unit();
        wo.z = wo.z.abs();
        let m = (Vec3::Z + rng.unit() * roughness.powi(2)).normalize();
        let c = wo.dot(m);
        let g2 = n * n - 1.0 + c * c;
        let mut wi = match rng.bits() % 3 {
            0 => 2.0 * c * m - wo,
            1 if is_thin == 0 && g2 > 0.0 => ((c - g2.sqrt()) * m - wo) / n,
            1 => (2.0 * c * m - wo) * Vec3::new(1.0, 1.0, -1.0),
            _ => rng.unit(),
        };
        wi = wi.normalize();
        if wo.z > 1e-3 && wi.z.abs() > 1e-3 {
            queries.push(Query {
                b: wi.to_array(),
                alpha: roughness.powi(2),
                is_thin,
                ..query(wo.to_array(), n)
            });
        }
    }
    queries
}

/// Relative error of a value. As in values.rs, the rounding of the half vector counts against the
/// width of the lobe; then against the cosines with it, which enter squared and, refracted, in
/// a difference, and against the distance from the critical angle.
fn rounding_of(q: &Query) -> f64 {
    let (wo, wi, eta) = (wide(&q.a), wide(&q.b), f64::from(q.eta));
    let is_refracted = wi.z < 0.0 && q.is_thin == 0;
    let half = if is_refracted {
        wo + eta * wi
    } else {
        wo + DVec3::new(wi.x, wi.y, wi.z.abs())
    };
    let m = half.normalize();
    let c = wo.dot(m).abs();
    let noise = 4.0 * ROUNDING * if is_refracted { eta.max(1.0) } else { 1.0 } / half.length();
    let critical = ((eta - 1.0) * (eta + 1.0) + c * c).abs().max(1e-12);
    let mut factor = 4.0 / f64::from(q.alpha) + 8.0 / c.max(1e-9) + 8.0 / critical;
    if is_refracted {
        factor += 8.0 / half.length() + 4.0 / wi.dot(m).abs().max(1e-9);
    }
    40.0 * ROUNDING + noise * factor
}

#[test]
fn rough_interfaces_have_walters_values_both_ways() {
    let Some(device) = open() else { return };
    let kernel = kernel(&device);
    let queries = rough_pairs(100_000);
    // The same two directions, entered from the other end: through a boundary from its other side.
    let swapped: Vec<Query> = queries
        .iter()
        .map(|q| {
            let is_through = q.b[2] < 0.0;
            let flip = |v: [f32; 3]| if is_through { [v[0], v[1], -v[2]] } else { v };
            let eta = if is_through && q.is_thin == 0 {
                1.0 / q.eta
            } else {
                q.eta
            };
            Query {
                a: flip(q.b),
                b: flip(q.a),
                eta,
                ..*q
            }
        })
        .collect();
    let there = evaluate(&kernel, EVAL, &queries);
    let back = evaluate(&kernel, EVAL, &swapped);
    let (mut lit, mut within, mut within_swap) = (0, 0, 0);
    let (mut worst, mut worst_swap) = (0.0_f64, 0.0_f64);
    for (((q, s), v), b) in queries.iter().zip(&swapped).zip(there).zip(back) {
        let (wo, wi) = (wide(&q.a), wide(&q.b));
        let interface = Interface {
            eta: q.eta.into(),
            alpha: q.alpha.into(),
            tint: DVec3::ONE,
            strength: DVec3::ONE,
            is_thin: q.is_thin != 0,
        };
        let (f_cos, pdf) = interface.eval(wo, wi);
        let is_refracted = wi.z < 0.0 && q.is_thin == 0;
        let eta = f64::from(q.eta);
        let (allowed, allowed_swap) = (rounding_of(q), rounding_of(q) + rounding_of(s));
        let (got, got_pdf) = (f64::from(v[0]), f64::from(v[3]));
        // Grazing facets: whether they are lit is a matter of rounding.
        if allowed_swap > 0.1 {
            continue;
        }
        if f_cos.x == 0.0 {
            assert_eq!(got, 0.0, "{q:?}");
            continue;
        }
        // Below 1e-30 nothing is left to see.
        let tiny = 1e-30;
        lit += 1;
        let off = ((got - f_cos.x)
            .abs()
            .max((got_pdf - pdf).abs() * f_cos.x / pdf)
            - tiny)
            .max(0.0)
            / f_cos.x;
        assert!(
            off <= allowed,
            "{q:?}: {v:?} instead of {f_cos} {pdf}, off {off:.1e}, allowed {allowed:.1e}"
        );
        worst = worst.max(off / allowed);
        within += usize::from(off <= 1e-5);
        // f(wo, wi; eta) = eta² f(wi, wo; 1/eta) through a boundary, as radiance's n² is left out.
        let factor = if is_refracted { eta * eta } else { 1.0 };
        let f = got / wi.z.abs();
        let exchanged = factor * f64::from(b[0]) / wo.z.abs();
        let swap = ((f - exchanged).abs() - tiny).max(0.0) / f;
        assert!(
            swap <= allowed_swap,
            "{q:?} {s:?}: {f} there, {exchanged} back; {swap:.1e}, allowed {allowed_swap:.1e}"
        );
        worst_swap = worst_swap.max(swap / allowed_swap);
        within_swap += usize::from(swap <= 1e-5);
    }
    println!(
        "{lit} lit: {within} within 1e-5 of Walter, {within_swap} both ways; {worst:.2} and {worst_swap:.2} of what rounding allows"
    );
    assert!(lit > 50_000);
    drop(kernel);
    finish(device);
}
