//! Fresnel and interfaces; media.

use crate::Verdict::*;
use crate::{Case, largest, line, passes};

/// B.
pub const INTERFACES: &[Case] = &[
    Case {
        id: "B1",
        what: "Normal incidence: wrong code passes there",
        expected: "closed forms at oblique angles too",
        verdict: Holds,
        evidence: &[largest("matter::slab::plates_of_all_kinds", "off ")],
    },
    Case {
        id: "B2",
        what: "Grazing: T = 1 − r cancels",
        expected: "c = 1e-8 … 1: T within 1e-6 of f64",
        verdict: Holds,
        evidence: &[largest(
            "shading::fresnel::fresnel_is_exact_from_one_index_to_millions",
            "T by ",
        )],
    },
    Case {
        id: "B3",
        what: "n → 1: r is lost, half vectors vanish",
        expected: "n = 1 ± 10^−k: r within 1e-6 of f64; n = 1 invisible",
        verdict: Holds,
        evidence: &[
            largest(
                "shading::fresnel::fresnel_is_exact_from_one_index_to_millions",
                "r off by ",
            ),
            largest(
                "shading::interface::smooth_interfaces_refract_by_snell_and_lose_nothing",
                "straight at n = 1 rounded:",
            ),
            largest(
                "stability::placement::glass_of_index_one_is_invisible",
                "differ by",
            ),
        ],
    },
    Case {
        id: "B4",
        what: "n < 1: inside and outside swapped",
        expected: "r(i, n) = r(t, 1/n) to 1e-6",
        verdict: Holds,
        evidence: &[
            largest(
                "shading::fresnel::fresnel_is_the_same_both_ways",
                "r both ways:",
            ),
            passes("matter::cube::camera_in_a_glass_cube_sees_n_squared_or_nothing"),
        ],
    },
    Case {
        id: "B5",
        what: "The critical angle: √ of −1e-8",
        expected: "± 1 ulp … 1e-3: finite, monotone, r ≤ 1",
        verdict: Holds,
        evidence: &[largest(
            "shading::fresnel::total_reflection_begins_without_a_jump",
            "rises by",
        )],
    },
    Case {
        id: "B6",
        what: "Huge n, n = 0 (infinite), n < 1, negative, NaN",
        expected: "n = 1e6: right to 1e-6; 0: r = 1; others refused",
        verdict: Holds,
        evidence: &[
            line(
                "shading::fresnel::fresnel_is_exact_from_one_index_to_millions",
                "n 1e6",
            ),
            passes("loader::broken_shading::broken_materials_and_textures_are_refused"),
        ],
    },
    Case {
        id: "B7",
        what: "Unpolarised light is a model: slabs transmit up to 0.022 more",
        expected: "documented",
        verdict: Absent(
            "a polarised renderer would be another one; the difference is stated in physics.md",
        ),
        evidence: &[],
    },
    Case {
        id: "B8",
        what: "Mirrors and direct light: densities of 0 or ∞, counted twice",
        expected: "mirror and glass before a lamp: the strategies agree to the bit",
        verdict: Holds,
        evidence: &[
            largest(
                "stability::light::smooth_surfaces_leave_nothing_to_light_samples",
                "strategies differ by",
            ),
            passes("matter::gradient::mirror_shows_the_mirrored_sky"),
        ],
    },
    Case {
        id: "B9",
        what: "Smooth and rough lobes mixed: the choice is missing from the density",
        expected: "χ² of every lobe; energy ≤ 1 + 1e-4",
        verdict: Holds,
        evidence: &[
            line(
                "shading::interface_samplers::mixed_surfaces_have_their_density_and_albedo",
                "mixed surface: mean",
            ),
            line(
                "shading::samplers::blend_of_coat_and_metal_has_its_density_and_albedo",
                "half metal: mean",
            ),
        ],
    },
    Case {
        id: "B10",
        what: "Coincident faces of glass: both are skipped",
        expected: "touching slabs of one n are one slab; no black",
        verdict: Holds,
        evidence: &[passes(
            "matter::nested::touching_solids_of_one_index_are_one",
        )],
    },
    Case {
        id: "B11",
        what: "Solids in solids: wrong relative index, or black",
        expected: "glass–liquid–glass in closed form; overflow counted",
        verdict: Holds,
        evidence: &[
            passes("matter::nested::liquid_between_panes_does_not_depend_on_the_overlap"),
            passes("reference::matter::glass_water_and_air_overlap"),
            line(
                "stability::placement::too_many_solids_in_one_place_are_counted",
                "12 solids",
            ),
        ],
    },
    Case {
        id: "B12",
        what: "The camera starts in glass",
        expected: "n² or 0 to 1e-5",
        verdict: Holds,
        evidence: &[
            line(
                "matter::cube::camera_in_a_glass_cube_sees_n_squared_or_nothing",
                "Bvh",
            ),
            passes("reference::matter::camera_within_glass"),
        ],
    },
    Case {
        id: "B13",
        what: "Interpolated normals at interfaces: leaks, black rims",
        expected: "order of convergence; the loss reported",
        verdict: Holds,
        evidence: &[
            line(
                "matter::closed::absorbing_ball_converges_to_its_closed_form",
                "4 levels",
            ),
            line(
                "matter::closed::lossless_solids_are_invisible_in_a_white_world",
                "Bvh, ball",
            ),
            passes("reference::matter::smooth_normals_refract"),
        ],
    },
    Case {
        id: "B14",
        what: "Sheet against solid",
        expected: "R = 2r/(1 + r), T = (1 − r)/(1 + r)",
        verdict: Holds,
        evidence: &[largest(
            "matter::slab::thin_sheet_is_a_plate_without_absorption",
            "off ",
        )],
    },
    Case {
        id: "B15",
        what: "Roulette after radiance was scaled by 1/n² kills good paths",
        expected: "glass cube without variance",
        verdict: Holds,
        evidence: &[passes(
            "matter::cube::glass_cube_may_have_any_size_and_place",
        )],
    },
];

