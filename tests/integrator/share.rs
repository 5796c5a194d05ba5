//! Pixels that share what their paths find: the same means, less noise, and the same bits however the work is cut.

use etendue::Error;
use etendue::film::Film;
use etendue::render::Tuning;
use etendue::scene::{AlphaMode, LightKind, PunctualLight, Scene};
use etendue::settings::{BackendChoice, Crop, Settings};
use glam::{DVec3, Vec3, Vec4};

use crate::common::backends::pair;
use crate::common::*;
use crate::statistics::{Batches, Family, regions};

const SIDE: u32 = 16;
const TILE: usize = 4;
/// Renders of each kind, with seeds of their own.
const SEEDS: u64 = 24;
/// How much less squared error pixels have that share with seven others in the hall, at least: 1.5 where the screen divides blocks; without it 2.2.
const LESS_ERROR: f64 = 1.25;

/// A room in which neighbours see different things: plates before a wall, a screen, a smooth ball, a metal plate, walls that reflect
/// nothing of a colour, two lamps and a hole to the sky.
fn hall() -> Scene {
    let mut scene = empty();
    let mut wall = |centre: Vec3, normal: Vec3, colour: [f32; 3]| {
        let [r, g, b] = colour;
        let mut paint = lambert(0.5);
        paint.base_color = Vec4::new(r, g, b, 1.0);
        add(&mut scene, square(centre, normal, 1.0), paint);
    };
    wall(-Vec3::Y, Vec3::Y, [0.6, 0.6, 0.6]);
    wall(-Vec3::Z, Vec3::Z, [0.8, 0.7, 0.6]);
    wall(-Vec3::X, Vec3::X, [0.9, 0.0, 0.1]);
    wall(Vec3::X, -Vec3::X, [0.0, 0.8, 0.1]);
    wall(Vec3::Z, -Vec3::Z, [0.5, 0.5, 0.9]);
    // The ceiling leaves a third open.
    let ceiling = quad([
        Vec3::new(-1.0, 1.0, -1.0),
        Vec3::new(0.4, 1.0, -1.0),
        Vec3::new(0.4, 1.0, 1.0),
        Vec3::new(-1.0, 1.0, 1.0),
    ]);
    add(&mut scene, ceiling, lambert(0.7));
    for k in 0..4 {
        let centre = Vec3::new(-0.7 + 0.45 * k as f32, -0.3, -0.8);
        add(&mut scene, square(centre, Vec3::Z, 0.09), lambert(0.8));
    }
    // A screen, edge on: what is on one side of it is not seen from the other.
    let screen = square(Vec3::new(0.25, 0.0, -0.4), Vec3::X, 0.6);
    add(&mut scene, screen, lambert(0.1));
    let mut ball = sphere(2);
    ball.positions
        .iter_mut()
        .for_each(|p| *p = 0.25 * *p + Vec3::new(0.5, -0.75, -0.2));
    add(&mut scene, ball, lambert(0.4));
    let plate = square(Vec3::new(-0.97, -0.2, 0.0), Vec3::X, 0.3);
    add(&mut scene, plate, metal(0.8, 0.3));
    let lamp = square(Vec3::new(-0.6, 0.3, -0.5), -Vec3::Y, 0.2);
    add(&mut scene, lamp, emitter(0.3, 4.0));
    scene.lights = vec![PunctualLight {
        name: String::from("lamp"),
        kind: LightKind::Point,
        position: DVec3::new(0.2, 0.1, 0.5),
        direction: -Vec3::Y,
        intensity: Vec3::new(0.1, 0.2, 0.3),
    }];
    scene.environment = constant_sky(1.0);
    scene.cameras = vec![pinhole(DVec3::new(0.1, 0.0, 0.95), -DVec3::Z, 75.0)];
    scene
}

fn plan(backend: BackendChoice, share: bool, samples: u64, seed: u64) -> Settings {
    Settings {
        backend,
        share,
        seed,
        aovs: true,
        ..settings(SIDE, samples)
    }
}

fn film(scene: &Scene, settings: &Settings, tuning: Tuning) -> Option<Film> {
    let rendered = render(scene, settings, tuning)?;
    let features = &rendered.report.features;
    let shares = features.iter().any(|f| f.name == "share" && f.on);
    assert_eq!(shares, settings.share);
    Some(rendered.film)
}

fn batches(scene: &Scene, of: impl Fn(u64) -> Settings) -> Option<Batches> {
    let mut batches = Batches::default();
    for seed in 0..SEEDS {
        batches.push(&film(scene, &of(seed), Tuning::default())?);
    }
    Some(batches)
}

/// Sum over the pixels of the squared standard error, by the scatter of the renders.
fn squared_error(batches: &Batches) -> f64 {
    let errors = (0..(SIDE * SIDE) as usize).map(|i| batches.estimate(&[i], 1).error.powi(2));
    errors.sum()
}

