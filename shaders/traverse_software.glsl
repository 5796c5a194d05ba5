// A ray meets opaque geometry: walk of the project's own BVH, an eight-wide tree
// with quantised boxes [Ylitie17]. The format is documented in src/bvh/mod.rs;
// src/bvh/traverse.rs mirrors this file on the host.
//
// No gaps: the edge functions of [Woop13] get the same sign (or zero, which counts
// as inside) in both triangles of an edge, because a vertex is sheared by the same
// operations in each and every product is rounded once (`precise`). Boxes contain
// their triangles exactly and are enlarged by more than the rounding of both tests.
//
// Requires: layout.glsl, spec.glsl, struct Hit, params, instances, surface_is_opaque().
//
// [Ylitie17] Ylitie, Karras, Laine: Efficient incoherent ray traversal on GPUs through
//            compressed wide BVHs. High-Performance Graphics 2017.
// [Woop13]   Woop, Benthin, Wald: Watertight ray/triangle intersection. Journal of
//            Computer Graphics Techniques 2(1), 2013.

#ifndef TRAVERSE_SOFTWARE_GLSL
#define TRAVERSE_SOFTWARE_GLSL

layout(binding = BIND_BVH_NODES) uniform usamplerBuffer bvh_nodes;
layout(binding = BIND_BVH_TRIANGLES) uniform samplerBuffer bvh_triangles;

// The builder bounds the depth of both levels so that this is enough.
const uint BVH_STACK_SIZE = 32u;
// Rounding of box and triangle test relative to the distance, 19 × 2⁻²⁴, rounded up to 2⁻¹⁹.
const float BVH_BOX_ROUNDING = 1.0 / 524288.0;
// 2⁻⁸⁰: slopes of directions closer to an axis plane would overflow; the ray bends by less than rounding.
const float BVH_MIN_DIRECTION = 8.271806125530277e-25;
// A set bit among these: the entry is a group of nodes. Otherwise it is a group of leaf records.
const uint BVH_NODE_BITS = 0xFF000000u;
const uint BVH_RECORD_MASKED = 1u;

uvec4 bvh_node_texel(uint index) { return texelFetch(bvh_nodes, int(index)); }
vec4 bvh_triangle_texel(uint index) { return texelFetch(bvh_triangles, int(index)); }

// What is computed once for a ray in one space.
struct BvhRay {
    vec3 origin;
    vec3 inverse;       // of the direction, finite
    vec3 shear_x;       // rows of the shear that takes the direction to the z axis …
    vec3 shear_y;
    vec3 shear_z;       // … and its largest component to one
    bvec3 negative;     // the direction points down
    uint octant;        // flips slots so that higher ones are nearer, in each byte
};

BvhRay bvh_ray(vec3 origin, vec3 d) {
    BvhRay ray;
    ray.origin = origin;
    ray.negative = lessThan(d, vec3(0.0));
    vec3 magnitude = max(abs(d), vec3(BVH_MIN_DIRECTION));
    ray.inverse = 1.0 / mix(magnitude, -magnitude, ray.negative);
    ray.octant = (ray.negative.x ? 0u : 0x04040404u) | (ray.negative.y ? 0u : 0x02020202u) |
                 (ray.negative.z ? 0u : 0x01010101u);
    // Factors 0 and 1 are exact, so that this equals [Woop13] without its permutation of axes.
    vec3 a = abs(d);
    if (a.x >= a.y && a.x >= a.z) {
        ray.shear_x = vec3(-d.y / d.x, 1.0, 0.0);
        ray.shear_y = vec3(-d.z / d.x, 0.0, 1.0);
        ray.shear_z = vec3(1.0 / d.x, 0.0, 0.0);
    } else if (a.y >= a.z) {
        ray.shear_x = vec3(0.0, -d.z / d.y, 1.0);
        ray.shear_y = vec3(1.0, -d.x / d.y, 0.0);
        ray.shear_z = vec3(0.0, 1.0 / d.y, 0.0);
    } else {
        ray.shear_x = vec3(1.0, 0.0, -d.x / d.z);
        ray.shear_y = vec3(0.0, 1.0, -d.y / d.z);
        ray.shear_z = vec3(0.0, 0.0, 1.0 / d.z);
    }
    return ray;
}

