//! Numbers and accumulation; random numbers.

use crate::Verdict::*;
use crate::{Case, largest, line, passes};

/// G.
pub const ACCUMULATION: &[Case] = &[
    Case {
        id: "G1",
        what: "Sums in fp32: 0.1 is 1 % off after 1e6 samples",
        expected: "constant sky, 1e6 samples: 1e-7",
        verdict: Holds,
        evidence: &[largest(
            "integrator::emission::constant_sky_keeps_its_value_over_a_million_samples",
            "off ",
        )],
    },
    Case {
        id: "G2",
        what: "Running means cannot be merged",
        expected: "any split, any order: the same bits",
        verdict: Holds,
        evidence: &[
            passes("film::any_split_in_any_order_gives_the_same_bits"),
            passes("integrator::determinism::merged_films_are_the_film_of_all_samples"),
        ],
    },
    Case {
        id: "G3",
        what: "Sums in half precision stall at 2048",
        expected: "none",
        verdict: Absent(
            "no buffer or image of the renderer has a half format; sums are fp32 trees",
        ),
        evidence: &[],
    },
    Case {
        id: "G4",
        what: "Variance by Σx² − (Σx)²/n: negative",
        expected: "1e-4 of noise on a constant",
        verdict: Holds,
        evidence: &[
            passes("film::small_deviations_on_a_large_mean_survive"),
            passes("film::moments_agree_with_two_passes_in_double_precision"),
        ],
    },
    Case {
        id: "G5",
        what: "Half in EXR: ∞ above 65 504",
        expected: "FLOAT channels return every bit",
        verdict: Holds,
        evidence: &[
            passes("files::arbitrary_bits_survive_compression"),
            passes("files::exr_returns_every_bit_both_windows_and_the_header"),
        ],
    },
    Case {
        id: "G6",
        what: "sin, cos, exp, log of the device",
        expected: "measured, and in the header",
        verdict: Holds,
        evidence: &[
            line("cli::selftest::device_passes_its_tests", "\"sin in"),
            line(
                "shading::interface::smooth_interfaces_refract_by_snell_and_lose_nothing",
                "Snell",
            ),
        ],
    },
    Case {
        id: "G7",
        what: "Denormals are flushed",
        expected: "FLT_MIN/2 in materials, media and lamps: the picture of zeros, to the bit",
        verdict: Holds,
        evidence: &[line(
            "stability::numbers::denormal_numbers_are_zeros",
            "numbers of",
        )],
    },
    Case {
        id: "G8",
        what: "Filters: weights at borders, correlation",
        expected: "constant stays constant",
        verdict: Holds,
        evidence: &[
            largest(
                "integrator::emission::constant_sky_keeps_its_value_over_a_million_samples",
                "off ",
            ),
            passes("integrator::determinism::crop_is_a_part_of_the_frame"),
        ],
    },
];

/// H.
pub const RANDOM: &[Case] = &[
    Case {
        id: "H1",
        what: "Correlation across pixels",
        expected: "autocorrelation ≤ 4.9/√N at 64 lags; variance of tile means = σ²/n",
        verdict: Holds,
        evidence: &[
            line(
                "shading::random::dimensions_pixels_samples_and_seeds_are_independent",
                "autocorrelation",
            ),
            line(
                "stability::chance::tiles_have_the_variance_of_independent_pixels",
                "tiles of 4",
            ),
            line(
                "stability::chance::tiles_have_the_variance_of_independent_pixels",
                "tiles of 16",
            ),
        ],
    },
    Case {
        id: "H2",
        what: "Correlation across dimensions",
        expected: "χ² of pairs",
        verdict: Wider("162 tests of pairs instead of 1000"),
        evidence: &[line(
            "shading::random::dimensions_pixels_samples_and_seeds_are_independent",
            "independent:",
        )],
    },
    Case {
        id: "H3",
        what: "Shards repeat samples",
        expected: "variance of the mean of K = 16 shards = σ²/K; no pixel sample twice",
        verdict: Holds,
        evidence: &[
            line("shading::random::no_pixel_sample_shares_its_key", "keys:"),
            passes("work::shards::any_number_in_any_order_gives_the_same_bits"),
            line(
                "stability::chance::shards_have_the_variance_of_independent_samples",
                "16 shards",
            ),
        ],
    },
    Case {
        id: "H4",
        what: "u = 0 or 1 in warps",
        expected: "all of 2²³ values through each warp: finite, in range",
        verdict: Wider(
            "numbers are odd multiples of 2⁻²⁴, so that neither end occurs; the warps met 1e6 draws, not every value",
        ),
        evidence: &[
            line(
                "shading::random::numbers_are_uniform_and_inside",
                "uniform:",
            ),
            line(
                "shading::samplers::warps_of_the_square_have_their_density",
                "warps:",
            ),
        ],
    },
    Case {
        id: "H5",
        what: "Quasi-Monte Carlo: plateaus",
        expected: "squared error × samples does not grow from one net on, unbiased",
        verdict: Holds,
        evidence: &[
            line(
                "stability::chance::errors_of_nets_fall_at_least_as_of_independent_samples",
                "256 samples",
            ),
            passes("shading::nets::nets_are_independent_of_each_other"),
            passes("shading::nets::nets_integrate_without_bias_and_slots_do_not_go_together"),
        ],
    },
    Case {
        id: "H6",
        what: "Dimensions run out on long paths",
        expected: "white medium with > 10³ events a path: 1",
        verdict: Holds,
        evidence: &[
            line(
                "matter::closed::white_media_are_invisible_in_a_white_world",
                "τ 100",
            ),
            line(
                "shading::random::numbers_are_uniform_and_inside",
                "uniform:",
            ),
            line(
                "stability::chance::long_paths_do_not_run_out_of_numbers",
                "rays a path",
            ),
        ],
    },
    Case {
        id: "H7",
        what: "Powers of two only",
        expected: "squared error × samples as good at 1000 as at 1024",
        verdict: Holds,
        evidence: &[line(
            "stability::chance::errors_of_nets_fall_at_least_as_of_independent_samples",
            "1000 samples",
        )],
    },
    Case {
        id: "H8",
        what: "Counters of 32 bits wrap",
        expected: "samples across 2³²: independent, no key twice",
        verdict: Holds,
        evidence: &[
            line("shading::random::no_pixel_sample_shares_its_key", "keys:"),
            line(
                "stability::chance::sample_numbers_pass_two_to_the_32",
                "range 1",
            ),
        ],
    },
];
