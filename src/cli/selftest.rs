//! `etendue selftest`: what this device and driver really do.

use std::time::Instant;

use clap::Args;
use etendue::selftest::{self, Check};
use serde_json::{Value as Json, json};

use super::failure::{Failure, Outcome};
use super::write_stdout;

/// `etendue selftest`
#[derive(Args)]
pub struct SelftestArgs {
    /// Vulkan device, by index or a part of its name
    #[arg(long, value_name = "INDEX|NAME")]
    pub device: Option<String>,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

/// Tests and prints.
pub fn run(args: &SelftestArgs) -> Result<Outcome, Failure> {
    let start = Instant::now();
    let mut group = "";
    let mut failed = None;
    let mut tell = |check: &Check| {
        if args.json || failed.is_some() {
            return;
        }
        let mut text = String::new();
        if check.group != group {
            group = check.group;
            text += &format!("{group}\n");
        }
        text += &line(check);
        failed = write_stdout(&text).err();
    };
    let result = selftest::run(args.device.as_deref(), &mut tell)?;
    if let Some(failure) = failed {
        return Err(failure);
    }
    let wrong = result.checks.iter().filter(|c| !c.is_right).count();
    let seconds = start.elapsed().as_secs_f64();
    if args.json {
        let checks = result.checks.iter().map(|c| {
            json!({
                "group": c.group,
                "name": c.name,
                "expected": c.expected,
                "measured": c.measured,
                "ok": c.is_right,
            })
        });
        let missing = result.missing.iter();
        let missing = missing.map(|(b, lacks)| json!({ "backend": b.name(), "lacks": lacks }));
        let object = json!({
            "version": env!("CARGO_PKG_VERSION"),
            "device": result.device,
            "driver": result.driver,
            "checks": checks.collect::<Json>(),
            "not_tested": missing.collect::<Json>(),
            "failed": wrong,
            "seconds": seconds,
        });
        write_stdout(&format!("{object}\n"))?;
    } else {
        let mut text = String::new();
        for (backend, lacks) in &result.missing {
            text += &format!("not tested: {}, the device lacks {lacks}\n", backend.name());
        }
        text += &format!(
            "{} ({}): {wrong} of {} checks failed, {seconds:.0} s\n",
            result.device,
            result.driver,
            result.checks.len()
        );
        write_stdout(&text)?;
    }
    Ok(match wrong {
        0 => Outcome::Done,
        _ => Outcome::Different,
    })
}

fn line(check: &Check) -> String {
    let verdict = if check.is_right { "ok  " } else { "FAIL" };
    format!(
        "  {verdict}  {:<56} {:<40} {}\n",
        check.name, check.measured, check.expected
    )
}
