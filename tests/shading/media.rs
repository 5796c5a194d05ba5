//! Media: Beer's law, distances of flight, and distances by the angle at a light.

use std::f32::consts::FRAC_PI_2;

use bytemuck::{Pod, Zeroable};
use etendue::gpu::{BindingKind, Device};
use etendue::scene::absorption_of;
use glam::Vec3;

use crate::fixture::Rng;
use crate::statistics::{Estimate, FALSE_ALARM, Family, Z, kolmogorov};
use crate::{BIND_INPUT, BIND_OUTPUT, GROUP, Kernel, finish, open};

const MEDIA: &str = "test_shading_media";

/// Of `shaders/tests/shading_media.comp`.
const TRANSMITTANCE: u32 = 0;
pub const PHASE: u32 = 1;
const EQUIANGULAR: u32 = 2;
const FLIGHT: u32 = 3;
pub const SCATTER: u32 = 4;
const APPROACH: u32 = 5;

/// Draws that one invocation makes, one after the other.
const EACH: usize = 16;

/// `Case` of the kernel.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Case {
    pub sigma_t: [f32; 3],
    pub phase: u32,
    pub sigma_s: [f32; 3],
    pub g: f32,
    pub beta: [f32; 3],
    pub end: f32,
    pub d: [f32; 3],
    pub reserved: u32,
}

pub fn kernel(device: &std::sync::Arc<Device>) -> Kernel {
    let bindings = [BIND_INPUT, BIND_OUTPUT].map(|b| (b, BindingKind::Storage));
    Kernel::new(device, MEDIA, &bindings, &[], 5)
}

/// `draws` answers for each case, in order.
pub fn draw(kernel: &Kernel, kind: u32, cases: &[Case], draws: usize, seed: u32) -> Vec<[f32; 4]> {
    let count = cases.len() * draws;
    let input = kernel.storage(cases);
    let output = kernel.output::<[f32; 4]>(count);
    kernel.run(
        &[(BIND_INPUT, &input), (BIND_OUTPUT, &output)],
        &[kind, cases.len() as u32, draws as u32, EACH as u32, seed],
        [count.div_ceil(GROUP * EACH) as u32, 1, 1],
    );
    output.read(count).unwrap()
}

fn grey(sigma: f32, end: f32) -> Case {
    Case {
        sigma_t: [sigma; 3],
        sigma_s: [sigma; 3],
        beta: [1.0; 3],
        end,
        ..Case::zeroed()
    }
}

#[test]
fn transmittance_is_beers_over_the_range_of_numbers() {
    let Some(device) = open() else { return };
    let kernel = kernel(&device);
    let mut cases: Vec<Case> = (0..=440)
        .map(|i| grey(1.0, 10f64.powf(-6.0 + f64::from(i) * 0.1) as f32))
        .collect();
    cases.extend((1..=880).map(|i| grey(0.1, i as f32)));
    for color in [0.0, 0.5, 1.0] {
        for distance in [1e-38, 1.0, f32::INFINITY] {
            for x in [0.0, f32::MIN_POSITIVE, 1e-30, 1.0, 1e38, f32::MAX] {
                let sigma_t = absorption_of(Vec3::splat(color), distance).to_array();
                cases.push(Case {
                    sigma_t,
                    ..grey(0.0, x)
                });
            }
        }
    }
    // Subnormal fractions may be flushed.
    let (mut worst, mut checked) = (0.0_f64, 0);
    for (case, got) in cases.iter().zip(draw(&kernel, TRANSMITTANCE, &cases, 1, 0)) {
        let depth = f64::from(case.sigma_t[0]) * f64::from(case.end);
        let wanted = (-depth).exp();
        let got = f64::from(got[0]);
        assert!((0.0..=1.0).contains(&got), "{case:?}: {got}");
        if case.end == 0.0 || case.sigma_t[0] == 0.0 {
            assert_eq!(got, 1.0, "{case:?}");
        }
        if wanted < f64::from(f32::MIN_POSITIVE) {
            assert!(got <= f64::from(f32::MIN_POSITIVE), "{case:?}: {got}");
            continue;
        }
        // The optical depth is rounded, and once more for exp2.
        let off = (got / wanted - 1.0).abs();
        assert!(off <= 1e-5, "{case:?}: {got} instead of {wanted}, {off:e}");
        worst = worst.max(off);
        checked += 1;
    }
    println!("Beer's law: {checked} depths, off by {worst:.1e} at most");
    drop(kernel);
    finish(device);
}

