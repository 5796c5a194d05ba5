// Entry of every compute kernel. A macro chooses the traversal (traverse.glsl), the
// kernel, what holds the scene's arrays (scene.glsl), and nothing else.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_vote : require
#ifdef SHARE
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_shuffle : require
#endif
#ifdef TRAVERSE_SOFTWARE
#extension GL_EXT_control_flow_attributes : require
#endif
#ifdef ADDRESSES
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#endif
#ifdef TRAVERSE_QUERY
#extension GL_EXT_ray_query : require
#endif

#ifdef KERNEL_PROBE
#include "kernel_probe.glsl"
#elif defined(PHOTON)
#include "kernel_photon.glsl"
#elif defined(KERNEL_REPLAY)
#include "kernel_replay.glsl"
#elif defined(SHARE)
#include "kernel_share.glsl"
#else
#include "kernel_path.glsl"
#endif
