#version 460
// What the device's numbers are like, for etendue selftest: an operation on many arguments.
#extension GL_GOOGLE_include_directive : require
#include "math.glsl"

layout(local_size_x = 64) in;

// Twins of src/selftest/numbers.rs.
const uint SIN = 0u;
const uint COS = 1u;
const uint EXP = 2u;
const uint LOG = 3u;
const uint DIVIDE = 4u;
const uint SQRT = 5u;
const uint INVERSE_SQRT = 6u;
const uint FINITE = 7u;
const uint CONTRACT = 8u;
const uint ASSOCIATE = 9u;
const uint LOOP = 10u;
layout(constant_id = 0) const uint OPERATION = SIN;

layout(binding = 0, std430) readonly buffer ArgumentsBlock { vec4 arguments[]; };
layout(binding = 1, std430) writeonly buffer ResultsBlock { uint results[]; };
layout(push_constant) uniform PushBlock {
    uint count;
} push;

uint answer(vec4 x)
{
    switch (OPERATION) {
    case SIN: return floatBitsToUint(sin(x.x));
    case COS: return floatBitsToUint(cos(x.x));
    case EXP: return floatBitsToUint(exp(x.x));
    case LOG: return floatBitsToUint(log(x.x));
    case DIVIDE: return floatBitsToUint(x.x / x.y);
    case SQRT: return floatBitsToUint(sqrt(x.x));
    case INVERSE_SQRT: return floatBitsToUint(inversesqrt(x.x));
    // 0/0, 1/0 and the like, made here: a compiler must not think that they cannot be.
    case FINITE: return is_finite(x.x / x.y) ? 1u : 0u;
    case CONTRACT: {
        precise float product = x.x * x.y;
        precise float sum = product + x.z;
        return floatBitsToUint(sum);
    }
    case ASSOCIATE: {
        precise float sum = x.x + x.y;
        precise float rest = sum - x.x;
        return floatBitsToUint(rest);
    }
    default: {
        uint state = floatBitsToUint(x.x);
        for (uint i = 0u; i < floatBitsToUint(x.y); i++) {
            state = state * 1664525u + 1013904223u;
        }
        return state;
    }
    }
}

void main()
{
    uint i = gl_GlobalInvocationID.x;
    if (i < push.count) {
        results[i] = answer(arguments[i]);
    }
}
