//! Standard errors are as large as errors: in many renders of one scene with
//! other samples, pixels stray from the truth as often as they say.

use etendue::render::{Control, Tuning};
use etendue::settings::{BackendChoice, Estimator, Settings, Strategy};
use etendue::tails::student_quantile;
use glam::{DVec3, Vec3};

use crate::closed::glowing_room;
use crate::common::*;
use crate::statistics::{Batches, FALSE_ALARM, Family, regions};
use crate::tier::{count, is_night};

/// Renders, and samples of each.
const RENDERS: u64 = 64;
const SAMPLES: u64 = 128;
/// Degrees of freedom of standard errors: of two nets and their blocks (`src/film/error.rs`), and of samples.
const DEGREES: [(Estimator, f64); 2] = [(Estimator::Full, 3.0), (Estimator::Textbook, 127.0)];

#[test]
fn intervals_hold_the_truth_as_often_as_they_say() {
    // Light and shadow without rare paths: the laws of pixels are close to normal.
    let mut scene = empty();
    add(&mut scene, square(Vec3::ZERO, Vec3::Y, 3.0), lambert(0.7));
    add(&mut scene, sphere(2), lambert(0.4));
    add(
        &mut scene,
        square(3.0 * Vec3::Y, -Vec3::Y, 0.5),
        emitter(0.2, 8.0),
    );
    scene.environment = constant_sky(0.3);
    scene.cameras = vec![pinhole(DVec3::new(1.0, 2.0, 5.0), DVec3::Y, 40.0)];
    for (estimator, degrees) in DEGREES {
        let quantile = student_quantile(0.05, degrees);
        let base = Settings {
            estimator,
            backend: BackendChoice::Bvh,
            ..settings(16, SAMPLES)
        };
        let Some(mut renderer) = open(&scene, &base, Tuning::default()) else {
            return;
        };
        let mut films = Vec::new();
        for seed in 0..RENDERS {
            renderer.restart(0..SAMPLES, seed).unwrap();
            let film = renderer.render(&mut |_| Control::Continue).unwrap();
            films.push((film.mean(), film.standard_error()));
        }
        let (mut held, mut count, mut said, mut was) = (0.0, 0.0, 0.0, 0.0);
        for pixel in 0..256 {
            let value = |i: usize| f64::from(films[i].0[pixel][1]);
            let renders = 0..RENDERS as usize;
            let truth = renders.clone().map(value).sum::<f64>() / RENDERS as f64;
            for i in renders {
                let error = f64::from(films[i].1[pixel][1]);
                // The truth is the mean of all renders, this one too.
                let deviation = (value(i) - truth).powi(2) * RENDERS as f64 / (RENDERS - 1) as f64;
                // Some pixels see nothing but the sky.
                if error == 0.0 {
                    continue;
                }
                said += error * error;
                was += deviation;
                held += f64::from(u8::from(deviation.sqrt() <= quantile * error));
                count += 1.0;
            }
        }
        let (share, ratio) = (held / count, said / was);
        println!(
            "{}: {:.1} % of pixels hold the truth, squared error told / found {ratio:.3}",
            estimator.name(),
            100.0 * share
        );
        // 64 × 256 pixels: chance alone gives ±0.9 % and ±6 % at 4.9 standard errors.
        assert!((0.93..0.97).contains(&share), "{share}");
        assert!((ratio - 1.0).abs() < 0.08, "{ratio}");
    }
}

/// Rooms whose radiance is known exactly, rendered in batches with seeds of their own: Student's t of every tile gives
/// p-values that are uniform, and those against a truth that is off by 1 % are not.
#[test]
fn p_values_against_the_truth_are_uniform() {
    const SIDE: usize = 64;
    const TILE: usize = 8;
    const STRATEGIES: [Strategy; 2] = [Strategy::Mis, Strategy::BsdfOnly];
    let (albedos, strategies): (&[f32], _) = match is_night() {
        true => (&[0.3, 0.5, 0.7, 0.9], &STRATEGIES[..]),
        false => (&[0.7], &STRATEGIES[..1]),
    };
    let tiles = &regions(SIDE, TILE)[1..];
    let whole = &regions(SIDE, TILE)[0].1;
    let (mut family, mut wrong) = (Family::default(), Family::default());
    for &albedo in albedos {
        for estimator in [Estimator::Full, Estimator::Textbook] {
            for &strategy in strategies {
                let what = format!("{albedo} {} {strategy:?}", estimator.name());
                let base = Settings {
                    estimator,
                    strategy,
                    ..settings(SIDE as u32, 4)
                };
                let scene = glowing_room(albedo);
                let Some(mut renderer) = open(&scene, &base, Tuning::default()) else {
                    return;
                };
                let mut batches = Batches::default();
                for batch in 0..count(64, 256) {
                    // Other rooms have other numbers.
                    let seed = family.len() as u64 * 1000 + batch + base.seed;
                    renderer.restart(0..4, seed).unwrap();
                    batches.push(&renderer.render(&mut |_| Control::Continue).unwrap());
                }
                let truth = 1.0 / (1.0 - f64::from(albedo));
                assert!(!batches.tail(0).is_heavy(), "{what}: {:?}", batches.tail(0));
                batches.estimate(whole, 0).assert_is(&what, truth, 1e-2);
                for (tile, pixels) in tiles {
                    let seen = batches.estimate(pixels, 0);
                    family.add(format!("{what} {tile}"), seen.p(truth));
                    wrong.add(String::new(), seen.p(1.01 * truth));
                }
            }
        }
    }
    family.assert("tiles against the truth");
    let (right, wrong) = (family.uniformity(), wrong.uniformity());
    println!(
        "{} p-values are uniform with p = {right:.3}, against a wrong truth {wrong:.0e}",
        family.len()
    );
    assert!(right >= FALSE_ALARM && wrong < FALSE_ALARM);
}
