//! Progress on stderr: a bar for terminals, plain lines for logs, JSON lines for programs.

use std::io::IsTerminal;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use etendue::render::Progress;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde_json::{Value as Json, json};

use super::args::{ProgressName, RenderArgs};
use super::write_stderr;

/// Between two plain lines.
const PLAIN_INTERVAL: Duration = Duration::from_secs(5);
/// Between two JSON lines.
const JSON_INTERVAL: Duration = Duration::from_millis(500);
/// Steps of the bar: fine enough for parts of a pass.
const BAR_STEPS: u64 = 10_000;

enum Mode {
    Bar(ProgressBar),
    Plain,
    Json,
    None,
}

/// Tells the user how it goes, in the way that was asked for.
pub struct Reporter {
    mode: Mode,
    quiet: bool,
    time_limit: Option<f64>,
    last: Option<Instant>,
}

impl Reporter {
    /// A reporter as the arguments and the terminal ask for.
    pub fn new(args: &RenderArgs) -> Self {
        let mode = match args.progress {
            ProgressName::Json => Mode::Json,
            _ if args.quiet => Mode::None,
            ProgressName::None => Mode::None,
            ProgressName::Auto if std::io::stderr().is_terminal() => Mode::Bar(bar()),
            ProgressName::Auto | ProgressName::Plain => Mode::Plain,
        };
        Self {
            mode,
            quiet: args.quiet,
            time_limit: args.time,
            last: None,
        }
    }

    /// Something to know about the scene or the render.
    pub fn note(&self, text: &str) {
        match &self.mode {
            Mode::Json => write_event("note", json!({ "message": text })),
            Mode::None => {}
            Mode::Plain | Mode::Bar(_) => write_stderr(text),
        }
    }

    /// Something that may not be as the user expects.
    pub fn warn(&self, text: &str) {
        match &self.mode {
            Mode::Json => write_event("warning", json!({ "message": text })),
            _ if self.quiet => {}
            _ => write_stderr(&format!("warning: {text}")),
        }
    }

    /// Shows how far the render is.
    pub fn update(&mut self, progress: &Progress) {
        let status = Status::of(progress, self.time_limit);
        match &self.mode {
            Mode::None => {}
            Mode::Bar(bar) => {
                bar.set_position((progress.fraction * BAR_STEPS as f64) as u64);
                bar.set_message(status.text());
                bar.tick();
            }
            Mode::Plain => {
                if self.is_due(PLAIN_INTERVAL, progress) {
                    write_stderr(&status.text());
                }
            }
            Mode::Json => {
                if self.is_due(JSON_INTERVAL, progress) {
                    write_event("progress", status.json());
                }
            }
        }
    }

    /// Removes the bar and tells how it ended.
    pub fn finish(&self, samples: u64, stop: &str, seconds: f64, files: &[PathBuf]) {
        let names: Vec<_> = files.iter().map(|f| f.display().to_string()).collect();
        match &self.mode {
            Mode::None => {}
            Mode::Json => {
                let object = json!({
                    "samples": samples, "stop": stop, "elapsed": seconds, "outputs": names,
                });
                write_event("done", object);
            }
            Mode::Plain | Mode::Bar(_) => write_stderr(&format!(
                "{samples} samples in {}: {}",
                duration(seconds),
                names.join(", ")
            )),
        }
    }

    /// Removes the bar, so that other lines can be written.
    pub fn clear(&self) {
        if let Mode::Bar(bar) = &self.mode {
            bar.finish_and_clear();
        }
    }

    /// Whether it is time for another line; the last one of a render always comes.
    fn is_due(&mut self, interval: Duration, progress: &Progress) -> bool {
        let now = Instant::now();
        let is_last = progress.samples_done == progress.samples_total;
        // nothing for renders that end before the first interval is over, but the end
        let last = *self.last.get_or_insert(now);
        let due = is_last || now - last >= interval;
        if due {
            self.last = Some(now);
        }
        due
    }
}

/// What a line of progress says.
struct Status {
    done: u64,
    total: u64,
    fraction: f64,
    elapsed: f64,
    /// Samples per pixel and second.
    rate: f64,
    /// Seconds left until all samples are there or the time is up; unknown at the very start.
    left: Option<f64>,
}

