//! The film gives the same bits however a render was split, and its moments are right.
#![allow(clippy::unwrap_used, reason = "a step that fails fails the test")]
#![allow(
    clippy::single_range_in_vec_init,
    reason = "the ranges of a film are a list of ranges"
)]

mod allotment;

use std::ops::Range;

use etendue::Error;
use etendue::film::{Film, dyadic_pieces};
use etendue::settings::Crop;

const WINDOW: Crop = Crop {
    x0: 3,
    y0: 1,
    x1: 6,
    y1: 3,
};
const PIXELS: usize = 6;

/// splitmix64: enough for test data, and the same on every machine.
fn hash(mut x: u64) -> u64 {
    x = x.wrapping_add(0x9E37_79B9_7F4A_7C15);
    x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    x ^ (x >> 31)
}

/// Values of very different size, so that every change of order shows.
fn radiance(sample: u64, float: u64) -> f32 {
    let h = hash(sample * 1000 + float);
    let unit = (h >> 40) as f32 / (1 << 24) as f32;
    unit * 2.0_f32.powi((h & 15) as i32 - 8)
}

fn film(aovs: bool) -> Film {
    Film::new(WINDOW, (8, 4), aovs)
}

/// The leaf of one sample: its radiance, no deviation, its AOVs.
fn leaf(sample: u64, aovs: bool) -> Vec<f32> {
    let stride = if aovs { 18 } else { 9 };
    (0..PIXELS * stride)
        .map(|i| match i % stride {
            3..9 => 0.0,
            // a third of the samples miss: no depth, no coverage
            15 | 16 if sample % 3 == 0 => 0.0,
            16 => 1.0,
            // of each pixel another share is dropped
            17 => u8::from(hash(sample) % (2 + (i / stride) as u64) == 0).into(),
            _ => radiance(sample, i as u64),
        })
        .collect()
}

fn sequential(samples: Range<u64>, aovs: bool) -> Film {
    let mut film = film(aovs);
    for sample in samples {
        film.add(sample, 0, leaf(sample, aovs)).unwrap();
    }
    film
}

/// A node as a renderer returns it: built sample by sample in a film of its own.
fn node(first: u64, level: u32, aovs: bool) -> Vec<f32> {
    let own = sequential(first..first + (1 << level), aovs);
    let nodes: Vec<_> = own.nodes().collect();
    assert_eq!(nodes.len(), 1, "an aligned range is one node");
    assert_eq!((nodes[0].0, nodes[0].1), (first, level));
    nodes[0].2.to_vec()
}

/// Everything that leaves a film, as bits.
fn bits(film: &Film) -> Vec<u32> {
    let mut all: Vec<f32> = film.nodes().flat_map(|n| n.2.to_vec()).collect();
    all.extend(film.mean().as_flattened());
    all.extend(film.standard_error().as_flattened());
    for vectors in [film.albedo(), film.normal()].into_iter().flatten() {
        all.extend(vectors.as_flattened());
    }
    for values in [film.depth(), film.coverage(), film.dropped()]
        .into_iter()
        .flatten()
    {
        all.extend(values);
    }
    all.into_iter().map(f32::to_bits).collect()
}

/// Splits a range into aligned pieces, some of them further than needed, in random order.
fn random_pieces(samples: Range<u64>, seed: u64) -> Vec<(u64, u32)> {
    let mut pieces = Vec::new();
    let mut open = dyadic_pieces(samples);
    while let Some((first, level)) = open.pop() {
        if level > 0 && hash(seed ^ hash(first * 64 + u64::from(level))) % 3 != 0 {
            let half = 1 << (level - 1);
            open.extend([(first, level - 1), (first + half, level - 1)]);
        } else {
            pieces.push((first, level));
        }
    }
    pieces.sort_by_key(|&(first, _)| hash(seed.wrapping_add(first)));
    pieces
}

