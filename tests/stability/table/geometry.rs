//! Geometry, rays, acceleration structures.

use crate::Verdict::*;
use crate::{Case, largest, line, passes};

/// A.
pub const CASES: &[Case] = &[
    Case {
        id: "A1",
        what: "Self-intersection at coordinates of 1e6: an offset of 256 ulp is 16 units there",
        expected: "0 re-hits of spawned rays at scales 1e-6 … 1e6 (1e7 at night)",
        verdict: Holds,
        evidence: &[
            line(
                "traversal::furnace::convex_solids_do_not_meet_themselves",
                "bvh:",
            ),
            passes("traversal::furnace::lit_sides_are_not_in_their_own_shadow"),
            passes("traversal::gap::plates_cast_shadows_through_thin_gaps"),
            line(
                "stability::scales::rays_leave_random_solids_of_all_scales",
                "Bvh:",
            ),
            line(
                "stability::scales::rays_leave_random_solids_of_all_scales",
                "RayQuery:",
            ),
        ],
    },
    Case {
        id: "A2",
        what: "Self-intersection at 1e-6: the same offset is 15 times the object",
        expected: "glass cube at 10^k, k = −6 … 6: the same picture to 1e-5",
        verdict: Holds,
        evidence: &[
            passes("matter::cube::glass_cube_may_have_any_size_and_place"),
            largest(
                "stability::scales::pictures_do_not_depend_on_scale_and_place",
                "largest deviation",
            ),
        ],
    },
    Case {
        id: "A3",
        what: "Hit points by weighted corners or o + t·d leave the plane by 0.1 at 1e6",
        expected: "edge form; points within 2 ulp of the plane",
        verdict: Wider(
            "shown by what it is for, rays that leave surfaces at all scales, and not as a residual",
        ),
        evidence: &[
            line(
                "stability::scales::rays_leave_random_solids_of_all_scales",
                "Bvh:",
            ),
            passes("traversal::gap::plates_cast_shadows_through_thin_gaps"),
        ],
    },
    Case {
        id: "A4",
        what: "An offset along the ray stays below the surface at grazing",
        expected: "grey and white planes seen at 89.9°: their albedo within 1e-4",
        verdict: Holds,
        evidence: &[largest(
            "stability::scales::planes_at_grazing_keep_their_albedo",
            "off by",
        )],
    },
    Case {
        id: "A5",
        what: "Edges and vertices leak: naive tests miss 5 % of rays at shared edges",
        expected: "0 misses of 1e7 rays for each traversal (at night)",
        verdict: Holds,
        evidence: &[
            passes("etendue::bvh::watertight::no_gaps_at_edges_and_vertices_in_ten_million_rays"),
            line(
                "traversal::watertight::closed_meshes_have_no_gaps",
                "all of bvh:",
            ),
            line(
                "traversal::watertight::closed_meshes_have_no_gaps",
                "all of ray-query:",
            ),
            line(
                "traversal::watertight::closed_meshes_have_no_gaps",
                "all of ray-pipeline:",
            ),
            line(
                "traversal::watertight::closed_meshes_have_no_gaps",
                "all of ray-query, triangles",
            ),
        ],
    },
    Case {
        id: "A6",
        what: "Edges between instances: no promise at all",
        expected: "the rate is reported, no crash",
        verdict: Holds,
        evidence: &[
            line(
                "stability::placement::edges_between_instances_leak_little",
                "Bvh",
            ),
            line(
                "stability::placement::edges_between_instances_leak_little",
                "RayQuery",
            ),
        ],
    },
    Case {
        id: "A7",
        what: "Triangles without area, indices twice",
        expected: "a mesh with half of them degenerate = the mesh without, to the bit",
        verdict: Holds,
        evidence: &[
            passes(
                "loader::geometry::degenerate_triangles_are_dropped_and_unused_vertices_with_them",
            ),
            passes("etendue::bvh::tests::degenerate_sets_are_built_and_never_lost"),
            largest(
                "stability::degenerate::triangles_without_area_change_nothing",
                "differ by",
            ),
        ],
    },
    Case {
        id: "A8",
        what: "Coincident triangles: parity of glass, flicker",
        expected: "a glass cube with one face twice is the glass cube, or a warning",
        verdict: Holds,
        evidence: &[largest(
            "stability::degenerate::a_face_that_is_there_twice_keeps_its_parity",
            "off",
        )],
    },
    Case {
        id: "A9",
        what: "NaN in a vertex: undefined behaviour in y and z",
        expected: "an error for each component, no validation message",
        verdict: Holds,
        evidence: &[
            passes("loader::broken::broken_numbers_are_refused"),
            passes("etendue::bvh::tests::bad_coordinates_are_refused"),
            line(
                "stability::degenerate::vertices_that_are_no_numbers_are_refused",
                "refused",
            ),
        ],
    },
    Case {
        id: "A10",
        what: "Infinite and 1e38 coordinates: overflow of bounds and squares",
        expected: "an error beyond 1e18 m",
        verdict: Holds,
        evidence: &[
            passes("loader::broken::broken_numbers_are_refused"),
            line(
                "stability::degenerate::vertices_that_are_no_numbers_are_refused",
                "refused",
            ),
        ],
    },
    Case {
        id: "A11",
        what: "Rays with NaN, infinite or zero directions",
        expected: "no hang, no crash, no hit",
        verdict: Wider(
            "met nothing on lavapipe; another driver may do as it likes with a ray query of NaN, and nothing counts such rays",
        ),
        evidence: &[line(
            "stability::degenerate::rays_that_are_none_meet_nothing",
            "RayQuery",
        )],
    },
    Case {
        id: "A12",
        what: "t_min < 0, t_min > t_max, −0",
        expected: "clamped: no validation message, no hit outside",
        verdict: Holds,
        evidence: &[
            line(
                "stability::degenerate::bounds_of_rays_are_open_and_kept",
                "RayQuery",
            ),
            line(
                "stability::degenerate::bounds_of_rays_are_open_and_kept",
                "Bvh",
            ),
        ],
    },
    Case {
        id: "A13",
        what: "Committed data read without a hit: null pointer in lavapipe",
        expected: "a scene of misses on all traversals",
        verdict: Holds,
        evidence: &[
            passes("traversal::table::nothing_and_one_triangle"),
            passes("gpu::rays::empty_scenes_are_missed"),
        ],
    },
    Case {
        id: "A14",
        what: "Unit of t, and its open interval",
        expected: "hits strictly inside (t_min, t_max), to one ulp",
        verdict: Holds,
        evidence: &[line(
            "stability::degenerate::bounds_of_rays_are_open_and_kept",
            "Bvh",
        )],
    },
    Case {
        id: "A15",
        what: "Directions drift over many mirrors",
        expected: "10⁴ mirrors: directions within 1e-6",
        verdict: Wider("500 mirrors; beyond 256 roulette thins the paths, so that few meet 10⁴"),
        evidence: &[
            line(
                "stability::placement::directions_survive_many_mirrors",
                "500",
            ),
            line(
                "stability::placement::directions_survive_many_mirrors",
                "1000",
            ),
        ],
    },
    Case {
        id: "A16",
        what: "Negative scale turns facing around",
        expected: "mirrored glass = glass, copied and as an instance, within 0.5 %",
        verdict: Wider("0.5 %, with chance, instead of the same bits"),
        evidence: &[
            passes("loader::world::hierarchy_mirrors_and_shares_meshes"),
            largest("stability::placement::mirrored_glass_is_glass", "off"),
        ],
    },
    Case {
        id: "A17",
        what: "Singular or zero scale",
        expected: "left out with a warning, the rest of the scene the same",
        verdict: Holds,
        evidence: &[passes("loader::world::flattened_instances_are_left_out")],
    },
    Case {
        id: "A18",
        what: "Non-uniform scale: normals, areas of emitters",
        expected: "ellipsoid light = the same mesh transformed before; power π L A",
        verdict: Wider("1.5 %, at night 0.3 %, by chance; flux is measured in `measure`"),
        evidence: &[
            passes("integrator::normals::stretched_meshes_keep_their_normals"),
            largest(
                "stability::placement::stretched_lamps_are_what_they_look_like",
                "off",
            ),
            passes("measure::intensity_and_flux_of_a_square_lamp"),
        ],
    },
    Case {
        id: "A19",
        what: "Deep hierarchies: error of products",
        expected: "1000 nodes R·R⁻¹: 1e-6",
        verdict: Holds,
        evidence: &[largest(
            "loader::world::deep_hierarchies_keep_their_place",
            "off by",
        )],
    },
    Case {
        id: "A20",
        what: "More than 2²⁴ instances or primitives wrap",
        expected: "limits are errors with the figure",
        verdict: Holds,
        evidence: &[passes("gpu::buffers::limits_are_errors_with_the_figure")],
    },
    Case {
        id: "A21",
        what: "Very distant cameras",
        expected: "telephoto from 10^k radii away: 1 % to 10⁵, and measured beyond",
        verdict: Holds,
        evidence: &[
            line(
                "stability::placement::distant_cameras_see_what_parallel_rays_see",
                "10^4",
            ),
            line(
                "stability::placement::distant_cameras_see_what_parallel_rays_see",
                "10^5",
            ),
            line(
                "stability::placement::distant_cameras_see_what_parallel_rays_see",
                "10^6",
            ),
            line(
                "stability::placement::distant_cameras_see_what_parallel_rays_see",
                "10^7",
            ),
        ],
    },
    Case {
        id: "A22",
        what: "Triangles seen edge-on",
        expected: "camera in the plane of a square: finite, the square invisible",
        verdict: Holds,
        evidence: &[line(
            "stability::degenerate::squares_seen_edge_on_are_not_there",
            "Bvh",
        )],
    },
    Case {
        id: "A23",
        what: "A ray leaves a medium through a skipped face and wanders for ever",
        expected: "paths that are trapped in glass: none of 1e8 segments (at night) gets out",
        verdict: Holds,
        evidence: &[
            passes("matter::cube::glass_cube_may_have_any_size_and_place"),
            line(
                "stability::scales::closed_rooms_are_dark_under_a_sun",
                "edge:",
            ),
            line(
                "stability::scales::closed_rooms_are_dark_under_a_sun",
                "room:",
            ),
            line("stability::scales::paths_in_glass_keep_their_side", "Bvh"),
            line(
                "stability::scales::paths_in_glass_keep_their_side",
                "RayQuery",
            ),
        ],
    },
];
