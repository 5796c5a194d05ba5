//! Error against time: every contender renders a scene with more and more samples.

use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::thread;
use std::time::Duration;

use etendue::film::Film;
use etendue::image_io::{Channel, Image, Metadata, Tone, write_png};
use etendue::render::{DeviceOptions, Renderer};
use etendue::scene::Scene;
use etendue::settings::Settings;

use super::super::failure::{FAILED, Failure};
use super::args::{BenchArgs, WayName};
use super::contender::{Contender, render_all, warm_up};
use super::error::{Picture, Reference, mean};
use super::peer::Peer;
use super::record::{self, Agreement, Bias, Line, Run, Skipped, Start};
use super::reference::{self, reference};
use super::{Output, scene_name};

/// The reference has so many times the samples of the longest run when none are asked for.
const REFERENCE_FACTOR: u64 = 128;
/// Below this factor the noise of the reference shows in the errors.
const LEAST_FACTOR: u64 = 100;
/// A peer whose mean is further off solves another problem.
const ALLOWED_DIFFERENCE: f64 = 0.003;
/// A picture of so many times the samples of the longest run joins the means of a peer, and another …
const CONVERGED_FACTOR: u64 = 4;
/// … so often at most …
const CONVERGED_PICTURES: u64 = 4;
/// … until the standard error of the difference is below this.
const CONVERGED_ERROR: f64 = 0.001;
/// Seed of the first of them, far from those of the runs.
const CONVERGED_SEED: u64 = 1 << 20;
/// Samples of the render by which a budget is turned into samples.
const PILOT_SPP: u64 = 8;
/// Between two runs: threads of the last contender may wait actively for more to do.
const REST: Duration = Duration::from_millis(200);

/// A scene and how it is rendered.
pub struct Contest<'a> {
    pub args: &'a BenchArgs,
    pub path: &'a Path,
    pub scene: &'a Scene,
    pub settings: &'a Settings,
    pub options: &'a DeviceOptions,
    /// Seconds it took to load the scene.
    pub load: f64,
}

