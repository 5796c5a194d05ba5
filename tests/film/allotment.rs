//! Films whose pixels take different numbers of samples.

use std::ops::Range;

use etendue::Error;
use etendue::film::{Allotment, Film};

use super::{PIXELS, film, leaf, random_pieces};

/// Six pixels that take 1 to 8 samples where the film counts one have the bits of even films of 1 to 8 times the samples,
/// with blocks of two, nets of 32 and pairs of these, whether siblings are merged early or late.
#[test]
fn pixels_that_take_more_are_those_of_longer_films() {
    const EXPONENTS: [u8; PIXELS] = [0, 1, 3, 0, 2, 1];
    const SAMPLES: Range<u64> = 3..77;
    let block = 1;
    let even = |samples: Range<u64>| {
        let mut film = film(true).with_blocks(block);
        for sample in samples {
            film.add(sample, 0, leaf(sample, true)).unwrap();
        }
        film
    };
    let longer: Vec<Film> = (0..4)
        .map(|e| even(SAMPLES.start << e..SAMPLES.end << e))
        .collect();
    for seed in 0..4 {
        let allotment = Allotment::from_exponents(EXPONENTS.to_vec());
        let mut spread = film(true).with_blocks(block).with_allotment(allotment);
        for (first, level) in random_pieces(SAMPLES, seed) {
            let mut values = Vec::new();
            for (pixel, e) in EXPONENTS.into_iter().enumerate() {
                let own = even(first << e..(first + (1 << level)) << e);
                let node = own.nodes().next().unwrap().2.to_vec();
                values.extend(&node[pixel * 18..(pixel + 1) * 18]);
            }
            spread.add(first, level, values).unwrap();
        }
        assert_eq!(spread.samples(), 74);
        assert_eq!(spread.paths(), 74 * (1 + 2 + 8 + 1 + 4 + 2));
        let interval = spread.interval(0.95);
        for (pixel, e) in EXPONENTS.into_iter().enumerate() {
            let film = &longer[usize::from(e)];
            assert_eq!(spread.mean()[pixel], film.mean()[pixel]);
            assert_eq!(spread.standard_error()[pixel], film.standard_error()[pixel]);
            assert_eq!(
                spread.albedo().unwrap()[pixel],
                film.albedo().unwrap()[pixel]
            );
            assert_eq!(spread.depth().unwrap()[pixel], film.depth().unwrap()[pixel]);
            assert_eq!(
                spread.coverage().unwrap()[pixel],
                film.coverage().unwrap()[pixel]
            );
            assert_eq!(
                spread.dropped().unwrap()[pixel],
                film.dropped().unwrap()[pixel]
            );
            assert_eq!(spread.samples_taken()[pixel], film.samples() as f32);
            assert!(interval[pixel][0].is_finite());
        }
        assert_eq!(spread.parts(), longer[0].parts());
        assert!(
            matches!(even(0..1).merge(spread), Err(Error::Settings { name, .. }) if name == "--adaptive")
        );
    }
}

/// Levels of a pixel end where counts would not fit.
#[test]
fn films_whose_pixels_take_more_end_earlier() {
    let allotment = Allotment::from_exponents(vec![0, 0, 0, 0, 0, 4]);
    let mut film = film(false).with_allotment(allotment);
    let values = || vec![0.0; PIXELS * 9];
    assert!(film.add(1 << 58, 58, values()).is_ok());
    assert!(film.add(1 << 59, 59, values()).is_err());
}
