//! `etendue render`: arguments → settings → library → files.

use std::path::Path;
use std::time::Instant;

use etendue::film::Film;
use etendue::image_io::{
    Aov, Format, Image, Lock, lock, probe_writable, write_bytes, write_exr, write_png,
};
use etendue::render::{Control, Identities, Progress, Report, Team, Work};
use etendue::scene::{Environment, Scene, gltf, load_environment};
use etendue::{Error, Result};

use super::args::RenderArgs;
use super::checkpoint::{self, Cost, Keeper, Saved};
use super::failure::{Failure, Outcome};
use super::header::{self, Job, Record, Stop};
use super::interrupt::Interrupt;
use super::plan;
use super::progress::Reporter;
use super::rerender::Repeat;
use super::samples::Planner;
use super::settings::{DEFAULT_SPP, settings};
use super::{stats, write_stderr};

/// Renders and writes what was asked for.
pub fn run(args: &RenderArgs) -> Result<Outcome, Failure> {
    repeat(args, None)
}

/// As [`run`]; with a header, the samples of that one, and only if everything is as it says.
pub fn repeat(args: &RenderArgs, repeats: Option<&Repeat>) -> Result<Outcome, Failure> {
    let start = Instant::now();
    // held until the last file is written
    let _locks = claim_outputs(args)?;
    let saved = checkpoint::open(args)?;
    let interrupt = Interrupt::install()?;
    let mut reporter = Reporter::new(args);
    let job = prepare(args, repeats, start)?;
    for warning in &job.scene.warnings {
        reporter.warn(warning);
    }
    if let Some(saved) = &saved {
        saved.check_job(&job)?;
    }
    let devices = plan::devices(args)?;
    plan::check_host(&job.settings)?;
    if args.dry_run {
        plan::show(&job, &devices)?;
        return Ok(Outcome::Done);
    }
    let mut renderer = Team::new(&job.scene, &job.settings, &devices)?;
    introduce(&reporter, &job, &renderer);
    let layers = identities(&renderer, args)?;
    let (film, work) = begin(&job, saved, &renderer.report(), &reporter)?;

    interrupt.begin_rendering();
    let rendered = render(&mut renderer, &job, film, work, &interrupt, &mut reporter);
    let (film, stop, cost) =
        rendered.map_err(|error| rescue(error, &mut renderer, &job, &reporter))?;
    interrupt.begin_writing();
    reporter.clear();
    let report = renderer.report();
    let record = Record {
        job: &job,
        report: &report,
        film: &film,
        layers: &layers,
        stop,
    };
    // first, so that nothing is lost where the images cannot be written
    let saved = match &args.checkpoint {
        Some(path) => checkpoint::save(path, &record).map_err(Failure::from),
        None => Ok(()),
    };
    if film.samples() == 0 {
        saved?;
        write_stderr("error: interrupted before the first pass was complete; nothing is written");
        return Ok(Outcome::Interrupted);
    }
    warn_about(&record, &reporter);
    let finished = finish(&record, cost, &reporter, start);
    saved.and(finished)?;
    check_dropped(&record)?;
    Ok(match stop {
        Stop::Interrupt => Outcome::Interrupted,
        _ => Outcome::Done,
    })
}

/// Loads the scene and decides what is rendered.
fn prepare<'a>(
    args: &'a RenderArgs,
    repeats: Option<&'a Repeat>,
    start: Instant,
) -> Result<Job<'a>, Failure> {
    let (scene, env_hash) = load(args)?;
    let load = start.elapsed().as_secs_f64();
    tracing::info!("loaded {} in {load:.3} s", args.scene.display());
    let job = Job {
        args,
        settings: settings(args, &scene)?,
        scene,
        env_hash,
        load,
        repeats,
    };
    if let Some(repeat) = repeats {
        repeat.check_job(&job)?;
    }
    Ok(job)
}

/// The layers of numbers that are asked for.
fn identities(renderer: &Team, args: &RenderArgs) -> Result<Vec<(Aov, Vec<f32>)>> {
    let asked: Vec<_> = args
        .aovs()
        .into_iter()
        .filter(|a| a.is_identity())
        .collect();
    if asked.is_empty() {
        return Ok(Vec::new());
    }
    let Identities {
        instances,
        materials,
    } = renderer.identities()?;
    let mut layers = vec![(Aov::Instance, instances), (Aov::Material, materials)];
    layers.retain(|(aov, _)| asked.contains(aov));
    Ok(layers)
}

