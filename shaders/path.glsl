// The estimator: one sample of a pixel, from the lens to radiance. Path tracing
// with next event estimation, multiple importance sampling and roulette; no cap
// on the depth unless the user sets one.
//
// Light that smooth sheets and index-matched boundaries let straight through is
// found by direct light as well as by the path: neither counts as scattering.
// Light through refracting interfaces is found by the path alone.
//
// [Kajiya86] Kajiya, The Rendering Equation.
// [Veach97] §5.2 (n² and radiance), §9 (multiple importance sampling), §10.4 (roulette).

#ifndef PATH_GLSL
#define PATH_GLSL

#include "bsdf.glsl"
#include "camera.glsl"
#include "direct.glsl"
#include "rng.glsl"

// Roulette starts after this many scattering events: short paths carry most of the light.
const uint ROULETTE_START = 3u;
// From here on survival at event n is at most 1 − 2/n, so that light that nothing
// absorbs ends with probability one, after twice as many events on average. The
// weight keeps the mean. Random walks in white media are rarely this long …
const uint LONG_PATH = 16384u;
// … and few chains of mirrors and smooth interfaces, which may trap light, are as long as this.
const uint LONG_CHAIN = 256u;

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

// A path on its way.
struct PathState {
    Ray ray;
    float lead;            // metres along the ray that it starts ahead of the point that it leaves
    vec3 beta;             // throughput without the factor n² of radiance
    uint depth;            // scattering events so far
    uint chain;            // perfectly specular ones among them since the last other
    bool can_be_sampled;   // direct light could have found what the ray finds
    float pdf;             // of the last scattering, per steradian
    vec3 scattered_at;
    Interior interior;
    float scale;           // radiance at the camera over radiance here: (n_camera / n)²
    Flight flight;         // that led to the last scattering in a medium
};

// Sends the path from s on a ray that starts at `origin`, close to it.
void path_leave(inout PathState path, SurfacePoint s, vec3 origin, vec3 direction)
{
    path.ray = Ray(origin, direction);
    path.lead = HAS_MEDIA ? dot(origin - s.position, direction) : 0.0;
}

// Roulette by throughput; false when the path ends. What is left has its weight.
bool path_survives(inout PathState path, float u)
{
    // Survival is the throughput itself, so that the weight of long paths stays near one.
    float survival = path.depth >= ROULETTE_START ? min(max_component(path.beta), 1.0) : 1.0;
    if (path.depth >= LONG_PATH) {
        survival = min(survival, 1.0 - 2.0 / float(path.depth));
    }
    if (HAS_SPECULAR && path.chain >= LONG_CHAIN) {
        survival = min(survival, 1.0 - 2.0 / float(path.chain));
    }
    if (max_component(path.beta) <= 0.0 || u >= survival) {
        return false;
    }
    path.beta /= survival;
    return true;
}

// Scattering in a medium, or its absence, over `end` metres from the point that the path left. True when the path scattered there; is_over when it ended.
bool path_scatter(inout PathState path, inout PathResult result, uvec4 key, uint event, float end, out bool is_over)
{
    is_over = false;
    Medium medium = scene_medium(path.interior.current);
    if (!HAS_SCATTERING || !medium_scatters(medium)) {
        path.beta *= medium_transmittance(medium, end);
        is_over = max_component(path.beta) <= 0.0;
        return false;
    }
    bool is_last = path.depth >= params.max_depth;
    vec4 u = rng_uniform(key, event, SLOT_MEDIUM);
    Flight flight = Flight(path.ray.origin - path.lead * path.ray.direction, path.ray.direction, end, medium_channels(path.beta), 0.0, 0.0);
    if (HAS_EQUIANGULAR && !is_last) {
        result.radiance += path.scale * path.beta
            * direct_along(medium, flight, path.interior, rng_uniform(key, event, SLOT_SEGMENT), u.z, result.rays);
    }
    MediumSample s = medium_sample(medium, path.beta, end, u.xy);
    path.beta *= s.weight;
    if (!s.is_scattered) {
        return false;
    }
    if (is_last) {
        result.truncated = (path.beta.x + path.beta.y + path.beta.z) / 3.0;
        is_over = true;
        return true;
    }
    flight.distance = s.distance;
    flight.pdf = medium_pdf(medium, flight.channels, s.distance);
    vec3 d = path.ray.direction;
    vec3 at = flight.origin + s.distance * d;
    result.radiance += path.scale * path.beta
        * direct_in_medium(medium, flight, at, path.interior, rng_uniform(key, event, SLOT_LIGHT), result.rays);

    u = rng_uniform(key, event, SLOT_BSDF);
    path.ray = Ray(at, phase_sample(medium, d, u.yz));
    path.lead = 0.0;
    path.pdf = phase_value(medium, d, path.ray.direction);
    path.can_be_sampled = true;
    path.scattered_at = at;
    path.flight = flight;
    path.depth++;
    path.chain = 0u;
    is_over = !path_survives(path, u.w);
    return true;
}

