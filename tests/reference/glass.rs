//! Interfaces against closed forms.

use std::sync::Arc;

use etendue::scene::{Environment, Material, Medium, Mesh, Scene, Volume};
use glam::{DAffine3, DVec3, Vec3};

use crate::common::*;
use crate::furnace::glass;
use crate::scattering::cuboid;
use crate::statistics::{Estimate, Z};
use crate::tracer::dielectric::fresnel;
use crate::tracer::path::Tracer;
use crate::tracer::rng::Rng;
use crate::{assert_is, traced};

/// A sky of 1 on one side of the horizon and 0 on the other; blurred within 1.5°.
fn half_sky(above: bool) -> Option<Environment> {
    let row = |y: usize| [f32::from((y < 60) == above); 3];
    Some(Environment::Map {
        width: 1,
        height: 120,
        texels: Arc::new((0..120).map(row).collect()),
        intensity: 1.0,
        rotation: 0.0,
    })
}

/// What an arrangement of layers reflects and lets through: seen obliquely from
/// above, lit from above and from below.
fn reflectance_and_transmittance(scene: &mut Scene, degrees: f64, samples: u32) -> [Estimate; 2] {
    let (sin, cos) = degrees.to_radians().sin_cos();
    // Not in the plane of an axis, so that nothing holds by symmetry alone.
    let from = 20.0 * DVec3::new(0.6 * sin, cos, 0.8 * sin);
    scene.cameras = vec![parallel(from, DVec3::ZERO, 0.1)];
    [true, false].map(|above| {
        scene.environment = half_sky(above);
        traced(scene, 4, samples, 1)[0]
    })
}

fn absorbing(ior: f32, absorption: f32, priority: i32) -> Material {
    Material {
        ior,
        volume: Some(Volume {
            medium: Medium {
                absorption: Vec3::splat(absorption),
                ..Medium::default()
            },
            priority,
        }),
        ..glass(0.0)
    }
}

/// A wide slab between two heights, fronts outside.
fn layer(low: f32, high: f32) -> Mesh {
    let mut mesh = cuboid(Vec3::new(5e3, 0.5 * (high - low), 5e3));
    for p in &mut mesh.positions {
        p.y += 0.5 * (low + high);
    }
    mesh
}

/// R = r + r(1 − r)²τ²/(1 − r²τ²), T = (1 − r)²τ/(1 − r²τ²), τ = e^{−αd/cos i₁}: n = 1.5, αd = 1/2.
#[test]
fn slab_reflects_and_transmits_as_airy_without_interference() {
    for (degrees, r, t) in [
        (0.0, 0.053_569, 0.559_308),
        (30.0, 0.054_738, 0.540_883),
        (60.0, 0.110_978, 0.450_739),
        (80.0, 0.427_916, 0.201_250),
    ] {
        let mut scene = empty();
        add(&mut scene, layer(-1.0, 0.0), absorbing(1.5, 0.5, 0));
        let [up, down] = reflectance_and_transmittance(&mut scene, degrees, 25_000);
        assert_is(&format!("R at {degrees}°"), up, r, 6e-3);
        assert_is(&format!("T at {degrees}°"), down, t, 6e-3);
    }
}

/// R and T of layers at normal incidence without interference: interfaces and absorption added up.
fn stack(layers: &[(f64, f64)]) -> [f64; 2] {
    let mut from = 1.0;
    // Reflectance from above and from below, and transmittance, of all so far.
    let (mut above, mut below, mut through) = (0.0, 0.0, 1.0);
    let mut add = |r: f64, t: f64| {
        let between = 1.0 / (1.0 - below * r);
        above += through * through * r * between;
        below = r + t * t * below * between;
        through *= t * between;
    };
    for &(index, depth) in layers.iter().chain(&[(1.0, 0.0)]) {
        let r = ((index - from) / (index + from)).powi(2);
        add(r, 1.0 - r);
        add(0.0, f64::exp(-depth));
        from = index;
    }
    [above, through]
}

/// Two slabs overlap: the one with the higher priority keeps its place, and the
/// boundary of the other inside it is not there.
#[test]
fn overlapping_solids_follow_their_priority() {
    for (what, glass_priority, water_priority, glass_depth) in [
        ("glass first", 1, 0, 1.0),
        ("water first", 0, 1, 0.5),
        // The smaller body counts: the glass.
        ("equal", 0, 0, 1.0),
    ] {
        let mut scene = empty();
        add(
            &mut scene,
            layer(-1.0, 0.0),
            absorbing(1.8, 0.5, glass_priority),
        );
        add(
            &mut scene,
            layer(-2.0, -0.5),
            absorbing(1.3, 0.2, water_priority),
        );
        let depths = [
            (f64::from(1.8_f32), 0.5 * glass_depth),
            (f64::from(1.3_f32), 0.2 * (2.0 - glass_depth)),
        ];
        let truth = stack(&depths);
        let seen = reflectance_and_transmittance(&mut scene, 0.0, 25_000);
        assert_is(&format!("{what}, R"), seen[0], truth[0], 5e-3);
        assert_is(&format!("{what}, T"), seen[1], truth[1], 6e-3);
    }
}

/// R = 2r/(1 + r), T = (1 − r)/(1 + r) times the tint: n = 1.5, r = 0.089 186 71 at 60°.
#[test]
fn sheet_adds_the_reflections_of_both_faces() {
    let mut scene = empty();
    let sheet = Material {
        base_color: Vec3::splat(0.7).extend(1.0),
        volume: None,
        ..glass(0.0)
    };
    add(&mut scene, square(Vec3::ZERO, Vec3::Y, 1e3), sheet);
    let [up, down] = reflectance_and_transmittance(&mut scene, 60.0, 25_000);
    let r = 0.089_186_71;
    assert_is("R", up, 2.0 * r / (1.0 + r), 5e-3);
    assert_is("T", down, 0.7 * (1.0 - r) / (1.0 + r), 6e-3);
}