#[test]
fn free_flights_are_exponential() {
    // In two parts, as buffers may be limited to 128 MiB.
    const FLIGHTS: usize = 5_000_000;
    let Some(device) = open() else { return };
    let kernel = kernel(&device);
    let sigma = 0.7_f32;
    let case = grey(sigma, 1e30);
    let mut distances = Vec::new();
    for seed in [11, 12] {
        let flights = draw(&kernel, FLIGHT, &[case], FLIGHTS, seed);
        assert!(flights.iter().all(|f| f[0] > 0.0 && f[1..] == [1.0; 3]));
        distances.extend(flights.iter().map(|f| f[0]));
    }
    let tested = |rate: f64| kolmogorov(distances.clone(), |x| -(-rate * x).exp_m1());
    let (d, p) = tested(f64::from(sigma));
    let count = distances.len();
    println!("free flights: √n D = {d:.3}, p = {p:.3}, {count} flights");
    println!("p-value free flights {p:.6e}");
    assert!(p >= FALSE_ALARM);
    // The test has teeth: an error of 0.3 % in the coefficient.
    assert!(tested(1.003 * f64::from(sigma)).1 < FALSE_ALARM);

    const SHARES: usize = 1 << 20;
    let depths = [1e-4_f32, 1e-3, 0.01, 0.1, 1.0, 3.0, 10.0, 20.0];
    let cases: Vec<Case> = depths.iter().map(|&d| grey(d / 2.0, 2.0)).collect();
    let flights = draw(&kernel, FLIGHT, &cases, SHARES, 13);
    for (depth, flights) in depths.iter().zip(flights.chunks(SHARES)) {
        let p = -(-f64::from(*depth)).exp_m1();
        let n = SHARES as f64;
        let share = flights.iter().filter(|f| f[0] > 0.0).count() as f64 / n;
        let error = (p * (1.0 - p) / n).sqrt();
        println!(
            "depth {depth}: {share:.6} scatter, {p:.6} by Beer's law, {:.2} se",
            (share - p).abs() / error
        );
        assert!(
            (share - p).abs() <= Z * error + 1.0 / n,
            "{depth}: {share} instead of {p}"
        );
    }
    drop(kernel);
    finish(device);
}