#[test]
fn any_split_in_any_order_gives_the_same_bits() {
    for aovs in [false, true] {
        for samples in [0..100, 3..77, 64..128, 5..6] {
            let expected = bits(&sequential(samples.clone(), aovs));
            for seed in 0..20 {
                let mut film = film(aovs);
                for (first, level) in random_pieces(samples.clone(), seed) {
                    film.add(first, level, node(first, level, aovs)).unwrap();
                }
                assert_eq!(film.ranges(), std::slice::from_ref(&samples));
                assert!(bits(&film) == expected, "{samples:?}, split {seed}");
            }
        }
    }
}

#[test]
fn shards_merge_to_the_same_bits_in_every_order() {
    let cuts = [0, 3, 17, 32, 33, 64, 90, 100];
    let expected = bits(&sequential(0..100, true));
    for seed in 0..10 {
        let mut shards: Vec<_> = cuts.windows(2).map(|c| c[0]..c[1]).collect();
        shards.sort_by_key(|shard| hash(seed * 1000 + shard.start));
        let mut whole = film(true);
        for shard in shards {
            whole.merge(sequential(shard, true)).unwrap();
        }
        assert_eq!((whole.samples(), whole.ranges()), (100, vec![0..100]));
        assert!(bits(&whole) == expected, "order {seed}");
    }
}

#[test]
fn gaps_stay_visible_and_count_only_what_is_there() {
    let mut film = sequential(3..77, false);
    film.merge(sequential(90..93, false)).unwrap();
    assert_eq!(film.ranges(), [3..77, 90..93]);
    assert_eq!(film.samples(), 77);
    // from 3, 4, 8, 16, 32, 64, 72, 76, and from 90, 92
    assert_eq!(film.nodes().count(), 10);
}

#[test]
fn what_is_missing_is_told() {
    let mut film = sequential(3..7, false);
    film.merge(sequential(9..12, false)).unwrap();
    for (asked, expected) in [
        (vec![0..16], vec![0..3, 7..9, 12..16]),
        (vec![3..7], vec![]),
        (vec![4..10], vec![7..9]),
        (vec![0..2, 5..6, 10..20], vec![0..2, 12..20]),
        (vec![20..22], vec![20..22]),
    ] {
        assert_eq!(film.missing(&asked), expected, "of {asked:?}");
    }
}

/// Each level of the tree doubles a constant, which is exact; so is the rest.
#[test]
fn a_million_equal_samples_lose_nothing() {
    let window = Crop {
        x0: 0,
        y0: 0,
        x1: 1,
        y1: 1,
    };
    let mut film = Film::new(window, (1, 1), false);
    for sample in 0..1_000_000 {
        let mut values = vec![0.0; 9];
        values[..3].fill(0.1);
        film.add(sample, 0, values).unwrap();
    }
    let mean = f64::from(film.mean()[0][0]);
    assert!((mean / 0.1 - 1.0).abs() < 1e-7, "{mean}");
    assert_eq!(film.standard_error()[0], [0.0; 3]);
    assert_eq!(film.relative_error(), 0.0);
    // 1 000 000 has seven ones in binary
    assert_eq!(film.nodes().count(), 7);
}

/// Against two passes in double precision. Each of seven levels rounds to 24
/// bits, so relative errors stay below 2 · 7 · 2⁻²⁴ < 1e-6.
#[test]
fn moments_agree_with_two_passes_in_double_precision() {
    for samples in [0..100_u64, 3..77] {
        let film = sequential(samples.clone(), false);
        let (mean, error) = (film.mean(), film.standard_error());
        let (mut signal, mut noise) = (0.0, 0.0);
        for pixel in 0..PIXELS {
            for channel in 0..3 {
                let float = (pixel * 9 + channel) as u64;
                let x = || samples.clone().map(|s| f64::from(radiance(s, float)));
                let n = (samples.end - samples.start) as f64;
                let expected = x().sum::<f64>() / n;
                let m2: f64 = x().map(|x| (x - expected) * (x - expected)).sum();
                let sigma = (m2 / (n - 1.0) / n).sqrt();
                let relative = |value: f32, expected: f64| f64::from(value) / expected - 1.0;
                assert!(relative(mean[pixel][channel], expected).abs() < 1e-6);
                assert!(relative(error[pixel][channel], sigma).abs() < 1e-6);
                signal += expected * expected;
                noise += sigma * sigma;
            }
        }
        let expected = (noise / signal).sqrt();
        assert!((film.relative_error() / expected - 1.0).abs() < 1e-6);
    }
}

