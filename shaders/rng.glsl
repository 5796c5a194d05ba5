// Counter-based random numbers: a pure function of (seed, pixel, sample, event,
// slot). Dimensions are named, so that switching a feature off shifts none of
// the others, and any sample can be computed alone.
//
// [Jarzynski20] Jarzynski, Olano, Hash Functions for GPU Rendering, JCGT 9(3): pcg4d.

#ifndef RNG_GLSL
#define RNG_GLSL

// Slots of one event of a path. Event 0 is the camera.
const uint SLOT_CAMERA = 0u; // x, y: position in the pixel; sensors use all four
const uint SLOT_BSDF = 0u;   // x: lobe, yz: direction, w: roulette
const uint SLOT_LIGHT = 1u;  // x: which light, yz: point on it, w: alias coin
const uint SLOT_COVER = 2u;  // x: partial coverage
const uint SLOT_MEDIUM = 3u; // x: channel, y: distance, z: distance by the light
const uint SLOT_SEGMENT = 4u; // as SLOT_LIGHT, for light along a segment
const uint SLOT_COUNT = 8u;

uvec4 rng_pcg4d(uvec4 v)
{
    v = v * 1664525u + 1013904223u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    v ^= v >> 16u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    return v;
}

// Key of one pixel sample. `pixel` counts in the full frame, so that crops and
// shards see the same numbers. The first round spreads the seed and the high
// half of the sample index over all words.
uvec4 rng_key(uvec2 seed, uint pixel, uint sample_low, uint sample_high)
{
    uvec4 base = rng_pcg4d(uvec4(seed, sample_high, 0x9E3779B9u));
    return rng_pcg4d(base ^ uvec4(pixel, sample_low, 0u, 0u));
}

// Four uniform numbers in the open interval (0, 1): multiples of 2⁻²³ plus 2⁻²⁴,
// exact in fp32, so neither 0 nor 1 can occur.
vec4 rng_uniform(uvec4 key, uint event, uint slot)
{
    uvec4 bits = rng_pcg4d(key ^ uvec4(0u, 0u, event * SLOT_COUNT + slot, 0x85EBCA6Bu));
    return (vec4(bits >> 9u) + 0.5) * (1.0 / 8388608.0);
}

#endif
