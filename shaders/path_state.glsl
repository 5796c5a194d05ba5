// A path on its way, and what it brings.

#ifndef PATH_STATE_GLSL
#define PATH_STATE_GLSL

#include "direct.glsl"
#include "interior.glsl"
#include "rng.glsl"

// What the first hit looks like, for the feature layers.
struct FirstHit {
    vec3 albedo;
    vec3 normal;
    float depth;    // metres along the ray
    float coverage; // 1 where something was hit
};

struct PathResult {
    vec3 radiance;
    FirstHit first;
    float truncated;   // throughput that --max-depth cut off, mean of the channels
    uint rays;
};

// A path on its way.
struct PathState {
    uvec4 key;             // of its random numbers
    uint event;            // how many things the path itself has met
    Ray ray;
    uint from;             // record of the hit that the ray leaves, or NONE
    float lead;            // metres along the ray that it starts ahead of the point that it leaves
    vec3 beta;             // throughput without the factor n² of radiance
    float guided;          // by how much guides made the path's directions more likely: roulette must not undo it
    uint depth;            // scattering events so far
    uint chain;            // perfectly specular ones among them since the last other
    bool can_be_sampled;   // direct light could have found what the ray finds
    float pdf;             // of the last scattering, per steradian
    vec3 scattered_at;
    vec3 scattered_normal; // as `LightView` has it
    Interior interior;
    float camera_ior;      // index of what surrounds the camera
    float scale;           // radiance at the camera over radiance here: (n_camera / n)²
    Flight flight;         // that led to the last scattering in a medium
    bool is_alive;
    bool is_sensor;        // at the surface of a light meter, which is no event
    // With HAS_INSIDE: the search for the solids that hold the camera comes first.
    bool is_search;
    InteriorSearch search;
    Ray camera;            // the ray of the path when the search is over
    Shadow shadow;         // with HAS_PASSAGE or HAS_SCATTERING: direct light that is on its way
};

PathResult path_result()
{
    PathResult result;
    result.radiance = vec3(0.0);
    result.first = FirstHit(vec3(0.0), vec3(0.0), 0.0, 0.0);
    result.truncated = 0.0;
    result.rays = 0u;
    return result;
}

// Random numbers of the path's event at a surface.
struct PathDraws {
    vec4 light;
    vec4 bsdf;
};

// Drawn at once, and where pieces are tested without a walk before them: each number is a chain of products, during which a
// CPU has time for what does not depend on it.
const bool IS_FLAT = PARALLELOGRAM_COUNT + TRIANGLE_COUNT > 0u;

PathDraws path_draws(PathState path)
{
    return PathDraws(rng_uniform(path.key, path.event, SLOT_LIGHT), rng_uniform(path.key, path.event, SLOT_BSDF));
}

#endif
