//! A render is a pure function of the scene and the settings, to the bit.

use etendue::error::Error;
use etendue::film::{Allotment, Film};
use etendue::render::{Control, DeviceOptions, Renderer, Study, Tuning, Workshop};
use etendue::scene::{LightKind, PunctualLight, Scene};
use etendue::settings::{BackendChoice, Crop, Settings};
use glam::{DVec3, Vec3};

use crate::common::backends::offered;
use crate::common::*;

const SIDE: u32 = 20;
const SAMPLES: u64 = 32;

/// A bit of everything that scatters: Lambert, metal, an area and a point light, a sky.
fn corner() -> Scene {
    let mut scene = empty();
    add(&mut scene, square(Vec3::ZERO, Vec3::Y, 3.0), lambert(0.7));
    add(
        &mut scene,
        square(-2.0 * Vec3::Z, Vec3::Z, 3.0),
        metal(0.8, 0.4),
    );
    add(&mut scene, sphere(2), lambert(0.4));
    add(
        &mut scene,
        square(3.0 * Vec3::Y, -Vec3::Y, 0.5),
        emitter(0.2, 8.0),
    );
    scene.lights = vec![PunctualLight {
        name: String::from("lamp"),
        kind: LightKind::Point,
        position: DVec3::new(-2.0, 2.0, 2.0),
        direction: -Vec3::Y,
        intensity: Vec3::new(3.0, 2.0, 1.0),
    }];
    scene.environment = constant_sky(0.3);
    scene.cameras = vec![pinhole(DVec3::new(1.0, 2.0, 5.0), DVec3::Y, 40.0)];
    scene
}

fn plain(backend: BackendChoice) -> Settings {
    Settings {
        backend,
        aovs: true,
        ..settings(SIDE, SAMPLES)
    }
}

/// Every float of the film's nodes, as bits, with their places in the tree.
fn bits(film: &Film) -> Vec<(u64, u32, Vec<u32>)> {
    let bits = |v: &[f32]| v.iter().map(|x| x.to_bits()).collect();
    film.nodes()
        .map(|(first, level, v)| (first, level, bits(v)))
        .collect()
}

fn film(settings: &Settings, tuning: Tuning) -> Option<Film> {
    render(&corner(), settings, tuning).map(|r| r.film)
}

#[test]
fn same_seed_gives_the_same_bits_however_the_work_is_cut() {
    for backend in offered() {
        let Some(first) = film(&plain(backend), Tuning::default()) else {
            continue;
        };
        let first = bits(&first);
        let default = Tuning::default();
        let cuts = [
            default,
            default,
            Tuning {
                max_pass: 1,
                ..default
            },
            Tuning {
                max_pass: 8,
                max_tiles: 7,
                ..default
            },
            Tuning {
                max_pass: 64,
                max_tiles: 1,
                ..default
            },
            Tuning {
                max_tiles: 64,
                ..default
            },
            // both ways to read the scene's arrays
            Tuning {
                addresses: Some(false),
                ..default
            },
            Tuning {
                addresses: Some(true),
                ..default
            },
            // a kernel of the limit report
            Tuning {
                study: Study::Counts,
                ..default
            },
        ];
        for tuning in cuts {
            let again = film(&plain(backend), tuning).unwrap();
            assert!(
                bits(&again) == first,
                "{backend:?}: {tuning:?} changes the bits"
            );
        }
        for seed in [2, 1 << 32 | 1] {
            let settings = Settings {
                seed,
                ..plain(backend)
            };
            let other = film(&settings, default).unwrap();
            assert!(
                bits(&other) != first,
                "{backend:?}: seed {seed:#x} changes nothing"
            );
        }
    }
}

#[test]
fn a_renderer_that_starts_again_is_as_good_as_a_new_one() {
    for backend in offered() {
        let settings = plain(backend);
        let Some(fresh) = film(&settings, Tuning::default()) else {
            continue;
        };
        let other = Settings {
            samples: 5..9,
            seed: 1 << 40,
            ..settings.clone()
        };
        let options = DeviceOptions::default();
        let mut renderer = Renderer::new(&corner(), &other, &options).unwrap();
        renderer.render(&mut |_| Control::Continue).unwrap();
        renderer.restart(settings.samples, settings.seed).unwrap();
        let again = renderer.render(&mut |_| Control::Continue).unwrap();
        assert!(bits(&again) == bits(&fresh), "{backend:?}");
        assert!(renderer.restart(3..3, 0).is_err());
    }
}

/// Devices and kernels that others used, and still use, change nothing.
#[test]
fn a_workshop_changes_no_bit_of_a_picture() {
    let options = DeviceOptions {
        validation: true,
        ..DeviceOptions::default()
    };
    for backend in offered() {
        let settings = plain(backend);
        let Some(shared) = film(&settings, Tuning::default()) else {
            continue;
        };
        let picture = |workshop: Option<&Workshop>| {
            let (scene, tuning) = (corner(), Tuning::default());
            let made = match workshop {
                Some(w) => Renderer::made_in(w, &scene, &settings, &options, tuning),
                None => Renderer::tuned(&scene, &settings, &options, tuning),
            };
            let mut renderer = made.unwrap();
            let film = renderer.render(&mut |_| Control::Continue).unwrap();
            (bits(&film), renderer)
        };
        let (alone, _) = picture(None);
        let workshop = Workshop::new();
        let (first, one) = picture(Some(&workshop));
        let (second, other) = picture(Some(&workshop));
        drop(one);
        let (third, _) = picture(Some(&workshop));
        let same = [bits(&shared), first, second, third];
        assert!(same.iter().all(|b| *b == alone), "{backend:?}");
        // The last renderer has the device to itself.
        drop(workshop);
        assert_eq!(other.validation_messages(), Vec::<String>::new());
    }
}

