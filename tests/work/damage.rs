//! Checkpoints that are damaged, cut or made up: refused, never believed.

use std::fs;
use std::path::{Path, PathBuf};

use etendue::checkpoint;
use etendue::error::Error;
use etendue::film::{Allotment, Film};
use etendue::image_io::Metadata;
use etendue::settings::Crop;
use sha2::{Digest, Sha256};

use super::support::{etendue, scene, stderr};
use super::{bits, hash, rounds};

fn film() -> Film {
    let window = Crop {
        x0: 1,
        y0: 0,
        x1: 4,
        y1: 2,
    };
    let allotment = Allotment::from_exponents(vec![0, 4, 1, 2, 3, 0]).with_pilot(16);
    let mut film = Film::new(window, (5, 3), false).with_allotment(allotment);
    for (first, level) in [(1, 0), (4, 2), (32, 5)] {
        let values = (0..54).map(|i| (hash(first + i) % 1000) as f32).collect();
        film.add(first, level, values).unwrap();
    }
    film
}

fn header() -> Metadata {
    let mut header = Metadata::new();
    header.insert("text".into(), "Größe, 大小\n".into());
    header.insert("number".into(), 0.1.into());
    header
}

/// A good checkpoint and its bytes.
fn good(folder: &Path) -> (PathBuf, Vec<u8>) {
    let path = folder.join("c.ck");
    checkpoint::write(&path, &header(), &film()).unwrap();
    let bytes = fs::read(&path).unwrap();
    (path, bytes)
}

#[test]
fn checkpoints_hold_everything() {
    let folder = tempfile::tempdir().unwrap();
    let (path, _) = good(folder.path());
    let (read_header, read_film) = checkpoint::read(&path).unwrap();
    assert_eq!(read_header, header());
    assert!(bits(&read_film) == bits(&film()));
    assert_eq!(read_film.allotment(), film().allotment());
    assert_eq!(read_film.window(), film().window());
    assert_eq!(read_film.full_size(), (5, 3));
    let empty = Film::new(film().window(), (5, 3), true);
    checkpoint::write(&path, &Metadata::new(), &empty).unwrap();
    let (_, film) = checkpoint::read(&path).unwrap();
    assert!(film.samples() == 0 && film.has_aovs());
}

#[test]
fn every_cut_and_any_flipped_bit_is_noticed() {
    let folder = tempfile::tempdir().unwrap();
    let (path, bytes) = good(folder.path());
    for length in 0..bytes.len() {
        fs::write(&path, &bytes[..length]).unwrap();
        refused(&path, &format!("cut to {length}"));
    }
    fs::write(&path, [&bytes[..], &[0]].concat()).unwrap();
    refused(&path, "a byte more");
    for round in 0..rounds(1500, 15_000) {
        let mut damaged = bytes.clone();
        for flip in 0..1 + round % 4 {
            let bit = hash(round * 8 + flip) as usize % (bytes.len() * 8);
            damaged[bit / 8] ^= 1 << (bit % 8);
        }
        if damaged == bytes {
            // the same bit twice
            continue;
        }
        fs::write(&path, &damaged).unwrap();
        refused(&path, &format!("round {round}"));
    }
}

/// With a checksum that fits, so that only the reader's own checks are left.
#[test]
fn claims_are_not_believed() {
    let folder = tempfile::tempdir().unwrap();
    let (path, bytes) = good(folder.path());
    let body = bytes.len() - 32;
    for round in 0..rounds(3000, 30_000) {
        let mut bytes = bytes[..body].to_vec();
        // the largest numbers in the places of lengths and counts, among others
        let at = 16 + hash(round) as usize % (body - 20);
        let value = [u32::MAX, 1 << 31, 0, hash(round) as u32][round as usize % 4];
        bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
        let sum = Sha256::digest(&bytes);
        bytes.extend_from_slice(&sum);
        fs::write(&path, &bytes).unwrap();
        // values of pixels may be anything; all else must not be taken for more than there is
        if let Ok((_, film)) = checkpoint::read(&path) {
            assert!(film.bytes() <= bytes.len() as u64, "round {round}");
        }
    }
}

fn refused(path: &Path, what: &str) {
    match checkpoint::read(path) {
        Err(Error::Image { .. }) => {}
        Err(error) => panic!("{what}: {error}"),
        Ok(_) => panic!("{what}: taken for good"),
    }
}

#[test]
fn the_program_says_so() {
    let folder = scene();
    let (path, mut bytes) = good(folder.path());
    bytes[100] ^= 1;
    fs::write(&path, &bytes).unwrap();
    let line = "render scene.gltf -o a.exr --checkpoint c.ck --resume";
    let output = etendue(line, folder.path());
    let message = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(message.contains("c.ck: damaged"), "{message}");
    assert!(fs::read(&path).unwrap() == bytes);
}
