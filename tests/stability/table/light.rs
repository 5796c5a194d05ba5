//! Integrator, surfaces, lights.

use crate::Verdict::*;
use crate::{Case, largest, line, passes};

/// D.
pub const INTEGRATOR: &[Case] = &[
    Case {
        id: "D1",
        what: "Roulette with q ≤ ρ²: infinite variance",
        expected: "glowing room, ρ = 0.5, 0.9, 0.99: mean right, variance ≤ 1.2 × theory",
        verdict: Holds,
        evidence: &[
            largest("integrator::closed::closed_room_sums_the_series", "off "),
            line(
                "stability::light::roulette_keeps_mean_and_variance",
                "albedo 0.5",
            ),
            line(
                "stability::light::roulette_keeps_mean_and_variance",
                "albedo 0.9:",
            ),
            line(
                "stability::light::roulette_keeps_mean_and_variance",
                "albedo 0.99",
            ),
        ],
    },
    Case {
        id: "D2",
        what: "A depth limit loses ρ^{m+1}",
        expected: "the series for m = 0 … 32, exact; what was cut is counted",
        verdict: Wider(
            "exact until roulette begins, with a quarter of the throughput, then 1 % with chance",
        ),
        evidence: &[
            largest("integrator::closed::closed_room_sums_the_series", "off "),
            line(
                "stability::light::depth_limits_cut_the_series_where_they_say",
                "depth 2",
            ),
            line(
                "stability::light::depth_limits_cut_the_series_where_they_say",
                "depth 32",
            ),
        ],
    },
    Case {
        id: "D3",
        what: "Fireflies are clamped: bias",
        expected: "off, or its amount stated",
        verdict: Absent("nothing is clamped"),
        evidence: &[],
    },
    Case {
        id: "D4",
        what: "NaN and infinite samples",
        expected: "dropped, counted for each pixel and in total; more than 1e-6 of the samples (`--max-dropped`) fail the run",
        verdict: Wider("a sum of many samples beyond 3.4e38 is infinite and not counted"),
        evidence: &[
            passes("integrator::emission::samples_that_overflow_are_counted"),
            line(
                "cli::ending::too_many_samples_that_are_not_finite_fail_the_render",
                "1536",
            ),
        ],
    },
    Case {
        id: "D5",
        what: "isnan() removed by the compiler",
        expected: "NaN made at run time is seen by its bits",
        verdict: Holds,
        evidence: &[line(
            "cli::selftest::device_passes_its_tests",
            "NaN and infinity",
        )],
    },
    Case {
        id: "D6",
        what: "Weights with infinite or 0/0 densities",
        expected: "lamps that face nearly smooth metal and that it sees edge-on: finite, the strategies agree within 0.5 % and 2 %",
        verdict: Holds,
        evidence: &[
            line(
                "integrator::strategies::rough_metal_with_a_spherical_emitter",
                "rough",
            ),
            largest(
                "stability::light::narrow_lobes_and_grazing_lamps_agree",
                "differ by",
            ),
        ],
    },
    Case {
        id: "D7",
        what: "Weights that do not sum to 1",
        expected: "1e-6 for 1e6 pairs",
        verdict: Holds,
        evidence: &[passes("shading::values::mis_weights_sum_to_one")],
    },
    Case {
        id: "D8",
        what: "Compilers reorder compensated sums",
        expected: "precise honoured",
        verdict: Holds,
        evidence: &[line(
            "cli::selftest::device_passes_its_tests",
            "precise: sums",
        )],
    },
    Case {
        id: "D9",
        what: "Albedo > 1 from textures or factors",
        expected: "clamped with a warning; no surface gains",
        verdict: Holds,
        evidence: &[
            passes("loader::shading::factors_that_would_create_energy_are_clamped_with_a_warning"),
            passes("loader::geometry::colors_above_one_are_clamped"),
            passes("shading::values::no_surface_gains_energy"),
        ],
    },
];

