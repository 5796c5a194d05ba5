// A ray meets opaque geometry: walk of the project's own BVH, an eight-wide tree
// with quantised boxes [Ylitie17]. The format is documented in src/bvh/mod.rs;
// src/bvh/traverse.rs mirrors this file on the host.
//
// No gaps: neither between triangles (shear.glsl) nor boxes, which contain their triangles
// exactly and are enlarged by more than the rounding of both tests.
//
// Requires: layout.glsl, spec.glsl, struct Hit, params, instances, surface_is_opaque().
//
// [Ylitie17] Ylitie, Karras, Laine: Efficient incoherent ray traversal on GPUs through
//            compressed wide BVHs. High-Performance Graphics 2017.

#ifndef TRAVERSE_SOFTWARE_GLSL
#define TRAVERSE_SOFTWARE_GLSL

#include "math.glsl"
#include "shear.glsl"

#ifdef WGPU
layout(binding = BIND_BVH_NODES, scalar) readonly buffer BvhNodesBlock { uvec4 bvh_nodes[]; };
layout(binding = BIND_BVH_TRIANGLES, scalar) readonly buffer BvhTrianglesBlock { uvec4 bvh_triangles[]; };
#elif defined(ADDRESSES)
#define bvh_nodes(i) scene_quad(BIND_BVH_NODES, i)
#define bvh_triangles(i) scene_quad(BIND_BVH_TRIANGLES, i)
#else
layout(binding = BIND_BVH_NODES) uniform usamplerBuffer bvh_nodes;
layout(binding = BIND_BVH_TRIANGLES) uniform usamplerBuffer bvh_triangles;
layout(binding = BIND_SMALL_NODES, scalar) uniform SmallNodesBlock { uvec4 bvh_small_nodes[SMALL_TEXELS]; };
layout(binding = BIND_SMALL_RECORDS, scalar) uniform SmallRecordsBlock { uvec4 bvh_small_records[SMALL_TEXELS]; };
#endif

// The builder bounds the depth of both levels so that this is enough.
const uint BVH_STACK_SIZE = 32u;
// Rounding of box and triangle test relative to the distance, 19 × 2⁻²⁴, rounded up to 2⁻¹⁹.
const float BVH_BOX_ROUNDING = 1.0 / 524288.0;
// 2⁻⁸⁰: slopes of directions closer to an axis plane would overflow; the ray bends by less than rounding.
const float BVH_MIN_DIRECTION = 8.271806125530277e-25;
// A set bit among these: the entry is a group of nodes. Otherwise it is a group of leaf records.
const uint BVH_NODE_BITS = 0xFF000000u;
// Fourth word of a record's third texel.
const uint BVH_FIRST_MASKED = 1u;
const uint BVH_SECOND_MASKED = 2u;
const uint BVH_FIRST_TURN = 2u; // shift of two bits
const uint BVH_SECOND_TURN = 4u;
const uint BVH_FLAT = 64u;
const uint BVH_NODE_RECORDS = 24u; // of a node at most

// Texel k of a node or a leaf record.
uvec4 bvh_node_texel(Row row, int k) {
#if !defined(WGPU) && !defined(ADDRESSES)
    if (HAS_SMALL_NODES) return bvh_small_nodes[row + k];
#endif
    return row_fetch(bvh_nodes, row, k);
}
uvec4 bvh_record_texel(uint record, int k) {
#if !defined(WGPU) && !defined(ADDRESSES)
    if (HAS_SMALL_RECORDS) return bvh_small_records[record + uint(k)];
#endif
    Row row = row_of(BIND_BVH_TRIANGLES, record);
    return row_fetch(bvh_triangles, row, k);
}

// What is computed once for a ray in one space.
struct BvhRay {
    vec3 origin;
    vec3 inverse;       // of the direction, finite
    Shear shear;
    bvec3 negative;     // the direction points down
    uint octant;        // flips slots so that higher ones are nearer, in each byte
};

