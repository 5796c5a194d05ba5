//! Lights without extent over a Lambert plane: one sample tells the answer.

use std::f64::consts::PI;

use etendue::render::Tuning;
use etendue::scene::{LightKind, PunctualLight, Scene};
use glam::{DVec3, Vec3};

use crate::common::*;
use crate::largest_deviation;

const ALBEDO: f64 = 0.6;
const INTENSITY: f64 = 5.0;
/// Directions, positions and the square root round a few times each.
const TOLERANCE: f64 = 1e-5;
/// Half the height of the view, metres: the light is the same all over it to
/// 1e-7 at the distance of 0.1 m.
const HALF_VIEW: f64 = 1e-9;

/// The plane z = 0, seen where it meets the axis.
fn plane(light: PunctualLight) -> Scene {
    let mut scene = empty();
    add(
        &mut scene,
        square(Vec3::ZERO, Vec3::Z, 1.0),
        lambert(ALBEDO as f32),
    );
    scene.lights = vec![light];
    scene.cameras = vec![parallel(DVec3::new(0.2, 0.1, 3.0), DVec3::ZERO, HALF_VIEW)];
    scene
}

/// A light at `position` that shines along `direction`.
fn light(kind: LightKind, position: DVec3, direction: DVec3) -> PunctualLight {
    PunctualLight {
        name: String::from("light"),
        kind,
        position,
        direction: direction.normalize().as_vec3(),
        intensity: Vec3::splat(INTENSITY as f32),
    }
}

/// Unit vector `degrees` from the plane's normal.
fn towards(degrees: f64) -> DVec3 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    DVec3::new(sin * 0.8, sin * 0.6, cos)
}

/// Whether the view shows `truth`; false without a device.
fn shows(what: &str, scene: &Scene, truth: f64) -> bool {
    let Some(r) = render(scene, &settings(4, 2), Tuning::default()) else {
        return false;
    };
    if truth == 0.0 {
        assert!(
            r.film.mean().iter().flatten().all(|v| *v == 0.0),
            "{what}: light"
        );
    } else {
        let off = largest_deviation(&r.film, truth);
        assert!(off <= TOLERANCE, "{what}: off by {off:.1e}");
    }
    true
}

#[test]
fn point_light_obeys_the_inverse_square_and_the_cosine() {
    // The law is a product: each distance and each angle, the extremes together.
    for (distance, degrees) in [
        (0.1, 0.0),
        (0.1, 89.0),
        (1.0, 30.0),
        (1.0, 80.0),
        (10.0, 60.0),
        (100.0, 30.0),
        (1000.0, 0.0),
        (1000.0, 89.0),
    ] {
        let position = distance * towards(degrees);
        let scene = plane(light(LightKind::Point, position, -DVec3::Z));
        let cos = degrees.to_radians().cos();
        let truth = ALBEDO / PI * INTENSITY * cos / (distance * distance);
        if !shows(&format!("{distance} m, {degrees}°"), &scene, truth) {
            return;
        }
    }
}

#[test]
fn directional_light_obeys_the_cosine_and_ends_at_the_horizon() {
    for degrees in [0.0, 60.0, 89.0, 91.0, 120.0] {
        let scene = plane(light(
            LightKind::Directional,
            DVec3::ZERO,
            -towards(degrees),
        ));
        // The plane is seen from above: light from below meets its other side.
        let truth = ALBEDO / PI * INTENSITY * degrees.to_radians().cos().max(0.0);
        if !shows(&format!("{degrees}°"), &scene, truth) {
            return;
        }
    }
}

/// KHR_lights_punctual: the square of a ramp that is linear in the cosine.
#[test]
fn spot_light_falls_off_between_its_cones() {
    let (inner, outer) = (20.0_f64.to_radians(), 40.0_f64.to_radians());
    let kind = LightKind::Spot {
        cos_inner: inner.cos() as f32,
        cos_outer: outer.cos() as f32,
    };
    for degrees in [0.0, 19.9, 25.0, 35.0, 40.1, 180.0] {
        // The light stands 2 m above the view, its axis turned away from it.
        let axis = -towards(degrees);
        let scene = plane(light(kind, 2.0 * DVec3::Z, axis));
        let ramp = (degrees.to_radians().cos() - outer.cos()) / (inner.cos() - outer.cos());
        let truth = ALBEDO / PI * INTENSITY / 4.0 * ramp.clamp(0.0, 1.0).powi(2);
        if !shows(&format!("{degrees}°"), &scene, truth) {
            return;
        }
    }
}
