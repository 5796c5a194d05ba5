//! Light through fog: what arrives unscattered, once scattered, and after many times.

use etendue::render::Tuning;
use etendue::scene::{LightKind, Medium, Phase, PunctualLight, Scene};
use etendue::settings::{Settings, Strategy};
use glam::{DVec3, Vec3, Vec3Swizzles};

use crate::common::backends::pair;
use crate::common::*;
use crate::tier::count;
use crate::{assert_channels, block, glass, grey};

fn point_light(position: DVec3, intensity: f32) -> PunctualLight {
    PunctualLight {
        name: String::from("lamp"),
        kind: LightKind::Point,
        position,
        direction: Vec3::NEG_Y,
        intensity: Vec3::splat(intensity),
    }
}

/// E = I e^{−σd}/d² on a Lambert floor seen from just above it: depth 1 leaves the direct light alone.
#[test]
fn point_light_in_absorbing_fog() {
    let mut scene = empty();
    add(&mut scene, square(Vec3::ZERO, Vec3::Y, 5.0), lambert(0.5));
    scene.lights = vec![point_light(DVec3::new(0.0, 2.0, 0.0), 3.0)];
    let sigma = Vec3::new(0.1, 0.5, 2.0);
    scene.medium = Some(Medium {
        absorption: sigma,
        ..Medium::default()
    });
    scene.cameras = vec![parallel(DVec3::new(0.0, 1e-3, 0.0), DVec3::ZERO, 1e-4)];
    for backend in pair() {
        let settings = Settings {
            backend,
            ..settings(8, 2)
        };
        let Some(r) = render(&scene, &settings, Tuning::default()) else {
            return;
        };
        let truth = [0, 1, 2].map(|c| {
            let s = f64::from(sigma[c]);
            0.5 / std::f64::consts::PI * 3.0 / 4.0 * (-2.001 * s).exp()
        });
        assert_channels(&format!("{backend:?}"), &r.film, truth, 1e-5);
    }
}

/// A box without an index about the origin, seen along +x.
fn box_of_fog(half: f32, medium: Medium) -> Scene {
    let mut scene = empty();
    add(
        &mut scene,
        block(Vec3::splat(-half), Vec3::splat(half)),
        glass(1.0, medium),
    );
    scene.cameras = vec![parallel(DVec3::new(-5.0, 0.0, 0.0), DVec3::ZERO, 1e-5)];
    scene
}

/// Light along a ray that is scattered once: a point light beside the ray in thin fog, by quadrature.
#[test]
fn single_scattering_of_a_point_light() {
    for (phase, name) in [
        (Phase::Isotropic, "isotropic"),
        (Phase::Rayleigh, "Rayleigh"),
        (Phase::HenyeyGreenstein { g: 0.8 }, "forward"),
        (Phase::HenyeyGreenstein { g: -0.8 }, "backward"),
    ] {
        for height in [1.0, 0.01] {
            let (sigma_a, sigma_s) = (0.05, 0.2);
            let (half, at) = (2.0, DVec3::new(0.3, height, 0.0));
            let mut scene = box_of_fog(half, grey(sigma_a, sigma_s, phase));
            scene.lights = vec![point_light(at, 1.0)];
            let settings = Settings {
                max_depth: 1,
                ..settings(16, count(4096, 16_384))
            };
            let Some(r) = render(&scene, &settings, Tuning::default()) else {
                return;
            };
            let truth = once_scattered(
                &scene.lights[0],
                f64::from(half),
                f64::from(sigma_a + sigma_s),
                f64::from(sigma_s),
                phase,
            );
            assert_channels(&format!("{name}, {height} m"), &r.film, [truth; 3], 8e-3);
        }
    }
}

/// A dozen spots about the ray and as many point lights: their cones hold all of the ray, a part of it or none.
#[test]
fn single_scattering_of_many_spots() {
    let (sigma_a, sigma_s, half) = (0.05, 0.2, 2.0);
    let phase = Phase::HenyeyGreenstein { g: 0.4 };
    let mut scene = box_of_fog(half, grey(sigma_a, sigma_s, phase));
    let sigma_t = f64::from(sigma_a + sigma_s);
    let once = |light: &PunctualLight| {
        f64::from(light.intensity.x)
            * once_scattered(light, f64::from(half), sigma_t, f64::from(sigma_s), phase)
    };
    let mut truth = 0.0;
    for i in 0..24 {
        let at = f64::from(i);
        let around = 2.4 * at;
        let apart = 0.05 + 0.06 * at;
        let position = DVec3::new(0.15 * at - 1.7, apart * around.cos(), apart * around.sin());
        let mut light = point_light(position, 1.0 + (i % 5) as f32);
        if i % 2 == 0 {
            let (inner, outer) = (0.1 + 0.02 * at, 0.15 + 0.03 * at);
            light.kind = LightKind::Spot {
                cos_inner: inner.cos() as f32,
                cos_outer: outer.cos() as f32,
            };
            let target = DVec3::new(1.5 * at.sin(), 0.4 * (1.7 * at).cos(), 0.0);
            light.direction = (target - position).normalize().as_vec3();
        }
        truth += once(&light);
        scene.lights.push(light);
    }
    let settings = Settings {
        max_depth: 1,
        ..settings(16, count(8192, 32_768))
    };
    let Some(r) = render(&scene, &settings, Tuning::default()) else {
        return;
    };
    assert_channels("spots", &r.film, [truth; 3], 8e-3);
}

