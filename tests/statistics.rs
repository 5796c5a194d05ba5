//! The statistics of the tests against tables and closed forms, and what the night makes of all p-values.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    dead_code,
    reason = "tests may unwrap and print figures; other test programs use the rest"
)]

#[path = "common/random.rs"]
mod random;
#[path = "common/statistics.rs"]
mod statistics;

use random::Random;
use statistics::*;

#[test]
fn tails_are_those_of_tables() {
    // Quantiles of χ² from standard tables, three decimals.
    for (x, degrees, p) in [
        (3.841, 1, 0.05),
        (18.307, 10, 0.05),
        (149.449, 100, 0.001),
        (0.207, 4, 0.995),
    ] {
        let tail = chi_square_tail(x, degrees);
        assert!(
            (tail - p).abs() < 2e-4 * p.max(0.1),
            "{x} {degrees}: {tail}"
        );
    }
    // A large number of degrees: nearly normal, three standard deviations.
    let (n, z) = (20_000.0_f64, 3.0);
    let wilson = n * (1.0 - 2.0 / (9.0 * n) + z * (2.0 / (9.0 * n)).sqrt()).powi(3);
    assert!((chi_square_tail(wilson, 20_000) - 1.3499e-3).abs() < 1e-6);
    assert!((1.0 - (1.0 - sidak(100)).powi(100) - FALSE_ALARM).abs() < 1e-12);
    // Kolmogorov's law: 1.3581 and 1.9495 are exceeded by 5 % and 0.1 %, and half of all exceed 0.8276.
    for (x, p) in [(1.3581, 0.05), (1.9495, 0.001), (0.8276, 0.5)] {
        assert!((kolmogorov_tail(x) / p - 1.0).abs() < 1e-3, "{x}");
    }
    assert_eq!(kolmogorov_tail(0.1), 1.0);
    // One normal variable, and a thousand.
    assert!((largest_of(1) - 3.2905).abs() < 1e-3);
    assert!((largest_of(1000) - 4.89).abs() < 0.01);
}

#[test]
fn counts_that_are_wrong_are_found() {
    // A sampler that is off by 6 % in its cells fails; a hit in an empty cell fails.
    let skewed: Vec<u32> = (0..1000)
        .map(|i| if i % 2 == 0 { 1060 } else { 940 })
        .collect();
    assert!(chi_square(&skewed, &[1e-3; 1000]) < 1e-6);
    assert!(chi_square(&[50, 50, 1], &[0.5, 0.5, 0.0]) == 0.0);
    assert_eq!(chi_square(&[1000; 10], &[0.1; 10]), 1.0);
}

#[test]
fn estimates_are_those_of_closed_forms() {
    // 0 … 9: variance 55/6.
    let ramp = Estimate::of((0..10).map(f64::from));
    assert_eq!((ramp.mean, ramp.degrees), (4.5, 9.0));
    assert!((ramp.error - (55.0f64 / 60.0).sqrt()).abs() < 1e-12);
    // Student's t at 2.262 with nine degrees is 5 %.
    assert!((ramp.p(ramp.mean - 2.262_157 * ramp.error) - 0.05).abs() < 1e-6);
    assert!((Estimate::new(0.0, 1.0).p(1.959_964) - 0.05).abs() < 1e-5);
    // Chance is larger where the error is known less well: tables have 4.8916 for the normal law and 10.2 for nine degrees.
    assert_eq!(Estimate::new(1.0, 2.0).chance(), 2.0 * Z);
    assert!(ramp.chance() > 2.0 * Z * ramp.error);
    // Welch: equal errors add their degrees; one that is known adds none.
    let difference = ramp.minus(ramp);
    assert!((difference.degrees - 18.0).abs() < 1e-9 && difference.mean == 0.0);
    let against = ramp.minus(Estimate::new(4.0, 0.0));
    assert!((against.mean, against.error) == (0.5, ramp.error));
    assert!((against.degrees - 9.0).abs() < 1e-9);
    let four = Estimate::of_pixels([(1.0, 0.3), (2.0, 0.4)].into_iter());
    assert!((four.mean - 1.5).abs() < 1e-12 && (four.error - 0.25).abs() < 1e-12);
    // Equivalence: near enough and known well enough.
    assert!(Estimate::new(1.001, 1e-4).is_within(1.0, 2e-3));
    assert!(!Estimate::new(1.0, 1e-3).is_within(1.0, 2e-3));
    assert!(!Estimate::new(1.003, 0.0).is_within(1.0, 2e-3));
}

#[test]
fn tiles_are_all_pixels_once() {
    let regions = regions(16, 4);
    assert_eq!(regions.len(), 17);
    let mut seen: Vec<usize> = regions[1..].iter().flat_map(|r| r.1.clone()).collect();
    assert_eq!(regions[6].1[..5], [68, 69, 70, 71, 84]);
    seen.sort_unstable();
    assert_eq!(seen, regions[0].1);
}

/// Numbers of a law and of one that is off by 3 %: p-values are uniform, or not.
#[test]
fn p_values_are_uniform_where_nothing_is_wrong() {
    let mut random = Random(3);
    let mut drawn = |scale: f64| {
        let mut family = Family::default();
        for i in 0..2000 {
            // Sums of 12 uniform numbers, 32 of them: Student's t to a good approximation.
            let values: Vec<f64> = (0..32)
                .map(|_| (0..12).map(|_| random.unit()).sum::<f64>() - 6.0)
                .collect();
            let e = Estimate::of(values.iter().copied());
            family.add(
                i.to_string(),
                Estimate {
                    error: e.error * scale,
                    ..e
                }
                .p(0.0),
            );
        }
        family.uniformity()
    };
    let (right, small, large) = (drawn(1.0), drawn(0.85), drawn(1.15));
    println!(
        "uniform: {right:.2}; errors told 15 % too small: {small:.1e}, too large: {large:.1e}"
    );
    assert!(right > FALSE_ALARM && small < FALSE_ALARM && large < FALSE_ALARM);
}

#[test]
fn printed_p_values_are_found() {
    let log = "test a ... p-value warps, cosine 2.5e-1\nother\np-value ggx, a b 0.75\np-value no number\n";
    let family = Family::printed(log);
    assert_eq!(family.len(), 2);
    // Two at a quarter and three quarters: D = 1/4.
    assert!(family.uniformity() > 0.9);
}

/// `scripts/nightly.sh` gives the log of the whole suite: the p-values of all tests together.
#[test]
#[ignore = "needs the log of a night; scripts/nightly.sh does it"]
fn p_values_of_the_night_are_uniform() {
    let path = std::env::var_os("ETENDUE_P_VALUES").expect("ETENDUE_P_VALUES: a log");
    let family = Family::printed(&std::fs::read_to_string(path).unwrap());
    let uniformity = family.uniformity();
    println!(
        "{} p-values, uniform with p = {uniformity:.3}",
        family.len()
    );
    assert!(family.len() >= 1000, "too few to tell");
    assert!(uniformity >= FALSE_ALARM, "p-values are not uniform");
}
