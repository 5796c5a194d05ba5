#version 460
// Test kernel: one ray query for each probe ray; primitives of odd number are cut out under HAS_ALPHA.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_ray_query : require
#include "tests/rays.glsl"

layout(local_size_x = 64) in;

void main() { rays_trace(gl_GlobalInvocationID.x); }
