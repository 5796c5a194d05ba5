//! `--noise`: how many samples a picture or a reading needs, told by samples that are no part of it. A render that
//! stopped when its own error looked small enough would favour those that happen to lack rare bright samples.

use etendue::Result;

/// Samples of the first nets: counts are multiples of it.
const BLOCK: u64 = 16;
/// Below two nets the samples of one count as independent, and errors as up to three times too large.
const LEAST: u64 = 2 * BLOCK;
/// A pilot ends when its error is at most this many times the limit: it then has about a ninth of the samples …
const ENOUGH: f64 = 3.0;
/// … or a ninth of the most that may be rendered, or of the time for all.
pub const MOST: u64 = 9;
/// The error to aim at, as a share of the limit: the pilot's error is known to a few percent.
const AIM: f64 = 0.92;

/// How many of `total` samples give a relative standard error of `limit`. `error_of` extends the pilot to so many
/// samples and returns its relative error, or `None` where it was stopped: then there is no plan.
pub fn plan(
    limit: f64,
    total: u64,
    mut error_of: impl FnMut(u64) -> Result<Option<f64>>,
) -> Result<Option<u64>> {
    if total <= LEAST {
        return Ok(Some(total));
    }
    let most = (total / MOST).max(LEAST);
    let mut samples = LEAST;
    loop {
        let Some(error) = error_of(samples)? else {
            return Ok(None);
        };
        let next = (samples + samples / 2).next_multiple_of(BLOCK);
        if error <= ENOUGH * limit || next > most {
            let needed = samples as f64 * (error / (AIM * limit)).powi(2);
            // (a number that is too large becomes the largest)
            let blocks = (needed / BLOCK as f64).ceil() as u64;
            return Ok(Some(blocks.saturating_mul(BLOCK).max(LEAST).min(total)));
        }
        samples = next;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_many_as_the_law_of_the_root_says() {
        // one sample has an error of 1
        let error = |samples: u64| Ok(Some(1.0 / (samples as f64).sqrt()));
        for (limit, needed) in [(0.01, 11_824), (0.1, 128), (1.0, 32)] {
            assert_eq!(plan(limit, 1 << 40, error).unwrap(), Some(needed));
        }
        assert_eq!(plan(0.01, 100, error).unwrap(), Some(100));
        assert_eq!(plan(0.01, 100, |_| Ok(Some(0.0))).unwrap(), Some(32));
        assert_eq!(plan(0.01, 100, |_| Ok(None)).unwrap(), None);
    }

    #[test]
    fn pilots_are_a_ninth() {
        let mut last = 0;
        let needed = plan(0.01, 1 << 40, |samples| {
            last = samples;
            Ok(Some(1.0 / (samples as f64).sqrt()))
        });
        let share = last as f64 / needed.unwrap().unwrap() as f64;
        assert!((0.1..0.17).contains(&share), "{share}");
    }
}
