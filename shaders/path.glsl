// The estimator: one sample of a pixel, from the lens to radiance. Path tracing
// with next event estimation, multiple importance sampling and roulette; no cap
// on the depth unless the user sets one.
//
// [Kajiya86] Kajiya, The Rendering Equation.
// [Veach97] §9 (multiple importance sampling), §10.4 (roulette).

#ifndef PATH_GLSL
#define PATH_GLSL

#include "bsdf.glsl"
#include "camera.glsl"
#include "lights.glsl"
#include "rng.glsl"

// Roulette starts after this many scattering events: short paths carry most of the light.
const uint ROULETTE_START = 3u;
// From here on survival is at most LONG_PATH_SURVIVAL, so that a path between
// perfect reflectors ends with probability one. The weight keeps the mean.
const uint LONG_PATH = 1024u;
const float LONG_PATH_SURVIVAL = 0.99;

// What the first hit looks like, for the feature layers.
struct FirstHit {
    vec3 albedo;
    vec3 normal;
    float depth;    // metres along the ray
    float coverage; // 1 where something was hit
};

struct PathResult {
    vec3 radiance;
    FirstHit first;
    float truncated;   // throughput that --max-depth cut off, mean of the channels
    uint rays;
};

// Weight of emission that a BSDF sample found, against direct light.
float path_bsdf_weight(float pdf_bsdf, float pdf_light)
{
    if (STRATEGY == STRATEGY_BSDF_ONLY || pdf_light == 0.0) {
        return 1.0;
    }
    return STRATEGY == STRATEGY_LIGHT_ONLY ? 0.0 : mis_weight(pdf_bsdf, pdf_light);
}

// Weight of direct light, against a BSDF sample.
float path_light_weight(bool is_delta, float pdf_light, float pdf_bsdf)
{
    if (is_delta || STRATEGY == STRATEGY_LIGHT_ONLY) {
        return 1.0;
    }
    return STRATEGY == STRATEGY_BSDF_ONLY ? 0.0 : mis_weight(pdf_light, pdf_bsdf);
}

// Fraction of light that gets through between a point and `target` (or infinity along `direction`).
float path_visibility(vec3 origin, vec3 direction, bool is_infinite, vec3 target, inout uint rays)
{
    vec3 to = target - origin;
    float t_max = is_infinite ? T_FAR : length(to);
    vec3 d = is_infinite ? direction : to / t_max;
    if (!(t_max > 0.0)) {
        return 1.0;
    }
    if (!HAS_BLEND) {
        rays++;
        return trace_occluded(origin, d, 0.0, t_max) ? 0.0 : 1.0;
    }
    // Surfaces that cover a part are met one after the other, nearest first.
    float through = 1.0;
    while (through > 0.0) {
        Hit hit;
        rays++;
        if (!trace_closest(origin, d, 0.0, t_max, hit)) {
            return through;
        }
        through *= 1.0 - surface_coverage(hit.instance, hit.primitive, hit.bary);
        SurfacePoint s = surface_point(hit, -d);
        origin = offset_origin(s.position, s.error, -s.ng);
        t_max = is_infinite ? T_FAR : dot(target - origin, d);
        if (!(t_max > 0.0)) {
            return through;
        }
    }
    return 0.0;
}

