//! Whether a standard error that was estimated from samples can be believed.

/// The part of the samples that counts as the tail: 1 of so many.
const TAIL: usize = 1000;

/// Largest part of Σx² that the tail may hold.
const MAX_SHARE: f64 = 0.5;

/// The variance is finite where the tail index is above 2 ...
const FINITE_VARIANCE: f64 = 2.0;

/// ... and the estimated index must be so by this many of its standard errors.
const MARGIN: f64 = 3.0;

/// The largest samples of a set, by magnitude.
///
/// The usual confidence interval needs a finite variance, and no set of samples
/// shows an infinite one directly: its sample variance is finite, only too small,
/// because the values that would make it large have not come up yet. What can be
/// seen is how the largest 0.1 % behave. Two signs, either of which is enough:
///
/// - they carry more than half of Σx², so a few samples decide what σ seems to be;
/// - their tail index is not clearly above 2. With P(|x| > t) ∝ t^(−α), moments of
///   order α and above are infinite.
///
/// Only the second moment matters. A tail with 2 < α < 4 makes σ imprecise, not
/// meaningless, and is not flagged: with α = 3 the index of 2²⁰ samples comes out as
/// 3.0 ± 0.09, and 2.2 is where the flag starts. With fewer samples the index is
/// known less well and more is flagged: 2²⁰ are enough to tell 3 from 2, 50 000 clear an
/// exponential tail, and below 10⁴ nothing passes but samples whose largest are equal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tail {
    /// How many samples are in the tail.
    pub count: usize,
    /// Their part of Σx².
    pub share: f64,
    /// Hill's estimate of the tail index α [Hill75]; infinite where all samples in the
    /// tail are equal to the next, 0 where those outside the tail are all 0.
    pub index: f64,
}

impl Tail {
    /// The tail of at least two samples.
    pub fn of(samples: &[f32]) -> Self {
        let mut sizes: Vec<f64> = samples.iter().map(|&x| f64::from(x).abs()).collect();
        let count = samples.len().div_ceil(TAIL);
        assert!(count < samples.len(), "a tail needs something to hang on");
        // `border` is the largest sample outside the tail. NaN sorts above infinity.
        let (tail, &mut border, body) =
            sizes.select_nth_unstable_by(count, |a, b| f64::total_cmp(b, a));
        let squares = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>();
        let total = squares(tail) + border * border + squares(body);
        let excess: f64 = tail.iter().map(|x| (x / border).ln()).sum();
        Self {
            count,
            // All samples 0: nothing is in the tail either.
            share: if total == 0.0 {
                0.0
            } else {
                squares(tail) / total
            },
            index: match border {
                _ if total == 0.0 => f64::INFINITY,
                0.0 => 0.0,
                _ => count as f64 / excess,
            },
        }
    }

    /// Whether σ is not trustworthy: neither a confidence interval nor a verdict may
    /// be based on it. Samples that are not finite count as heavy.
    pub fn is_heavy(&self) -> bool {
        let error = self.index / (self.count as f64).sqrt();
        // Written so that NaN is heavy; ∞ − ∞ must not be.
        let is_clear = self.index == f64::INFINITY || self.index - MARGIN * error > FINITE_VARIANCE;
        !(self.share <= MAX_SHARE && is_clear)
    }
}
