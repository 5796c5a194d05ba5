//! Random numbers as pictures see them: independent pixels and shards, long paths, sample numbers beyond 32 bits.

use etendue::film::Film;
use etendue::render::Tuning;
use etendue::scene::{Phase, Scene};
use etendue::settings::{Settings, Strategy};
use glam::{DVec3, Vec3};

use crate::common::*;
use crate::solids::{block, glass, grey};
use crate::statistics::Family;
use crate::support::Estimate;
use crate::tier::count;

/// A plane under half a sky: every pixel has the same mean, and a variance of its own.
fn noisy_plane() -> Scene {
    let mut scene = empty();
    add(&mut scene, square(Vec3::ZERO, Vec3::Z, 50.0), lambert(0.7));
    let lamp = square(Vec3::new(0.0, 0.0, 3.0), Vec3::NEG_Z, 4.0);
    add(&mut scene, lamp, emitter(0.0, 1.0));
    scene.cameras = vec![parallel(DVec3::Z, DVec3::ZERO, 1e-3)];
    scene
}

fn picture(scene: &Scene, side: u32, samples: std::ops::Range<u64>, seed: u64) -> Option<Film> {
    let settings = Settings {
        samples,
        seed,
        strategy: Strategy::BsdfOnly,
        ..settings(side, 1)
    };
    Some(render(scene, &settings, Tuning::default())?.film)
}

/// A normal deviate is not beyond chance.
fn is_likely(what: &str, z: f64) {
    println!("{what}: {z:.2} standard deviations");
    let mut family = Family::default();
    family.add(format!("{z:.2} deviations"), Estimate::new(z, 1.0).p(0.0));
    family.assert(what);
}

/// Variance of the means of tiles of 2, 4, 8 and 16 pixels a side: σ²/n if pixels are independent.
#[test]
fn tiles_have_the_variance_of_independent_pixels() {
    const SIDE: usize = 128;
    let Some(film) = picture(&noisy_plane(), SIDE as u32, 0..16, 5) else {
        return;
    };
    let values: Vec<f64> = film.mean().iter().map(|m| f64::from(m[0])).collect();
    let variance = |v: &[f64]| {
        let mean = v.iter().sum::<f64>() / v.len() as f64;
        v.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (v.len() - 1) as f64
    };
    let single = variance(&values);
    for tile in [2, 4, 8, 16] {
        let across = SIDE / tile;
        let mut means = vec![0.0; across * across];
        for (i, v) in values.iter().enumerate() {
            let (x, y) = (i % SIDE / tile, i / SIDE / tile);
            means[y * across + x] += v / (tile * tile) as f64;
        }
        let ratio = variance(&means) * (tile * tile) as f64 / single;
        // The variance of n nearly normal means has the relative deviation √(2/(n − 1)).
        let z = (ratio - 1.0) / (2.0 / (means.len() - 1) as f64).sqrt();
        is_likely(&format!("tiles of {tile}: variance × {ratio:.3}"), z);
    }
}

/// The means of K shards scatter as their standard errors say, and the mean of all has a K-th of the variance.
#[test]
fn shards_have_the_variance_of_independent_samples() {
    const SHARDS: u64 = 16;
    let scene = noisy_plane();
    // A pair of nets of 256 each: shards that cut nets in two are not independent.
    let samples = 512;
    let mut whole: Option<Film> = None;
    let mut sum = 0.0;
    let mut degrees = 0.0;
    let mut means: Vec<Vec<f64>> = Vec::new();
    for k in 0..SHARDS {
        let Some(film) = picture(&scene, 32, samples * (k + 1)..samples * (k + 2), 9) else {
            return;
        };
        means.push(film.mean().iter().map(|m| f64::from(m[0])).collect());
        match &mut whole {
            None => whole = Some(film),
            Some(all) => all.merge(film).unwrap(),
        }
    }
    let error = whole.unwrap().standard_error();
    for (pixel, error) in error.iter().enumerate() {
        let variance = f64::from(error[0]).powi(2) * SHARDS as f64;
        let mean = means.iter().map(|m| m[pixel]).sum::<f64>() / SHARDS as f64;
        // F of means of shards over samples, summed over the pixels.
        sum += means.iter().map(|m| (m[pixel] - mean).powi(2)).sum::<f64>() / variance;
        degrees += (SHARDS - 1) as f64;
    }
    let z = (sum - degrees) / (2.0 * degrees).sqrt();
    is_likely(
        &format!("16 shards: F {:.4} of {degrees} degrees", sum / degrees),
        z,
    );
}

