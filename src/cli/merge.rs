//! `etendue merge`: shards of one render into one image.

use std::ops::Range;
use std::path::{Path, PathBuf};

use etendue::film::Film;
use etendue::image_io::{
    Aov, Format, Image, Metadata, Value, lock, probe_writable, read_exr, write_exr,
};
use etendue::{Error, Result};

use super::args::MergeArgs;
use super::failure::{Failure, Outcome};
use super::header::{STOP, ranges};
use super::identity::{DEVICE, JOB, check, number, text};
use super::rerender::samples;

/// Sums of doubles are exact to this fraction of the ledger's unit of throughput.
const THROUGHPUT_UNITS: f64 = 65_536.0;

/// A shard without its film.
struct Shard {
    path: PathBuf,
    header: Metadata,
    /// Samples that it holds.
    held: Vec<Range<u64>>,
    /// Samples that it was asked for.
    asked: Vec<Range<u64>>,
    /// Pixels times samples.
    paths: f64,
    /// Layers that the film does not know.
    layers: Vec<(Aov, Vec<f32>)>,
}

/// Merges and writes.
pub fn run(args: &MergeArgs) -> Result<Outcome, Failure> {
    if Format::of(&args.output).map_err(Failure::usage)? != Format::Exr {
        return Err(Failure::usage(Error::Settings {
            name: "--output",
            what: format!("{} does not end in .exr", args.output.display()),
        }));
    }
    probe_writable(&args.output).map_err(Failure::usage)?;
    let _lock = lock(&args.output).map_err(Failure::usage)?;
    let (film, mut shards) = gather(&args.shards).map_err(Failure::usage)?;
    // so that the header does not depend on the order either
    shards.sort_by_key(|shard| shard.held.first().map(|range| range.start));
    let asked = hull(&shards);
    if !args.partial {
        complete(&film, &asked, &shards).map_err(Failure::usage)?;
    }
    let header = header(&film, &asked, &shards);
    let layers = text(&header, "settings.aov").unwrap_or_default();
    let is_asked = |aov: &Aov| layers.split(',').any(|name| name == aov.name());
    let layers: Vec<_> = Aov::ALL.into_iter().filter(is_asked).collect();
    let mut image = Image::from_film(&film, &layers, header)?;
    for (aov, values) in std::mem::take(&mut shards[0].layers) {
        image.push_layer(aov, values);
    }
    image.push_nodes(&film);
    write_exr(&args.output, &image)?;
    tracing::info!("wrote {}", args.output.display());
    Ok(Outcome::Done)
}

/// Reads the shards one after the other into one film.
fn gather(paths: &[PathBuf]) -> Result<(Film, Vec<Shard>)> {
    let (mut film, mut shards) = read(&paths[0]).map(|(film, shard)| (film, vec![shard]))?;
    for path in &paths[1..] {
        let (more, shard) = read(path)?;
        let first: &Shard = &shards[0];
        let whose = format!("in {}", first.path.display());
        let fields = [JOB, &["settings.aov"], DEVICE].concat();
        check(path, &shard.header, &first.header, &whose, &fields)?;
        for other in &shards {
            if let Some(common) = overlap(&shard.held, &other.held) {
                return Err(Error::Mismatch {
                    path: path.clone(),
                    field: "samples",
                    what: format!(
                        "{}..{} are in {} as well",
                        common.start,
                        common.end,
                        other.path.display()
                    ),
                });
            }
        }
        if let Some((aov, _)) = first
            .layers
            .iter()
            .find(|layer| !shard.layers.contains(layer))
        {
            return Err(Error::Mismatch {
                path: path.clone(),
                field: aov.name(),
                what: format!("the layer differs from the one {whose}"),
            });
        }
        film.merge(more)?;
        shards.push(shard);
    }
    Ok((film, shards))
}