BvhRay bvh_ray(vec3 origin, vec3 d) {
    BvhRay ray;
    ray.origin = origin;
    ray.negative = lessThan(d, vec3(0.0));
    vec3 magnitude = larger(abs(d), vec3(BVH_MIN_DIRECTION));
    ray.inverse = 1.0 / mix(magnitude, -magnitude, ray.negative);
    ray.octant = (ray.negative.x ? 0u : 0x04040404u) | (ray.negative.y ? 0u : 0x02020202u) |
                 (ray.negative.z ? 0u : 0x01010101u);
    ray.shear = shear_along(d);
    return ray;
}

// The four bytes of a word, and the planes that they stand for.
uvec4 bvh_bytes(uint word) { return (uvec4(word) >> uvec4(0u, 8u, 16u, 24u)) & 0xFFu; }
vec4 bvh_planes(uint word, float scale, float offset) { return vec4(bvh_bytes(word)) * scale + offset; }

// Bits of four children that the ray may meet.
uint bvh_four_hits(uvec3 near_words, uvec3 far_words, vec3 scale, vec3 near_offset, vec3 far_offset,
                   float t_min, float t_max, uint meta, uint octant) {
    // Compared as integers: min and max of floats take three instructions each on lavapipe for the sake of NaN.
    // Bits of floats that are not negative are in the same order, and t_min is not, so a negative distance is below it.
    precise ivec4 nx = floatBitsToInt(bvh_planes(near_words.x, scale.x, near_offset.x));
    precise ivec4 ny = floatBitsToInt(bvh_planes(near_words.y, scale.y, near_offset.y));
    precise ivec4 nz = floatBitsToInt(bvh_planes(near_words.z, scale.z, near_offset.z));
    precise ivec4 fx = floatBitsToInt(bvh_planes(far_words.x, scale.x, far_offset.x));
    precise ivec4 fy = floatBitsToInt(bvh_planes(far_words.y, scale.y, far_offset.y));
    precise ivec4 fz = floatBitsToInt(bvh_planes(far_words.z, scale.z, far_offset.z));
    ivec4 near = max(max(nx, ny), max(nz, ivec4(floatBitsToInt(t_min))));
    ivec4 far = min(min(fx, fy), min(fz, ivec4(floatBitsToInt(t_max))));
    // Low five bits of a slot's byte: 24 + slot for a node, offset of the record for a leaf. Upper three: 001 for
    // a node, number of records in unary for a leaf.
    uint is_node = ((meta & (meta << 1)) & 0x10101010u) >> 4;
    uvec4 index = bvh_bytes((meta ^ (octant & (is_node * 0xFFu))) & 0x1F1F1F1Fu);
    uvec4 bits = bvh_bytes((meta >> 5) & 0x07070707u) << index;
    bits = mix(uvec4(0u), bits, lessThanEqual(near, far));
    return bits.x | bits.y | bits.z | bits.w;
}

// Visits a node: children in the upper byte of `nodes.y` in order of visit, records in `leaves.y`.
void bvh_visit(uint index, BvhRay ray, float t_min, float t_max, out uvec2 nodes, out uvec2 leaves) {
    Row row = row_of(BIND_BVH_NODES, 5u * index);
    // The first and the last at once: a node lies in two cache lines, and so one is waited for while the other comes.
    uvec4 head = bvh_node_texel(row, 0);
    uvec4 z = bvh_node_texel(row, 4);
    uvec4 links = bvh_node_texel(row, 1);
    uvec4 x = bvh_node_texel(row, 2);
    uvec4 y = bvh_node_texel(row, 3);

    vec3 cell = uintBitsToFloat(((uvec3(head.w) >> uvec3(0u, 8u, 16u)) & 0xFFu) << 23u);
    vec3 from_origin = uintBitsToFloat(head.xyz) - ray.origin;
    // The far side of the box along any axis bounds every distance in it.
    vec3 reach = abs(from_origin) + 255.0 * cell;
    float pad = larger(reach.x, larger(reach.y, reach.z)) * BVH_BOX_ROUNDING;
    vec3 scale = cell * ray.inverse;
    vec3 offset = from_origin * ray.inverse;
    vec3 slack = abs(ray.inverse) * pad;

    if (ray.negative.x) x = x.zwxy;
    if (ray.negative.y) y = y.zwxy;
    if (ray.negative.z) z = z.zwxy;
    uint hits = bvh_four_hits(uvec3(x.x, y.x, z.x), uvec3(x.z, y.z, z.z), scale, offset - slack, offset + slack,
                              t_min, t_max, links.z, ray.octant) |
                bvh_four_hits(uvec3(x.y, y.y, z.y), uvec3(x.w, y.w, z.w), scale, offset - slack, offset + slack,
                              t_min, t_max, links.w, ray.octant);
    nodes = uvec2(links.x, (hits & BVH_NODE_BITS) | (head.w >> 24));
    leaves = uvec2(links.y, hits & ~BVH_NODE_BITS);
}

