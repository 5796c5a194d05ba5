#version 460
// Test kernel: counts samples of one sampler in the cells of each case, and sums their weights.
#extension GL_GOOGLE_include_directive : require
#include "tests/shading_case.glsl"
#include "rng.glsl"

layout(local_size_x = 64) in;

const uint KIND_COSINE = 0u;
const uint KIND_GGX = 1u;      // reflected about a visible normal
const uint KIND_BSDF = 2u;
const uint KIND_TRIANGLE = 3u;
// Cells of each case along both axes; after them one that counts samples without a direction.
const uint CELLS_A = 32u;
const uint CELLS_B = 64u;
const uint CELLS = CELLS_A * CELLS_B + 1u;
const uint EDGES = CELLS_A + CELLS_B + 2u;

layout(binding = BIND_TEST_INPUT, scalar) readonly buffer EdgesBlock { float edges[]; };
layout(binding = BIND_TEST_OUTPUT, scalar) writeonly buffer SumsBlock { vec4 sums[]; };
layout(binding = BIND_TEST_COUNTS, scalar) buffer CountsBlock { uint counts[]; };
layout(push_constant, scalar) uniform PushBlock {
    uint kind;
    uint samples;    // of one invocation
    uint seed;
    uint is_lattice; // 1: a rank-1 lattice instead of random numbers
} push;

// tan(θ/2) up to the horizon, 2 − tan((π − θ)/2) below: monotone in θ and, unlike
// the cosine, precise at the poles.
float polar_coordinate(vec3 d)
{
    float q = length(d.xy) / (1.0 + abs(d.z));
    return d.z >= 0.0 ? q : 2.0 - q;
}

// 0 … 4, monotone in the angle from +x: position on the unit diamond.
float azimuth_coordinate(vec3 d)
{
    float sum = abs(d.x) + abs(d.y);
    if (sum == 0.0) {
        return 0.0;
    }
    float r = d.y / sum;
    return d.x < 0.0 ? 2.0 - r : (r >= 0.0 ? r : 4.0 + r);
}

// Largest i in 0 … count − 1 with edges[first + i] <= x; the outermost intervals are open.
uint interval(uint first, uint count, float x)
{
    uint low = 0u;
    uint high = count;
    while (high - low > 1u) {
        uint middle = (low + high) / 2u;
        if (edges[first + middle] <= x) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}

// Roberts's additive lattice in three dimensions, in 32-bit fixed point; the same 23 bits as rng_uniform.
vec3 lattice(uint i)
{
    uvec3 bits = (i + 1u) * uvec3(3518319153u, 2882110345u, 2360945575u);
    return (vec3(bits >> 9u) + 0.5) * (1.0 / 8388608.0);
}

void main()
{
    uint index = gl_GlobalInvocationID.y;
    uint invocation = gl_GlobalInvocationID.x;
    uint invocations = gl_NumWorkGroups.x * gl_WorkGroupSize.x;
    Case c = cases[index];
    Bsdf bsdf = case_bsdf(c, c.wo.z);
    float alpha = c.roughness * c.roughness;
    vec4 sum = vec4(0.0);
    for (uint i = 0u; i < push.samples; i++) {
        vec3 u;
        if (push.is_lattice != 0u) {
            u = lattice(i * invocations + invocation);
        } else {
            uvec4 key = rng_key(rng_base(uvec2(push.seed, index), 0u), invocation, i);
            u = rng_uniform(key, 1u, SLOT_BSDF).xyz;
        }
        vec2 at;
        bool is_valid = true;
        if (push.kind == KIND_TRIANGLE) {
            at = sample_triangle(u.yz);
        } else {
            vec3 wi;
            if (push.kind == KIND_COSINE) {
                wi = sample_cosine_hemisphere(u.yz);
            } else if (push.kind == KIND_GGX) {
                vec3 m = ggx_sample_normal(c.wo, alpha, u.yz);
                wi = 2.0 * dot(c.wo, m) * m - c.wo;
            } else {
                BsdfSample s = bsdf_sample(bsdf, c.wo, u);
                is_valid = s.is_valid;
                wi = s.wi;
                sum += is_valid ? vec4(s.weight, 1.0) : vec4(0.0);
            }
            at = vec2(polar_coordinate(wi), azimuth_coordinate(wi));
        }
        if (push.is_lattice == 0u) {
            uint first = index * EDGES;
            uint cell = interval(first, CELLS_A, at.x) * CELLS_B + interval(first + CELLS_A + 1u, CELLS_B, at.y);
            atomicAdd(counts[index * CELLS + (is_valid ? cell : CELLS - 1u)], 1u);
        }
    }
    sums[index * invocations + invocation] = sum;
}