/// The reason for M₂: a sum of squares in single precision would lose the whole variance here.
#[test]
fn small_deviations_on_a_large_mean_survive() {
    let mut film = film(false);
    for sample in 0..64 {
        let mut values = leaf(sample, false);
        // 1000 and 1000.125 in turn: these and their sums are exact
        for pixel in values.chunks_exact_mut(9) {
            pixel[..3].fill(1000.0 + 0.125 * (sample % 2) as f32);
        }
        film.add(sample, 0, values).unwrap();
    }
    let expected = (0.0625_f64.powi(2) * 64.0 / 63.0 / 64.0).sqrt() as f32;
    assert_eq!(film.standard_error()[0][0], expected);
}

/// Counts, however a render was split: those of all samples.
#[test]
fn dropped_samples_are_counted_for_each_pixel() {
    let samples = 3..203;
    let film = sequential(samples.clone(), true);
    let counts = film.dropped().unwrap();
    assert_eq!(counts.len(), PIXELS);
    for (pixel, count) in counts.into_iter().enumerate() {
        let is_dropped = |sample: &u64| leaf(*sample, true)[18 * pixel + 17] == 1.0;
        assert_eq!(count as usize, samples.clone().filter(is_dropped).count());
    }
    assert!(sequential(0..4, false).dropped().is_none());
}

#[test]
fn depth_averages_hits_and_misses_are_infinitely_far() {
    let mut film = film(true);
    for (sample, depth) in [2.0, 4.0, 0.0, 0.0].into_iter().enumerate() {
        let mut values = vec![0.0; PIXELS * 18];
        if depth > 0.0 {
            // only the first pixel is ever hit
            values[9..12].copy_from_slice(&[0.5, 0.25, 1.0]);
            values[12..15].copy_from_slice(&[0.0, 1.0, 0.0]);
            values[15..17].copy_from_slice(&[depth, 1.0]);
        }
        film.add(sample as u64, 0, values).unwrap();
    }
    let (depth, coverage) = (film.depth().unwrap(), film.coverage().unwrap());
    assert_eq!((depth[0], coverage[0]), (3.0, 0.5));
    assert_eq!((depth[1], coverage[1]), (f32::INFINITY, 0.0));
    assert_eq!(film.albedo().unwrap()[0], [0.25, 0.125, 0.5]);
    assert_eq!(film.normal().unwrap()[0], [0.0, 0.5, 0.0]);
    let plain = sequential(0..4, false);
    assert!(plain.albedo().is_none() && plain.depth().is_none());
}

#[test]
fn one_sample_says_nothing_about_the_error() {
    let film = sequential(7..8, false);
    assert_eq!(film.standard_error()[0], [f32::INFINITY; 3]);
    assert_eq!(film.relative_error(), f64::INFINITY);
    assert!(film.mean()[0][0] > 0.0);
}

#[test]
fn what_does_not_fit_is_refused_and_changes_nothing() {
    let mut whole = sequential(8..24, false);
    let before = bits(&whole);
    let mut refused = |first: u64, level: u32, len: usize| {
        let result = whole.add(first, level, vec![0.0; len]);
        assert!(
            matches!(result, Err(Error::Settings { .. })),
            "node {first}, {level} of {len} floats"
        );
    };
    let len = PIXELS * 9;
    refused(8, 0, len);
    refused(23, 0, len);
    refused(16, 3, len);
    refused(0, 5, len); // holds all of it
    refused(0, 4, len); // its second half overlaps
    refused(3, 1, len); // not aligned
    refused(24, 0, len - 1);
    refused(0, 64, len);
    refused(1 << 63, 0, len);

    // the second node of this film collides; the first must not be left behind
    let mut other = sequential(0..1, false);
    other.merge(sequential(10..11, false)).unwrap();
    assert!(whole.merge(other).is_err());
    assert!(whole.merge(sequential(100..101, true)).is_err());
    assert!(whole.merge(Film::new(WINDOW, (8, 5), false)).is_err());
    let moved = Crop { x0: 2, ..WINDOW };
    assert!(whole.merge(Film::new(moved, (8, 4), false)).is_err());
    assert!(bits(&whole) == before);
    assert_eq!(whole.ranges(), [8..24]);
}

