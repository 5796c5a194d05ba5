//! Several devices that render one picture: each takes the next samples when it is done
//! with its last, and the others go on when one is lost. Devices of one class give the
//! bits that one of them gives alone.

use std::collections::VecDeque;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use super::passes::MAX_PASS_LEVEL;
use super::{
    Control, DeviceOptions, Identities, Ledger, PASS_SECONDS, Progress, Renderer, Report, Work,
    keep_finished,
};
use crate::error::{Error, Result};
use crate::fault;
use crate::film::{Allotment, Film};
use crate::scene::Scene;
use crate::settings::Settings;

/// How long the caller waits for word at most: it may want to stop.
const PATIENCE: Duration = Duration::from_millis(100);

/// Devices that render one scene together. With one of them it is a [`Renderer`].
pub struct Team {
    pub(super) members: Vec<Renderer>,
    settings: Settings,
    pub(super) allotment: Allotment,
    report: Report,
    /// The complete passes of a render that failed.
    finished: Option<(Film, Work)>,
}

/// What a member tells.
enum Word {
    /// A pass is complete.
    Pass {
        first: u64,
        level: u32,
        values: Vec<f32>,
        rays: u64,
        ledger: Ledger,
    },
    /// A member failed; its pass went back.
    Lost(usize, Error),
}

/// Samples that nobody has taken.
struct Queue(Mutex<VecDeque<Range<u64>>>);

impl Queue {
    fn ranges(&self) -> MutexGuard<'_, VecDeque<Range<u64>>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes an aligned power of two of samples, of this level at most.
    fn take(&self, level: u32) -> Option<(u64, u32)> {
        let mut ranges = self.ranges();
        let range = ranges.front_mut()?;
        let first = range.start;
        let inside = (range.end - first).ilog2();
        let level = level.min(first.trailing_zeros()).min(inside);
        range.start += 1 << level;
        if range.is_empty() {
            ranges.pop_front();
        }
        Some((first, level))
    }

    fn give_back(&self, first: u64, level: u32) {
        self.ranges().push_front(first..first + (1 << level));
    }
}

impl Team {
    /// Opens devices, uploads the scene to each and compiles what it needs.
    ///
    /// # Errors
    /// As [`Renderer::new`], for any of them, or they would trace rays in different ways.
    pub fn new(scene: &Scene, settings: &Settings, devices: &[DeviceOptions]) -> Result<Self> {
        let members = devices
            .iter()
            .map(|device| Renderer::new(scene, settings, device))
            .collect::<Result<Vec<_>>>()?;
        let reports: Vec<_> = members.iter().map(Renderer::report).collect();
        let report = joint(&reports)?;
        Ok(Self {
            members,
            settings: settings.clone(),
            allotment: Allotment::default(),
            report,
            finished: None,
        })
    }

    /// As [`Renderer::restart`].
    ///
    /// # Errors
    /// As [`Renderer::restart`], of any device.
    pub fn restart(&mut self, samples: Range<u64>, seed: u64) -> Result<()> {
        for member in &mut self.members {
            member.restart(samples.clone(), seed)?;
        }
        self.settings.samples = samples;
        self.settings.seed = seed;
        Ok(())
    }

    /// As [`Renderer::resume`]. A device that fails is left out from then on; the render
    /// fails with the last.
    ///
    /// # Errors
    /// As [`Renderer::resume`], of the last device.
    pub fn resume(
        &mut self,
        mut film: Film,
        before: Work,
        samples: &[Range<u64>],
        control: &mut dyn FnMut(&Progress) -> Control,
    ) -> Result<Film> {
        if let [only] = &mut self.members[..] {
            let result = only.resume(film, before, samples, control);
            self.finished = only.take_finished();
            let report = only.report();
            // the names of all that began
            let (device, driver) = (self.report.device.clone(), self.report.driver.clone());
            self.report = Report {
                device,
                driver,
                ..report
            };
            return result;
        }
        // refuses a film of other settings, and says what differs
        film.merge(Film::of(&self.settings).with_allotment(self.allotment.clone()))?;
        let mut work = before;
        let start = Instant::now();
        let result = self.rounds(&mut film, &mut work, samples, start, control);
        self.report.note(&film, &work, work.seconds);
        keep_finished(&mut self.finished, result, film, work)
    }

