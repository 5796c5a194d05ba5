#version 460
// Never run: binds every struct of layout.glsl and uses every constant of
// spec.glsl, so that their offsets and ids stand in the SPIR-V for
// tests/layout.rs to read.
#extension GL_GOOGLE_include_directive : require
#include "layout.glsl"
#include "spec.glsl"

layout(local_size_x = 1) in;

// An array of each, since the distance between elements is compared as well.
layout(binding = 0, scalar) buffer Probe00 { Params params[]; };
layout(binding = 1, scalar) buffer Probe01 { Batch batches[]; };
layout(binding = 2, scalar) buffer Probe02 { Instance instances[]; };
layout(binding = 3, scalar) buffer Probe03 { Material materials[]; };
layout(binding = 4, scalar) buffer Probe04 { TextureUse texture_uses[]; };
layout(binding = 5, scalar) buffer Probe05 { Light lights[]; };
layout(binding = 6, scalar) buffer Probe06 { EnvCell env_cells[]; };
layout(binding = 7, scalar) buffer Probe07 { ProbeRay probe_rays[]; };
layout(binding = 8, scalar) buffer Probe08 { ProbeHit probe_hits[]; };
layout(binding = 9, scalar) buffer Probe09 { Medium media[]; };
layout(binding = 10, scalar) buffer Probe10 { Plane planes[]; };
layout(binding = 11, scalar) buffer Probe11 { PhotonStart photon_starts[]; };
layout(binding = 12, scalar) buffer Probe12 { Photon photons[]; };
layout(binding = 13, scalar) buffer Probe13 { StreamRay stream[]; };

void main() {}
