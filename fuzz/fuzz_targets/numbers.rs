//! What can be typed where numbers are expected; what is accepted keeps its promise.
#![no_main]

#[path = "../../src/cli/numbers.rs"]
mod numbers;

use etendue::film::MAX_SAMPLES;
use numbers::{counts, crop, finite, level, not_negative, numbers, positive, samples};

libfuzzer_sys::fuzz_target!(|text: &str| {
    assert!(positive(text).map_or(true, |x| x.is_finite() && x > 0.0));
    assert!(not_negative(text).map_or(true, |x| x.is_finite() && x >= 0.0));
    assert!(finite(text).map_or(true, |x| (x as f32).is_finite()));
    assert!(level(text).map_or(true, |x| x > 0.0 && x < 1.0));
    assert!(numbers::<3>(text).map_or(true, |all| all.iter().all(|x| x.is_finite())));
    assert!(numbers::<6>(text).map_or(true, |all| all.iter().all(|x| x.is_finite())));
    assert!(counts(text).map_or(true, |all| all.iter().all(|&n| n >= 1.0)));
    assert!(samples(text).map_or(true, |range| range.start < range.end
        && range.end <= MAX_SAMPLES));
    assert!(crop(text).map_or(true, |c| c.x0 < c.x1 && c.y0 < c.y1));
});
