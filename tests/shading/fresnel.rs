//! Fresnel's equations: values, the critical angle, both ways, and means over the hemisphere.

use crate::interface::{FRESNEL, Query, ROUNDING, conditioning, evaluate, kernel, query};
use crate::oracle::fresnel;
use crate::{finish, open};

/// The requirement on Fresnel's factors.
const FRESNEL_ERROR: f64 = 1e-6;

fn indices() -> Vec<f32> {
    let mut all = vec![1.0, 1.0 + f32::EPSILON, 1.0 - f32::EPSILON, 1.0 - 1e-6];
    for n in [1.0 + 1e-6, 1.33, 1.5, 2.4, 10.0, 1e3, 1e6] {
        all.extend([n, 1.0 / n]);
    }
    all
}

/// Cosines of 1e-8 to 1, even in the logarithm, then even.
fn cosines() -> Vec<f32> {
    let steps = |i: i32| 10f64.powf(-8.0 + 8.0 * f64::from(i) / 1000.0) as f32;
    let even = (1..=1000).map(|i| i as f32 / 1000.0);
    (0..=1000).map(steps).chain(even).collect()
}

/// The reference against the textbook's quotients where these do not cancel.
#[test]
fn the_reference_is_the_textbooks() {
    for n in [1.33, 1.5, 2.4, 1.0 / 1.33, 1.0 / 1.5, 1.0 / 2.4_f64] {
        for i in 1..=1000 {
            let c = f64::from(i) / 1000.0;
            let sine = (1.0 - c * c).sqrt() / n;
            if sine > 0.999 {
                continue;
            }
            let ct = (1.0 - sine * sine).sqrt();
            let r_s = (c - n * ct) / (c + n * ct);
            let r_p = (n * c - ct) / (n * c + ct);
            let (r, t) = fresnel(c, n);
            let wanted = 0.5 * (r_s * r_s + r_p * r_p);
            assert!(
                (r - wanted).abs() < 1e-12 && (r + t - 1.0).abs() < 1e-12,
                "{n} {c}: {r} {t}"
            );
        }
    }
}

#[test]
fn fresnel_is_exact_from_one_index_to_millions() {
    let Some(device) = open() else { return };
    let kernel = kernel(&device);
    for eta in indices() {
        let queries: Vec<Query> = cosines()
            .into_iter()
            .map(|c| query([c, 0.0, 0.0], eta))
            .collect();
        let (mut worst_r, mut worst_t, mut worst_sum) = (0.0_f64, 0.0_f64, 0.0_f64);
        let (mut near_critical, mut worst_critical) = (0, 0.0_f64);
        for (q, got) in queries.iter().zip(evaluate(&kernel, FRESNEL, &queries)) {
            let (c, n) = (f64::from(q.a[0]), f64::from(eta));
            let (r, t) = (f64::from(got[0]), f64::from(got[1]));
            let (wanted_r, wanted_t) = fresnel(c, n);
            worst_sum = worst_sum.max((r + t - 1.0).abs());
            assert!((0.0..=1.0).contains(&t), "{q:?}: T {t}");
            assert!((0.0..=1.0).contains(&r), "{q:?}: r {r}");
            let allowed = conditioning(c, n);
            if allowed > 0.0 {
                near_critical += 1;
                let off = (r - wanted_r).abs();
                worst_critical = worst_critical.max(off);
                assert!(
                    off <= FRESNEL_ERROR + allowed,
                    "{q:?}: r {r} instead of {wanted_r}"
                );
                continue;
            }
            let relative = |got: f64, wanted: f64| {
                if got == wanted {
                    0.0
                } else {
                    (got / wanted - 1.0).abs()
                }
            };
            worst_r = worst_r.max(relative(r, wanted_r));
            worst_t = worst_t.max(relative(t, wanted_t));
        }
        println!(
            "n {eta:e}: r off by {worst_r:.1e}, T by {worst_t:.1e}, r + T − 1 {worst_sum:.1e}; {near_critical} near critical, r off by {worst_critical:.1e} of 1"
        );
        assert!(
            worst_r <= FRESNEL_ERROR && worst_t <= FRESNEL_ERROR && worst_sum <= FRESNEL_ERROR,
            "n {eta}"
        );
    }
    let special = [
        query([0.3, 0.0, 0.0], 0.0),
        query([1e-8, 0.0, 0.0], 1.0),
        query([0.7, 0.0, 0.0], 1.0),
        query([80f64.to_radians().cos() as f32, 0.0, 0.0], 1.5),
        query([60f64.to_radians().cos() as f32, 0.0, 0.0], 1.5),
    ];
    let got = evaluate(&kernel, FRESNEL, &special);
    // An infinite index reflects all; where nothing changes, nothing is reflected.
    assert_eq!(got[0][..2], [1.0, 0.0]);
    assert_eq!(got[1][0], 0.0);
    assert_eq!(got[2][0], 0.0);
    println!("n 1: T {} and {}", got[1][1], got[2][1]);
    for got in [got[1], got[2]] {
        assert!((f64::from(got[1]) - 1.0).abs() <= 4.0 * ROUNDING, "{got:?}");
    }
    // Textbook values for glass, seven digits.
    assert!(
        (f64::from(got[3][0]) / 0.387_704_35 - 1.0).abs() < FRESNEL_ERROR,
        "{:?}",
        got[3]
    );
    assert!(
        (f64::from(got[4][0]) / 0.089_186_71 - 1.0).abs() < FRESNEL_ERROR,
        "{:?}",
        got[4]
    );
    drop(kernel);
    finish(device);
}

