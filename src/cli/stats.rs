//! `--stats`: one JSON object that describes a render.

use etendue::image_io::Value;
use etendue::render::Memory;
use serde_json::{Map, Number, Value as Json, json};

use super::checkpoint::Cost;
use super::header::Record;

/// Changes when a name is changed or removed; additions do not count.
const SCHEMA: u32 = 1;

/// Seconds that the header cannot know, since it is part of what is written.
pub struct LateTimes {
    /// Writing the images.
    pub write: f64,
    /// From the start of the program.
    pub total: f64,
    /// Of the time of the render, what checkpoints took.
    pub checkpoints: Cost,
}

/// The object: everything that stands in the header, nested at the dots, and more.
pub fn statistics(record: &Record, late: &LateTimes) -> Json {
    let mut root = Map::new();
    for (name, value) in record.metadata() {
        let value = match value {
            Value::Text(text) => Json::from(text),
            Value::Number(number) => json_number(number),
        };
        match name.split_once('.') {
            None => drop(root.insert(name, value)),
            Some((group, name)) => {
                let group = root.entry(group).or_insert_with(|| json!({}));
                group[name] = value;
            }
        }
    }
    let report = record.report;
    root.insert("schema".into(), SCHEMA.into());
    // what must be text in a header
    root["settings"]["seed"] = record.job.settings.seed.into();
    let on = report.features.iter().filter(|f| f.on).map(|f| f.name);
    root.insert("features".into(), on.collect());
    root["times"]["write"] = late.write.into();
    root["times"]["total"] = late.total.into();
    root["times"]["checkpoints"] = late.checkpoints.time.as_secs_f64().into();
    root.insert("checkpoints".into(), late.checkpoints.count.into());
    let rate = |count: u64| {
        let rate = count as f64 / report.times.render;
        if rate.is_finite() { rate } else { 0.0 }
    };
    root.insert("paths_per_second".into(), rate(report.paths).into());
    root.insert("rays_per_second".into(), rate(report.rays).into());
    let mut memory = memory(&report.memory);
    memory["peak_host"] = peak_host_bytes().into();
    root.insert("memory".into(), memory);
    root.into()
}

/// Bytes by purpose.
pub fn memory(memory: &Memory) -> Json {
    json!({
        "geometry": memory.geometry,
        "acceleration": memory.acceleration,
        "textures": memory.textures,
        "tables": memory.tables,
        "film": memory.film,
    })
}

/// Counts look like counts.
fn json_number(number: f64) -> Json {
    const EXACT: f64 = (1_u64 << 53) as f64;
    if number.fract() == 0.0 && number.abs() <= EXACT {
        Json::from(number as i64)
    } else {
        Number::from_f64(number).map_or(Json::Null, Json::Number)
    }
}

/// Most memory that this process ever had in use, bytes; unknown outside Linux.
fn peak_host_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_their_kind() {
        assert_eq!(json_number(128.0).to_string(), "128");
        assert_eq!(json_number(0.25).to_string(), "0.25");
        assert_eq!(json_number(f64::INFINITY), Json::Null);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn the_peak_counts_what_was_used() {
        let block = std::hint::black_box(vec![1_u8; 32 << 20]);
        let peak = peak_host_bytes().expect("Linux tells");
        assert!(peak > block.len() as u64, "{peak}");
    }
}
