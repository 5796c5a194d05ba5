//! Numbers, ranges and windows as they are typed. Nothing but text goes in, so `fuzz/` can ask as well.

use std::ops::Range;

use etendue::film::MAX_SAMPLES;
use etendue::settings::Crop;

/// Exactly N finite numbers between commas.
pub fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let parse = |part: &str| {
        let number: f64 = part
            .trim()
            .parse()
            .map_err(|_| format!("{part:?} is not a number"))?;
        if number.is_finite() {
            Ok(number)
        } else {
            Err(format!("{part} is not finite"))
        }
    };
    let all: Vec<f64> = text.split(',').map(parse).collect::<Result<_, _>>()?;
    let count = all.len();
    all.try_into()
        .map_err(|_| format!("{count} numbers, not {N}"))
}

/// A finite number above 0.
pub fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err(String::from("must be a number above 0")),
    }
}

/// A finite number from 0 on.
pub fn not_negative(text: &str) -> Result<f64, String> {
    finite(text)
        .ok()
        .filter(|&value| value >= 0.0)
        .ok_or_else(|| String::from("must be a number of at least 0"))
}

/// A number that is finite as a float too.
pub fn finite(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        // what is computed with is a float
        Ok(value) if (value as f32).is_finite() => Ok(value),
        _ => Err(String::from("must be a number")),
    }
}

/// `A..B`, not empty.
pub fn samples(text: &str) -> Result<Range<u64>, String> {
    let range = text
        .split_once("..")
        .and_then(|(a, b)| Some(a.parse().ok()?..b.parse().ok()?));
    match range {
        Some(range) if range.start < range.end && range.end <= MAX_SAMPLES => Ok(range),
        Some(_) => Err(format!("A must be below B, and B at most {MAX_SAMPLES}")),
        None => Err(String::from("must be two sample indices, e.g. 0..64")),
    }
}

/// `X0,Y0,X1,Y1`, not empty.
pub fn crop(text: &str) -> Result<Crop, String> {
    let numbers: Result<Vec<u32>, _> = text.split(',').map(|n| n.trim().parse()).collect();
    match numbers.as_deref() {
        Ok(&[x0, y0, x1, y1]) if x0 < x1 && y0 < y1 => Ok(Crop { x0, y0, x1, y1 }),
        Ok([_, _, _, _]) => Err(String::from("X0 must be below X1 and Y0 below Y1")),
        _ => Err(String::from(
            "must be four pixel coordinates, e.g. 0,0,64,64",
        )),
    }
}

/// A number between 0 and 1, neither of them.
pub fn level(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value < 1.0 => Ok(value),
        _ => Err(String::from("must be a number between 0 and 1")),
    }
}

/// Numbers of samples of two images: one for both, or two.
pub fn counts(text: &str) -> Result<[f64; 2], String> {
    let numbers: Result<Vec<u64>, _> = text.split(',').map(|n| n.trim().parse()).collect();
    match numbers.as_deref() {
        Ok(&[n]) if n > 0 => Ok([n as f64; 2]),
        Ok(&[n, m]) if n > 0 && m > 0 => Ok([n as f64, m as f64]),
        _ => Err(String::from(
            "must be one number of samples above 0, or two, e.g. 64,4096",
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_half_open_and_not_empty() {
        assert_eq!(samples("3..77"), Ok(3..77));
        for bad in [
            "",
            "5",
            "5..5",
            "6..5",
            "-1..5",
            "..5",
            "0..1e3",
            "0..9999999999999999999",
        ] {
            assert!(samples(bad).is_err(), "{bad}");
        }
        assert!(crop("1,2,3,4").is_ok());
        for bad in ["1,2,3", "1,2,1,4", "1,4,3,2", "-1,0,1,1", "1,2,3,4,5"] {
            assert!(crop(bad).is_err(), "{bad}");
        }
    }
}
