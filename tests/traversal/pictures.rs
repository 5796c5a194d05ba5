//! All backends see the same and make the same pictures of the scenes that come
//! with the project.

use std::path::{Path, PathBuf};

use etendue::film::Film;
use etendue::layout::{NONE, ProbeHit, ProbeRay};
use etendue::render::{Tuning, devices};
use etendue::scene::{Camera, Projection, Scene, gltf};
use etendue::settings::{BackendChoice, Settings};
use glam::DVec3;

use crate::backends::offered;
use crate::brute::{Brute, T_TOLERANCE, check, origin};
use crate::statistics::largest_of;
use crate::{Levels, finish, levels_tuning, open, open_tuned, probing, render};

const WIDTH: u32 = 64;
const HEIGHT: u32 = 48;
/// Pixels of the pictures that are probed: 20 480 rays.
const PROBED: (u32, u32) = (160, 128);
/// Rays whose ids may differ, as a share: those on edges.
const MOST_OTHER_IDS: f64 = 1e-4;
const TILE: u32 = 8;
/// Pixels of the same samples that differ by more than rounding, as a share, where all traversals run our own test of triangles.
/// Nested solids have 2.7 %, other scenes 0.3 % at most; shadow rays that ended at what is cut out, 13 %.
const MOST_OTHER_PIXELS: f64 = 0.05;

/// Rays through the centres of pixels from the first camera, relative to the scene's origin.
pub fn primary_rays(scene: &Scene, (width, height): (u32, u32)) -> Vec<ProbeRay> {
    let aspect = f64::from(width) / f64::from(height);
    let camera: Camera = match scene.cameras.first() {
        Some(camera) => camera.clone(),
        None => scene.framing_camera(aspect),
    };
    let pose = camera.world_from_camera;
    let eye = pose.translation - origin(scene);
    (0..width * height)
        .map(|pixel| {
            let x = (f64::from(pixel % width) + 0.5) / f64::from(width) * 2.0 - 1.0;
            let y = 1.0 - (f64::from(pixel / width) + 0.5) / f64::from(height) * 2.0;
            let (from, to) = match camera.projection {
                Projection::Perspective { yfov, .. } => {
                    let half = (0.5 * f64::from(yfov)).tan();
                    (DVec3::ZERO, DVec3::new(x * half * aspect, y * half, -1.0))
                }
                Projection::Orthographic { ymag, .. } => {
                    let half = f64::from(ymag);
                    (DVec3::new(x * half * aspect, y * half, 0.0), DVec3::NEG_Z)
                }
            };
            ProbeRay {
                origin: (eye + pose.matrix3 * from).as_vec3().to_array(),
                t_min: 0.0,
                direction: (pose.matrix3 * to).normalize().as_vec3().to_array(),
                t_max: 3e38,
                from: NONE,
            }
        })
        .collect()
}

/// Tile means of two pictures against their standard errors; returns the largest deviation. The samples are the same
/// on both sides, so equal pictures stay far below the bound: it is missed by a bias only.
pub fn assert_same_picture(label: &str, a: &Film, b: &Film, (width, height): (u32, u32)) -> f64 {
    let (tiles_x, tiles_y) = (width / TILE, height / TILE);
    let means = [a.mean(), b.mean()];
    let errors = [a.standard_error(), b.standard_error()];
    let brightest = means[0].iter().flatten().fold(0f32, |m, &v| m.max(v));
    assert!(brightest > 0.0, "{label}: black");
    let limit = largest_of((tiles_x * tiles_y * 3) as usize);
    let mut worst = 0f64;
    for (tile, channel) in (0..tiles_x * tiles_y).flat_map(|t| [(t, 0), (t, 1), (t, 2)]) {
        let (mut difference, mut variance, mut sum) = (0.0, 0.0, 0.0);
        for i in 0..TILE * TILE {
            let x = tile % tiles_x * TILE + i % TILE;
            let pixel = ((tile / tiles_x * TILE + i / TILE) * width + x) as usize;
            let value = |side: usize| f64::from(means[side][pixel][channel]);
            difference += value(0) - value(1);
            sum += value(0);
            for side in &errors {
                variance += f64::from(side[pixel][channel]).powi(2);
            }
        }
        // Tiles without noise may differ by rounding.
        let deviation = difference.abs() / (variance.sqrt() + 1e-5 * sum).max(f64::MIN_POSITIVE);
        assert!(
            deviation <= limit,
            "{label}, tile {tile}: {deviation} deviations"
        );
        worst = worst.max(deviation);
    }
    worst
}

