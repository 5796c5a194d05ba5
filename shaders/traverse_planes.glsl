// What a ray meets where a scene has a handful of flat pieces: all of them are tested. On lavapipe that is several
// times as fast as a walk, since no lane waits for another and nothing is fetched lane by lane.
//
// The test is a filter. Each piece is made larger and smaller by more than the rounding of this test and of
// bvh_intersect (src/render/planes.rs has the bounds), so it tells which piece a ray surely meets first, or that it
// surely meets none. The few rays of which it is not sure walk the tree. So hits are those of the tree, to the bit.
//
// Requires: layout.glsl, math.glsl, spec.glsl, params, bvh_intersect(), bvh_ray().

#ifndef TRAVERSE_PLANES_GLSL
#define TRAVERSE_PLANES_GLSL

const uint PLANE_COUNT = PARALLELOGRAM_COUNT + TRIANGLE_COUNT;

#ifdef ADDRESSES
#define planes_given(i) scene_quad(BIND_PLANES, i)
#else
layout(binding = BIND_PLANES) uniform usamplerBuffer planes_given;
#endif

// For as long as the invocation runs: lavapipe makes a branch for each word of a uniform buffer, which takes longer than the
// test, and a kernel that has hundreds compiles long.
Plane planes[PLANES_MAX];

// A vector of piece i without what is known to be 0.
vec3 planes_known(vec3 v, uint i, uint without_x, uint without_y, uint without_z) {
    bvec3 is_zero = notEqual(uvec3(without_x, without_y, without_z) >> i & 1u, uvec3(0u));
    return mix(v, vec3(0.0), is_zero);
}

// The normal of piece i; one along an axis points that way (src/render/planes.rs).
vec3 planes_normal(vec3 v, uint i) {
    vec3 n = planes_known(v, i, NORMAL_WITHOUT_X, NORMAL_WITHOUT_Y, NORMAL_WITHOUT_Z);
    uint only_x = NORMAL_WITHOUT_Y & NORMAL_WITHOUT_Z;
    uint only_y = NORMAL_WITHOUT_Z & NORMAL_WITHOUT_X;
    uint only_z = NORMAL_WITHOUT_X & NORMAL_WITHOUT_Y;
    bvec3 is_one = notEqual(uvec3(only_x, only_y, only_z) >> i & 1u, uvec3(0u));
    return mix(n, vec3(1.0), is_one);
}

void planes_read() {
    [[unroll]] for (uint i = 0u; i < PLANE_COUNT; i++) {
        int at = int(PLANE_TEXELS * i);
        uvec4 a = texelFetch(planes_given, at);
        uvec4 b = texelFetch(planes_given, at + 1);
        uvec4 c = texelFetch(planes_given, at + 2);
        uvec4 d = texelFetch(planes_given, at + 3);
        uvec4 e = texelFetch(planes_given, at + 4);
        vec3 normal = planes_normal(uintBitsToFloat(a.xyz), i);
        vec3 u = planes_known(uintBitsToFloat(b.xyz), i, U_WITHOUT_X, U_WITHOUT_Y, U_WITHOUT_Z);
        vec3 v = planes_known(uintBitsToFloat(c.xyz), i, V_WITHOUT_X, V_WITHOUT_Y, V_WITHOUT_Z);
        planes[i] = Plane(normal, uintBitsToFloat(a.w), u, uintBitsToFloat(b.w), v, uintBitsToFloat(c.w), uintBitsToFloat(d.x),
                          uintBitsToFloat(d.y), d.z, d.w, e.x, 0u, 0u, 0u);
    }
}

// A ray as the test reads it.
struct PlaneRay {
    vec3 origin; // from params.planes_center
    vec3 dir;
    float t_min;
    bool is_near; // starts where the bounds hold
};

// Where a ray meets a piece: between two distances, surely or not.
struct PlaneMeeting {
    float least;
    float most;
    bool is_sure;
    bool is_possible;
};

