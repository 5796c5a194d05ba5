#version 460
// Test kernel: every kind of resource and constant contributes a summand of its own.

layout(local_size_x = 64) in;

layout(constant_id = 3) const uint SCALE = 1u;
layout(constant_id = 7) const bool HAS_BIAS = false;

layout(binding = 0) uniform Uniforms {
    uint count;
    uint bias;
} uniforms;
layout(binding = 2) uniform usamplerBuffer quads;
layout(binding = 4) uniform samplerBuffer floats;
layout(binding = 5) uniform usamplerBuffer words;
layout(binding = 8) readonly buffer Numbers { uint numbers[]; };
layout(binding = 9) buffer Sums { uint sums[]; };

layout(push_constant) uniform Push {
    uint first;
    uint factor;
} push;

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= uniforms.count) return;
    uvec4 quad = texelFetch(quads, int(i));
    vec4 four = texelFetch(floats, int(i));
    uint sum = SCALE * numbers[i] + push.factor * texelFetch(words, int(i)).x;
    sum += quad.x + quad.w + uint(four.y + four.z) + push.first;
    if (HAS_BIAS) sum += uniforms.bias;
    // Accumulates, so that two dispatches show whether the second one saw the first.
    sums[i] += sum;
}
