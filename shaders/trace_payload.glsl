// What a ray of the ray tracing pipeline carries, to its hit and back.

#ifndef TRACE_PAYLOAD_GLSL
#define TRACE_PAYLOAD_GLSL

#include "surface_skip.glsl"

struct TracePayload {
    float t;        // metres; < 0 where the ray met nothing
    vec2 bary;      // weights of the second and third vertex
    uint instance;
    uint primitive;
    SurfaceSkip skip; // on the way there, with HAS_NESTED
};

#endif
