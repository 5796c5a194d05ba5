// Entry of every compute kernel. A macro chooses the traversal (traverse.glsl), the
// kernel, or with WGPU what wgpu can bind and naga read, and nothing else.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_vote : require
#ifdef TRAVERSE_SOFTWARE
#extension GL_EXT_control_flow_attributes : require
#endif
#ifdef TRAVERSE_QUERY
#extension GL_EXT_ray_query : require
#endif

#ifdef KERNEL_PROBE
#include "kernel_probe.glsl"
#else
#include "kernel_path.glsl"
#endif