#[test]
fn crop_is_a_part_of_the_frame() {
    for backend in offered() {
        let Some(whole) = film(&plain(backend), Tuning::default()) else {
            continue;
        };
        // Not on borders of tiles.
        let crop = Crop {
            x0: 3,
            y0: 5,
            x1: 17,
            y1: 18,
        };
        let settings = Settings {
            crop: Some(crop),
            ..plain(backend)
        };
        let part = film(&settings, Tuning::default()).unwrap();
        let floats = whole.floats_per_pixel();
        let (whole, part) = (bits(&whole), bits(&part));
        assert_eq!((whole.len(), part.len()), (1, 1));
        let columns = (crop.x1 - crop.x0) as usize * floats;
        for (y, row) in (crop.y0..crop.y1).zip(part[0].2.chunks_exact(columns)) {
            let start = (y * SIDE + crop.x0) as usize * floats;
            assert!(
                row == &whole[0].2[start..start + columns],
                "{backend:?}: row {y}"
            );
        }
    }
}

#[test]
fn merged_films_are_the_film_of_all_samples() {
    for backend in offered() {
        let part = |samples| {
            let settings = Settings {
                samples,
                ..plain(backend)
            };
            film(&settings, Tuning::default())
        };
        let Some(mut merged) = part(0..10) else {
            continue;
        };
        let whole = part(0..SAMPLES).unwrap();
        merged.merge(part(10..SAMPLES).unwrap()).unwrap();
        assert!(bits(&merged) == bits(&whole), "{backend:?}");
    }
}

/// Pixels take 1 to 16 samples where the film counts one, by every traversal, from the third on: each has the bits of an
/// even picture of so many times the samples.
#[test]
fn pixels_that_take_more_samples_have_the_bits_of_longer_renders() {
    const RANGE: std::ops::Range<u64> = 3..21;
    let exponents: Vec<u8> = (0..SIDE * SIDE).map(|p| (p * 7 % 5) as u8).collect();
    let allotment = Allotment::from_exponents(exponents.clone());
    for backend in offered() {
        for max_pass in [256, 2] {
            let adaptive = Settings {
                samples: RANGE,
                adaptive: true,
                ..plain(backend)
            };
            let tuning = Tuning {
                max_pass,
                max_tiles: 5,
                ..Tuning::default()
            };
            let Some(mut renderer) = open(&corner(), &adaptive, tuning) else {
                continue;
            };
            renderer.allot(&allotment).unwrap();
            let spread = renderer.render(&mut |_| Control::Continue).unwrap();
            let paths = renderer.report().paths;
            assert_eq!(paths, 18 * exponents.iter().map(|e| 1 << e).sum::<u64>());
            for e in 0..5 {
                let even = Settings {
                    samples: RANGE.start << e..RANGE.end << e,
                    adaptive: false,
                    ..adaptive.clone()
                };
                let even = film(&even, Tuning::default()).unwrap();
                let own = |film: &Film| -> Vec<_> {
                    let (mean, error) = (film.mean(), film.standard_error());
                    let (albedo, depth) = (film.albedo().unwrap(), film.depth().unwrap());
                    let chosen = (0..exponents.len()).filter(|p| exponents[*p] == e);
                    chosen
                        .map(|p| (mean[p], error[p], albedo[p], depth[p]))
                        .collect()
                };
                assert!(own(&spread) == own(&even), "{backend:?} {max_pass} {e}");
            }
        }
    }
}

#[test]
fn samples_are_spread_only_where_they_can_be() {
    let bvh = plain(BackendChoice::Bvh);
    let Some(mut renderer) = open(&corner(), &bvh, Tuning::default()) else {
        return;
    };
    let refused = |result: etendue::Result<()>| matches!(result, Err(Error::Settings { name, .. }) if name == "--adaptive");
    assert!(refused(renderer.allot(&Allotment::default())));
    let adaptive = Settings {
        adaptive: true,
        ..bvh
    };
    let mut renderer = open(&corner(), &adaptive, Tuning::default()).unwrap();
    assert!(refused(
        renderer.allot(&Allotment::from_exponents(vec![1; 3]))
    ));
    let all = vec![Allotment::MOST + 1; (SIDE * SIDE) as usize];
    assert!(refused(renderer.allot(&Allotment::from_exponents(all))));
    // too few to be spread
    assert_eq!(renderer.spread(63).unwrap(), 63);
    assert_eq!(renderer.spread(64).unwrap(), 16);
    let film = renderer.render(&mut |_| Control::Continue).unwrap();
    assert!(film.allotment().most() > 0);
    // the same again, from a pilot of its own
    let first = film.allotment().clone();
    renderer.spread(64).unwrap();
    let again = renderer.render(&mut |_| Control::Continue).unwrap();
    assert!(again.allotment() == &first && bits(&again) == bits(&film));
}