fn read(path: &Path) -> Result<(Film, Shard)> {
    let fail = |what| Error::Image {
        path: path.to_owned(),
        what,
    };
    let image = read_exr(path)?;
    let held = samples(path, &image.metadata, "samples")?;
    let asked = samples(path, &image.metadata, "settings.samples")?;
    let film = image.film().map_err(fail)?;
    let numbers = Aov::ALL.into_iter().filter(|aov| aov.is_identity());
    let layer = |aov: Aov| Some((aov, image.channel(aov.name())?.to_vec()));
    let layers = numbers.filter_map(layer).collect();
    if film.ranges() != held {
        let is = ranges(&film.ranges());
        let should = ranges(&held);
        return Err(fail(format!(
            "its sums are of samples {is}, its header says {should}"
        )));
    }
    let shard = Shard {
        path: path.to_owned(),
        held,
        asked,
        paths: film.samples() as f64 * film.pixels() as f64,
        layers,
        header: image.metadata,
    };
    Ok((film, shard))
}

fn overlap(a: &[Range<u64>], b: &[Range<u64>]) -> Option<Range<u64>> {
    let common = |a: &Range<u64>, b: &Range<u64>| a.start.max(b.start)..a.end.min(b.end);
    let mut pairs = a.iter().flat_map(|a| b.iter().map(move |b| common(a, b)));
    pairs.find(|range| !range.is_empty())
}

/// From the first sample that any shard was asked for to the last.
fn hull(shards: &[Shard]) -> Range<u64> {
    let asked = || shards.iter().flat_map(|shard| &shard.asked);
    let start = asked().map(|range| range.start).min().unwrap_or(0);
    start..asked().map(|range| range.end).max().unwrap_or(0)
}

/// Refuses a render of which samples are missing.
fn complete(film: &Film, asked: &Range<u64>, shards: &[Shard]) -> Result<()> {
    let missing = film.missing(std::slice::from_ref(asked));
    let Some(gap) = missing.first() else {
        return Ok(());
    };
    // the shard that was to hold the gap, or else the one before it
    let owes = |shard: &&Shard| overlap(&shard.asked, std::slice::from_ref(gap)).is_some();
    let before = |shard: &&Shard| shard.held.first().is_some_and(|r| r.start < gap.start);
    let shard = shards.iter().find(owes);
    let shard = shard.or_else(|| shards.iter().rfind(before));
    Err(Error::Mismatch {
        path: shard.unwrap_or(&shards[0]).path.clone(),
        field: "samples",
        what: format!(
            "{} are missing in {}..{}; --partial allows that",
            ranges(&missing),
            asked.start,
            asked.end
        ),
    })
}

/// The header of a single run, with the sums of the times.
fn header(film: &Film, asked: &Range<u64>, shards: &[Shard]) -> Metadata {
    let mut header = shards[0].header.clone();
    let mut put = |name: &str, value: Value| header.insert(name.to_owned(), value);
    put("samples", ranges(&film.ranges()).into());
    put("spp", (film.samples() as f64).into());
    put(
        "settings.samples",
        ranges(std::slice::from_ref(asked)).into(),
    );
    let sum = |name: &str| -> f64 {
        let values = shards.iter().filter_map(|s| number(&s.header, name));
        values.sum()
    };
    for name in ["times.load", "times.build", "times.compile", "times.render"] {
        put(name, sum(name).into());
    }
    for name in ["non_finite", "truncated_paths", "interior_overflows"] {
        let name = format!("ledger.{name}");
        put(&name, sum(&name).into());
    }
    // headers hold a mean; the sums that it was made of are multiples of a unit
    let throughput = |shard: &Shard| {
        let mean = number(&shard.header, "ledger.truncated_throughput").unwrap_or(0.0);
        (mean * shard.paths * THROUGHPUT_UNITS).round() / THROUGHPUT_UNITS
    };
    let paths: f64 = shards.iter().map(|shard| shard.paths).sum();
    let throughput: f64 = shards.iter().map(throughput).sum();
    put("ledger.truncated_throughput", (throughput / paths).into());
    let mut stops: Vec<&str> = Vec::new();
    for stop in shards.iter().filter_map(|s| text(&s.header, STOP)) {
        for stop in stop.split("; ").filter(|stop| !stop.is_empty()) {
            if !stops.contains(&stop) {
                stops.push(stop);
            }
        }
    }
    put(STOP, stops.join("; ").into());
    header
}
