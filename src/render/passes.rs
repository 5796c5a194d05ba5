//! Cuts a range of samples into aligned powers of two, the nodes of the film's
//! tree: few paths first, so that something is there soon, then doubling as
//! long as a pass stays short. The cut does not change the bits of the result.

use std::collections::VecDeque;
use std::ops::Range;

/// log₂ of the most samples of a pass: what one invocation sums (FILM_LEVELS in film.glsl).
pub(crate) const MAX_PASS_LEVEL: u32 = 8;

/// A first pass has at most so many paths, or one sample: less than a second even of a slow device.
const FIRST_PATHS: u64 = 1 << 16;

/// The passes that are left.
pub(crate) struct Passes {
    /// What is left, in order.
    ranges: VecDeque<Range<u64>>,
    done: u64,
    first: u32,
    current: u32,
    limit: u32,
}

impl Passes {
    /// All of some disjoint ranges of samples of a picture of so many pixels, at most `max_pass` at a time.
    pub fn new(ranges: impl IntoIterator<Item = Range<u64>>, pixels: u64, max_pass: u64) -> Self {
        Self {
            first: (FIRST_PATHS / pixels.max(1)).max(1).ilog2(),
            ranges: ranges.into_iter().filter(|r| !r.is_empty()).collect(),
            done: 0,
            current: 0,
            limit: max_pass.max(1).ilog2().min(MAX_PASS_LEVEL),
        }
    }

    /// First sample and log₂ of the number of samples of the next pass.
    pub fn upcoming(&mut self) -> Option<(u64, u32)> {
        let Range { start, end } = *self.ranges.front()?;
        // A pass starts at a multiple of its size, ends inside the range and is
        // not larger than what is done already, or than the first.
        let aligned = start.trailing_zeros();
        let inside = (end - start).ilog2();
        let ramp = (self.done + 1).ilog2().max(self.first);
        self.current = aligned.min(inside).min(ramp).min(self.limit);
        Some((start, self.current))
    }

    /// Notes that the pass is complete and took `seconds`; keeps the next ones below `target` seconds.
    pub fn finish(&mut self, seconds: f64, target: f64) {
        self.done += 1 << self.current;
        if let Some(range) = self.ranges.front_mut() {
            range.start += 1 << self.current;
            if range.is_empty() {
                self.ranges.pop_front();
            }
        }
        if 2.0 * seconds > target {
            self.limit = self.limit.min(self.current);
        }
    }

    /// Samples of complete passes.
    pub fn done(&self) -> u64 {
        self.done
    }
}

#[cfg(test)]
mod tests {
    use std::iter;

    use super::*;

    #[test]
    fn passes_tile_the_range_with_aligned_powers_of_two() {
        for (range, max) in [
            (0..128, 256),
            (3..77, 256),
            (5..6, 4),
            (0..1000, 1),
            (7..4096, 64),
        ] {
            let mut passes = Passes::new([range.clone()], 1 << 20, max);
            let mut at = range.start;
            while let Some((first, level)) = passes.upcoming() {
                assert_eq!(first, at);
                assert_eq!(first % (1 << level), 0);
                assert!(1 << level <= max);
                at += 1 << level;
                passes.finish(0.0, 1.0);
            }
            assert_eq!(at, range.end);
        }
    }

    #[test]
    fn passes_skip_what_lies_between_ranges() {
        let mut passes = Passes::new([3..6, 9..9, 12..13], 1 << 20, 256);
        let mut samples = Vec::new();
        while let Some((first, level)) = passes.upcoming() {
            samples.extend(first..first + (1 << level));
            passes.finish(0.0, 1.0);
        }
        assert_eq!(samples, [3, 4, 5, 12]);
        assert_eq!(passes.done(), 4);
    }

    #[test]
    fn small_pictures_begin_with_more_samples() {
        for (pixels, level) in [(1, 8), (64 * 64, 4), (1 << 16, 0), (1 << 30, 0)] {
            let mut passes = Passes::new(iter::once(0..256), pixels, 256);
            assert_eq!(passes.upcoming(), Some((0, level)));
        }
    }

    #[test]
    fn slow_passes_do_not_grow() {
        let mut passes = Passes::new(iter::once(0..64), 1 << 20, 256);
        let mut longest = 0;
        while let Some((_, level)) = passes.upcoming() {
            longest = longest.max(level);
            passes.finish(0.3 * f64::from(1 << level), 1.0);
        }
        assert_eq!(longest, 1);
    }
}
