//! `etendue bench`: measures, and writes one JSON object a line.

pub mod args;
mod contender;
mod contest;
mod error;
mod generated;
mod growth;
mod limits;
mod peer;
mod rates;
pub mod record;
mod reference;

use std::cell::RefCell;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::time::Instant;

use etendue::image_io::probe_writable;
use etendue::render::{DeviceOptions, Renderer};
use etendue::scene::Scene;
use etendue::settings::{Estimator, Settings};

use super::failure::{FAILED, Failure, Outcome, USAGE};
use super::render::load_scene;
use super::settings::frame;
use super::write_stderr;
use args::BenchArgs;
use contest::Contest;
use peer::Peer;
use record::{Line, Machine, SCHEMA};

/// Width of the frame when none is asked for, pixels.
const WIDTH: u32 = 256;

/// Measures what was asked for. What is measured is written at once: a bench that is interrupted keeps its lines.
pub fn run(args: &BenchArgs) -> Result<Outcome, Failure> {
    probe_writable(&args.output).map_err(Failure::usage)?;
    let mut peers = Vec::new();
    if let Some(folder) = &args.peers {
        let usage = |error| Failure::new(USAGE, error, "start the peers");
        for script in peer::scripts(folder).map_err(usage)? {
            let peer = Peer::start(&args.python, &script).map_err(usage)?;
            peers.push(Rc::new(RefCell::new(peer)));
        }
    }
    let mut scenes = Vec::new();
    for path in &args.scenes {
        let start = Instant::now();
        let (scene, _) = load_scene(path, None, (1.0, 0.0), None)?;
        scenes.push((path, scene, start.elapsed().as_secs_f64()));
    }
    let options = DeviceOptions {
        device: args.device.clone(),
        ..DeviceOptions::default()
    };
    let device = device(args, &options)?;
    let mut out = Output::create(args)?;
    out.line(&Line::Machine(machine(&device)))?;
    for (path, scene, load) in &scenes {
        let settings = settings(args, scene)?;
        let contest = Contest {
            args,
            path,
            scene,
            settings: &settings,
            options: &options,
            load: *load,
        };
        contest.run(&peers, &mut out)?;
        out.note(&format!("{}: rates", scene_name(path)));
        let rounds = args.seeds;
        let backends = rates::offered(path, &device.0, &mut out)?;
        for estimator in [Estimator::Full, Estimator::Textbook] {
            let ways = &args.estimators;
            if !ways.iter().any(|way| way.estimator() == estimator) {
                continue;
            }
            let settings = Settings {
                estimator,
                ..settings.clone()
            };
            rates::run(
                path, scene, &settings, &options, rounds, &backends, &mut out,
            )?;
        }
        if args.limits {
            out.note(&format!("{}: limits", scene_name(path)));
            limits::run(path, scene, &settings, &options, rounds, &mut out)?;
        }
    }
    for sweep in &args.growth {
        growth::run(args, *sweep, &options, &mut out)?;
    }
    Ok(Outcome::Done)
}

fn settings(args: &BenchArgs, scene: &Scene) -> Result<Settings, Failure> {
    let (width, height) = frame(scene, None, args.width, args.height, WIDTH);
    let settings = Settings {
        width,
        height,
        max_depth: args.max_depth,
        backend: args.backend.into(),
        ..Settings::default()
    };
    settings.validate()?;
    Ok(settings)
}

/// Names of the device that is going to be used, and of its driver.
fn device(args: &BenchArgs, options: &DeviceOptions) -> Result<(String, String), Failure> {
    let settings = Settings {
        width: 1,
        height: 1,
        backend: args.backend.into(),
        ..Settings::default()
    };
    let report = Renderer::new(&Scene::default(), &settings, options)?.report();
    Ok((report.device, report.driver))
}

fn machine((device, driver): &(String, String)) -> Machine {
    let read = |path: &str| std::fs::read_to_string(path).ok();
    let cpu = read("/proc/cpuinfo").and_then(|text| {
        let line = text.lines().find(|l| l.starts_with("model name"))?;
        Some(line.split_once(':')?.1.trim().to_owned())
    });
    let load = read("/proc/loadavg").and_then(|text| text.split(' ').next()?.parse().ok());
    let words = std::env::args().skip(1);
    let words: Vec<String> = std::iter::once(String::from("etendue"))
        .chain(words)
        .collect();
    Machine {
        schema: SCHEMA,
        version: env!("CARGO_PKG_VERSION").to_owned(),
        device: device.clone(),
        driver: driver.clone(),
        cpu: cpu.unwrap_or_else(|| std::env::consts::ARCH.to_owned()),
        cores: std::thread::available_parallelism().map_or(1, |n| n.get()),
        os: std::env::consts::OS.to_owned(),
        load,
        command: words.join(" "),
    }
}

/// The name of a scene's file without its suffix.
fn scene_name(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or(path.as_os_str());
    stem.to_string_lossy().into_owned()
}

/// The bench file, and what is said meanwhile.
pub struct Output {
    path: PathBuf,
    file: File,
    quiet: bool,
}

impl Output {
    fn create(args: &BenchArgs) -> Result<Self, Failure> {
        let file = File::create(&args.output)
            .map_err(|error| Failure::new(FAILED, error, "write the bench file"))?;
        Ok(Self {
            path: args.output.clone(),
            file,
            quiet: args.quiet,
        })
    }

    /// Writes a line, whole.
    pub fn line(&mut self, line: &Line) -> Result<(), Failure> {
        let fail = |error: anyhow::Error| Failure::new(FAILED, error, "write the bench file");
        let mut text = serde_json::to_string(line).map_err(|e| fail(e.into()))?;
        text.push('\n');
        let written = self.file.write_all(text.as_bytes());
        written.map_err(|e| fail(e.into()))
    }

    /// Tells people how far it is.
    pub fn note(&self, text: &str) {
        if !self.quiet {
            write_stderr(text);
        }
    }

    /// The folder NAME.`suffix` beside the file.
    fn beside(&self, suffix: &str) -> PathBuf {
        self.path.with_extension(suffix)
    }

    /// A file through which a peer hands over a picture.
    fn scratch(&self) -> PathBuf {
        let path = self.path.with_extension("peer.f32");
        std::path::absolute(&path).unwrap_or(path)
    }

    /// How a file in a folder beside this one is called from here.
    fn relative(&self, path: &Path) -> String {
        let folder = self.path.parent().unwrap_or(Path::new(""));
        let inside = path.strip_prefix(folder).unwrap_or(path);
        inside.to_string_lossy().replace('\\', "/")
    }
}
