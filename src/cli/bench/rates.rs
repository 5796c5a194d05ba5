//! How fast each traversal of the device is, with each estimator that takes part.

use std::path::Path;

use etendue::render::{DeviceOptions, Renderer, Tuning, devices};
use etendue::scene::Scene;
use etendue::settings::{BackendChoice, Settings};

use super::super::failure::Failure;
use super::contender::{render_all, warm_up};
use super::record::{Line, Rate, Skipped};
use super::{Output, scene_name};

/// Samples a pixel of a round.
const SPP: u64 = 16;

/// The traversals that the device offers; it is said what the others lack.
pub fn offered(path: &Path, device: &str, out: &mut Output) -> Result<Vec<BackendChoice>, Failure> {
    let this = devices()?.into_iter().find(|info| info.name == device);
    let mut offered = Vec::new();
    for (backend, support) in this.map(|info| info.backends).unwrap_or_default() {
        match support {
            Ok(()) => offered.push(backend),
            Err(lacks) => {
                let reason = format!("the device lacks {lacks}");
                out.line(&skipped(path, backend, reason))?;
            }
        }
    }
    Ok(offered)
}

fn skipped(path: &Path, backend: BackendChoice, reason: String) -> Line {
    Line::Skipped(Skipped {
        scene: scene_name(path),
        contender: backend.name().to_owned(),
        reason,
    })
}

/// Renders in rounds by the estimator of the settings, every one of the traversals once a round.
pub fn run(
    path: &Path,
    scene: &Scene,
    settings: &Settings,
    options: &DeviceOptions,
    rounds: u64,
    backends: &[BackendChoice],
    out: &mut Output,
) -> Result<(), Failure> {
    let mut renderers = Vec::new();
    for &backend in backends {
        let settings = Settings {
            backend,
            ..settings.clone()
        };
        // the device's own test of triangles is part of what is measured
        let tuning = Tuning {
            boxes: Some(false),
            ..Tuning::default()
        };
        match Renderer::tuned(scene, &settings, options, tuning) {
            Ok(mut renderer) => {
                warm_up(&mut renderer)?;
                renderers.push((backend, renderer));
            }
            Err(e) => out.line(&skipped(path, backend, e.to_string()))?,
        }
    }
    for round in 1..=rounds {
        for (backend, renderer) in &mut renderers {
            render_all(renderer, SPP, round)?;
            let report = renderer.report();
            let seconds = report.times.render;
            out.line(&Line::Rate(Rate {
                scene: scene_name(path),
                backend: backend.name().to_owned(),
                estimator: settings.estimator.name().to_owned(),
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