PathResult path_trace(uvec4 key, uvec2 pixel)
{
    Ray ray = camera_ray(pixel, rng_uniform(key, 0u, SLOT_CAMERA).xy);
    PathResult result;
    result.radiance = vec3(0.0);
    result.first = FirstHit(vec3(0.0), vec3(0.0), 0.0, 0.0);
    result.truncated = 0.0;
    result.rays = 0u;

    vec3 beta = vec3(1.0);
    uint depth = 0u;              // scattering events so far
    bool can_be_sampled = false;  // direct light could have found what the ray finds
    float pdf_bsdf = 0.0;         // of the last scattering
    vec3 scattered_at = ray.origin;

    // `event` counts everything that uses random numbers, `depth` what scatters.
    for (uint event = 1u;; event++) {
        Hit hit;
        result.rays++;
        if (!trace_closest(ray.origin, ray.direction, 0.0, T_FAR, hit)) {
            float pdf_light;
            vec3 radiance = environment_radiance(ray.direction, pdf_light);
            float weight = can_be_sampled ? path_bsdf_weight(pdf_bsdf, pdf_light) : 1.0;
            result.radiance += weight * beta * radiance;
            break;
        }
        vec3 wo = -ray.direction;
        SurfacePoint s = surface_point(hit, wo);

        // A surface that covers a part of the light lets the rest pass straight on.
        if (HAS_BLEND && s.alpha < 1.0 && rng_uniform(key, event, SLOT_COVER).x >= s.alpha) {
            ray.origin = offset_origin(s.position, s.error, -s.ng);
            continue;
        }
        if (HAS_AOVS && depth == 0u) {
            result.first = FirstHit(s.base_color, s.ns, distance(s.position, scattered_at), 1.0);
        }

        if (HAS_AREA_LIGHTS && s.emission_pdf > 0.0) {
            vec3 to = s.position - scattered_at;
            float pdf_light = can_be_sampled ? light_triangle_pdf(s, wo, dot(to, to)) : 0.0;
            result.radiance += path_bsdf_weight(pdf_bsdf, pdf_light) * beta * s.emission;
        }
        if (depth >= params.max_depth) {
            result.truncated = (beta.x + beta.y + beta.z) / 3.0;
            break;
        }

        mat3 frame = frame_from_z(s.ns);
        vec3 wo_local = wo * frame;
        Bsdf bsdf = bsdf_of(s, wo_local.z);

        // Direct light. A mirror has no density that a light's sample could meet.
        bool is_mirror = HAS_SPECULAR && bsdf.alpha == 0.0 && bsdf.p_specular == 1.0;
        bool has_lights = HAS_ENVIRONMENT || HAS_AREA_LIGHTS || HAS_PUNCTUAL;
        if (has_lights && !is_mirror) {
            LightSample light = light_sample(s.position, rng_uniform(key, event, SLOT_LIGHT));
            if (light.pdf > 0.0 && dot(light.wi, s.ng) > 0.0) {
                BsdfValue value = bsdf_eval(bsdf, wo_local, light.wi * frame);
                float weight = path_light_weight(light.is_delta, light.pdf, value.pdf);
                vec3 contribution = (weight / light.pdf) * beta * value.f_cos * light.radiance;
                if (max_component(contribution) > 0.0) {
                    vec3 origin = offset_origin(s.position, s.error, s.ng);
                    result.radiance += contribution
                        * path_visibility(origin, light.wi, light.is_infinite, light.target, result.rays);
                }
            }
        }

        vec4 u = rng_uniform(key, event, SLOT_BSDF);
        BsdfSample next = bsdf_sample(bsdf, wo_local, u.xyz);
        if (!next.is_valid) {
            break;
        }
        vec3 wi = normalize(frame * next.wi);
        // A shading normal can send light through the surface: such samples carry nothing.
        if (dot(wi, s.ng) <= 0.0) {
            break;
        }
        beta *= next.weight;
        depth++;
        // Survival is the throughput itself, so that the weight of long paths stays near one.
        float survival = depth >= ROULETTE_START ? min(max_component(beta), 1.0) : 1.0;
        if (depth >= LONG_PATH) {
            survival = min(survival, LONG_PATH_SURVIVAL);
        }
        if (max_component(beta) <= 0.0 || u.w >= survival) {
            break;
        }
        beta /= survival;
        pdf_bsdf = next.pdf;
        can_be_sampled = next.pdf > 0.0;
        scattered_at = s.position;
        ray = Ray(offset_origin(s.position, s.error, s.ng), wi);
    }
    return result;
}

#endif
