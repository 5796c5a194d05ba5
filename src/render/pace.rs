//! Whether the lanes of a subgroup start their samples together, or each as soon
//! as its path has ended. Both give the same bits. Starting at once keeps lanes busy where
//! paths are of unequal length, as in closed rooms; waiting keeps camera rays coherent,
//! as under an open sky. The first batches try both, and the faster one stays.

/// The batches that are timed, true where lanes start together: what changes evenly from batch to batch cancels.
const TRIALS: [bool; 4] = [false, true, true, false];
/// A batch of fewer samples a lane says nothing: its paths end at much the same time.
const MIN_SAMPLES: u32 = 16;

/// Rays and seconds of one kind.
#[derive(Clone, Copy, Default)]
struct Rate {
    rays: f64,
    seconds: f64,
}

/// What has been measured: at once, together.
#[derive(Clone, Copy, Default)]
pub(super) struct Pace {
    rates: [Rate; 2],
    trials: usize,
}

impl Pace {
    /// Whether a batch of `samples` a pixel is a trial, to be told to [`Pace::note`].
    pub fn is_trial(&self, samples: u32) -> bool {
        samples >= MIN_SAMPLES && self.trials < TRIALS.len()
    }

    /// The most tiles of a trial out of those of a pass: all trials fit into one pass.
    pub fn trial_tiles(tiles: u32) -> u32 {
        tiles.div_ceil(TRIALS.len() as u32)
    }

    /// Whether the lanes of the next batch start together.
    pub fn is_together(&self) -> bool {
        let [at_once, together] = self.rates;
        // Rays rather than samples: the trials are different parts of the picture.
        let is_faster = together.rays * at_once.seconds > at_once.rays * together.seconds;
        TRIALS.get(self.trials).copied().unwrap_or(is_faster)
    }

    /// Notes how long a trial took.
    pub fn note(&mut self, is_together: bool, rays: u64, seconds: f64) {
        let rate = &mut self.rates[usize::from(is_together)];
        rate.rays += rays as f64;
        rate.seconds += seconds;
        self.trials += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_faster_kind_stays() {
        for (at_once, together) in [(2.0, 1.0), (1.0, 2.0)] {
            let mut pace = Pace::default();
            assert!(!pace.is_trial(MIN_SAMPLES - 1));
            while pace.is_trial(MIN_SAMPLES) {
                let kind = pace.is_together();
                let rate = if kind { together } else { at_once };
                pace.note(kind, 1000, 1000.0 / rate);
            }
            assert_eq!(pace.trials, TRIALS.len());
            assert_eq!(pace.is_together(), together > at_once);
        }
    }
}
