//! Rays: closed meshes without gaps, and surfaces that light leaves without meeting them again.

use glam::{DVec3, Vec3};

use super::scenes::{ball, lambert, scene};
use super::{Check, Random, film, settings};
use crate::error::Result;
use crate::layout::{NONE, ProbeRay};
use crate::render::{DeviceOptions, Renderer};
use crate::settings::{BackendChoice, Settings, Strategy};

/// Rays at edges and vertices, for each size.
const RAYS: usize = 50_000;
/// Sizes of the ball, metres.
const SIZES: [f32; 3] = [1e-6, 1.0, 1e6];
/// Share of rays that ray query may lose: Vulkan recommends that there are no gaps, and does not promise it.
const MOST_LOST: f64 = 0.01;
/// Albedo of the ball.
const ALBEDO: f32 = 0.5;
/// Relative deviation of a white ball under a white sky that is rounding. A thousandth of its light that
/// met the ball again would be 2.5e-4.
const ROUNDING: f64 = 1e-5;

/// For one backend.
pub(super) fn checks(backend: BackendChoice, device: &DeviceOptions) -> Result<Vec<Check>> {
    let (mut lost, mut worst) = (0, 0.0);
    for size in SIZES {
        let ball = ball(size, 3);
        let rays = at_edges(&ball.positions, size);
        let eye = f64::from(size) * DVec3::new(1.0, 2.0, 3.0);
        let half = 0.4 * f64::from(size);
        let scene = scene(
            vec![(ball, lambert(ALBEDO, 0.0))],
            1.0,
            eye,
            DVec3::ZERO,
            half,
        );
        let settings = Settings {
            backend,
            strategy: Strategy::BsdfOnly,
            ..settings(32, 64)
        };
        let mut renderer = Renderer::new(&scene, &settings, device)?;
        let hits = renderer.probe(&rays)?;
        let is_lost = |hit: &&crate::layout::ProbeHit| hit.primitive == NONE || hit.occluded == 0;
        lost += hits.iter().filter(is_lost).count();
        for value in film(&mut renderer)?.mean().into_iter().flatten() {
            let off = (f64::from(value) / f64::from(ALBEDO) - 1.0).abs();
            worst = if off <= worst { worst } else { off };
        }
    }
    let total = RAYS * SIZES.len();
    let name = format!("{}: edges and vertices of a closed mesh", backend.name());
    let (expected, most) = match backend {
        BackendChoice::Bvh => ("no ray lost", 0.0),
        _ => ("< 1 % lost (Vulkan: should be none)", MOST_LOST),
    };
    let measured = format!("{lost} of {total} lost");
    let watertight = Check::new(
        "rays",
        &name,
        expected,
        measured,
        lost as f64 <= most * total as f64,
    );
    let name = format!(
        "{}: light leaves surfaces, sizes 1e-6 … 1e6 m",
        backend.name()
    );
    let measured = format!("{worst:.1e} off");
    let offsets = Check::new(
        "rays",
        &name,
        "0.5 within 1e-5",
        measured,
        worst <= ROUNDING,
    );
    Ok(vec![watertight, offsets])
}

/// Rays from inside at points of edges and at vertices; three positions a triangle.
fn at_edges(positions: &[Vec3], size: f32) -> Vec<ProbeRay> {
    let mut random = Random(5);
    let ray = |i: usize| {
        // Half of the rays start at the centre, where differences of coordinates are often exact.
        let mut coordinate = || random.between(-0.3, 0.3) * size;
        let from = match i % 2 {
            0 => Vec3::ZERO,
            _ => Vec3::new(coordinate(), coordinate(), coordinate()),
        };
        let triangle = (random.unit() * (positions.len() / 3) as f64) as usize;
        let (a, b) = (
            positions[3 * triangle + i % 3],
            positions[3 * triangle + (i + 1) % 3],
        );
        let along = [0.0, 0.5, random.between(0.0, 1.0)][(random.unit() * 3.0) as usize];
        ProbeRay {
            origin: from.to_array(),
            t_min: 0.0,
            direction: ((a + (b - a) * along - from) / size).normalize().to_array(),
            t_max: 3e38,
            from: NONE,
        }
    };
    (0..RAYS).map(ray).collect()
}