// Edge functions of a triangle of a record as weights of the second and third vertex of the scene's triangle, which
// the record holds turned.
vec2 bvh_weights(vec3 edges, float sum, uint turn) {
    vec2 weights = turn == 0u ? edges.yz : turn == 1u ? edges.xy : edges.zx;
    return weights / sum;
}

// Meets a record's triangles, v0 v1 v2 and v0 v2 v3, and takes a hit that is nearer.
bool bvh_intersect(BvhRay ray, uint record, uvec4 v0, uint instance, float t_min, inout Hit hit) {
    uvec4 v1 = bvh_record_texel(record, 1);
    uvec4 v2 = bvh_record_texel(record, 2);
    uvec4 v3 = bvh_record_texel(record, 3);
    vec3 a = shear_vertex(ray.shear, ray.origin, uintBitsToFloat(v0.xyz));
    vec3 b = shear_vertex(ray.shear, ray.origin, uintBitsToFloat(v1.xyz));
    vec3 c = shear_vertex(ray.shear, ray.origin, uintBitsToFloat(v2.xyz));
    vec3 d = shear_vertex(ray.shear, ray.origin, uintBitsToFloat(v3.xyz));
    vec3 first = vec3(shear_cross(c, b), shear_cross(a, c), shear_cross(b, a));
    // The common edge runs the other way, which negates its function exactly.
    vec3 second = vec3(shear_cross(d, c), shear_cross(a, d), -first.y);
    float first_sum = first.x + first.y + first.z;
    float second_sum = second.x + second.y + second.z;
    // A mean of the vertices' depths: never beyond the triangle, even where it is seen edge-on.
    float first_t = a.z + (first.y * (b.z - a.z) + first.z * (c.z - a.z)) / first_sum;
    float second_t = a.z + (second.y * (c.z - a.z) + second.z * (d.z - a.z)) / second_sum;
    // Where there is no second triangle v3 equals v0, which makes its sum 0.
    bool meets_first = shear_inside(first) && first_sum != 0.0 && first_t > t_min && first_t < hit.t;
    bool meets_second = shear_inside(second) && second_sum != 0.0 && second_t > t_min && second_t < hit.t;
    if (HAS_CANDIDATES) {
        if (meets_first && (v2.w & BVH_FIRST_MASKED) != 0u) {
            vec2 bary = bvh_weights(first, first_sum, v2.w >> BVH_FIRST_TURN & 3u);
            meets_first = surface_is_opaque(instance, v0.w, bary);
        }
        if (meets_second && (v2.w & BVH_SECOND_MASKED) != 0u) {
            vec2 bary = bvh_weights(second, second_sum, v2.w >> BVH_SECOND_TURN & 3u);
            meets_second = surface_is_opaque(instance, v1.w, bary);
        }
    }
    if (!meets_first && !meets_second) {
        return false;
    }
    bool is_second = meets_second && !(meets_first && first_t <= second_t);
    uint turn = v2.w >> (is_second ? BVH_SECOND_TURN : BVH_FIRST_TURN) & 3u;
    vec2 bary = bvh_weights(is_second ? second : first, is_second ? second_sum : first_sum, turn);
    // The same record is in several places where its group is.
    uint name = !HAS_INSTANCES && (v2.w & BVH_FLAT) != 0u ? record >> 2u : NONE;
    hit = Hit(is_second ? second_t : first_t, bary, instance, is_second ? v1.w : v0.w, name);
    return true;
}

