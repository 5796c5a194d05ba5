//! Solids that lose nothing change nothing in a white world, with and without
//! scattering inside; an absorbing ball converges to its closed form.

use std::sync::Arc;

use etendue::render::Tuning;
use etendue::scene::{Environment, Material, Medium, Mesh, Phase, Scene};
use etendue::settings::{Settings, Strategy};
use glam::{DVec3, Vec3};

use crate::common::backends::pair;
use crate::common::*;
use crate::tier::{bound, count};
use crate::{block, channel_mean, fresnel, glass, grey, sheet};

/// A mesh of `material` in a white world, seen whole.
fn in_white(mesh: Mesh, material: Material) -> Scene {
    let mut scene = empty();
    add(&mut scene, mesh, material);
    scene.environment = constant_sky(1.0);
    scene.cameras = vec![pinhole(DVec3::new(1.5, 1.0, 3.0), DVec3::ZERO, 40.0)];
    scene
}

/// Every pixel is 1 within `delta`, chance included.
fn assert_white(what: &str, scene: &Scene, settings: &Settings, delta: f64) {
    let Some(r) = render(scene, settings, Tuning::default()) else {
        return;
    };
    let seen = channel_mean(&r.film, 0);
    println!("{what}: {:.6} ± {:.1e}", seen.mean, seen.chance());
    assert!(seen.is_within(1.0, delta), "{what}: {seen:?} instead of 1");
}

#[test]
fn lossless_solids_are_invisible_in_a_white_world() {
    let clear = Medium::default();
    let half = Vec3::splat(0.8);
    for backend in pair() {
        let settings = Settings {
            backend,
            ..settings(32, 64)
        };
        for ior in [1.0, 1.0 + 1e-6, 1.33, 1.5, 2.4, 1e6, 0.0] {
            let scene = in_white(block(-half, half), glass(ior, clear));
            assert_white(
                &format!("{backend:?}, cube, n {ior}"),
                &scene,
                &settings,
                1e-5,
            );
        }
        let scene = in_white(faceted(sphere(3)), glass(1.5, clear));
        assert_white(
            &format!("{backend:?}, faceted ball"),
            &scene,
            &settings,
            1e-4,
        );
        // Shading normals are not those of the surface: a little light is trapped, and rare paths carry it.
        let scene = in_white(sphere(3), glass(1.5, clear));
        let many = Settings {
            samples: 0..1024,
            ..settings.clone()
        };
        assert_white(&format!("{backend:?}, ball"), &scene, &many, 2e-3);
        let scene = in_white(square(Vec3::ZERO, Vec3::Z, 1.0), sheet(1.5));
        assert_white(&format!("{backend:?}, sheet"), &scene, &settings, 1e-5);
    }
}

#[test]
fn white_media_are_invisible_in_a_white_world() {
    let half = Vec3::splat(0.5);
    let phases = [
        Phase::Isotropic,
        Phase::Rayleigh,
        Phase::HenyeyGreenstein { g: 0.7 },
    ];
    for (phase, tau) in phases.into_iter().zip([1.0, 10.0, 100.0]) {
        let shares = if tau > 10.0 { [1.0, 1.0] } else { [0.7, 0.4] };
        for ior in [1.0, 1.5] {
            let medium = Medium {
                // Chromatic: the channels share one distance.
                scattering: Vec3::new(1.0, shares[0], shares[1]) * tau,
                ..grey(0.0, 0.0, phase)
            };
            let scene = in_white(block(-half, half), glass(ior, medium));
            let what = format!("τ {tau}, {phase:?}, n {ior}");
            assert_white(
                &what,
                &scene,
                &settings(24, count(128, 16_384)),
                bound(1e-2, 1e-3),
            );
        }
    }
}

/// Mean over the view of the radiance of an absorbing ball of radius 1 and index n in a white
/// world, seen by parallel rays within 0.7 of its centre.
fn ball(n: f64, alpha: f64) -> f64 {
    let count = 400;
    let at = |i: usize| 0.7 * ((i as f64 + 0.5) / f64::from(count) * 2.0 - 1.0);
    let value = |b2: f64| {
        let cos_i = (1.0 - b2).sqrt();
        let cos_t = (1.0 - b2 / (n * n)).sqrt();
        let r = fresnel(cos_i, n);
        let tau = (-2.0 * alpha * cos_t).exp();
        r + (1.0 - r).powi(2) * tau / (1.0 - r * tau)
    };
    let mut sum = 0.0;
    for i in 0..count as usize {
        for j in 0..count as usize {
            sum += value(at(i).powi(2) + at(j).powi(2));
        }
    }
    sum / f64::from(count * count)
}

#[test]
fn absorbing_ball_converges_to_its_closed_form() {
    let truth = ball(1.5, 0.7);
    let mut offs = Vec::new();
    for levels in [2, 3, 4] {
        let mut scene = in_white(
            faceted(sphere(levels)),
            glass(1.5, grey(0.7, 0.0, Phase::Isotropic)),
        );
        scene.cameras = vec![parallel(DVec3::new(0.3, 0.4, 5.0), DVec3::ZERO, 0.7)];
        let settings = Settings {
            strategy: Strategy::BsdfOnly,
            ..settings(32, 2048)
        };
        let Some(r) = render(&scene, &settings, Tuning::default()) else {
            return;
        };
        let seen = channel_mean(&r.film, 0);
        let (mean, (off, bound)) = (seen.mean, seen.off(truth));
        println!("{levels} levels: {mean:.6}, truth {truth:.6}, off {off:.1e} ± {bound:.1e}");
        offs.push(off);
    }
    // Flat facets err in proportion to their size or better: halving it halves the error.
    assert!(
        offs[2] < 0.5 * offs[1] && offs[1] < 0.5 * offs[0],
        "{offs:?}"
    );
}

/// The same where the white world is a map, which direct light samples as well: both ways
/// of finding it share the work, however the phase function differs from the map's density.
#[test]
fn white_fog_is_invisible_in_a_white_map() {
    let half = Vec3::splat(0.5);
    let fog = grey(0.0, 2.0, Phase::HenyeyGreenstein { g: 0.7 });
    let mut scene = in_white(block(-half, half), glass(1.0, fog));
    scene.environment = Some(Environment::Map {
        width: 4,
        height: 2,
        texels: Arc::new(vec![[1.0; 3]; 8]),
        intensity: 1.0,
        rotation: 0.0,
    });
    assert_white("fog in a map", &scene, &settings(24, 512), 1e-2);
}
