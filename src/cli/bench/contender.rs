//! Who renders: this program with one estimator, or a peer with one sampler.

use std::cell::RefCell;
use std::path::Path;
use std::rc::Rc;
use std::time::Instant;

use etendue::Result;
use etendue::film::Film;
use etendue::render::{Control, Renderer};

use super::super::failure::{FAILED, Failure};
use super::error::Picture;
use super::peer::Peer;

/// A picture and what it took.
pub struct Shot {
    pub picture: Picture,
    /// Samples a pixel: what was asked for, or more.
    pub spp: u64,
    /// Between the first and the last sample.
    pub seconds: f64,
    /// Absent where a peer does not count.
    pub rays: Option<u64>,
}

/// Renders the loaded scene again and again.
pub enum Contender {
    /// This program.
    Own {
        name: String,
        renderer: Box<Renderer>,
        /// A pilot spreads the samples over the pixels.
        is_adaptive: bool,
    },
    /// Another one.
    Peer {
        name: String,
        sampler: String,
        process: Rc<RefCell<Peer>>,
    },
}

impl Contender {
    pub fn name(&self) -> &str {
        match self {
            Self::Own { name, .. } | Self::Peer { name, .. } => name,
        }
    }

    pub fn is_peer(&self) -> bool {
        matches!(self, Self::Peer { .. })
    }

    pub fn render(&mut self, spp: u64, seed: u64, scratch: &Path) -> Result<Shot, Failure> {
        match self {
            Self::Own {
                renderer,
                is_adaptive,
                ..
            } => {
                let (mut samples, mut seconds, mut rays) = (spp, 0.0, 0);
                if *is_adaptive {
                    let start = Instant::now();
                    renderer.restart(0..spp, seed)?;
                    samples = renderer.spread(spp)?;
                    if samples < spp {
                        seconds = start.elapsed().as_secs_f64();
                        rays = renderer.report().rays;
                    }
                }
                let film = render_all(renderer, samples, seed)?;
                let report = renderer.report();
                Ok(Shot {
                    picture: film.mean(),
                    spp,
                    seconds: seconds + report.times.render,
                    rays: Some(rays + report.rays),
                })
            }
            Self::Peer {
                sampler, process, ..
            } => {
                let mut process = process.borrow_mut();
                let (picture, seconds, spp) = process
                    .render(sampler, spp, seed, scratch)
                    .map_err(|error| Failure::new(FAILED, error, "render with a peer"))?;
                Ok(Shot {
                    picture,
                    spp,
                    seconds,
                    rays: None,
                })
            }
        }
    }
}

/// All of so many samples.
pub fn render_all(renderer: &mut Renderer, spp: u64, seed: u64) -> Result<Film> {
    renderer.restart(0..spp, seed)?;
    renderer.render(&mut |_| Control::Continue)
}

/// Finds the size of batches and the pace of lanes that fit, which a first render only feels for.
pub fn warm_up(renderer: &mut Renderer) -> Result<()> {
    for _ in 0..2 {
        render_all(renderer, 16, 0)?;
    }
    Ok(())
}
