//! Phase functions: moments, values, and directions against both.

use std::f64::consts::PI;

use bytemuck::Zeroable;
use glam::{DVec3, Vec3};

use crate::media::{Case, PHASE, SCATTER, draw, kernel};
use crate::statistics::{Estimate, Family, Z, chi_square};
use crate::{finish, open};

/// Of `layout.glsl`.
const HENYEY_GREENSTEIN: u32 = 0;
const RAYLEIGH: u32 = 1;

/// Error of fp32 in the mean of a power of the cosine.
const ROUNDING: f64 = 1e-6;

fn case(phase: u32, g: f32, d: Vec3) -> Case {
    Case {
        phase,
        g,
        d: d.to_array(),
        ..Case::zeroed()
    }
}

fn axes() -> Vec<Vec3> {
    let oblique = Vec3::new(0.48, -0.6, 0.64);
    vec![
        Vec3::X,
        -Vec3::X,
        Vec3::Y,
        -Vec3::Y,
        Vec3::Z,
        -Vec3::Z,
        oblique,
    ]
}

/// 1 − cosθ, exact for narrow lobes.
fn away(d: DVec3, wi: DVec3) -> f64 {
    0.5 * (d.normalize() - wi.normalize()).length_squared()
}

/// Density, 1/sr.
fn value(case: &Case, away: f64) -> f64 {
    let g = f64::from(case.g);
    if case.phase == RAYLEIGH {
        return 3.0 / (16.0 * PI) * (1.0 + (1.0 - away).powi(2));
    }
    (1.0 - g * g) / (4.0 * PI * ((1.0 - g).powi(2) + 2.0 * g * away).powf(1.5))
}

/// Probability of a cosine below that of `away`.
fn cdf(case: &Case, away: f64) -> f64 {
    let (g, mu) = (f64::from(case.g), 1.0 - away);
    if case.phase == RAYLEIGH {
        return 0.5 + (3.0 * mu + mu.powi(3)) / 8.0;
    }
    if g == 0.0 {
        return 0.5 * (1.0 + mu);
    }
    let root = ((1.0 - g).powi(2) + 2.0 * g * away).sqrt();
    (1.0 - g * g) / (2.0 * g) * (1.0 / root - 1.0 / (1.0 + g))
}

fn wide(v: &[f32]) -> DVec3 {
    Vec3::from_slice(v).as_dvec3()
}

#[test]
fn directions_have_the_moments_of_their_phase() {
    const DRAWS: usize = 1 << 20;
    let Some(device) = open() else { return };
    let kernel = kernel(&device);
    let d = Vec3::new(0.48, -0.6, 0.64);
    let mut cases = vec![case(RAYLEIGH, 0.0, d)];
    for g in [0.0, 0.5, 0.9, 0.99, 0.9999] {
        cases.push(case(HENYEY_GREENSTEIN, g, d));
        cases.push(case(HENYEY_GREENSTEIN, -g, d));
    }
    for (i, case) in cases.iter().enumerate() {
        let drawn = draw(&kernel, SCATTER, &[*case], DRAWS, 20 + i as u32);
        let cosines: Vec<f64> = drawn
            .iter()
            .map(|v| 1.0 - away(wide(&case.d), wide(&v[..3])))
            .collect();
        for v in &drawn {
            let length = wide(&v[..3]).length();
            assert!((length - 1.0).abs() < 2e-7, "{case:?}: {v:?}");
            // No direction is farther than 1 in single precision either.
            assert!(wide(&case.d).dot(wide(&v[..3])).abs() <= 1.0 + 3e-7);
        }
        let g = f64::from(case.g);
        let second = |mu: &f64| 0.5 * (3.0 * mu * mu - 1.0);
        let checks = if case.phase == RAYLEIGH {
            vec![
                ("μ", Estimate::of(cosines.iter().copied()), 0.0),
                ("μ²", Estimate::of(cosines.iter().map(|mu| mu.powi(2))), 0.4),
                (
                    "μ⁴",
                    Estimate::of(cosines.iter().map(|mu| mu.powi(4))),
                    9.0 / 35.0,
                ),
            ]
        } else {
            vec![
                ("μ", Estimate::of(cosines.iter().copied()), g),
                ("P₂", Estimate::of(cosines.iter().map(second)), g * g),
            ]
        };
        for (what, seen, wanted) in checks {
            let (got, error) = (seen.mean, seen.error);
            let off = (got - wanted).abs();
            println!(
                "phase {}, g {g}: E[{what}] = {got:.6}, {wanted:.6} wanted, {:.2} se",
                case.phase,
                off / error
            );
            assert!(
                off <= Z * error + ROUNDING,
                "{case:?} {what}: {got} instead of {wanted} ± {error:e}"
            );
        }
    }
    drop(kernel);
    finish(device);
}

