//! `--checkpoint` and `--resume`.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use etendue::checkpoint;
use etendue::film::Film;
use etendue::image_io::Metadata;
use etendue::render::{Ledger, Progress, Report, Work};
use etendue::{Error, Result};

use super::args::RenderArgs;
use super::failure::Failure;
use super::header::{Job, Record, Stop};
use super::identity::{DEVICE, JOB, check, number};

/// The header of the EXR has a mean of it, which is rounded.
const THROUGHPUT: &str = "work.truncated_throughput";
const RAYS: &str = "work.rays";

/// A checkpoint that was read.
pub struct Saved {
    path: PathBuf,
    header: Metadata,
    /// Its samples.
    pub film: Film,
}

/// Reads the checkpoint to go on from. It is locked already: somebody may have finished one
/// before.
pub fn open(args: &RenderArgs) -> Result<Option<Saved>, Failure> {
    let Some(path) = args.checkpoint.as_ref().filter(|path| path.exists()) else {
        return Ok(None);
    };
    if !args.resume {
        let what = format!(
            "{} is there; --resume goes on from it, removing it starts anew",
            path.display()
        );
        let name = "--checkpoint";
        return Err(Failure::usage(Error::Settings { name, what }));
    }
    let (header, film) = checkpoint::read(path).map_err(Failure::usage)?;
    let path = path.clone();
    Ok(Some(Saved { path, header, film }))
}

impl Saved {
    /// Refuses another scene, other settings or another build.
    pub fn check_job(&self, job: &Job) -> Result<()> {
        check(&self.path, &self.header, &job.metadata(), "here", JOB)?;
        let mismatch = |field, what| {
            let path = self.path.clone();
            Err(Error::Mismatch { path, field, what })
        };
        if self.film.has_aovs() != job.settings.aovs {
            let what = "only one of them has layers of the first hit";
            return mismatch("settings.aov", String::from(what));
        }
        let Range { start, end } = job.settings.samples;
        let asked = start..self.film.allotment().least(end);
        for held in self.film.ranges() {
            if held.start < asked.start || held.end > asked.end {
                let what = format!(
                    "{}..{} there, {}..{} here",
                    held.start, held.end, asked.start, asked.end
                );
                return mismatch("samples", what);
            }
        }
        Ok(())
    }

    /// Refuses another device.
    pub fn check_device(&self, record: &Record) -> Result<()> {
        check(&self.path, &self.header, &record.metadata(), "here", DEVICE)
    }

    /// What the samples took.
    pub fn work(&self) -> Work {
        let number = |name: &str| number(&self.header, name).unwrap_or(0.0);
        let count = |name: &str| number(name) as u64;
        Work {
            rays: count(RAYS),
            seconds: number("times.render"),
            ledger: Ledger {
                non_finite: count("ledger.non_finite"),
                truncated_paths: count("ledger.truncated_paths"),
                truncated_throughput: number(THROUGHPUT),
                interior_overflows: count("ledger.interior_overflows"),
            },
        }
    }
}

/// What checkpoints took during a render; the last one comes after it.
#[derive(Clone, Copy, Default)]
pub struct Cost {
    /// How many were written.
    pub count: u64,
    /// For which the render waited.
    pub time: Duration,
}

/// Writes checkpoints at an interval.
pub struct Keeper<'a> {
    path: &'a Path,
    interval: Duration,
    last: Instant,
    job: &'a Job<'a>,
    report: Report,
    /// So far.
    pub cost: Cost,
}

impl<'a> Keeper<'a> {
    /// A keeper, if one was asked for.
    pub fn new(job: &'a Job, report: &Report) -> Option<Self> {
        let path = job.args.checkpoint.as_deref()?;
        // too long for a duration: never
        let interval = Duration::try_from_secs_f64(job.args.checkpoint_interval);
        Some(Self {
            path,
            interval: interval.unwrap_or(Duration::MAX),
            last: Instant::now(),
            job,
            report: report.clone(),
            cost: Cost::default(),
        })
    }

    /// Writes a checkpoint if it is time for one.
    pub fn update(&mut self, progress: &Progress) -> Result<()> {
        if !progress.pass_complete || self.last.elapsed() < self.interval {
            return Ok(());
        }
        let start = Instant::now();
        let Work {
            rays,
            seconds,
            ledger,
        } = progress.work;
        self.report.rays = rays;
        self.report.ledger = ledger;
        self.report.times.render = seconds;
        self.report.paths = progress.samples_done * progress.film.pixels() as u64;
        let record = Record {
            job: self.job,
            report: &self.report,
            film: progress.film,
            layers: &[],
            stop: Stop::Interrupt,
        };
        let result = save(self.path, &record);
        self.last = Instant::now();
        self.cost.count += u64::from(result.is_ok());
        self.cost.time += self.last - start;
        result
    }
}

/// Writes a checkpoint.
pub fn save(path: &Path, record: &Record) -> Result<()> {
    let mut header = record.metadata();
    header.insert(RAYS.to_owned(), (record.report.rays as f64).into());
    let throughput = record.report.ledger.truncated_throughput;
    header.insert(THROUGHPUT.to_owned(), throughput.into());
    checkpoint::write(path, &header, record.film)
}