#[test]
fn chromatic_flights_have_the_means_of_each_channel() {
    const FLIGHTS: usize = 1 << 18;
    let Some(device) = open() else { return };
    let kernel = kernel(&device);
    let mut cases = Vec::new();
    for end in [0.03_f32, 0.2, 1.0, 4.0] {
        for beta in [[1.0; 3], [0.2, 1.0, 0.5], [0.0, 1.0, 0.5]] {
            for (sigma_t, sigma_s) in [
                ([1.0, 10.0, 3.0], [0.5, 10.0, 1.0]),
                ([1.0, 0.0, 3.0], [1.0, 0.0, 2.0]),
                ([0.0; 3], [0.0; 3]),
                ([1.0, f32::MAX, 3.0], [1.0, 0.0, 2.0]),
            ] {
                cases.push(Case {
                    sigma_t,
                    sigma_s,
                    beta,
                    end,
                    ..Case::zeroed()
                });
            }
        }
    }
    let (mut largest, mut worst) = (0.0_f64, 0.0_f64);
    for case in &cases {
        let flights = draw(&kernel, FLIGHT, &[*case], FLIGHTS, 14);
        let beta = Vec3::from(case.beta).as_dvec3();
        for flight in &flights {
            let weight = Vec3::from_slice(&flight[1..]).as_dvec3();
            assert!(
                weight.is_finite() && weight.min_element() >= 0.0,
                "{case:?}: {flight:?}"
            );
            // Of the throughput: at most its sum, and so at most three where all are equal.
            let share = (beta * weight).element_sum() / beta.element_sum();
            assert!(share <= 1.0 + 1e-6, "{case:?}: {flight:?}");
            if case.beta == [1.0; 3] {
                largest = largest.max(weight.max_element());
            }
        }
        for k in 0..3 {
            if case.beta[k] == 0.0 {
                continue;
            }
            let flights = &flights;
            let of = |scattered: bool| {
                let weights = flights.iter().map(move |f| {
                    if (f[0] >= 0.0) == scattered {
                        f64::from(f[1 + k])
                    } else {
                        0.0
                    }
                });
                Estimate::of(weights)
            };
            let (t, s) = (f64::from(case.sigma_t[k]), f64::from(case.sigma_s[k]));
            let left = (-t * f64::from(case.end)).exp();
            let share = if t > 0.0 { s / t * (1.0 - left) } else { 0.0 };
            for (
                Estimate {
                    mean: got, error, ..
                },
                wanted,
            ) in [(of(false), left), (of(true), share)]
            {
                let off = (got - wanted).abs();
                // 1e-6: weights and ends are rounded; unlikely flights may not occur: one of them.
                let allowed = Z * error + 1e-6 * wanted + 4.0 * 3.0 / FLIGHTS as f64;
                assert!(
                    off <= allowed,
                    "{case:?} channel {k}: {got} instead of {wanted}, se {error:.1e}"
                );
                if error > 0.0 {
                    worst = worst.max(off / error);
                }
            }
        }
    }
    println!("chromatic flights: largest weight {largest}, means off by {worst:.2} se at most");
    assert!(largest <= 3.0 + 1e-6);
    drop(kernel);
    finish(device);
}

#[test]
fn approaches_to_a_light_have_their_density() {
    const DRAWS: usize = 1 << 18;
    const NODES: usize = 1 << 16;
    let Some(device) = open() else { return };
    let kernel = kernel(&device);
    let mut rng = Rng(6);
    let mut cases = Vec::new();
    for along in [-2.0_f32, 0.5, 1.7, 9.0] {
        for apart in [0.01_f32, 0.3, 5.0] {
            let d = rng.unit();
            let side = d.any_orthonormal_vector();
            cases.push(Case {
                beta: (d * along + side * apart).to_array(),
                d: d.to_array(),
                end: 3.0,
                ..Case::zeroed()
            });
        }
    }
    let all = draw(&kernel, APPROACH, &cases, DRAWS, 15);
    let (mut largest, mut worst, mut worst_sum) = (0.0_f64, 0.0_f64, 0.0_f64);
    let mut family = Family::default();
    for (case, draws) in cases.iter().zip(all.chunks(DRAWS)) {
        let (d, to) = (
            Vec3::from(case.d).as_dvec3(),
            Vec3::from(case.beta).as_dvec3(),
        );
        let end = f64::from(case.end);
        let closest = to.dot(d.normalize());
        let apart = to.cross(d.normalize()).length();
        let angle = |t: f64| (t - closest).atan2(apart);
        let whole = angle(end) - angle(0.0);
        let distances: Vec<f32> = draws.iter().map(|v| v[0]).collect();
        assert!(distances.iter().all(|t| (0.0..=case.end).contains(t)));
        let (ks, p) = kolmogorov(distances, |t| (angle(t) - angle(0.0)) / whole);
        largest = largest.max(ks);
        family.add(format!("{case:?}"), p);
        for v in draws {
            let wanted = apart / (whole * (apart * apart + (f64::from(v[0]) - closest).powi(2)));
            worst = worst.max((f64::from(v[1]) / wanted - 1.0).abs());
        }
        let nodes: Vec<Case> = (0..NODES)
            .map(|i| Case {
                sigma_t: [(i as f32 + 0.5) * case.end / NODES as f32; 3],
                ..*case
            })
            .collect();
        let sum: f64 = draw(&kernel, EQUIANGULAR, &nodes, 1, 0)
            .iter()
            .map(|v| f64::from(v[1]))
            .sum();
        let total = sum * end / NODES as f64;
        worst_sum = worst_sum.max((total - 1.0).abs());
    }
    println!("approaches: √n D = {largest:.3}; pdf off by {worst:.1e}, ∫pdf − 1 {worst_sum:.1e}");
    family.assert("approaches");
    // The distance from the light cancels: 1e-7 of 2 over 0.01.
    assert!(worst < 1e-4 && worst_sum < 1e-4);
    drop(kernel);
    finish(device);
}

