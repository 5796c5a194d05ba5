//! `etendue rerender`: an image once more, from what its header says.

use std::ops::Range;
use std::path::{Path, PathBuf};

use clap::Parser;
use etendue::image_io::{Metadata, read_exr};
use etendue::{Error, Result};

use super::args::{Arguments, Command, RenderArgs, RerenderArgs};
use super::failure::{Failure, Outcome};
use super::header::{Job, PILOT, Record};
use super::identity::{DEVICE, JOB, check, number, show, text};
use super::progress::Reporter;
use super::{numbers, render};

/// A render to be done again.
pub struct Repeat {
    path: PathBuf,
    /// What its image says.
    pub header: Metadata,
    /// Its samples.
    pub samples: Vec<Range<u64>>,
}

/// Renders an image again.
pub fn run(args: &RerenderArgs) -> Result<Outcome, Failure> {
    let image = read_exr(&args.image).map_err(Failure::usage)?;
    let is_shard = image.film().is_ok();
    let repeat = Repeat {
        samples: samples(&args.image, &image.metadata, "samples").map_err(Failure::usage)?,
        path: args.image.clone(),
        header: image.metadata,
    };
    let args = repeat.arguments(args, is_shard).map_err(Failure::usage)?;
    render::repeat(&args, Some(&repeat))
}

/// Ranges of samples in a header.
pub fn samples(path: &Path, header: &Metadata, field: &str) -> Result<Vec<Range<u64>>> {
    let parse = |text: &str| {
        let ranges = text.split(',').map(|range| numbers::samples(range).ok());
        ranges.collect::<Option<Vec<_>>>()
    };
    let ranges = text(header, field).and_then(parse);
    let ordered = |r: &Vec<Range<u64>>| r.windows(2).all(|pair| pair[0].end < pair[1].start);
    ranges.filter(ordered).ok_or_else(|| Error::Image {
        path: path.to_owned(),
        what: format!(
            "its header has {} as {field}; it is no image of `etendue render`",
            show(header, field)
        ),
    })
}

impl Repeat {
    /// The arguments of `etendue render` that the header stands for.
    fn arguments(&self, args: &RerenderArgs, is_shard: bool) -> Result<RenderArgs> {
        let header = &self.header;
        let setting = |name: &str| {
            let name = format!("settings.{name}");
            header.get(&name).map(|_| show(header, &name))
        };
        let mut words: Vec<String> = Vec::new();
        let mut put = |option: &str, value: Option<String>| {
            words.extend(value.map(|value| format!("--{option}={value}")));
        };
        let asked = samples(&self.path, header, "settings.samples")?;
        let asked = (asked[0].start, asked[asked.len() - 1].end);
        match is_shard || asked.0 > 0 {
            true => put("samples", Some(format!("{}..{}", asked.0, asked.1))),
            false => put("spp", Some(asked.1.to_string())),
        }
        for name in ["width", "height", "crop", "seed", "max-depth", "estimator"] {
            put(name, setting(&name.replace('-', "_")));
        }
        put("backend", text(header, "backend").map(String::from));
        if number(header, "settings.camera").is_some() {
            // names come first; `check_job` finds out whether this was the one
            let name = setting("camera_name").filter(|name| !name.is_empty());
            put("camera", name.or_else(|| setting("camera")));
        }
        put("aov", setting("aov").filter(|list| !list.is_empty()));
        let env = args.env.as_ref().map(|path| path.display().to_string());
        if setting("env").is_some() {
            put("env", env.or_else(|| setting("env")));
            put("env-intensity", setting("env_intensity"));
            put("env-rotation", setting("env_rotation"));
        }
        put("device", args.device.clone().or_else(|| setting("device")));
        words.extend(setting("adaptive").map(|_| String::from("--adaptive")));
        words.extend(setting("share").map(|_| String::from("--share")));
        let scene = text(header, "scene").map(PathBuf::from);
        let scene = args.scene.clone().or(scene).unwrap_or_default();
        let start = ["etendue", "render", "scene", "-o", "out.exr"].map(String::from);
        let parsed = Arguments::try_parse_from(start.into_iter().chain(words));
        match parsed.map(|arguments| arguments.command) {
            Ok(Command::Render(parsed)) => Ok(RenderArgs {
                scene,
                output: args.output.clone(),
                quiet: args.quiet,
                ..*parsed
            }),
            Ok(_) => unreachable!("the words say render"),
            Err(error) => Err(Error::Image {
                path: self.path.clone(),
                what: format!("its header cannot be carried out: {error}"),
            }),
        }
    }

    /// Samples of the pilot that spread those of the picture.
    pub fn pilot(&self) -> u64 {
        number(&self.header, PILOT).unwrap_or(0.0) as u64
    }

    /// Refuses a scene that is not the one of the header any more.
    pub fn check_job(&self, job: &Job) -> Result<(), Failure> {
        let fields: Vec<_> = JOB.iter().copied().filter(|f| !is_build(f)).collect();
        let whose = "here";
        check(&self.path, &self.header, &job.metadata(), whose, &fields).map_err(Failure::scene)
    }

    /// Says why the bits may differ.
    pub fn warn_about(&self, record: &Record, reporter: &Reporter) {
        let here = record.metadata();
        let build = JOB.iter().filter(|field| is_build(field));
        for field in build.chain(DEVICE) {
            if self.header.get(*field) != here.get(*field) {
                reporter.warn(&format!(
                    "{field} differs: {} in {}, {} here; so may the last bits of the picture",
                    show(&self.header, field),
                    self.path.display(),
                    show(&here, field)
                ));
            }
        }
    }
}

fn is_build(field: &str) -> bool {
    matches!(field, "version" | "build")
}
