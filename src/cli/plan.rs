//! What a render will take: `--dry-run`, and the memory of the host.

use std::fs;

use etendue::film::Film;
use etendue::render::{self, DeviceOptions};
use etendue::settings::Settings;
use etendue::{Error, Result};

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

/// Says what the render would take.
pub fn show(job: &Job, options: &DeviceOptions) -> Result<(), Failure> {
    let plan = render::plan(&job.scene, &job.settings, options)?;
    let host = free_host_bytes().map_or(String::new(), |free| format!(" of {} free", bytes(free)));
    write_stdout(&format!(
        "device         {}\n\
         backend        {} ({})\n\
         samples        {}..{}\n\
         device memory  {}; {} free\n\
         film on host   {}{host}\n",
        plan.device,
        plan.backend.name(),
        plan.backend_reason,
        job.settings.samples.start,
        job.settings.samples.end,
        memory_text(&plan.memory),
        bytes(plan.free),
        bytes(host_bytes(&job.settings)),
    ))
}
