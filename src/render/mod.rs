//! Introduces scenes to devices: chooses a traversal, uploads, runs batches and
//! collects the film. A render is a pure function of (scene, settings); batch
//! sizes, and stopping and going on, do not change a bit of it.

mod allot;
mod backend;
mod boxes;
mod cache;
mod curve;
mod emitters;
mod environment;
pub mod geometry;
mod identity;
mod light_tree;
mod lights;
mod media;
mod meter;
mod pace;
mod passes;
mod photons;
mod planes;
mod report;
mod room;
pub mod solids;
mod stream;
mod team;
mod traversal;
mod tuning;
mod upload;
mod view;
mod vulkan;
#[cfg(feature = "wgpu")]
mod wgpu;
mod workshop;

use std::ops::Range;
use std::path::PathBuf;
use std::time::Instant;

use crate::error::{Error, Result};
use crate::film::{Allotment, Film};
use crate::gpu::{self, Caps};
use crate::layout::{ProbeHit, ProbeRay};
use crate::scene::Scene;
use crate::settings::{BackendChoice, Settings};

pub use identity::{Identities, Owner};
pub use meter::Reading;
pub use report::{
    Control, DeviceInfo, Feature, Ledger, Memory, Plan, Progress, Report, SceneModel, Times, Work,
};
pub use stream::{Stream, Studied, TraversalCounts};
pub use team::Team;
pub use tuning::{Study, Tuning};
pub use workshop::Workshop;

#[cfg(feature = "wgpu")]
use self::wgpu::WgpuBackend;
use backend::{Backend, Band, Batch};
use pace::Pace;
use passes::Passes;
use upload::SceneData;
use vulkan::VulkanBackend;

/// A batch aims at this long, seconds: far below the watchdogs of drivers (2 s on Windows).
const BATCH_SECONDS: f64 = 0.1;
/// A pass aims at no more than this long, seconds: what a stop may throw away.
const PASS_SECONDS: f64 = 1.0;
/// Tiles of the first batch: few enough for the slowest device and scene.
const FIRST_BATCH_TILES: u32 = 16;

/// Which device, whether to watch it, and what there is from earlier renders.
#[derive(Clone, Debug, Default)]
pub struct DeviceOptions {
    /// Index or part of the name; `None` takes the fastest kind.
    pub device: Option<String>,
    /// Runs the Khronos validation layer.
    pub validation: bool,
    /// Folder that keeps trees of scenes, so that they need not be built again; safe to delete.
    pub cache: Option<PathBuf>,
}

/// Renders one scene with one group of settings on one device.
pub struct Renderer {
    backend: Box<dyn Backend>,
    settings: Settings,
    tuning: Tuning,
    tiles_per_batch: u32,
    pace: Pace,
    owners: Vec<Owner>,
    allotment: Allotment,
    report: Report,
    /// The complete passes of a render that failed.
    finished: Option<(Film, Work)>,
}

impl Renderer {
    /// Opens a device, uploads the scene and compiles what it needs.
    ///
    /// # Errors
    /// Settings out of range, no device that can do it, or too little memory.
    pub fn new(scene: &Scene, settings: &Settings, options: &DeviceOptions) -> Result<Self> {
        Self::tuned(scene, settings, options, Tuning::default())
    }

    /// As [`Self::new`], with details that do not change the picture.
    #[doc(hidden)]
    pub fn tuned(
        scene: &Scene,
        settings: &Settings,
        options: &DeviceOptions,
        tuning: Tuning,
    ) -> Result<Self> {
        Self::made(scene, settings, options, tuning, None)
    }

    /// As [`Self::tuned`], with devices and kernels that others had before.
    #[doc(hidden)]
    pub fn made_in(
        workshop: &Workshop,
        scene: &Scene,
        settings: &Settings,
        options: &DeviceOptions,
        tuning: Tuning,
    ) -> Result<Self> {
        Self::made(scene, settings, options, tuning, Some(workshop))
    }

