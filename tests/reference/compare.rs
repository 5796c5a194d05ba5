//! The renderer beside the reference: image and tile means of every channel.

use etendue::render::Tuning;
use etendue::scene::Scene;
use etendue::settings::{BackendChoice, Settings};

use crate::common::{render, settings};
use crate::statistics::{Estimate, regions};
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
    pub backends: Vec<BackendChoice>,
}

impl Default for Comparison {
    fn default() -> Self {
        Self {
            reference: 4096,
            renderer: 4096,
            image: 1e-2,
            tile: 2e-2,
            channels: 1,
            backends: vec![BackendChoice::Bvh],
        }
    }
}

/// Mean of a channel over pixels.
fn average(p: &Picture, pixels: &[usize], channel: usize) -> Estimate {
    let of = |&i: &usize| (p.mean[i][channel], p.variance[i][channel].sqrt());
    Estimate::of_pixels(pixels.iter().map(of))
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
/// plus [`crate::statistics::Z`] standard errors (Welch) stays within the bounds.
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
    for &backend in &c.backends {
        let settings = Settings {
            backend,
            ..settings(SIDE as u32, c.renderer)
        };
        let Some(ours) = rendered(scene, &settings) else {
            continue;
        };
        for (region, pixels) in regions(SIDE, TILE) {
            let delta = if region == "image" { c.image } else { c.tile };
            for channel in 0..c.channels {
                let theirs = average(&reference, &pixels, channel);
                let ours = average(&ours, &pixels, channel);
                let difference = ours.minus(theirs);
                let line = format!(
                    "{what}, {backend:?}, {region}, channel {channel}: {:.6} ± {:.1e}, reference \
                     {:.6} ± {:.1e}: {:+.2} % ± {:.2} %, z {:+.1}, allowed {:.1} %",
                    ours.mean,
                    ours.error,
                    theirs.mean,
                    theirs.error,
                    100.0 * difference.mean / theirs.mean,
                    100.0 * difference.chance() / theirs.mean,
                    difference.mean / difference.error,
                    100.0 * delta,
                );
                println!("{line}");
                // The same where both are black.
                if !difference.is_within(0.0, delta * theirs.mean) {
                    failures.push(line);
                }
            }
        }
    }
    assert!(failures.is_empty(), "\n{}", failures.join("\n"));
}
