// Direct light: what lights give to a surface or a point in a medium, seen through
// everything that lets light straight through, and the weights that share the
// work with scattering that happens to find a light.
//
// [Veach97] §9. [Kulla12] Kulla, Fajardo, Importance Sampling Techniques for Path Tracing in Participating Media.

#ifndef DIRECT_GLSL
#define DIRECT_GLSL

#include "bsdf.glsl"
#include "interior.glsl"
#include "lights.glsl"
#include "medium.glsl"

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

// What a surface lets straight through; the rest of the light it stops.
vec3 direct_through(SurfacePoint s, vec3 wo, bool is_solid, Boundary boundary)
{
    if (!HAS_DIELECTRIC || s.transmission <= 0.0) {
        return vec3(1.0 - s.alpha);
    }
    if (is_solid && boundary.before == boundary.after) {
        return vec3(1.0);
    }
    float eta = is_solid ? interior_eta(boundary) : s.ior;
    float cosine = dot(s.ns, wo);
    return (1.0 - s.alpha) + s.alpha * bsdf_straight(bsdf_of(s, cosine, eta), cosine);
}

// Fraction of light that gets from a light to `origin`, which lies in `interior`.
vec3 direct_visibility(Interior interior, vec3 origin, LightSample light, inout uint rays)
{
    vec3 to = light.target - origin;
    float t_max = light.is_infinite ? T_FAR : length(to);
    vec3 d = light.is_infinite ? light.wi : to / t_max;
    if (!(t_max > 0.0)) {
        return vec3(1.0);
    }
    if (!HAS_BLEND && !HAS_PASSAGE) {
        rays++;
        if (trace_occluded(origin, d, 0.0, t_max)) {
            return vec3(0.0);
        }
        return HAS_MEDIA ? medium_transmittance(scene_medium(interior.current), t_max) : vec3(1.0);
    }
    // Surfaces that let light through are met one after the other, nearest first.
    vec3 through = vec3(1.0);
    float lead = 0.0; // metres that the ray starts ahead of the surface that it left
    while (max_component(through) > 0.0) {
        Hit hit;
        rays++;
        bool is_hit = trace_closest(origin, d, 0.0, t_max, hit);
        if (HAS_MEDIA) {
            through *= medium_transmittance(scene_medium(interior.current), max((is_hit ? hit.t : t_max) + lead, 0.0));
        }
        if (!is_hit) {
            break;
        }
        SurfacePoint s = surface_point(hit, -d);
        bool is_solid = HAS_DIELECTRIC && s.is_solid;
        Boundary boundary;
        boundary.beyond = interior;
        if (is_solid) {
            boundary = interior_boundary(interior, hit, s, d, rays);
        }
        through *= direct_through(s, -d, is_solid, boundary);
        interior = boundary.beyond;
        origin = offset_origin(s.position, s.error, -s.ng);
        lead = dot(origin - s.position, d);
        t_max = light.is_infinite ? T_FAR : dot(light.target - origin, d);
        if (!(t_max > 0.0)) {
            break;
        }
    }
    return through;
}

// Density, relative to that of the flight's own, with which the light at `point` would have drawn its distance.
float direct_equiangular_ratio(Flight flight, vec3 point)
{
    return equiangular_pdf(equiangular_of(flight.origin, flight.direction, flight.end, point), flight.distance) / flight.pdf;
}

// Weight of a light that scattering in a medium found, against direct light from
// there by both ways of drawing the distance.
float direct_found_weight(Flight flight, float pdf_phase, float pdf_light, vec3 point)
{
    if (STRATEGY != STRATEGY_MIS || pdf_light == 0.0) {
        return direct_bsdf_weight(pdf_phase, pdf_light);
    }
    float ratio = pdf_light / pdf_phase;
    float equiangular = direct_equiangular_ratio(flight, point);
    return 1.0 / (1.0 + ratio * ratio * (1.0 + equiangular * equiangular));
}

// Direct light that a point in a medium scatters back along the flight, for throughput one.
vec3 direct_in_medium(Medium medium, Flight flight, vec3 at, Interior interior, vec4 u, inout uint rays)
{
    if (!HAS_LIGHTS) {
        return vec3(0.0);
    }
    LightSample light = light_sample(at, u);
    if (!(light.pdf > 0.0)) {
        return vec3(0.0);
    }
    float phase = phase_value(medium, flight.direction, light.wi);
    float weight = direct_light_weight(light.is_delta, light.pdf, phase);
    if (HAS_EQUIANGULAR && !light.is_infinite && weight > 0.0) {
        // All three ways share: 1/w = 1/w_direction + (density by angle / density by distance)².
        float equiangular = direct_equiangular_ratio(flight, light.target);
        weight = 1.0 / (1.0 / weight + equiangular * equiangular);
    }
    if (!(weight * phase > 0.0)) {
        return vec3(0.0);
    }
    return (weight * phase / light.pdf) * light.radiance * direct_visibility(interior, at, light, rays);
}

// The same for a distance that is drawn by the angle at which a light sees the segment, for throughput one at its origin.
vec3 direct_along(Medium medium, Flight flight, Interior interior, vec4 u, float u_distance, inout uint rays)
{
    // The same numbers choose the same point of the same light from anywhere.
    LightSample light = light_sample(flight.origin, u);
    if (light.is_infinite) {
        return vec3(0.0);
    }
    Equiangular e = equiangular_of(flight.origin, flight.direction, flight.end, light.target);
    flight.distance = equiangular_sample(e, flight.end, u_distance);
    float pdf = equiangular_pdf(e, flight.distance);
    vec3 at = flight.origin + flight.distance * flight.direction;
    light = light_sample(at, u);
    if (!(pdf > 0.0) || !(light.pdf > 0.0)) {
        return vec3(0.0);
    }
    float phase = phase_value(medium, flight.direction, light.wi);
    // 1/w = (density by distance / density by angle)² · (1/w_direction) + 1, as in direct_in_medium.
    float weight = direct_light_weight(light.is_delta, light.pdf, phase);
    flight.pdf = medium_pdf(medium, flight.channels, flight.distance);
    if (!(weight * phase > 0.0)) {
        return vec3(0.0);
    }
    float ratio = flight.pdf / pdf;
    weight = 1.0 / (1.0 + ratio * ratio / weight);
    vec3 scattered = medium.sigma_s * medium_transmittance(medium, flight.distance);
    return (weight * phase / (pdf * light.pdf)) * scattered * light.radiance * direct_visibility(interior, at, light, rays);
}

#endif