PlaneRay planes_ray(vec3 origin, vec3 dir, float t_min) {
#ifdef TRACE_COUNTS
    bvh_steps++;
    bvh_lane_steps += subgroupElect() ? gl_SubgroupSize : 0u;
#endif
    vec3 start = origin - params.planes_center;
    return PlaneRay(start, dir, t_min, all(lessThanEqual(abs(start), params.planes_extent)));
}

// Surely met are pieces before the distance `nearest`, possibly met those before `farthest`, if the ray neither leaves them nor
// ends on them. Conditions are joined so that each is one comparison under the mask of the one before. No comparison with what
// is not a number is true, so that such a piece is possible and not sure.
PlaneMeeting planes_meet(PlaneRay ray, Plane plane, bool is_triangle, bool is_other, float nearest, float farthest) {
    float inverse = -1.0 / dot(ray.dir, plane.normal);
    float t = (dot(ray.origin, plane.normal) + plane.offset) * inverse;
    vec3 at = ray.origin + t * ray.dir;
    float u = dot(at, plane.u) + plane.u_offset;
    float v = dot(at, plane.v) + plane.v_offset;
    // Largest at the edges, where it is 0 or 1.
    float bound = is_triangle ? 0.0 : 1.0;
    float reach = is_triangle ? larger(larger(-u, -v), u + v - 1.0) : larger(abs(u), abs(v));
    float slope = abs(inverse);
    float edge = plane.edge_error * slope;
    float least = t - plane.t_error * slope;
    float most = t + plane.t_error * slope;
    precise bool is_sure = is_other && reach < bound - edge && least > ray.t_min && most < nearest;
    precise bool is_possible = is_other && !(reach > bound + edge) && !(most <= ray.t_min) && !(least >= farthest);
    return PlaneMeeting(least, most, is_sure, is_possible);
}

// Whether it is known what the ray meets first; puts it into `hit`, whose t is t_max.
bool planes_closest(vec3 origin, vec3 dir, float t_min, float t_max, uint from, inout Hit hit) {
    if (PLANE_COUNT == 0u) return false;
    PlaneRay ray = planes_ray(origin, dir, t_min);
    bool is_known = ray.is_near;
    uint record = NONE;
    float nearest = t_max;
    float farthest = t_max;
    [[unroll]] for (uint i = 0u; i < PLANE_COUNT; i++) {
        bool is_other = planes[i].record != from;
        PlaneMeeting m = planes_meet(ray, planes[i], i >= PARALLELOGRAM_COUNT, is_other, nearest, farthest);
        is_known = is_known && (m.is_sure || !m.is_possible);
        nearest = m.is_sure ? m.least : nearest;
        farthest = m.is_sure ? m.most : farthest;
        record = m.is_sure ? planes[i].record : record;
    }
    if (!is_known || record == NONE) return is_known;
    record *= 4u;
#ifdef TRACE_COUNTS
    bvh_records_read++;
#endif
    return bvh_intersect(bvh_ray(origin, dir), record, bvh_record_texel(record, 0), 0u, t_min, hit);
}

// Whether it is known if the ray meets anything; if so, `hit` then has some primitive.
bool planes_occluded(vec3 origin, vec3 dir, float t_min, float t_max, uint from, uint to, inout Hit hit) {
    if (PLANE_COUNT == 0u) return false;
    PlaneRay ray = planes_ray(origin, dir, t_min);
    bool is_met = false;
    bool is_possible = false;
    [[unroll]] for (uint i = 0u; i < PLANE_COUNT; i++) {
        bool is_other = planes[i].record != from && planes[i].first_triangle != to && planes[i].second_triangle != to;
        PlaneMeeting m = planes_meet(ray, planes[i], i >= PARALLELOGRAM_COUNT, is_other, t_max, t_max);
        is_met = is_met || m.is_sure;
        is_possible = is_possible || m.is_possible;
    }
    hit.primitive = is_met ? 0u : NONE;
    return ray.is_near && (is_met || !is_possible);
}

#endif
