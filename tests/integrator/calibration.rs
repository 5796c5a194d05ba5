//! Standard errors are as large as errors: in many renders of one scene with
//! other samples, pixels stray from the truth as often as they say.

use etendue::render::{Control, Tuning};
use etendue::settings::{BackendChoice, Estimator, Settings};
use glam::{DVec3, Vec3};

use crate::common::*;

/// Renders, each of so many samples that the standard error has seven degrees of freedom.
const RENDERS: u64 = 64;
const SAMPLES: u64 = 128;
/// 97.5 % quantile of Student's t with 7 degrees of freedom, and with 127.
const STUDENT: [(Estimator, f64); 2] = [(Estimator::Full, 2.3646), (Estimator::Textbook, 1.9788)];

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
    for (estimator, quantile) in STUDENT {
        let base = Settings {
            estimator,
            backend: BackendChoice::Bvh,
            ..settings(16, SAMPLES)
        };
        let Some(mut renderer) = open(&scene, &base, Tuning::default()) else {
            return;
        };
        let mut films = Vec::new();
        for part in 0..RENDERS {
            let samples = part * SAMPLES..(part + 1) * SAMPLES;
            renderer.restart(samples, 1).unwrap();
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