#[test]
fn directions_have_the_density_of_their_phase_about_every_axis() {
    const DRAWS: usize = 1 << 17;
    const POLAR: usize = 32;
    const AZIMUTH: usize = 16;
    let Some(device) = open() else { return };
    let kernel = kernel(&device);
    let mut cases = Vec::new();
    for d in axes() {
        cases.push(case(RAYLEIGH, 0.0, d));
        cases.extend([0.0, 0.5, -0.5, 0.9, -0.9].map(|g| case(HENYEY_GREENSTEIN, g, d)));
    }
    let mut family = Family::default();
    let mut worst = 0.0_f64;
    for (i, case) in cases.iter().enumerate() {
        let drawn = draw(&kernel, SCATTER, &[*case], DRAWS, 50 + i as u32);
        let d = wide(&case.d).normalize();
        let (x, y) = d.any_orthonormal_pair();
        let mut counts = vec![0_u32; POLAR * AZIMUTH];
        let mut wrong = vec![0_u32; POLAR * AZIMUTH];
        let other = Case {
            g: case.g + 0.05,
            phase: HENYEY_GREENSTEIN,
            ..*case
        };
        for v in &drawn {
            let wi = wide(&v[..3]);
            let away = away(d, wi);
            // Roundings of the direction against the width 1 − |g| of the lobe.
            let wanted = value(case, away);
            worst = worst.max((f64::from(v[3]) / wanted - 1.0).abs());
            let turn = wi.dot(y).atan2(wi.dot(x)) / (2.0 * PI) + 0.5;
            let cell = |p: f64, n: usize| ((p * n as f64) as usize).min(n - 1);
            counts[cell(cdf(case, away), POLAR) * AZIMUTH + cell(turn, AZIMUTH)] += 1;
            wrong[cell(cdf(&other, away), POLAR) * AZIMUTH + cell(turn, AZIMUTH)] += 1;
        }
        let even = vec![1.0 / (POLAR * AZIMUTH) as f64; POLAR * AZIMUTH];
        family.add(format!("{case:?}"), chi_square(&counts, &even));
        // The test has teeth: a mean cosine that is off by 0.05.
        assert!(chi_square(&wrong, &even) < 1e-9, "{case:?}");
    }
    println!("phase values off by {worst:.1e}");
    assert!(worst < 1e-5);
    family.assert("phase functions");
    drop(kernel);
    finish(device);
}

#[test]
fn phase_values_are_normalised() {
    const NODES: usize = 1 << 17;
    let Some(device) = open() else { return };
    let kernel = kernel(&device);
    let mut cases = vec![case(RAYLEIGH, 0.0, Vec3::Z)];
    cases.extend(
        [0.0, 0.5, -0.5, 0.9, -0.9, 0.99, -0.99].map(|g| case(HENYEY_GREENSTEIN, g, Vec3::Z)),
    );
    for case in cases {
        let at = |mu: f64| Case {
            beta: [(1.0 - mu * mu).sqrt() as f32, 0.0, mu as f32],
            ..case
        };
        // Even in the square root of 1 − |cosθ|, on either side of the lobe: fine where it is narrow.
        let half = NODES / 2;
        let node = |i: usize| {
            (
                ((i % half) as f64 + 0.5) / half as f64,
                if i < half { 1.0 } else { -1.0 },
            )
        };
        let nodes: Vec<Case> = (0..NODES)
            .map(&node)
            .map(|(s, sign)| at(sign * (1.0 - s * s)))
            .collect();
        let values = draw(&kernel, PHASE, &nodes, 1, 0);
        let sum: f64 = values
            .iter()
            .enumerate()
            .map(|(i, v)| f64::from(v[0]) * 2.0 * node(i).0)
            .sum();
        let total = 2.0 * PI * sum / half as f64;
        println!("phase {}, g {}: ∫ = {total:.8}", case.phase, case.g);
        assert!((total - 1.0).abs() < 1e-5, "{case:?}: {total}");
    }
    let both = [Vec3::Z, Vec3::X, -Vec3::Z].map(|wi| Case {
        beta: wi.to_array(),
        ..case(RAYLEIGH, 0.0, Vec3::Z)
    });
    let got = draw(&kernel, PHASE, &both, 1, 0);
    assert_eq!(got[0][0], 2.0 * got[1][0]);
    assert_eq!(got[2][0], got[0][0]);
    drop(kernel);
    finish(device);
}
