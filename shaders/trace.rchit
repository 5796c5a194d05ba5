// Records what the ray met, and nothing else: shading is in the ray generation shader.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_ray_tracing : require
#include "trace_payload.glsl"

layout(location = 0) rayPayloadInEXT TracePayload payload;
hitAttributeEXT vec2 bary;

void main()
{
    payload.t = gl_HitTEXT;
    payload.bary = bary;
    payload.instance = uint(gl_InstanceCustomIndexEXT);
    payload.primitive = uint(gl_PrimitiveID);
}