    /// As [`Renderer::identities`], by the first device.
    ///
    /// # Errors
    /// As [`Renderer::identities`].
    pub fn identities(&self) -> Result<Identities> {
        match self.members.first() {
            Some(first) => first.identities(),
            None => Ok(Identities::default()),
        }
    }

    /// As [`Renderer::take_finished`].
    pub fn take_finished(&mut self) -> Option<(Film, Work)> {
        self.finished.take()
    }

    /// How the render went; names of devices that differ stand beside each other.
    pub fn report(&self) -> Report {
        self.report.clone()
    }

    /// Renders until nothing is missing: what a member failed to do when the others had
    /// nothing left takes another round.
    fn rounds(
        &mut self,
        film: &mut Film,
        work: &mut Work,
        samples: &[Range<u64>],
        start: Instant,
        control: &mut dyn FnMut(&Progress) -> Control,
    ) -> Result<()> {
        let mut missing = film.missing(samples);
        let samples_before = film.samples();
        let total = samples_before + missing.iter().map(|r| r.end - r.start).sum::<u64>();
        let seconds_before = work.seconds;
        let mut tell = |film: &Film, work: &mut Work, pass_complete: bool| {
            work.seconds = seconds_before + start.elapsed().as_secs_f64();
            control(&Progress {
                film,
                work: *work,
                samples_before: film.mean_of(samples_before),
                samples_done: film.mean_of(film.samples()),
                samples_total: film.mean_of(total),
                fraction: film.samples() as f64 / total as f64,
                pass_complete,
                elapsed: start.elapsed(),
            })
        };
        while !missing.is_empty() {
            let (is_stopped, lost) = self.round(film, work, missing, &mut tell)?;
            let mut numbers = 0..;
            let is_lost = |number: usize| lost.iter().any(|(other, _)| *other == number);
            self.members
                .retain(|_| !numbers.next().is_some_and(is_lost));
            if self.members.is_empty() {
                if let Some((_, error)) = lost.into_iter().next_back() {
                    return Err(error);
                }
            }
            missing = film.missing(samples);
            if is_stopped {
                break;
            }
        }
        Ok(())
    }

    /// Lets every member work until all samples are taken. Says whether it was stopped, and who failed.
    fn round(
        &mut self,
        film: &mut Film,
        work: &mut Work,
        missing: Vec<Range<u64>>,
        tell: &mut dyn FnMut(&Film, &mut Work, bool) -> Control,
    ) -> Result<(bool, Vec<(usize, Error)>)> {
        let queue = Queue(Mutex::new(missing.into()));
        let stop = AtomicBool::new(false);
        let (sender, words) = mpsc::channel();
        let mut planned = Some(fault::take());
        thread::scope(|scope| {
            for (number, member) in self.members.iter_mut().enumerate() {
                let (sender, queue, stop) = (sender.clone(), &queue, &stop);
                let planned = planned.take();
                scope.spawn(move || {
                    if let Some(plan) = planned {
                        fault::give(plan);
                    }
                    member.serve(number, queue, stop, &sender);
                });
            }
            drop(sender);
            let result = listen(&words, film, work, &stop, tell);
            // whatever happened, nobody begins another pass
            stop.store(true, Ordering::Relaxed);
            result
        })
    }
}

