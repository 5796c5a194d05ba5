#version 460
// Kernel of examples/pi: throws needles at the unit square and sums what they are
// worth. g(x, y) is 1 inside the quarter of the unit disc and 0 outside.
#extension GL_GOOGLE_include_directive : require
#include "rng.glsl"

layout(local_size_x = 64) in;

// How needles are thrown and what one of them is worth.
const uint KIND_UNIFORM = 0u;  // density 1: g
const uint KIND_SUM_BARE = 1u; // density f = x + y: g
const uint KIND_SUM = 2u;      // density f = x + y: g / f
const uint KIND_PRODUCT = 3u;  // density f = 4xy: g / f
const uint KIND_MISTAKE = 4u;  // density 1, but weighted as if it were f = x + y: g / f
layout(constant_id = 100) const uint KIND = KIND_UNIFORM;
// Needles of one invocation.
layout(constant_id = 101) const uint THROWS = 1u;

layout(binding = 0, std430) writeonly buffer SumsBlock { vec2 sums[]; }; // of values, of their squares
layout(binding = 1, std430) writeonly buffer KeptBlock { float kept[]; };
layout(push_constant) uniform PushBlock {
    uint seed;
    uint first; // invocation of the whole run that is the first of this dispatch
    uint kept;  // invocations of the whole run whose single values are written as well
} push;

// Where a needle lands. The larger of two uniform numbers has the density 2x, and
// x + y is the even mixture of 2x and 2y. Unlike the square root, this is exact on
// the generator's lattice: the point (2k + 1)/2²⁴ gets the probability (2k + 1)/2⁴⁶,
// and no mean of g/f is shifted by the coarseness of small numbers.
vec2 needle_position(vec4 u)
{
    if (KIND == KIND_SUM_BARE || KIND == KIND_SUM) {
        vec2 p = vec2(max(u.x, u.y), u.z);
        return u.w < 0.5 ? p : p.yx;
    }
    if (KIND == KIND_PRODUCT) {
        return vec2(max(u.x, u.y), max(u.z, u.w));
    }
    return u.xy;
}

// u lies in the open unit cube, so no density is 0.
float needle_value(vec2 p)
{
    if (dot(p, p) >= 1.0) {
        return 0.0;
    }
    if (KIND == KIND_SUM || KIND == KIND_MISTAKE) {
        return 1.0 / (p.x + p.y);
    }
    return KIND == KIND_PRODUCT ? 1.0 / (4.0 * p.x * p.y) : 1.0;
}

void main()
{
    uint invocation = push.first + gl_GlobalInvocationID.x;
    vec2 sum = vec2(0.0);
    for (uint i = 0u; i < THROWS; i++) {
        uvec4 key = rng_key(rng_base(uvec2(push.seed, KIND), 0u), invocation, i);
        float value = needle_value(needle_position(rng_uniform(key, 0u, 0u)));
        sum += vec2(value, value * value);
        if (invocation < push.kept) {
            kept[invocation * THROWS + i] = value;
        }
    }
    sums[gl_GlobalInvocationID.x] = sum;
}