    fn made(
        scene: &Scene,
        settings: &Settings,
        options: &DeviceOptions,
        tuning: Tuning,
        workshop: Option<&Workshop>,
    ) -> Result<Self> {
        settings.validate()?;
        if let Some(camera) = settings.camera.filter(|c| *c >= scene.cameras.len()) {
            return Err(Error::Settings {
                name: "--camera",
                what: format!(
                    "there is no camera {camera}; the scene has {}",
                    scene.cameras.len()
                ),
            });
        }
        let start = Instant::now();
        let (device, choice, reason) = vulkan::open(settings.backend, options, workshop)?;
        let mut data = SceneData::new(scene, settings, tuning.copy_limit);
        data.geometry.check()?;
        if tuning.everything {
            data.spec = data.spec.with_everything();
        }
        let mut backend: Box<dyn Backend> = match choice {
            #[cfg(feature = "wgpu")]
            way if BackendChoice::WGPU.contains(&way) => {
                Box::new(WgpuBackend::new(device.caps(), way, &data, &tuning)?)
            }
            _ => {
                let bvh = traversal::own_tree(choice, &data, options.cache.as_deref())?;
                Box::new(VulkanBackend::new(&device, choice, &data, bvh, &tuning)?)
            }
        };
        let build = start.elapsed().as_secs_f64();
        let start = Instant::now();
        backend.warm_up()?;
        let compile = start.elapsed().as_secs_f64();
        let caps = device.caps();
        tracing::info!(backend = choice.name(), reason, device = caps.name, "ready");
        let features = features(backend.frame().spec);
        let report = Report {
            backend: choice,
            backend_reason: reason,
            device: caps.name.clone(),
            driver: caps.driver.clone(),
            features,
            times: Times {
                build,
                compile,
                render: 0.0,
            },
            memory: backend.memory(),
            rays: 0,
            paths: 0,
            ledger: Ledger::default(),
        };
        Ok(Self {
            backend,
            settings: settings.clone(),
            tuning,
            tiles_per_batch: FIRST_BATCH_TILES.min(tuning.max_tiles),
            pace: Pace::default(),
            owners: data.geometry.owners,
            allotment: Allotment::default(),
            report,
            finished: None,
        })
    }

    /// Takes other samples or another seed from here on; nothing is built or compiled again.
    ///
    /// # Errors
    /// No samples, or the device fails.
    pub fn restart(&mut self, samples: Range<u64>, seed: u64) -> Result<()> {
        let mut settings = self.settings.clone();
        settings.samples = samples;
        settings.seed = seed;
        settings.validate()?;
        self.backend.set_seed(seed)?;
        self.settings = settings;
        Ok(())
    }

    /// Renders the samples of the settings in passes, calling `control` after
    /// every batch. After [`Control::Stop`] the film holds the complete passes.
    ///
    /// # Errors
    /// The device fails.
    pub fn render(&mut self, control: &mut dyn FnMut(&Progress) -> Control) -> Result<Film> {
        let samples = self.settings.samples.clone();
        self.resume(self.empty_film(), Work::default(), &[samples], control)
    }

    /// As [`Self::render`], but goes on with `film`, which `before` was spent on,
    /// and renders what it lacks of `samples` (in order, disjoint). The film then
    /// has the same bits as if it had been rendered at once.
    ///
    /// # Errors
    /// The device fails, or the film is not one of these settings. [`Self::take_finished`]
    /// has what was complete by then.
    pub fn resume(
        &mut self,
        mut film: Film,
        before: Work,
        samples: &[Range<u64>],
        control: &mut dyn FnMut(&Progress) -> Control,
    ) -> Result<Film> {
        // refuses a film of other settings, and says what differs
        film.merge(self.empty_film())?;
        let mut work = before;
        let start = Instant::now();
        let result = self.passes(&mut film, &mut work, samples, start, control);
        let seconds = before.seconds + start.elapsed().as_secs_f64();
        self.report.note(&film, &work, seconds);
        self.report.memory.film = self.backend.memory().film + film.bytes();
        keep_finished(&mut self.finished, result, film, work)
    }

    /// The complete passes of the last render, if it failed, and what they took.
    pub fn take_finished(&mut self) -> Option<(Film, Work)> {
        self.finished.take()
    }

