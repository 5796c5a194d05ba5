//! Light that is seen directly.

use etendue::render::{Control, Renderer, Tuning};
use etendue::scene::{Material, Scene};
use etendue::settings::{BackendChoice, Estimator, Settings};
use glam::{DVec3, Vec3};

use crate::common::backends::{is_device_required, pair};
use crate::common::*;
use crate::largest_deviation;
use crate::statistics::Estimate;
use crate::tier::count;

const RADIANCE: f32 = 3.7;

/// An emissive square that fills a narrow view from `distance` metres along the
/// direction `degrees` from its normal.
fn filled_view(distance: f64, degrees: f64, is_double_sided: bool) -> Scene {
    let mut scene = empty();
    let material = Material {
        double_sided: is_double_sided,
        ..emitter(0.0, RADIANCE)
    };
    // The view is 1° high: 0.009 of the distance each way, 11 times that along a surface at 85°.
    add(
        &mut scene,
        square(Vec3::ZERO, Vec3::Z, 0.15 * distance as f32),
        material,
    );
    let (sin, cos) = degrees.to_radians().sin_cos();
    let from = distance * DVec3::new(sin, 0.0, cos);
    scene.cameras = vec![pinhole(from, DVec3::ZERO, 1.0)];
    scene
}

/// Radiance does not fall with distance or tilt.
#[test]
fn radiance_of_an_emitter_is_the_same_from_everywhere() {
    // All distances and all tilts, the extremes together.
    let views = [
        (1.0, 0.0),
        (10.0, 60.0),
        (1e2, 0.0),
        (1e3, 60.0),
        (1.0, 85.0),
        (1e4, 0.0),
        (1e4, 85.0),
    ];
    for (distance, degrees) in views {
        let Some(r) = render(
            &filled_view(distance, degrees, false),
            &settings(8, 4),
            Tuning::default(),
        ) else {
            return;
        };
        let off = largest_deviation(&r.film, RADIANCE.into());
        // Sums of four equal numbers are exact; 1e-6 leaves room for a fused mean.
        assert!(off <= 1e-6, "{distance} m, {degrees}°: off by {off:.1e}");
    }
}

#[test]
fn only_the_front_emits_unless_double_sided() {
    for backend in pair() {
        let settings = Settings {
            backend,
            ..settings(8, 4)
        };
        for (degrees, is_double_sided, truth) in [
            (60.0, false, RADIANCE),
            (60.0, true, RADIANCE),
            (120.0, false, 0.0),
            (180.0, false, 0.0),
            (120.0, true, RADIANCE),
            (180.0, true, RADIANCE),
        ] {
            let scene = filled_view(10.0, degrees, is_double_sided);
            let Some(r) = render(&scene, &settings, Tuning::default()) else {
                continue;
            };
            for v in r.film.mean().iter().flatten() {
                // Exact on the dark side, 1e-6 as above on the bright one.
                assert!(
                    (v - truth).abs() <= 1e-6 * truth,
                    "{backend:?}, {degrees}°: {v}"
                );
            }
        }
    }
}

/// A million samples of a sky do not drift: the sum is a tree.
#[test]
fn constant_sky_keeps_its_value_over_a_million_samples() {
    // By day two, neither of them a sum of few powers of two.
    for radiance in [0.1, 1e-3, 0.3, 0.7].into_iter().take(count(2, 4) as usize) {
        let mut scene = empty();
        scene.environment = constant_sky(radiance);
        scene.cameras = vec![pinhole(DVec3::Z, DVec3::ZERO, 40.0)];
        let settings = Settings {
            backend: BackendChoice::Bvh,
            ..settings(8, 1_000_000)
        };
        let Some(r) = render(&scene, &settings, Tuning::default()) else {
            return;
        };
        let truth = f64::from(radiance);
        let off = largest_deviation(&r.film, truth);
        println!(
            "sky {radiance}: off {off:.1e}, mean {:.9}",
            Estimate::of_image(&r.film).mean
        );
        // Twenty levels of a tree of equal numbers: each doubling is exact; one rounding at the end.
        assert!(off <= 1e-7, "{radiance}: off by {off:.1e}");
    }
}

/// Across the rim of an emitter each sample is 1 or 0: the mean p tells the standard error, √(p(1 − p)/(N − 1)).
#[test]
fn standard_error_is_that_of_the_samples() {
    const SAMPLES: u64 = 256;
    let mut scene = empty();
    add(
        &mut scene,
        square(Vec3::ZERO, Vec3::Z, 0.55),
        emitter(0.0, 1.0),
    );
    scene.cameras = vec![parallel(DVec3::Z, DVec3::ZERO, 1.0)];
    // The full estimator's samples are no independent coins.
    let settings = Settings {
        estimator: Estimator::Textbook,
        ..settings(8, SAMPLES)
    };
    let Some(r) = render(&scene, &settings, Tuning::default()) else {
        return;
    };
    let mut rim = 0;
    for (mean, error) in r.film.mean().iter().zip(r.film.standard_error()) {
        let p = f64::from(mean[0]);
        let wanted = (p * (1.0 - p) / (SAMPLES - 1) as f64).sqrt();
        let off = (f64::from(error[0]) - wanted).abs();
        // Eight levels of a tree of squares, rounded in single precision.
        assert!(off <= 1e-6 * wanted, "{p}: {error:?} instead of {wanted}");
        rim += usize::from(wanted > 0.0);
    }
    assert!(rim >= 12, "{rim} pixels on the rim");
}

/// Two emitters at the end of fp32 are more than it holds: such samples are left out, and the report says how many.
#[test]
fn samples_that_overflow_are_counted() {
    let mut scene = filled_view(10.0, 0.0, false);
    scene.materials[0] = Material {
        emission: Vec3::splat(f32::MAX),
        ..lambert(1.0)
    };
    scene.environment = constant_sky(f32::MAX);
    let options = etendue::render::DeviceOptions {
        validation: true,
        ..Default::default()
    };
    let settings = Settings {
        aovs: true,
        ..settings(8, 4)
    };
    let made = Renderer::made_in(&WORKSHOP, &scene, &settings, &options, Tuning::default());
    let mut renderer = match made {
        Ok(renderer) => renderer,
        Err(error) if is_device_required() => panic!("{error}"),
        Err(error) => return println!("skipped: {error}"),
    };
    let film = renderer.render(&mut |_| Control::Continue).unwrap();
    assert_eq!(renderer.report().ledger.non_finite, 8 * 8 * 4);
    assert_eq!(film.dropped().unwrap(), [4.0; 8 * 8]);
    assert!(film.mean().iter().flatten().all(|v| *v == 0.0));
}
