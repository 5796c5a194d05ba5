//! What a render will take: devices, `--dry-run`, and the memory of the host.

use std::fs;
use std::ops::Range;
use std::path::Path;

use etendue::film::Film;
use etendue::render::{self, DeviceInfo, DeviceOptions};
use etendue::settings::{BackendChoice, Settings};
use etendue::{Error, Result};

use super::args::RenderArgs;
use super::failure::Failure;
use super::header::Job;
use super::info::{bytes, memory_text};
use super::write_stdout;

/// Copies of a film's node that are alive while a pass is added to it: the node, the
/// pass, and their sum.
const NODES: u64 = 3;

/// Least bytes of the host's memory that the sums of samples take.
fn host_bytes(settings: &Settings) -> u64 {
    let film = Film::of(settings);
    NODES * 4 * film.pixels() as u64 * film.floats_per_pixel() as u64
}

/// Bytes that processes can still get; unknown outside Linux.
fn free_host_bytes() -> Option<u64> {
    let text = fs::read_to_string("/proc/meminfo").ok()?;
    let kibibytes = |name: &str| -> Option<u64> {
        let line = text.lines().find_map(|line| line.strip_prefix(name))?;
        line.trim().strip_suffix("kB")?.trim().parse().ok()
    };
    Some(1024 * (kibibytes("MemAvailable:")? + kibibytes("SwapFree:")?))
}

/// Refuses a picture that the host's memory cannot hold.
pub fn check_host(settings: &Settings) -> Result<()> {
    let needed = host_bytes(settings);
    match free_host_bytes() {
        Some(free) if needed > free => Err(Error::OutOfMemory {
            what: format!("a picture of this size, with {free} bytes of host memory free,"),
            bytes: needed,
        }),
        _ => Ok(()),
    }
}

/// The devices of `--device`: one, `all`, or several by their indices.
pub fn devices(args: &RenderArgs) -> Result<Vec<DeviceOptions>> {
    let options = |device: Option<String>| DeviceOptions {
        device,
        cache: args.cache().map(Path::to_path_buf),
        ..DeviceOptions::default()
    };
    let Some(text) = &args.device else {
        return Ok(vec![options(None)]);
    };
    let indices: Option<Vec<usize>> = text
        .split(',')
        .map(|part| part.trim().parse().ok())
        .collect();
    let indices = match indices {
        Some(indices) => indices,
        None if text == "all" => all(args)?,
        // names may have commas
        None => return Ok(vec![options(Some(text.clone()))]),
    };
    let option = |index: &usize| options(Some(index.to_string()));
    Ok(indices.iter().map(option).collect())
}

/// Every device that can trace as asked. A driver that computes on the processor would
/// only slow a machine with better ones down.
fn all(args: &RenderArgs) -> Result<Vec<usize>> {
    let choice = match BackendChoice::from(args.backend) {
        BackendChoice::Auto => BackendChoice::Bvh,
        choice => choice,
    };
    let is_able = |device: &DeviceInfo| {
        let mut backends = device.backends.iter();
        backends.any(|(backend, support)| *backend == choice && support.is_ok())
    };
    let able: Vec<_> = render::devices()?.into_iter().filter(is_able).collect();
    let is_slow = |device: &DeviceInfo| device.kind == "cpu";
    let keeps_slow = able.iter().all(is_slow);
    let chosen = able.iter().filter(|device| keeps_slow || !is_slow(device));
    Ok(chosen.map(|device| device.index).collect())
}

/// Says what the render would take.
pub fn show(job: &Job, devices: &[DeviceOptions]) -> Result<(), Failure> {
    let mut text = String::new();
    for options in devices {
        let plan = render::plan(&job.scene, &job.settings, options)?;
        text += &format!(
            "device         {}\n\
             backend        {} ({})\n\
             device memory  {}; {} free\n",
            plan.device,
            plan.backend.name(),
            plan.backend_reason,
            memory_text(&plan.memory),
            bytes(plan.free),
        );
    }
    let host = free_host_bytes().map_or(String::new(), |free| format!(" of {} free", bytes(free)));
    let needed = bytes(host_bytes(&job.settings));
    let Range { start, end } = job.settings.samples;
    text += &format!("film on host   {needed}{host}\nsamples        {start}..{end}\n");
    write_stdout(&text)
}
