// The estimator: one sample of a pixel, from the lens to radiance. Path tracing
// with next event estimation, multiple importance sampling and roulette; no cap
// on the depth unless the user sets one.
//
// Light that smooth sheets and index-matched boundaries let straight through is
// found by direct light as well as by the path: neither counts as scattering.
// Light through refracting interfaces is found by the path alone.
//
// [Kajiya86] Kajiya, The Rendering Equation.
// [Talbot05] Talbot, Cline, Egbert, Importance Resampling for Global Illumination.
// [Veach97] §5.2 (n² and radiance), §9 (multiple importance sampling), §10.4 (roulette).

#ifndef PATH_GLSL
#define PATH_GLSL

#include "bsdf.glsl"
#include "camera.glsl"
#include "direct.glsl"
#include "guide.glsl"
#include "path_state.glsl"
#include "rng.glsl"
#ifdef SHARE
#include "share.glsl"
#endif
#ifdef PHOTON
#include "photon.glsl"
const bool IS_PHOTON = true;
#else
const bool IS_PHOTON = false;
#endif

// Roulette starts after this many scattering events: short paths carry most of the light …
const uint ROULETTE_START = 2u;
// … and thins the paths whose throughput is less than this, which is what survivors then have. Random walks
// in media are long and each step brings little: thinned harder, they take less time for the same error.
const float ROULETTE_WEIGHT = 0.25;
const float ROULETTE_WEIGHT_MEDIUM = 1.0;
// From here on survival at event n is at most 1 − 2/n, so that light that nothing
// absorbs ends with probability one, after twice as many events on average. The
// weight keeps the mean. Random walks in white media are rarely this long …
const uint LONG_PATH = 16384u;
// … and few chains of mirrors and smooth interfaces, which may trap light, are as long as this.
const uint LONG_CHAIN = 256u;

// Sends the path from s on a ray that starts at `origin`, close to it.
void path_leave(inout PathState path, SurfacePoint s, vec3 origin, vec3 direction)
{
    path.ray = Ray(origin, direction);
    path.from = s.record;
    path.lead = HAS_MEDIA ? dot(origin - s.position, direction) : 0.0;
}

// Throughput that is left when the depth limit ends the path, mean of the channels.
float path_throughput(PathState path)
{
    vec3 beta = path.beta;
#ifdef SHARE
    beta = share_throughput(beta);
#endif
    return (beta.x + beta.y + beta.z) / 3.0;
}

// Roulette by throughput, which is kept at `weight` or above; false when the path ends. What is left has its weight.
bool path_survives(inout PathState path, float weight, float u)
{
    float throughput = max_component(path.beta);
    if (HAS_GUIDE) {
        throughput *= path.guided;
    }
    float survival = path.depth >= ROULETTE_START ? smaller(throughput / weight, 1.0) : 1.0;
    if (path.depth >= LONG_PATH) {
        survival = smaller(survival, 1.0 - 2.0 / float(path.depth));
    }
    if (HAS_SPECULAR && path.chain >= LONG_CHAIN) {
        survival = smaller(survival, 1.0 - 2.0 / float(path.chain));
    }
    if (max_component(path.beta) <= 0.0 || u >= survival) {
        return false;
    }
    path.beta /= survival;
    return true;
}

// Adds direct light that is scattered at `origin`, now or when its shadow ray has arrived. Of light along a segment and light
// at its end one is followed, in proportion to what they give if nothing is in the way, for both [Talbot05].
void path_light(inout PathState path, inout PathResult result, Interior interior, vec3 origin, uint from, LightSample light,
                vec3 value)
{
    float weight = value.x + value.y + value.z;
    // What is not a number goes on, and is counted with its sample.
    if (weight <= 0.0) {
        return;
    }
    if (HAS_EQUIANGULAR && path.shadow.is_waiting) {
        float other = path.shadow.value.x + path.shadow.value.y + path.shadow.value.z;
        float share = weight / (other + weight);
        if (rng_coin(path.key, path.event, SLOT_SEGMENT) >= share) {
            path.shadow.value /= 1.0 - share;
            return;
        }
        value /= share;
    }
    Shadow shadow = shadow_of(interior, origin, from, light, value);
    if (HAS_PASSAGE || HAS_SCATTERING) {
        path.shadow = shadow;
    } else {
        result.radiance += shadow_arrives(shadow, result.rays);
    }
}

