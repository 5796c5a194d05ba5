// Which pixel an invocation takes.

#ifndef PIXELS_GLSL
#define PIXELS_GLSL

#include "invocation.glsl"
#include "rng.glsl"
#include "scene.glsl"

layout(push_constant, scalar) uniform BatchBlock { Batch batch; };
#ifdef ADDRESSES
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer Ledger { uint counts[]; };
#define ledger Ledger(addresses[BIND_LEDGER]).counts
#else
layout(binding = BIND_LEDGER, scalar) buffer LedgerBlock { uint ledger[]; };
#endif

// Place in the 8 × 8 tile: eight neighbours in the index are a block of 4 × 2 pixels, so that a subgroup stays together.
uvec2 pixels_place(uint i)
{
    return uvec2((i & 3u) | (i >> 1u & 4u), (i >> 2u & 1u) | (i >> 3u & 6u));
}

// The pixel that the invocation takes next, counted tile by tile through the batch, or NONE. CPU drivers settle beforehand which
// work groups a thread gets: there few groups take pixels one by one, so that no thread waits for another.
uint pixels_take(bool is_first)
{
    uint k = NONE;
    if (batch.is_shared != 0u) {
        k = atomicAdd(ledger[LEDGER_TAKEN], 1u) - batch.taken;
    } else if (is_first) {
        k = INVOCATION_GROUP * invocation_group() + invocation_place();
    }
    return k < TILE * TILE * batch.tile_count ? k : NONE;
}

// Its number, counted tile by tile through the window.
uint pixels_number(uint k) { return TILE * TILE * batch.first_tile + k; }

// Where it is in the window, if it is in it: tiles may reach beyond.
uvec2 pixels_at(uint number)
{
    uint tile = number / (TILE * TILE);
    return TILE * uvec2(tile % params.tiles_x, tile / params.tiles_x) + pixels_place(number % (TILE * TILE));
}

// What keys of samples with the same high word have in common: compilers do not take it out of the loop over samples.
uvec4 pixels_base(uint sample_high) { return rng_base(uvec2(params.seed_low, params.seed_high), sample_high); }

// Key of a sample's random numbers. Batches are aligned, so the low word does not overflow within one.
uvec4 pixels_key(uvec4 base, uvec2 pixel, uint sample_low)
{
    return rng_key(base, pixel.y * params.width + pixel.x, sample_low);
}

// Adds to a counter of two words, the low one first.
void ledger_add(uint low, uint amount)
{
    uint before = atomicAdd(ledger[low], amount);
    if (before > 0xFFFFFFFFu - amount) {
        atomicAdd(ledger[low + 1u], 1u);
    }
}

#endif
