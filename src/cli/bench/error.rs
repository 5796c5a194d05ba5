//! How far pictures are from a reference.

/// Pixels row by row, cd/m² per channel.
pub type Picture = Vec<[f32; 3]>;

/// ε of relMSE as a share of the square of the reference's mean: what is a tenth as bright
/// as the picture and darker counts by its absolute error.
const EPSILON: f64 = 0.01;
/// Share of the pixels that the trimmed error leaves out, the worst.
const TRIMMED: f64 = 0.001;

/// A pixel of more than so many times the picture's mean has less weight where means are compared.
const BRIGHT: f64 = 4.0;

/// Two independent halves of a converged picture.
pub struct Reference {
    /// The halves.
    pub halves: [Picture; 2],
    /// Their mean, by channel values in a row.
    mean: Vec<f64>,
    /// ε of relMSE.
    pub epsilon: f64,
}

/// Errors of one picture.
pub struct Errors {
    pub rmse: f64,
    pub relmse: f64,
    pub relmse_trimmed: f64,
}

/// Bias and variance of several pictures, relative as relMSE.
pub struct Together {
    pub bias2: f64,
    pub bias2_error: f64,
    pub variance: f64,
}

/// Mean of each channel.
pub fn mean(picture: &[[f32; 3]]) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for pixel in picture {
        for (sum, value) in sum.iter_mut().zip(pixel) {
            *sum += f64::from(*value);
        }
    }
    sum.map(|s| s / picture.len() as f64)
}

impl Reference {
    pub fn new(halves: [Picture; 2]) -> Self {
        let [a, b] = &halves;
        let values = a.as_flattened().iter().zip(b.as_flattened());
        let mean: Vec<f64> = values
            .map(|(a, b)| 0.5 * (f64::from(*a) + f64::from(*b)))
            .collect();
        let whole = mean.iter().sum::<f64>() / mean.len() as f64;
        // a black reference needs something above zero to divide by
        let epsilon = (EPSILON * whole * whole).max(f64::MIN_POSITIVE);
        Self {
            halves,
            mean,
            epsilon,
        }
    }

    /// Mean of each channel for the comparison of means: a pixel whose reference is brighter than `BRIGHT` times the
    /// mean counts as if it was that bright, so that the edge of a small lamp does not drown the rest in noise.
    pub fn weighted_mean(&self, picture: &[[f32; 3]]) -> [f64; 3] {
        let whole = self.mean.iter().sum::<f64>() / self.mean.len() as f64;
        let (mut sum, mut weights) = ([0.0; 3], 0.0);
        for (pixel, reference) in picture.iter().zip(self.mean.chunks_exact(3)) {
            let bright = reference.iter().sum::<f64>() / 3.0;
            let weight = (BRIGHT * whole / bright).min(1.0);
            for (sum, value) in sum.iter_mut().zip(pixel) {
                *sum += weight * f64::from(*value);
            }
            weights += weight;
        }
        sum.map(|s| s / weights)
    }

    /// Mean of each channel.
    pub fn mean(&self) -> [f64; 3] {
        let [a, b] = [mean(&self.halves[0]), mean(&self.halves[1])];
        std::array::from_fn(|i| 0.5 * (a[i] + b[i]))
    }

    /// r² + ε of a channel value.
    fn scale(&self, index: usize) -> f64 {
        self.mean[index] * self.mean[index] + self.epsilon
    }

    /// How far a picture is from the reference.
    pub fn errors(&self, picture: &[[f32; 3]]) -> Errors {
        let values = picture.as_flattened();
        assert_eq!(values.len(), self.mean.len(), "pictures of one size");
        let square = |i: usize| (f64::from(values[i]) - self.mean[i]).powi(2);
        let count = values.len() as f64;
        let mse = (0..values.len()).map(square).sum::<f64>() / count;
        let pixel = |p: usize| {
            (3 * p..3 * p + 3)
                .map(|i| square(i) / self.scale(i))
                .sum::<f64>()
        };
        let mut relative: Vec<f64> = (0..picture.len()).map(pixel).collect();
        let relmse = relative.iter().sum::<f64>() / count;
        relative.sort_by(f64::total_cmp);
        let kept = relative.len() - (TRIMMED * relative.len() as f64).ceil() as usize;
        let trimmed = relative[..kept].iter().sum::<f64>() / (3 * kept.max(1)) as f64;
        Errors {
            rmse: mse.sqrt(),
            relmse,
            relmse_trimmed: trimmed,
        }
    }

