// Warps from the unit square and weights of multiple importance sampling.

#ifndef SAMPLING_GLSL
#define SAMPLING_GLSL

#include "math.glsl"

// Cosine-weighted direction about +z; pdf = cosθ/π. The radius is taken from the
// sine directly, so that z needs no square root of a difference.
vec3 sample_cosine_hemisphere(vec2 u)
{
    float phi = TWO_PI * u.x;
    float r = sqrt(u.y);
    return vec3(r * cos(phi), r * sin(phi), sqrt(1.0 - u.y));
}

// Barycentric weights of the second and third vertex, uniform over the triangle.
vec2 sample_triangle(vec2 u)
{
    float r = sqrt(u.x);
    return vec2(r * (1.0 - u.y), r * u.y);
}

// A number in [0, 1] with a density that goes linearly from a to b, up to a factor.
float sample_linear(float u, float a, float b)
{
    float divisor = a + sqrt(mix(a * a, b * b, u));
    return divisor > 0.0 ? smaller(u * (a + b) / divisor, 1.0) : u;
}

// Numbers in (0, 1), multiples of 2⁻²³ plus 2⁻²⁴, moved on by `turn`, multiples of 2⁻²³, around from 1 to 0: exact.
vec4 sample_turned(vec4 u, vec4 turn)
{
    return u + mix(turn, turn - 1.0, greaterThan(u, 1.0 - turn));
}

// Weight of a sample drawn with density `mine` that another technique would have
// drawn with density `other`. Written with the ratio, so that large densities do
// not overflow. [Veach97] power heuristic, exponent 2.
float mis_weight(float mine, float other)
{
    float ratio = other / mine;
    return 1.0 / (1.0 + ratio * ratio);
}

#endif
