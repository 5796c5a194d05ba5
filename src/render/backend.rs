//! What renders batches, on whichever API, and what all of them compute alike.

use std::cell::Cell;
use std::ops::Range;

use super::stream::Stream;
use super::traversal::GROUP;
use super::{Ledger, Memory, TraversalCounts};
use crate::error::{Error, Result};
use crate::layout::{self, ProbeHit, ProbeRay, StreamRay};
use crate::spec::Spec;

/// A scene on a device, ready to render batches.
pub(super) trait Backend: Send {
    fn memory(&self) -> Memory;

    fn set_seed(&mut self, seed: u64) -> Result<()>;

    /// Gives each pixel of the window its exponent, where the kernel is made for that.
    fn set_allotment(&self, exponents: &[u32]) -> Result<()>;

    /// What the kernels read, and bytes of the film buffer.
    fn frame(&self) -> Frame<'_>;

    /// Renders a batch into the film buffer; returns seconds.
    fn render(&mut self, batch: &Batch) -> Result<f64>;

    /// Appends the film of a band of `pixels`.
    fn read(&self, pixels: usize, values: &mut Vec<f32>) -> Result<()>;

    fn reset_ledger(&self) -> Result<()>;

    /// Rays traced, and what may have changed the expected value.
    fn ledger(&self) -> Result<(u64, Ledger)>;

    /// What given rays meet.
    fn probe(&self, rays: &[ProbeRay]) -> Result<Vec<ProbeHit>>;

    fn validation_messages(&self) -> Vec<String>;

    /// Bytes of device memory that buffers have, and that were taken from the driver; 0 where that is not known.
    fn device_memory(&self) -> (u64, u64) {
        (0, 0)
    }

    /// What traversal did since the ledger was reset, where a kernel counts it.
    fn traversal_counts(&self) -> Result<TraversalCounts> {
        Ok(TraversalCounts::default())
    }

    /// Takes the rays of a pass, or room for them, where the kernel is made for that.
    fn hold(&mut self, _stream: &Stream) -> Result<()> {
        Err(no_stream())
    }

    /// How many rays of each pixel were recorded, tile by tile.
    fn recorded_counts(&self) -> Result<Vec<u32>> {
        Err(no_stream())
    }

    fn recorded_rays(&self, _count: usize) -> Result<Vec<StreamRay>> {
        Err(no_stream())
    }

    /// Makes the driver compile: no sample is taken.
    fn warm_up(&mut self) -> Result<()> {
        let batch = Batch {
            first_sample: 0,
            samples: 0,
            tiles: 0..1,
            film_first_pixel: 0,
            is_together: false,
        };
        self.render(&batch).map(|_| ())
    }
}

fn no_stream() -> Error {
    Error::Unsupported {
        what: String::from("recorded rays"),
        missing: String::from("this backend has no kernel for them"),
    }
}

/// Rows of tiles whose film fits one buffer.
pub(super) struct Band {
    pub tiles: Range<u32>,
    /// Pixels of the window, row by row.
    pub pixels: Range<u32>,
}

/// Work groups that share the pixels of a batch on CPUs, whose drivers divide groups among their threads beforehand: more than
/// there are threads. The last ones find nothing to do.
const SHARERS: u32 = 64;

/// Some tiles, an aligned power of two of samples.
pub(super) struct Batch {
    pub first_sample: u64,
    pub samples: u32,
    pub tiles: Range<u32>,
    pub film_first_pixel: u32,
    /// Lanes of a subgroup start their samples together.
    pub is_together: bool,
}

impl Batch {
    /// The push constants, and the number of work groups. Where these share the pixels, `taken` counts what they take.
    pub fn push(&self, taken: Option<&Cell<u32>>) -> (layout::Batch, u32) {
        let count = self.tiles.len() as u32;
        let push = layout::Batch {
            first_sample_low: self.first_sample as u32,
            first_sample_high: (self.first_sample >> 32) as u32,
            sample_count: self.samples,
            first_tile: self.tiles.start,
            tile_count: count,
            is_shared: u32::from(taken.is_some()),
            film_first_pixel: self.film_first_pixel,
            is_together: u32::from(self.is_together),
            taken: taken.map_or(0, Cell::get),
        };
        let Some(taken) = taken else {
            return (push, count);
        };
        if self.samples > 0 {
            // each invocation asks once more than it gets
            let asked = (count + SHARERS).wrapping_mul(GROUP);
            taken.set(push.taken.wrapping_add(asked));
        }
        (push, SHARERS)
    }
}

/// The window and the buffer that holds its film, or a part of it.
pub(super) struct Frame<'a> {
    pub params: &'a layout::Params,
    /// What the kernels are made for.
    pub spec: &'a Spec,
    pub film_bytes: u64,
}

impl Frame<'_> {
    /// Tiles of the window.
    pub fn tiles(&self) -> u32 {
        self.params.tiles_x * self.params.tiles_y
    }

    /// The window in parts whose film fits the buffer.
    pub fn bands(&self) -> Vec<Band> {
        let rows = ((self.film_bytes / row_bytes(self.params, self.spec.aovs)) as u32).max(1);
        (0..self.params.tiles_y)
            .step_by(rows as usize)
            .map(|row| {
                let end = (row + rows).min(self.params.tiles_y);
                let pixel_row = |r: u32| {
                    (r * layout::TILE).min(self.params.window_height) * self.params.window_width
                };
                Band {
                    tiles: row * self.params.tiles_x..end * self.params.tiles_x,
                    pixels: pixel_row(row)..pixel_row(end),
                }
            })
            .collect()
    }
}

/// Floats of the film for each pixel.
pub(super) fn film_floats(aovs: bool) -> u32 {
    if aovs {
        layout::FILM_FLOATS_AOV
    } else {
        layout::FILM_FLOATS
    }
}

/// Bytes of a film of a row of tiles.
fn row_bytes(params: &layout::Params, aovs: bool) -> u64 {
    u64::from(params.window_width) * 4 * u64::from(film_floats(aovs) * layout::TILE)
}

/// Bytes of a film of the whole window, or of as many rows of tiles as the device can bind.
pub(super) fn film_bytes(max_range: u64, params: &layout::Params, aovs: bool) -> u64 {
    let row = row_bytes(params, aovs);
    (max_range / row).clamp(1, u64::from(params.tiles_y)) * row
}

/// The counters of the kernels: rays traced, and what may have changed the expected value.
pub(super) fn read_ledger(words: &[u32]) -> (u64, Ledger) {
    let word = |at: u32| u64::from(words[at as usize]);
    let pair = |low: u32| word(low) | word(low + 1) << 32;
    let ledger = Ledger {
        non_finite: word(layout::LEDGER_NON_FINITE),
        truncated_paths: word(layout::LEDGER_TRUNCATED),
        truncated_throughput: pair(layout::LEDGER_THROUGHPUT_LOW) as f64 / 65_536.0,
        interior_overflows: word(layout::LEDGER_INTERIOR_OVERFLOWS),
    };
    (pair(layout::LEDGER_RAYS_LOW), ledger)
}
