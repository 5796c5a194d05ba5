//! `etendue bench` and `etendue chart`.

use std::fs;
use std::path::Path;

use serde_json::{Value as Json, json};
use tempfile::TempDir;

use super::support::{command, etendue, has_device, list, scene, stderr};

fn lines(folder: &TempDir, name: &str) -> Vec<Json> {
    let text = fs::read_to_string(folder.path().join(name)).unwrap();
    text.lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect()
}

fn of<'a>(lines: &'a [Json], kind: &str) -> Vec<&'a Json> {
    lines.iter().filter(|line| line["kind"] == kind).collect()
}

fn succeeds(line: &str, folder: &Path) {
    let output = etendue(line, folder);
    assert!(output.status.success(), "{line}: {}", stderr(&output));
    assert!(output.stdout.is_empty(), "{line} writes to stdout");
}

/// The smallest bench has lines of every kind that it is asked for, and they can be drawn.
#[test]
fn a_tiny_bench_is_measured_and_drawn() {
    if !has_device() {
        return;
    }
    let folder = scene();
    let line = "bench scene.gltf -o bench.jsonl --width 16 --height 16 --spp 1,4 --seeds 3 \
                --reference 512 -q";
    succeeds(
        &format!("{line} --pictures --limits --growth depth"),
        folder.path(),
    );
    let first = lines(&folder, "bench.jsonl");
    assert_eq!(first[0]["kind"], "machine");
    assert_eq!(first[0]["schema"], 2);
    let scenes = of(&first, "scene");
    assert_eq!(scenes.len(), 1);
    assert_eq!(scenes[0]["reference_spp"], 512);
    let runs = of(&first, "run");
    // two estimators, two numbers of samples, three seeds
    assert_eq!(runs.len(), 12);
    for run in &runs {
        for name in ["seconds", "paths_per_second", "rays_per_second", "rmse"] {
            assert!(run[name].as_f64().unwrap() > 0.0, "{name} of {run}");
        }
        let (all, kept) = (&run["relmse"], &run["relmse_trimmed"]);
        assert!(kept.as_f64().unwrap() <= all.as_f64().unwrap(), "{run}");
    }
    let error = |spp: u64| -> f64 {
        let of = runs.iter().filter(|r| r["spp"] == spp);
        of.map(|r| r["relmse"].as_f64().unwrap()).sum()
    };
    // a factor of four in samples; Monte Carlo owes four in square error
    assert!(error(1) > 2.0 * error(4), "{} {}", error(1), error(4));
    for bias in of(&first, "bias") {
        let [value, error] = ["bias2", "bias2_error"].map(|n| bias[n].as_f64().unwrap());
        assert!(value.abs() < 4.9 * error, "{bias}");
    }
    assert_eq!(of(&first, "rate").len() % 3, 0);
    let limits = of(&first, "limit");
    assert_eq!(limits.len(), 3);
    for limit in limits {
        let number = |name: &str| limit[name].as_f64().unwrap();
        // a scene of few flat pieces visits no node, and reads the record that is met
        let read = number("nodes_per_ray") + number("records_per_ray");
        assert!(read > 0.1, "{limit}");
        assert!((0.0..=1.0).contains(&number("lane_use")), "{limit}");
        assert!(number("lane_use") > 0.1, "{limit}");
        assert!(number("bandwidth") > 1e8, "{limit}");
        for part in ["shading", "replay", "sorted", "reading", "ray_query"] {
            assert!(number(&format!("seconds_{part}")) > 0.0, "{limit}");
        }
        assert!(
            number("different_ray_query") <= 1e-3 * number("rays"),
            "{limit}"
        );
    }
    assert!(of(&first, "growth").len() > 3);
    assert_eq!(of(&first, "picture").len(), 3);

    let chart = "chart bench.jsonl -o chart.svg -o report.html";
    // drawing needs no device
    let output = command(chart, folder.path())
        .env("VK_DRIVER_FILES", "/nonexistent.json")
        .env("VK_ICD_FILENAMES", "/nonexistent.json")
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    let read = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
    let (svg, html) = (read("chart.svg"), read("report.html"));
    for text in [
        "etendue full",
        "etendue textbook",
        "√relMSE",
        "bvh",
        "slope −½",
        "traversal: its rays alone",
    ] {
        assert!(svg.contains(text), "{text}");
        assert!(html.contains(text), "{text}");
    }
    assert!(html.contains("data:image/png;base64,"));
    // nothing is loaded from elsewhere
    assert!(
        !html
            .replace("http://www.w3.org/2000/svg", "")
            .contains("http")
    );

    // the reference is found again: the same errors to the last digit
    succeeds(
        &line.replace("bench.jsonl", "bench.again.jsonl"),
        folder.path(),
    );
    let kept = fs::read_dir(folder.path().join("bench.references")).unwrap();
    assert_eq!(kept.count(), 2);
    let again = lines(&folder, "bench.again.jsonl");
    let errors = |lines: &[Json]| -> Vec<Json> {
        of(lines, "run")
            .iter()
            .map(|r| r["relmse"].clone())
            .collect()
    };
    assert_eq!(errors(&first), errors(&again));
}

