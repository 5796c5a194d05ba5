//! `etendue compare`: whether two images differ by more than their noise.

use std::path::{Path, PathBuf};

use clap::Args;
use etendue::compare::{self, CHANNELS, Comparison, Options, Side, TILE};
use etendue::image_io::{Format, Image, Tone, read_exr, write_exr, write_png};
use serde_json::{Value as Json, json};

use super::failure::{self, Failure, Outcome};
use super::numbers::{counts, level};
use super::write_stdout;

/// `etendue compare`
#[derive(Args)]
pub struct CompareArgs {
    /// Image: .exr, of this or another renderer; with standard errors (render --aov stderr,samples) for a verdict
    pub a: PathBuf,
    /// The image to compare with: the reference of the metrics
    pub b: PathBuf,
    /// Rate of false alarms of the whole comparison
    #[arg(long, value_name = "P", default_value_t = 0.001, allow_negative_numbers = true, value_parser = level)]
    pub alpha: f64,
    /// Samples a pixel of A and of B, where the files do not tell
    #[arg(long, value_name = "N[,N]", allow_negative_numbers = true, value_parser = counts)]
    pub spp: Option<[f64; 2]>,
    /// Write where they differ: .exr, A − B and deviations; .png, red where A is brighter, blue where B is
    #[arg(long, value_name = "FILE")]
    pub diff: Option<PathBuf>,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

/// Compares and prints.
pub fn run(args: &CompareArgs) -> Result<Outcome, Failure> {
    let format = args.diff.as_deref().map(Format::of).transpose()?;
    let images = [read_exr(&args.a)?, read_exr(&args.b)?];
    let options = Options {
        alpha: args.alpha,
        spp: [0, 1].map(|i| args.spp.map(|n| n[i])),
    };
    let result = compare::compare(&images[0], &images[1], &options)
        .map_err(|error| Failure::new(failure::USAGE, error, "compare the images"))?;
    if let (Some(path), Some(format)) = (&args.diff, format) {
        write_difference(path, format, &images, &options)?;
    }
    let text = match args.json {
        true => format!("{}\n", object(args, &images[0], &result)),
        false => text(args, &images[0], &result),
    };
    write_stdout(&text)?;
    Ok(match result.is_different {
        Some(true) => Outcome::Different,
        _ => Outcome::Done,
    })
}

fn write_difference(
    path: &Path,
    format: Format,
    images: &[Image; 2],
    options: &Options,
) -> Result<(), Failure> {
    let sides = [
        Side::of(&images[0], options.spp[0])?,
        Side::of(&images[1], options.spp[1])?,
    ];
    match format {
        Format::Exr => write_exr(path, &compare::difference(&sides, &images[0]))?,
        Format::Png => {
            let picture = compare::signed_picture(&sides, &images[0]);
            write_png(path, &picture, Tone::Srgb, 0.0)?;
        }
    }
    Ok(())
}

fn verdict(result: &Comparison) -> &'static str {
    match result.is_different {
        Some(true) => "different",
        Some(false) => "not different",
        None => "none",
    }
}

fn object(args: &CompareArgs, image: &Image, result: &Comparison) -> Json {
    let families: Vec<Json> = (result.families.iter())
        .map(|f| {
            json!({
                "family": f.name,
                "tests": f.count,
                "p": f.p,
                "worst": {
                    "at": [f.worst.at.0, f.worst.at.1],
                    "channel": CHANNELS[f.worst.channel],
                    "weighted": f.worst.is_weighted,
                    "difference": f.worst.difference,
                    "deviations": f.worst.z,
                    // a bound, or no noise at all
                    "degrees": (f.worst.degrees > 0.0 && f.worst.degrees.is_finite()).then_some(f.worst.degrees),
                    "p": f.worst.p,
                },
            })
        })
        .collect();
    let m = &result.metrics;
    let (width, height) = image.size();
    json!({
        "a": args.a.to_string_lossy(),
        "b": args.b.to_string_lossy(),
        "width": width,
        "height": height,
        "alpha": args.alpha,
        "verdict": verdict(result),
        "identical": result.is_identical,
        "p": result.p,
        "families": families,
        "detectable": result.detectable,
        "standard_errors": result.sources.map(|s| s.map(|s| s.name())),
        "not_finite": { "a": result.not_finite[0], "b": result.not_finite[1], "both": result.not_finite[2] },
        "metrics": {
            "rmse": m.rmse,
            "relmse": m.relmse,
            "mape": m.mape,
            "epsilon": m.epsilon,
            "bias": m.bias,
            "psnr": m.psnr.is_finite().then_some(m.psnr),
            "largest": m.largest,
        },
        "notes": result.notes,
    })
}

fn text(args: &CompareArgs, image: &Image, result: &Comparison) -> String {
    let (width, height) = image.size();
    let m = &result.metrics;
    let bias = m.bias.map(|b| format!("{:+.4} %", 100.0 * b)).join(", ");
    let mut text = format!(
        "A {}\nB {}\n{width} × {height} pixels\n\n\
         RMSE      {:.4e}   largest difference {:.4e}\n\
         relMSE    {:.4e}   (ε = {:.3e})\n\
         MAPE      {:.4} %   (ε = {:.3e})\n\
         PSNR      {:.2} dB\n\
         bias      {bias}   (sum of A over sum of B, by channel)\n",
        args.a.display(),
        args.b.display(),
        m.rmse,
        m.largest,
        m.relmse,
        m.epsilon,
        100.0 * m.mape,
        m.epsilon,
        m.psnr,
    );
    if !result.families.is_empty() {
        text += "\n            tests      p of all   largest deviation\n";
    }
    for f in &result.families {
        let (x, y) = f.worst.at;
        let place = match f.name {
            "image" if f.worst.is_weighted => String::from(", weighted by noise"),
            "image" => String::new(),
            "tile" => format!(" at {x},{y} ({TILE} × {TILE})"),
            _ => format!(" at {x},{y}"),
        };
        let degrees = match f.worst.degrees {
            v if v > 0.0 && v < 1000.0 => format!(", {v:.0} degrees of freedom"),
            _ => String::new(),
        };
        text += &format!(
            "  {:<8}{:>8}   {:>11.3e}   {:+.2}{place}, {}{degrees}\n",
            f.name, f.count, f.p, f.worst.z, CHANNELS[f.worst.channel],
        );
    }
    if let Some(detectable) = result.detectable {
        let percent = 100.0 * detectable;
        text += &format!(
            "  a difference of {percent:.3} % everywhere would be found in 95 of 100 cases\n"
        );
    }
    let [a, b, both] = result.not_finite;
    if a + b + both > 0 {
        text += &format!(
            "\npixels that are not finite: {a} in A alone, {b} in B alone, {both} in both\n"
        );
    }
    for note in &result.notes {
        text += &format!("note: {note}\n");
    }
    text += "\n";
    text += &conclusion(args.alpha, result);
    text
}

fn conclusion(alpha: f64, result: &Comparison) -> String {
    if result.is_identical {
        return String::from("identical: every value is the same number\n");
    }
    match (result.is_different, result.p) {
        (Some(true), Some(p)) if p < alpha => {
            format!(
                "different: chance alone does this in a part {p:.2e} of all pairs, less than {alpha}\n"
            )
        }
        (Some(true), _) => String::from("different: values are missing in one image alone\n"),
        (Some(false), Some(p)) => {
            format!(
                "not different: chance alone does this in a part {p:.2} of all pairs, not less than {alpha}\n"
            )
        }
        _ => String::from(
            "no verdict: neither image has standard errors (render --aov stderr,samples writes them)\n",
        ),
    }
}