/// From the middle of a glass cube a white sky has radiance n² where it is seen
/// at all: a direction is trapped for ever if it meets no face below the critical angle.
#[test]
fn cube_shows_its_camera_n_squared_or_nothing() {
    let mut scene = empty();
    add(&mut scene, cuboid(Vec3::ONE), glass(0.0));
    scene.environment = constant_sky(1.0);
    let tracer = Tracer::new(&scene);
    let critical = (1.0 - 1.0 / 2.25_f64).sqrt();
    let mut rng = Rng::new(&[7]);
    let (mut trapped, count) = (0, 1000);
    for _ in 0..count {
        let d = rng.direction();
        let p = DVec3::new(0.01, 0.02, 0.03);
        let value = tracer.radiance(p, d, tracer.around(p), 0, &mut rng);
        let escapes = d.abs().max_element() > critical;
        match value {
            Some(value) => assert!(escapes && (value - 2.25).abs() < 1e-9, "{d}: {value}"),
            None => {
                assert!(!escapes, "{d} is not trapped");
                trapped += 1;
            }
        }
    }
    // 1 − 3 (1 − √(1 − 1/n²)) = 0.236 07.
    let fraction = f64::from(trapped) / f64::from(count);
    println!("trapped: {fraction}");
    let error = (0.236_07_f64 * 0.763_93 / f64::from(count)).sqrt();
    assert!((fraction - 0.236_07).abs() < Z * error);
}

/// L = r + (1 − r)²τ/(1 − rτ), τ = e^{−αc}, at impact parameter 0.3: n = 1.5, α = 0.7.
/// Facets deviate in the second order of their size: four times less after each split.
#[test]
fn absorbing_ball_converges_to_the_closed_form() {
    for (levels, delta) in [(4, 8e-3), (6, 3e-3)] {
        let mut scene = empty();
        add(&mut scene, faceted(sphere(levels)), absorbing(1.5, 0.7, 0));
        scene.environment = constant_sky(1.0);
        // A strip at the same impact parameter all round would be a ring; take spots of it.
        let at = |phi: f64| 0.3 * DVec3::new(phi.cos(), phi.sin(), 0.0);
        let spots = [0.2, 1.3, 2.9, 4.4].map(|phi| {
            let p = at(phi);
            scene.cameras = vec![parallel(p + DVec3::Z * 4.0, p, 0.02)];
            traced(&scene, 4, 10_000, 1)[0]
        });
        let mean = Estimate::of_pixels(spots.iter().map(|s| (s.mean, s.error)));
        assert_is(&format!("{levels} splits"), mean, 0.276_266, delta);
    }
}

#[test]
fn fresnel_agrees_with_tables_and_with_itself() {
    for (degrees, r) in [
        (0.0_f64, 0.04),
        (30.0, 0.041_522_63),
        (45.0, 0.050_239_91),
        (60.0, 0.089_186_71),
        (80.0, 0.387_704_35),
    ] {
        let cosine = degrees.to_radians().cos();
        let (outside, beyond) = fresnel(cosine, 1.5);
        assert!((outside - r).abs() < 1e-8, "{degrees}°: {outside}");
        let (inside, back) = fresnel(beyond, 1.0 / 1.5);
        assert!((inside - outside).abs() < 1e-12 && (back - cosine).abs() < 1e-12);
    }
    assert_eq!(fresnel(0.5, 1.0 / 1.5), (1.0, 0.0));
    // Hemispherical means: 0.091 778 0 outside, 0.596 345 8 inside.
    let mean = |eta: f64| {
        let n = 200_000;
        let at = |i: u32| (f64::from(i) + 0.5) / f64::from(n);
        (0..n)
            .map(|i| 2.0 * at(i) * fresnel(at(i), eta).0 / f64::from(n))
            .sum::<f64>()
    };
    assert!((mean(1.5) - 0.091_778_0).abs() < 1e-6);
    assert!((mean(1.0 / 1.5) - 0.596_345_8).abs() < 1e-6);
}

/// A solid behind a mirrored placement, and one that is scaled: crossing parity and normals hold.
#[test]
fn placed_solids_are_closed() {
    let mut scene = empty();
    let place = DAffine3::from_scale(DVec3::new(-5e3, 0.5, 5e3));
    add_at(&mut scene, cuboid(Vec3::ONE), absorbing(1.5, 0.5, 0), place);
    let [up, down] = reflectance_and_transmittance(&mut scene, 60.0, 25_000);
    assert_is("R", up, 0.110_978, 5e-3);
    assert_is("T", down, 0.450_739, 6e-3);
}

/// A lamp within glass emits its radiance there: outside it is L (1 − r)/n².
#[test]
fn lamp_within_glass_is_dimmer_outside() {
    let mut scene = empty();
    add(&mut scene, layer(-2.0, 0.0), glass(0.0));
    let lamp = square(-Vec3::Y, Vec3::Y, 1e3);
    add(&mut scene, lamp, emitter(0.0, 3.0));
    scene.cameras = vec![parallel(DVec3::Y * 4.0, DVec3::ZERO, 0.1)];
    let mean = traced(&scene, 4, 40_000, 1)[0];
    assert_is("lamp", mean, 3.0 * 0.96 / 2.25, 5e-3);
}
