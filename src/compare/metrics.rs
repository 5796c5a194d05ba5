//! How far apart two images are, noise included. The second one is the reference.

use super::side::Side;

/// Part of the reference's mean that keeps relative errors finite where it is dark.
const EPSILON: f64 = 0.01;

/// Distances of A from B over all finite pixels and channels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Metrics {
    /// Root mean square of A − B, in the images' unit.
    pub rmse: f64,
    /// Mean of (A − B)²/(B² + ε²).
    pub relmse: f64,
    /// Mean of |A − B|/(|B| + ε).
    pub mape: f64,
    /// ε of both: a hundredth of the mean of |B|, in the images' unit.
    pub epsilon: f64,
    /// (ΣA − ΣB)/ΣB of each channel.
    pub bias: [f64; 3],
    /// 20 log₁₀ (largest B / RMSE), decibels.
    pub psnr: f64,
    /// Largest |A − B|.
    pub largest: f64,
}

impl Metrics {
    /// Of the given pixels.
    pub fn of(a: &Side, b: &Side, pixels: &[usize]) -> Self {
        let n = (3 * pixels.len()).max(1) as f64;
        let each = |f: &dyn Fn(f64, f64) -> f64| -> f64 {
            let channel = |c: usize| pixels.iter().map(move |&i| f(a.mean[c][i], b.mean[c][i]));
            (0..3).flat_map(channel).sum()
        };
        let epsilon = EPSILON * each(&|_, b| b.abs()) / n;
        // 0 of two black pixels of a black reference.
        let over = |x: f64, y: f64| if x == 0.0 { 0.0 } else { x / y };
        let rmse = (each(&|a, b| (a - b).powi(2)) / n).sqrt();
        let most = |f: &dyn Fn(f64, f64) -> f64| {
            let channel = |c: usize| pixels.iter().map(move |&i| f(a.mean[c][i], b.mean[c][i]));
            (0..3).flat_map(channel).fold(0.0, f64::max)
        };
        Self {
            rmse,
            relmse: each(&|a, b| over((a - b).powi(2), b * b + epsilon * epsilon)) / n,
            mape: each(&|a, b| over((a - b).abs(), b.abs() + epsilon)) / n,
            epsilon,
            bias: [0, 1, 2].map(|c| {
                let sum = |s: &Side| pixels.iter().map(|&i| s.mean[c][i]).sum::<f64>();
                over(sum(a) - sum(b), sum(b))
            }),
            psnr: 20.0 * (most(&|_, b| b) / rmse).log10(),
            largest: most(&|a, b| (a - b).abs()),
        }
    }
}
