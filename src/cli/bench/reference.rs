//! References: converged pictures in two independent halves, kept beside the bench file.

use std::path::{Path, PathBuf};

use etendue::image_io::{Image, Metadata, read_exr, write_exr};
use etendue::render::Renderer;
use etendue::settings::Settings;
use sha2::{Digest, Sha256};

use super::super::failure::{FAILED, Failure};
use super::contender::render_all;
use super::error::{Picture, Reference};

/// Seeds of the halves, far from those of the runs.
pub const SEEDS: [u64; 2] = [1 << 40, (1 << 40) + 1];
/// What renders them.
pub const ESTIMATOR: &str = "full";

/// The reference of `spp` samples; `renderer` takes it only where it is not in `folder`. What the name of the
/// file is made of decides the picture: a scene that changes gets another reference.
pub fn reference(
    renderer: &mut Renderer,
    (scene, hash): (&str, &str),
    settings: &Settings,
    spp: u64,
    folder: &Path,
) -> Result<Reference, Failure> {
    std::fs::create_dir_all(folder)
        .map_err(|error| Failure::new(FAILED, error, "make the folder of the references"))?;
    let mut half = |seed: u64| -> Result<Picture, Failure> {
        let path = file(folder, scene, &key(hash, settings, spp, seed));
        if path.exists() {
            return stored(&path);
        }
        let film = render_all(renderer, spp.div_ceil(2), seed)?;
        let image = Image::from_film(&film, &[], Metadata::new())?;
        write_exr(&path, &image)?;
        Ok(film.mean())
    };
    Ok(Reference::new([half(SEEDS[0])?, half(SEEDS[1])?]))
}

fn file(folder: &Path, scene: &str, key: &str) -> PathBuf {
    folder.join(format!("{scene}-{}.exr", &key[..16]))
}

fn stored(path: &Path) -> Result<Picture, Failure> {
    let rgb = read_exr(path)?.rgb();
    let what = || {
        Failure::new(
            FAILED,
            anyhow::anyhow!("it has no colours"),
            "read a reference",
        )
    };
    rgb.ok_or_else(what)
}

fn key(hash: &str, settings: &Settings, spp: u64, seed: u64) -> String {
    let text = format!(
        "{hash} {}x{} camera {:?} depth {} spp {spp} seed {seed} etendue {} {ESTIMATOR}",
        settings.width,
        settings.height,
        settings.camera,
        settings.max_depth,
        env!("CARGO_PKG_VERSION"),
    );
    let digest = Sha256::digest(text);
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}