/// Adds what members tell of until all have ended.
fn listen(
    words: &Receiver<Word>,
    film: &mut Film,
    work: &mut Work,
    stop: &AtomicBool,
    tell: &mut dyn FnMut(&Film, &mut Work, bool) -> Control,
) -> Result<(bool, Vec<(usize, Error)>)> {
    let mut lost = Vec::new();
    loop {
        let is_pass = match words.recv_timeout(PATIENCE) {
            Ok(Word::Pass {
                first,
                level,
                values,
                rays,
                ledger,
            }) => {
                film.add(first, level, values)?;
                work.rays += rays;
                work.ledger.add(&ledger);
                true
            }
            Ok(Word::Lost(number, error)) => {
                tracing::warn!("a device is lost, others go on: {error}");
                lost.push((number, error));
                false
            }
            Err(RecvTimeoutError::Timeout) => false,
            Err(RecvTimeoutError::Disconnected) => break,
        };
        if tell(film, work, is_pass) == Control::Stop {
            stop.store(true, Ordering::Relaxed);
        }
    }
    Ok((stop.load(Ordering::Relaxed), lost))
}

impl Renderer {
    /// Takes passes and renders them until none is left or `stop` is set.
    fn serve(&mut self, number: usize, queue: &Queue, stop: &AtomicBool, sender: &Sender<Word>) {
        let (mut done, mut limit) = (0u64, MAX_PASS_LEVEL - self.allotment.most());
        while !stop.load(Ordering::Relaxed) {
            let Some((first, level)) = queue.take(limit.min((done + 1).ilog2())) else {
                return;
            };
            let start = Instant::now();
            let word = match self.whole_pass(first, level, stop) {
                Ok(Some(word)) => word,
                Ok(None) => return,
                Err(error) => {
                    queue.give_back(first, level);
                    // nobody listens any more where the caller has failed
                    let _ = sender.send(Word::Lost(number, error));
                    return;
                }
            };
            if sender.send(word).is_err() {
                return;
            }
            done += 1 << level;
            if 2.0 * start.elapsed().as_secs_f64() > PASS_SECONDS {
                limit = limit.min(level);
            }
        }
    }

    fn whole_pass(&mut self, first: u64, level: u32, stop: &AtomicBool) -> Result<Option<Word>> {
        self.backend.reset_ledger()?;
        let mut between = |_| match stop.load(Ordering::Relaxed) {
            true => Control::Stop,
            false => Control::Continue,
        };
        let Some(values) = self.pass(first, level, &mut between)? else {
            return Ok(None);
        };
        let (rays, ledger) = self.backend.ledger()?;
        Ok(Some(Word::Pass {
            first,
            level,
            values,
            rays,
            ledger,
        }))
    }
}

/// One report of all members.
fn joint(reports: &[Report]) -> Result<Report> {
    let Some((first, others)) = reports.split_first() else {
        return Err(Error::Unsupported {
            what: String::from("a render"),
            missing: String::from("no device was named"),
        });
    };
    let mut report = first.clone();
    let (mut devices, mut drivers) = (vec![&*first.device], vec![&*first.driver]);
    for other in others {
        if other.backend != report.backend {
            let (one, two) = (report.backend.name(), other.backend.name());
            return Err(Error::Settings {
                name: "--backend",
                what: format!("devices would trace by {one} and by {two}: name one for all"),
            });
        }
        if !devices.contains(&&*other.device) {
            devices.push(&other.device);
        }
        if !drivers.contains(&&*other.driver) {
            drivers.push(&other.driver);
        }
        report.times.build += other.times.build;
        report.times.compile += other.times.compile;
    }
    let (device, driver) = (devices.join(" + "), drivers.join(" + "));
    (report.device, report.driver) = (device, driver);
    Ok(report)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_taken_once_and_what_is_given_back_again() {
        let queue = Queue(Mutex::new(VecDeque::from([3..10, 12..13])));
        assert_eq!(queue.take(8), Some((3, 0)));
        assert_eq!(queue.take(1), Some((4, 1)));
        assert_eq!(queue.take(8), Some((6, 1)));
        queue.give_back(4, 1);
        assert_eq!(queue.take(8), Some((4, 1)));
        assert_eq!(queue.take(8), Some((8, 1)));
        assert_eq!(queue.take(8), Some((12, 0)));
        assert_eq!(queue.take(8), None);
    }
}
