// What a ray of the ray tracing pipeline carries, to its hit and back.

#ifndef TRACE_PAYLOAD_GLSL
#define TRACE_PAYLOAD_GLSL

#include "layout.glsl"
#include "spec.glsl"
#include "surface_skip.glsl"

// Words of a search: the number of solids and whether it is for them alone (NONE: no search), and the solids. Scenes without it carry one word.
const uint PAYLOAD_SOLIDS = 1u;
const uint PAYLOAD_CLOSED = 0x100u;
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
    payload.skip[0] = s.is_search ? s.count | (s.is_closed ? PAYLOAD_CLOSED : 0u) : NONE;
    if (s.is_search) {
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
    s.is_search = payload.skip[0] != NONE;
    s.is_closed = s.is_search && (payload.skip[0] & PAYLOAD_CLOSED) != 0u;
    s.count = payload.skip[0] & ~PAYLOAD_CLOSED;
    if (s.is_search) {
        for (uint k = 0u; k < s.count; k++) {
            uint at = PAYLOAD_SOLIDS + 2u * k;
            s.solids[k] = uvec2(payload.skip[at], payload.skip[at + 1u]);
        }
    }
    return s;
}

#endif
