// Neighbouring pixels share what their paths find [Bekaert02]: where the path of a pixel first scatters, light comes from
// the places that its own path and those of its neighbours met next. Each place is weighted by the balance heuristic over
// all pixels that might have found it [Veach97], so that a pixel's expected value is what it is alone.
//
// [Bekaert02] Bekaert, Sbert, Halton, Accelerating Path Tracing by Re-Using Paths.
// [Veach97] §9 (multiple importance sampling).

#ifndef SHARE_GLSL
#define SHARE_GLSL

#include "bsdf.glsl"
#include "math.glsl"
#include "surface.glsl"

// Where a path first scatters, if by a Lambert surface.
struct ShareNear {
    bool is_there;
    vec3 origin;   // of rays: off the surface
    uint record;
    vec3 ng;
    vec3 ns;
    vec3 albedo;
};

// What it met next, if a Lambert surface, which sends the same radiance to all neighbours, or a constant sky.
struct ShareFar {
    bool is_there;
    bool is_infinite;
    vec3 place;    // off the surface; infinite: the direction to it
    vec3 ng;
    vec3 radiance; // that comes from there, without what direct light might have found
};

// Of the path on its way.
ShareNear share_near;
ShareFar share_far;
bool share_is_open; // nothing was met since it scattered
// Radiance that its own pixel has alone: before it scattered, and, yet to be scattered, before it scattered again.
vec3 share_before;
vec3 share_between;

void share_start()
{
    share_near.is_there = false;
    share_far.is_there = false;
    share_far.radiance = vec3(0.0);
    share_is_open = false;
}

bool share_is_lambert(Bsdf bsdf)
{
    return !(HAS_SPECULAR && bsdf.p_specular > 0.0);
}

// The path scatters for the first time. Its throughput starts anew, so that what it finds does not depend on this surface.
void share_scatter(SurfacePoint s, Bsdf bsdf, inout vec3 beta, inout vec3 radiance)
{
    if (share_is_lambert(bsdf)) {
        share_near = ShareNear(true, offset_origin(s.start, s.error, s.ng), s.record, s.ng, s.ns, beta);
        share_is_open = true;
        share_before = radiance;
        share_between = vec3(0.0);
        radiance = vec3(0.0);
        beta = vec3(1.0);
    }
}

// It has met the next surface, and what this emits is counted: the pixel's own, since direct light might have found it.
void share_meet(SurfacePoint s, Bsdf bsdf, inout vec3 radiance)
{
    if (share_is_open && share_is_lambert(bsdf)) {
        share_far = ShareFar(true, false, offset_origin(s.position, s.error, s.ng), s.ng, vec3(0.0));
        share_between = radiance;
        radiance = vec3(0.0);
    }
    share_is_open = false;
}

// It has left the scene along d. Direct light does not look for a constant sky.
void share_escape(vec3 d)
{
    if (share_is_open && !HAS_ENVIRONMENT) {
        share_far = ShareFar(true, true, d, -d, vec3(0.0));
    }
}

// Throughput since the camera.
vec3 share_throughput(vec3 beta) { return share_near.is_there ? share_near.albedo * beta : beta; }

// The path has ended. Gives the radiance that the pixel has alone.
vec3 share_finish(vec3 radiance)
{
    if (!share_near.is_there) {
        return radiance;
    }
    if (share_far.is_there) {
        share_far.radiance = radiance;
        return share_before + share_near.albedo * share_between;
    }
    return share_before + share_near.albedo * radiance;
}

// π times the density, per square metre or steradian, with which the pixel's path goes on to the place; `is_own`: it did.
float share_density(ShareFar far, bool is_own, inout uint rays)
{
    vec3 to = far.is_infinite ? far.place : far.place - share_near.origin;
    float distance2 = dot(to, to);
    if (!share_near.is_there || distance2 == 0.0) {
        return 0.0;
    }
    float distance = far.is_infinite ? T_FAR : sqrt(distance2);
    vec3 d = far.is_infinite ? to : to / distance;
    float here = dot(d, share_near.ns);
    float there = -dot(d, far.ng);
    if (!is_own) {
        if (here <= 0.0 || there <= 0.0 || dot(d, share_near.ng) <= 0.0) {
            return 0.0;
        }
        rays++;
        if (trace_occluded(share_near.origin, d, 0.0, distance, share_near.record, NONE)) {
            return 0.0;
        }
    }
    return abs(here * there) / (far.is_infinite ? 1.0 : distance2);
}

// The sum over the pixels of a block, which are lanes: the same bits in each.
float share_sum(float value)
{
    for (uint bit = 1u; bit < SHARE_COUNT; bit <<= 1u) {
        value += subgroupShuffleXor(value, bit);
    }
    return value;
}

// Light from the places that the paths of the block met. All lanes of the subgroup come here together.
vec3 share_gather(inout uint rays)
{
    vec3 sum = vec3(0.0);
    uint first = gl_SubgroupInvocationID & ~(SHARE_COUNT - 1u);
    // What is not a number goes on, and is counted with its sample.
    bool is_lit = share_far.is_there && share_far.radiance != vec3(0.0);
    for (uint k = 0u; k < SHARE_COUNT; k++) {
        uint lane = first + k;
        ShareFar far;
        far.is_there = subgroupShuffle(is_lit ? 1u : 0u, lane) != 0u;
        far.is_infinite = subgroupShuffle(share_far.is_infinite ? 1u : 0u, lane) != 0u;
        far.place = subgroupShuffle(share_far.place, lane);
        far.ng = subgroupShuffle(share_far.ng, lane);
        far.radiance = subgroupShuffle(share_far.radiance, lane);
        float density = 0.0;
        if (far.is_there) {
            density = share_density(far, gl_SubgroupInvocationID == lane, rays);
        }
        float all = share_sum(density);
        if (density > 0.0) {
            sum += far.radiance * (density / all);
        }
    }
    return share_near.is_there ? share_near.albedo * sum : vec3(0.0);
}

#endif