// The stack of groups that wait: its two newest entries, and the others in pairs below them. On lavapipe a masked
// store to indexed memory becomes a branch for each lane and word, so the two oldest pairs are chosen by comparison;
// more are rare. An entry's second word is never 0.
uvec2 bvh_newest;
uvec2 bvh_older;      // 0 where bvh_newest is
uint bvh_height;      // entries below them, even
uvec4 bvh_first_pair; // the older entry before the newer one
uvec4 bvh_second_pair;
uvec2 bvh_spilled[BVH_STACK_SIZE]; // at their height

void bvh_push(uvec2 entry) {
    if (bvh_older.y != 0u) {
        uvec4 pair = uvec4(bvh_older, bvh_newest);
        bvh_first_pair = bvh_height == 0u ? pair : bvh_first_pair;
        bvh_second_pair = bvh_height == 2u ? pair : bvh_second_pair;
        if (bvh_height >= 4u) {
            bvh_spilled[bvh_height] = bvh_older;
            bvh_spilled[bvh_height + 1u] = bvh_newest;
        }
        bvh_height += 2u;
        bvh_newest = uvec2(0u);
    }
    bvh_older = bvh_newest;
    bvh_newest = entry;
}

// The newest entry; its second word is 0 when there is none.
uvec2 bvh_pop() {
    uvec2 entry = bvh_newest;
    bvh_newest = bvh_older;
    bvh_older = uvec2(0u);
    if (entry.y == 0u && bvh_height != 0u) {
        bvh_height -= 2u;
        uvec4 pair = bvh_height == 2u ? bvh_second_pair : bvh_first_pair;
        if (bvh_height >= 4u) pair = uvec4(bvh_spilled[bvh_height], bvh_spilled[bvh_height + 1u]);
        bvh_newest = pair.xy;
        entry = pair.zw;
    }
    return entry;
}

uint bvh_waiting() { return bvh_height + (bvh_newest.y != 0u ? 1u : 0u) + (bvh_older.y != 0u ? 1u : 0u); }

#ifdef TRACE_COUNTS
// What this invocation did; for the limit report.
uint bvh_nodes_visited = 0u;
uint bvh_records_read = 0u;
uint bvh_steps = 0u;
uint bvh_lane_steps = 0u; // of all lanes of the subgroup, idle ones included; counted by one of them
#endif