/// Pictures of the same samples differ where rounding sends a path elsewhere, and are then as often brighter as
/// darker. A traversal that loses light by itself shows long before the means do. Differences below
/// `1e-4` are roundings themselves; the number of the brighter ones stays within 5 deviations of half of all, plus 8.
fn assert_even(label: &str, a: &Film, b: &Film) {
    let (mut brighter, mut darker) = (0_u32, 0_u32);
    for (a, b) in a.mean().iter().zip(b.mean()) {
        let [a, b] = [*a, b].map(|pixel| pixel.iter().map(|v| f64::from(*v)).sum::<f64>());
        if (a - b).abs() > 1e-4 * a.max(b) {
            *(if a > b { &mut brighter } else { &mut darker }) += 1;
        }
    }
    println!("{label}: {brighter} pixels are brighter, {darker} darker");
    let excess = f64::from(brighter.abs_diff(darker));
    let bound = 5.0 * f64::from(brighter + darker).sqrt() + 8.0;
    assert!(excess <= bound, "{label}: {brighter} : {darker}");
    let is_cpu = devices()
        .unwrap()
        .iter()
        .all(|d| d.name.contains("llvmpipe"));
    let most = MOST_OTHER_PIXELS * f64::from(WIDTH * HEIGHT);
    assert!(
        !is_cpu || f64::from(brighter + darker) <= most,
        "{label}: {brighter} + {darker}"
    );
}

/// One side of a comparison: what it answered, and how it numbers.
pub struct Side<'a> {
    pub hits: &'a [ProbeHit],
    pub levels: Levels,
}

/// Bounds the rays whose ids differ. These, and those whose distances differ by more than [`T_TOLERANCE`] (where
/// rounding moves a point by more: at grazing angles, or near the eye on triangles that are large), must be right on
/// both sides as far as single precision can tell.
pub fn other_ids(
    label: &str,
    scene: &Scene,
    rays: &[ProbeRay],
    [a, b]: [Side; 2],
    same: impl Fn(&ProbeHit, &ProbeHit) -> bool,
) {
    let (mut others, mut doubtful) = (0, Vec::new());
    for (i, (a, b)) in a.hits.iter().zip(b.hits).enumerate() {
        let error = f64::from((a.t - b.t).abs());
        let is_same = same(a, b);
        if !is_same || error > T_TOLERANCE * f64::from(a.t.abs()) {
            doubtful.push(i);
        }
        others += usize::from(!is_same);
    }
    for side in [a, b] {
        if doubtful.is_empty() {
            break;
        }
        let brute = Brute::new(scene, side.levels);
        for &i in &doubtful {
            if let Err(error) = check(&side.hits[i], &brute.trace(&rays[i])) {
                panic!("{label}: {:?}: {error}", rays[i]);
            }
        }
    }
    println!(
        "{label}: {others} other ids, {} checked by brute force",
        doubtful.len()
    );
    assert!(
        others as f64 <= MOST_OTHER_IDS * rays.len() as f64,
        "{label}: {others}"
    );
}

