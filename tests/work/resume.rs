//! Renders that stop anywhere and go on: by a limit, by a signal, by `kill -9`.

use std::fs;
use std::process::Stdio;
use std::slice;
use std::time::Instant;

use etendue::checkpoint;
use etendue::film::Film;
use etendue::image_io::{Metadata, read_exr};
use etendue::render::{Control, Work};

use super::support::{
    command, etendue, has_device, list, number, read, render, scene, stderr, text, wait_for_samples,
};
use super::{bits, example, hash, renderer, rounds};

/// Stops after a random batch, saves, reads and goes on, until all is there; as often
/// as it takes for so many stops.
#[test]
fn any_stop_point_gives_the_same_bits() {
    if !has_device() {
        return;
    }
    let folder = scene();
    let path = folder.path().join("c");
    let square = folder.path().join("scene.gltf");
    for scene in [square.to_str().unwrap(), &example("cornell")] {
        let (mut renderer, settings) = renderer(scene);
        let mut batches = 0;
        let whole = renderer.render(&mut |_| {
            batches += 1;
            Control::Continue
        });
        let (whole, report) = (whole.unwrap(), renderer.report());
        let (mut stops, mut draw) = (0, 0);
        while stops < rounds(40, 200) {
            let (mut film, mut work) = (Film::of(&settings), Work::default());
            while film.samples() < 100 {
                draw += 1;
                let mut left = hash(draw) % batches;
                let samples = [settings.samples.clone()];
                let result = renderer.resume(film, work, &samples, &mut |progress| {
                    work = progress.work;
                    left = left.saturating_sub(1);
                    match left {
                        0 => Control::Stop,
                        _ => Control::Continue,
                    }
                });
                checkpoint::write(&path, &Metadata::new(), &result.unwrap()).unwrap();
                film = checkpoint::read(&path).unwrap().1;
                // the last one is no stop
                stops += u64::from(film.samples() < 100);
            }
            assert!(bits(&film) == bits(&whole), "stop {stops} of {scene}");
            assert_eq!(work.rays, report.rays);
            assert_eq!(work.ledger.truncated_paths, report.ledger.truncated_paths);
        }
        eprintln!("{scene}: {stops} stops");
    }
}

#[test]
fn a_film_of_other_settings_is_refused() {
    if !has_device() {
        return;
    }
    let (mut renderer, mut settings) = renderer(&example("cornell"));
    settings.width += 1;
    let film = Film::of(&settings);
    let result = renderer.resume(film, Work::default(), slice::from_ref(&(0..1)), &mut |_| {
        Control::Continue
    });
    assert!(result.is_err());
}

#[test]
fn the_program_goes_on_from_its_checkpoint() {
    if !has_device() {
        return;
    }
    let folder = scene();
    let all = "--width 32 --aov stderr,albedo --max-depth 3";
    render(&folder, &format!("-o whole.exr {all} --spp 48"));
    // what was rendered with fewer samples goes on to more
    let saved = format!("{all} --checkpoint c.ck --resume");
    let output = render(&folder, &format!("-o a.exr {saved} --spp 7"));
    assert!(
        stderr(&output).contains("no c.ck yet"),
        "{}",
        stderr(&output)
    );
    let output = render(
        &folder,
        &format!("-o a.exr {saved} --spp 48 --stats s.json"),
    );
    assert!(stderr(&output).contains("going on from samples 0..7"));
    let (whole, a) = (read(&folder, "whole.exr"), read(&folder, "a.exr"));
    assert!(whole.channels == a.channels);
    for (name, value) in &whole.metadata {
        let is_time = name.starts_with("times.");
        assert!(is_time || a.metadata.get(name) == Some(value), "{name}");
    }
    // the paths of both runs
    let stats = fs::read(folder.path().join("s.json")).unwrap();
    let stats: serde_json::Value = serde_json::from_slice(&stats).unwrap();
    let seconds = stats["times"]["render"].as_f64().unwrap();
    let paths = stats["paths_per_second"].as_f64().unwrap() * seconds;
    assert!((paths - 48.0 * 32.0 * 16.0).abs() < 0.5, "{paths} paths");

    // finished work is neither done again nor thrown away
    render(&folder, &format!("-o b.exr {saved} --spp 48"));
    assert!(read(&folder, "b.exr").channels == a.channels);
    let line = format!("render scene.gltf -o b.exr {all} --spp 48 --checkpoint c.ck");
    let output = etendue(&line, folder.path());
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("--resume"), "{}", stderr(&output));
}

#[cfg(unix)]
#[test]
fn signals_leave_a_checkpoint_and_what_is_finished() {
    if !has_device() {
        return;
    }
    for signal in ["INT", "TERM"] {
        let folder = scene();
        let line = "render scene.gltf -o a.exr --spp 100000000 --width 16 --checkpoint c.ck";
        let mut child = command(&format!("{line} --progress json"), folder.path())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        wait_for_samples(&mut child);
        kill(signal, child.id());
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(130), "{}", stderr(&output));
        assert_eq!(list(folder.path()), ["a.exr", "c.ck", "scene.gltf"]);
        let image = read(&folder, "a.exr");
        let (header, film) = checkpoint::read(&folder.path().join("c.ck")).unwrap();
        assert_eq!(film.samples() as f64, number(&image, "spp"));
        assert_eq!(text(&image, "ledger.stop"), "interrupt");
        assert_eq!(header["scene_hash"], image.metadata["scene_hash"]);
        assert!(film.mean() == image.rgb().unwrap());
    }
}