    /// Renders what the film lacks, pass by pass.
    fn passes(
        &mut self,
        film: &mut Film,
        work: &mut Work,
        samples: &[Range<u64>],
        start: Instant,
        control: &mut dyn FnMut(&Progress) -> Control,
    ) -> Result<()> {
        let before = work.seconds;
        let missing = film.missing(samples);
        let samples_before = film.samples();
        let total = samples_before + missing.iter().map(|r| r.end - r.start).sum::<u64>();
        let params = self.backend.frame().params;
        let pixels = u64::from(params.window_width) * u64::from(params.window_height);
        let most = self.tuning.max_pass >> self.allotment.most();
        let mut passes = Passes::new(missing, pixels, most);
        while let Some((first, level)) = passes.upcoming() {
            let pass_start = Instant::now();
            let done = (samples_before + passes.done()) as f64;
            let size = (1u64 << level) as f64;
            let mut tell = |share: f64, pass_complete: bool, film: &Film, work: &Work| {
                control(&Progress {
                    film,
                    work: *work,
                    samples_before: film.mean_of(samples_before),
                    samples_done: film.mean_of(film.samples()),
                    samples_total: film.mean_of(total),
                    fraction: (done + share * size) / total as f64,
                    pass_complete,
                    elapsed: start.elapsed(),
                })
            };
            self.backend.reset_ledger()?;
            let mut between = |share: f64| tell(share, false, film, work);
            let Some(values) = self.pass(first, level, &mut between)? else {
                break;
            };
            // first, so that a film never has samples whose ledger is missing
            let (rays, ledger) = self.backend.ledger()?;
            film.add(first, level, values)?;
            work.rays += rays;
            work.ledger.add(&ledger);
            work.seconds = before + start.elapsed().as_secs_f64();
            passes.finish(pass_start.elapsed().as_secs_f64(), PASS_SECONDS);
            if tell(1.0, true, film, work) == Control::Stop {
                break;
            }
        }
        Ok(())
    }

    /// Renders one node of the film's tree in batches; `between` hears the share
    /// of the pass that is done. `None` when it asked to stop.
    fn pass(
        &mut self,
        first: u64,
        level: u32,
        between: &mut dyn FnMut(f64) -> Control,
    ) -> Result<Option<Vec<f32>>> {
        let mut values = Vec::new();
        for Band { tiles, pixels } in self.backend.frame().bands() {
            let mut tile = tiles.start;
            while tile < tiles.end {
                let mut count = self.tiles_per_batch.min(tiles.end - tile);
                let is_together = self.pace.is_together();
                let is_trial = self.pace.is_trial(1 << level);
                if is_trial {
                    count = count.min(Pace::trial_tiles(tiles.end - tiles.start));
                }
                let rays_before = if is_trial {
                    self.backend.ledger()?.0
                } else {
                    0
                };
                let seconds = self.backend.render(&Batch {
                    first_sample: first,
                    samples: 1 << level,
                    tiles: tile..tile + count,
                    film_first_pixel: pixels.start,
                    is_together,
                })?;
                if is_trial {
                    let rays = self.backend.ledger()?.0 - rays_before;
                    self.pace.note(is_together, rays, seconds);
                }
                tile += count;
                self.tiles_per_batch =
                    next_batch(self.tiles_per_batch, count, seconds).min(self.tuning.max_tiles);
                if between(f64::from(tile) / f64::from(self.backend.frame().tiles()))
                    == Control::Stop
                {
                    return Ok(None);
                }
            }
            self.backend.read(pixels.len(), &mut values)?;
        }
        Ok(Some(values))
    }

    /// How the render went.
    pub fn report(&self) -> Report {
        self.report.clone()
    }

    /// What given rays meet in this scene, relative to the scene's origin.
    ///
    /// # Errors
    /// The device fails.
    #[doc(hidden)]
    pub fn probe(&self, rays: &[ProbeRay]) -> Result<Vec<ProbeHit>> {
        self.backend.probe(rays)
    }

    /// Bytes of device memory that buffers have, and that were taken from the driver.
    #[doc(hidden)]
    pub fn device_memory(&self) -> (u64, u64) {
        self.backend.device_memory()
    }

    /// What the validation layer said so far.
    #[doc(hidden)]
    pub fn validation_messages(&self) -> Vec<String> {
        self.backend.validation_messages()
    }
}

