//! Surfaces, light sources, textures, the camera.

use crate::Mutant;

pub const MUTANTS: &[Mutant] = &[
    Mutant {
        name: "emitter-radiance-cosine",
        wrong: "radiance of an emitter × cosθ (the seed's 6)",
        file: "shaders/surface.glsl",
        edits: &[(
            "        s.emission = surface_emission(material, triangle, hit.bary);",
            "        s.emission = dot(s.ng, wo) * surface_emission(material, triangle, hit.bary);",
        )],
        killers: &["integrator::emission::radiance_of_an_emitter_is_the_same_from_everywhere"],
    },
    Mutant {
        name: "emitter-density-cosine",
        wrong: "light's density without the emitter's cosθ (the seed's 6)",
        file: "shaders/lights.glsl",
        edits: &[(
            "s.pdf = choice * density * distance2 / abs(cosine);",
            "s.pdf = choice * density * distance2;",
        )],
        killers: &["shading::lights::emissive_triangles_are_sampled_by_area"],
    },
    Mutant {
        name: "emitter-found-cosine",
        wrong: "the same, where scattering found the emitter",
        file: "shaders/lights.glsl",
        edits: &[(
            "? pdf_area * distance2 / cosine : 0.0;",
            "? pdf_area * distance2 : 0.0;",
        )],
        killers: &["integrator::strategies::lambert_room_with_a_quad_light"],
    },
    Mutant {
        name: "direction-flipped",
        wrong: "emitters shine from their backs (the seed's 24)",
        file: "shaders/surface.glsl",
        edits: &[("!= 0u && (s.is_front ||", "!= 0u && (!s.is_front ||")],
        killers: &["integrator::emission::only_the_front_emits_unless_double_sided"],
    },
    Mutant {
        name: "light-flipped",
        wrong: "direct light from the backs of emitters",
        file: "shaders/lights.glsl",
        edits: &[(
            "bool is_lit = cosine > 0.0 || (cosine < 0.0 &&",
            "bool is_lit = cosine < 0.0 || (cosine > 0.0 &&",
        )],
        killers: &["shading::lights::emissive_triangles_are_sampled_by_area"],
    },
    Mutant {
        name: "mirror-cosine",
        wrong: "a mirror's weight × cosθ (the seed's 14 and 15)",
        file: "shaders/bsdf.glsl",
        edits: &[(
            "result.weight = fresnel_schlick(b.f0, b.f90, wo.z) *",
            "result.weight = wo.z * fresnel_schlick(b.f0, b.f90, wo.z) *",
        )],
        killers: &["shading::samplers::mirrors_reflect_what_fresnel_says"],
    },
    Mutant {
        name: "wrong-density",
        wrong: "a sample is divided by another sampler's density (the seed's 31)",
        file: "shaders/bsdf.glsl",
        edits: &[(
            "result.weight = result.is_valid ? v.f_cos / v.pdf : vec3(0.0);",
            "result.weight = result.is_valid ? v.f_cos / (abs(result.wi.z) * INV_PI) : vec3(0.0);",
        )],
        killers: &["shading::samplers::metal_has_its_density_and_albedo"],
    },
    Mutant {
        name: "lobe-probability",
        wrong: "the density leaves out the choice of the lobe",
        file: "shaders/bsdf.glsl",
        edits: &[(
            "v.pdf += b.p_specular * ggx_pdf(wo.z, m, b.alpha);",
            "v.pdf += ggx_pdf(wo.z, m, b.alpha);",
        )],
        killers: &["shading::samplers::coated_diffuse_has_its_density_and_albedo"],
    },
    Mutant {
        name: "surface-cosine",
        wrong: "Lambert's surface without cosθ",
        file: "shaders/bsdf.glsl",
        edits: &[(
            "v.f_cos = bsdf_diffuse(b, wo.z, wi.z) * wi.z;",
            "v.f_cos = bsdf_diffuse(b, wo.z, wi.z);",
        )],
        killers: &["shading::values::lambert_is_right_and_reciprocal"],
    },
    Mutant {
        name: "lambert-pi",
        wrong: "Lambert's surface without 1/π",
        file: "shaders/bsdf.glsl",
        edits: &[("return b.diffuse * INV_PI;", "return b.diffuse;")],
        killers: &["shading::values::lambert_is_right_and_reciprocal"],
    },
    Mutant {
        name: "hemisphere-uniform",
        wrong: "cosine-weighted directions drawn uniformly",
        file: "shaders/sampling.glsl",
        edits: &[
            (
                "float r = sqrt(u.y);",
                "float r = sqrt(1.0 - square(1.0 - u.y));",
            ),
            ("sqrt(1.0 - u.y));", "1.0 - u.y);"),
        ],
        killers: &["shading::samplers::warps_of_the_square_have_their_density"],
    },
    Mutant {
        name: "triangle-corner",
        wrong: "points of a triangle crowd at a corner",
        file: "shaders/sampling.glsl",
        edits: &[("float r = sqrt(u.x);", "float r = u.x;")],
        killers: &["shading::samplers::warps_of_the_square_have_their_density"],
    },
    Mutant {
        name: "alpha-not-squared",
        wrong: "roughness used as α",
        file: "shaders/bsdf.glsl",
        edits: &[(
            "float alpha = s.roughness * s.roughness;",
            "float alpha = s.roughness;",
        )],
        killers: &["shading::values::coats_and_metals_are_right_and_reciprocal"],
    },
    Mutant {
        name: "ggx-naive",
        wrong: "GGX's D in the form that cancels",
        file: "shaders/microfacet.glsl",
        edits: &[(
            "    float stretched = (m.x * m.x + m.y * m.y) / (alpha * alpha) + m.z * m.z;",
            "    float k = (alpha * alpha - 1.0) * m.z * m.z + 1.0;\n    return alpha * alpha / (PI * k * k);\n    float stretched = 1.0;",
        )],
        killers: &["shading::values::microfacet_functions_match_the_formulas"],
    },
    Mutant {
        name: "ggx-density",
        wrong: "visible normals' density without masking",
        file: "shaders/microfacet.glsl",
        edits: &[(
            "return ggx_d(m, alpha) * 0.5 / (cos_o + ggx_root(cos_o, alpha));",
            "return ggx_d(m, alpha) * 0.25 / cos_o;",
        )],
        killers: &["shading::values::microfacet_functions_match_the_formulas"],
    },
    Mutant {
        name: "schlick-fourth",
        wrong: "Schlick's power is four",
        file: "shaders/microfacet.glsl",
        edits: &[("(m2 * m2 * m);", "(m2 * m2);")],
        killers: &["shading::values::fresnel_matches_schlick"],
    },
    Mutant {
        name: "coat-uncoupled",
        wrong: "the base is not weakened by the coat",
        file: "shaders/bsdf.glsl",
        edits: &[(
            "bsdf_coat_transmission(b, cos_o) * bsdf_coat_transmission(b, cos_i) / base);",
            "base / base);",
        )],
        killers: &["shading::values::coats_and_metals_are_right_and_reciprocal"],
    },
    Mutant {
        name: "inverse-transpose",
        wrong: "normals carried like directions",
        file: "shaders/surface.glsl",
        edits: &[(
            "return vec3(dot(placed.object_from_world_x, n), dot(placed.object_from_world_y, n), dot(placed.object_from_world_z, n));",
            "return mat3(placed.world_from_object_x, placed.world_from_object_y, placed.world_from_object_z) * n;",
        )],
        killers: &["integrator::normals::stretched_meshes_keep_their_normals"],
    },
    Mutant {
        name: "shading-side",
        wrong: "the side of a direction is asked of the shading normal",
        file: "shaders/path.glsl",
        edits: &[(
            "float side = dot(path.ray.direction, s.ng);",
            "float side = dot(path.ray.direction, s.ns);",
        )],
        killers: &["integrator::normals::light_below_the_surface_is_lost"],
    },
    Mutant {
        name: "offset-none",
        wrong: "rays leave without an offset",
        file: "shaders/math.glsl",
        edits: &[(
            "return p + unit_side * dot(abs(unit_side), error);",
            "return p;",
        )],
        killers: &["traversal::furnace::convex_solids_do_not_meet_themselves"],
    },
    Mutant {
        name: "offset-huge",
        wrong: "rays leave with 10⁴ offsets",
        file: "shaders/math.glsl",
        edits: &[(
            "return p + unit_side * dot(abs(unit_side), error);",
            "return p + 1.0e4 * unit_side * dot(abs(unit_side), error);",
        )],
        killers: &["traversal::gap::inside_of_the_gap_is_dark"],
    },
    Mutant {
        name: "shadow-end",
        wrong: "the bound on the error of a shadow ray's end leaves out its length",
        file: "shaders/lights.glsl",
        edits: &[(" + abs(light.edge2) + abs(to);", " + abs(light.edge2);")],
        killers: &["integrator::analytic::far_lamps_are_not_in_their_own_shadow"],
    },
    Mutant {
        name: "planes-edge",
        wrong: "flat pieces of small scenes are surely met beside their edges, too",
        file: "shaders/traverse_planes.glsl",
        edits: &[("reach < bound - edge &&", "reach < bound + edge &&")],
        killers: &["traversal::planes::few_flat_pieces_are_met_as_in_the_tree"],
    },
    Mutant {
        name: "planes-axis",
        wrong: "flat pieces across the x axis have the y axis as their normal",
        file: "shaders/traverse_planes.glsl",
        edits: &[("uvec3(only_x, only_y,", "uvec3(only_y, only_x,")],
        killers: &["traversal::planes::few_flat_pieces_are_met_as_in_the_tree"],
    },
    Mutant {
        name: "edge-open",
        wrong: "what meets an edge of a triangle exactly misses it",
        file: "shaders/shear.glsl",
        edits: &[(
            "smaller(edges.x, edges.y)) >= 0.0 || larger(edges.z, larger(edges.x, edges.y)) <= 0.0",
            "smaller(edges.x, edges.y)) > 0.0 || larger(edges.z, larger(edges.x, edges.y)) < 0.0",
        )],
        killers: &["traversal::watertight::closed_meshes_have_no_gaps"],
    },
    Mutant {
        name: "offset-small",
        wrong: "the bound on a hit point's error is 160 times too small",
        file: "shaders/surface.glsl",
        edits: &[(
            "const float POSITION_ROUNDINGS = 8.0;",
            "const float POSITION_ROUNDINGS = 0.05;",
        )],
        killers: &[
            "traversal::furnace::convex_solids_do_not_meet_themselves",
            "integrator::furnace::lambert_sphere_vanishes_in_the_furnace",
        ],
    },
    Mutant {
        name: "edge-places",
        wrong: "rays do not start within their triangles",
        file: "shaders/surface.glsl",
        edits: &[("return moved == weights ?", "return weights == weights ?")],
        killers: &["stability::scales::closed_rooms_are_dark_under_a_sun"],
    },
    Mutant {
        name: "cut-out-ignored",
        wrong: "cut-outs are solid",
        file: "shaders/surface.glsl",
        edits: &[(
            "return surface_base_color(material, triangle, bary).a < material.alpha_cutoff;",
            "return false;",
        )],
        killers: &["traversal::table::alpha_mask_on_and_off"],
    },
    Mutant {
        name: "coverage-shadow",
        wrong: "partial coverage blocks all direct light",
        file: "shaders/path.glsl",
        edits: &[(
            ": 1.0 - s.alpha + s.alpha * bsdf_straight(bsdf, cosine);",
            ": s.alpha * bsdf_straight(bsdf, cosine);",
        )],
        killers: &["integrator::strategies::pane_and_cut_out_under_a_quad_light"],
    },
    Mutant {
        name: "srgb-not-linear",
        wrong: "sRGB texels are taken as linear",
        file: "shaders/texture.glsl",
        edits: &[(
            "return uintBitsToFloat(texelFetch(texels, int(byte)).x);",
            "return float(byte) / 255.0;",
        )],
        killers: &["shading::lookups::textures_are_wrapped_filtered_and_decoded"],
    },
    Mutant {
        name: "filter-off",
        wrong: "textures are read half a texel off",
        file: "shaders/texture.glsl",
        edits: &[("    at -= 0.5;", "    at -= 0.0;")],
        killers: &["shading::lookups::textures_are_wrapped_filtered_and_decoded"],
    },
    Mutant {
        name: "environment-sine",
        wrong: "the environment's density without sinθ",
        file: "shaders/environment.glsl",
        edits: &[(
            "density > 0.0 ? density / sine : 0.0;",
            "density > 0.0 ? density * 0.5 * PI : 0.0;",
        )],
        killers: &["shading::environment::directions_have_their_density"],
    },
    Mutant {
        name: "environment-nearest",
        wrong: "the environment's table does not know of the interpolation",
        file: "src/render/environment.rs",
        edits: &[],
        killers: &["etendue::render::environment::tests::cells_hold_the_integral_of_the_density"],
    },
    Mutant {
        name: "environment-run",
        wrong: "of the environment's cells in a run of places the first is always taken",
        file: "shaders/environment.glsl",
        edits: &[("while (run.x < run.y) {", "while (false) {")],
        killers: &["shading::environment::directions_have_their_density"],
    },
    Mutant {
        name: "environment-mirrored",
        wrong: "the environment left to right",
        file: "shaders/environment.glsl",
        edits: &[("0.5 + atan(x, -z) / TWO_PI", "0.5 - atan(x, -z) / TWO_PI")],
        killers: &["shading::environment::every_direction_finds_its_place"],
    },
    Mutant {
        name: "inverse-distance",
        wrong: "point lights fall with 1/d",
        file: "shaders/lights.glsl",
        edits: &[(
            "s.radiance = light.intensity / distance2;",
            "s.radiance = light.intensity * inversesqrt(distance2);",
        )],
        killers: &["integrator::punctual::point_light_obeys_the_inverse_square_and_the_cosine"],
    },
    Mutant {
        name: "spot-linear",
        wrong: "a spot's ramp is not squared",
        file: "shaders/lights.glsl",
        edits: &[(
            "s.radiance *= square(limited(ramp, 0.0, 1.0));",
            "s.radiance *= limited(ramp, 0.0, 1.0);",
        )],
        killers: &["integrator::punctual::spot_light_falls_off_between_its_cones"],
    },
    Mutant {
        name: "light-choice",
        wrong: "the density leaves out the choice of the light",
        file: "shaders/lights.glsl",
        edits: &[("s.pdf = choice * light.choice;", "s.pdf = choice;")],
        killers: &["shading::lights::lights_are_chosen_as_often_as_their_table_says"],
    },
    Mutant {
        name: "cluster-choice",
        wrong: "the density leaves out the way through the tree of lights",
        file: "shaders/lights.glsl",
        edits: &[(
            "probability = way.probability * params.tree_choice;",
            "probability = params.tree_choice;",
        )],
        killers: &["integrator::lamps::points_of_light_add_up"],
    },
    Mutant {
        name: "cluster-way",
        wrong: "the same, where scattering found the emitter",
        file: "shaders/light_tree.glsl",
        edits: &[(
            "(is_right ? importance.y : importance.x) / sum : 0.0;",
            "0.5 : 0.0;",
        )],
        killers: &["integrator::lamps::lamps_of_many_shapes"],
    },
    Mutant {
        name: "cluster-horizon",
        wrong: "where scattering found the emitter, the tree of lights is asked for the other side of the surface",
        file: "shaders/path.glsl",
        edits: &[(
            "light_view_surface(path.scattered_at, path.scattered_normal)",
            "light_view_surface(path.scattered_at, -path.scattered_normal)",
        )],
        killers: &["integrator::lamps::lamps_of_many_shapes"],
    },
    Mutant {
        name: "cluster-middle",
        wrong: "the tree of lights takes clusters for dark whose middle is below the horizon of the surface",
        file: "shaders/light_tree.glsl",
        edits: &[(
            "limited(cosine + sine + CLUSTER_SLACK, 0.0, 1.0)",
            "limited(cosine, 0.0, 1.0)",
        )],
        killers: &["integrator::lamps::points_below_the_floor_hide_none_above"],
    },
    Mutant {
        name: "cluster-beam",
        wrong: "the tree of lights takes spots for dark at 10° from their axis",
        file: "shaders/light_tree.glsl",
        edits: &[(
            "light_angle_beyond(beyond, reach).x < 1.0;",
            "cosine < 0.985;",
        )],
        killers: &["integrator::lamps::points_of_light_add_up"],
    },
    Mutant {
        name: "candidate-count",
        wrong: "where scattering found the emitter, one of several samples of lights counts for one",
        file: "shaders/path.glsl",
        edits: &[("count * pdf_light", "pdf_light")],
        killers: &["integrator::lamps::walls_of_lamps_are_counted_once"],
    },
    Mutant {
        name: "candidate-share",
        wrong: "of several samples of lights any is followed, not in proportion to what it gives",
        file: "shaders/direct.glsl",
        edits: &[(
            "float share = weight / sum;",
            "float share = 1.0 / float(k + 1);",
        )],
        killers: &["integrator::lamps::points_of_light_add_up"],
    },
    Mutant {
        name: "environment-choice",
        wrong: "the density leaves out the choice between map and lamps",
        file: "shaders/environment.glsl",
        edits: &[(
            "s.pdf = params.env_choice * environment_pdf(value.w, sine);",
            "s.pdf = environment_pdf(value.w, sine);",
        )],
        killers: &[
            "shading::environment::directions_have_their_density",
            "shading::lights::lights_are_chosen_as_often_as_their_table_says",
        ],
    },
    Mutant {
        name: "pixel-centre",
        wrong: "all rays of a pixel go through its middle",
        file: "shaders/camera.glsl",
        edits: &[("(vec2(pixel) + u.yz)", "(vec2(pixel) + 0.5)")],
        killers: &["shading::lookups::camera_rays_go_through_their_pixels"],
    },
];
