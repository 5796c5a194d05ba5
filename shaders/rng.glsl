// Counter-based random numbers: a pure function of (seed, pixel, sample, event,
// slot). Dimensions are named, so that switching a feature off shifts none of
// the others, and any sample can be computed alone.
//
// With HAS_STRATA two nets in the four numbers of each slot, scrambled after Owen, take turns: sixteen samples are of the
// one, the next sixteen of the other. Their scrambles are independent, so that what they differ by gives the standard error.
// After 2^NET_LEVEL samples of each come two others.
//
// [Jarzynski20] Jarzynski, Olano, Hash Functions for GPU Rendering, JCGT 9(3): pcg4d.
// [Owen97] Owen, Scrambled Net Variance for Integrals of Smooth Functions.
// [Burley20] Burley, Practical Hash-based Owen Scrambling, JCGT 9(4): scrambling by hash, shuffled padding.

#ifndef RNG_GLSL
#define RNG_GLSL

#include "layout.glsl"
#include "spec.glsl"

// Slots of one event of a path. Event 0 is the camera.
const uint SLOT_CAMERA = 0u; // yz: position in the pixel; sensors use all four
const uint SLOT_BSDF = 0u;   // x: lobe, yz: direction, w: roulette
const uint SLOT_LIGHT = 1u;  // x: which light, yz: point on it, w: alias coin
const uint SLOT_COVER = 2u;  // x: partial coverage
const uint SLOT_MEDIUM = 3u; // x: channel, y: distance, z: distance by the light
const uint SLOT_SEGMENT = 4u; // as SLOT_LIGHT, for light on a segment in a medium
const uint SLOT_CANDIDATE = 5u; // which sample of a light is followed
const uint SLOT_GUIDE = 6u;  // x: whether the guide chooses, and its lobe, yz: direction
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

// The seed and the high half of a sample's index, spread over all words.
uvec4 rng_base(uvec2 seed, uint sample_high)
{
    return rng_pcg4d(uvec4(seed, sample_high, 0x9E3779B9u));
}

// Key of one pixel sample. `pixel` counts in the full frame, so that crops and
// shards see the same numbers. With HAS_STRATA the last word is the
// sample's place in its net and the others are the net's.
uvec4 rng_key(uvec4 base, uint pixel, uint sample_low)
{
    if (!HAS_STRATA) {
        return rng_pcg4d(base ^ uvec4(pixel, sample_low, 0u, 0u));
    }
    // The bit above those of a block tells which of the two nets; the bits above a pair of nets, which pair.
    const uint WHICH = 1u << BLOCK_LEVEL;
    const uint PAIR = 2u << NET_LEVEL;
    uint place = (sample_low & WHICH - 1u) | (sample_low & PAIR - 1u & ~(2u * WHICH - 1u)) >> 1u;
    uint net = sample_low & (WHICH | ~(PAIR - 1u));
    uvec3 words = rng_pcg4d(base ^ uvec4(pixel, net, 0u, 0u)).xyz;
    return uvec4(words, place);
}

// A nested permutation of the binary digits after the point, chosen by two words for
// each number: the first digit is the lowest bit of v. Adding the first word makes each result uniform by itself. [Burley20]
uvec4 rng_owen(uvec4 v, uvec4 add, uvec4 factor)
{
    v ^= v * 0x3D20ADEAu;
    v += add;
    v *= factor | 1u;
    v ^= v * 0x05526C56u;
    v ^= v * 0x53A22864u;
    return bitfieldReverse(v);
}

// A permutation of the places in a net, chosen by a word, that keeps each run of the first 2^k places together, k ≥ BLOCK_LEVEL,
// so that they stay a net. The low digits go through steps that carry from low digits
// to high ones, and are reversed between them, so that no digit leads; each group of 16 has another order.
uint rng_shuffle(uint place, uint word)
{
    uint low = bitfieldExtract(place, 0, int(BLOCK_LEVEL));
    uint group = place - low;
    word = (word ^ group) * 0x9E3779B1u;
    word ^= word >> 15u;
    for (uint k = 0u; k < 3u; k++) {
        low = low * (word >> 3u | 1u) + word;
        low = bitfieldReverse(low) >> (32u - BLOCK_LEVEL);
        word >>= 8u;
    }
    return group | low;
}

// Point of a four-dimensional digital sequence, of which each aligned run of 2^m places, m ≥ BLOCK_LEVEL, is a net [Owen97]. y and z are
// Sobol's first two numbers: cells of any shape in their plane hold one point each. x and w were found by search: alone
// they have one point in each of 2^m intervals, and the other planes lack a digit at most (x with w two at 256). 16 places are a (1, 4, 4)-net
// and, without w, a (0, 4, 3)-net. The first digit after the point is the lowest bit.
uvec4 rng_net(uint place)
{
    // Of the generator matrices, those of x, y, z and w a byte each, x the lowest.
    const uint columns[NET_LEVEL] = uint[](
        0xF1010158u, 0xF4030264u, 0xD30504F2u, 0x2D0F0811u,
        0xAC11109Eu, 0x473320D3u, 0x095540B9u, 0x5CFF8084u);
    uint v = 0u;
    for (uint k = 0u; k < NET_LEVEL; k++) {
        // all bits of the digit alike
        v ^= columns[k] & uint(bitfieldExtract(int(place), int(k), 1));
    }
    return (uvec4(v) >> uvec4(0u, 8u, 16u, 24u)) & 0xFFu;
}

uint rng_dimension(uint event, uint slot)
{
    return event * SLOT_COUNT + slot;
}

// Four uniform numbers in the open interval (0, 1): multiples of 2⁻²³ plus 2⁻²⁴,
// exact in fp32, so neither 0 nor 1 can occur.
vec4 rng_uniform(uvec4 key, uint event, uint slot)
{
    uvec4 bits;
    uint dimension = rng_dimension(event, slot);
    if (HAS_STRATA) {
        uvec4 words = rng_pcg4d(uvec4(key.xy, key.z ^ dimension, 0x85EBCA6Bu));
        // Slots see the net in orders of their own, so that they do not go together.
        uint place = rng_shuffle(key.w, words.x ^ words.z) ^ (words.y ^ words.w) >> 24u & 0xF0u;
        bits = rng_owen(rng_net(place), words, words.yzwx);
    } else {
        bits = rng_pcg4d(key ^ uvec4(0u, 0u, dimension, 0x85EBCA6Bu));
    }
    return (vec4(bits >> 9u) + 0.5) * (1.0 / 8388608.0);
}

// One uniform number in (0, 1), of no net and independent of all others.
float rng_coin(uvec4 key, uint event, uint slot)
{
    uint bits = rng_pcg4d(key ^ uvec4(0u, 0u, rng_dimension(event, slot), 0x165667B1u)).x;
    return (float(bits >> 9u) + 0.5) * (1.0 / 8388608.0);
}

#endif
