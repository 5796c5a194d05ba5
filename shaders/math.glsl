// Constants, frames, robust ray origins.
//
// [Duff17] Duff et al., Building an Orthonormal Basis, Revisited, JCGT 6(1).
// [Woop13] Woop, Benthin, Wald, Watertight Ray/Triangle Intersection, JCGT 2(1).

#ifndef MATH_GLSL
#define MATH_GLSL

const float PI = 3.14159265358979323846;
const float INV_PI = 0.31830988618379067154;
const float TWO_PI = 6.28318530717958647692;
// End of a ray that may go as far as it likes; its square is not used.
const float T_FAR = 3.0e38;
// Unit roundoff of fp32.
const float EPSILON = 5.9604645e-8;

// Whether x is neither infinite nor NaN, by its bits: compilers may assume that
// isnan() and isinf() are false.
bool is_finite(float x)
{
    return (floatBitsToUint(x) & 0x7F800000u) != 0x7F800000u;
}

bool is_finite(vec3 v)
{
    return is_finite(v.x) && is_finite(v.y) && is_finite(v.z);
}

// x, a whole number from 0 to 2²³ − 1, by its bits: lavapipe converts lane by lane.
int whole(float x)
{
    return floatBitsToInt(x + 8388608.0) - 0x4B000000;
}

// x, a whole number from 0 to 2³² − 1.
uint whole_long(float x)
{
    float high = floor(x * (1.0 / 65536.0));
    return uint(whole(high)) << 16u | uint(whole(x - 65536.0 * high));
}

// The larger and the smaller number, or b where one is NaN. Of max and min lavapipe makes several instructions, for the sake of
// NaN and since it halves vectors of 512 bits for them; of these one.
float larger(float a, float b)
{
    precise float c = a > b ? a : b;
    return c;
}

float smaller(float a, float b)
{
    precise float c = a < b ? a : b;
    return c;
}

vec3 larger(vec3 a, vec3 b) { return vec3(larger(a.x, b.x), larger(a.y, b.y), larger(a.z, b.z)); }
vec3 smaller(vec3 a, vec3 b) { return vec3(smaller(a.x, b.x), smaller(a.y, b.y), smaller(a.z, b.z)); }

// x, or the bound that it is beyond; the lower one where x is NaN.
float limited(float x, float lower, float upper) { return smaller(larger(x, lower), upper); }
vec2 limited(vec2 x, float lower, float upper) { return vec2(limited(x.x, lower, upper), limited(x.y, lower, upper)); }

float max_component(vec3 v)
{
    return larger(v.x, larger(v.y, v.z));
}

float square(float x)
{
    return x * x;
}

// Orthonormal frame whose third column is the unit vector n. [Duff17]
mat3 frame_from_z(vec3 n)
{
    float s = n.z >= 0.0 ? 1.0 : -1.0;
    float a = -1.0 / (s + n.z);
    float b = n.x * n.y * a;
    return mat3(vec3(1.0 + s * n.x * n.x * a, s * b, -s * n.x),
                vec3(b, s + n.y * n.y * a, -n.y),
                n);
}

// Origin of a ray that leaves the point p in a direction on the side of `side`,
// a vector along the geometric normal: moved off the surface by the bound on the
// error of p, so that the surface that holds p is not met again.
vec3 offset_origin(vec3 p, vec3 error, vec3 unit_side)
{
    return p + unit_side * dot(abs(unit_side), error);
}

#endif
