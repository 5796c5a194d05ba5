//! Which samples a render takes: all that were asked for, as many as a pilot says, or spread as a pilot says.

use std::mem;
use std::ops::Range;
use std::time::Instant;

use etendue::Result;
use etendue::film::{Allotment, Budget, Film};
use etendue::render::{Control, Team, Work};
use etendue::settings::Settings;

use super::header::Job;
use super::interrupt::Interrupt;
use super::pilot;
use super::progress::Reporter;

/// The film to go on with, and the samples that it is to have in the end.
pub type Planned = (Film, Vec<Range<u64>>);

/// Looks at other samples before those of the picture.
pub struct Planner<'a> {
    renderer: &'a mut Team,
    job: &'a Job<'a>,
    interrupt: &'a Interrupt,
    begun: Instant,
    settings: Settings,
    film: Film,
}

impl<'a> Planner<'a> {
    /// For a render that begins now.
    pub fn new(renderer: &'a mut Team, job: &'a Job, interrupt: &'a Interrupt) -> Self {
        let settings = job.settings.pilot();
        Self {
            renderer,
            job,
            interrupt,
            begun: Instant::now(),
            film: Film::of(&settings),
            settings,
        }
    }

    /// What `film`, which may be that of a checkpoint, is to have: with `--noise`, as many samples as a pilot
    /// says; with `--adaptive`, spread over the pixels as a pilot says.
    pub fn plan(mut self, film: Film, reporter: &Reporter) -> Result<Planned> {
        let Range { start, end } = self.job.settings.samples;
        let all = self.job.samples();
        if self.job.settings.adaptive {
            if film.samples() > 0 {
                // goes on as it was spread, or evenly where there were too few to spread
                self.renderer.allot(film.allotment())?;
                let planned = 0..film.allotment().least(end);
                return Ok((film, vec![planned]));
            }
            let Some(budget) = Budget::of(end) else {
                reporter.note("too few samples to spread: all pixels take as many");
                return Ok((film, all));
            };
            return self.spread(film, budget, reporter);
        }
        let (Some(limit), None) = (self.job.args.noise, self.job.repeats) else {
            return Ok((film, all));
        };
        self.renderer.restart(0..end, self.settings.seed)?;
        let needed = pilot::plan(limit, end - start, |samples| {
            self.extend(start..start + samples)?;
            Ok((self.film.samples() == samples).then(|| self.film.relative_error()))
        })?;
        self.go_back()?;
        let Some(needed) = needed else {
            return Ok((film, all));
        };
        let error = self.film.relative_error();
        reporter.note(&format!(
            "{} other samples have a relative error of {error:.2e}: {needed} are needed",
            self.film.samples()
        ));
        let planned = start..start + needed;
        Ok((film, vec![planned]))
    }

    /// Spreads the samples of a film that has none yet over the pixels.
    fn spread(mut self, film: Film, budget: Budget, reporter: &Reporter) -> Result<Planned> {
        let end = self.job.settings.samples.end;
        let least = 0..budget.least;
        let (planned, pilot) = match self.job.repeats {
            Some(repeat) => (repeat.samples.clone(), repeat.pilot()),
            None => (vec![least], budget.pilot),
        };
        self.renderer.restart(0..end, self.settings.seed)?;
        self.extend(0..pilot)?;
        self.go_back()?;
        let allotment = Allotment::of(&self.film, end, budget);
        let film = film.with_allotment(allotment);
        self.renderer.allot(film.allotment())?;
        reporter.note(&format!(
            "samples are spread as {} others say: {} to {} a pixel",
            self.film.samples(),
            budget.least,
            budget.least << film.allotment().most()
        ));
        Ok((film, planned))
    }

    /// Renders the pilot up to these samples, unless it is time to stop.
    fn extend(&mut self, samples: Range<u64>) -> Result<()> {
        let so_far = mem::replace(&mut self.film, Film::of(&self.settings));
        let limit = self.job.args.time.unwrap_or(f64::INFINITY) / pilot::MOST as f64;
        let (interrupt, begun) = (self.interrupt, self.begun);
        self.film =
            self.renderer.resume(
                so_far,
                Work::default(),
                &[samples],
                &mut |_| match interrupt.is_requested() || begun.elapsed().as_secs_f64() >= limit {
                    true => Control::Stop,
                    false => Control::Continue,
                },
            )?;
        Ok(())
    }

    /// To the samples of the picture.
    fn go_back(&mut self) -> Result<()> {
        let Settings { samples, seed, .. } = &self.job.settings;
        self.renderer.restart(samples.clone(), *seed)
    }
}