/// The film of a render, or its error; what was complete by then is kept.
fn keep_finished(
    finished: &mut Option<(Film, Work)>,
    result: Result<()>,
    film: Film,
    work: Work,
) -> Result<Film> {
    match result {
        Ok(()) => Ok(film),
        Err(error) => {
            *finished = Some((film, work));
            Err(error)
        }
    }
}

/// Tiles of the next batch, from how long `count` tiles took.
fn next_batch(current: u32, count: u32, seconds: f64) -> u32 {
    let fitting = f64::from(count) * BATCH_SECONDS / seconds.max(1e-6);
    // At most fourfold: the next tiles may cost more.
    (fitting as u32).clamp(1, current.saturating_mul(4))
}

fn features(spec: &crate::spec::Spec) -> Vec<Feature> {
    let planes = ("planes", spec.parallelograms + spec.triangles > 0);
    let share = ("share", spec.shares());
    spec.features()
        .into_iter()
        .chain([planes, share, ("guide", spec.guide)])
        .map(|(name, on)| Feature { name, on })
        .collect()
}

/// The devices of this machine and what each can run.
///
/// # Errors
/// There is no Vulkan driver; the message names packages that bring one.
pub fn devices() -> Result<Vec<DeviceInfo>> {
    let info = |caps: Caps| {
        let (major, minor, patch) = caps.api_version;
        let needs = |way: &BackendChoice| match way {
            #[cfg(feature = "wgpu")]
            BackendChoice::WgpuRayQuery => caps.ray_query.clone(),
            _ => caps.compute.clone(),
        };
        let ways = BackendChoice::WGPU.iter();
        let through_wgpu: Vec<_> = ways.map(|way| (*way, needs(way))).collect();
        DeviceInfo {
            index: caps.index,
            name: caps.name,
            kind: caps.kind.name().to_owned(),
            driver: caps.driver,
            api_version: format!("{major}.{minor}.{patch}"),
            backends: [
                (BackendChoice::RayQuery, caps.ray_query),
                (BackendChoice::RayPipeline, caps.ray_pipeline),
                (BackendChoice::Bvh, caps.compute.clone()),
            ]
            .into_iter()
            .chain(through_wgpu)
            .collect(),
            subgroup: caps.subgroup_size,
        }
    };
    Ok(gpu::enumerate()?.into_iter().map(info).collect())
}

/// What the scene needs, without a device.
///
/// # Errors
/// Geometry that no tree can hold.
pub fn model(scene: &Scene, settings: &Settings) -> Result<SceneModel> {
    let mut data = SceneData::new(scene, settings, geometry::DEFAULT_COPY_LIMIT);
    let bvh = traversal::build_bvh(&data, None)?;
    if let Some(planes) = planes::Planes::of(&bvh, &data) {
        planes.note(&mut data.spec, &mut data.params);
    }
    let triangles = data.geometry.triangles.len() as u64;
    let window = settings.window();
    let pixels = u64::from(window.x1 - window.x0) * u64::from(window.y1 - window.y0);
    let floats = backend::film_floats(settings.aovs);
    let memory = room::estimate(&data, Some(&bvh), pixels * 4 * u64::from(floats));
    Ok(SceneModel {
        features: features(&data.spec),
        triangles,
        bytes_per_triangle: (memory.geometry + memory.acceleration) as f64
            / triangles.max(1) as f64,
        memory,
    })
}

/// What a render would take of a device; nothing is compiled, and nothing copied there.
///
/// # Errors
/// As [`Renderer::new`].
pub fn plan(scene: &Scene, settings: &Settings, options: &DeviceOptions) -> Result<Plan> {
    settings.validate()?;
    let (device, backend, backend_reason) = vulkan::open(settings.backend, options, None)?;
    let data = SceneData::new(scene, settings, geometry::DEFAULT_COPY_LIMIT);
    let bvh = traversal::own_tree(backend, &data, options.cache.as_deref())?;
    let range = device.caps().max_storage_range;
    let film = backend::film_bytes(range, &data.params, data.spec.aovs);
    let memory = room::estimate(&data, bvh.as_ref(), film);
    Ok(Plan {
        backend,
        backend_reason,
        device: device.caps().name.clone(),
        memory,
        free: room::check(&device, &memory, None)?,
    })
}