#[test]
fn total_reflection_begins_without_a_jump() {
    let Some(device) = open() else { return };
    let kernel = kernel(&device);
    // Where Brewster's angle is farther than 1e-3 from the critical one: beyond it r rises.
    for n in [1.000_001_f32, 1.33, 1.5, 2.4] {
        let eta = 1.0 / n;
        let wide_eta = f64::from(eta);
        let critical = ((1.0 - wide_eta) * (1.0 + wide_eta)).sqrt() as f32;
        // Steps of single bits, then wider ones, to 1e-3 on either side.
        let last = (1e-3 / f64::from(f32::EPSILON)) as i32;
        let steps: Vec<i32> = (-64..64)
            .chain((64..last).step_by(16))
            .chain((-last..-64).step_by(16))
            .collect();
        let mut queries: Vec<Query> = steps
            .into_iter()
            .map(|k| {
                query(
                    [
                        f32::from_bits((critical.to_bits() as i32 + k) as u32),
                        0.0,
                        0.0,
                    ],
                    eta,
                )
            })
            .collect();
        queries.sort_by(|p, q| p.a[0].total_cmp(&q.a[0]));
        let got = evaluate(&kernel, FRESNEL, &queries);
        let mut rise = 0.0_f64;
        for pair in got.windows(2) {
            rise = rise.max(f64::from(pair[1][0]) - f64::from(pair[0][0]));
        }
        let largest = got.iter().map(|f| f[0]).fold(0.0, f32::max);
        println!(
            "n 1/{n}: r falls from {largest} to {}, rises by {rise:.1e} at most",
            got.last().unwrap()[0]
        );
        assert!(
            got.iter()
                .all(|f| f[0].is_finite() && f[1] >= 0.0 && f[2] >= 0.0)
        );
        assert!(largest <= 1.0);
        assert_eq!(got[0][..3], [1.0, 0.0, 0.0]);
        // Monotone but for the rounding of r itself: a dozen operations.
        assert!(rise <= 12.0 * ROUNDING, "n {n}: {rise}");
    }
    drop(kernel);
    finish(device);
}

#[test]
fn fresnel_is_the_same_both_ways() {
    let Some(device) = open() else { return };
    let kernel = kernel(&device);
    let mut worst = 0.0_f64;
    for n in [1.33_f32, 1.5, 2.4, 10.0] {
        let eta = f64::from(n);
        let outside: Vec<Query> = (1..=4000)
            .map(|i| query([i as f32 / 4000.0, 0.0, 0.0], n))
            .collect();
        let inside: Vec<Query> = outside
            .iter()
            .map(|q| {
                let c = f64::from(q.a[0]);
                query(
                    [
                        (((eta - 1.0) * (eta + 1.0) + c * c).sqrt() / eta) as f32,
                        0.0,
                        0.0,
                    ],
                    1.0 / n,
                )
            })
            .collect();
        let (there, back) = (
            evaluate(&kernel, FRESNEL, &outside),
            evaluate(&kernel, FRESNEL, &inside),
        );
        for ((q, a), b) in inside.iter().zip(there).zip(back) {
            let (a, b) = (f64::from(a[0]), f64::from(b[0]));
            let off = (a - b).abs();
            let allowed = FRESNEL_ERROR + 2.0 * conditioning(f64::from(q.a[0]), f64::from(q.eta));
            assert!(off <= allowed, "{q:?}: {a} there, {b} back");
            if allowed == FRESNEL_ERROR {
                worst = worst.max(off);
            }
        }
    }
    println!("r both ways: {worst:.1e} apart");
    drop(kernel);
    finish(device);
}

#[test]
fn fresnel_has_the_means_over_the_hemisphere_of_tables() {
    const NODES: usize = 1 << 20;
    let Some(device) = open() else { return };
    let kernel = kernel(&device);
    let mean = |eta: f32| {
        // Midpoints: the square root at the critical angle costs (1/NODES)^1.5.
        let node = |i: usize| query([(i as f32 + 0.5) / NODES as f32, 0.0, 0.0], eta);
        let queries: Vec<Query> = (0..NODES).map(node).collect();
        let got = evaluate(&kernel, FRESNEL, &queries);
        let sum: f64 = queries
            .iter()
            .zip(got)
            .map(|(q, f)| 2.0 * f64::from(q.a[0]) * f64::from(f[0]))
            .sum();
        sum / NODES as f64
    };
    for (n, external, internal) in [
        (1.33_f32, 0.065_930_8, 0.471_949_1),
        (1.5, 0.091_778_0, 0.596_345_8),
        (2.4, 0.210_181_3, 0.862_878_6),
    ] {
        let (out, inside) = (mean(n), mean(1.0 / n));
        let exchanged = (1.0 - out) / f64::from(n).powi(2);
        println!(
            "n {n}: mean {out:.8} outside, {inside:.8} inside; 1 − F {:.8} by exchange {exchanged:.8}",
            1.0 - inside
        );
        assert!((out - external).abs() < 1e-6, "n {n}: {out}");
        assert!((inside - internal).abs() < 1e-6, "n {n}: {inside}");
        assert!((1.0 - inside - exchanged).abs() < 1e-6, "n {n}: {inside}");
    }
    drop(kernel);
    finish(device);
}