/// The film to begin with, and what it took.
fn begin(
    job: &Job,
    saved: Option<Saved>,
    report: &Report,
    reporter: &Reporter,
) -> Result<(Film, Work)> {
    let empty = Film::of(&job.settings);
    let record = Record {
        job,
        report,
        film: &empty,
        layers: &[],
        stop: Stop::Samples,
    };
    if let Some(repeat) = job.repeats {
        repeat.warn_about(&record, reporter);
    }
    if let Some(saved) = saved {
        saved.check_device(&record)?;
        let work = saved.work();
        let held = header::ranges(&saved.film.ranges());
        reporter.note(&format!("going on from samples {held}"));
        return Ok((saved.film, work));
    }
    if let Some(path) = job.args.checkpoint.as_ref().filter(|_| job.args.resume) {
        let path = path.display();
        reporter.note(&format!(
            "there is no {path} yet: starting at the first sample"
        ));
    }
    Ok((empty, Work::default()))
}

/// Finds out before the work whether its results can be written, and keeps others from doing so.
fn claim_outputs(args: &RenderArgs) -> Result<Vec<Lock>, Failure> {
    for path in &args.output {
        let format = Format::of(path).map_err(Failure::usage)?;
        if format == Format::Png && !args.output.iter().any(|p| is_exr(p)) && !args.aov.is_empty() {
            return Err(Failure::usage(Error::Settings {
                name: "--aov",
                what: String::from("PNG has no layers; add -o FILE.exr"),
            }));
        }
    }
    let mut locks: Vec<Lock> = Vec::new();
    let others = args.stats.iter().chain(&args.checkpoint);
    for path in args.output.iter().chain(others) {
        probe_writable(path).map_err(Failure::usage)?;
        if locks.iter().any(|lock| lock.is_of(path)) {
            return Err(Failure::usage(Error::Settings {
                name: "--output",
                what: format!("{} is named twice", path.display()),
            }));
        }
        locks.extend(lock(path).map_err(Failure::usage)?);
    }
    Ok(locks)
}

fn is_exr(path: &Path) -> bool {
    Format::of(path).is_ok_and(|format| format == Format::Exr)
}

/// The scene with the environment of the command line, and that file's hash.
fn load(args: &RenderArgs) -> Result<(Scene, Option<String>), Failure> {
    let env = args.env.as_deref();
    let factors = (args.env_intensity, args.env_rotation);
    load_scene(&args.scene, env, factors, args.cache())
}