// Scattering in a medium, or its absence, over `end` metres from the point that the path left. True when the path scattered there.
bool path_scatter(inout PathState path, inout PathResult result, float end)
{
    Medium medium = scene_medium(path.interior.current);
    if (!HAS_SCATTERING || !medium_scatters(medium)) {
        path.beta *= medium_transmittance(medium, end);
        path.is_alive = max_component(path.beta) > 0.0;
        return false;
    }
    bool is_last = path.depth >= params.max_depth;
    vec4 u = rng_uniform(path.key, path.event, SLOT_MEDIUM);
    vec3 d = path.ray.direction;
    Flight flight = Flight(path.ray.origin - path.lead * d, d, end, medium_channels(path.beta), 0.0, 0.0);
    vec4 u_light = rng_uniform(path.key, path.event, SLOT_SEGMENT);
    LightChoice choice;
    if (HAS_LIGHTS && !is_last) {
        choice = light_choose(direct_view(flight), u_light);
    }
    if (HAS_EQUIANGULAR && !is_last) {
        DirectLight direct = direct_along(medium, flight, choice, u_light, u.z);
        path_light(path, result, path.interior, direct.at, NONE, direct.light, path.scale * path.beta * direct.value);
    }
    MediumSample s = medium_sample(medium, path.beta, end, u.xy);
    path.beta *= s.weight;
    if (!s.is_scattered) {
        return false;
    }
    if (is_last) {
        result.truncated = path_throughput(path);
        path.is_alive = false;
        return true;
    }
    flight.distance = s.distance;
    flight.pdf = medium_pdf(medium, flight.channels, s.distance);
    vec3 at = flight.origin + s.distance * d;
    if (HAS_LIGHTS) {
        DirectLight direct = direct_in_medium(medium, flight, choice, u_light);
        path_light(path, result, path.interior, at, NONE, direct.light, path.scale * path.beta * direct.value);
    }

    u = rng_uniform(path.key, path.event, SLOT_BSDF);
    path.ray = Ray(at, phase_sample(medium, d, u.yz));
    path.from = NONE;
    path.lead = 0.0;
    path.pdf = phase_value(medium, d, path.ray.direction);
    path.can_be_sampled = true;
    path.scattered_at = at;
    path.flight = flight;
    path.depth++;
    path.chain = 0u;
    path.is_alive = path_survives(path, ROULETTE_WEIGHT_MEDIUM, u.w);
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
    // one of several samples of lights counts for all of them
    bool is_medium = HAS_SCATTERING && path.flight.pdf > 0.0;
    float count = is_medium ? 1.0 : float(direct_candidates(path.depth <= 1u));
    return direct_bsdf_weight(path.pdf, count * pdf_light);
}

// What direct light was chosen for at the last scattering.
LightView path_view(PathState path)
{
    bool is_medium = HAS_SCATTERING && path.flight.pdf > 0.0;
    return is_medium ? direct_view(path.flight) : light_view_surface(path.scattered_at, path.scattered_normal);
}

// Starts the path of one sample at the camera.
PathState path_start(uvec4 key, uvec2 pixel)
{
    Ray ray = camera_ray(pixel, rng_uniform(key, 0u, SLOT_CAMERA));
    PathState path;
    path.key = key;
    path.event = 0u;
    path.ray = ray;
    path.from = NONE;
    path.lead = 0.0;
    path.beta = vec3(1.0);
    path.guided = 1.0;
    path.depth = 0u;
    path.chain = 0u;
    path.can_be_sampled = false;
    path.pdf = 0.0;
    path.scattered_at = ray.origin;
    path.scattered_normal = vec3(0.0);
    path.interior = interior_empty();
    path.camera_ior = 1.0;
    path.scale = 1.0;
    path.flight = flight_none();
    path.is_alive = true;
    path.is_sensor = HAS_SENSOR && params.camera_kind == CAMERA_IRRADIANCE;
    path.is_search = HAS_INSIDE;
    path.search = interior_search();
    path.camera = ray;
    path.shadow = shadow_none();
    return path;
}

// The white Lambert surface of a light meter: what leaves it is the irradiance over π.
SurfacePoint path_sensor()
{
    SurfacePoint s = surface_white();
    s.position = s.start = params.camera_position;
    // It may lie on a surface of the scene.
    s.error = vec3(POSITION_ROUNDINGS * EPSILON) * (abs(s.position) + params.camera_right.x);
    s.ng = s.ns = params.camera_forward;
    return s;
}

// Starts the path in the solids that hold the camera.
void path_enter(inout PathState path)
{
    path.is_search = false;
    path.ray = path.camera;
    path.interior = path.search.holds;
    path.camera_ior = interior_ior(path.interior.current);
}

// A shadow ray arrived, or met s, through which the fraction `through` of the light passes.
void path_shadow(inout PathState path, inout PathResult result, bool is_hit, SurfacePoint s, vec3 through, Interior beyond)
{
    bool is_done = !is_hit;
    if (is_hit) {
        path.shadow.value *= through;
        vec3 origin = s.position + surface_step(s, path.shadow.ray.direction);
        shadow_aim(path.shadow, origin);
        path.shadow.from = s.record;
        path.shadow.lead = dot(origin - s.position, path.shadow.ray.direction);
        path.shadow.interior = beyond;
        is_done = path.shadow.t_max == 0.0 || max_component(path.shadow.value) <= 0.0;
    }
    if (is_done) {
        result.radiance += path.shadow.value;
        path.shadow.is_waiting = false;
    }
}

