//! Scattering layers whose answers are known: thin ones scatter once, and the
//! half space is Chandrasekhar's.

use etendue::render::Tuning;
use etendue::scene::{LightKind, Phase, PunctualLight};
use etendue::settings::Settings;
use glam::{DVec3, Vec3};

use crate::common::backends::pair;
use crate::common::*;
use crate::tier::{bound, count};
use crate::{assert_channels, block, channel_mean, glass, grey, oblique, samples_for};

/// A layer below z = 0 without an index of refraction, wide enough to be infinite.
fn layer(thickness: f32) -> etendue::scene::Mesh {
    block(
        Vec3::new(-200.0, -200.0, -thickness),
        Vec3::new(200.0, 200.0, 0.0),
    )
}

/// L = ϖ p(Θ) E μ₀/(μ₀ + μ) (1 − e^{−τ(1/μ₀ + 1/μ)}) for sunlight that is scattered once
/// back out of a layer. [Chandrasekhar60] §III
#[test]
fn thin_layer_scatters_sunlight_once() {
    let (degrees_sun, degrees_eye) = (40.0f64, 60.0f64);
    let (mu_sun, mu_eye) = (
        degrees_sun.to_radians().cos(),
        degrees_eye.to_radians().cos(),
    );
    let to_sun = DVec3::new(-degrees_sun.to_radians().sin(), 0.0, mu_sun);
    let to_eye = DVec3::new(degrees_eye.to_radians().sin(), 0.0, mu_eye);
    let cosine = -to_sun.dot(to_eye);
    for (phase, p) in [
        (Phase::Isotropic, 1.0),
        (Phase::Rayleigh, 0.75 * (1.0 + cosine * cosine)),
    ] {
        for backend in pair() {
            let mut scene = empty();
            // τ = 0.1 over 0.5 m, ϖ = 0.8.
            add(&mut scene, layer(0.5), glass(1.0, grey(0.04, 0.16, phase)));
            scene.lights = vec![PunctualLight {
                name: String::from("sun"),
                kind: LightKind::Directional,
                position: DVec3::ZERO,
                direction: -to_sun.as_vec3(),
                intensity: Vec3::splat(5.0),
            }];
            scene.cameras = vec![oblique(degrees_eye, 0.05)];
            let settings = Settings {
                max_depth: 1,
                backend,
                ..settings(32, count(1024, 16_384))
            };
            let Some(r) = render(&scene, &settings, Tuning::default()) else {
                return;
            };
            let p = p / (4.0 * std::f64::consts::PI);
            let thickness = 0.1 * (1.0 / mu_sun + 1.0 / mu_eye);
            let truth = 0.8 * p * 5.0 * mu_sun / (mu_sun + mu_eye) * (1.0 - (-thickness).exp());
            let what = format!("{backend:?}, {phase:?}");
            assert_channels(&what, &r.film, [truth; 3], bound(5e-3, 1e-3));
        }
    }
}

/// Chandrasekhar's H function for isotropic scattering of albedo `w`, by iteration. [Chandrasekhar60] §V
fn h_function(w: f64, mu: f64) -> f64 {
    const COUNT: usize = 400;
    let node = |i: usize| (i as f64 + 0.5) / COUNT as f64;
    let mut h = vec![1.0; COUNT];
    let inverse = |h: &[f64], mu: f64| {
        let sum: f64 = (0..COUNT).map(|i| node(i) * h[i] / (mu + node(i))).sum();
        (1.0 - w).sqrt() + 0.5 * w * sum / COUNT as f64
    };
    for _ in 0..500 {
        h = (0..COUNT).map(|i| 1.0 / inverse(&h, node(i))).collect();
    }
    1.0 / inverse(&h, mu)
}

/// Under a white sky the half space shows 1 − √(1 − ϖ) H(μ).
#[test]
fn half_space_is_chandrasekhars() {
    for (albedo, degrees, gate) in [
        (0.5f64, 0.0f64, 2e-3f64),
        (0.9, 60.0, 2e-3),
        (0.99, 0.0, 4e-3),
    ] {
        let delta = bound(gate, 1e-3);
        let mut scene = empty();
        let medium = grey(1.0 - albedo as f32, albedo as f32, Phase::Isotropic);
        add(&mut scene, layer(200.0), glass(1.0, medium));
        scene.environment = constant_sky(1.0);
        scene.cameras = vec![oblique(degrees, 0.5)];
        let truth = 1.0 - (1.0 - albedo).sqrt() * h_function(albedo, degrees.to_radians().cos());
        let paths = truth * (1.0 - truth) * (8.4 / delta).powi(2);
        let settings = settings(32, samples_for(paths / 1024.0 / count(2, 1) as f64));
        let Some(r) = render(&scene, &settings, Tuning::default()) else {
            return;
        };
        let seen = channel_mean(&r.film, 0);
        let (mean, off, bound) = (seen.mean, (seen.mean - truth).abs(), seen.chance());
        println!(
            "ϖ {albedo}, {degrees}°: {mean:.6}, truth {truth:.6}, off {off:.1e} ± {bound:.1e}"
        );
        assert!(
            off + bound <= delta,
            "ϖ {albedo}: {mean} instead of {truth}"
        );
    }
}
