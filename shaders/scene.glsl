// The scene's buffers. Read-only arrays that are walked per ray are texel
// buffers, which lavapipe reads faster than storage buffers (docs/decisions.md).

#ifndef SCENE_GLSL
#define SCENE_GLSL

#include "layout.glsl"
#include "spec.glsl"

#ifdef ADDRESSES
// For as long as the invocation runs: lavapipe makes a branch for each word that is read of a uniform buffer.
Params params;
uint64_t addresses[ADDRESSES_SIZE];
layout(binding = BIND_ADDRESSES, scalar) uniform AddressesBlock { uint64_t addresses_given[ADDRESSES_SIZE]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer ParamsAt { Params params; };
// Once in each kernel, before the scene is read.
void scene_start()
{
    for (uint i = 0u; i < ADDRESSES_SIZE; i++) {
        addresses[i] = addresses_given[i];
    }
    params = ParamsAt(addresses[BIND_PARAMS]).params;
}
#else
layout(binding = BIND_PARAMS, scalar) uniform ParamsBlock { Params params; };
void scene_start() {}
#endif

// wgpu has no texel buffers; the same records then are storage buffers. CPUs that gather read
// by addresses, in words of 64 bits (docs/decisions.md).
#ifdef WGPU
#define texelFetch(array, i) array[i]
layout(binding = BIND_INSTANCES, scalar) readonly buffer InstancesBlock { uvec4 instances[]; };
layout(binding = BIND_TRIANGLES, scalar) readonly buffer TrianglesBlock { uvec4 triangles[]; };
layout(binding = BIND_VERTICES, scalar) readonly buffer VerticesBlock { vec4 vertices[]; };
layout(binding = BIND_ATTRIBUTES, scalar) readonly buffer AttributesBlock { vec4 attributes[]; };
layout(binding = BIND_MATERIALS, scalar) readonly buffer MaterialsBlock { uvec4 materials[]; };
layout(binding = BIND_TEXTURE_USES, scalar) readonly buffer TextureUsesBlock { uvec4 texture_uses[]; };
layout(binding = BIND_TEXELS, scalar) readonly buffer TexelsBlock { uint texels[]; };
layout(binding = BIND_LIGHTS, scalar) readonly buffer LightsBlock { uvec4 lights[]; };
layout(binding = BIND_ENV_MAP, scalar) readonly buffer EnvMapBlock { vec4 env_map[]; };
layout(binding = BIND_ENV_TABLE, scalar) readonly buffer EnvTableBlock { uvec2 env_table[]; };
layout(binding = BIND_MEDIA, scalar) readonly buffer MediaBlock { uvec4 media[]; };
#elif defined(ADDRESSES)
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer Quad { u64vec2 words; };
layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer Pair { uint64_t words; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Single { uint word; };
uint64_t scene_address(uint binding, int i, uint bytes) { return addresses[binding] + uint64_t(uint(i)) * bytes; }
uvec4 scene_quad_at(uint64_t address)
{
    u64vec2 words = Quad(address).words;
    return uvec4(unpackUint2x32(words.x), unpackUint2x32(words.y));
}
uvec4 scene_quad(uint binding, int i) { return scene_quad_at(scene_address(binding, i, 16u)); }
uvec2 scene_pair(uint binding, int i) { return unpackUint2x32(Pair(scene_address(binding, i, 8u)).words); }
uint scene_single(uint binding, int i) { return Single(scene_address(binding, i, 4u)).word; }
#define texelFetch(array, i) array(i)
#define instances(i) scene_quad(BIND_INSTANCES, i)
#define triangles(i) scene_quad(BIND_TRIANGLES, i)
#define vertices(i) uintBitsToFloat(scene_quad(BIND_VERTICES, i))
#define attributes(i) uintBitsToFloat(scene_quad(BIND_ATTRIBUTES, i))
#define materials(i) scene_quad(BIND_MATERIALS, i)
#define texture_uses(i) scene_quad(BIND_TEXTURE_USES, i)
#define texels(i) scene_single(BIND_TEXELS, i)
#define lights(i) scene_quad(BIND_LIGHTS, i)
#define env_map(i) uintBitsToFloat(scene_quad(BIND_ENV_MAP, i))
#define env_table(i) scene_pair(BIND_ENV_TABLE, i)
#define media(i) scene_quad(BIND_MEDIA, i)
#define guide_texels(i) scene_quad(BIND_GUIDE, i)
#else
layout(binding = BIND_INSTANCES) uniform usamplerBuffer instances;
layout(binding = BIND_TRIANGLES) uniform usamplerBuffer triangles;
layout(binding = BIND_VERTICES) uniform samplerBuffer vertices;
layout(binding = BIND_ATTRIBUTES) uniform samplerBuffer attributes;
layout(binding = BIND_MATERIALS) uniform usamplerBuffer materials;
layout(binding = BIND_TEXTURE_USES) uniform usamplerBuffer texture_uses;
layout(binding = BIND_TEXELS) uniform usamplerBuffer texels;
layout(binding = BIND_LIGHTS) uniform usamplerBuffer lights;
layout(binding = BIND_ENV_MAP) uniform samplerBuffer env_map;
layout(binding = BIND_ENV_TABLE) uniform usamplerBuffer env_table;
layout(binding = BIND_MEDIA) uniform usamplerBuffer media;
layout(binding = BIND_GUIDE) uniform usamplerBuffer guide_texels;
#endif

// Elements of an array that follow each other: where they begin, and the one that is k further. Where arrays are read by addresses
// there is one address for all, not one for each to be computed in every lane.
#ifdef ADDRESSES
#define Row uint64_t
#define row_of(binding, i) scene_address(binding, int(i), 16u)
#define row_fetch(array, row, k) scene_quad_at(row + 16u * (k))
#else
#define Row int
#define row_of(binding, i) int(i)
#define row_fetch(array, row, k) texelFetch(array, row + (k))
#endif

// Where a group is placed; groups of words that are not used cost nothing.
Instance scene_instance(uint index)
{
    Row row = row_of(BIND_INSTANCES, INSTANCE_TEXELS * index);
    uvec4 a = row_fetch(instances, row, 0);
    uvec4 b = row_fetch(instances, row, 1);
    uvec4 c = row_fetch(instances, row, 2);
    uvec4 d = row_fetch(instances, row, 3);
    uvec4 e = row_fetch(instances, row, 4);
    uvec4 f = row_fetch(instances, row, 5);
    uvec4 g = row_fetch(instances, row, 6);
    uvec4 h = row_fetch(instances, row, 7);
    return Instance(uintBitsToFloat(a.xyz), a.w, uintBitsToFloat(b.xyz), b.w, uintBitsToFloat(c.xyz), c.w,
                    uintBitsToFloat(d.xyz), d.w, uintBitsToFloat(e.xyz), e.w, uintBitsToFloat(f.xyz), f.w,
                    uintBitsToFloat(g.xyz), g.w, uintBitsToFloat(h.xyz), h.w);
}

// A texture in a slot.
TextureUse scene_texture_use(uint index)
{
    Row row = row_of(BIND_TEXTURE_USES, TEXTURE_USE_TEXELS * index);
    uvec4 a = row_fetch(texture_uses, row, 0);
    uvec4 b = row_fetch(texture_uses, row, 1);
    uvec4 c = row_fetch(texture_uses, row, 2);
    return TextureUse(uintBitsToFloat(a.xyz), a.w, uintBitsToFloat(b.xyz), b.w, c.x, c.y, c.z, c.w);
}

// The material's words; groups that are not used cost nothing.
Material scene_material(uint index)
{
    Row row = row_of(BIND_MATERIALS, MATERIAL_TEXELS * index);
    uvec4 a = row_fetch(materials, row, 0);
    uvec4 b = row_fetch(materials, row, 1);
    uvec4 c = row_fetch(materials, row, 2);
    uvec4 d = row_fetch(materials, row, 3);
    uvec4 e = row_fetch(materials, row, 4);
    vec4 shape = uintBitsToFloat(c);
    return Material(uintBitsToFloat(a.xyz), a.w, uintBitsToFloat(b.xyz), uintBitsToFloat(b.w), shape.x, shape.y, shape.z,
                    shape.w, uintBitsToFloat(d.xyz), uintBitsToFloat(d.w), uintBitsToFloat(e.x), e.y, uintBitsToFloat(e.z),
                    uintBitsToFloat(e.w));
}

// What fills solids with this material; NONE: the space outside all solids. Groups that are not used cost nothing.
Medium scene_medium(uint material)
{
    Row row = row_of(BIND_MEDIA, MEDIUM_TEXELS * (material + 1u));
    uvec4 a = row_fetch(media, row, 0);
    uvec4 b = row_fetch(media, row, 1);
    uvec4 c = row_fetch(media, row, 2);
    return Medium(uintBitsToFloat(a.xyz), a.w, uintBitsToFloat(b.xyz), uintBitsToFloat(b.w), uintBitsToFloat(c.x), c.y,
                  c.z, c.w);
}

// An entry of the light table; groups that are not used cost nothing.
Light scene_light(uint index)
{
    Row row = row_of(BIND_LIGHTS, LIGHT_TEXELS * index);
    uvec4 a = row_fetch(lights, row, 0);
    uvec4 b = row_fetch(lights, row, 1);
    uvec4 c = row_fetch(lights, row, 2);
    uvec4 d = row_fetch(lights, row, 3);
    uvec4 e = row_fetch(lights, row, 4);
    uvec4 f = row_fetch(lights, row, 5);
    return Light(a.x, a.y, uintBitsToFloat(a.z), uintBitsToFloat(a.w), uintBitsToFloat(b.xyz), b.w,
                 uintBitsToFloat(c.xyz), c.w, uintBitsToFloat(d.xyz), uintBitsToFloat(d.w), uintBitsToFloat(e.xyz),
                 uintBitsToFloat(e.w), uintBitsToFloat(f.xyz), uintBitsToFloat(f.w));
}

#endif