#[test]
fn what_pixels_share_has_the_mean_of_each_alone() {
    let scene = hall();
    for max_depth in [0, 2] {
        let at = |share, backend, seed| Settings {
            max_depth,
            ..plan(backend, share, 64, seed)
        };
        let own = |seed| at(false, BackendChoice::Bvh, 1000 + seed);
        let Some(alone) = batches(&scene, own) else {
            return;
        };
        for backend in pair() {
            let Some(shared) = batches(&scene, |seed| at(true, backend, seed)) else {
                continue;
            };
            let mut family = Family::default();
            for (name, pixels) in regions(SIDE as usize, TILE) {
                for channel in 0..3 {
                    let [a, b] = [&shared, &alone].map(|x| x.estimate(&pixels, channel));
                    family.add(format!("{name}, {channel}"), a.minus(b).p(0.0));
                }
            }
            family.assert(&format!("{backend:?}, depth {max_depth}"));
            let ratio = squared_error(&alone) / squared_error(&shared);
            println!("{backend:?}, depth {max_depth}: {ratio:.2} times less squared error");
            assert!(ratio > LESS_ERROR, "{ratio:.2}");
        }
    }
}

/// Walls that emit 1 and reflect a half of what meets them: 2 everywhere, whatever is shared.
#[test]
fn a_closed_room_that_shares_is_as_bright_as_the_series() {
    let mut scene = empty();
    add(&mut scene, room(1.0), emitter(0.5, 1.0));
    scene.cameras = vec![pinhole(DVec3::new(0.1, 0.2, 0.3), -DVec3::Z, 75.0)];
    let of = |seed| plan(BackendChoice::Bvh, true, 256, seed);
    let Some(room) = batches(&scene, of) else {
        return;
    };
    let pixels: Vec<usize> = (0..(SIDE * SIDE) as usize).collect();
    room.estimate(&pixels, 1)
        .assert_is("a room that shares", 2.0, 2e-3);
}

#[test]
fn what_pixels_share_has_the_same_bits_however_the_work_is_cut() {
    let scene = hall();
    let bits = |film: &Film| -> Vec<u32> {
        let (mean, error) = (film.mean(), film.standard_error());
        let values = mean.into_iter().chain(error).flatten();
        values.map(f32::to_bits).collect()
    };
    for backend in pair() {
        let whole = plan(backend, true, 32, 5);
        let Some(first) = film(&scene, &whole, Tuning::default()) else {
            continue;
        };
        let default = Tuning::default();
        for tuning in [
            Tuning {
                max_pass: 2,
                max_tiles: 1,
                ..default
            },
            Tuning {
                addresses: Some(false),
                max_tiles: 3,
                ..default
            },
        ] {
            let again = film(&scene, &whole, tuning).unwrap();
            assert!(bits(&again) == bits(&first), "{backend:?}: {tuning:?}");
        }
        // shards
        let mut halves = [0..12, 12..32].map(|samples| {
            let settings = Settings {
                samples,
                ..whole.clone()
            };
            film(&scene, &settings, default).unwrap()
        });
        let [a, b] = &mut halves;
        a.merge(std::mem::replace(b, Film::of(&whole))).unwrap();
        assert!(bits(a) == bits(&first), "{backend:?}: shards");
        // a part of the frame that ends within blocks
        let crop = Crop {
            x0: 4,
            y0: 2,
            x1: 14,
            y1: 13,
        };
        let part = Settings {
            crop: Some(crop),
            ..whole.clone()
        };
        let part = film(&scene, &part, default).unwrap();
        let (width, all, own) = (crop.x1 - crop.x0, first.mean(), part.mean());
        for (i, value) in (0u32..).zip(own) {
            let (x, y) = (crop.x0 + i % width, crop.y0 + i / width);
            assert_eq!(value, all[(y * SIDE + x) as usize], "{backend:?} {x},{y}");
        }
    }
}

#[test]
fn pixels_share_only_where_they_can() {
    let refused = |settings: Settings, option: &str| {
        let error = settings.validate().unwrap_err();
        assert!(
            matches!(&error, Error::Settings { name, .. } if *name == option),
            "{error}"
        );
    };
    let shared = plan(BackendChoice::Bvh, true, 4, 0);
    let crop = |x0, y0| {
        let (x1, y1) = (SIDE, SIDE);
        Some(Crop { x0, y0, x1, y1 })
    };
    for (x0, y0) in [(1, 0), (0, 1), (2, 2)] {
        refused(
            Settings {
                crop: crop(x0, y0),
                ..shared.clone()
            },
            "--crop",
        );
    }
    refused(
        Settings {
            adaptive: true,
            ..shared.clone()
        },
        "--adaptive",
    );
    // where light passes straight on, nothing is shared: the picture is that of each pixel alone
    let mut veil = hall();
    let mut pane = lambert(0.5);
    pane.alpha_mode = AlphaMode::Blend;
    pane.base_color.w = 0.5;
    add(&mut veil, square(0.2 * Vec3::Y, Vec3::Z, 0.3), pane);
    let [with, without] = [true, false].map(|share| {
        let settings = plan(BackendChoice::Bvh, share, 4, 0);
        render(&veil, &settings, Tuning::default())
    });
    let (Some(with), Some(without)) = (with, without) else {
        return;
    };
    assert!(with.film.mean() == without.film.mean());
    let features = with.report.features;
    assert!(features.iter().any(|f| f.name == "share" && !f.on));
}
