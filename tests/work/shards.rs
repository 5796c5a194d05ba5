//! Any split, merged in any order, is the picture of one run.

use std::fs;
use std::slice;

use etendue::film::Film;
use etendue::image_io::{Image, Metadata, read_exr, write_exr};
use etendue::render::{Control, Work};
use tempfile::TempDir;

use super::support::{etendue, has_device, read, render, scene, stderr, text};
use super::{bits, example, hash, renderer};

/// Cuts 3..103 into so many ranges of random length.
fn cut(shards: u64, seed: u64) -> Vec<std::ops::Range<u64>> {
    let mut cuts = vec![3, 103];
    let mut draw = seed * 1000 + shards;
    while cuts.len() < shards as usize + 1 {
        draw += 1;
        let at = 4 + hash(draw) % 99;
        if !cuts.contains(&at) {
            cuts.push(at);
        }
    }
    cuts.sort_unstable();
    cuts.windows(2).map(|c| c[0]..c[1]).collect()
}

/// Through files, as shards travel.
#[test]
fn any_number_in_any_order_gives_the_same_bits() {
    if !has_device() {
        return;
    }
    let folder = scene();
    let path = folder.path().join("shard.exr");
    for scene in ["cornell", "glass", "lights"] {
        let (mut renderer, settings) = renderer(&example(scene));
        let whole = renderer.render(&mut |_| Control::Continue).unwrap();
        for count in [1, 2, 3, 4, 7, 16] {
            let films: Vec<_> = cut(count, 1)
                .into_iter()
                .map(|range| {
                    let empty = Film::of(&settings);
                    let film = renderer.resume(
                        empty,
                        Work::default(),
                        slice::from_ref(&range),
                        &mut |_| Control::Continue,
                    );
                    let film = film.unwrap();
                    let mut image = Image::from_film(&film, &[], Metadata::new()).unwrap();
                    image.push_nodes(&film);
                    image
                })
                .collect();
            for order in 0..24 {
                let mut films: Vec<_> = films.iter().enumerate().collect();
                films.sort_by_key(|(i, _)| hash(order * 1000 + *i as u64));
                let mut merged = Film::of(&settings);
                for (_, image) in films {
                    if order == 0 {
                        write_exr(&path, image).unwrap();
                        merged.merge(read_exr(&path).unwrap().film().unwrap())
                    } else {
                        merged.merge(image.film().unwrap())
                    }
                    .unwrap();
                }
                assert!(
                    bits(&merged) == bits(&whole),
                    "{count} shards of {scene}, order {order}"
                );
            }
        }
    }
}

/// Merges files of a folder; fails the test unless that works.
fn merge(folder: &TempDir, line: &str) {
    let output = etendue(&format!("merge {line}"), folder.path());
    assert!(output.status.success(), "merge {line}: {}", stderr(&output));
}

/// All but what it took.
fn without_times(image: &Image) -> Metadata {
    let all = image.metadata.clone().into_iter();
    all.filter(|(name, _)| !name.starts_with("times."))
        .collect()
}

#[test]
fn the_program_merges_files_to_the_image_of_one_run() {
    if !has_device() {
        return;
    }
    let folder = scene();
    let cornell = example("cornell");
    fs::copy(&cornell, folder.path().join("scene.gltf")).unwrap();
    let all = "--width 24 --height 24 --max-depth 2 --aov stderr,samples,depth,normal,instance,material --seed 7";
    render(&folder, &format!("-o whole.exr --samples 2..29 {all}"));
    for (name, range) in [
        ("a", "2..3"),
        ("b", "3..11"),
        ("c", "11..12"),
        ("d", "12..29"),
    ] {
        render(&folder, &format!("-o {name}.exr --samples {range} {all}"));
    }
    let whole = read(&folder, "whole.exr");
    for order in ["a b c d", "d c b a", "c a d b"] {
        let files = order.replace(' ', ".exr ");
        merge(&folder, &format!("{files}.exr -o m.exr"));
        let merged = read(&folder, "m.exr");
        assert!(merged.channels == whole.channels, "{order}");
        assert_eq!(without_times(&merged), without_times(&whole), "{order}");
    }
    // truncated paths are there, and all of them
    let lost = &whole.metadata["ledger.truncated_throughput"];
    assert_ne!(*lost, etendue::image_io::Value::Number(0.0));

    // merges of merges, with and without gaps
    merge(&folder, "c.exr b.exr -o bc.exr");
    merge(&folder, "d.exr a.exr --partial -o ad.exr");
    let partial = read(&folder, "ad.exr");
    assert_eq!(text(&partial, "samples"), "2..3,12..29");
    assert_eq!(text(&partial, "settings.samples"), "2..29");
    merge(&folder, "ad.exr bc.exr -o m.exr");
    let merged = read(&folder, "m.exr");
    assert!(merged.channels == whole.channels);
    assert_eq!(without_times(&merged), without_times(&whole));
    // and the picture is that of a render that was never meant to be split
    render(&folder, &format!("-o e.exr --samples 0..2 {all}"));
    render(&folder, &format!("-o plain.exr --spp 29 {all}"));
    merge(&folder, "m.exr e.exr -o m.exr");
    let (merged, plain) = (read(&folder, "m.exr"), read(&folder, "plain.exr"));
    for channel in &plain.channels {
        assert_eq!(merged.channel(&channel.name), Some(&channel.values[..]));
    }
}

/// What a signal or a limit leaves of a shard counts as what it is.
#[test]
fn shards_that_ended_early_are_gaps() {
    if !has_device() {
        return;
    }
    let folder = scene();
    render(
        &folder,
        "-o a.exr --samples 0..1000000 --time 0.2 --width 16",
    );
    let ended = read(&folder, "a.exr");
    let output = etendue("merge a.exr -o m.exr", folder.path());
    assert_eq!(output.status.code(), Some(2));
    let message = stderr(&output);
    assert!(
        message.contains("a.exr: samples") && message.contains("--partial"),
        "{message}"
    );
    merge(&folder, "a.exr -o m.exr --partial");
    let merged = read(&folder, "m.exr");
    assert!(merged.channels == ended.channels);
    assert_eq!(text(&merged, "ledger.stop"), "time 0.2");
}
