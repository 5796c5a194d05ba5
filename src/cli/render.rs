//! `etendue render`: arguments → settings → library → files.

use std::path::Path;
use std::time::Instant;

use etendue::film::Film;
use etendue::image_io::{Aov, Format, Image, probe_writable, write_bytes, write_exr, write_png};
use etendue::render::{Control, DeviceOptions, Progress, Renderer};
use etendue::scene::{Camera, Environment, Projection, Scene, gltf, load_environment};
use etendue::settings::Settings;
use etendue::{Error, Result};

use super::args::RenderArgs;
use super::failure::{Failure, Outcome};
use super::header::{Record, Stop};
use super::interrupt::Interrupt;
use super::progress::Reporter;
use super::{stats, write_stderr};

/// Width of the frame when none is asked for, pixels.
const DEFAULT_WIDTH: u32 = 1280;
/// Samples per pixel when none are asked for.
const DEFAULT_SPP: u64 = 128;
/// Aspect of the frame when neither arguments nor camera tell.
const DEFAULT_ASPECT: f64 = 16.0 / 9.0;
/// With fewer samples the standard error itself is too uncertain to decide by.
const MIN_SAMPLES_FOR_NOISE: u64 = 16;

/// Renders and writes what was asked for.
pub fn run(args: &RenderArgs) -> Result<Outcome, Failure> {
    let start = Instant::now();
    check_outputs(args)?;
    let interrupt = Interrupt::install()?;
    let mut reporter = Reporter::new(args);
    let (scene, env_hash) = load(args)?;
    let load = start.elapsed().as_secs_f64();
    tracing::info!("loaded {} in {load:.3} s", args.scene.display());
    for warning in &scene.warnings {
        reporter.warn(warning);
    }
    let settings = settings(args, &scene)?;
    let device = DeviceOptions {
        device: args.device.clone(),
        validation: false,
    };
    let mut renderer = Renderer::new(&scene, &settings, &device)?;
    introduce(&reporter, args, &scene, &settings, &renderer);

    interrupt.begin_rendering();
    let (film, stop) = render(&mut renderer, args, &settings, &interrupt, &mut reporter)?;
    interrupt.begin_writing();
    reporter.clear();
    if film.samples() == 0 {
        write_stderr("error: interrupted before the first pass was complete; nothing is written");
        return Ok(Outcome::Interrupted);
    }
    let report = renderer.report();
    let record = Record {
        args,
        settings: &settings,
        scene: &scene,
        env_hash,
        report: &report,
        film: &film,
        stop,
        load,
    };
    warn_about(&record, &reporter);
    finish(&record, &reporter, start)?;
    Ok(match stop {
        Stop::Interrupt => Outcome::Interrupted,
        _ => Outcome::Done,
    })
}

/// Finds out before the work whether its result can be written.
fn check_outputs(args: &RenderArgs) -> Result<(), Failure> {
    for path in &args.output {
        let format = Format::of(path).map_err(Failure::usage)?;
        if format == Format::Png && !args.output.iter().any(|p| is_exr(p)) && !args.aov.is_empty() {
            return Err(Failure::usage(Error::Settings {
                name: "--aov",
                what: String::from("PNG has no layers; add -o FILE.exr"),
            }));
        }
    }
    for path in args.output.iter().chain(&args.stats) {
        probe_writable(path).map_err(Failure::usage)?;
    }
    Ok(())
}

fn is_exr(path: &Path) -> bool {
    Format::of(path).is_ok_and(|format| format == Format::Exr)
}

/// The scene with the environment of the command line, and that file's hash.
fn load(args: &RenderArgs) -> Result<(Scene, Option<String>), Failure> {
    let env = args.env.as_deref();
    load_scene(&args.scene, env, args.env_intensity, args.env_rotation)
}

/// A scene, with another environment if one is given: its factor, and its rotation in degrees.
pub fn load_scene(
    scene: &Path,
    env: Option<&Path>,
    env_intensity: f64,
    env_rotation: f64,
) -> Result<(Scene, Option<String>), Failure> {
    let mut scene = gltf::load(scene).map_err(Failure::scene)?;
    let Some(path) = env else {
        return Ok((scene, None));
    };
    let loaded = load_environment(path).map_err(Failure::scene)?;
    let mut environment = loaded.environment;
    if let Environment::Map {
        intensity,
        rotation,
        ..
    } = &mut environment
    {
        *intensity = env_intensity as f32;
        *rotation = env_rotation.to_radians() as f32;
    }
    scene.environment = Some(environment);
    scene.warnings.extend(loaded.warnings);
    Ok((scene, Some(loaded.hash)))
}