// What the path does at the surface s: emission, direct light, scattering.
void path_surface(inout PathState path, inout PathResult result, SurfacePoint s, bool is_solid, Boundary boundary, mat3 frame,
                  Bsdf bsdf, PathDraws draws)
{
    vec3 wo = -path.ray.direction;
    vec3 wo_local = wo * frame;
    vec3 far_side = offset_origin(s.start, s.error, -s.ng);
    // A surface that covers a part of the light lets the rest pass straight on.
    bool is_passed = HAS_BLEND && s.alpha < 1.0 && rng_uniform(path.key, path.event, SLOT_COVER).x >= s.alpha;
    if (!is_passed) {
        if (HAS_AOVS && path.depth == 0u) {
            result.first = FirstHit(s.base_color, s.ns, distance(s.position, path.scattered_at), 1.0);
        }
        if (HAS_AREA_LIGHTS && s.emission_pdf > 0.0) {
            vec3 to = s.position - path.scattered_at;
            float pdf_light = path.can_be_sampled ? light_triangle_pdf(s, wo, dot(to, to), path_view(path)) : 0.0;
            result.radiance += path_found_weight(path, pdf_light, s.position, false) * path.scale * path.beta * s.emission;
        }
#ifdef SHARE
        if (path.depth == 1u) {
            share_meet(s, bsdf, result.radiance);
        }
#endif
        // Inside a solid that outranks it, a boundary is not there.
        is_passed = is_solid && boundary.before == boundary.after;
    }
    if (is_passed) {
        path_leave(path, s, s.position + surface_step(s, path.ray.direction), path.ray.direction);
        path.interior = boundary.beyond;
        return;
    }

#ifdef PHOTON
    if (photon_meet(s, bsdf, path.ray.direction, path.beta)) {
        path.is_alive = false;
        return;
    }
#endif
    bool is_last = !path.is_sensor && path.depth >= params.max_depth;
    if (is_last && !bsdf_is_straight(bsdf)) {
        result.truncated = path_throughput(path);
        path.is_alive = false;
        return;
    }
    // Direct light. A mirror has no density that a light's sample could meet.
    if (HAS_LIGHTS && !IS_PHOTON && !is_last && bsdf_has_density(bsdf)) {
        DirectLight direct = direct_on_surface(s, bsdf, frame, wo_local, path.key, path.event, draws.light, path.depth == 0u);
        if (!(direct.value.x + direct.value.y + direct.value.z <= 0.0)) {
            bool is_beyond = HAS_DIELECTRIC && dot(direct.light.wi, s.ng) < 0.0;
            vec3 origin = is_beyond ? far_side : offset_origin(s.start, s.error, s.ng);
            Interior there = path.interior;
            float scale = path.scale;
            if (is_beyond && is_solid) {
                there = boundary.beyond;
                scale = square(path.camera_ior / interior_ior(boundary.after));
            }
            path_light(path, result, there, origin, s.record, direct.light, scale * path.beta * direct.value);
        }
    }

    vec4 u = draws.bsdf;
    BsdfSample next = bsdf_sample(bsdf, wo_local, u.xyz);
    if (HAS_GUIDE && bsdf_has_density(bsdf)) {
        vec4 u_guide = rng_uniform(path.key, path.event, SLOT_GUIDE);
        path.guided *= guide_sample(s.position, bsdf, frame, wo_local, u.x, u_guide, next);
    }
#ifdef PHOTON
    next.is_valid = next.is_valid && photon_leave(next);
#endif
    if (!next.is_valid) {
        path.is_alive = false;
        return;
    }
    path.beta *= next.weight;
#ifdef SHARE
    if (path.depth == 0u) {
        share_scatter(s, bsdf, path.beta, result.radiance);
    }
#endif
    vec3 origin = offset_origin(s.start, s.error, s.ng);
    if (HAS_DIELECTRIC && next.is_transmitted) {
        origin = far_side;
        if (is_solid) {
            path.interior = boundary.beyond;
            path.scale = square(path.camera_ior / interior_ior(boundary.after));
        }
        if (next.is_straight) {
            path_leave(path, s, s.position + surface_step(s, path.ray.direction), path.ray.direction);
            path.is_alive = max_component(path.beta) > 0.0;
            return;
        }
    }
    if (is_last) {
        result.truncated = path_throughput(path);
        path.is_alive = false;
        return;
    }
    path_leave(path, s, origin, normalize(frame * next.wi));
    // A shading normal can send light to the wrong side of the surface: such samples carry nothing.
    float side = dot(path.ray.direction, s.ng);
    path.depth += path.is_sensor ? 0u : 1u;
    path.is_sensor = false;
    path.chain = next.pdf > 0.0 ? 0u : path.chain + 1u;
    path.is_alive = (next.is_transmitted ? side < 0.0 : side > 0.0) && path_survives(path, ROULETTE_WEIGHT, u.w);
    path.pdf = next.pdf;
    path.can_be_sampled = next.pdf > 0.0;
    path.scattered_at = s.position;
    path.scattered_normal = direct_normal(s, bsdf);
    path.flight.pdf = 0.0;
}

