//! The estimator, random numbers, sums.

use crate::Mutant;

pub const MUTANTS: &[Mutant] = &[
    Mutant {
        name: "mis-half",
        wrong: "each of two strategies has half the weight",
        file: "shaders/sampling.glsl",
        edits: &[(
            "    return 1.0 / (1.0 + ratio * ratio);",
            "    return 0.5 + 0.0 * ratio;",
        )],
        killers: &["shading::values::mis_weights_sum_to_one"],
    },
    Mutant {
        name: "mis-sum",
        wrong: "the weights of two strategies do not sum to one",
        file: "shaders/direct.glsl",
        edits: &[(
            "STRATEGY_LIGHT_ONLY ? 0.0 : mis_weight(pdf_bsdf, pdf_light);",
            "STRATEGY_LIGHT_ONLY ? 0.0 : 1.0;",
        )],
        killers: &["integrator::closed::closed_room_sums_the_series"],
    },
    Mutant {
        name: "mis-delta",
        wrong: "light without extent shares its weight with scattering",
        file: "shaders/direct.glsl",
        edits: &[(
            "if (is_delta || STRATEGY == STRATEGY_LIGHT_ONLY) {",
            "if (STRATEGY == STRATEGY_LIGHT_ONLY) {",
        )],
        killers: &[
            "integrator::punctual::directional_light_obeys_the_cosine_and_ends_at_the_horizon",
        ],
    },
    Mutant {
        name: "mirror-shared",
        wrong: "what a mirror shows shares its weight with direct light",
        file: "shaders/path.glsl",
        edits: &[(
            "path.can_be_sampled = next.pdf > 0.0;",
            "path.can_be_sampled = true;",
        )],
        killers: &["matter::slab::thin_sheet_is_a_plate_without_absorption"],
    },
    Mutant {
        name: "roulette-weight",
        wrong: "survivors of roulette are not weighted",
        file: "shaders/path.glsl",
        edits: &[("    path.beta /= survival;", "    path.beta *= 1.0;")],
        killers: &["integrator::closed::closed_room_sums_the_series"],
    },
    Mutant {
        name: "roulette-square",
        wrong: "survival is the square of the throughput",
        file: "shaders/path.glsl",
        edits: &[(
            "smaller(throughput / weight, 1.0) : 1.0;",
            "square(min(max_component(path.beta), 1.0)) : 1.0;",
        )],
        killers: &["integrator::closed::closed_room_sums_the_series"],
    },
    Mutant {
        name: "spread-index",
        wrong: "pixels that take more samples take those of the pass",
        file: "shaders/kernel_path.glsl",
        edits: &[("        low <<= exponent;", "        low <<= 0u;")],
        killers: &[
            "integrator::determinism::pixels_that_take_more_samples_have_the_bits_of_longer_renders",
        ],
    },
    Mutant {
        name: "share-unseen",
        wrong: "what a pixel shares is seen by all of its block",
        file: "shaders/share.glsl",
        edits: &[(
            "if (trace_occluded(share_near.origin, d, 0.0, distance, share_near.record, NONE)) {",
            "if (distance < 0.0) {",
        )],
        killers: &["integrator::share::what_pixels_share_has_the_mean_of_each_alone"],
    },
    Mutant {
        name: "share-evenly",
        wrong: "pixels weigh what they share by their number, not by how it might have been found",
        file: "shaders/share.glsl",
        edits: &[(
            "far.radiance * (density / all);",
            "far.radiance / float(SHARE_COUNT);",
        )],
        killers: &["integrator::share::what_pixels_share_has_the_mean_of_each_alone"],
    },
    Mutant {
        name: "share-colour",
        wrong: "what a pixel shares has the colour of its own surface",
        file: "shaders/share.glsl",
        edits: &[("        beta = vec3(1.0);", "")],
        killers: &["integrator::share::what_pixels_share_has_the_mean_of_each_alone"],
    },
    Mutant {
        name: "guide-density",
        wrong: "directions of the guide have the density that the surface would have given them",
        file: "shaders/guide.glsl",
        edits: &[(
            "    next.weight = value.f_cos / pdf;",
            "    next.weight = value.f_cos / value.pdf;",
        )],
        killers: &["integrator::guide::a_mirrored_lamp_is_as_bright_as_two"],
    },
    Mutant {
        name: "guide-all",
        wrong: "what the guide takes is not missing from the surface's own directions",
        file: "shaders/guide.glsl",
        edits: &[(
            "(guide_pdf(guide, frame * next.wi) - next.wi.z * INV_PI);",
            "guide_pdf(guide, frame * next.wi);",
        )],
        killers: &["integrator::guide::guided_paths_have_the_mean_of_plain_ones"],
    },
    Mutant {
        name: "guide-evenly",
        wrong: "all lobes weigh the same, and are not chosen alike",
        file: "shaders/guide.glsl",
        edits: &[(
            "sum += lobe.weight * lobe.kappa *",
            "sum += (guide.total / float(GUIDE_LOBES)) * lobe.kappa *",
        )],
        killers: &["integrator::guide::a_mirrored_lamp_is_as_bright_as_two"],
    },
    Mutant {
        name: "guide-wide",
        wrong: "lobes are half as dense as their directions",
        file: "shaders/guide.glsl",
        edits: &[(
            "return sum / (TWO_PI * guide.total);",
            "return sum / (2.0 * TWO_PI * guide.total);",
        )],
        killers: &["integrator::guide::a_mirrored_lamp_is_as_bright_as_two"],
    },
    Mutant {
        name: "spread-itself",
        wrong: "samples of the picture tell which pixels take more",
        file: "src/settings.rs",
        edits: &[],
        killers: &["integrator::analytic::spread_samples_are_not_biased"],
    },
    Mutant {
        name: "depth-eight",
        wrong: "paths end after eight scatterings",
        file: "shaders/path.glsl",
        edits: &[(
            "bool is_last = !path.is_sensor && path.depth >= params.max_depth;",
            "bool is_last = !path.is_sensor && path.depth >= min(params.max_depth, 8u);",
        )],
        killers: &["integrator::closed::closed_room_sums_the_series"],
    },
    Mutant {
        name: "clamp-ten",
        wrong: "bright samples are cut at 10",
        file: "shaders/kernel_path.glsl",
        edits: &[(
            "vec3(0.0) : result.radiance, vec3(0.0)",
            "vec3(0.0) : min(result.radiance, vec3(10.0)), vec3(0.0)",
        )],
        killers: &["integrator::closed::closed_room_sums_the_series"],
    },
    Mutant {
        name: "silent-drop",
        wrong: "samples that are not finite vanish uncounted",
        file: "shaders/kernel_path.glsl",
        edits: &[("non_finite += is_dropped ? 1u : 0u;", "non_finite += 0u;")],
        killers: &["integrator::emission::samples_that_overflow_are_counted"],
    },
    Mutant {
        name: "silent-cut",
        wrong: "what the depth limit cuts off is not counted",
        file: "shaders/kernel_path.glsl",
        edits: &[(
            "truncated += result.truncated > 0.0 ? 1u : 0u;",
            "truncated += 0u;",
        )],
        killers: &["integrator::closed::closed_room_sums_the_series"],
    },
    Mutant {
        name: "filter-weights",
        wrong: "weights of the pixel filter are not divided out",
        file: "shaders/kernel_path.glsl",
        edits: &[(
            "vec3(0.0) : result.radiance, vec3(0.0)",
            "vec3(0.0) : result.radiance * 2.0 * rng_uniform(path.key, 0u, SLOT_CAMERA).y, vec3(0.0)",
        )],
        killers: &["integrator::emission::radiance_of_an_emitter_is_the_same_from_everywhere"],
    },
    Mutant {
        name: "sum-half",
        wrong: "sums in half precision",
        file: "shaders/film.glsl",
        edits: &[(
            "precise vec3 sum = a.sum + b.sum;",
            "vec3 exact = a.sum + b.sum;\n    vec3 sum = vec3(unpackHalf2x16(packHalf2x16(exact.xy)), unpackHalf2x16(packHalf2x16(exact.zz)).x);",
        )],
        killers: &["integrator::emission::constant_sky_keeps_its_value_over_a_million_samples"],
    },
    Mutant {
        name: "sum-variance",
        wrong: "the deviations of two halves leave out their difference",
        file: "shaders/film.glsl",
        edits: &[(
            "precise vec3 m2 = within + (d * d) * (1.0 / (2.0 * count));",
            "precise vec3 m2 = within + 0.0 * d * count;",
        )],
        killers: &["integrator::emission::standard_error_is_that_of_the_samples"],
    },
    Mutant {
        name: "net-column",
        wrong: "one digit of one column of the nets is wrong",
        file: "shaders/rng.glsl",
        edits: &[("0x095540B9u", "0x095540B8u")],
        killers: &["shading::nets::samples_in_turn_are_nets"],
    },
    Mutant {
        name: "one-net",
        wrong: "the two nets that take turns are one",
        file: "shaders/rng.glsl",
        edits: &[(
            "uint net = sample_low & (WHICH | ~(PAIR - 1u));",
            "uint net = sample_low & ~(PAIR - 1u);",
        )],
        killers: &["shading::nets::nets_are_independent_of_each_other"],
    },
    Mutant {
        name: "nets-of-a-block",
        wrong: "what two nets differ by is that of their last blocks",
        file: "shaders/film.glsl",
        edits: &[(
            "precise vec3 between = a.between + b.between;",
            "precise vec3 between = b.between;",
        )],
        killers: &["integrator::calibration::intervals_hold_the_truth_as_often_as_they_say"],
    },
    Mutant {
        name: "blocks-as-samples",
        wrong: "deviations within a net count as those of independent samples",
        file: "shaders/film.glsl",
        edits: &[(
            "        within = vec3(0.0);",
            "        within += vec3(0.0);",
        )],
        killers: &["integrator::calibration::intervals_hold_the_truth_as_often_as_they_say"],
    },
    Mutant {
        name: "sample-zero-twice",
        wrong: "the first sample is counted twice and the second never",
        file: "shaders/kernel_path.glsl",
        edits: &[("low + i)", "low + (i == 1u ? 0u : i))")],
        killers: &[
            "integrator::determinism::same_seed_gives_the_same_bits_however_the_work_is_cut",
        ],
    },
    Mutant {
        name: "shard-seed",
        wrong: "every pass and every shard draws the same numbers",
        file: "shaders/kernel_path.glsl",
        edits: &[("low + i)", "i)")],
        killers: &[
            "integrator::determinism::same_seed_gives_the_same_bits_however_the_work_is_cut",
        ],
    },
    Mutant {
        name: "interval-closed",
        wrong: "random numbers may be 0 and 1",
        file: "shaders/rng.glsl",
        edits: &[(
            "return (vec4(bits >> 9u) + 0.5) * (1.0 / 8388608.0);",
            "return vec4(bits) * (1.0 / 4294967295.0);",
        )],
        killers: &["shading::random::numbers_are_uniform_and_inside"],
    },
    Mutant {
        name: "pixels-alike",
        wrong: "all pixels draw the same numbers",
        file: "shaders/rng.glsl",
        edits: &[(
            "uvec4(pixel, sample_low, 0u, 0u)",
            "uvec4(0u, sample_low, 0u, 0u)",
        )],
        killers: &["shading::random::no_pixel_sample_shares_its_key"],
    },
    Mutant {
        name: "slots-alike",
        wrong: "light and scattering draw the same numbers",
        file: "shaders/rng.glsl",
        edits: &[("event * SLOT_COUNT + slot", "event * SLOT_COUNT")],
        killers: &["shading::random::dimensions_pixels_samples_and_seeds_are_independent"],
    },
];
