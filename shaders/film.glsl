// Sums of samples as a dyadic tree over global sample indices, so that any split
// of the samples into ranges gives the same bits. The host continues the tree
// above the batch (src/film.rs) with the same operations in the same order.
//
// [Chan83] Chan, Golub, LeVeque, Algorithms for Computing the Sample Variance.

#ifndef FILM_GLSL
#define FILM_GLSL

#include "scene.glsl"

#ifdef ADDRESSES
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer Film { float values[]; };
#define film Film(addresses[BIND_FILM]).values
#else
layout(binding = BIND_FILM, scalar) buffer FilmBlock { float film[]; };
#endif

// Levels of the tree that one batch can hold: up to 2^(FILM_LEVELS − 1) samples.
const uint FILM_LEVELS = 9u;

struct FilmNode {
    vec3 sum;        // of radiance
    vec3 m2;         // squared deviations from the node's mean; of blocks where there are two
    vec3 between;    // what its samples of the first net add up to, less those of the second
    vec3 albedo;     // sums over the first hits
    vec3 normal;
    float depth;
    float coverage;
    float dropped;   // samples
};

// Two siblings of 2^level samples each, the earlier one first; level < NET_LEVEL.
FilmNode film_merge(FilmNode a, FilmNode b, uint level)
{
    FilmNode r;
    float count = float(1u << level);
    precise vec3 sum = a.sum + b.sum;
    precise vec3 d = a.sum - b.sum;
    precise vec3 within = a.m2 + b.m2;
    precise vec3 between = a.between + b.between;
    // Samples of a block are not independent: what counts is how blocks differ. Two siblings are of two nets.
    if (HAS_STRATA && level == BLOCK_LEVEL) {
        within = vec3(0.0);
        between = d;
    }
    precise vec3 m2 = within + (d * d) * (1.0 / (2.0 * count));
    r.sum = sum;
    r.m2 = m2;
    r.between = between;
    if (HAS_AOVS) {
        precise vec3 albedo = a.albedo + b.albedo;
        precise vec3 normal = a.normal + b.normal;
        precise float depth = a.depth + b.depth;
        r.albedo = albedo;
        r.normal = normal;
        r.depth = depth;
        r.coverage = a.coverage + b.coverage;
        r.dropped = a.dropped + b.dropped;
    }
    return r;
}

void film_write(uint pixel, FilmNode node)
{
    uint at = pixel * (HAS_AOVS ? FILM_FLOATS_AOV : FILM_FLOATS);
    for (uint c = 0u; c < 3u; c++) {
        film[at + c] = node.sum[c];
        film[at + 3u + c] = node.m2[c];
        film[at + 6u + c] = node.between[c];
        if (HAS_AOVS) {
            film[at + 9u + c] = node.albedo[c];
            film[at + 12u + c] = node.normal[c];
        }
    }
    if (HAS_AOVS) {
        film[at + 15u] = node.depth;
        film[at + 16u] = node.coverage;
        film[at + 17u] = node.dropped;
    }
}

#endif
