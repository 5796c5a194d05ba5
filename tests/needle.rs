//! Monte Carlo integration at its smallest, as in examples/pi: needles on a quarter
//! disc, thrown with several densities. Shows which formulas are right, and that the
//! detector of heavy tails tells a finite variance from an infinite one.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    dead_code,
    reason = "tests may unwrap, and say why they skip; the example uses what they do not"
)]

#[path = "../examples/pi/needle.rs"]
mod needle;
#[path = "common/statistics.rs"]
mod statistics;

use std::f64::consts::FRAC_PI_4;

use etendue::Error;
use etendue::gpu::{Device, DeviceRequest};

use needle::{Estimate, Estimator, MISTAKE, PRODUCT, SUM, SUM_BARE, Throws, UNIFORM};
use statistics::{Tail, Z};

/// Needles of each test.
const LOG2: u32 = 24;

/// 2²⁴ needles under validation, or the printed reason why there are none.
fn throw(estimator: Estimator) -> Option<(Throws, Estimate)> {
    let request = DeviceRequest {
        validation: true,
        ..DeviceRequest::default()
    };
    let required = std::env::var_os("ETENDUE_REQUIRE_DEVICE").is_some();
    let device = match Device::open(&request) {
        Ok(device) => device,
        Err(error @ Error::Unsupported { .. }) if !required => {
            println!("skipped: {error}");
            return None;
        }
        Err(error) => panic!("{error}"),
    };
    let throws = needle::throw(&device, estimator, LOG2, 1).unwrap();
    assert_eq!(device.validation_messages(), Vec::<String>::new());
    let estimate = throws.estimate(1 << LOG2);
    let name = estimator.name;
    println!("{name}: {estimate:?}, {:?}", Tail::of(&throws.kept));
    Some((throws, estimate))
}

/// The mean is within [`Z`] standard errors of the truth, with σ from the closed form, and
/// therefore within `bound`, which is twice that: an estimator that is off by more than
/// `bound` fails (1 − 10⁻⁶).
fn assert_mean(estimator: Estimator, bound: f64) {
    let Some((_, estimate)) = throw(estimator) else {
        return;
    };
    let deviation = (estimate.mean - estimator.truth).abs();
    let allowed = Z * (estimator.variance / estimate.count as f64).sqrt();
    assert!(deviation <= allowed, "{deviation:.2e} > {allowed:.2e}");
    assert!(deviation + allowed <= bound, "{allowed:.2e}");
}

#[test]
fn uniform_needles_give_pi() {
    // σ of 4g is 1.6422.
    assert!((4.0 * UNIFORM.variance.sqrt() - 1.6422).abs() < 5e-5);
    assert_mean(UNIFORM, 1.0e-3);
}

#[test]
fn needles_that_are_not_uniform_give_another_area() {
    // 2/3 is 0.119 away from π/4, a hundred times the bound.
    assert_mean(SUM_BARE, 1.2e-3);
}

#[test]
fn needles_divided_by_their_density_give_pi() {
    assert!((SUM.variance - 0.6296).abs() < 5e-5);
    assert_mean(SUM, 2.0e-3);
}

/// P(g/f > t) = 1/(3t³), so (g/f)² has the tail y^(−3/2)/3 and no variance. The sample
/// variance of N needles then exceeds the truth by x with a probability of about
/// N P((g/f)² > Nx) = 1/(3 √N x^(3/2)), which is 0.7 % for x = 0.05; it falls short by far less.
#[test]
fn sample_variance_wanders_but_stays_near() {
    let Some((_, estimate)) = throw(SUM) else {
        return;
    };
    let deviation = estimate.variance - SUM.variance;
    assert!((-0.02..0.05).contains(&deviation), "{deviation:.4}");
}

/// Of uniform needles g/f has the mean ∫g/f = √2 ln(1+√2), not π/4: the density to divide by
/// is the one that made the sample. The variance diverges like a logarithm, P(g/f > t) = 1/(2t²);
/// up to the largest of 2²⁴ values, about 2900, it is 7, and the error of the mean 6.5e-4.
#[test]
fn dividing_uniform_needles_by_a_density_does_not_give_pi() {
    let Some((throws, estimate)) = throw(MISTAKE) else {
        return;
    };
    assert!((MISTAKE.truth - 1.2465).abs() < 5e-5);
    assert!((estimate.mean - MISTAKE.truth).abs() < 0.01);
    assert!((estimate.mean - FRAC_PI_4).abs() > 0.45);
    assert!(Tail::of(&throws.kept).is_heavy());
}