fn run(contender: &str, spp: u64, seed: u64, seconds: f64, relmse: f64) -> Json {
    json!({
        "kind": "run", "scene": "a <scene>", "contender": contender, "spp": spp, "seed": seed,
        "seconds": seconds, "paths_per_second": 1.0, "rays_per_second": null, "rmse": 1.0,
        "relmse": relmse, "relmse_trimmed": relmse, "mean": [1.0, 1.0, 1.0],
    })
}

/// A peer that takes three times as long for the same error; what a later version may add is passed over.
#[test]
fn the_report_compares_at_equal_error() {
    let folder = tempfile::tempdir().unwrap();
    let mut text = String::from("{\"kind\":\"weather\",\"rain\":true}\n");
    let starts = [
        ("etendue full", "etendue", 18.0),
        ("other 1.0 fast", "other 1.0", 20.0),
    ];
    for (contender, renderer, seconds) in starts {
        let start = json!({
            "kind": "start", "scene": "a <scene>", "contender": contender, "renderer": renderer,
            "process": 1.0, "build": 2.0, "compile": seconds - 3.0,
        });
        text += &format!("{start}\n");
    }
    let contenders = [
        ("etendue full", 1.0),
        ("peer", 3.0),
        ("cheat", 0.1),
        ("other 1.0 slow", 5.0),
        ("other 1.0 fast", 3.0),
    ];
    for (name, factor) in contenders {
        for seed in 1..=5 {
            for spp in [1, 4, 16] {
                let (n, wobble) = (spp as f64, 1.0 + 0.01 * seed as f64);
                let line = run(name, spp, seed, factor * n, wobble / n);
                text += &format!("{line}\n");
            }
        }
    }
    let cheat = json!({
        "kind": "agreement", "scene": "a <scene>", "contender": "cheat",
        "difference": 0.25, "error": 0.001, "allowed": 0.003, "agrees": false,
    });
    text += &format!("{cheat}\n");
    fs::write(folder.path().join("b.jsonl"), text).unwrap();
    succeeds("chart b.jsonl -o r.html -o r.md", folder.path());
    let html = fs::read_to_string(folder.path().join("r.html")).unwrap();
    let row =
        "<td>a &lt;scene&gt;</td><td>peer</td><td class=\"n\">3</td><td class=\"n\">3 to 3</td>";
    assert!(html.contains(row), "{html}");
    assert!(html.contains("not compared: mean off by 25 ± 0.1 %"));
    // at its best, with what comes before the first sample: (20 + 3 · 16)/(18 + 16)
    let best = "| other 1.0 | a <scene> | fast | 3 | 3 to 3 | 3 (3 to 3) | 2 |";
    let tables = fs::read_to_string(folder.path().join("r.md")).unwrap();
    assert!(tables.contains(best), "{tables}");
    assert!(!html.contains("<scene>"));
}

#[test]
fn what_cannot_be_drawn_is_said_with_its_line() {
    let folder = tempfile::tempdir().unwrap();
    let good = run("etendue full", 1, 1, 1.0, 1.0).to_string();
    let picture = json!({ "kind": "picture", "scene": "s", "contender": "c", "spp": 1, "file": "../secret.png" });
    let cases = [
        (format!("{good}\n{{\"kind\":"), "b.jsonl, line 2"),
        (format!("{good}\n{good}\n{{\"kind\":\"run\"}}"), "line 3"),
        (
            String::from("{\"kind\":\"weather\"}"),
            "nothing that can be drawn",
        ),
        (String::new(), "nothing that can be drawn"),
        (format!("{good}\n{picture}"), "secret.png"),
    ];
    for (text, part) in cases {
        fs::write(folder.path().join("b.jsonl"), &text).unwrap();
        let output = etendue("chart b.jsonl -o c.html", folder.path());
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(1), "{text}: {message}");
        assert!(message.contains(part), "{part}: {message}");
    }
    assert_eq!(list(folder.path()), ["b.jsonl"]);
    for (line, part) in [
        ("chart b.jsonl -o c.png", ".svg nor .html nor .md"),
        ("chart b.jsonl", "--output"),
        ("bench -o b.jsonl", "<SCENES>"),
        ("bench s.gltf", "--output"),
        ("bench s.gltf -o b.jsonl --spp 0", "--spp"),
        ("bench s.gltf -o b.jsonl --peers=nowhere", "nowhere"),
    ] {
        let output = etendue(line, folder.path());
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{line}: {message}");
        assert!(message.contains(part), "{line}: {message}");
    }
}
