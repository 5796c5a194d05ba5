// Traversal by VK_KHR_ray_tracing_pipeline, in a ray generation shader. Directions are
// unit length, t is in metres; nothing is culled. Distances outside t_min < t < t_max do
// not count.
//
// Requires, declared before: layout.glsl (BIND_SCENE, NONE), spec.glsl (HAS_CANDIDATES), struct Hit,
//   SurfaceSkip surface_skip, which candidates (trace.rahit) are told;
// and, since it must stand before all declarations, in the entry:
//   #extension GL_EXT_ray_tracing : require
// `record` is NONE, and `from` not used.

#ifndef TRAVERSE_PIPELINE_GLSL
#define TRAVERSE_PIPELINE_GLSL

#include "trace_payload.glsl"

layout(binding = BIND_SCENE) uniform accelerationStructureEXT scene;
layout(location = 0) rayPayloadEXT TracePayload trace_payload;

// Every instance has all bits of its mask set.
const uint TRACE_ALL = 0xFFu;

// Sends a ray; false when it met nothing. The first records of hit and miss are the only ones.
bool trace_send(uint flags, vec3 origin, vec3 dir, float t_min, float t_max) {
    // A ray with t_min > t_max, t_min < 0 or a NaN is undefined behaviour, not a miss.
    if (!(t_min >= 0.0 && t_min <= t_max)) return false;
    flags |= HAS_CANDIDATES ? gl_RayFlagsNoneEXT : gl_RayFlagsOpaqueEXT;
    // Without a closest-hit shader nobody changes the distance of what was met.
    trace_payload.t = 0.0;
    if (HAS_NESTED) payload_put(trace_payload, surface_skip);
    traceRayEXT(scene, flags, TRACE_ALL, 0u, 0u, 0u, origin, t_min, dir, t_max, 0);
    return trace_payload.t >= 0.0;
}

void trace_start() {}

bool trace_closest(vec3 origin, vec3 dir, float t_min, float t_max, uint from, out Hit hit) {
    hit = Hit(-1.0, vec2(0.0), NONE, NONE, NONE);
    if (!trace_send(gl_RayFlagsNoneEXT, origin, dir, t_min, t_max)) return false;
    hit = Hit(trace_payload.t, trace_payload.bary, trace_payload.instance, trace_payload.primitive, NONE);
    return true;
}

bool trace_occluded(vec3 origin, vec3 dir, float t_min, float t_max, uint from, uint to) {
    uint flags = gl_RayFlagsTerminateOnFirstHitEXT | gl_RayFlagsSkipClosestHitShaderEXT;
    return trace_send(flags, origin, dir, t_min, t_max);
}

#endif
