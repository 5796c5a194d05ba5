// Traversal by VK_KHR_ray_query. Directions are unit length, t is in metres;
// nothing is culled. Distances outside t_min < t < t_max do not count.
//
// Requires, declared before: layout.glsl (BIND_SCENE, NONE), spec.glsl (HAS_CANDIDATES),
//   struct Hit { float t; vec2 bary; uint instance; uint primitive; uint record; };
//   bool surface_is_opaque(uint instance, uint primitive, vec2 bary);
// and, since it must stand before all declarations, in the entry:
//   #extension GL_EXT_ray_query : require
// `bary` holds the weights of the triangle's second and third vertex; `record` is NONE, and `from` not used.

#ifndef TRAVERSE_QUERY_GLSL
#define TRAVERSE_QUERY_GLSL

layout(binding = BIND_SCENE) uniform accelerationStructureEXT scene;

// Every instance has all bits of its mask set.
const uint QUERY_ALL = 0xFFu;

// A query with t_min > t_max, t_min < 0 or a NaN is undefined behaviour, not a miss.
bool query_is_valid(float t_min, float t_max) {
    return t_min >= 0.0 && t_min <= t_max;
}

// Runs the query to its end. Candidates only exist where geometry is not opaque.
void query_finish(rayQueryEXT query) {
    while (rayQueryProceedEXT(query)) {
        if (!HAS_CANDIDATES) continue;
        if (rayQueryGetIntersectionTypeEXT(query, false) != gl_RayQueryCandidateIntersectionTriangleEXT) continue;
        uint instance = uint(rayQueryGetIntersectionInstanceCustomIndexEXT(query, false));
        uint primitive = uint(rayQueryGetIntersectionPrimitiveIndexEXT(query, false));
        vec2 bary = rayQueryGetIntersectionBarycentricsEXT(query, false);
        if (surface_is_opaque(instance, primitive, bary)) rayQueryConfirmIntersectionEXT(query);
    }
}

void trace_start() {}

bool trace_closest(vec3 origin, vec3 dir, float t_min, float t_max, uint from, out Hit hit) {
    hit = Hit(-1.0, vec2(0.0), NONE, NONE, NONE);
    if (!query_is_valid(t_min, t_max)) return false;
    uint flags = HAS_CANDIDATES ? gl_RayFlagsNoneEXT : gl_RayFlagsOpaqueEXT;
    rayQueryEXT query;
    rayQueryInitializeEXT(query, scene, flags, QUERY_ALL, origin, t_min, dir, t_max);
    query_finish(query);
    if (rayQueryGetIntersectionTypeEXT(query, true) != gl_RayQueryCommittedIntersectionTriangleEXT) return false;
    hit.t = rayQueryGetIntersectionTEXT(query, true);
    hit.bary = rayQueryGetIntersectionBarycentricsEXT(query, true);
    hit.instance = uint(rayQueryGetIntersectionInstanceCustomIndexEXT(query, true));
    hit.primitive = uint(rayQueryGetIntersectionPrimitiveIndexEXT(query, true));
    return true;
}

bool trace_occluded(vec3 origin, vec3 dir, float t_min, float t_max, uint from, uint to) {
    if (!query_is_valid(t_min, t_max)) return false;
    uint flags = gl_RayFlagsTerminateOnFirstHitEXT | (HAS_CANDIDATES ? gl_RayFlagsNoneEXT : gl_RayFlagsOpaqueEXT);
    rayQueryEXT query;
    rayQueryInitializeEXT(query, scene, flags, QUERY_ALL, origin, t_min, dir, t_max);
    query_finish(query);
    return rayQueryGetIntersectionTypeEXT(query, true) != gl_RayQueryCommittedIntersectionNoneEXT;
}

#endif