vec3 bvh_shear(BvhRay ray, vec3 vertex) {
    precise vec3 v = vertex - ray.origin;
    precise vec3 sheared = v.x * vec3(ray.shear_x.x, ray.shear_y.x, ray.shear_z.x) +
                           v.y * vec3(ray.shear_x.y, ray.shear_y.y, ray.shear_z.y) +
                           v.z * vec3(ray.shear_x.z, ray.shear_y.z, ray.shear_z.z);
    return sheared;
}

// The four bytes of a word, and the planes that they stand for.
uvec4 bvh_bytes(uint word) { return (uvec4(word) >> uvec4(0u, 8u, 16u, 24u)) & 0xFFu; }
vec4 bvh_planes(uint word, float scale, float offset) { return vec4(bvh_bytes(word)) * scale + offset; }

// Bits of four children that the ray may meet.
uint bvh_four_hits(uvec3 near_words, uvec3 far_words, vec3 scale, vec3 near_offset, vec3 far_offset,
                   float t_min, float t_max, uint meta, uint octant) {
    vec4 near = max(max(bvh_planes(near_words.x, scale.x, near_offset.x),
                        bvh_planes(near_words.y, scale.y, near_offset.y)),
                    max(bvh_planes(near_words.z, scale.z, near_offset.z), vec4(t_min)));
    vec4 far = min(min(bvh_planes(far_words.x, scale.x, far_offset.x),
                       bvh_planes(far_words.y, scale.y, far_offset.y)),
                   min(bvh_planes(far_words.z, scale.z, far_offset.z), vec4(t_max)));
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
    uvec4 head = bvh_node_texel(5u * index);
    uvec4 links = bvh_node_texel(5u * index + 1u);
    uvec4 x = bvh_node_texel(5u * index + 2u);
    uvec4 y = bvh_node_texel(5u * index + 3u);
    uvec4 z = bvh_node_texel(5u * index + 4u);

    vec3 cell = uintBitsToFloat(((uvec3(head.w) >> uvec3(0u, 8u, 16u)) & 0xFFu) << 23u);
    vec3 from_origin = uintBitsToFloat(head.xyz) - ray.origin;
    // The far side of the box along any axis bounds every distance in it.
    vec3 reach = abs(from_origin) + 255.0 * cell;
    float pad = max(reach.x, max(reach.y, reach.z)) * BVH_BOX_ROUNDING;
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

// Parameter and weights of the second and third vertex; false on a miss. [Woop13] without its fall-back to double
// precision, which only reduces the number of rays that hit both triangles of an edge.
bool bvh_intersect(BvhRay ray, vec3 v0, vec3 v1, vec3 v2, out float t, out vec2 bary) {
    vec3 a = bvh_shear(ray, v0);
    vec3 b = bvh_shear(ray, v1);
    vec3 c = bvh_shear(ray, v2);
    precise float u = c.x * b.y - c.y * b.x;
    precise float v = a.x * c.y - a.y * c.x;
    precise float w = b.x * a.y - b.y * a.x;
    float sum = u + v + w;
    bary = vec2(v, w) / sum;
    // A mean of the vertices' depths: never beyond the triangle, even where it is seen edge-on.
    t = a.z + bary.x * (b.z - a.z) + bary.y * (c.z - a.z);
    float least = min(u, min(v, w));
    float most = max(u, max(v, w));
    return (least >= 0.0 || most <= 0.0) && sum != 0.0;
}

// Both traversals; `any_hit` ends at the first hit and is a literal at both calls.
bool bvh_trace(vec3 origin, vec3 dir, float t_min, float t_max, bool any_hit, out Hit hit) {
    uvec2 stack[BVH_STACK_SIZE];
    uint height = 0u;
    uint base = 0u; // height at which the instance is left
    BvhRay ray = bvh_ray(origin, dir);
    uint instance = HAS_INSTANCES ? NONE : 0u; // NONE: in the top level
    uvec2 nodes = uvec2(params.bvh_root, 0x80000000u);
    uvec2 leaves = uvec2(0u);
    hit = Hit(t_max, vec2(0.0), NONE, NONE);
    while (true) {
        if (leaves.y == 0u) {
            if ((nodes.y & BVH_NODE_BITS) == 0u) {
                if (HAS_INSTANCES && instance != NONE && height == base) {
                    instance = NONE;
                    ray = bvh_ray(origin, dir);
                }
                if (height == 0u) break;
                nodes = stack[--height];
            }
            if (HAS_INSTANCES && (nodes.y & BVH_NODE_BITS) == 0u) {
                leaves = nodes;
            } else {
                uint bit = uint(findMSB(nodes.y));
                uint slot = (bit - 24u) ^ (ray.octant & 7u);
                uint index = nodes.x + bitCount(nodes.y & ~(0xFFFFFFFFu << slot) & 0xFFu);
                nodes.y &= ~(1u << bit);
                if ((nodes.y & BVH_NODE_BITS) != 0u) stack[height++] = nodes;
                bvh_visit(index, ray, t_min, hit.t, nodes, leaves);
            }
        }
        // Two records at most before the next node: lanes that have more wait less for those that have none.
        for (uint i = 0u; i < 2u && leaves.y != 0u; i++) {
            uint record = 3u * (leaves.x + uint(findLSB(leaves.y)));
            leaves.y &= leaves.y - 1u;
            vec4 v0 = bvh_triangle_texel(record);
            if (HAS_INSTANCES && instance == NONE) {
                // A leaf entry of the top level: leave what remains for later and enter the group.
                if ((nodes.y & BVH_NODE_BITS) != 0u) stack[height++] = nodes;
                if (leaves.y != 0u) stack[height++] = leaves;
                base = height;
                instance = floatBitsToUint(v0.w);
                nodes = uvec2(instances[instance].bvh_root, 0x80000000u);
                leaves.y = 0u;
                vec3 x = instances[instance].object_from_world_x;
                vec3 y = instances[instance].object_from_world_y;
                vec3 z = instances[instance].object_from_world_z;
                vec3 moved = x * origin.x + y * origin.y + z * origin.z + instances[instance].object_from_world_t;
                ray = bvh_ray(moved, x * dir.x + y * dir.y + z * dir.z);
                break;
            }
            vec4 v1 = bvh_triangle_texel(record + 1u);
            vec4 v2 = bvh_triangle_texel(record + 2u);
            float t;
            vec2 bary;
            if (bvh_intersect(ray, v0.xyz, v1.xyz, v2.xyz, t, bary) && t > t_min && t < hit.t) {
                uint primitive = floatBitsToUint(v0.w);
                bool is_masked = HAS_ALPHA && (floatBitsToUint(v1.w) & BVH_RECORD_MASKED) != 0u;
                if (!is_masked || surface_is_opaque(instance, primitive, bary)) {
                    hit = Hit(t, bary, instance, primitive);
                    if (any_hit) {
                        // Nothing left to do: the loop ends by itself.
                        nodes.y = 0u;
                        leaves.y = 0u;
                        height = 0u;
                    }
                }
            }
        }
    }
    return hit.primitive != NONE;
}

bool trace_closest(vec3 origin, vec3 dir, float t_min, float t_max, out Hit hit) {
    return bvh_trace(origin, dir, t_min, t_max, false, hit);
}

bool trace_occluded(vec3 origin, vec3 dir, float t_min, float t_max) {
    Hit hit;
    return bvh_trace(origin, dir, t_min, t_max, true, hit);
}

#endif
