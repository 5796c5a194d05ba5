//! Several devices in one process. One that is opened twice stands for two.

use std::slice;

use etendue::film::Film;
use etendue::render::{Control, DeviceOptions, Team, Work};
use etendue::scene::gltf;

use super::support::{etendue, has_device, read, render, scene, stderr};
use super::{bits, example, renderer};

fn team(scene: &str, settings: &etendue::settings::Settings, count: usize) -> Team {
    let scene = gltf::load(scene.as_ref()).unwrap();
    let device = DeviceOptions {
        device: Some(String::from("0")),
        ..DeviceOptions::default()
    };
    Team::new(&scene, settings, &vec![device; count]).unwrap()
}

#[test]
fn devices_together_give_the_bits_of_one() {
    if !has_device() {
        return;
    }
    let scene = example("cornell");
    let (mut renderer, settings) = renderer(&scene);
    let whole = renderer.render(&mut |_| Control::Continue).unwrap();
    let all = slice::from_ref(&settings.samples);
    let mut team = team(&scene, &settings, 3);
    for stop_after in [u64::MAX, 1, 20, 60] {
        let (mut film, mut work) = (Film::of(&settings), Work::default());
        let mut runs = 0;
        while film.samples() < 100 {
            let start = film.samples();
            let result = team.resume(film, work, all, &mut |progress| {
                work = progress.work;
                let is_enough = progress.samples_done - start >= stop_after;
                match is_enough {
                    true => Control::Stop,
                    false => Control::Continue,
                }
            });
            film = result.unwrap();
            runs += 1;
        }
        assert_eq!(runs > 1, stop_after != u64::MAX, "{runs} runs");
        assert!(bits(&film) == bits(&whole), "stopped after {stop_after}");
        // passes that were under way when it was told to stop are complete or gone
        let (report, wanted) = (team.report(), renderer.report());
        assert_eq!(report.rays, wanted.rays, "stopped after {stop_after}");
        assert_eq!(report.paths, wanted.paths);
        assert_eq!(report.ledger.truncated_paths, wanted.ledger.truncated_paths);
    }
}

#[test]
fn the_program_takes_several_devices() {
    if !has_device() {
        return;
    }
    let folder = scene();
    let all = "--width 32 --spp 40 --aov stderr,albedo";
    render(&folder, &format!("-o one.exr {all} --device 0"));
    render(
        &folder,
        &format!("-o two.exr {all} --device 0,0 --checkpoint c.ck"),
    );
    render(&folder, &format!("-o all.exr {all} --device all"));
    let one = read(&folder, "one.exr");
    for name in ["two.exr", "all.exr"] {
        let image = read(&folder, name);
        assert!(image.channels == one.channels, "{name}");
        for (entry, value) in &one.metadata {
            let is_own = entry.starts_with("times.") || entry == "settings.device";
            assert!(
                is_own || image.metadata.get(entry) == Some(value),
                "{name}: {entry}"
            );
        }
    }
    // one goes on with what two have done
    let line = format!("{all} --checkpoint c.ck --resume");
    render(
        &folder,
        &format!("-o one.exr {} --device 0", line.replace("40", "50")),
    );
    let output = etendue("rerender two.exr -o again.exr", folder.path());
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(read(&folder, "again.exr").channels == one.channels);

    // the pilot, and the samples that it spreads
    let all = "--width 32 --spp 96 --adaptive --aov stderr,samples";
    render(&folder, &format!("-o one.exr {all} --device 0"));
    render(&folder, &format!("-o two.exr {all} --device 0,0,0"));
    assert!(read(&folder, "two.exr").channels == read(&folder, "one.exr").channels);

    // a number is no part of a name, of which lavapipe's has "256 bits" and LLVM's version
    for number in 6..10 {
        let line = format!("render scene.gltf -o a.exr --width 8 --spp 1 --device 0,{number}");
        let output = etendue(&line, folder.path());
        assert_eq!(output.status.code(), Some(4), "{}", stderr(&output));
    }
}
