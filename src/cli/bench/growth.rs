//! How time and memory grow with what a scene has more of.

use etendue::film::Film;
use etendue::render::{DeviceOptions, Renderer};
use etendue::scene::Scene;
use etendue::settings::Settings;

use super::super::failure::Failure;
use super::args::{BenchArgs, SweepName};
use super::contender::{render_all, warm_up};
use super::record::{self, Line, Skipped};
use super::{Output, generated, settings};

/// Samples a pixel where they do not grow.
const SPP: u64 = 16;
/// Triangles of the terrain where they do not grow.
const TERRAIN: u64 = 20_000;

/// A step: how far, and what is rendered.
struct Step {
    value: u64,
    scene: Scene,
    settings: Settings,
    spp: u64,
}

/// Measures every step of a sweep in rounds.
pub fn run(
    args: &BenchArgs,
    sweep: SweepName,
    options: &DeviceOptions,
    out: &mut Output,
) -> Result<(), Failure> {
    let name = name(sweep);
    for value in values(sweep, args.growth_to) {
        out.note(&format!("{name}: {value}"));
        let step = step(args, sweep, value)?;
        let mut renderer = match Renderer::new(&step.scene, &step.settings, options) {
            Ok(renderer) => renderer,
            Err(error) => {
                // so large is too large for this device; the steps before stand
                out.line(&Line::Skipped(Skipped {
                    scene: format!("growth {name} {value}"),
                    contender: String::from("etendue"),
                    reason: error.to_string(),
                }))?;
                break;
            }
        };
        warm_up(&mut renderer)?;
        for round in 1..=args.seeds {
            let film = render_all(&mut renderer, step.spp, round)?;
            out.line(&Line::Growth(record(name, round, &step, &renderer, &film)))?;
        }
    }
    Ok(())
}

fn name(sweep: SweepName) -> &'static str {
    match sweep {
        SweepName::Triangles => "triangles",
        SweepName::Spp => "spp",
        SweepName::Lights => "lights",
        SweepName::Resolution => "resolution",
        SweepName::Depth => "depth",
        SweepName::Instances => "instances",
    }
}

/// The steps, half a decade or a factor of two or four apart.
fn values(sweep: SweepName, most: u64) -> Vec<u64> {
    let decades = |from: i32| -> Vec<u64> {
        let values = (2 * from..).map(|half| 10f64.powf(f64::from(half) / 2.0).round() as u64);
        values.take_while(|v| *v <= most).collect()
    };
    match sweep {
        SweepName::Triangles => decades(3),
        SweepName::Lights => decades(0),
        SweepName::Instances => decades(1),
        SweepName::Spp => (0..6).map(|i| 4u64.pow(i)).collect(),
        SweepName::Resolution => (5..11).map(|i| 1 << i).collect(),
        SweepName::Depth => (0..7).map(|i| 1 << i).collect(),
    }
}

fn step(args: &BenchArgs, sweep: SweepName, value: u64) -> Result<Step, Failure> {
    let scene = match sweep {
        SweepName::Triangles => generated::terrain(value),
        SweepName::Lights => generated::lamps(value),
        SweepName::Instances => generated::copies(value),
        SweepName::Depth => generated::room(),
        SweepName::Spp | SweepName::Resolution => generated::terrain(TERRAIN),
    };
    let mut settings = settings(args, &scene)?;
    let mut spp = SPP;
    match sweep {
        SweepName::Spp => spp = value,
        SweepName::Resolution => (settings.width, settings.height) = (value as u32, value as u32),
        SweepName::Depth => settings.max_depth = value as u32,
        _ => {}
    }
    Ok(Step {
        value,
        scene,
        settings,
        spp,
    })
}

fn record(
    sweep: &str,
    round: u64,
    step: &Step,
    renderer: &Renderer,
    film: &Film,
) -> record::Growth {
    let report = renderer.report();
    let seconds = report.times.render;
    record::Growth {
        sweep: sweep.to_owned(),
        value: step.value as f64,
        backend: report.backend.name().to_owned(),
        round,
        spp: step.spp,
        pixels: film.pixels() as u64,
        triangles: step.scene.triangle_count(),
        seconds,
        rays_per_second: report.rays as f64 / seconds,
        build: report.times.build,
        bytes: report.memory.geometry + report.memory.acceleration,
        variance: variance(film),
        truncated: report.ledger.truncated_paths as f64 / report.paths.max(1) as f64,
    }
}

/// The mean estimated variance over the square of the mean; 0 where one sample does not tell.
fn variance(film: &Film) -> f64 {
    let error = film.relative_error();
    if error.is_finite() {
        error * error
    } else {
        0.0
    }
}