/// E.
pub const SURFACES: &[Case] = &[
    Case {
        id: "E1",
        what: "GGX, α → 0: the usual form is ∞ below 1.7e-4",
        expected: "α = 1 … 1e-6: ∫ D cos = 1 within 1e-4; the mean continuous within 0.1 %",
        verdict: Holds,
        evidence: &[
            line(
                "shading::values::microfacet_functions_match_the_formulas",
                "D, visibility",
            ),
            largest(
                "stability::numbers::narrowing_lobes_go_over_into_a_mirror",
                "off by",
            ),
        ],
    },
    Case {
        id: "E2",
        what: "GGX at grazing: G overflows, gain",
        expected: "weak white furnace 1 ± 1e-3 at 0 … 89.9°",
        verdict: Wider(
            "the densities of visible normals are tested by χ² to α = 1e-2 and 89°; values against f64; no gain within 1e-4",
        ),
        evidence: &[
            passes("shading::samplers::visible_normals_have_their_density"),
            passes("shading::values::no_surface_gains_energy"),
            line(
                "shading::values::microfacet_functions_match_the_formulas",
                "D, visibility",
            ),
        ],
    },
    Case {
        id: "E3",
        what: "Energy lost at high roughness",
        expected: "stated; the table = f64 quadrature within 0.2 %",
        verdict: Holds,
        evidence: &[
            line(
                "shading::samplers::metal_has_its_density_and_albedo",
                "metal: mean",
            ),
            line(
                "integrator::furnace::white_metal_never_gains_and_a_mirror_loses_nothing",
                "roughness 1:",
            ),
        ],
    },
    Case {
        id: "E4",
        what: "sample, pdf and eval disagree",
        expected: "χ², mean weight = quadrature within 1e-3, reciprocity",
        verdict: Holds,
        evidence: &[
            largest(
                "shading::samplers::coated_diffuse_has_its_density_and_albedo",
                "mean weight off by",
            ),
            largest(
                "shading::samplers::metal_has_its_density_and_albedo",
                "mean weight off by",
            ),
            largest(
                "shading::interface_samplers::rough_glass_has_its_density_and_albedo",
                "mean weight off by",
            ),
            line(
                "shading::values::coats_and_metals_are_right_and_reciprocal",
                "values:",
            ),
        ],
    },
    Case {
        id: "E5",
        what: "Shading normals leak light through solids",
        expected: "closed bumpy box, light outside: exactly 0 inside",
        verdict: Holds,
        evidence: &[passes(
            "integrator::normals::no_light_leaks_through_walls_with_bumpy_normals",
        )],
    },
    Case {
        id: "E6",
        what: "Normal maps make visible points black",
        expected: "random normal map in a furnace: no black pixel",
        verdict: Holds,
        evidence: &[passes(
            "integrator::normals::bumpy_normals_leave_no_pixel_black",
        )],
    },
    Case {
        id: "E7",
        what: "Terminator of coarse meshes",
        expected: "light below the triangle is lost (decisions.md); the error falls with the triangles",
        verdict: Holds,
        evidence: &[
            line(
                "stability::light::terminators_converge_with_the_triangles",
                "128",
            ),
            line(
                "stability::light::terminators_converge_with_the_triangles",
                "8192",
            ),
        ],
    },
    Case {
        id: "E8",
        what: "Normals or tangents of 0 or NaN",
        expected: "rebuilt, with a warning",
        verdict: Holds,
        evidence: &[passes(
            "loader::geometry::normals_and_tangents_are_unit_and_bad_normals_are_rebuilt",
        )],
    },
    Case {
        id: "E9",
        what: "Wrapping, sRGB, filtering",
        expected: "linear before filtering: a 0/1 checker averages 0.5",
        verdict: Holds,
        evidence: &[passes(
            "shading::lookups::textures_are_wrapped_filtered_and_decoded",
        )],
    },
];

