// Traces given rays and returns what they meet: tests, and layers of identities.

#include "invocation.glsl"
#include "surface.glsl"

layout(binding = BIND_PROBE_RAYS, scalar) readonly buffer ProbeRaysBlock { ProbeRay probe_rays[]; };
layout(binding = BIND_PROBE_HITS, scalar) writeonly buffer ProbeHitsBlock { ProbeHit probe_hits[]; };

layout(push_constant, scalar) uniform BatchBlock { Batch batch; };

void main()
{
    uint i = INVOCATION_GROUP * invocation_group() + invocation_place();
    if (i >= batch.sample_count) {
        return;
    }
    trace_start();
    ProbeRay ray = probe_rays[i];
    if (HAS_NESTED) {
        surface_skip_triangle(uvec2(NONE));
    }
    Hit hit;
    bool is_hit = trace_closest(ray.origin, ray.direction, ray.t_min, ray.t_max, ray.from, hit);
    bool is_occluded = trace_occluded(ray.origin, ray.direction, ray.t_min, ray.t_max, ray.from, NONE);
    ProbeHit result = ProbeHit(-1.0, vec2(0.0), NONE, NONE, NONE, is_occluded ? 1u : 0u);
    if (is_hit) {
        result = ProbeHit(hit.t, hit.bary, hit.instance, hit.primitive, hit.record, is_occluded ? 1u : 0u);
    }
    probe_hits[i] = result;
}
