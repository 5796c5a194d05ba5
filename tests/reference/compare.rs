//! The renderer beside the reference: image and tile means of every channel.

use etendue::render::Tuning;
use etendue::scene::Scene;
use etendue::settings::{BackendChoice, Settings};

use crate::Z;
use crate::common::{render, settings};
use crate::tracer::{Picture, Plan, picture};

/// Both render frames of so many pixels a side …
const SIDE: usize = 16;
/// … which are cut into tiles of so many.
const TILE: usize = 8;

/// Effort and demand of a comparison.
pub struct Comparison {
    /// Samples a pixel of the reference.
    pub reference: u32,
    /// Samples a pixel of the renderer.
    pub renderer: u64,
    /// Relative difference of image means that is allowed, chance included.
    pub image: f64,
    /// The same for a tile.
    pub tile: f64,
    /// 1 for a scene without colours, else 3.
    pub channels: usize,
    /// The renderer's traversals.
    pub backends: &'static [BackendChoice],
}

impl Default for Comparison {
    fn default() -> Self {
        Self {
            reference: 4096,
            renderer: 4096,
            image: 1e-2,
            tile: 2e-2,
            channels: 1,
            backends: &[BackendChoice::Bvh],
        }
    }
}

/// Mean and squared standard error of a channel over pixels.
fn average(p: &Picture, pixels: &[usize], channel: usize) -> (f64, f64) {
    let n = pixels.len() as f64;
    let mean = pixels.iter().map(|&i| p.mean[i][channel]).sum::<f64>() / n;
    let variance = pixels.iter().map(|&i| p.variance[i][channel]).sum::<f64>();
    (mean, variance / (n * n))
}

/// Names and pixels of the image and of its tiles.
fn regions() -> Vec<(String, Vec<usize>)> {
    let mut regions = vec![(String::from("image"), (0..SIDE * SIDE).collect())];
    for (y, x) in (0..SIDE / TILE).flat_map(|y| (0..SIDE / TILE).map(move |x| (y, x))) {
        let pixels = (0..TILE * TILE)
            .map(|i| (y * TILE + i / TILE) * SIDE + x * TILE + i % TILE)
            .collect();
        regions.push((format!("tile ({x}, {y})"), pixels));
    }
    regions
}

/// The renderer's picture in the form of the reference's.
fn rendered(scene: &Scene, settings: &Settings) -> Option<Picture> {
    let film = render(scene, settings, Tuning::default())?.film;
    let wide = |values: Vec<[f32; 3]>| values.into_iter().map(|v| v.map(f64::from));
    Some(Picture {
        mean: wide(film.mean()).collect(),
        variance: wide(film.standard_error())
            .map(|v| v.map(|e| e * e))
            .collect(),
        given_up: 0,
    })
}

/// Renders both ways and asserts that the means are equivalent: their difference
/// plus [`Z`] standard errors (Welch) stays within the bounds.
pub fn agree(what: &str, scene: &Scene, c: &Comparison) {
    let plan = Plan {
        side: SIDE as u32,
        samples: c.reference,
        seed: 1,
        channels: c.channels,
    };
    let reference = picture(scene, &plan);
    assert_eq!(reference.given_up, 0, "{what}: paths were given up");
    let mut failures = Vec::new();
    for &backend in c.backends {
        let settings = Settings {
            backend,
            ..settings(SIDE as u32, c.renderer)
        };
        let Some(ours) = rendered(scene, &settings) else {
            continue;
        };
        for (region, pixels) in regions() {
            let delta = if region == "image" { c.image } else { c.tile };
            for channel in 0..c.channels {
                let (theirs, their_square) = average(&reference, &pixels, channel);
                let (ours, our_square) = average(&ours, &pixels, channel);
                let difference = ours - theirs;
                let error = (their_square + our_square).sqrt();
                let line = format!(
                    "{what}, {backend:?}, {region}, channel {channel}: {ours:.6} ± {:.1e}, reference \
                     {theirs:.6} ± {:.1e}: {:+.2} % ± {:.2} %, z {:+.1}, allowed {:.1} %",
                    our_square.sqrt(),
                    their_square.sqrt(),
                    100.0 * difference / theirs,
                    100.0 * Z * error / theirs,
                    difference / error,
                    100.0 * delta,
                );
                println!("{line}");
                // The same where both are black.
                if difference.abs() + Z * error > delta * theirs {
                    failures.push(line);
                }
            }
        }
    }
    assert!(failures.is_empty(), "\n{}", failures.join("\n"));
}
