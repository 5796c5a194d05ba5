//! Absorption and scattering against closed forms.

use etendue::scene::{Material, Medium, Phase, Scene, Volume};
use glam::{DVec3, Vec3};

use crate::common::*;
use crate::statistics::Estimate;
use crate::tracer::medium::deflect;
use crate::tracer::rng::Rng;
use crate::{assert_is, traced};

/// A boundary that does nothing but hold a medium.
pub fn matched(medium: Medium) -> Material {
    Material {
        name: String::from("matched"),
        metallic: 0.0,
        roughness: 0.0,
        ior: 1.0,
        transmission: 1.0,
        volume: Some(Volume {
            medium,
            priority: 0,
        }),
        ..Material::default()
    }
}

/// The box −half … half in each direction, with its fronts outside.
pub fn cuboid(half: Vec3) -> etendue::scene::Mesh {
    let mut mesh = room(1.0);
    for p in &mut mesh.positions {
        *p *= half;
    }
    for t in &mut mesh.triangles {
        t.swap(1, 2);
    }
    mesh
}

/// E[μ^k] of both phase functions: Rayleigh's are 2/5 and 9/35, Henyey and
/// Greenstein's Legendre moments are g^k, so E[μ] = g and E[μ²] = (1 + 2g²)/3.
#[test]
fn moments_of_phase_functions() {
    let axis = DVec3::new(0.48, -0.6, 0.64);
    let moment = |phase, power, seed| {
        let mut rng = Rng::new(&[seed]);
        let cosines: Vec<f64> = (0..1_000_000)
            .map(|_| deflect(phase, axis, &mut rng).dot(axis).powi(power))
            .collect();
        Estimate::of(cosines.into_iter())
    };
    for (power, truth) in [(1, 0.0), (2, 1.0 / 3.0), (4, 0.2)] {
        assert_is("isotropic", moment(Phase::Isotropic, power, 1), truth, 5e-3);
    }
    for (power, truth) in [(1, 0.0), (2, 0.4), (4, 9.0 / 35.0)] {
        assert_is("Rayleigh", moment(Phase::Rayleigh, power, 2), truth, 5e-3);
    }
    for g in [-0.6_f32, 0.0, 0.3, 0.9] {
        let phase = Phase::HenyeyGreenstein { g };
        let g = f64::from(g);
        assert_is("HG, first", moment(phase, 1, 3), g, 5e-3);
        assert_is(
            "HG, second",
            moment(phase, 2, 4),
            (1.0 + 2.0 * g * g) / 3.0,
            5e-3,
        );
    }
}

/// A slab 2 m thick across the view, in front of a sky of 1, seen at an angle with cosine `mu`.
fn slab(material: Material, mu: f64) -> Scene {
    let mut scene = empty();
    add(&mut scene, cuboid(Vec3::new(1e4, 1.0, 1e4)), material);
    scene.environment = constant_sky(1.0);
    let from = 10.0 * DVec3::new((1.0 - mu * mu).sqrt(), mu, 0.0);
    scene.cameras = vec![parallel(from, DVec3::ZERO, 0.1)];
    scene
}

/// e^{−σd}, for each channel by its own coefficient.
#[test]
fn absorbing_slab_follows_beer_and_lambert() {
    let absorption = Vec3::new(0.0, 0.2, 1.0);
    let medium = Medium {
        absorption,
        ..Medium::default()
    };
    let means = traced(&slab(matched(medium), 0.6), 4, 40_000, 3);
    for (channel, mean) in means.into_iter().enumerate() {
        let truth = (-f64::from(absorption[channel]) * 2.0 / 0.6).exp();
        assert_is(&format!("σ {}", absorption[channel]), mean, truth, 5e-3);
    }
}

/// Without absorption a cloud in uniform light vanishes, whatever its phase function.
#[test]
fn white_clouds_vanish() {
    for phase in [
        Phase::Isotropic,
        Phase::Rayleigh,
        Phase::HenyeyGreenstein { g: 0.7 },
    ] {
        let mut scene = empty();
        let medium = Medium {
            scattering: Vec3::new(0.5, 3.0, 20.0),
            phase,
            ..Medium::default()
        };
        add(&mut scene, faceted(sphere(2)), matched(medium));
        scene.environment = constant_sky(1.0);
        scene.cameras = vec![pinhole(DVec3::Z * 4.0, DVec3::ZERO, 30.0)];
        for mean in traced(&scene, 4, 256, 3) {
            assert_is("cloud", mean, 1.0, 1e-12);
        }
    }
}

/// Plane albedo of a half-space that scatters isotropically: 1 − √(1 − ϖ) H(μ).
#[test]
fn half_space_has_chandrasekhars_albedo() {
    let medium = Medium {
        absorption: Vec3::splat(3.0),
        scattering: Vec3::splat(27.0),
        phase: Phase::Isotropic,
    };
    // ϖ = 0.9, μ = 1/2: H = 1.5560.
    let mean = traced(&slab(matched(medium), 0.5), 4, 40_000, 1)[0];
    assert_is("albedo", mean, 0.507_94, 5e-3);
}

/// The exterior medium dims a lamp: L e^{−σd}.
#[test]
fn absorbing_air_dims_a_wall() {
    let mut scene = empty();
    add(
        &mut scene,
        square(Vec3::ZERO, Vec3::Z, 1.0),
        emitter(0.0, 5.0),
    );
    scene.medium = Some(Medium {
        absorption: Vec3::splat(0.3),
        ..Medium::default()
    });
    scene.cameras = vec![parallel(DVec3::Z * 4.0, DVec3::ZERO, 0.5)];
    let mean = traced(&scene, 4, 40_000, 1)[0];
    assert_is("wall", mean, 5.0 * (-1.2_f64).exp(), 2e-2);
}