/// F.
pub const LIGHTS: &[Case] = &[
    Case {
        id: "F1",
        what: "Receiver near the lamp: variance A/(3πh²)",
        expected: "Lambert's formula at h = 10^−k, k = 0 … 6",
        verdict: Wider("heights of 3 to 1e-3 of the lamp's size, 0.5 %"),
        evidence: &[passes(
            "integrator::analytic::polygon_light_obeys_lamberts_formula_at_every_height",
        )],
    },
    Case {
        id: "F2",
        what: "Distance 0, a lamp through the point",
        expected: "a point on the emitter: finite",
        verdict: Holds,
        evidence: &[line(
            "stability::light::points_on_a_lamp_are_finite",
            "albedo 0.8",
        )],
    },
    Case {
        id: "F3",
        what: "Lamps seen edge-on: density ∞",
        expected: "tilt 0 … 90.01°: monotone to exactly 0",
        verdict: Holds,
        evidence: &[
            line(
                "stability::placement::lamps_seen_edge_on_fade_to_nothing",
                "90.01",
            ),
            line(
                "stability::placement::lamps_seen_edge_on_fade_to_nothing",
                "89.99",
            ),
        ],
    },
    Case {
        id: "F4",
        what: "Tiny lamps (1e-8)",
        expected: "size 1e-8 … 1e-2 at constant power: E constant within 0.1 %",
        verdict: Wider("lamps of 1e-8 to 1e-2 m; larger ones are no points"),
        evidence: &[largest(
            "stability::light::tiny_lamps_keep_their_power",
            "off by",
        )],
    },
    Case {
        id: "F5",
        what: "Enclosing lamps",
        expected: "glowing room, closed form",
        verdict: Holds,
        evidence: &[largest(
            "integrator::closed::closed_room_sums_the_series",
            "off ",
        )],
    },
    Case {
        id: "F6",
        what: "One hot texel: density 0 where interpolation gives light",
        expected: "closed form of the reconstruction; the strategies agree",
        verdict: Holds,
        evidence: &[
            passes(
                "integrator::analytic::single_bright_texel_lights_a_plane_by_its_reconstruction",
            ),
            line(
                "integrator::strategies::sun_in_a_map_behind_an_occluder",
                "BsdfOnly",
            ),
            passes(
                "etendue::render::environment::tests::every_direction_with_light_has_a_density_unless_scattering_finds_it",
            ),
        ],
    },
    Case {
        id: "F7",
        what: "Poles and seam of a map",
        expected: "uniform map: E = πL within 1e-4, six orientations",
        verdict: Wider("2 % in the gate, 0.2 % at night, by chance"),
        evidence: &[
            line(
                "shading::environment::every_direction_finds_its_place",
                "environment_uv",
            ),
            line(
                "shading::environment::directions_have_their_density",
                "environment:",
            ),
            largest("stability::light::uniform_maps_have_no_poles", "off by"),
        ],
    },
    Case {
        id: "F8",
        what: "Many lamps, lamps without power",
        expected: "1e4 (at night 1e5) lamps, half of them dark: E right within 3 %",
        verdict: Wider("1e4 lamps within 3 %, with chance"),
        evidence: &[
            line(
                "shading::lights::lights_are_chosen_as_often_as_their_table_says",
                "choice of lights",
            ),
            passes("etendue::render::lights::tests::alias_table_reproduces_the_weights"),
            line("stability::light::many_lamps_half_of_them_dark", "lamps"),
        ],
    },
    Case {
        id: "F9",
        what: "Black map, no lamp: 0/0",
        expected: "exactly 0",
        verdict: Holds,
        evidence: &[
            passes("etendue::render::environment::tests::a_black_map_is_none"),
            line("stability::light::without_light_it_is_dark", "dark"),
        ],
    },
    Case {
        id: "F10",
        what: "Negative, NaN or infinite emission",
        expected: "an error",
        verdict: Holds,
        evidence: &[
            passes("loader::shading::broken_environments_are_refused"),
            passes("loader::broken_shading::broken_materials_and_textures_are_refused"),
            passes("loader::world::broken_lights_are_refused"),
        ],
    },
];