#[test]
fn pieces_are_aligned_and_make_up_the_range() {
    let far = 1 << 62;
    for range in [0..1, 0..100, 3..77, 1..1 << 40, far - 3..far, 9..9] {
        let pieces = dyadic_pieces(range.clone());
        let mut next = range.start;
        for &(first, level) in &pieces {
            assert_eq!(first, next);
            assert_eq!(first % (1 << level), 0);
            next += 1 << level;
        }
        assert_eq!(next, range.end);
        assert!(pieces.len() <= 2 * 62);
    }
}

/// Leaves of a film of nets in blocks of 2^`level` samples.
fn nets(samples: Range<u64>, level: u32) -> Film {
    let mut film = film(false).with_blocks(level);
    for sample in samples {
        film.add(sample, 0, leaf(sample, false)).unwrap();
    }
    film
}

/// Squared standard error of the mean from the sums of parts: Σ n (m − mean)² / (N (G − 1)).
fn squared_error(parts: &[Range<u64>], float: u64) -> f64 {
    let value = |sample| f64::from(radiance(sample, float));
    let all = || parts.iter().flat_map(Clone::clone).map(value);
    let count = all().count() as f64;
    let mean = all().sum::<f64>() / count;
    let spread = |part: &Range<u64>| {
        let n = (part.end - part.start) as f64;
        n * (part.clone().map(value).sum::<f64>() / n - mean).powi(2)
    };
    let spread: f64 = parts.iter().map(spread).sum();
    spread / count / (parts.len() as f64 - 1.0)
}

/// That of nets in blocks of 4 samples, of which there is a number of whole ones and a rest, (Σ_w (x̄ − mean)² n W / (K − 1) + (A − B)²) /
/// ((W + R) N): K whole nets of n samples have W of the N samples, A and B are the sums of the two nets of the R samples of the rest.
fn squared_error_of_nets(whole: Range<u64>, rest: &[u64], count: u64, float: u64) -> f64 {
    let value = |sample: u64| f64::from(radiance(sample, float));
    let is_first = |sample: &u64| sample % 8 < 4;
    let sum = |samples: &[u64]| samples.iter().map(|&s| value(s)).sum::<f64>();
    let split = |samples: &[u64]| -> [f64; 2] {
        let (a, b): (Vec<u64>, Vec<u64>) = samples.iter().partition(|s| is_first(s));
        [sum(&a), sum(&b)]
    };
    let pairs: Vec<u64> = whole.clone().collect();
    let means: Vec<f64> = pairs
        .chunks(128)
        .flat_map(|pair| split(pair).map(|sum| sum / 64.0))
        .collect();
    let mean = means.iter().sum::<f64>() / means.len() as f64;
    let m2: f64 = means.iter().map(|m| 64.0 * (m - mean).powi(2)).sum();
    let samples = pairs.len() as f64;
    let of_whole = if pairs.is_empty() {
        0.0
    } else {
        m2 / (means.len() - 1) as f64 * samples
    };
    let [a, b] = split(rest);
    (of_whole + (a - b).powi(2)) / ((samples + rest.len() as f64) * count as f64)
}