/// What the arguments mean for this scene.
fn settings(args: &RenderArgs, scene: &Scene) -> Result<Settings> {
    let camera = match &args.camera {
        Some(name) => Some(find_camera(scene, name)?),
        None => None,
    };
    let (width, height) = frame(scene, camera, args.width, args.height, DEFAULT_WIDTH);
    let samples = args.samples.clone();
    let settings = Settings {
        width,
        height,
        crop: args.crop,
        samples: samples.unwrap_or_else(|| 0..args.spp.unwrap_or(DEFAULT_SPP)),
        seed: args.seed,
        max_depth: args.max_depth,
        backend: args.backend.into(),
        estimator: args.estimator.into(),
        camera,
        aovs: args.aovs().into_iter().any(Aov::needs_first_hit),
        ..Settings::default()
    };
    settings.validate()?;
    Ok(settings)
}

/// Width and height of the frame: as asked, else by the camera's aspect, else so wide.
pub fn frame(
    scene: &Scene,
    camera: Option<usize>,
    width: Option<u32>,
    height: Option<u32>,
    default_width: u32,
) -> (u32, u32) {
    let aspect = scene
        .cameras
        .get(camera.unwrap_or(0))
        .and_then(aspect)
        .unwrap_or(DEFAULT_ASPECT);
    match (width, height) {
        (Some(width), Some(height)) => (width, height),
        (None, Some(height)) => (pixels(f64::from(height) * aspect), height),
        (width, None) => {
            let width = width.unwrap_or(default_width);
            (width, pixels(f64::from(width) / aspect))
        }
    }
}

/// Whole pixels, at least one.
fn pixels(length: f64) -> u32 {
    // `as` saturates; `validate` refuses what is too large
    length.round().max(1.0) as u32
}

/// Width over height that a camera asks for.
fn aspect(camera: &Camera) -> Option<f64> {
    match camera.projection {
        Projection::Perspective { aspect, .. } => aspect.map(f64::from),
        Projection::Orthographic { xmag, ymag } => Some(f64::from(xmag) / f64::from(ymag)),
    }
    .filter(|aspect| aspect.is_finite() && *aspect > 0.0)
}

/// A camera by its name or, where none is called so, by its index.
fn find_camera(scene: &Scene, asked: &str) -> Result<usize> {
    let by_name = scene.cameras.iter().position(|c| c.name == asked);
    let by_index = || asked.parse().ok().filter(|&i| i < scene.cameras.len());
    by_name.or_else(by_index).ok_or_else(|| {
        let names: Vec<_> = scene.cameras.iter().map(|c| c.name.as_str()).collect();
        Error::Settings {
            name: "--camera",
            what: match names.is_empty() {
                true => format!("there is no {asked}: the scene has no cameras"),
                false => format!("there is no {asked}; the scene has {}", names.join(", ")),
            },
        }
    })
}

/// Says what is going to be rendered, how, and with which parts of the model.
fn introduce(
    reporter: &Reporter,
    args: &RenderArgs,
    scene: &Scene,
    settings: &Settings,
    renderer: &Renderer,
) {
    let report = renderer.report();
    let names = |on: bool| {
        let chosen = report.features.iter().filter(|f| f.on == on);
        let names: Vec<_> = chosen.map(|f| f.name).collect();
        if names.is_empty() {
            String::from("nothing")
        } else {
            names.join(", ")
        }
    };
    let window = settings.window();
    reporter.note(&format!(
        "{}: {} triangles, {} × {} pixels, samples {}..{}",
        args.scene.display(),
        scene.triangle_count(),
        window.x1 - window.x0,
        window.y1 - window.y0,
        settings.samples.start,
        settings.samples.end,
    ));
    reporter.note(&format!(
        "{} ({}) on {}",
        report.backend.name(),
        report.backend_reason,
        report.device
    ));
    reporter.note(&format!(
        "model: {}; compiled out: {}",
        names(true),
        names(false)
    ));
}

/// Renders until the first limit is reached.
fn render(
    renderer: &mut Renderer,
    args: &RenderArgs,
    settings: &Settings,
    interrupt: &Interrupt,
    reporter: &mut Reporter,
) -> Result<(Film, Stop)> {
    let mut stop = Stop::Samples;
    let film = renderer.render(&mut |progress| {
        reporter.update(progress);
        stop = if interrupt.is_requested() {
            Stop::Interrupt
        } else {
            limit(args, progress)
        };
        match stop {
            Stop::Samples => Control::Continue,
            _ => Control::Stop,
        }
    })?;
    // the limit came with the last sample: nothing was cut short
    if film.samples() == settings.samples.end - settings.samples.start {
        stop = Stop::Samples;
    }
    Ok((film, stop))
}

/// Which limit of the arguments has been reached, if any.
fn limit(args: &RenderArgs, progress: &Progress) -> Stop {
    let samples = progress.film.samples();
    if samples == 0 {
        return Stop::Samples;
    }
    if let Some(limit) = args.time {
        if progress.elapsed.as_secs_f64() >= limit {
            return Stop::Time(limit);
        }
    }
    match args.noise {
        Some(limit)
            if progress.pass_complete
                && samples >= MIN_SAMPLES_FOR_NOISE
                && progress.film.relative_error() <= limit =>
        {
            Stop::Noise(limit)
        }
        _ => Stop::Samples,
    }
}

