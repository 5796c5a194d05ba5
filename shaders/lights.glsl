// Direct light: choose an emitter, sample a point or direction on it, and the
// density of the same for directions that the BSDF chose. Emissive triangles and
// punctual lights share one alias table, or with HAS_LIGHT_TREE a tree, which leaves the distant
// ones to the table; the environment map is chosen beside them.
//
// [Veach97] Veach, Robust Monte Carlo Methods for Light Transport Simulation, §8.

#ifndef LIGHTS_GLSL
#define LIGHTS_GLSL

#include "environment.glsl"
#include "light_tree.glsl"
#include "surface.glsl"

// A way for light to reach a point.
struct LightSample {
    vec3 target;     // where the light is; unused when it is infinitely far
    vec3 wi;         // unit direction to it
    uint triangle;   // that emits it, in `triangles`; NONE
    bool is_infinite;
    bool is_delta;   // no BSDF sample can find it
    vec3 radiance;   // delta lights: irradiance on a surface that faces wi
    float pdf;       // per steradian, choice included; delta lights: probability of the choice; 0: no light
};

// Density per steradian at which direct light would have sampled a point of an
// emissive triangle that the BSDF found, `distance2` away, for a view.
float light_triangle_pdf(SurfacePoint s, vec3 wo, float distance2, LightView view)
{
    float pdf_area = s.emission_pdf;
    if (HAS_LIGHT_TREE) {
        pdf_area *= params.tree_choice * light_tree_density(view, s.placement, s.triangle);
    } else {
        pdf_area = params.table_choice * (params.light_uniform > 0.0 ? params.light_uniform / s.area : pdf_area);
    }
    float cosine = abs(dot(s.ng, wo));
    return cosine > 0.0 ? pdf_area * distance2 / cosine : 0.0;
}

// `choice` is the probability of the list that the light is in.
LightSample light_sample_triangle(Light light, vec3 from, vec2 u, float choice)
{
    LightSample s;
    s.pdf = 0.0;
    s.triangle = light.triangle;
    s.is_infinite = false;
    s.is_delta = false;
    vec2 bary = sample_triangle(u);
    vec3 point = light.position + bary.x * light.edge1 + bary.y * light.edge2;
    vec3 to = point - from;
    float distance2 = dot(to, to);
    vec3 cross_edges = cross(light.edge1, light.edge2);
    float doubled_area = length(cross_edges);
    vec3 front = ((light.material & LIGHT_MIRRORED) != 0u ? -cross_edges : cross_edges) / doubled_area;
    s.wi = to * inversesqrt(distance2);
    float cosine = -dot(front, s.wi);
    // The ray stops short of the emitter by the bound on the error of its points and, by `to`, on that of the ray's end.
    vec3 magnitude = abs(light.position) + abs(light.edge1) + abs(light.edge2) + abs(to);
    s.target = offset_origin(point, surface_error(magnitude, light.edge1, light.edge2), cosine > 0.0 ? front : -front);
    uint index = light.material & TRIANGLE_MATERIAL_MASK;
    bool is_lit = cosine > 0.0 || (cosine < 0.0 && (light.material & LIGHT_DOUBLE_SIDED) != 0u);
    if (!is_lit || !(distance2 > 0.0)) {
        return s;
    }
    s.radiance = light.intensity;
    bool is_plain = (light.material & LIGHT_PLAIN) != 0u;
    if ((HAS_TEXTURES || HAS_ATTRIBUTES || HAS_ALPHA || HAS_BLEND) && !is_plain) {
        Material material = scene_material(index);
        uvec4 triangle = texelFetch(triangles, int(light.triangle));
        s.radiance = surface_emission(material, triangle, bary);
        float alpha = surface_base_color(material, triangle, bary).a;
        if (HAS_BLEND && (material.flags & MATERIAL_BLEND) != 0u) {
            s.radiance *= limited(alpha, 0.0, 1.0);
        }
        if (HAS_ALPHA && (material.flags & MATERIAL_MASK) != 0u && alpha < material.alpha_cutoff) {
            return s;
        }
    }
    float density = params.light_uniform > 0.0 ? params.light_uniform / (0.5 * doubled_area) : light.emission_pdf;
    s.pdf = choice * density * distance2 / abs(cosine);
    return s;
}

LightSample light_sample_punctual(Light light, vec3 from, float choice)
{
    LightSample s;
    s.triangle = NONE;
    s.is_delta = true;
    s.is_infinite = light.kind == LIGHT_DIRECTIONAL;
    s.target = light.position;
    s.pdf = choice * light.choice;
    if (s.is_infinite) {
        s.wi = -light.direction;
        s.radiance = light.intensity;
        return s;
    }
    vec3 to = light.position - from;
    float distance2 = dot(to, to);
    s.wi = to * inversesqrt(distance2);
    s.radiance = light.intensity / distance2;
    if (light.kind == LIGHT_SPOT) {
        // KHR_lights_punctual: the square of a linear ramp in the cosine between the cones.
        float ramp = (dot(-s.wi, light.direction) - light.cos_outer) / larger(light.cos_inner - light.cos_outer, 1.0e-6);
        s.radiance *= square(limited(ramp, 0.0, 1.0));
    }
    if (!(distance2 > 0.0)) {
        s.pdf = 0.0;
    }
    return s;
}

