// What a ray of the ray tracing pipeline carries, to its hit and back.

#ifndef TRACE_PAYLOAD_GLSL
#define TRACE_PAYLOAD_GLSL

#include "layout.glsl"
#include "spec.glsl"
#include "surface_skip.glsl"

// Words of a search: the number of solids (NONE: no search), the direction, the solids. Scenes without it carry one word.
const uint PAYLOAD_SOLIDS = 4u;
const uint PAYLOAD_WORDS = HAS_NESTED ? PAYLOAD_SOLIDS + 2u * SKIP_SIZE : 1u;

struct TracePayload {
    float t;        // metres; < 0 where the ray met nothing
    vec2 bary;      // weights of the second and third vertex
    uint instance;  // with HAS_NESTED, on the way there: this and the next are the triangle to pass over
    uint primitive;
    uint skip[PAYLOAD_WORDS];
};

// What candidates must know; with HAS_NESTED.
void payload_put(inout TracePayload payload, SurfaceSkip s)
{
    payload.instance = s.triangle.x;
    payload.primitive = s.triangle.y;
    payload.skip[0] = s.is_search ? s.count : NONE;
    if (s.is_search) {
        for (uint k = 0u; k < 3u; k++) {
            payload.skip[1u + k] = floatBitsToUint(s.direction[k]);
        }
        for (uint k = 0u; k < s.count; k++) {
            payload.skip[PAYLOAD_SOLIDS + 2u * k] = s.solids[k].x;
            payload.skip[PAYLOAD_SOLIDS + 2u * k + 1u] = s.solids[k].y;
        }
    }
}

SurfaceSkip payload_skip(TracePayload payload)
{
    SurfaceSkip s;
    s.triangle = uvec2(payload.instance, payload.primitive);
    s.count = payload.skip[0];
    s.is_search = s.count != NONE;
    if (s.is_search) {
        for (uint k = 0u; k < 3u; k++) {
            s.direction[k] = uintBitsToFloat(payload.skip[1u + k]);
        }
        for (uint k = 0u; k < s.count; k++) {
            uint at = PAYLOAD_SOLIDS + 2u * k;
            s.solids[k] = uvec2(payload.skip[at], payload.skip[at + 1u]);
        }
    }
    return s;
}

#endif
