// Direct light: what lights give to a surface or a point in a medium, seen through
// everything that lets light straight through, and the weights that share the
// work with scattering that happens to find a light.
//
// [Veach97] §9. [Kulla12] Kulla, Fajardo, Importance Sampling Techniques for Path Tracing in Participating Media.
// [Talbot05] Talbot, Cline, Egbert, Importance Resampling for Global Illumination.

#ifndef DIRECT_GLSL
#define DIRECT_GLSL

#include "bsdf.glsl"
#include "camera.glsl"
#include "interior.glsl"
#include "lights.glsl"
#include "medium.glsl"
#include "rng.glsl"

const bool HAS_LIGHTS = HAS_ENVIRONMENT || HAS_AREA_LIGHTS || HAS_PUNCTUAL;

// A segment in a scattering medium, and where the path scattered on it.
struct Flight {
    vec3 origin;
    vec3 direction;
    float end;       // metres
    vec3 channels;   // probabilities by which the distance was drawn
    float distance;  // to the scattering
    float pdf;       // of that distance, 1/m; 0: the path did not scatter in a medium
};

Flight flight_none()
{
    return Flight(vec3(0.0), vec3(0.0), 0.0, vec3(0.0), 0.0, 0.0);
}

// Weight of emission that a scattering found, against direct light.
float direct_bsdf_weight(float pdf_bsdf, float pdf_light)
{
    if (STRATEGY == STRATEGY_BSDF_ONLY || pdf_light == 0.0) {
        return 1.0;
    }
    return STRATEGY == STRATEGY_LIGHT_ONLY ? 0.0 : mis_weight(pdf_bsdf, pdf_light);
}

// Weight of direct light, against a scattering.
float direct_light_weight(bool is_delta, float pdf_light, float pdf_bsdf)
{
    if (is_delta || STRATEGY == STRATEGY_LIGHT_ONLY) {
        return 1.0;
    }
    return STRATEGY == STRATEGY_BSDF_ONLY ? 0.0 : mis_weight(pdf_light, pdf_bsdf);
}

// Light on its way from a light to a point of the path, which it reaches only straight.
struct Shadow {
    bool is_waiting;
    vec3 value;      // what arrives if nothing is in the way
    Interior interior;
    Ray ray;
    uint from;       // record of the hit that the ray leaves, or NONE
    uint to;         // triangle that emits the light, or NONE
    float lead;      // metres that the ray starts ahead of what it left
    float t_max;
    bool is_infinite;
    vec3 target;
};

Shadow shadow_none()
{
    return Shadow(false, vec3(0.0), interior_empty(), Ray(vec3(0.0), vec3(0.0)), NONE, NONE, 0.0, 0.0, false, vec3(0.0));
}

// Sends the shadow ray on from `origin`. It aims at the light anew: a step off a large
// surface may be longer than the distance at which rays stop short of a small lamp.
void shadow_aim(inout Shadow s, vec3 origin)
{
    s.ray.origin = origin;
    if (s.is_infinite) {
        s.t_max = T_FAR;
        return;
    }
    vec3 to = s.target - origin;
    bool is_reached = dot(to, s.ray.direction) <= 0.0;
    s.t_max = is_reached ? 0.0 : length(to);
    if (s.t_max > 0.0) {
        s.ray.direction = to / s.t_max;
    }
}

Shadow shadow_of(Interior interior, vec3 origin, uint from, LightSample light, vec3 value)
{
    Shadow s = Shadow(true, value, interior, Ray(origin, light.wi), from, light.triangle, 0.0, 0.0, light.is_infinite, light.target);
    shadow_aim(s, origin);
    return s;
}

// Whether all of the light arrives, where surfaces let through all or nothing.
vec3 shadow_arrives(Shadow s, inout uint rays)
{
    if (s.t_max > 0.0) {
        rays++;
        if (trace_occluded(s.ray.origin, s.ray.direction, 0.0, s.t_max, s.from, s.to)) {
            return vec3(0.0);
        }
    }
    return HAS_MEDIA ? s.value * medium_transmittance(scene_medium(s.interior.current), s.t_max) : s.value;
}

