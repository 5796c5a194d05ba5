// One ray for each probe ray: the body of rays.comp and rays.rgen.
#include "layout.glsl"
#include "spec.glsl"

layout(binding = BIND_PROBE_RAYS, scalar) readonly buffer Rays { ProbeRay rays[]; };
layout(binding = BIND_PROBE_HITS, scalar) writeonly buffer Hits { ProbeHit hits[]; };
layout(push_constant) uniform Push { uint count; } push;

struct Hit { float t; vec2 bary; uint instance; uint primitive; uint record; };

bool surface_is_opaque(uint instance, uint primitive, vec2 bary) {
    return (primitive & 1u) == 0u;
}

// The triangles of tests/gpu/rays.rs.
void surface_corners(uint instance, uint primitive, out vec3 a, out vec3 b, out vec3 c) {
    float z = -float(primitive);
    a = vec3(0.0, 0.0, z);
    b = vec3(1.0, 0.0, z);
    c = vec3(0.0, 1.0, z);
}

#ifdef TRAVERSE_PIPELINE
#include "traverse_pipeline.glsl"
#else
#include "traverse_query.glsl"
#endif

void rays_trace(uint i) {
    if (i >= push.count) return;
    ProbeRay ray = rays[i];
    Hit hit;
    if (!trace_closest(ray.origin, ray.direction, ray.t_min, ray.t_max, ray.from, hit)) hit.t = -1.0;
    bool occluded = trace_occluded(ray.origin, ray.direction, ray.t_min, ray.t_max, ray.from, NONE);
    hits[i] = ProbeHit(hit.t, hit.bary, hit.instance, hit.primitive, hit.record, occluded ? 1u : 0u);
}
