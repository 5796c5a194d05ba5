//! Talks to people: what was typed, in; messages and exit codes, out. Sees only
//! the library's public items.

mod args;
mod bench;
mod chart;
mod checkpoint;
mod compare;
mod failure;
mod header;
mod identity;
mod info;
mod interrupt;
mod measure;
mod merge;
mod numbers;
mod pilot;
mod plan;
mod progress;
mod render;
mod rerender;
mod samples;
mod selftest;
mod settings;
mod stats;

use std::io::{self, IsTerminal, Write};
use std::process::ExitCode;

use clap::Parser;
use tracing_subscriber::EnvFilter;

use self::args::{Arguments, Command, ProgressName};
use self::failure::{Failure, Outcome};

/// The whole program.
pub fn main() -> ExitCode {
    failure::report_panics_as_errors();
    etendue::gpu::widen_vectors();
    #[cfg(feature = "faults")]
    etendue::fault::arm_from_environment();
    let outcome = match Arguments::parse().command {
        Command::Render(args) => {
            // lines of text would get between the JSON objects
            let quiet = args.quiet || args.progress == ProgressName::Json;
            log_to_stderr(quiet, args.verbose);
            render::run(&args)
        }
        Command::Merge(args) => {
            log_to_stderr(false, 0);
            merge::run(&args)
        }
        Command::Rerender(args) => {
            log_to_stderr(args.quiet, 0);
            rerender::run(&args)
        }
        Command::Measure(args) => {
            log_to_stderr(args.quiet, 0);
            measure::run(&args)
        }
        Command::Compare(args) => {
            log_to_stderr(false, 0);
            compare::run(&args)
        }
        Command::Selftest(args) => {
            log_to_stderr(false, 0);
            selftest::run(&args)
        }
        Command::Info(args) => {
            log_to_stderr(false, 0);
            info::run(&args)
        }
        Command::Bench(args) => {
            log_to_stderr(args.quiet, 0);
            bench::run(&args)
        }
        Command::Chart(args) => {
            log_to_stderr(false, 0);
            chart::run(&args)
        }
    };
    match outcome {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::Different) => ExitCode::from(failure::DIFFERENT),
        Ok(Outcome::Interrupted) => ExitCode::from(failure::INTERRUPTED),
        Err(failure) => {
            failure.print();
            ExitCode::from(failure.code)
        }
    }
}

/// Sends the library's log to stderr; `RUST_LOG` has the last word on what is shown.
fn log_to_stderr(quiet: bool, verbose: u8) {
    // what the loader warns of also stands in the scene, and is shown from there
    let level = match (quiet, verbose) {
        (true, _) => "error",
        (_, 0) => "warn,etendue::scene=error",
        (_, 1) => "info,etendue::scene=error",
        _ => "debug",
    };
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(level));
    tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(io::stderr)
        .with_ansi(io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none())
        .without_time()
        .with_target(false)
        .init();
}

/// Writes data to stdout. A reader that went away (`| head`) is not an error.
fn write_stdout(text: &str) -> Result<(), Failure> {
    let mut stdout = io::stdout().lock();
    match stdout
        .write_all(text.as_bytes())
        .and_then(|()| stdout.flush())
    {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(Failure::new(failure::FAILED, error, "write to stdout"))
        }
        _ => Ok(()),
    }
}

/// Writes one line to stderr. Nobody can be told when even that fails.
fn write_stderr(line: &str) {
    let _ = writeln!(io::stderr(), "{line}");
}
