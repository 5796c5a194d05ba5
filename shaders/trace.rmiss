// The ray met nothing.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_ray_tracing : require
#include "trace_payload.glsl"

layout(location = 0) rayPayloadInEXT TracePayload payload;

void main()
{
    payload.t = -1.0;
}
