//! Two plates with a thin gap: light does not leak through or round offsets, and
//! the shadow between them is right.

use etendue::film::Film;
use etendue::scene::{LightKind, PunctualLight, Scene};
use etendue::settings::{BackendChoice, Settings};
use glam::{DAffine3, DVec3, Vec3};

use crate::backends::pair;
use crate::scenes::{fan, lambert, look_at, scaled, scene, white_sky};
use crate::{Levels, finish, open, render};

/// Distance of the plates relative to their half width.
const GAP: f64 = 1e-4;
const WIDTH: u32 = 32;

/// The lower plate has half width `size`, at z = 0; the upper one covers a quarter of its area in the middle. The
/// camera looks at the lower plate from `below` or from above.
fn plates(size: f64, moved: DVec3, below: bool) -> Scene {
    let lower = scaled(fan(), size as f32);
    let upper = scaled(fan(), 0.5 * size as f32);
    let above = DVec3::new(0.0, 0.0, GAP * size);
    let mut scene = scene(
        vec![
            (lower, vec![DAffine3::from_translation(moved)]),
            (upper, vec![DAffine3::from_translation(moved + above)]),
        ],
        vec![lambert(0.5)],
    );
    // Right under or over the middle; 1.8 across at z = 0.
    let side = if below { -1.0 } else { 1.0 };
    let eye = moved + DVec3::new(0.0, 0.0, 4.0 * size * side);
    look_at(&mut scene, eye, moved, 2.0 * (0.9f32 / 4.0).atan());
    scene
}

fn sun(scene: &mut Scene, direction: Vec3) {
    scene.lights.push(PunctualLight {
        name: String::new(),
        kind: LightKind::Directional,
        position: DVec3::ZERO,
        direction: direction.normalize(),
        intensity: Vec3::ONE,
    });
}

fn picture(scene: &Scene, backend: BackendChoice, max_depth: u32) -> Option<Film> {
    let settings = Settings {
        width: WIDTH,
        height: WIDTH,
        samples: 0..16,
        backend,
        max_depth,
        ..Settings::default()
    };
    let mut renderer = open(scene, &settings, Levels::Flat)?;
    let film = render(&mut renderer);
    finish(&renderer);
    Some(film)
}

/// Value of a face that the sun meets straight on; roundings of a few operations.
const LIT: f32 = 0.5 * std::f32::consts::FRAC_1_PI;
const TOLERANCE: f32 = 1e-5;

#[test]
fn plates_cast_shadows_through_thin_gaps() {
    for backend in pair() {
        for (size, moved) in [
            (1.0, DVec3::ZERO),
            (1e-6, DVec3::ZERO),
            (1.0, DVec3::splat(1e6)),
        ] {
            let label = format!("size {size}, moved {moved}, {}", backend.name());
            // From below with the sun above: not a photon, though paths are long.
            let mut dark = plates(size, moved, true);
            sun(&mut dark, Vec3::NEG_Z);
            let Some(film) = picture(&dark, backend, 0) else {
                return;
            };
            assert!(film.mean().iter().all(|m| m[0] == 0.0), "{label}: a leak");
            // From above: both plates are lit in full, and neither is in its own shadow.
            let mut bright = plates(size, moved, false);
            sun(&mut bright, Vec3::NEG_Z);
            let film = picture(&bright, backend, 1).unwrap();
            for m in film.mean() {
                assert!((m[0] - LIT).abs() < TOLERANCE, "{label}: {m:?}");
            }
        }
    }
}

/// Looking flat into the gap from the lower plate's rim: the lower plate under the upper one is in its shadow.
#[test]
fn inside_of_the_gap_is_dark() {
    for backend in pair() {
        let mut scene = plates(1.0, DVec3::ZERO, false);
        scene.cameras.clear();
        // All rays go between the plates: from the middle of the gap, down at the lower plate.
        let eye = DVec3::new(0.0, 0.0, 0.5 * GAP);
        look_at(&mut scene, eye, DVec3::ZERO, 1.5);
        sun(&mut scene, Vec3::NEG_Z);
        let Some(film) = picture(&scene, backend, 1) else {
            return;
        };
        assert!(
            film.mean().iter().all(|m| m[0] == 0.0),
            "{}",
            backend.name()
        );
        // Almost all of the sky is hidden, too: what comes in from the rim is of the order of the gap squared.
        scene.lights.clear();
        white_sky(&mut scene);
        let film = picture(&scene, backend, 1).unwrap();
        let mean = film.mean().iter().map(|m| f64::from(m[0])).sum::<f64>();
        assert!(
            mean / film.pixels() as f64 <= 1e-3,
            "{}: {mean}",
            backend.name()
        );
    }
}