/// Spots of all widths: distances are drawn in the cone alone, and everywhere in it.
#[test]
fn approaches_to_a_spot_cover_its_cone() {
    const DRAWS: usize = 1 << 16;
    const STEPS: usize = 1 << 18;
    let Some(device) = open() else { return };
    let kernel = kernel(&device);
    let mut rng = Rng(7);
    let mut cases = Vec::new();
    for half_angle in [0.003_f32, 0.1, 0.7, FRAC_PI_2] {
        for apart in [0.01_f32, 0.3, 5.0] {
            for i in 0..6 {
                let d = rng.unit();
                let light = d * (3.0 * rng.uniform32()) + d.any_orthonormal_vector() * apart;
                // Along the segment, at it, and anywhere.
                let target = d * (3.0 * rng.uniform32());
                let axis = match i {
                    0 => d,
                    1..=3 => (target - light).normalize(),
                    _ => rng.unit(),
                };
                cases.push(Case {
                    beta: light.to_array(),
                    d: d.to_array(),
                    end: 3.0,
                    sigma_s: axis.to_array(),
                    g: half_angle.cos().max(0.0),
                    ..Case::zeroed()
                });
            }
        }
    }
    let all = draw(&kernel, APPROACH, &cases, DRAWS, 16);
    let (mut worst, mut lit, mut outside) = (0.0_f64, 0, 0.0_f64);
    for (case, draws) in cases.iter().zip(all.chunks(DRAWS)) {
        let [d, light, axis] = [case.d, case.beta, case.sigma_s].map(|v| Vec3::from(v).as_dvec3());
        // Radians beyond the cone.
        let beyond = |t: f64| {
            let to = t * d - light;
            axis.cross(to).length().atan2(axis.dot(to)) - f64::from(case.g).acos()
        };
        let step = f64::from(case.end) / STEPS as f64;
        let wanted = (0..STEPS)
            .filter(|&i| beyond((i as f64 + 0.5) * step) <= 0.0)
            .count() as f64
            * step;
        // Every distance in the cone counts the inverse of its density, which makes its length.
        let got = Estimate::of(draws.iter().map(|v| {
            let is_in = v[1] > 0.0 && beyond(f64::from(v[0])) <= 0.0;
            if is_in { 1.0 / f64::from(v[1]) } else { 0.0 }
        }));
        let off = (got.mean - wanted).abs();
        // 1e-4: rounding of the cone's cosine where it is narrow, and of the distance from the light.
        assert!(
            off <= Z * got.error + 2.0 * step + 1e-4 * wanted,
            "{case:?}: {} m instead of {wanted}, se {:.1e}",
            got.mean,
            got.error
        );
        if wanted > 0.0 {
            lit += 1;
            worst = worst.max(off / (got.error + step));
            let farthest = draws
                .iter()
                .map(|v| beyond(f64::from(v[0])))
                .fold(0.0, f64::max);
            outside = outside.max(farthest);
        }
    }
    println!(
        "{lit} segments in cones: lengths off by {worst:.2} se at most, drawn up to {outside:.1e} beyond"
    );
    // Arc tangents of a device may be as far off as the margin for them.
    assert!(lit >= 30 && outside <= 5e-3);
    drop(kernel);
    finish(device);
}
