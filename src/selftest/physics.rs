//! One closed form for each topic of physics, and the backends against each other.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};

use super::scenes::{ball, cuboid, lambert, quad, scene, solid};
use super::{Check, film, settings};
use crate::compare::{Options, compare};
use crate::error::Result;
use crate::film::Film;
use crate::image_io::{Aov, Image, Metadata};
use crate::render::{DeviceOptions, Reading, Renderer};
use crate::scene::{LightKind, Material, Medium, Phase, PunctualLight, Scene};
use crate::settings::{BackendChoice, Sensor, Settings};

/// Standard errors beside an estimate: one of 10⁶ right ones is further off.
const Z: f64 = 4.9;
/// Rate of false alarms of the comparison of backends.
const ALPHA: f64 = 1e-3;

/// A scene whose pixels are all the same known number.
struct Topic {
    name: &'static str,
    formula: &'static str,
    scene: Scene,
    samples: u64,
    truth: f64,
    /// Relative deviation that is allowed, chance included.
    tolerance: f64,
}

fn topics() -> Vec<Topic> {
    let (above, at) = (DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO);
    let sheet = |z: f32, half: f32| quad(Vec3::Z * z, Vec3::X * half, Vec3::Y * half);
    let seen =
        |parts: Vec<(crate::scene::Mesh, Material)>, sky: f32| scene(parts, sky, above, at, 0.1);
    let block = cuboid(Vec3::new(-5.0, -5.0, -1.0), Vec3::new(5.0, 5.0, 0.0), false);
    let medium = |absorption: f32, scattering: f32, phase| Medium {
        absorption: Vec3::splat(absorption),
        scattering: Vec3::splat(scattering),
        phase,
    };
    let lamp = || (sheet(-2.0, 50.0), lambert(0.0, 1.0));
    let mut lit = seen(vec![(sheet(0.0, 1.0), lambert(0.6, 0.0))], 0.0);
    lit.cameras = scene(vec![], 0.0, DVec3::new(0.2, 0.1, 3.0), at, 1e-6).cameras;
    lit.lights.push(PunctualLight {
        name: String::new(),
        kind: LightKind::Point,
        position: DVec3::new(0.0, 0.0, 2.0),
        direction: -Vec3::Z,
        intensity: Vec3::splat(5.0),
    });
    let topic = |name, formula, scene, samples, truth, tolerance| Topic {
        name,
        formula,
        scene,
        samples,
        truth,
        tolerance,
    };
    let room = cuboid(Vec3::splat(-4.0), Vec3::splat(4.0), true);
    let fog = ball(1.0, 2);
    vec![
        topic(
            "emission: a lamp",
            "L",
            seen(vec![(sheet(0.0, 1.0), lambert(0.0, 3.0))], 0.0),
            1,
            3.0,
            1e-6,
        ),
        topic(
            "surfaces: a furnace of albedo 1/2",
            "E/(1 − ρ)",
            seen(vec![(room, lambert(0.5, 1.0))], 0.0),
            4096,
            2.0,
            5e-3,
        ),
        topic(
            "lights: a point light over a plane",
            "ρ I/(π d²)",
            lit,
            1,
            0.6 * 5.0 / (4.0 * PI),
            1e-5,
        ),
        topic(
            "Fresnel: a pane of glass, n = 1.5",
            "(1 − R)/(1 + R)",
            seen(
                vec![(block.clone(), solid(1.5, Medium::default())), lamp()],
                0.0,
            ),
            4096,
            0.96 / 1.04,
            5e-3,
        ),
        topic(
            "media: absorption over one mean free path",
            "exp(−1)",
            seen(
                vec![
                    (block, solid(1.0, medium(1.0, 0.0, Phase::Isotropic))),
                    lamp(),
                ],
                0.0,
            ),
            1,
            (-1f64).exp(),
            1e-5,
        ),
        topic(
            "media: white Rayleigh fog under a white sky",
            "1",
            seen(
                vec![(fog, solid(1.0, medium(0.0, 2.0, Phase::Rayleigh)))],
                1.0,
            ),
            256,
            1.0,
            5e-3,
        ),
    ]
}

/// Mean of all pixels and channels and its standard error. Channels share their paths.
fn mean(film: &Film) -> (f64, f64) {
    let n = film.pixels() as f64;
    let sum: f64 = film.mean().iter().flatten().map(|v| f64::from(*v)).sum();
    let error = |c: usize| {
        let squares = film
            .standard_error()
            .into_iter()
            .map(move |e| f64::from(e[c]).powi(2));
        squares.sum::<f64>().sqrt() / n
    };
    let error = [0, 1, 2].map(error).into_iter().fold(0.0, f64::max);
    (
        sum / (3.0 * n),
        if film.samples() < 2 { 0.0 } else { error },
    )
}