// Weight of emission that the path found by scattering, where direct light would have had the density `pdf_light`.
float path_found_weight(PathState path, float pdf_light, vec3 point, bool is_infinite)
{
    if (!path.can_be_sampled) {
        return 1.0;
    }
    if (HAS_EQUIANGULAR && !is_infinite && path.flight.pdf > 0.0) {
        return direct_found_weight(path.flight, path.pdf, pdf_light, point);
    }
    return direct_bsdf_weight(path.pdf, pdf_light);
}

PathResult path_trace(uvec4 key, uvec2 pixel)
{
    PathResult result;
    result.radiance = vec3(0.0);
    result.first = FirstHit(vec3(0.0), vec3(0.0), 0.0, 0.0);
    result.truncated = 0.0;
    result.rays = 0u;

    PathState path;
    path.ray = camera_ray(pixel, rng_uniform(key, 0u, SLOT_CAMERA).xy);
    path.lead = 0.0;
    path.beta = vec3(1.0);
    path.depth = 0u;
    path.chain = 0u;
    path.can_be_sampled = false;
    path.pdf = 0.0;
    path.scattered_at = path.ray.origin;
    path.interior = interior_empty();
    path.scale = 1.0;
    path.flight = flight_none();
    float camera_ior = 1.0;
    if (HAS_INSIDE) {
        path.interior = interior_find(path.ray.origin, path.ray.direction, result.rays);
        camera_ior = interior_ior(path.interior.current);
    }

    // `event` counts everything that uses random numbers, `depth` what scatters.
    for (uint event = 1u;; event++) {
        Hit hit;
        result.rays++;
        bool is_hit = trace_closest(path.ray.origin, path.ray.direction, 0.0, T_FAR, hit);
        if (HAS_MEDIA) {
            bool is_over;
            float end = is_hit ? max(hit.t + path.lead, 0.0) : T_FAR;
            bool is_scattered = path_scatter(path, result, key, event, end, is_over);
            if (is_over) {
                break;
            }
            if (is_scattered) {
                continue;
            }
        }
        if (!is_hit) {
            float pdf_light;
            vec3 radiance = environment_radiance(path.ray.direction, pdf_light);
            result.radiance += path_found_weight(path, pdf_light, vec3(0.0), true) * path.scale * path.beta * radiance;
            break;
        }
        vec3 wo = -path.ray.direction;
        SurfacePoint s = surface_point(hit, wo);
        bool is_solid = HAS_DIELECTRIC && s.is_solid;
        Boundary boundary;
        boundary.beyond = path.interior;
        if (is_solid) {
            boundary = interior_boundary(path.interior, hit, s, path.ray.direction, result.rays);
        }

        // A surface that covers a part of the light lets the rest pass straight on.
        if (HAS_BLEND && s.alpha < 1.0 && rng_uniform(key, event, SLOT_COVER).x >= s.alpha) {
            path_leave(path, s, offset_origin(s.position, s.error, -s.ng), path.ray.direction);
            path.interior = boundary.beyond;
            continue;
        }
        if (HAS_AOVS && path.depth == 0u) {
            result.first = FirstHit(s.base_color, s.ns, distance(s.position, path.scattered_at), 1.0);
        }

        if (HAS_AREA_LIGHTS && s.emission_pdf > 0.0) {
            vec3 to = s.position - path.scattered_at;
            float pdf_light = path.can_be_sampled ? light_triangle_pdf(s, wo, dot(to, to)) : 0.0;
            result.radiance += path_found_weight(path, pdf_light, s.position, false) * path.scale * path.beta * s.emission;
        }

        float eta = s.ior;
        if (is_solid) {
            // Inside a solid that outranks it, a boundary is not there.
            if (boundary.before == boundary.after) {
                path_leave(path, s, offset_origin(s.position, s.error, -s.ng), path.ray.direction);
                path.interior = boundary.beyond;
                continue;
            }
            eta = interior_eta(boundary);
        }
        vec3 normal = s.ns;
        if (HAS_DIELECTRIC && HAS_NORMALS && s.transmission > 0.0) {
            normal = bsdf_interface_normal(s, wo, eta);
        }
        mat3 frame = frame_from_z(normal);
        vec3 wo_local = wo * frame;
        Bsdf bsdf = bsdf_of(s, wo_local.z, eta);

        bool is_last = path.depth >= params.max_depth;
        if (is_last && !bsdf_is_straight(bsdf)) {
            result.truncated = (path.beta.x + path.beta.y + path.beta.z) / 3.0;
            break;
        }
        // Direct light. A mirror has no density that a light's sample could meet.
        if (HAS_LIGHTS && !is_last && bsdf_has_density(bsdf)) {
            LightSample light = light_sample(s.position, rng_uniform(key, event, SLOT_LIGHT));
            float side = dot(light.wi, s.ng);
            bool is_beyond = bsdf_transmits_widely(bsdf) && side < 0.0;
            if (light.pdf > 0.0 && (side > 0.0 || is_beyond)) {
                BsdfValue value = bsdf_eval(bsdf, wo_local, light.wi * frame);
                float weight = direct_light_weight(light.is_delta, light.pdf, value.pdf);
                vec3 contribution = (weight / light.pdf) * path.beta * value.f_cos * light.radiance;
                if (max_component(contribution) > 0.0) {
                    vec3 origin = offset_origin(s.position, s.error, is_beyond ? -s.ng : s.ng);
                    Interior there = path.interior;
                    float scale = path.scale;
                    if (is_beyond && is_solid) {
                        there = boundary.beyond;
                        scale = square(camera_ior / interior_ior(there.current));
                    }
                    result.radiance += scale * contribution * direct_visibility(there, origin, light, result.rays);
                }
            }
        }

        vec4 u = rng_uniform(key, event, SLOT_BSDF);
        BsdfSample next = bsdf_sample(bsdf, wo_local, u.xyz);
        if (!next.is_valid) {
            break;
        }
        path.beta *= next.weight;
        vec3 origin = offset_origin(s.position, s.error, s.ng);
        if (HAS_DIELECTRIC && next.is_transmitted) {
            origin = offset_origin(s.position, s.error, -s.ng);
            if (is_solid) {
                path.interior = boundary.beyond;
                path.scale = square(camera_ior / interior_ior(boundary.after));
            }
            if (next.is_straight) {
                path_leave(path, s, origin, path.ray.direction);
                if (max_component(path.beta) <= 0.0) {
                    break;
                }
                continue;
            }
        }
        if (is_last) {
            result.truncated = (path.beta.x + path.beta.y + path.beta.z) / 3.0;
            break;
        }
        path_leave(path, s, origin, normalize(frame * next.wi));
        // A shading normal can send light to the wrong side of the surface: such samples carry nothing.
        float side = dot(path.ray.direction, s.ng);
        if (next.is_transmitted ? side >= 0.0 : side <= 0.0) {
            break;
        }
        path.depth++;
        path.chain = next.pdf > 0.0 ? 0u : path.chain + 1u;
        if (!path_survives(path, u.w)) {
            break;
        }
        path.pdf = next.pdf;
        path.can_be_sampled = next.pdf > 0.0;
        path.scattered_at = s.position;
        path.flight.pdf = 0.0;
    }
    return result;
}

#endif
