// Who is running: a work group of a compute shader, or a run of as many
// neighbours in the launch of a ray generation shader, which knows no groups.

#ifndef INVOCATION_GLSL
#define INVOCATION_GLSL

const uint INVOCATION_GROUP = 64u;

#ifdef TRAVERSE_PIPELINE

uint invocation_group() { return gl_LaunchIDEXT.x / INVOCATION_GROUP; }
uint invocation_place() { return gl_LaunchIDEXT.x % INVOCATION_GROUP; }

// Parts of a sum over the subgroup that the invocations with invocation_adds() add
// up. Devices need not have subgroup arithmetic in this stage, so each adds its own.
uint invocation_sum(uint value) { return value; }
bool invocation_adds() { return true; }
// True for some invocation of the subgroup. Here the device may regroup invocations
// at every ray, so that each knows of itself only.
bool invocation_any(bool value) { return value; }

#else

layout(local_size_x = 64, local_size_y = 1, local_size_z = 1) in;

uint invocation_group() { return gl_WorkGroupID.x; }
uint invocation_place() { return gl_LocalInvocationID.x; }
#ifdef WGPU
// naga's SPIR-V front end knows no election.
uint invocation_sum(uint value) { return value; }
bool invocation_adds() { return true; }
#else
uint invocation_sum(uint value) { return subgroupAdd(value); }
bool invocation_adds() { return subgroupElect(); }
#endif
bool invocation_any(bool value) { return subgroupAny(value); }

#endif

#endif