/// A scene, with another environment if one is given: its factor, and its rotation in degrees. `cache` is a folder of images.
pub fn load_scene(
    scene: &Path,
    env: Option<&Path>,
    (env_intensity, env_rotation): (f64, f64),
    cache: Option<&Path>,
) -> Result<(Scene, Option<String>), Failure> {
    let limits = gltf::Limits::default();
    let mut scene = gltf::load_cached(scene, &limits, cache).map_err(Failure::scene)?;
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

/// Says what is going to be rendered, how, and with which parts of the model.
fn introduce(reporter: &Reporter, job: &Job, renderer: &Team) {
    let settings = &job.settings;
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
        job.args.scene.display(),
        job.scene.triangle_count(),
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
    renderer: &mut Team,
    job: &Job,
    film: Film,
    before: Work,
    interrupt: &Interrupt,
    reporter: &mut Reporter,
) -> Result<(Film, Stop, Cost)> {
    let begun = Instant::now();
    let (film, samples) = Planner::new(renderer, job, interrupt).plan(film, reporter)?;
    let mut stop = Stop::Samples;
    let mut keeper = Keeper::new(job, &renderer.report());
    let film = renderer.resume(film, before, &samples, &mut |progress| {
        reporter.update(progress);
        stop = if interrupt.is_requested() {
            Stop::Interrupt
        } else {
            limit(job.args, progress, begun)
        };
        if stop != Stop::Samples {
            return Control::Stop;
        }
        if let Some(Err(error)) = keeper.as_mut().map(|keeper| keeper.update(progress)) {
            // the next one may succeed
            reporter.warn(&error.to_string());
        }
        Control::Continue
    })?;
    if film.missing(&samples).is_empty() {
        stop = match job.args.noise {
            Some(limit) if !film.missing(&job.samples()).is_empty() => Stop::Noise(limit),
            // the limit came with the last sample: nothing was cut short
            _ => Stop::Samples,
        };
    }
    let cost = keeper.map_or_else(Cost::default, |keeper| keeper.cost);
    Ok((film, stop, cost))
}

/// Keeps what was finished before a render failed, if there is a checkpoint to keep it in.
fn rescue(error: Error, renderer: &mut Team, job: &Job, reporter: &Reporter) -> Error {
    let Some(path) = &job.args.checkpoint else {
        return error;
    };
    let finished = renderer.take_finished();
    let Some((film, work)) = finished.filter(|(film, _)| film.samples() > 0) else {
        return error;
    };
    let mut report = renderer.report();
    report.times.render = work.seconds;
    let record = Record {
        job,
        report: &report,
        film: &film,
        layers: &[],
        stop: Stop::Interrupt,
    };
    match checkpoint::save(path, &record) {
        Ok(()) => reporter.warn(&format!(
            "the render failed; its {} finished samples are in {}, --resume goes on from there",
            film.mean_of(film.samples()),
            path.display()
        )),
        Err(failed) => reporter.warn(&failed.to_string()),
    }
    error
}

/// Which limit of the arguments has been reached, if any.
fn limit(args: &RenderArgs, progress: &Progress, begun: Instant) -> Stop {
    let samples = progress.film.samples();
    if samples == 0 {
        return Stop::Samples;
    }
    if let Some(limit) = args.time {
        if begun.elapsed().as_secs_f64() >= limit {
            return Stop::Time(limit);
        }
    }
    Stop::Samples
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
    let args = record.job.args;
    if let Stop::Noise(limit) = record.stop {
        let error = record.film.relative_error();
        if error > limit {
            reporter.warn(&format!(
                "the relative error is {error:.2e}, above --noise {limit}: rare bright samples came; --spp takes more"
            ));
        }
    }
    let by_default = args.spp.is_none() && args.samples.is_none();
    if record.stop == Stop::Samples && by_default && (args.time.is_some() || args.noise.is_some()) {
        reporter.warn(&format!(
            "the default of {DEFAULT_SPP} samples was reached before --time or --noise; --spp raises it"
        ));
    }
}

/// A picture that lost more samples than the arguments allow is kept, but is no success.
fn check_dropped(record: &Record) -> Result<(), Failure> {
    let (report, args) = (record.report, record.job.args);
    let dropped = report.ledger.non_finite;
    if dropped as f64 <= args.max_dropped * report.paths as f64 {
        return Ok(());
    }
    Err(Failure::from(Error::Image {
        path: args.output[0].clone(),
        what: format!(
            "{dropped} of {} samples were not finite, more than the share of {:e} that --max-dropped allows; the files are written",
            report.paths, args.max_dropped
        ),
    }))
}

/// Writes every file, the remaining ones also when one fails.
fn finish(record: &Record, cost: Cost, reporter: &Reporter, start: Instant) -> Result<(), Failure> {
    let writing = Instant::now();
    let args = record.job.args;
    let mut image = Image::from_film(record.film, &args.aovs(), record.metadata())?;
    for (aov, values) in record.layers {
        image.push_layer(*aov, values.clone());
    }
    if args.samples.is_some() {
        image.push_nodes(record.film);
    }
    let mut result = Ok(());
    let mut written = Vec::new();
    for path in &args.output {
        let wrote = if is_exr(path) {
            write_exr(path, &image)
        } else {
            let exposure = args.exposure as f32;
            write_png(path, &image, args.tone(), exposure)
        };
        match wrote {
            Ok(()) => written.push(path.clone()),
            Err(error) => result = result.and(Err(Failure::from(error))),
        }
    }
    let late = stats::LateTimes {
        write: writing.elapsed().as_secs_f64(),
        total: start.elapsed().as_secs_f64(),
        checkpoints: cost,
    };
    for path in &written {
        tracing::info!("wrote {}", path.display());
    }
    if let Some(path) = &args.stats {
        let text = format!("{:#}\n", stats::statistics(record, &late));
        if let Err(error) = write_bytes(path, text.as_bytes()) {
            result = result.and(Err(Failure::from(error)));
        }
    }
    if result.is_ok() {
        let stop = record.stop_text();
        let samples = record.film.mean_of(record.film.samples());
        reporter.finish(samples, &stop, late.total, &written);
    }
    result
}
