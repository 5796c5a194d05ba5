//! White surfaces in uniform light: they vanish.

use etendue::render::Tuning;
use etendue::scene::Scene;
use etendue::settings::Settings;
use glam::DVec3;

use crate::common::backends::pair;
use crate::common::*;
use crate::largest_deviation;
use crate::statistics::Estimate;

/// A white Lambert sphere under a sky of 1, seen whole and at its rim.
fn white_sphere() -> [(&'static str, Scene); 2] {
    let mut scene = empty();
    add(&mut scene, faceted(sphere(3)), lambert(1.0));
    scene.environment = constant_sky(1.0);
    let mut grazing = scene.clone();
    let from = DVec3::new(0.3, 0.5, 4.0);
    scene.cameras = vec![pinhole(from, DVec3::ZERO, 30.0)];
    grazing.cameras = vec![parallel(
        DVec3::new(0.995, 0.0, 4.0),
        DVec3::X * 0.995,
        0.01,
    )];
    [("whole", scene), ("rim", grazing)]
}

#[test]
fn lambert_sphere_vanishes_in_the_furnace() {
    for (view, scene) in white_sphere() {
        for (scale, offset) in [(1.0, 0.0), (1e-6, 0.0), (1e6, 0.0), (1.0, 1e6)] {
            let scene = carried(
                scene.clone(),
                scale,
                DVec3::new(offset, -offset, 0.5 * offset),
            );
            for backend in pair() {
                let settings = Settings {
                    backend,
                    aovs: true,
                    ..settings(16, 16)
                };
                let Some(r) = render(&scene, &settings, Tuning::default()) else {
                    continue;
                };
                let off = largest_deviation(&r.film, 1.0);
                let seen: f32 = r.film.coverage().unwrap().iter().sum();
                println!("{view}, × {scale}, + {offset}, {backend:?}: off {off:.1e}");
                assert!(seen > 40.0, "the sphere is not in view");
                // A path is 1 to the bit. One that met the body that it left would be as well: traversal::furnace finds those.
                assert!(
                    off <= 1e-6,
                    "{view}, × {scale}, + {offset}, {backend:?}: {off}"
                );
            }
        }
    }
}

/// Single scattering loses what bounces twice between facets; it never gains.
#[test]
fn white_metal_never_gains_and_a_mirror_loses_nothing() {
    for roughness in [0.0, 0.1, 0.3, 0.6, 1.0] {
        let mut scene = empty();
        add(&mut scene, faceted(sphere(3)), metal(1.0, roughness));
        scene.environment = constant_sky(1.0);
        let from = DVec3::new(0.3, 0.5, 4.0);
        scene.cameras = vec![pinhole(from, DVec3::ZERO, 30.0)];
        let Some(r) = render(&scene, &settings(16, 256), Tuning::default()) else {
            return;
        };
        let Estimate { mean, error, .. } = Estimate::of_image(&r.film);
        println!("roughness {roughness}: {mean:.6} ± {error:.1e}");
        if roughness == 0.0 {
            // F = F0 = 1 and the lobe is chosen with certainty: roundings only.
            assert!(largest_deviation(&r.film, 1.0) <= 1e-5);
        } else {
            // Every weight is a masking factor, at most 1 to rounding: no noise above 1.
            assert!(mean <= 1.0 + 1e-4, "{mean}");
            // Heitz's masking keeps more than half even at roughness 1.
            assert!(mean > 0.5, "{mean}");
        }
    }
}