/// All topics.
pub(super) fn checks(backend: BackendChoice, device: &DeviceOptions) -> Result<Vec<Check>> {
    let mut checks = Vec::new();
    for t in topics() {
        let settings = Settings {
            backend,
            ..settings(16, t.samples)
        };
        let mut renderer = Renderer::new(&t.scene, &settings, device)?;
        let (mean, error) = mean(&film(&mut renderer)?);
        checks.push(judge(t.name, t.formula, mean, error, t.truth, t.tolerance));
    }
    checks.push(pi(backend, device)?);
    Ok(checks)
}

fn judge(name: &str, formula: &str, mean: f64, error: f64, truth: f64, tolerance: f64) -> Check {
    let expected = format!("{formula} = {truth:.6} within {:.4} %", 100.0 * tolerance);
    let measured = format!("{mean:.6} ± {:.1e}", Z * error);
    let is_right = (mean - truth).abs() + Z * error <= tolerance * truth;
    Check::new("physics", name, &expected, measured, is_right)
}

/// The illuminance under a sky of radiance 1 is π.
fn pi(backend: BackendChoice, device: &DeviceOptions) -> Result<Check> {
    let mut scene = scene(vec![], 1.0, DVec3::Z, DVec3::ZERO, 1.0);
    // Something below, so that the scene has an extent.
    let floor = quad(-Vec3::Z, Vec3::X, Vec3::Y);
    scene.meshes.push(floor);
    scene.materials.push(lambert(0.5, 0.0));
    scene.instances.push(crate::scene::Instance {
        name: String::new(),
        mesh: 0,
        world_from_object: glam::DAffine3::IDENTITY,
    });
    let sensor = Sensor::Irradiance {
        position: DVec3::ZERO,
        normal: DVec3::Z,
    };
    let settings = Settings {
        backend,
        sensor: Some(sensor),
        ..settings(16, 64)
    };
    let mut renderer = Renderer::new(&scene, &settings, device)?;
    let reading = Reading::of(&film(&mut renderer)?, &sensor, &scene)?;
    let (value, error) = (reading.value[1], reading.error[1]);
    Ok(judge(
        "measuring: illuminance under a white sky",
        "π",
        value,
        error,
        PI,
        5e-3,
    ))
}

/// Two backends render a scene with different seeds.
pub(super) fn agreement(backends: [BackendChoice; 2], device: &DeviceOptions) -> Result<Check> {
    let floor = quad(-Vec3::Z, Vec3::X * 2.0, Vec3::Y * 2.0);
    let lamp = quad(Vec3::new(0.5, 0.0, 2.0), Vec3::Y * 0.5, Vec3::X * 0.5);
    let parts = vec![
        (floor, lambert(0.7, 0.0)),
        (
            ball(0.7, 3),
            Material {
                roughness: 0.3,
                ..Material::default()
            },
        ),
        (lamp, lambert(0.0, 8.0)),
    ];
    let scene = scene(parts, 0.1, DVec3::new(2.0, 3.0, 3.0), DVec3::ZERO, 1.5);
    let mut images = Vec::new();
    for (seed, backend) in (0..).zip(backends) {
        let settings = Settings {
            backend,
            seed,
            ..settings(64, 256)
        };
        let mut renderer = Renderer::new(&scene, &settings, device)?;
        let film = film(&mut renderer)?;
        let layers = [Aov::StandardError, Aov::Samples];
        images.push(Image::from_film(&film, &layers, Metadata::new())?);
    }
    let options = Options {
        alpha: ALPHA,
        spp: [None; 2],
    };
    let result = compare(&images[0], &images[1], &options)?;
    let detectable = 100.0 * result.detectable.unwrap_or(f64::INFINITY);
    let measured = format!(
        "p = {:.2}; {detectable:.2} % would show",
        result.p.unwrap_or(f64::NAN)
    );
    let name = format!("{} and {} agree", backends[0].name(), backends[1].name());
    let is_right = result.is_different == Some(false);
    Ok(Check::new(
        "rays",
        &name,
        "the same picture, p ≥ 0.001",
        measured,
        is_right,
    ))
}

#[cfg(test)]
mod tests {
    use super::judge;

    #[test]
    fn values_that_are_off_or_not_known_fail() {
        let is_right = |mean, error| judge("", "", mean, error, 1.0, 1e-2).is_right;
        assert!(is_right(1.001, 1e-4) && is_right(0.991, 1e-4));
        assert!(!is_right(1.02, 1e-4) && !is_right(1.0, 1e-2) && !is_right(f64::NAN, 0.0));
    }
}
