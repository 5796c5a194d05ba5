#version 460
// Test kernel: keys and numbers of the generator for a block of pixels × samples.
#extension GL_GOOGLE_include_directive : require
#include "rng.glsl"

layout(local_size_x = 64) in;

struct Draw {
    uvec4 key;
    vec4 number;
};

layout(binding = 0, std430) writeonly buffer DrawsBlock { Draw draws[]; };
layout(push_constant) uniform PushBlock {
    uint seed_low;
    uint seed_high;
    uint first_pixel;
    uint first_sample_low;
    uint first_sample_high;
    uint event;
    uint slot;
    uint samples; // of each pixel; they run fastest
    uint count;
} push;

void main()
{
    uint i = gl_GlobalInvocationID.x;
    if (i >= push.count) {
        return;
    }
    uint carry;
    uint low = uaddCarry(push.first_sample_low, i % push.samples, carry);
    uvec4 base = rng_base(uvec2(push.seed_low, push.seed_high), push.first_sample_high + carry);
    uvec4 key = rng_key(base, push.first_pixel + i / push.samples, low);
    draws[i] = Draw(key, rng_uniform(key, push.event, push.slot));
}
