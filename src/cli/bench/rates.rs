//! How fast each traversal of the device is, with each estimator that takes part.

use std::path::Path;

use etendue::render::{DeviceOptions, Renderer, Tuning, devices};
use etendue::scene::Scene;
use etendue::settings::Settings;

use super::super::failure::Failure;
use super::contender::{render_all, warm_up};
use super::record::{Line, Rate, Skipped};
use super::{Output, scene_name};

/// Samples a pixel of a round.
const SPP: u64 = 16;

/// Renders in rounds by the estimator of the settings, every traversal that the device offers once a round; it is said what
/// the others lack.
pub fn run(
    path: &Path,
    scene: &Scene,
    settings: &Settings,
    options: &DeviceOptions,
    rounds: u64,
    device: &str,
    out: &mut Output,
) -> Result<(), Failure> {
    let estimator = settings.estimator;
    let name = scene_name(path);
    let mut renderers = Vec::new();
    let this = devices()?.into_iter().find(|info| info.name == device);
    let backends = this.map(|info| info.backends).unwrap_or_default();
    for (backend, support) in backends {
        let skipped = |reason| {
            Line::Skipped(Skipped {
                scene: name.clone(),
                contender: backend.name().to_owned(),
                reason,
            })
        };
        let settings = Settings {
            backend,
            ..settings.clone()
        };
        let renderer = match support {
            // the device's own test of triangles is part of what is measured
            Ok(()) => {
                let tuning = Tuning {
                    boxes: Some(false),
                    ..Tuning::default()
                };
                let renderer = Renderer::tuned(scene, &settings, options, tuning);
                renderer.map_err(|e| e.to_string())
            }
            Err(lacks) => Err(format!("the device lacks {lacks}")),
        };
        match renderer {
            Ok(mut renderer) => {
                warm_up(&mut renderer)?;
                renderers.push((backend, renderer));
            }
            Err(reason) => out.line(&skipped(reason))?,
        }
    }
    for round in 1..=rounds {
        for (backend, renderer) in &mut renderers {
            render_all(renderer, SPP, round)?;
            let report = renderer.report();
            let seconds = report.times.render;
            out.line(&Line::Rate(Rate {
                scene: name.clone(),
                backend: backend.name().to_owned(),
                estimator: estimator.name().to_owned(),
                round,
                spp: SPP,
                seconds,
                paths_per_second: report.paths as f64 / seconds,
                rays_per_second: report.rays as f64 / seconds,
                build: report.times.build,
                compile: report.times.compile,
            }))?;
        }
    }
    Ok(())
}