/// Says what is not as the user may believe.
fn warn_about(record: &Record, reporter: &Reporter) {
    let ledger = &record.report.ledger;
    if ledger.non_finite > 0 {
        reporter.warn(&format!(
            "{} samples were not finite and count as black; the image is darker than it should be",
            ledger.non_finite
        ));
    }
    if ledger.interior_overflows > 0 {
        reporter.warn(&format!(
            "more solids overlap at a point than are tracked; {} of their boundaries were missed",
            ledger.interior_overflows
        ));
    }
    let args = record.args;
    let by_default = args.spp.is_none() && args.samples.is_none();
    if record.stop == Stop::Samples && by_default && (args.time.is_some() || args.noise.is_some()) {
        reporter.warn(&format!(
            "the default of {DEFAULT_SPP} samples was reached before --time or --noise; --spp raises it"
        ));
    }
}

/// Writes every file, the remaining ones also when one fails.
fn finish(record: &Record, reporter: &Reporter, start: Instant) -> Result<(), Failure> {
    let writing = Instant::now();
    let image = Image::from_film(record.film, &record.args.aovs(), record.metadata())?;
    let mut result = Ok(());
    let mut written = Vec::new();
    for path in &record.args.output {
        let wrote = if is_exr(path) {
            write_exr(path, &image)
        } else {
            let exposure = record.args.exposure as f32;
            write_png(path, &image, record.args.tone(), exposure)
        };
        match wrote {
            Ok(()) => written.push(path.clone()),
            Err(error) => result = result.and(Err(Failure::from(error))),
        }
    }
    let late = stats::LateTimes {
        write: writing.elapsed().as_secs_f64(),
        total: start.elapsed().as_secs_f64(),
    };
    for path in &written {
        tracing::info!("wrote {}", path.display());
    }
    if let Some(path) = &record.args.stats {
        let text = format!("{:#}\n", stats::statistics(record, &late));
        if let Err(error) = write_bytes(path, text.as_bytes()) {
            result = result.and(Err(Failure::from(error)));
        }
    }
    if result.is_ok() {
        let stop = record.stop_text();
        reporter.finish(record.film.samples(), &stop, late.total, &written);
    }
    result
}

#[cfg(test)]
mod tests {
    use clap::Parser;
    use glam::DAffine3;

    use super::super::args::{Arguments, Command};
    use super::*;

    fn parse(line: &str) -> RenderArgs {
        let words = "etendue render scene.gltf -o out.exr".split(' ');
        match Arguments::parse_from(words.chain(line.split_whitespace())).command {
            Command::Render(args) => *args,
            _ => unreachable!("the line says render"),
        }
    }

    fn scene() -> Scene {
        let camera = |name: &str, projection| Camera {
            name: name.to_owned(),
            world_from_camera: DAffine3::IDENTITY,
            projection,
        };
        let wide = Projection::Perspective {
            yfov: 1.0,
            aspect: Some(2.0),
        };
        let open = Projection::Perspective {
            yfov: 1.0,
            aspect: None,
        };
        let flat = Projection::Orthographic {
            xmag: 1.0,
            ymag: 4.0,
        };
        Scene {
            cameras: vec![
                camera("1", wide),
                camera("open", open),
                camera("flat", flat),
            ],
            ..Scene::default()
        }
    }

    #[test]
    fn the_frame_follows_the_camera() {
        let size = |line: &str, scene: &Scene| {
            let settings = settings(&parse(line), scene).unwrap();
            (settings.width, settings.height)
        };
        assert_eq!(size("", &scene()), (1280, 640));
        assert_eq!(size("--width 100", &scene()), (100, 50));
        assert_eq!(size("--height 100", &scene()), (200, 100));
        assert_eq!(size("--width 100 --height 3", &scene()), (100, 3));
        assert_eq!(size("--camera open", &scene()), (1280, 720));
        assert_eq!(size("--camera flat --width 100", &scene()), (100, 400));
        assert_eq!(size("", &Scene::default()), (1280, 720));
    }

    #[test]
    fn cameras_go_by_name_before_index() {
        let index = |name: &str| settings(&parse(&format!("--camera {name}")), &scene());
        // a camera is called 1, and it is the first one
        assert_eq!(index("1").unwrap().camera, Some(0));
        assert_eq!(index("2").unwrap().camera, Some(2));
        let message = index("3").unwrap_err().to_string();
        assert!(message.contains("1, open, flat"), "{message}");
    }

    #[test]
    fn samples_come_from_either_option() {
        let samples = |line: &str| settings(&parse(line), &scene()).unwrap().samples;
        assert_eq!(samples(""), 0..128);
        assert_eq!(samples("--spp 5"), 0..5);
        assert_eq!(samples("--samples 5..9"), 5..9);
    }

    #[test]
    fn only_first_hit_layers_cost_anything() {
        let aovs = |line: &str| settings(&parse(line), &scene()).unwrap().aovs;
        assert!(!aovs("--aov stderr,samples"));
        assert!(aovs("--aov stderr,depth"));
    }
}
