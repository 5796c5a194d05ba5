// Traversal by VK_KHR_ray_query. Directions are unit length, t is in metres;
// nothing is culled. Distances outside t_min < t < t_max do not count.
//
// Requires, declared before: layout.glsl (BIND_SCENE, NONE), spec.glsl (HAS_CANDIDATES, HAS_BOXES, HAS_INSTANCES),
//   struct Hit { float t; vec2 bary; uint instance; uint primitive; uint record; };
//   bool surface_is_opaque(uint instance, uint primitive, vec2 bary);
//   void surface_corners(uint instance, uint primitive, out vec3 a, out vec3 b, out vec3 c);
// and, since it must stand before all declarations, in the entry:
//   #extension GL_EXT_ray_query : require
// `bary` holds the weights of the triangle's second and third vertex; `record` is NONE, and `from` not used.

#ifndef TRAVERSE_QUERY_GLSL
#define TRAVERSE_QUERY_GLSL

#include "shear.glsl"

layout(binding = BIND_SCENE) uniform accelerationStructureEXT scene;

// Every instance has all bits of its mask set.
const uint QUERY_ALL = 0xFFu;

// A ray in the space of a group.
struct QueryRay {
    vec3 origin;
    Shear shear;
    uint instance; // that it is for, or NONE
};

// Meets the triangle in the candidate's box, and takes a hit that is nearer.
bool query_box(rayQueryEXT query, inout QueryRay ray, uint instance, uint primitive, float t_min, inout Hit hit) {
    if (HAS_INSTANCES && ray.instance != instance) {
        ray.origin = rayQueryGetIntersectionObjectRayOriginEXT(query, false);
        ray.shear = shear_along(rayQueryGetIntersectionObjectRayDirectionEXT(query, false));
        ray.instance = instance;
    }
    vec3 a, b, c;
    surface_corners(instance, primitive, a, b, c);
    float t;
    vec2 bary;
    if (!shear_meets(ray.shear, ray.origin, a, b, c, t, bary) || !(t > t_min && t < hit.t)) return false;
    bool is_asked = HAS_CANDIDATES && !rayQueryGetIntersectionCandidateAABBOpaqueEXT(query);
    if (is_asked && !surface_is_opaque(instance, primitive, bary)) return false;
    hit = Hit(t, bary, instance, primitive, NONE);
    return true;
}

// Runs a query to its end. Candidates only exist where geometry is not opaque, or is boxes.
bool query_run(uint flags, vec3 origin, vec3 dir, float t_min, float t_max, out Hit hit) {
    hit = Hit(t_max, vec2(0.0), NONE, NONE, NONE);
    // A query with t_min > t_max, t_min < 0 or a NaN is undefined behaviour, not a miss.
    if (!(t_min >= 0.0 && t_min <= t_max)) return false;
    if (!HAS_CANDIDATES) flags |= gl_RayFlagsOpaqueEXT;
    rayQueryEXT query;
    rayQueryInitializeEXT(query, scene, flags, QUERY_ALL, origin, t_min, dir, t_max);
    QueryRay ray = QueryRay(origin, shear_along(dir), NONE);
    while (rayQueryProceedEXT(query)) {
        if (!HAS_CANDIDATES && !HAS_BOXES) continue;
        uint instance = uint(rayQueryGetIntersectionInstanceCustomIndexEXT(query, false));
        uint primitive = uint(rayQueryGetIntersectionPrimitiveIndexEXT(query, false));
        if (HAS_BOXES) {
            if (query_box(query, ray, instance, primitive, t_min, hit)) rayQueryGenerateIntersectionEXT(query, hit.t);
        } else {
            vec2 bary = rayQueryGetIntersectionBarycentricsEXT(query, false);
            if (surface_is_opaque(instance, primitive, bary)) rayQueryConfirmIntersectionEXT(query);
        }
    }
    if (HAS_BOXES) return hit.primitive != NONE;
    if (rayQueryGetIntersectionTypeEXT(query, true) != gl_RayQueryCommittedIntersectionTriangleEXT) return false;
    hit.t = rayQueryGetIntersectionTEXT(query, true);
    hit.bary = rayQueryGetIntersectionBarycentricsEXT(query, true);
    hit.instance = uint(rayQueryGetIntersectionInstanceCustomIndexEXT(query, true));
    hit.primitive = uint(rayQueryGetIntersectionPrimitiveIndexEXT(query, true));
    return true;
}

void trace_start() {}

bool trace_closest(vec3 origin, vec3 dir, float t_min, float t_max, uint from, out Hit hit) {
    return query_run(gl_RayFlagsNoneEXT, origin, dir, t_min, t_max, hit);
}

bool trace_occluded(vec3 origin, vec3 dir, float t_min, float t_max, uint from, uint to) {
    Hit hit;
    return query_run(gl_RayFlagsTerminateOnFirstHitEXT, origin, dir, t_min, t_max, hit);
}

#endif