/// What the rays meet, and the picture of 16 samples with the default seed.
pub fn look(
    scene: &Scene,
    rays: &[ProbeRay],
    backend: BackendChoice,
    levels: Levels,
) -> Option<(Vec<ProbeHit>, Film)> {
    let settings = Settings {
        width: WIDTH,
        height: HEIGHT,
        samples: 0..16,
        backend,
        ..Settings::default()
    };
    let mut renderer = open(scene, &settings, levels)?;
    let hits = renderer.probe(rays).unwrap();
    let film = render(&mut renderer);
    finish(&renderer);
    Some((hits, film))
}

pub const SIZE: (u32, u32) = (WIDTH, HEIGHT);

fn files() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let mut files: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|e| e == "gltf"))
        .collect();
    files.sort();
    assert!(files.len() >= 5, "{files:?}");
    files
}

fn compare(path: &Path) -> Option<()> {
    let name = path.file_name().unwrap().to_string_lossy().into_owned();
    let scene = gltf::load(path).unwrap();
    let rays = primary_rays(&scene, PROBED);
    let mut hits = Vec::new();
    let mut films = Vec::new();
    for backend in offered() {
        let (found, film) = look(&scene, &rays, backend, Levels::Flat)?;
        hits.push(found);
        films.push(film);
    }
    let same = |a: &ProbeHit, b: &ProbeHit| {
        (a.instance, a.primitive, a.occluded) == (b.instance, b.primitive, b.occluded)
    };
    for (other, backend) in offered().iter().enumerate().skip(1) {
        let label = format!("{name}, {}", backend.name());
        let sides = [0, other].map(|i| Side {
            hits: &hits[i],
            levels: Levels::Flat,
        });
        other_ids(&label, &scene, &rays, sides, same);
        let worst = assert_same_picture(&label, &films[0], &films[other], SIZE);
        assert_even(&label, &films[0], &films[other]);
        println!("{label}: tiles differ by {worst:.2} deviations at most");
    }
    let met = hits[0].iter().filter(|hit| hit.occluded != 0).count();
    assert!(met > rays.len() / 20, "{name}: only {met} rays hit");
    Some(())
}

#[test]
fn backends_agree_on_the_scenes() {
    for path in files() {
        if compare(&path).is_none() {
            return;
        }
    }
}

/// How kernels read the scene's arrays changes no bit: by addresses, in texel buffers, small trees in uniform ones
/// (glass with nodes and records, caustic with nodes alone). The scenes have every array between them.
#[test]
fn arrays_are_read_alike_from_all_places() {
    // with the most triangles whose tree is small
    for (name, small) in [
        ("glass", Some(1362)),
        ("caustic", Some(3068)),
        ("fog", None),
        ("instances", None),
        ("lights", None),
        ("sun", None),
    ] {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{name}.gltf"));
        let scene = gltf::load(&file).unwrap();
        let held: usize = scene.meshes.iter().map(|m| m.triangles.len()).sum();
        assert!(
            small.is_none_or(|triangles| held <= triangles),
            "{name} has grown: is its tree still small?"
        );
        let levels = match name {
            "instances" => Levels::Two,
            _ => Levels::Flat,
        };
        let film = |backend, addresses, small| {
            let settings = Settings {
                width: 32,
                height: 32,
                samples: 0..8,
                ..probing(backend)
            };
            let tuning = Tuning {
                addresses: Some(addresses),
                small: Some(small),
                ..levels_tuning(levels)
            };
            let mut renderer = open_tuned(&scene, &settings, tuning)?;
            let film = render(&mut renderer);
            finish(&renderer);
            Some(film.mean())
        };
        let bvh = BackendChoice::Bvh;
        let Some(texels) = film(bvh, false, false) else {
            return;
        };
        assert!(
            film(bvh, true, false).unwrap() == texels,
            "{name}: addresses"
        );
        assert!(film(bvh, false, true).unwrap() == texels, "{name}: uniform");
        if name == "lights" {
            let query = |addresses| film(BackendChoice::RayQuery, addresses, false);
            assert!(query(true) == query(false), "{name}: ray query");
        }
    }
}