/// The variance of f = x + y is finite and its fourth moment is not: σ is imprecise but means
/// something. Its tail index is 3 and its tail holds (3/1000)^(1/3)/1.2465 = 11.6 % of Σx².
#[test]
fn finite_variance_is_not_flagged() {
    for (estimator, share, index) in [
        (UNIFORM, 0.001 / FRAC_PI_4, f64::INFINITY),
        (SUM, 0.116, 3.0),
    ] {
        let Some((throws, _)) = throw(estimator) else {
            return;
        };
        let tail = Tail::of(&throws.kept);
        assert!(!tail.is_heavy(), "{}: {tail:?}", estimator.name);
        assert!((tail.share / share - 1.0).abs() < 0.3, "{tail:?}");
        // Five of its standard errors, index / √1049.
        let is_same = tail.index == index || (tail.index - index).abs() < 0.46;
        assert!(is_same, "{tail:?}");
    }
}

/// Of f = 4xy, P(g/f > t) ∝ (1 + 2 ln 4t)/t²: index 2 in the limit, about 1.8 here. Both signs are there.
#[test]
fn infinite_variance_is_flagged() {
    let Some((throws, estimate)) = throw(PRODUCT) else {
        return;
    };
    let tail = Tail::of(&throws.kept);
    assert!(tail.is_heavy(), "{tail:?}");
    assert!(tail.share > 0.5 && tail.index < 2.0, "{tail:?}");
    // Without bias nevertheless: Var up to the largest of 2²⁴ values is about 13, its error 9e-4.
    assert!((estimate.mean - PRODUCT.truth).abs() < 0.01);
}

/// 2²⁰ quantiles of the law P(x > t) = t^(−index): a sample without chance.
fn pareto(index: f64) -> Vec<f32> {
    let count = 1 << 20;
    (0..count)
        .map(|i| ((f64::from(i) + 0.5) / f64::from(count)).powf(-1.0 / index) as f32)
        .collect()
}

#[test]
fn detector_tells_tails_apart() {
    for (index, is_heavy) in [
        (1.0, true),
        (1.5, true),
        (2.0, true),
        (2.5, false),
        (3.0, false),
        (5.0, false),
    ] {
        let tail = Tail::of(&pareto(index));
        assert!((tail.index / index - 1.0).abs() < 0.01, "{index}: {tail:?}");
        assert_eq!(tail.is_heavy(), is_heavy, "{index}: {tail:?}");
        // The sign of a sample does not matter, nor does its place.
        let negative: Vec<f32> = pareto(index).iter().rev().map(|x| -x).collect();
        assert_eq!(Tail::of(&negative).is_heavy(), is_heavy);
    }
}

#[test]
fn detector_knows_the_corner_cases() {
    let ramp: Vec<f32> = (0..50_000).map(|i| i as f32).collect();
    let exponential: Vec<f32> = ramp.iter().map(|x| -((x + 0.5) / 5e4).ln()).collect();
    assert!(!Tail::of(&ramp).is_heavy());
    assert!(!Tail::of(&exponential).is_heavy());
    assert!(!Tail::of(&[0.0; 5000]).is_heavy());
    assert!(!Tail::of(&[0.25; 5000]).is_heavy());
    // Too few to tell.
    assert!(Tail::of(&ramp[..5000]).is_heavy());
    // One firefly that outweighs everything else; hits that are rarer than the tail.
    for (background, firefly) in [(1.0, 1000.0), (0.0, 1.0)] {
        let mut samples = [background; 50_000];
        samples[1234] = firefly;
        assert!(Tail::of(&samples).is_heavy());
    }
    for broken in [f32::NAN, f32::INFINITY] {
        let mut samples = ramp.clone();
        samples[77] = broken;
        assert!(Tail::of(&samples).is_heavy());
    }
}