// Light that may arrive, and how much if nothing is in the way.
struct DirectLight {
    LightSample light;
    vec3 value;
    vec3 at;        // where it is scattered
};

// The normal by which lights are chosen for a surface: 0 where light from both sides counts.
vec3 direct_normal(SurfacePoint s, Bsdf bsdf)
{
    return bsdf_transmits_widely(bsdf) ? vec3(0.0) : s.ng;
}

// How far the numbers of one sample of a light are from those of the next, multiples of 2⁻²³: powers of the golden and the plastic ratio.
const vec3 CANDIDATE_TURNS = vec3(5184444.0, 6332377.0, 4780167.0) / 8388608.0;

// Samples of lights of which one is followed, one or an even number. What the tree does not know, the BSDF's lobes, matters most where the camera sees it.
int direct_candidates(bool is_first)
{
    if (!HAS_LIGHT_TREE) {
        return 1;
    }
    return HAS_SPECULAR && is_first ? 4 : 2;
}

// Direct light by one of `count` samples of lights, which a surface scatters along wo, in the frame, for throughput one.
DirectLight direct_sample(SurfacePoint s, Bsdf bsdf, mat3 frame, vec3 wo, LightChoice choice, vec4 u, int count)
{
    DirectLight direct = DirectLight(light_from(choice, s.position, u), vec3(0.0), s.position);
    LightSample light = direct.light;
    float side = dot(light.wi, s.ng);
    if (light.pdf > 0.0 && (side > 0.0 || (bsdf_transmits_widely(bsdf) && side < 0.0))) {
        BsdfValue value = bsdf_eval(bsdf, wo, light.wi * frame);
        float weight = direct_light_weight(light.is_delta, float(count) * light.pdf, value.pdf);
        direct.value = (weight / light.pdf) * value.f_cos * light.radiance;
    }
    return direct;
}

// The same by several samples of lights: one, in proportion to what it gives if nothing is in the way, with the mean of
// what all give [Talbot05]. They have the first one's numbers, u, turned, so that they are spread evenly.
DirectLight direct_on_surface(SurfacePoint s, Bsdf bsdf, mat3 frame, vec3 wo, uvec4 key, uint event, vec4 u, bool is_first)
{
    LightView view = light_view_surface(s.position, direct_normal(s, bsdf));
    int count = direct_candidates(is_first);
    if (count == 1) {
        return direct_sample(s, bsdf, frame, wo, light_choose(view, u), u, count);
    }
    vec4 turn = vec4(1.0 / float(count), CANDIDATE_TURNS);
    float coin = rng_coin(key, event, SLOT_CANDIDATE);
    float sum = 0.0;
    DirectLight direct;
    direct.light.wi = s.ng;
    direct.value = vec3(0.0);
    LightChoice next;
    for (int k = 0; k < count; k++) {
        vec4 u_next = sample_turned(u, turn);
        LightChoice choice = next;
        // every other step chooses for two
        if (k % 2 == 0) {
            light_choose_two(view, u, u_next, choice, next);
        }
        DirectLight candidate = direct_sample(s, bsdf, frame, wo, choice, u, count);
        u = u_next;
        float weight = candidate.value.x + candidate.value.y + candidate.value.z;
        if (weight != 0.0) {
            sum += weight;
            float share = weight / sum;
            bool is_taken = coin < share;
            coin = is_taken ? coin / share : (coin - share) / (1.0 - share);
            if (is_taken) {
                direct = candidate;
                direct.value /= weight;
            }
        }
    }
    direct.value *= sum / float(count);
    return direct;
}

// The flight as it is seen from `point`, which is on a light.
Equiangular direct_equiangular(Flight flight, vec3 point)
{
    return equiangular_of(flight.origin, flight.direction, flight.end, point);
}

