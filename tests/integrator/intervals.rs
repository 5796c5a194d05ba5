//! At night, with many seeds: how often the intervals of the project's own scenes hold the truth.

use std::ops::RangeInclusive;
use std::path::Path;

use etendue::render::{Control, Tuning};
use etendue::scene::gltf;
use etendue::settings::{BackendChoice, Settings};

use crate::common::*;
use crate::tier::is_night;

const SCENES: [&str; 6] = ["cornell", "veach", "window", "sun", "instances", "caustic"];
const SEEDS: u64 = 256;
const SIDE: u32 = 24;
const SAMPLES: u64 = 128;
/// What nominal 95 % are in truth.
const SHARE: RangeInclusive<f64> = 0.93..=0.97;

#[test]
fn intervals_hold_the_truth_in_the_projects_scenes() {
    if !is_night() {
        return println!("at night only");
    }
    let mut failures = Vec::new();
    for name in SCENES {
        let file = format!("{}/scenes/{name}.gltf", env!("CARGO_MANIFEST_DIR"));
        let scene = gltf::load(Path::new(&file)).unwrap();
        let base = Settings {
            backend: BackendChoice::Bvh,
            ..settings(SIDE, SAMPLES)
        };
        let Some(mut renderer) = open(&scene, &base, Tuning::default()) else {
            return;
        };
        let mut films = Vec::new();
        for seed in 0..SEEDS {
            renderer.restart(0..SAMPLES, 1000 + seed).unwrap();
            let film = renderer.render(&mut |_| Control::Continue).unwrap();
            films.push((film.mean(), film.interval(0.95)));
        }
        let (mut held, mut count) = (0_u64, 0_u64);
        for i in 0..(SIDE * SIDE) as usize {
            let values = || films.iter().map(|film| f64::from(film.0[i][1]));
            // Some pixels see nothing but a constant sky or a lamp.
            if values().all(|value| value == values().next().unwrap_or_default()) {
                continue;
            }
            let truth = values().sum::<f64>() / SEEDS as f64;
            // The truth is the mean of all renders, each of them included.
            let own = (SEEDS as f64 / (SEEDS - 1) as f64).sqrt();
            for (value, film) in values().zip(&films) {
                let half = f64::from(film.1[i][1]);
                count += 1;
                held += u64::from((value - truth).abs() * own <= half);
            }
        }
        let share = held as f64 / count as f64;
        let line = format!(
            "{name}: {:.1} % of {count} intervals hold the truth",
            100.0 * share
        );
        println!("{line}");
        if !SHARE.contains(&share) {
            failures.push(line);
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}