// Both traversals; `any_hit` ends at the first hit and is a literal at both calls.
void bvh_trace(vec3 origin, vec3 dir, float t_min, float t_max, uint from, bool any_hit, out Hit hit) {
    bvh_height = 0u;
    bvh_newest = uvec2(0u);
    bvh_older = uvec2(0u);
    uint base = 0u; // entries that wait when the instance is left
    BvhRay ray = bvh_ray(origin, dir);
    uint instance = HAS_INSTANCES ? NONE : 0u; // NONE: in the top level
    uvec2 nodes = uvec2(params.bvh_root, 0x80000000u);
    uvec2 leaves = uvec2(0u);
    hit = Hit(t_max, vec2(0.0), NONE, NONE, NONE);
#ifdef TRACE_COUNTS
    uint steps = 0u;
#endif
    while (true) {
#ifdef TRACE_COUNTS
        steps++;
#endif
        if (leaves.y == 0u) {
            if ((nodes.y & BVH_NODE_BITS) == 0u) {
                if (HAS_INSTANCES && instance != NONE && bvh_waiting() == base) {
                    instance = NONE;
                    ray = bvh_ray(origin, dir);
                }
                nodes = bvh_pop();
                if (nodes.y == 0u) break;
            }
            if (HAS_INSTANCES && (nodes.y & BVH_NODE_BITS) == 0u) {
                leaves = nodes;
            } else {
                uint bit = uint(findMSB(nodes.y));
                uint slot = (bit - 24u) ^ (ray.octant & 7u);
                uint index = nodes.x + bitCount(nodes.y & ~(0xFFFFFFFFu << slot) & 0xFFu);
                nodes.y &= ~(1u << bit);
                if ((nodes.y & BVH_NODE_BITS) != 0u) bvh_push(nodes);
                bvh_visit(index, ray, t_min, hit.t, nodes, leaves);
#ifdef TRACE_COUNTS
                bvh_nodes_visited++;
#endif
                // The box of a plane that the ray leaves is always met.
                uint place = from - leaves.x;
                if (!HAS_INSTANCES) leaves.y &= ~(place < BVH_NODE_RECORDS ? 1u << place : 0u);
            }
        }
        // One record before the next node: lanes that have more wait less for those that have none.
        if (leaves.y != 0u) {
            uint record = 4u * (leaves.x + uint(findLSB(leaves.y)));
            leaves.y &= leaves.y - 1u;
            uvec4 v0 = bvh_record_texel(record, 0);
#ifdef TRACE_COUNTS
            bvh_records_read++;
#endif
            if (HAS_INSTANCES && instance == NONE) {
                // A leaf entry of the top level: leave what remains for later and enter the group.
                if ((nodes.y & BVH_NODE_BITS) != 0u) bvh_push(nodes);
                if (leaves.y != 0u) bvh_push(leaves);
                base = bvh_waiting();
                instance = v0.w;
                Instance placed = scene_instance(instance);
                nodes = uvec2(placed.bvh_root, 0x80000000u);
                leaves.y = 0u;
                vec3 x = placed.object_from_world_x;
                vec3 y = placed.object_from_world_y;
                vec3 z = placed.object_from_world_z;
                vec3 moved = x * origin.x + y * origin.y + z * origin.z + placed.object_from_world_t;
                ray = bvh_ray(moved, x * dir.x + y * dir.y + z * dir.z);
            } else if (bvh_intersect(ray, record, v0, instance, t_min, hit) && any_hit) {
                // Nothing left to do: the loop ends by itself.
                nodes.y = 0u;
                leaves.y = 0u;
                bvh_height = 0u;
                bvh_newest = uvec2(0u);
                bvh_older = uvec2(0u);
            }
        }
    }
#ifdef TRACE_COUNTS
    bvh_steps += steps;
    uint longest = subgroupMax(steps);
    bvh_lane_steps += subgroupElect() ? longest * gl_SubgroupSize : 0u;
#endif
}

#ifdef WGPU
// Kernels for wgpu walk the tree alone.
void planes_read() {}
bool planes_closest(vec3 origin, vec3 dir, float t_min, float t_max, uint from, inout Hit hit) { return false; }
bool planes_occluded(vec3 origin, vec3 dir, float t_min, float t_max, uint from, uint to, inout Hit hit) { return false; }
#else
#include "traverse_planes.glsl"
#endif

#ifdef TRACE_RECORDS
#include "stream.glsl"
#endif

void trace_start() { planes_read(); }

bool trace_closest(vec3 origin, vec3 dir, float t_min, float t_max, uint from, out Hit hit) {
    hit = Hit(t_max, vec2(0.0), NONE, NONE, NONE);
    if (!planes_closest(origin, dir, t_min, t_max, from, hit)) bvh_trace(origin, dir, t_min, t_max, from, false, hit);
#ifdef TRACE_RECORDS
    stream_keep(origin, dir, t_max, from, NONE, 0u, hit);
#endif
    return hit.primitive != NONE;
}

bool trace_occluded(vec3 origin, vec3 dir, float t_min, float t_max, uint from, uint to) {
    Hit hit = Hit(t_max, vec2(0.0), NONE, NONE, NONE);
    if (!planes_occluded(origin, dir, t_min, t_max, from, to, hit)) bvh_trace(origin, dir, t_min, t_max, from, true, hit);
#ifdef TRACE_RECORDS
    stream_keep(origin, dir, t_max, from, to, STREAM_IS_SHADOW, hit);
#endif
    return hit.primitive != NONE;
}

#endif