impl Contest<'_> {
    /// Renders and writes lines.
    pub fn run(&self, peers: &[Rc<RefCell<Peer>>], out: &mut Output) -> Result<(), Failure> {
        let name = scene_name(self.path);
        let mut contenders = Vec::new();
        for way in &self.args.estimators {
            contenders.push(self.own(*way, &name, out)?);
        }
        let mut judge = self.renderer(WayName::Full)?;
        let ladder = self.ladder(&mut judge)?;
        let most = ladder.iter().copied().max().unwrap_or(1);
        let spp = self.args.reference.unwrap_or(REFERENCE_FACTOR * most);
        if spp < LEAST_FACTOR * most {
            out.note(&format!(
                "warning: {name}: a reference of {spp} samples is noisy beside runs of {most}; {} would be enough",
                LEAST_FACTOR * most
            ));
        }
        out.note(&format!("{name}: reference of {spp} samples"));
        let source = (name.as_str(), self.scene.hash.as_str());
        let folder = out.beside("references");
        let truth = reference(&mut judge, source, self.settings, spp, &folder)?;
        out.line(&Line::Scene(self.describe(&name, spp, &truth)))?;
        for peer in peers {
            self.invite(peer, &name, &mut contenders, out)?;
        }
        self.compete(&name, &ladder, &mut contenders, &truth, out)
    }

    fn renderer(&self, way: WayName) -> Result<Renderer, Failure> {
        let settings = way.settings(self.settings);
        Ok(Renderer::new(self.scene, &settings, self.options)?)
    }

    fn own(&self, way: WayName, scene: &str, out: &mut Output) -> Result<Contender, Failure> {
        let mut renderer = self.renderer(way)?;
        warm_up(&mut renderer)?;
        let times = renderer.report().times;
        let name = format!("etendue {}", way.name());
        out.line(&Line::Start(Start {
            scene: scene.to_owned(),
            contender: name.clone(),
            renderer: Some(String::from("etendue")),
            process: Some(0.0),
            build: self.load + times.build,
            compile: times.compile,
        }))?;
        Ok(Contender::Own {
            name,
            renderer: Box::new(renderer),
            is_adaptive: way == WayName::Adaptive,
        })
    }

    /// Samples a pixel of the runs.
    fn ladder(&self, renderer: &mut Renderer) -> Result<Vec<u64>, Failure> {
        let Some(budget) = self.args.budget else {
            return Ok(self.args.spp.clone());
        };
        render_all(renderer, PILOT_SPP, 0)?;
        let each = renderer.report().times.render / PILOT_SPP as f64;
        let most = (budget / each).max(1.0).log2() as u32;
        Ok((0..=most).map(|level| 1 << level).collect())
    }

    fn describe(&self, name: &str, spp: u64, truth: &Reference) -> record::Scene {
        record::Scene {
            scene: name.to_owned(),
            hash: self.scene.hash.clone(),
            width: self.settings.width,
            height: self.settings.height,
            max_depth: self.settings.max_depth,
            triangles: self.scene.triangle_count(),
            reference_spp: spp,
            reference_seeds: reference::SEEDS,
            reference_estimator: reference::ESTIMATOR.to_owned(),
            mean: truth.mean(),
            epsilon: truth.epsilon,
        }
    }

    /// A peer takes part with each of its samplers, or it is said why not. Its first picture tells what compiling takes.
    fn invite(
        &self,
        peer: &Rc<RefCell<Peer>>,
        scene: &str,
        contenders: &mut Vec<Contender>,
        out: &mut Output,
    ) -> Result<(), Failure> {
        let size = (self.settings.width, self.settings.height);
        let loaded = peer
            .borrow_mut()
            .load(self.path, size, self.settings.max_depth);
        let loaded = match loaded {
            Ok(loaded) => loaded,
            Err(error) => {
                let contender = peer.borrow().name.clone();
                return skip(scene, &contender, &format!("{error:#}"), out);
            }
        };
        let name = peer.borrow().name.clone();
        for sampler in loaded.samplers {
            let mut contender = Contender::Peer {
                name: format!("{name} {sampler}"),
                sampler,
                process: Rc::clone(peer),
            };
            match contender.render(1, 0, &out.scratch()) {
                Ok(first) => {
                    out.line(&Line::Start(Start {
                        scene: scene.to_owned(),
                        contender: contender.name().to_owned(),
                        renderer: Some(name.clone()),
                        process: Some(peer.borrow().process),
                        build: loaded.build,
                        compile: first.seconds,
                    }))?;
                    contenders.push(contender);
                }
                Err(failure) => skip(scene, contender.name(), &failure.text(), out)?,
            }
        }
        Ok(())
    }

    /// The runs: contenders alternate, each seed beginning with another one, so that all meet the same conditions.
    fn compete(
        &self,
        scene: &str,
        ladder: &[u64],
        contenders: &mut [Contender],
        truth: &Reference,
        out: &mut Output,
    ) -> Result<(), Failure> {
        let pixels = f64::from(self.settings.width) * f64::from(self.settings.height);
        let mut means: Vec<Means> = vec![Means::new(); contenders.len()];
        for (rung, &spp) in ladder.iter().enumerate() {
            out.note(&format!("{scene}: {spp} samples a pixel"));
            for peer in contenders.iter_mut().filter(|c| c.is_peer()) {
                // kernels of peers may depend on the number of samples
                peer.render(spp, 0, &out.scratch())?;
            }
            let mut pictures: Vec<Vec<Picture>> = vec![Vec::new(); contenders.len()];
            for seed in 1..=self.args.seeds {
                let count = contenders.len();
                for turn in 0..count {
                    let i = (turn + seed as usize) % count;
                    let contender = &mut contenders[i];
                    thread::sleep(REST);
                    let shot = contender.render(spp, seed, &out.scratch())?;
                    let errors = truth.errors(&shot.picture);
                    let mean = mean(&shot.picture);
                    means[i].push((shot.spp, truth.weighted_mean(&shot.picture)));
                    out.line(&Line::Run(Run {
                        scene: scene.to_owned(),
                        contender: contender.name().to_owned(),
                        spp: shot.spp,
                        seed,
                        seconds: shot.seconds,
                        paths_per_second: shot.spp as f64 * pixels / shot.seconds,
                        rays_per_second: shot.rays.map(|rays| rays as f64 / shot.seconds),
                        rmse: errors.rmse,
                        relmse: errors.relmse,
                        relmse_trimmed: errors.relmse_trimmed,
                        mean,
                    }))?;
                    pictures[i].push(shot.picture);
                }
            }
            for (contender, pictures) in contenders.iter().zip(&pictures) {
                bias(scene, contender, spp, truth, pictures, out)?;
                if self.args.pictures && rung + 1 == ladder.len() {
                    self.picture(scene, contender.name(), spp, &pictures[0], out)?;
                }
            }
        }
        if self.args.pictures {
            let whole = average(&truth.halves);
            self.picture(scene, "reference", 0, &whole, out)?;
        }
        let converged = CONVERGED_FACTOR * ladder.iter().copied().max().unwrap_or(1);
        for (contender, means) in contenders.iter_mut().zip(&mut means) {
            if contender.is_peer() {
                let mut line = agreement(scene, contender.name(), truth, means);
                for picture in 0..CONVERGED_PICTURES {
                    if line.error <= CONVERGED_ERROR {
                        break;
                    }
                    let seed = CONVERGED_SEED + picture;
                    let shot = contender.render(converged, seed, &out.scratch())?;
                    means.push((shot.spp, truth.weighted_mean(&shot.picture)));
                    line = agreement(scene, contender.name(), truth, means);
                }
                out.line(&Line::Agreement(line))?;
            }
        }
        Ok(())
    }

    /// Writes a picture for people beside the bench file.
    fn picture(
        &self,
        scene: &str,
        contender: &str,
        spp: u64,
        pixels: &Picture,
        out: &mut Output,
    ) -> Result<(), Failure> {
        let folder = out.beside("pictures");
        std::fs::create_dir_all(&folder)
            .map_err(|error| Failure::new(FAILED, error, "make the folder of the pictures"))?;
        let name: String = format!("{scene}-{contender}.png").replace([' ', '/'], "-");
        let path: PathBuf = folder.join(name);
        let (width, height) = (self.settings.width, self.settings.height);
        let empty = Film::new(self.settings.window(), (width, height), false);
        let mut image = Image::from_film(&empty, &[], Metadata::new())?;
        image.channels = ["R", "G", "B"]
            .into_iter()
            .enumerate()
            .map(|(i, name)| Channel {
                name: name.to_owned(),
                values: pixels.iter().map(|p| p[i]).collect(),
            })
            .collect();
        write_png(&path, &image, Tone::Srgb, 0.0)?;
        out.line(&Line::Picture(record::Picture {
            scene: scene.to_owned(),
            contender: contender.to_owned(),
            spp,
            file: out.relative(&path),
        }))
    }
}

