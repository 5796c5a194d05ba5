// The scene's buffers. Read-only arrays that are walked per ray are texel
// buffers: 20–30 % faster than storage buffers on lavapipe (docs/decisions.md).

#ifndef SCENE_GLSL
#define SCENE_GLSL

#include "layout.glsl"
#include "spec.glsl"

layout(binding = BIND_PARAMS, scalar) uniform ParamsBlock { Params params; };
layout(binding = BIND_INSTANCES, scalar) readonly buffer InstancesBlock { Instance instances[]; };
layout(binding = BIND_TRIANGLES) uniform usamplerBuffer triangles;
layout(binding = BIND_VERTICES) uniform samplerBuffer vertices;
layout(binding = BIND_ATTRIBUTES) uniform samplerBuffer attributes;
layout(binding = BIND_MATERIALS, scalar) readonly buffer MaterialsBlock { Material materials[]; };
layout(binding = BIND_TEXTURE_USES, scalar) readonly buffer TextureUsesBlock { TextureUse texture_uses[]; };
layout(binding = BIND_TEXELS) uniform usamplerBuffer texels;
layout(binding = BIND_LIGHTS, scalar) readonly buffer LightsBlock { Light lights[]; };
layout(binding = BIND_ENV_MAP) uniform samplerBuffer env_map;
layout(binding = BIND_ENV_TABLE, scalar) readonly buffer EnvTableBlock { EnvTexel env_table[]; };

#endif