    /// Bias and variance from at least two independent pictures: the product of the deviations of two pictures from
    /// two references, all independent, has the square of the bias as its expected value. All pairs are used.
    pub fn together(&self, pictures: &[Picture]) -> Together {
        let n = pictures.len() as f64;
        let [first, second] = [0, 1].map(|half| self.halves[half].as_flattened());
        let (mut sum, mut squares, mut variance) = (0.0, 0.0, 0.0);
        for i in 0..self.mean.len() {
            let (r, s) = (f64::from(first[i]), f64::from(second[i]));
            let (mut from_r, mut from_s, mut own, mut spread) = (0.0, 0.0, 0.0, 0.0);
            for picture in pictures {
                let x = f64::from(picture.as_flattened()[i]);
                from_r += x - r;
                from_s += x - s;
                own += (x - r) * (x - s);
                spread += (x - r) * (x - r);
            }
            let scale = self.scale(i);
            let cross = (from_r * from_s - own) / (n * (n - 1.0)) / scale;
            sum += cross;
            squares += cross * cross;
            variance += (spread - from_r * from_r / n) / (n - 1.0) / scale;
        }
        let count = self.mean.len() as f64;
        let bias2 = sum / count;
        // the channels of a pixel go together: count pixels, not values
        let scatter = (squares / count - bias2 * bias2).max(0.0);
        Together {
            bias2,
            bias2_error: (scatter / (count / 3.0)).sqrt(),
            variance: variance / count,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture around `level` whose values scatter by ± 0.1, evenly.
    fn noisy(level: f32, seed: u32) -> Picture {
        let mut state = seed.wrapping_mul(0x9E37_79B9);
        let mut next = || {
            state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
            level + 0.2 * ((word >> 8) as f32 / (1 << 24) as f32 - 0.5)
        };
        (0..10_000).map(|_| [next(), next(), next()]).collect()
    }

    #[test]
    fn errors_of_a_known_deviation() {
        let reference = Reference::new([vec![[2.0; 3]; 1000], vec![[2.0; 3]; 1000]]);
        let mut picture = vec![[2.5; 3]; 1000];
        let errors = reference.errors(&picture);
        assert!((errors.rmse - 0.5).abs() < 1e-12);
        assert!((errors.relmse - 0.25 / 4.04).abs() < 1e-12);
        picture[7] = [1e6; 3];
        let with_speck = reference.errors(&picture);
        assert!(with_speck.relmse > 1e6);
        assert!((with_speck.relmse_trimmed - errors.relmse).abs() < 1e-12);
    }

    #[test]
    fn bright_pixels_do_not_rule_the_comparison_of_means() {
        let mut halves = [vec![[1.0; 3]; 1000], vec![[1.0; 3]; 1000]];
        for half in &mut halves {
            half[5] = [1e4; 3];
        }
        let reference = Reference::new(halves);
        // the mean is 10.999: 40 times as much at most
        let mut picture = vec![[1.1; 3]; 1000];
        picture[5] = [1.2e4; 3];
        let ratio =
            reference.weighted_mean(&picture)[0] / reference.weighted_mean(&reference.halves[0])[0];
        let share = 4.0 * 10.999;
        let wanted = (999.0 * 1.1 + 1.2 * share) / (999.0 + share);
        assert!((ratio - wanted).abs() < 1e-6, "{ratio} {wanted}");
    }

    /// Noise of variance 0.04/12 is not taken for bias, and a bias of 0.05 is found below it.
    #[test]
    fn bias_and_noise_come_apart() {
        let reference = Reference::new([noisy(1.0, 1), noisy(1.0, 2)]);
        for bias in [0.0, 0.05] {
            let pictures: Vec<Picture> = (3..8).map(|s| noisy(1.0 + bias, s)).collect();
            let together = reference.together(&pictures);
            let scale = 1.01;
            let truth = f64::from(bias * bias) / scale;
            // the halves of the reference put noise of their own into r² + ε: 0.5 % at most
            let allowed = 4.9 * together.bias2_error + 0.005 * truth;
            let off = (together.bias2 - truth).abs();
            assert!(off < allowed, "{off} {allowed}");
            assert!(together.bias2_error < 2e-4, "{}", together.bias2_error);
            let variance = 0.04 / 12.0 / scale;
            assert!((together.variance / variance - 1.0).abs() < 0.03);
        }
    }
}
