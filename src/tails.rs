//! Tails of the distributions that tests of chance need, and families of tests.

use std::f64::consts::PI;

/// Chance that Student's t with `degrees` of freedom, which need not be whole, is further from 0 than `t`.
pub fn student(t: f64, degrees: f64) -> f64 {
    if t.is_infinite() {
        return 0.0;
    }
    // P(|T| > t) = I_x(ν/2, 1/2) with x = ν/(ν + t²) [Press07] Eq. 6.14.11.
    let square = t * t;
    beta(
        0.5 * degrees,
        0.5,
        degrees / (degrees + square),
        square / (degrees + square),
    )
}

/// Chance that a normal variable is further from its mean than `z` standard deviations.
pub fn normal(z: f64) -> f64 {
    // Student's t beyond 10¹² degrees of freedom.
    student(z, 1e12)
}

/// The t that Student's t with `degrees` of freedom exceeds in magnitude with the chance `p`.
pub fn student_quantile(p: f64, degrees: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    while student(high, degrees) > p && high < 1e150 {
        high *= 2.0;
    }
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        match student(middle, degrees) > p {
            true => low = middle,
            false => high = middle,
        }
    }
    high
}

/// Chance that the least of `count` independent p-values is at most `p` when nothing is wrong (Šidák). The
/// bound also holds where the tests are positively dependent.
pub fn least_of(p: f64, count: usize) -> f64 {
    -(count as f64 * (-p.min(1.0)).ln_1p()).exp_m1()
}

/// Level of each of `count` tests that are to have the false-alarm rate `alpha` together: the inverse of [`least_of`].
pub fn share_of(alpha: f64, count: usize) -> f64 {
    -((-alpha).ln_1p() / count as f64).exp_m1()
}

/// The regularised incomplete beta function I_x(a, b); `y` = 1 − x, which the caller knows without cancellation.
fn beta(a: f64, b: f64, x: f64, y: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    if y <= 0.0 {
        return 1.0;
    }
    // ln x from y, where x is near 1 and a is huge.
    let ln = |x: f64, y: f64| if y < 0.5 { (-y).ln_1p() } else { x.ln() };
    let scale = a * ln(x, y) + b * ln(y, x) - ln_beta(a, b);
    if x < (a + 1.0) / (a + b + 2.0) {
        scale.exp() * fraction(a, b, x) / a
    } else {
        1.0 - scale.exp() * fraction(b, a, y) / b
    }
}

/// The continued fraction of the incomplete beta function by Lentz's method \[Press07\] §6.4.
fn fraction(a: f64, b: f64, x: f64) -> f64 {
    let guard = |v: f64| if v.abs() < 1e-300 { 1e-300 } else { v };
    let mut c = 1.0;
    let mut d = 1.0 / guard(1.0 - (a + b) * x / (a + 1.0));
    let mut h = d;
    for m in 1..20_000 {
        let m = f64::from(m);
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        let mut change = 1.0;
        for term in [even, odd] {
            d = 1.0 / guard(1.0 + term * d);
            c = guard(1.0 + term / c);
            change = c * d;
            h *= change;
        }
        if (change - 1.0).abs() < 1e-15 {
            break;
        }
    }
    h
}

/// ln B(a, b) for b = 1/2 or a = 1/2, one of which may be huge.
fn ln_beta(a: f64, b: f64) -> f64 {
    let (small, large) = if a < b { (a, b) } else { (b, a) };
    // ln Γ(large) − ln Γ(large + small) loses all digits for a large argument; its series does not.
    let ratio = if large > 1e5 {
        -small * large.ln() - small * (small - 1.0) / (2.0 * large)
    } else {
        ln_gamma(large) - ln_gamma(large + small)
    };
    ln_gamma(small) + ratio
}

/// ln Γ(x) for x > 0: Stirling's series after shifting x above 10 (error below 1e-13).
pub fn ln_gamma(mut x: f64) -> f64 {
    let mut shift = 0.0;
    while x < 10.0 {
        shift -= x.ln();
        x += 1.0;
    }
    let y = 1.0 / (x * x);
    let series = (1.0 / 12.0 - y * (1.0 / 360.0 - y * (1.0 / 1260.0 - y / 1680.0))) / x;
    shift + (x - 0.5) * x.ln() - x + 0.5 * (2.0 * PI).ln() + series
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tails_are_those_of_tables() {
        // Two-sided quantiles of Student's t from tables, three or four decimals, and of the normal law.
        for (t, degrees, p) in [
            (12.706, 1.0, 0.05),
            (4.303, 2.0, 0.05),
            (2.228, 10.0, 0.05),
            (4.587, 10.0, 0.001),
            (3.390_5, 100.0, 0.001),
        ] {
            assert!(
                (student(t, degrees) / p - 1.0).abs() < 1e-3,
                "{t} {degrees}"
            );
            assert!((student_quantile(p, degrees) / t - 1.0).abs() < 1e-3);
        }
        for (z, p) in [(1.959_964, 0.05), (4.891_638, 1e-6), (6.109_410, 1e-9)] {
            assert!((normal(z) / p - 1.0).abs() < 1e-4, "{z}: {}", normal(z));
        }
        // Cauchy's law and two degrees have closed forms.
        for t in [1e-3, 0.7, 30.0, 1e6] {
            let cauchy = 1.0 - 2.0 / PI * f64::atan(t);
            let two = 1.0 - t / (2.0 + t * t).sqrt();
            assert!((student(t, 1.0) - cauchy).abs() < 1e-12);
            assert!((student(t, 2.0) - two).abs() < 1e-12);
        }
        assert_eq!((student(0.0, 5.0), student(f64::INFINITY, 5.0)), (1.0, 0.0));
    }

    #[test]
    fn families_share_a_level() {
        for count in [1, 3, 100_000] {
            let p = share_of(1e-3, count);
            assert!((least_of(p, count) / 1e-3 - 1.0).abs() < 1e-9);
        }
        assert_eq!((least_of(0.0, 9), least_of(1.0, 9)), (0.0, 1.0));
    }
}