impl Status {
    fn of(progress: &Progress, time_limit: Option<f64>) -> Self {
        let elapsed = progress.elapsed.as_secs_f64();
        let fraction = progress.fraction;
        // of this run alone: what was there before took other time
        let total = progress.samples_total.max(1) as f64;
        let run = fraction - progress.samples_before as f64 / total;
        let by_samples = (run > 0.0).then(|| elapsed * (1.0 - fraction) / run);
        let by_time = time_limit.map(|limit| (limit - elapsed).max(0.0));
        let left = match (by_samples, by_time) {
            (Some(a), Some(b)) => Some(a.min(b)),
            (a, b) => a.or(b),
        };
        Self {
            done: progress.samples_done,
            total: progress.samples_total,
            fraction,
            elapsed,
            rate: if elapsed > 0.0 {
                run * total / elapsed
            } else {
                0.0
            },
            left,
        }
    }

    fn text(&self) -> String {
        let left = self.left.map_or_else(|| String::from("?"), duration);
        format!(
            "{}/{} samples ({:.0} %), {:.*} samples/s, {left} left",
            self.done,
            self.total,
            self.fraction * 100.0,
            if self.rate < 10.0 { 2 } else { 0 },
            self.rate
        )
    }

    fn json(&self) -> Json {
        json!({
            "samples": self.done,
            "total": self.total,
            "fraction": self.fraction,
            "elapsed": self.elapsed,
            "rate": self.rate,
            "remaining": self.left,
        })
    }
}

fn bar() -> ProgressBar {
    let style = ProgressStyle::with_template("{bar:30} {msg}")
        .expect("the template is valid")
        .progress_chars("━╸ ");
    ProgressBar::with_draw_target(Some(BAR_STEPS), ProgressDrawTarget::stderr()).with_style(style)
}

fn write_event(event: &str, mut object: Json) {
    object["event"] = event.into();
    write_stderr(&object.to_string());
}

/// Seconds as people read them.
fn duration(seconds: f64) -> String {
    let whole = seconds.round() as u64;
    match whole {
        0..10 => format!("{seconds:.1} s"),
        10..60 => format!("{whole} s"),
        60..3600 => format!("{}:{:02} min", whole / 60, whole % 60),
        _ => format!("{}:{:02} h", whole / 3600, whole / 60 % 60),
    }
}

#[cfg(test)]
mod tests {
    use etendue::render::Work;

    use super::*;

    #[test]
    fn durations_are_short() {
        let cases = [
            (0.04, "0.0 s"),
            (9.4, "9.4 s"),
            (59.4, "59 s"),
            (75.0, "1:15 min"),
        ];
        for (seconds, text) in cases {
            assert_eq!(duration(seconds), text);
        }
        assert_eq!(duration(7_260.0), "2:01 h");
    }

    #[test]
    fn the_nearer_limit_tells_the_time_left() {
        let window = etendue::settings::Crop {
            x0: 0,
            y0: 0,
            x1: 1,
            y1: 1,
        };
        let film = etendue::film::Film::new(window, (1, 1), false);
        let progress = |fraction| Progress {
            film: &film,
            work: Work::default(),
            samples_before: 0,
            samples_done: 16,
            samples_total: 100,
            fraction,
            pass_complete: true,
            elapsed: Duration::from_secs(10),
        };
        let left = |fraction, limit| Status::of(&progress(fraction), limit).left;
        assert_eq!(left(0.25, None), Some(30.0));
        assert_eq!(left(0.25, Some(25.0)), Some(15.0));
        assert_eq!(left(0.25, Some(5.0)), Some(0.0));
        assert_eq!(left(0.0, None), None);
        assert_eq!(Status::of(&progress(0.25), None).rate, 2.5);
        let resumed = Progress {
            samples_before: 20,
            ..progress(0.25)
        };
        let status = Status::of(&resumed, None);
        assert!((status.rate - 0.5).abs() < 1e-12, "{}", status.rate);
        assert_eq!(status.left.map(f64::round), Some(150.0));
    }
}