// An emitter that was chosen for a view.
struct LightChoice {
    float probability; // of the list that holds it; 0: none this time
    bool is_environment;
    float u;           // uniform, for the environment
    Light light;
};

// What light is taken from: the environment, the tree, or else the table.
struct LightList {
    bool is_environment;
    bool is_tree;
    float u;           // uniform
};

LightList light_list(float u)
{
    LightList list = LightList(false, false, u);
    if (HAS_ENVIRONMENT) {
        list.is_environment = u < params.env_choice;
        if (list.is_environment) {
            list.u = u / params.env_choice;
            return list;
        }
        list.u -= params.env_choice;
    }
    if (HAS_LIGHT_TREE) {
        list.is_tree = list.u < params.tree_choice;
        list.u = list.is_tree ? list.u / params.tree_choice : (list.u - params.tree_choice) / params.table_choice;
    } else if (HAS_ENVIRONMENT) {
        list.u /= params.table_choice;
    }
    return list;
}

// A way to walk where lights are taken from the tree, else one that has arrived.
LightWay light_start(LightList list)
{
    return LightWay(list.is_tree ? 0u : LIGHT_LEAF, list.u, 1.0);
}

// The light, from the list or where the way through the tree has arrived.
LightChoice light_pick(LightList list, LightWay way, float u)
{
    LightChoice c;
    c.probability = 0.0;
    c.is_environment = list.is_environment;
    c.u = list.u;
    if (list.is_environment || (!HAS_AREA_LIGHTS && !HAS_PUNCTUAL) || (HAS_LIGHT_TREE && way.probability == 0.0)) {
        return c;
    }
    uint index = 0u;
    uint count = params.light_count;
    float probability = params.table_choice;
    if (HAS_LIGHT_TREE && list.is_tree) {
        index = way.link & LIGHT_LEAF_FIRST_MASK;
        count = (way.link >> LIGHT_LEAF_COUNT_SHIFT & 7u) + 1u;
        probability = way.probability * params.tree_choice;
    }
    // An empty list reads zeros, which are a light without density.
    index += min(uint(whole(floor(way.u * float(count)))), max(count, 1u) - 1u);
    uvec4 entry = texelFetch(lights, int(LIGHT_TEXELS * index));
    c.light = scene_light(u < uintBitsToFloat(entry.z) ? index : entry.y);
    c.probability = probability;
    return c;
}

LightChoice light_choose(LightView view, vec4 u)
{
    LightList list = light_list(u.x);
    LightWay way = light_start(list);
    while (HAS_LIGHT_TREE && !light_arrived(way)) {
        light_step(view, way);
    }
    return light_pick(list, way, u.w);
}

// Two choices, whose ways are walked side by side: a processor has time for a second one while it waits for the first.
void light_choose_two(LightView view, vec4 u_a, vec4 u_b, out LightChoice a, out LightChoice b)
{
    LightList list_a = light_list(u_a.x);
    LightList list_b = light_list(u_b.x);
    LightWay way_a = light_start(list_a);
    LightWay way_b = light_start(list_b);
    while (!(light_arrived(way_a) && light_arrived(way_b))) {
        light_step(view, way_a);
        light_step(view, way_b);
    }
    a = light_pick(list_a, way_a, u_a.w);
    b = light_pick(list_b, way_b, u_b.w);
}

// The chosen light for the point `from`. pdf 0 stands for "none this time". The same u stands
// for the same point of the light whatever `from` is.
LightSample light_from(LightChoice c, vec3 from, vec4 u)
{
    LightSample s;
    s.pdf = 0.0;
    s.triangle = NONE;
    s.is_infinite = true;
    if (HAS_ENVIRONMENT && c.is_environment) {
        EnvironmentSample e = environment_sample(vec3(c.u, u.yz), u.w);
        s.wi = e.wi;
        s.is_delta = false;
        s.radiance = e.radiance;
        s.pdf = e.pdf;
        return s;
    }
    if ((!HAS_AREA_LIGHTS && !HAS_PUNCTUAL) || (HAS_LIGHT_TREE && c.probability == 0.0)) {
        return s;
    }
    if (HAS_AREA_LIGHTS && (!HAS_PUNCTUAL || c.light.kind == LIGHT_TRIANGLE)) {
        return light_sample_triangle(c.light, from, u.yz, c.probability);
    }
    return light_sample_punctual(c.light, from, c.probability);
}

// A light for the point `from`, chosen for the view.
LightSample light_sample(vec3 from, LightView view, vec4 u)
{
    return light_from(light_choose(view, u), from, u);
}

#endif
