// What a ray of the ray tracing pipeline carries, to its hit and back.

#ifndef TRACE_PAYLOAD_GLSL
#define TRACE_PAYLOAD_GLSL

struct TracePayload {
    float t;        // metres; < 0 where the ray met nothing
    vec2 bary;      // weights of the second and third vertex
    uint instance;  // on the way there, this and the next are the triangle to pass over (surface_skip)
    uint primitive;
};

#endif