/// What of its intensity a light sends along `to`, unit. KHR_lights_punctual
fn ramp(light: &PunctualLight, to: DVec3) -> f64 {
    let LightKind::Spot {
        cos_inner,
        cos_outer,
    } = light.kind
    else {
        return 1.0;
    };
    let [inner, outer] = [cos_inner, cos_outer].map(f64::from);
    let cosine = light.direction.as_dvec3().dot(to);
    ((cosine - outer) / (inner - outer)).clamp(0.0, 1.0).powi(2)
}

/// ∫ σ_s e^{−σ s} p(θ) e^{−σ d}/d² ds along +x through the box for a light of one candela, by the midpoint rule in the angle.
fn once_scattered(
    source: &PunctualLight,
    half: f64,
    sigma_t: f64,
    sigma_s: f64,
    phase: Phase,
) -> f64 {
    let light = source.position;
    let d = light.yz().length();
    let angle = |x: f64| ((x - light.x) / d).atan();
    let (a, b) = (angle(-half), angle(half));
    let count = 100_000;
    let mut sum = 0.0;
    for i in 0..count {
        let theta = a + (b - a) * (f64::from(i) + 0.5) / f64::from(count);
        let x = light.x + d * theta.tan();
        let distance = d / theta.cos();
        // Light goes from the lamp to the point and then towards −x.
        let to = DVec3::new(x, 0.0, 0.0) - light;
        let to = to.normalize();
        let cosine = to.dot(DVec3::NEG_X);
        let p = match phase {
            Phase::Isotropic => 0.25 / std::f64::consts::PI,
            Phase::Rayleigh => 3.0 / (16.0 * std::f64::consts::PI) * (1.0 + cosine * cosine),
            Phase::HenyeyGreenstein { g } => {
                let g = f64::from(g);
                (1.0 - g * g)
                    / (4.0 * std::f64::consts::PI * (1.0 + g * g - 2.0 * g * cosine).powf(1.5))
            }
        };
        // ds = distance²/d dθ cancels 1/distance².
        sum += (-sigma_t * (x + half) - sigma_t * distance).exp() * p * ramp(source, to) / d;
    }
    sigma_s * sum * (b - a) / f64::from(count)
}

/// All ways of sampling see the same fog: a lamp with an area, a point light and the
/// sky about a scattering box.
#[test]
fn strategies_agree_in_fog() {
    let mut means: Vec<crate::statistics::Estimate> = Vec::new();
    for strategy in [Strategy::Mis, Strategy::LightOnly, Strategy::BsdfOnly] {
        let mut scene = empty();
        let medium = grey(0.1, 0.6, Phase::HenyeyGreenstein { g: 0.5 });
        add(
            &mut scene,
            block(Vec3::splat(-1.0), Vec3::splat(1.0)),
            glass(1.0, medium),
        );
        add(
            &mut scene,
            square(Vec3::new(0.0, 1.5, 0.0), -Vec3::Y, 0.8),
            emitter(0.2, 3.0),
        );
        scene.environment = constant_sky(0.1);
        scene.cameras = vec![pinhole(DVec3::new(0.5, 0.3, 4.0), DVec3::ZERO, 40.0)];
        let settings = Settings {
            strategy,
            ..settings(32, 2048)
        };
        let Some(r) = render(&scene, &settings, Tuning::default()) else {
            return;
        };
        means.push(crate::channel_mean(&r.film, 0));
    }
    let m = means[0].mean;
    for other in &means[1..] {
        let (d, bound) = other.off_from(means[0]);
        let other = other.mean;
        println!("{m:.6} and {other:.6}: off {d:.1e} ± {bound:.1e}");
        assert!(d + bound <= 1e-2, "{m} and {other}");
    }
}
