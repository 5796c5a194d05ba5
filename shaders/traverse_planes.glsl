// What a ray meets where a scene has a handful of flat pieces: all of them are tested. On lavapipe that is several
// times as fast as a walk, since no lane waits for another and nothing is fetched lane by lane.
//
// The test is a filter. Each piece is made larger and smaller by more than the rounding of this test and of
// bvh_intersect (src/render/planes.rs has the bounds), so it tells which piece a ray surely meets first, or that it
// surely meets none. The few rays of which it is not sure walk the tree. So hits are those of the tree, to the bit.
//
// Requires: layout.glsl, spec.glsl, params, bvh_intersect(), bvh_ray().

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

void planes_read() {
    [[unroll]] for (uint i = 0u; i < PLANE_COUNT; i++) {
        int at = int(PLANE_TEXELS * i);
        uvec4 a = texelFetch(planes_given, at);
        uvec4 b = texelFetch(planes_given, at + 1);
        uvec4 c = texelFetch(planes_given, at + 2);
        uvec4 d = texelFetch(planes_given, at + 3);
        uvec4 e = texelFetch(planes_given, at + 4);
        planes[i] = Plane(uintBitsToFloat(a.xyz), uintBitsToFloat(a.w), uintBitsToFloat(b.xyz), uintBitsToFloat(b.w),
                          uintBitsToFloat(c.xyz), uintBitsToFloat(c.w), uintBitsToFloat(d.x), uintBitsToFloat(d.y), d.z, d.w,
                          e.x, 0u, 0u, 0u);
    }
}

// A ray, and what is known of it.
struct PlaneSearch {
    vec3 origin;    // from params.planes_center
    vec3 dir;
    float t_min;
    uint from;      // record that the ray leaves …
    uint to;        // … and triangle that it ends before, or NONE
    uint record;    // that it meets first, or NONE: between these distances, or t_max
    float nearest;
    float farthest;
    bool is_sure;
};

void planes_test(inout PlaneSearch s, Plane plane, bool is_triangle) {
    float inverse = 1.0 / dot(s.dir, plane.normal);
    float t = -(dot(s.origin, plane.normal) + plane.offset) * inverse;
    vec3 at = s.origin + t * s.dir;
    float u = dot(at, plane.u) + plane.u_offset;
    float v = dot(at, plane.v) + plane.v_offset;
    // Positive inside. Comparisons instead of min, as in bvh_four_hits.
    precise float a = is_triangle ? u : 1.0 - abs(u);
    precise float b = is_triangle ? v : 1.0 - abs(v);
    precise float inside = a < b ? a : b;
    if (is_triangle) {
        precise float c = 1.0 - u - v;
        inside = c < inside ? c : inside;
    }
    float slope = abs(inverse);
    float edge = plane.edge_error * slope;
    float least = t - plane.t_error * slope;
    float most = t + plane.t_error * slope;
    bool is_left = plane.record == s.from || plane.first_triangle == s.to || plane.second_triangle == s.to;
    // Of what is not a number neither is true.
    bool is_out = is_left || inside < -edge || most <= s.t_min || least >= s.farthest;
    bool is_in = !is_left && inside > edge && least > s.t_min && most < s.nearest;
    s.is_sure = s.is_sure && (is_out || is_in);
    s.nearest = is_in ? least : s.nearest;
    s.farthest = is_in ? most : s.farthest;
    s.record = is_in ? plane.record : s.record;
}

PlaneSearch planes_search(vec3 origin, vec3 dir, float t_min, float t_max, uint from, uint to) {
    vec3 start = origin - params.planes_center;
    bool is_near = all(lessThanEqual(abs(start), params.planes_extent));
    PlaneSearch s = PlaneSearch(start, dir, t_min, from, to, NONE, t_max, t_max, is_near);
    [[unroll]] for (uint i = 0u; i < PARALLELOGRAM_COUNT; i++) planes_test(s, planes[i], false);
    [[unroll]] for (uint i = 0u; i < TRIANGLE_COUNT; i++) planes_test(s, planes[PARALLELOGRAM_COUNT + i], true);
#ifdef TRACE_COUNTS
    bvh_steps++;
    bvh_lane_steps += subgroupElect() ? gl_SubgroupSize : 0u;
#endif
    return s;
}

// Whether it is known what the ray meets first; puts it into `hit`, whose t is t_max.
bool planes_closest(vec3 origin, vec3 dir, float t_min, float t_max, uint from, inout Hit hit) {
    if (PLANE_COUNT == 0u) return false;
    PlaneSearch s = planes_search(origin, dir, t_min, t_max, from, NONE);
    if (!s.is_sure || s.record == NONE) return s.is_sure;
    uint record = 4u * s.record;
#ifdef TRACE_COUNTS
    bvh_records_read++;
#endif
    return bvh_intersect(bvh_ray(origin, dir), record, bvh_record_texel(record, 0), 0u, t_min, hit);
}

// Whether it is known if the ray meets anything; if so, `hit` then has some primitive.
bool planes_occluded(vec3 origin, vec3 dir, float t_min, float t_max, uint from, uint to, inout Hit hit) {
    if (PLANE_COUNT == 0u) return false;
    PlaneSearch s = planes_search(origin, dir, t_min, t_max, from, to);
    hit.primitive = s.record;
    return s.is_sure || s.record != NONE;
}

#endif