// The same of the light that was chosen for it: a spot sees what lies in its cone.
Equiangular direct_equiangular_of(Flight flight, LightChoice choice, vec3 point)
{
    Equiangular e = direct_equiangular(flight, point);
    if (HAS_PUNCTUAL && choice.light.kind == LIGHT_SPOT && e.apart > 0.0) {
        equiangular_within(e, flight.origin, flight.direction, point, choice.light.direction, choice.light.cos_outer);
    }
    return e;
}

// Weight of a light that scattering in a medium found, against direct light from
// there by both ways of drawing the distance.
float direct_found_weight(Flight flight, float pdf_phase, float pdf_light, vec3 point)
{
    if (STRATEGY != STRATEGY_MIS || pdf_light == 0.0) {
        return direct_bsdf_weight(pdf_phase, pdf_light);
    }
    float ratio = pdf_light / pdf_phase;
    float equiangular = equiangular_pdf(direct_equiangular(flight, point), flight.distance) / flight.pdf;
    return 1.0 / (1.0 + ratio * ratio * (1.0 + equiangular * equiangular));
}

// Lights are chosen for the whole segment: both ways of drawing the distance then choose alike.
LightView direct_view(Flight flight)
{
    return LightView(flight.origin, flight.direction, flight.end);
}

// Direct light of the chosen emitter that a point in a medium scatters back along the flight, for throughput one.
DirectLight direct_in_medium(Medium medium, Flight flight, LightChoice choice, vec4 u)
{
    DirectLight direct;
    direct.at = flight.origin + flight.distance * flight.direction;
    direct.light = light_from(choice, direct.at, u);
    float phase = phase_value(medium, flight.direction, direct.light.wi);
    float weight = direct_light_weight(direct.light.is_delta, direct.light.pdf, phase);
    if (HAS_EQUIANGULAR && !direct.light.is_infinite && weight > 0.0) {
        // All three ways share: 1/w = 1/w_direction + (density by angle / density by distance)².
        Equiangular e = direct_equiangular_of(flight, choice, direct.light.target);
        float equiangular = equiangular_pdf(e, flight.distance) / flight.pdf;
        weight = 1.0 / (1.0 / weight + equiangular * equiangular);
    }
    bool is_lit = direct.light.pdf > 0.0 && weight * phase > 0.0;
    direct.value = is_lit ? (weight * phase / direct.light.pdf) * direct.light.radiance : vec3(0.0);
    return direct;
}

// The same for a distance that is drawn by the angle at which a light sees the segment, for throughput one at its origin.
DirectLight direct_along(Medium medium, Flight flight, LightChoice choice, vec4 u, float u_distance)
{
    // The same numbers are the same point of the light from anywhere.
    DirectLight direct;
    direct.light = light_from(choice, flight.origin, u);
    direct.value = vec3(0.0);
    direct.at = flight.origin;
    if (direct.light.is_infinite) {
        return direct;
    }
    Equiangular e = direct_equiangular_of(flight, choice, direct.light.target);
    float distance = equiangular_sample(e, flight.end, u_distance);
    float pdf = equiangular_pdf(e, distance);
    direct.at = flight.origin + distance * flight.direction;
    direct.light = light_from(choice, direct.at, u);
    float phase = phase_value(medium, flight.direction, direct.light.wi);
    // 1/w = 1 + (density by distance / density by angle)² / w_direction, as in direct_in_medium.
    float weight = direct_light_weight(direct.light.is_delta, direct.light.pdf, phase);
    if (pdf > 0.0 && direct.light.pdf > 0.0 && weight * phase > 0.0) {
        float ratio = medium_pdf(medium, flight.channels, distance) / pdf;
        weight = 1.0 / (1.0 + ratio * ratio / weight);
        direct.value = (weight * phase / (pdf * direct.light.pdf)) * direct.light.radiance
            * medium.sigma_s * medium_transmittance(medium, distance);
    }
    return direct;
}

#endif