/// C.
pub const MEDIA: &[Case] = &[
    Case {
        id: "C1",
        what: "α → 0: 1/α, ln 0",
        expected: "σ = 0, 1e-30, 1e-6: continuous, finite",
        verdict: Holds,
        evidence: &[line(
            "shading::media::transmittance_is_beers_over_the_range_of_numbers",
            "Beer's law",
        )],
    },
    Case {
        id: "C2",
        what: "αd ≫ 88: 0 · ∞",
        expected: "αd to 1e38: 0 ≤ T ≤ 1, no NaN",
        verdict: Holds,
        evidence: &[line(
            "shading::media::transmittance_is_beers_over_the_range_of_numbers",
            "Beer's law",
        )],
    },
    Case {
        id: "C3",
        what: "Attenuation colour 0, infinite distance",
        expected: "9 corners of colour × distance: T in 0 … 1",
        verdict: Holds,
        evidence: &[
            passes("loader::media::attenuation_is_what_is_left_after_a_distance"),
            passes("loader::media::a_medium_adds_to_the_attenuation_and_stays_finite"),
        ],
    },
    Case {
        id: "C4",
        what: "Chromatic media: one channel drawn, infinite variance",
        expected: "weights ≤ the number of channels; means right",
        verdict: Holds,
        evidence: &[line(
            "shading::media::chromatic_flights_have_the_means_of_each_channel",
            "chromatic flights",
        )],
    },
    Case {
        id: "C5",
        what: "Free flights: u = 1 is ∞, a grid of u has no tail",
        expected: "Kolmogorov–Smirnov of 1e7 flights; 1 − e^{−σd} for 1e-4 … 20",
        verdict: Wider("1e7 flights instead of 1e8"),
        evidence: &[line(
            "shading::media::free_flights_are_exponential",
            "free flights",
        )],
    },
    Case {
        id: "C6",
        what: "Rayleigh's inverse distribution cancels near u = ½",
        expected: "χ² about all axes; moments within 4.9 σ; no direction beyond ±1",
        verdict: Wider("1e6 samples for each test instead of 1e8"),
        evidence: &[
            line(
                "shading::phase::directions_have_the_density_of_their_phase_about_every_axis",
                "phase functions:",
            ),
            largest(
                "shading::phase::directions_have_the_moments_of_their_phase",
                "wanted,",
            ),
        ],
    },
    Case {
        id: "C7",
        what: "Henyey–Greenstein, g → ±1: μ > 1",
        expected: "E[μ] = g, E[P₂] = g² for g to ±0.9999",
        verdict: Holds,
        evidence: &[largest(
            "shading::phase::directions_have_the_moments_of_their_phase",
            "wanted,",
        )],
    },
    Case {
        id: "C8",
        what: "Frames about an axis that is parallel to their helper",
        expected: "about ± x, y, z and skew axes",
        verdict: Holds,
        evidence: &[largest(
            "shading::phase::directions_have_the_density_of_their_phase_about_every_axis",
            "phase values off by",
        )],
    },
    Case {
        id: "C9",
        what: "Forward and backward swapped: Rayleigh cannot show it",
        expected: "E[μ] has the sign of g; clouds agree with a second tracer",
        verdict: Holds,
        evidence: &[
            line(
                "shading::phase::directions_have_the_moments_of_their_phase",
                "g 0.899",
            ),
            passes("reference::matter::forward_and_rayleigh_clouds"),
        ],
    },
    Case {
        id: "C10",
        what: "Many short segments drift",
        expected: "64 (at night 10⁴) touching slabs = one slab, 1e-5; no path is lost",
        verdict: Wider(
            "64 plates are within 1e-5; 10⁴ were off by 3.3e-4, all 256 paths alike: the factor of a plate is rounded, and so is the product, by 2⁻²⁴ each at most",
        ),
        evidence: &[
            largest(
                "stability::numbers::many_touching_plates_absorb_as_one",
                "off by",
            ),
            line(
                "stability::numbers::rays_along_edges_know_what_they_are_in",
                "Bvh, 20³ blocks, edges",
            ),
            line(
                "stability::numbers::rays_along_edges_know_what_they_are_in",
                "RayQuery, 20³ blocks, edges",
            ),
        ],
    },
    Case {
        id: "C11",
        what: "Albedo 1: paths without end",
        expected: "white media at τ = 1, 10, 100: 1",
        verdict: Holds,
        evidence: &[line(
            "matter::closed::white_media_are_invisible_in_a_white_world",
            "τ 100",
        )],
    },
    Case {
        id: "C12",
        what: "Overlapping media",
        expected: "closed form, second tracer",
        verdict: Holds,
        evidence: &[
            passes("reference::matter::overlapping_clouds_from_within"),
            passes("reference::matter::overlaps_elsewhere_change_nothing"),
        ],
    },
    Case {
        id: "C13",
        what: "Lamp and camera in a medium: transmittance forgotten",
        expected: "E = I e^{−σd}/d²",
        verdict: Holds,
        evidence: &[largest("matter::fog::point_light_in_absorbing_fog", "off ")],
    },
    Case {
        id: "C14",
        what: "σ ∝ λ⁻⁴ in three channels",
        expected: "stated wavelengths; channel ratios exact",
        verdict: Holds,
        evidence: &[passes("loader::media::media_are_read_with_their_defaults")],
    },
];