/// Paths of more than a thousand events keep drawing new numbers: a white cloud of optical depth 100 is still 1.
#[test]
fn long_paths_do_not_run_out_of_numbers() {
    let mut scene = empty();
    let half = Vec3::splat(0.5);
    add(
        &mut scene,
        block(-half, half),
        glass(1.0, grey(0.0, 100.0, Phase::Isotropic)),
    );
    scene.environment = constant_sky(1.0);
    // From the middle: (τ/2)² · 3/2 events, about.
    scene.cameras = vec![pinhole(DVec3::ZERO, DVec3::Z, 90.0)];
    let Some(r) = render(&scene, &settings(16, count(64, 1024)), Tuning::default()) else {
        return;
    };
    let (off, bound) = Estimate::of_image(&r.film).off(1.0);
    let events = r.report.rays as f64 / r.report.paths as f64;
    println!("{events:.0} rays a path: off by {off:.1e} ± {bound:.1e}");
    assert!(events > 1000.0);
    assert!(off + bound <= 5e-2);
}

/// Samples on both sides of 2³² are as good as the first ones, and other ones.
#[test]
fn sample_numbers_pass_two_to_the_32() {
    let scene = noisy_plane();
    let around = 1u64 << 32;
    let mut means = Vec::new();
    for first in [0, around - 32, around, (1 << 40) - 32] {
        let Some(film) = picture(&scene, 32, first..first + 64, 3) else {
            return;
        };
        means.push(Estimate::of_image(&film));
    }
    for (i, b) in means.iter().enumerate().skip(1) {
        assert_ne!(means[0].mean, b.mean);
        let difference = b.minus(means[0]);
        let z = difference.mean / difference.error;
        is_likely(&format!("range {i} against the first"), z);
    }
}

/// Form factor of a rectangle for a point on the normal through one of its corners, `a` × `b` at distance `h`.
fn corner_factor(a: f64, b: f64, h: f64) -> f64 {
    let part = |x: f64, y: f64| {
        let root = x.hypot(h);
        x / root * (y / root).atan()
    };
    (part(a, b) + part(b, a)) / (2.0 * std::f64::consts::PI)
}

/// Nets bring no plateau: squared error × samples does not grow from a block of 16 on, and is less where nets
/// are longer, for 1000 samples, which are no number of whole nets, too; all of it about the closed form.
#[test]
fn errors_of_nets_fall_at_least_as_of_independent_samples() {
    const SIDE: u32 = 64;
    let truth = 0.7 * 4.0 * corner_factor(4.0, 4.0, 3.0);
    let scene = noisy_plane();
    let mut first = None;
    for samples in [16, 64, 256, 1000, 1024] {
        let (mut sum, mut squares, mut count) = (0.0, 0.0, 0.0);
        for seed in 1..=4 {
            let Some(film) = picture(&scene, SIDE, 0..samples, seed) else {
                return;
            };
            assert!(film.block_level() > 0);
            for mean in film.mean() {
                let off = f64::from(mean[0]) - truth;
                sum += off;
                squares += off * off;
                count += 1.0;
            }
        }
        let product = squares / count * samples as f64;
        let ratio = product / *first.get_or_insert(product);
        let bias = sum / count / (squares / count / count).sqrt();
        println!(
            "{samples} samples: squared error × samples {product:.4}, {ratio:.3} of the first"
        );
        is_likely(&format!("mean of {samples} samples"), bias);
        // 16384 pixels tell it to 1.1 % each
        let wanted = match samples {
            ..64 => 0.92..1.08,
            64 => 0.0..0.95,
            256 => 0.0..0.7,
            _ => 0.0..0.8,
        };
        assert!(wanted.contains(&ratio), "{samples} samples: {ratio}");
    }
}