#[test]
fn nets_and_their_blocks_decide_the_standard_error() {
    let singles = |samples: Range<u64>| samples.map(|s| s..s + 1).collect::<Vec<_>>();
    let fours = |samples: Range<u64>| samples.step_by(4).map(|s| s..s + 4).collect::<Vec<_>>();
    // Samples, parts of which blocks' deviations are taken, samples in whole pairs of nets (128 samples) and in other
    // pairs of blocks, and degrees of freedom.
    type Case = (Range<u64>, Vec<Range<u64>>, Range<u64>, Vec<u64>, f64);
    let cases: [Case; 12] = [
        (0..64, fours(0..64), 0..0, (0..64).collect(), 1.0 + 2.0),
        (16..48, fours(16..48), 0..0, (16..48).collect(), 1.0 + 2.0),
        // one pair of blocks: a single difference, whoever asks
        (8..16, fours(8..16), 0..0, (8..16).collect(), 1.0),
        // six whole nets
        (128..512, fours(128..512), 128..512, vec![], 5.0 + 2.0),
        // rests are taken together: (128 + 64)² / (128² / 1 + 64² / 1)
        (
            96..288,
            fours(96..288),
            128..256,
            (96..128).chain(256..288).collect(),
            1.8 + 2.0,
        ),
        // (256 + 64)² / (256² / 3 + 64² / 1)
        (
            0..320,
            fours(0..320),
            0..256,
            (256..320).collect(),
            102_400.0 / (65_536.0 / 3.0 + 4096.0) + 2.0,
        ),
        // a rest of two nodes, which no pair of blocks holds
        (
            0..11,
            vec![0..4, 4..8, 8..10, 10..11],
            0..0,
            (0..8).collect(),
            1.0 + 2.0,
        ),
        // eight pairs
        (
            1024..2048,
            fours(1024..2048),
            1024..2048,
            vec![],
            15.0 + 2.0,
        ),
        (
            0..39,
            [fours(0..36), vec![36..38, 38..39]].concat(),
            0..0,
            (0..32).collect(),
            1.0 + 2.0,
        ),
        (
            3..16,
            [vec![3..4], fours(4..16)].concat(),
            0..0,
            (8..16).collect(),
            1.0 + 2.0,
        ),
        // two blocks, but no pair
        (4..12, fours(4..12), 0..0, vec![], 1.0),
        // a single block: its samples
        (4..11, singles(4..11), 0..0, vec![], 6.0),
    ];
    for (samples, parts, whole, rest, degrees) in cases {
        let film = nets(samples.clone(), 2);
        let difference = film.parts() - 1.0 - degrees;
        assert!(difference.abs() < 1e-12, "{samples:?}: {}", film.parts());
        let errors = film.standard_error();
        let is_net = !whole.is_empty() || !rest.is_empty();
        // one pair of blocks has no more than one
        let weight = 3.0 * if degrees > 2.0 { degrees - 2.0 } else { 1.0 };
        for (pixel, errors) in errors.iter().enumerate() {
            for (channel, &error) in errors.iter().enumerate() {
                let float = (pixel * 9 + channel) as u64;
                let mut expected = squared_error(&parts, float);
                if is_net {
                    let count = samples.end - samples.start;
                    let of_nets = squared_error_of_nets(whole.clone(), &rest, count, float);
                    expected = (weight * of_nets + 0.75 * expected) / (weight + 1.0);
                }
                let deviation = (f64::from(error) / expected.sqrt() - 1.0).abs();
                // sums of up to 1024 floats of very different size
                assert!(
                    deviation < 1e-4,
                    "{samples:?}: {error} is not {}",
                    expected.sqrt()
                );
            }
        }
    }
    assert!(nets(0..1, 2).relative_error().is_infinite());
}

#[test]
fn nets_give_the_same_bits_in_any_order() {
    for samples in [0..100, 3..77, 64..128, 200..600] {
        let expected = bits(&nets(samples.clone(), 3));
        for seed in 0..20 {
            let mut film = film(false).with_blocks(3);
            for (first, level) in random_pieces(samples.clone(), seed) {
                let own = nets(first..first + (1 << level), 3);
                let values = own.nodes().next().unwrap().2.to_vec();
                film.add(first, level, values).unwrap();
            }
            assert!(bits(&film) == expected, "{samples:?}, split {seed}");
        }
    }
    let mut other = nets(0..4, 3);
    assert!(
        other.merge(nets(4..8, 2)).is_err(),
        "blocks of another size"
    );
}
