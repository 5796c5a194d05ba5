//! Every step of writing a file may fail.

use std::fs;
use std::path::Path;

use etendue::fault::{Kind, Manner, Plan, arm, disarm};
use etendue::film::Film;
use etendue::image_io::{Image, Metadata, Tone, write_bytes, write_exr, write_png};
use etendue::settings::Settings;
use etendue::{Error, Result, checkpoint};

use super::support::list;

/// One of the ways in which files are written.
type Writer<'a> = &'a dyn Fn(&Path) -> Result<()>;

/// Writes a file with a fault; the names of the steps, and how it ended.
fn attempt(
    writer: Writer,
    path: &Path,
    at: u64,
    manner: Manner,
) -> (Vec<&'static str>, Result<()>) {
    let kind = Kind::File;
    arm(Plan { kind, at, manner });
    let result = writer(path);
    (disarm(), result)
}

/// With a file of before, and without.
fn every_step_fails_cleanly(name: &str, writer: Writer) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    let old = b"what was there before".as_slice();
    for has_old in [false, true] {
        let before = || match has_old {
            true => fs::write(&path, old).unwrap(),
            false => drop(fs::remove_file(&path)),
        };
        before();
        let (steps, result) = attempt(writer, &path, 0, Manner::Once);
        result.unwrap();
        let new = fs::read(&path).unwrap();
        for step in ["create", "write", "flush", "rename"] {
            assert!(steps.contains(&step), "{name}: {step} is not in {steps:?}");
        }
        for at in 1..=steps.len() {
            for manner in [Manner::Once, Manner::Lasting] {
                before();
                let (made, result) = attempt(writer, &path, at as u64, manner);
                let step = steps[at - 1];
                let about = format!("{name}: {step}, step {at}, {manner:?}");
                assert_eq!(made[..at], steps[..at], "{about}");
                let Err(Error::Io { path: named, .. }) = &result else {
                    panic!("{about}: {result:?}");
                };
                assert_eq!(*named, path, "{about}");
                // the file has its name already; only whether that lasts is unknown
                let is_published = step == "flush folder";
                let wanted = if is_published {
                    Some(new.as_slice())
                } else {
                    has_old.then_some(old)
                };
                assert!(fs::read(&path).ok().as_deref() == wanted, "{about}");
                let names = list(folder.path());
                assert!(
                    names.len() == usize::from(wanted.is_some()),
                    "{about}: {names:?}"
                );
            }
        }
    }
}

#[test]
fn every_step_of_writing_may_fail() {
    let settings = Settings {
        width: 40,
        height: 30,
        samples: 0..3,
        ..Settings::default()
    };
    let mut film = Film::of(&settings);
    for (first, level) in [(0, 1), (2, 0)] {
        let values = vec![0.5; film.pixels() * film.floats_per_pixel()];
        film.add(first, level, values).unwrap();
    }
    let header = Metadata::new();
    let mut image = Image::from_film(&film, &[], header.clone()).unwrap();
    // Entries of a header are written in any order, and the bytes of two files are compared here.
    image.metadata.clear();
    every_step_fails_cleanly("a.json", &|path| write_bytes(path, b"{}"));
    every_step_fails_cleanly("a.exr", &|path| write_exr(path, &image));
    every_step_fails_cleanly("a.png", &|path| write_png(path, &image, Tone::Srgb, 0.0));
    every_step_fails_cleanly("a.ck", &|path| checkpoint::write(path, &header, &film));
}
