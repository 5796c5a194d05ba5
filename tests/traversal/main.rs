//! Traversal held against double precision: what rays meet, that closed meshes
//! have no gaps, that surfaces do not meet themselves, and that all backends and
//! both depths of the hierarchy agree. Everything runs under validation.
//!
//! Without a device the tests print why they are skipped; with the environment
//! variable `ETENDUE_REQUIRE_DEVICE` they fail instead.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "tests may unwrap, and they say why they skip and what they measured"
)]

#[path = "../common/backends.rs"]
mod backends;
#[path = "../common/random.rs"]
mod random;
#[path = "../common/statistics.rs"]
mod statistics;
#[path = "../common/tier.rs"]
mod tier;

mod brute;
mod furnace;
mod gap;
mod identity;
mod pictures;
mod planes;
mod replay;
mod scenes;
mod soup;
mod table;
mod two_level;
mod watertight;

use etendue::Error;
use etendue::film::Film;
use etendue::render::{Control, DeviceOptions, Renderer, Tuning, Workshop};
use etendue::scene::Scene;
use etendue::settings::{BackendChoice, Settings};

/// How shared meshes are traced.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Levels {
    /// Everything is copied into world space.
    Flat,
    /// Every mesh that is placed more than once keeps a group of its own.
    Two,
}

/// Kernels are compiled once.
static WORKSHOP: Workshop = Workshop::new();

fn levels_tuning(levels: Levels) -> Tuning {
    let copy_limit = match levels {
        Levels::Flat => usize::MAX,
        Levels::Two => 0,
    };
    Tuning {
        copy_limit,
        // The tree is what these tests are about; `planes` shows that small scenes are met alike without it.
        planes: Some(false),
        ..Tuning::default()
    }
}

/// A renderer under validation, or the printed reason why there is none.
fn open(scene: &Scene, settings: &Settings, levels: Levels) -> Option<Renderer> {
    open_tuned(scene, settings, levels_tuning(levels))
}

/// The same with other details.
fn open_tuned(scene: &Scene, settings: &Settings, tuning: Tuning) -> Option<Renderer> {
    let options = DeviceOptions {
        validation: true,
        ..DeviceOptions::default()
    };
    match Renderer::made_in(&WORKSHOP, scene, settings, &options, tuning) {
        Ok(renderer) => {
            assert_eq!(renderer.report().backend, settings.backend);
            Some(renderer)
        }
        Err(error @ Error::Unsupported { .. }) if !backends::is_device_required() => {
            println!("skipped: {error}");
            None
        }
        Err(error) => panic!("{error}"),
    }
}

/// A renderer for probes.
fn prober(scene: &Scene, backend: BackendChoice, levels: Levels) -> Option<Renderer> {
    open(scene, &probing(backend), levels)
}

fn probing(backend: BackendChoice) -> Settings {
    Settings {
        width: 8,
        height: 8,
        samples: 0..1,
        backend,
        ..Settings::default()
    }
}

/// The complete film, with the ledger clean.
fn render(renderer: &mut Renderer) -> Film {
    let film = renderer.render(&mut |_| Control::Continue).unwrap();
    assert_eq!(renderer.report().ledger.non_finite, 0);
    film
}

/// Asserts that validation had nothing to say.
fn finish(renderer: &Renderer) {
    assert_eq!(renderer.validation_messages(), Vec::<String>::new());
}