/// Whatever is found after `kill -9` is complete, no checkpoint is lost, and what
/// goes on from it ends with the same picture. Four at a time, each in a folder of its own.
#[cfg(unix)]
#[test]
fn killed_renders_leave_complete_files() {
    const WORKERS: u64 = 4;
    if !has_device() {
        return;
    }
    let kills = rounds(60, 1000) / WORKERS;
    let counts = std::thread::scope(|scope| {
        let work = |worker| scope.spawn(move || kill_often(worker * kills..(worker + 1) * kills));
        let workers: Vec<_> = (0..WORKERS).map(work).collect();
        let counts = workers.into_iter().map(|worker| worker.join().unwrap());
        counts.fold([0; 3], |sum, counts| {
            std::array::from_fn(|i| sum[i] + counts[i])
        })
    });
    let [met, finished, torn] = counts;
    let kills = WORKERS * kills;
    eprintln!("{kills} kills: {met} went on, {finished} came to the end, {torn} while writing");
    assert!(
        met > 0,
        "every render was killed before its first checkpoint"
    );
}

/// Kills once for each seed. Counts the renders that got on, those that came to the end, and
/// the files that were being written.
#[cfg(unix)]
fn kill_often(seeds: std::ops::Range<u64>) -> [u64; 3] {
    let folder = scene();
    let all = "--width 64 --spp 2000";
    let start = Instant::now();
    render(&folder, &format!("-o whole.exr {all}"));
    let whole = start.elapsed();
    let line = format!(
        "render scene.gltf -o a.exr -o a.png --stats s.json {all} -q \
         --checkpoint c.ck --resume --checkpoint-interval 0"
    );
    let path = |name: &str| folder.path().join(name);
    let (mut held, mut finished, mut met) = (0, 0, 0);
    for seed in seeds {
        let mut child = command(&line, folder.path()).spawn().unwrap();
        // most of the time before the first sample is left out
        std::thread::sleep(whole.mul_f64(0.4 + 0.7 * (hash(seed) % 1000) as f64 / 1000.0));
        // SIGKILL; a render that is done already does not mind
        child.kill().unwrap();
        child.wait().unwrap();
        if path("c.ck").exists() {
            let (_, film) = checkpoint::read(&path("c.ck")).unwrap();
            assert!(film.samples() >= held, "seed {seed}");
            met += u64::from(film.samples() > held);
            held = film.samples();
        } else {
            assert_eq!(held, 0, "seed {seed}: the checkpoint is gone");
        }
        if path("a.exr").exists() {
            read_exr(&path("a.exr")).unwrap();
        }
        if path("a.png").exists() {
            image::open(path("a.png")).unwrap();
        }
        if path("s.json").exists() {
            let text = fs::read(path("s.json")).unwrap();
            serde_json::from_slice::<serde_json::Value>(&text).unwrap();
        }
        if held == 2000 {
            // start anew
            fs::remove_file(path("c.ck")).unwrap();
            held = 0;
            finished += 1;
        }
    }
    let is_torn = |name: &&String| name.ends_with(".tmp");
    let torn = list(folder.path()).iter().filter(is_torn).count();
    let output = command(&line, folder.path()).output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(read(&folder, "a.exr").channels == read(&folder, "whole.exr").channels);
    [met, finished, torn as u64]
}

#[cfg(unix)]
fn kill(signal: &str, process: u32) {
    let kill = format!("kill -{signal} {process}");
    let sent = std::process::Command::new("sh")
        .args(["-c", &kill])
        .status();
    assert!(sent.unwrap().success());
}

/// Where samples are spread, a render that goes on keeps the spread of the checkpoint.
#[test]
fn spread_samples_go_on_as_they_were_spread() {
    if !has_device() {
        return;
    }
    let folder = scene();
    let all = "--width 32 --adaptive --aov stderr,samples,albedo";
    render(&folder, &format!("-o whole.exr {all} --spp 192"));
    let saved = format!("{all} --checkpoint c.ck --resume -o a.exr");
    render(&folder, &format!("{saved} --spp 64"));
    let output = render(&folder, &format!("{saved} --spp 192"));
    assert!(stderr(&output).contains("going on from samples 0..16"));
    let (whole, a) = (read(&folder, "whole.exr"), read(&folder, "a.exr"));
    assert!(whole.channels == a.channels);
    // 192 a pixel on average, and not the same everywhere
    let taken = whole.channel("samples").unwrap();
    let mean = taken.iter().sum::<f32>() / taken.len() as f32;
    assert!((185.0..=192.0).contains(&mean), "{mean}");
    let bounds = [48.0, 768.0];
    assert!(taken.iter().all(|n| (bounds[0]..=bounds[1]).contains(n)));
    assert!(taken.iter().any(|n| *n != taken[0]));

    // fewer than are there are refused, as they are where samples are even
    for fewer in [40, 100] {
        let line = format!("render scene.gltf {saved} --spp {fewer}");
        let output = etendue(&line, folder.path());
        assert!(!output.status.success(), "{fewer}");
        let expected = format!("0..48 there, 0..{} here", fewer / 4);
        assert!(stderr(&output).contains(&expected), "{}", stderr(&output));
    }
    // what began with too few to spread stays even, and takes all
    let late = saved.replace("c.ck", "late.ck");
    render(&folder, &format!("{late} --spp 40"));
    render(&folder, &format!("{late} --spp 80"));
    let taken = read(&folder, "a.exr");
    assert!(taken.channel("samples").unwrap().iter().all(|n| *n == 80.0));

    let even = saved.replace("--adaptive", "");
    let output = etendue(
        &format!("render scene.gltf {even} --spp 192"),
        folder.path(),
    );
    assert!(!output.status.success());
    assert!(
        stderr(&output).contains("settings.adaptive"),
        "{}",
        stderr(&output)
    );
}
