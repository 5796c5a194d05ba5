//! What is known about a render, under the names of the EXR header. `stats.rs`
//! nests the same names (`times.load` …), so both files agree.

use std::ops::Range;
use std::path::Path;

use etendue::film::Film;
use etendue::image_io::{Aov, Image, Metadata, Value};
use etendue::layout::{SHARE_HEIGHT, SHARE_WIDTH};
use etendue::render::Report;
use etendue::scene::Scene;
use etendue::settings::Settings;

use super::args::{Backend, RenderArgs};
use super::rerender::Repeat;

/// The name of the limit that ended a render.
pub const STOP: &str = "ledger.stop";

/// Samples of the pilot that spread those of the picture.
pub const PILOT: &str = "pilot";

/// Which limit ended a render.
#[derive(Clone, Copy, PartialEq)]
pub enum Stop {
    /// All samples are there.
    Samples,
    /// `--time`
    Time(f64),
    /// `--noise`
    Noise(f64),
    /// Ctrl-C or SIGTERM.
    Interrupt,
}

/// What is to be rendered.
pub struct Job<'a> {
    /// What was typed.
    pub args: &'a RenderArgs,
    /// What it means.
    pub settings: Settings,
    /// The scene with the environment of the arguments.
    pub scene: Scene,
    /// SHA-256 of the file of `--env`.
    pub env_hash: Option<String>,
    /// Seconds it took to load the scene.
    pub load: f64,
    /// The render that this one repeats.
    pub repeats: Option<&'a Repeat>,
}

/// Everything about a render that has ended.
pub struct Record<'a> {
    /// What was rendered.
    pub job: &'a Job<'a>,
    /// What the renderer says.
    pub report: &'a Report,
    /// The result.
    pub film: &'a Film,
    /// The layers that are not in the film.
    pub layers: &'a [(Aov, Vec<f32>)],
    /// Why it ended.
    pub stop: Stop,
}

impl Record<'_> {
    /// The header: all that is needed to render the file again and to judge it.
    pub fn metadata(&self) -> Metadata {
        let mut data = self.job.metadata();
        let mut put = |name: &str, value: Value| data.insert(name.to_owned(), value);
        put("backend", self.report.backend.name().into());
        put("backend_reason", self.report.backend_reason.as_str().into());
        put("device", self.report.device.as_str().into());
        put("driver", self.report.driver.as_str().into());
        let features = self.report.features.iter().filter(|f| f.on);
        let features: Vec<_> = features.map(|f| f.name).collect();
        put("features", features.join(" ").into());
        let shares = self
            .report
            .features
            .iter()
            .any(|f| f.name == "share" && f.on);
        for (name, size) in Image::SHARE.into_iter().zip([SHARE_WIDTH, SHARE_HEIGHT]) {
            if shares {
                put(name, f64::from(size).into());
            }
        }
        put("samples", ranges(&self.film.ranges()).into());
        put("spp", count(self.film.mean_of(self.film.samples())));
        if self.job.settings.adaptive {
            put(PILOT, count(self.film.allotment().pilot()));
        }
        put("times.load", self.job.load.into());
        put("times.build", self.report.times.build.into());
        put("times.compile", self.report.times.compile.into());
        put("times.render", self.report.times.render.into());
        let ledger = &self.report.ledger;
        put("ledger.non_finite", count(ledger.non_finite));
        put("ledger.truncated_paths", count(ledger.truncated_paths));
        // per path: what they would have added if unit radiance had met each of them
        let throughput = ledger.truncated_throughput / self.report.paths.max(1) as f64;
        put("ledger.truncated_throughput", throughput.into());
        put(
            "ledger.interior_overflows",
            count(ledger.interior_overflows),
        );
        // a limit that looks at the samples favours images that look finished early
        put(STOP, self.stop_text().into());
        data
    }

    /// The reason for the end, as in the header.
    pub fn stop_text(&self) -> String {
        let repeated = self.job.repeats.and_then(|repeat| repeat.header.get(STOP));
        match (self.stop, repeated) {
            // the same samples, chosen by the same limit
            (Stop::Samples, Some(Value::Text(stop))) => stop.clone(),
            (Stop::Samples, _) => String::from("samples"),
            (Stop::Time(limit), _) => format!("time {limit}"),
            (Stop::Noise(limit), _) => format!("noise {limit}"),
            (Stop::Interrupt, _) => String::from("interrupt"),
        }
    }
}

impl Job<'_> {
    /// The samples to render.
    pub fn samples(&self) -> Vec<Range<u64>> {
        match self.repeats {
            Some(repeat) => repeat.samples.clone(),
            None => vec![self.settings.samples.clone()],
        }
    }

    /// What can be said before anything is rendered.
    pub fn metadata(&self) -> Metadata {
        let mut data = Metadata::new();
        let mut put = |name: &str, value: Value| data.insert(name.to_owned(), value);
        put("version", env!("CARGO_PKG_VERSION").into());
        put("build", etendue::BUILD.into());
        put("scene", path(&self.args.scene));
        put("scene_hash", self.scene.hash.as_str().into());
        self.put_settings(&mut data);
        data
    }

    /// Every setting under its option's name.
    fn put_settings(&self, data: &mut Metadata) {
        let (args, settings) = (self.args, &self.settings);
        let mut put = |name: &str, value: Value| data.insert(format!("settings.{name}"), value);
        put("width", f64::from(settings.width).into());
        put("height", f64::from(settings.height).into());
        if let Some(crop) = settings.crop {
            let crop = [crop.x0, crop.y0, crop.x1, crop.y1].map(|x| x.to_string());
            put("crop", crop.join(",").into());
        }
        let range = &settings.samples;
        put("samples", format!("{}..{}", range.start, range.end).into());
        for (name, limit) in [("time", args.time), ("noise", args.noise)] {
            if let Some(limit) = limit {
                put(name, limit.into());
            }
        }
        // all 64 bits count
        put("seed", settings.seed.to_string().into());
        put("max_depth", f64::from(settings.max_depth).into());
        let backend = if args.backend == Backend::Auto {
            "auto"
        } else {
            settings.backend.name()
        };
        put("backend", backend.into());
        put("estimator", settings.estimator.name().into());
        if settings.adaptive {
            put("adaptive", 1.0.into());
        }
        if settings.share {
            put("share", 1.0.into());
        }
        let strategy = format!("{:?}", settings.strategy).to_lowercase();
        put("strategy", strategy.into());
        match settings.camera {
            Some(index) => {
                put("camera", (index as f64).into());
                put(
                    "camera_name",
                    self.scene.cameras[index].name.as_str().into(),
                );
            }
            None => drop(put("camera", "default".into())),
        }
        if let Some(file) = &args.env {
            put("env", path(file));
            put("env_hash", self.env_hash.clone().unwrap_or_default().into());
            put("env_intensity", args.env_intensity.into());
            put("env_rotation", args.env_rotation.into());
        }
        if let Some(device) = &args.device {
            put("device", device.as_str().into());
        }
        let aovs: Vec<_> = args.aovs().into_iter().map(|aov| aov.name()).collect();
        put("aov", aovs.join(",").into());
    }
}

/// `A..B,C..D`
pub fn ranges(ranges: &[Range<u64>]) -> String {
    let texts: Vec<_> = ranges
        .iter()
        .map(|r| format!("{}..{}", r.start, r.end))
        .collect();
    texts.join(",")
}

fn path(path: &Path) -> Value {
    path.to_string_lossy().into_owned().into()
}

/// Counts are exact up to 2^53.
fn count(count: u64) -> Value {
    Value::Number(count as f64)
}
