//! Interfaces, solids, media.

use crate::Mutant;

pub const MUTANTS: &[Mutant] = &[
    Mutant {
        name: "control-swap-p-s",
        wrong: "r_p and r_s swapped: their mean is the same",
        file: "shaders/dielectric.glsl",
        edits: &[(
            "0.5 * (r_s * r_s + r_p * r_p)",
            "0.5 * (r_p * r_p + r_s * r_s)",
        )],
        killers: &[
            "shading::fresnel::fresnel_is_exact_from_one_index_to_millions",
            "shading::interface::sheets_and_weak_reflection_share_all_power",
            "matter::slab::thin_sheet_is_a_plate_without_absorption",
            "matter::cube::glass_cube_may_have_any_size_and_place",
        ],
    },
    Mutant {
        name: "interface-mirror-cosine",
        wrong: "reflection by an interface × cosθ (the seed's 14 and 15)",
        file: "shaders/dielectric.glsl",
        edits: &[(
            "result.weight = split.r / split.p_reflect;",
            "result.weight = split.r / split.p_reflect * wo.z;",
        )],
        killers: &["shading::interface::smooth_interfaces_refract_by_snell_and_lose_nothing"],
    },
    Mutant {
        name: "transmission-cosines",
        wrong: "transmission × cosθt/cosθi (the seed's 19 and 20)",
        file: "shaders/dielectric.glsl",
        edits: &[(
            "result.wi = dielectric_refract(d.eta, wo, m, split.g);",
            "result.wi = dielectric_refract(d.eta, wo, m, split.g);\n        result.weight *= split.g / (d.eta * dot(wo, m));",
        )],
        killers: &[
            "shading::interface::smooth_interfaces_refract_by_snell_and_lose_nothing",
            "matter::cube::glass_cube_may_have_any_size_and_place",
        ],
    },
    Mutant {
        name: "no-n-squared",
        wrong: "radiance without n²",
        file: "shaders/path.glsl",
        edits: &[(
            "            path.scale = square(path.camera_ior / interior_ior(boundary.after));",
            "            path.scale = 1.0;",
        )],
        killers: &["matter::cube::glass_cube_may_have_any_size_and_place"],
    },
    Mutant {
        name: "n-squared-inverted",
        wrong: "radiance × 1/n² instead of n²",
        file: "shaders/path.glsl",
        edits: &[(
            "            path.scale = square(path.camera_ior / interior_ior(boundary.after));",
            "            path.scale = square(interior_ior(boundary.after) / path.camera_ior);",
        )],
        killers: &["matter::cube::glass_cube_may_have_any_size_and_place"],
    },
    Mutant {
        name: "p-only",
        wrong: "Fresnel's equations without the s term",
        file: "shaders/dielectric.glsl",
        edits: &[("0.5 * (r_s * r_s + r_p * r_p)", "r_p * r_p")],
        killers: &["shading::fresnel::fresnel_is_exact_from_one_index_to_millions"],
    },
    Mutant {
        name: "schlick-for-glass",
        wrong: "Schlick's approximation at interfaces",
        file: "shaders/dielectric.glsl",
        edits: &[(
            "    if (r < 0.5) {",
            "    float f0 = square((eta - 1.0) / (eta + 1.0));\n    r = f0 + (1.0 - f0) * pow(1.0 - (eta < 1.0 ? g / eta : c), 5.0);\n    if (r < 2.0) {",
        )],
        killers: &["shading::fresnel::fresnel_is_exact_from_one_index_to_millions"],
    },
    Mutant {
        name: "no-total-reflection",
        wrong: "total reflection is not asked for",
        file: "shaders/dielectric.glsl",
        edits: &[
            (
                "if (eta == IOR_INFINITE || g2 <= 0.0) {",
                "if (eta == IOR_INFINITE) {",
            ),
            ("float g = sqrt(g2);", "float g = sqrt(abs(g2));"),
        ],
        killers: &["shading::fresnel::total_reflection_begins_without_a_jump"],
    },
    Mutant {
        name: "inside-out",
        wrong: "the index of an interface is inverted",
        file: "shaders/interior.glsl",
        edits: &[(
            "IOR_INFINITE : after / before;",
            "IOR_INFINITE : before / after;",
        )],
        killers: &["matter::gradient::face_of_a_block_shows_the_refracted_sky"],
    },
    Mutant {
        name: "thin-single-face",
        wrong: "a thin sheet reflects once only, not between its faces",
        file: "shaders/dielectric.glsl",
        edits: &[
            ("f.r = 2.0 * f.r * sum;", "f.r *= 1.0;"),
            ("f.t *= sum;", "f.t *= 1.0;"),
        ],
        killers: &["shading::interface::sheets_and_weak_reflection_share_all_power"],
    },
    Mutant {
        name: "refraction-jacobian",
        wrong: "rough refraction without η² in its Jacobian",
        file: "shaders/dielectric.glsl",
        edits: &[(
            "float jacobian = d.eta * d.eta * -cos_i / (root * root);",
            "float jacobian = -cos_i / (root * root);",
        )],
        killers: &["shading::interface::rough_interfaces_have_walters_values_both_ways"],
    },
    Mutant {
        name: "refraction-masking",
        wrong: "rough refraction without shadowing",
        file: "shaders/dielectric.glsl",
        edits: &[(
            "f_cos = share * (visible * dielectric_masking(-wi.z, d.alpha) * jacobian);",
            "f_cos = share * (visible * jacobian);",
        )],
        killers: &["shading::interface::rough_interfaces_have_walters_values_both_ways"],
    },
    Mutant {
        name: "nested-index-one",
        wrong: "a solid in a solid is met as from vacuum",
        file: "shaders/interior.glsl",
        edits: &[(
            "IOR_INFINITE : after / before;",
            "IOR_INFINITE : (b.before != NONE && b.after != NONE ? after : after / before);",
        )],
        killers: &["matter::nested::liquid_between_panes_does_not_depend_on_the_overlap"],
    },
    Mutant {
        name: "priority-ignored",
        wrong: "the solid that was entered first fills the space",
        file: "shaders/interior.glsl",
        edits: &[(
            "        if (other > rank) {",
            "        if (highest == NONE) {",
        )],
        killers: &["matter::nested::inner_solids_fill_the_space_by_default"],
    },
    Mutant {
        name: "edge-unasked",
        wrong: "where solids touch, what a short search says of the faces beside an edge is believed",
        file: "shaders/interior.glsl",
        edits: &[(
            "    if (interior_find(s, d, fits, rays)) {",
            "    if (interior_find(s, d, fits, rays) && false) {",
        )],
        killers: &["stability::numbers::rays_along_edges_know_what_they_are_in"],
    },
    Mutant {
        name: "rayleigh-norm",
        wrong: "Rayleigh's phase function without 3/16π",
        file: "shaders/medium.glsl",
        edits: &[(
            "return 3.0 / (16.0 * PI) * (1.0 + cosine * cosine);",
            "return 1.0 + cosine * cosine;",
        )],
        killers: &[
            "shading::phase::phase_values_are_normalised",
            "matter::scatter::thin_layer_scatters_sunlight_once",
        ],
    },
    Mutant {
        name: "rayleigh-square",
        wrong: "Rayleigh's coefficient ∝ ω² instead of ω⁴ (the seed's 23)",
        file: "src/scene/gltf/medium.rs",
        edits: &[],
        killers: &["loader::media::media_are_read_with_their_defaults"],
    },
    Mutant {
        name: "phase-value-sign",
        wrong: "Henyey–Greenstein's value with g inverted",
        file: "shaders/medium.glsl",
        edits: &[(
            "m.g < 0.0 ? d + wi : d - wi;",
            "m.g < 0.0 ? d - wi : d + wi;",
        )],
        killers: &["shading::phase::directions_have_the_density_of_their_phase_about_every_axis"],
    },
    Mutant {
        name: "phase-sample-sign",
        wrong: "Henyey–Greenstein's sample with g inverted",
        file: "shaders/medium.glsl",
        edits: &[(
            "away = m.g < 0.0 ? 2.0 - away : away;",
            "away = m.g < 0.0 ? away : 2.0 - away;",
        )],
        killers: &["shading::phase::directions_have_the_moments_of_their_phase"],
    },
    Mutant {
        name: "phase-pdf",
        wrong: "the density of every phase function is 1/4π",
        file: "shaders/path.glsl",
        edits: &[(
            "path.pdf = phase_value(medium, d, path.ray.direction);",
            "path.pdf = 0.25 * INV_PI;",
        )],
        killers: &["matter::closed::white_fog_is_invisible_in_a_white_map"],
    },
    Mutant {
        name: "absorption-scattering",
        wrong: "σa and σs swapped",
        file: "shaders/medium.glsl",
        edits: &[(
            "? m.sigma_s * relative / dot(",
            "? (m.sigma_t - m.sigma_s) * relative / dot(",
        )],
        killers: &["shading::media::chromatic_flights_have_the_means_of_each_channel"],
    },
    Mutant {
        name: "absorption-forgotten",
        wrong: "scattered light is not weakened by the albedo",
        file: "shaders/medium.glsl",
        edits: &[(
            "? m.sigma_s * relative / dot(",
            "? m.sigma_t * relative / dot(",
        )],
        killers: &["shading::media::chromatic_flights_have_the_means_of_each_channel"],
    },
    Mutant {
        name: "channel-alone",
        wrong: "the density of a distance is not averaged over the channels",
        file: "shaders/medium.glsl",
        edits: &[
            (
                "? m.sigma_s * relative / dot(channels, m.sigma_t * relative)",
                "? m.sigma_s / max(m.sigma_t, vec3(1.0e-30))",
            ),
            (": relative / dot(channels, relative);", ": vec3(1.0);"),
        ],
        killers: &["shading::media::chromatic_flights_have_the_means_of_each_channel"],
    },
    Mutant {
        name: "beer-decadic",
        wrong: "absorption by powers of ten, not of e",
        file: "shaders/medium.glsl",
        edits: &[(
            "precise vec3 depth = m.sigma_t * distance;",
            "precise vec3 depth = m.sigma_t * distance * 2.302585;",
        )],
        killers: &["shading::media::transmittance_is_beers_over_the_range_of_numbers"],
    },
    Mutant {
        name: "beer-forgotten",
        wrong: "absorbing media let everything through",
        file: "shaders/path.glsl",
        edits: &[(
            "path.beta *= medium_transmittance(medium, end);",
            "path.beta *= 1.0;",
        )],
        killers: &["matter::slab::medium_without_an_interface_absorbs_by_the_law"],
    },
    Mutant {
        name: "shadow-transmittance",
        wrong: "direct light is not absorbed on its way",
        file: "shaders/direct.glsl",
        edits: &[(
            "return HAS_MEDIA ? s.value * medium_transmittance(scene_medium(s.interior.current), s.t_max) : s.value;",
            "return s.value;",
        )],
        killers: &["matter::fog::point_light_in_absorbing_fog"],
    },
    Mutant {
        name: "walk-transmittance",
        wrong: "the same, on the way through boundaries",
        file: "shaders/path.glsl",
        edits: &[(
            "path.shadow.value *= medium_transmittance(scene_medium(path.shadow.interior.current), end);",
            "path.shadow.value *= 1.0;",
        )],
        killers: &["matter::fog::single_scattering_of_a_point_light"],
    },
    Mutant {
        name: "straight-unfiltered",
        wrong: "direct light passes sheets without loss",
        file: "shaders/dielectric.glsl",
        edits: &[("return dielectric_split(d, c).t;", "return vec3(1.0);")],
        killers: &["matter::lamps::lamp_behind_a_pane"],
    },
    Mutant {
        name: "equiangular-twice",
        wrong: "light along a segment is counted by both ways of drawing distances",
        file: "shaders/direct.glsl",
        edits: &[(
            "weight = 1.0 / (1.0 / weight + equiangular * equiangular);",
            "weight *= 1.0;",
        )],
        killers: &["matter::fog::single_scattering_of_a_point_light"],
    },
    Mutant {
        name: "equiangular-density",
        wrong: "equiangular density without its distance",
        file: "shaders/medium.glsl",
        edits: &[(
            "? e.apart / (angle * (e.apart * e.apart + from * from)) : 0.0;",
            "? 1.0 / (angle * (e.apart * e.apart + from * from)) : 0.0;",
        )],
        killers: &["shading::media::approaches_to_a_light_have_their_density"],
    },
    Mutant {
        name: "equiangular-cone",
        wrong: "a spot's light along a segment is asked for in half of its cone",
        file: "shaders/medium.glsl",
        edits: &[(
            "acos(smaller(cos_cone / reach, 1.0)) +",
            "0.5 * acos(smaller(cos_cone / reach, 1.0)) +",
        )],
        killers: &[
            "shading::media::approaches_to_a_spot_cover_its_cone",
            "matter::fog::single_scattering_of_many_spots",
        ],
    },
    Mutant {
        name: "segment-beam",
        wrong: "the tree of lights asks of a segment in a spot's cone for its ends alone",
        file: "shaders/light_tree.glsl",
        edits: &[("a > 0.0 ? vec2(limited(b * c / a, x.x, x.y)) : x;", "x;")],
        killers: &["matter::fog::single_scattering_of_many_spots"],
    },
    Mutant {
        name: "segment-share",
        wrong: "of light along a segment and light at its end one is followed, but counts for itself alone",
        file: "shaders/path.glsl",
        edits: &[
            ("path.shadow.value /= 1.0 - share;", ""),
            ("value /= share;", ""),
        ],
        killers: &["matter::fog::single_scattering_of_a_point_light"],
    },
];