fn skip(scene: &str, contender: &str, reason: &str, out: &mut Output) -> Result<(), Failure> {
    out.note(&format!("{scene}: without {contender}: {reason}"));
    out.line(&Line::Skipped(Skipped {
        scene: scene.to_owned(),
        contender: contender.to_owned(),
        reason: reason.to_owned(),
    }))
}

fn average([a, b]: &[Picture; 2]) -> Picture {
    let pixel = |(a, b): (&[f32; 3], &[f32; 3])| std::array::from_fn(|i| 0.5 * (a[i] + b[i]));
    a.iter().zip(b).map(pixel).collect()
}

/// One picture has no scatter to tell bias from.
fn bias(
    scene: &str,
    contender: &Contender,
    spp: u64,
    truth: &Reference,
    pictures: &[Picture],
    out: &mut Output,
) -> Result<(), Failure> {
    if pictures.len() < 2 {
        return Ok(());
    }
    let together = truth.together(pictures);
    out.line(&Line::Bias(Bias {
        scene: scene.to_owned(),
        contender: contender.name().to_owned(),
        spp,
        seeds: pictures.len(),
        bias2: together.bias2,
        bias2_error: together.bias2_error,
        variance: together.variance,
    }))
}

/// Samples and means of the pictures of a contender.
type Means = Vec<(u64, [f64; 3])>;

/// The channel that deviates most decides.
fn agreement(scene: &str, contender: &str, truth: &Reference, means: &Means) -> Agreement {
    let [a, b] = [0, 1].map(|half| truth.weighted_mean(&truth.halves[half]));
    let wanted: [f64; 3] = std::array::from_fn(|i| 0.5 * (a[i] + b[i]));
    let brightest = wanted.iter().copied().fold(0.0, f64::max);
    let channel = |i: usize| {
        let samples: f64 = means.iter().map(|(spp, _)| *spp as f64).sum();
        let sum: f64 = means.iter().map(|(spp, m)| *spp as f64 * m[i]).sum();
        let whole = sum / samples;
        // the variance of a picture's mean goes with one over its samples
        let squares = means.iter();
        let squares: f64 = squares
            .map(|(spp, m)| *spp as f64 * (m[i] - whole).powi(2))
            .sum();
        let variance = squares / ((means.len() - 1).max(1) as f64 * samples);
        let error = (variance + 0.25 * (a[i] - b[i]).powi(2)).sqrt();
        let scale = wanted[i].max(0.01 * brightest);
        ((whole - wanted[i]).abs() / scale, error / scale)
    };
    let channels = [0, 1, 2].map(channel);
    let worst = channels.into_iter().max_by(|x, y| x.0.total_cmp(&y.0));
    let (difference, error) = worst.unwrap_or_default();
    Agreement {
        scene: scene.to_owned(),
        contender: contender.to_owned(),
        difference,
        error,
        allowed: ALLOWED_DIFFERENCE,
        agrees: difference <= ALLOWED_DIFFERENCE + 2.0 * error && error <= ALLOWED_DIFFERENCE,
    }
}