// Traces one ray of the path, of direct light or of the search for solids that hold
// the camera, so that the code that meets surfaces is there once.
void path_trace(inout PathState path, inout PathResult result)
{
    bool is_shadow = HAS_PASSAGE && path.shadow.is_waiting;
    Ray ray = path.ray;
    float t_max = T_FAR;
    uint from = path.from;
    float lead = path.lead;
    if (is_shadow) {
        ray = path.shadow.ray;
        t_max = path.shadow.t_max;
        from = path.shadow.from;
        lead = path.shadow.lead;
    } else if (!path.is_search) {
        path.event++;
    }
    if (HAS_NESTED) {
        surface_skip_triangle(HAS_INSIDE && path.is_search ? path.search.last : uvec2(NONE));
    }
    PathDraws draws;
    if (IS_FLAT) {
        draws = path_draws(path);
    }
    Hit hit;
    bool is_sensor = path.is_sensor && !is_shadow && !path.is_search;
    bool is_hit = is_sensor;
    if (!is_sensor && t_max > 0.0) {
        result.rays++;
        is_hit = trace_closest(ray.origin, ray.direction, 0.0, t_max, from, hit);
    }
    if (HAS_MEDIA && !path.is_search && !is_sensor) {
        float end = larger((is_hit ? hit.t : t_max) + lead, 0.0);
        if (is_shadow) {
            path.shadow.value *= medium_transmittance(scene_medium(path.shadow.interior.current), end);
        } else if (path_scatter(path, result, end) || !path.is_alive) {
            return;
        }
    }
    if (!is_hit && !is_shadow) {
        if (path.is_search) {
            path_enter(path);
            return;
        }
#ifdef SHARE
        share_escape(ray.direction);
#endif
        float pdf_light;
        vec3 radiance = environment_radiance(ray.direction, pdf_light);
        result.radiance += path_found_weight(path, pdf_light, vec3(0.0), true) * path.scale * path.beta * radiance;
        path.is_alive = false;
        return;
    }

    SurfacePoint s;
    Boundary boundary;
    boundary.beyond = is_shadow ? path.shadow.interior : path.interior;
    bool is_solid = false;
    mat3 frame;
    Bsdf bsdf;
    vec3 through = vec3(0.0);
    if (is_hit) {
        if (is_sensor) {
            s = path_sensor();
        } else {
            s = surface_point(hit, -ray.direction);
        }
        if (path.is_search) {
            bool is_found;
            path.ray.origin = interior_note(path.search, hit, s, is_found);
            if (is_found) {
                path_enter(path);
            }
            return;
        }
        is_solid = HAS_DIELECTRIC && s.is_solid;
        float eta = s.ior;
        if (is_solid) {
            boundary = interior_boundary(boundary.beyond, hit, s, ray.direction, result.rays);
            eta = interior_eta(boundary);
        }
        vec3 normal = s.ns;
        if (HAS_DIELECTRIC && HAS_NORMALS && s.transmission > 0.0) {
            normal = bsdf_interface_normal(s, -ray.direction, eta);
        }
        frame = frame_from_z(normal);
        float cosine = -dot(ray.direction, normal);
        bsdf = bsdf_of(s, cosine, eta);
        if (is_shadow) {
            bool is_passed = is_solid && boundary.before == boundary.after;
            through = is_passed ? vec3(1.0) : 1.0 - s.alpha + s.alpha * bsdf_straight(bsdf, cosine);
        }
    }
    if (is_shadow) {
        path_shadow(path, result, is_hit, s, through, boundary.beyond);
    } else {
        if (!IS_FLAT) {
            draws = path_draws(path);
        }
        path_surface(path, result, s, is_solid, boundary, frame, bsdf, draws);
    }
}

// Takes the path one step on. Where media scatter, the step's direct light is traced here, whether air or a surface scatters it.
void path_step(inout PathState path, inout PathResult result)
{
    path_trace(path, result);
    if (HAS_SCATTERING && !HAS_PASSAGE && path.shadow.is_waiting) {
        path.shadow.is_waiting = false;
        result.radiance += shadow_arrives(path.shadow, result.rays);
    }
}

// Whether the path needs another step.
bool path_goes_on(PathState path)
{
    return path.is_alive || (HAS_PASSAGE && path.shadow.is_waiting);
}

#endif
