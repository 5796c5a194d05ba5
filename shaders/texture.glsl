// Texture look-up in fp32: texels are decoded to linear light, then filtered.
// Done by hand, since texture units filter with 8-bit weights and differ between
// devices.

#ifndef TEXTURE_GLSL
#define TEXTURE_GLSL

#include "math.glsl"
#include "scene.glsl"

// Whether any texture has a bit of TEXTURE_KINDS.
bool texture_may(uint kind)
{
    return (TEXTURE_KINDS >> kind & 1u) != 0u;
}

// Texel coordinate i, a whole number, wrapped into 0 … size − 1.
float texture_wrap(float i, float size, uint mode)
{
    bool is_mirrored = texture_may(TEXTURE_KIND_MIRROR) && mode == WRAP_MIRROR;
    float period = is_mirrored ? 2.0 * size : size;
    float k = limited(i - period * floor(i / period), 0.0, period - 1.0);
    k = is_mirrored && k >= size ? period - 1.0 - k : k;
    return texture_may(TEXTURE_KIND_CLAMP) && mode == WRAP_CLAMP ? limited(i, 0.0, size - 1.0) : k;
}

float texture_srgb(uint byte)
{
    return uintBitsToFloat(texelFetch(texels, int(byte)).x);
}

// One texel, linear.
vec4 texture_texel(TextureUse use, bool may_be_srgb, float x, float y)
{
    uint format = use.format & 15u;
    uint index = uint(whole(y)) * use.width + uint(whole(x));
    if (texture_may(TEXTURE_KIND_RGBA16) && format == FORMAT_RGBA16) {
        uint low = texelFetch(texels, int(use.first_texel + 2u * index)).x;
        uint high = texelFetch(texels, int(use.first_texel + 2u * index + 1u)).x;
        return vec4(unpackUnorm2x16(low), unpackUnorm2x16(high));
    }
    uint word = texelFetch(texels, int(use.first_texel + index)).x;
    vec4 value = unpackUnorm4x8(word);
    if (may_be_srgb && format == FORMAT_SRGB8) {
        value.rgb = vec3(texture_srgb(word & 255u), texture_srgb(word >> 8u & 255u), texture_srgb(word >> 16u & 255u));
    }
    return value;
}

// Value at the coordinates of the mesh, before the use's transform, of a texture in a slot.
vec4 texture_sample(TextureUse use, uint slot, vec2 mesh_uv)
{
    bool may_be_srgb = texture_may(TEXTURE_KIND_SRGB + slot);
    vec3 h = vec3(mesh_uv, 1.0);
    vec2 uv = vec2(dot(use.uv_row_u, h), dot(use.uv_row_v, h));
    uint wrap_u = use.format >> 4u & 15u;
    uint wrap_v = use.format >> 8u & 15u;
    vec2 size = vec2(use.width, use.height);
    // Whole periods are removed first: large coordinates keep their precision.
    bvec2 is_clamped = texture_may(TEXTURE_KIND_CLAMP) ? equal(uvec2(wrap_u, wrap_v), uvec2(WRAP_CLAMP)) : bvec2(false);
    uv -= mix(2.0 * floor(0.5 * uv), vec2(0.0), is_clamped);
    vec2 at = limited(uv, -4.0, 4.0) * size;
    bool is_nearest = !texture_may(TEXTURE_KIND_LINEAR) || (use.format >> 12u) == FILTER_NEAREST;
    if (texture_may(TEXTURE_KIND_NEAREST) && is_nearest) {
        vec2 i = floor(at);
        return texture_texel(use, may_be_srgb, texture_wrap(i.x, size.x, wrap_u), texture_wrap(i.y, size.y, wrap_v));
    }
    at -= 0.5;
    vec2 base = floor(at);
    vec2 f = at - base;
    float x0 = texture_wrap(base.x, size.x, wrap_u);
    float x1 = texture_wrap(base.x + 1.0, size.x, wrap_u);
    float y0 = texture_wrap(base.y, size.y, wrap_v);
    float y1 = texture_wrap(base.y + 1.0, size.y, wrap_v);
    vec4 top = mix(texture_texel(use, may_be_srgb, x0, y0), texture_texel(use, may_be_srgb, x1, y0), f.x);
    vec4 bottom = mix(texture_texel(use, may_be_srgb, x0, y1), texture_texel(use, may_be_srgb, x1, y1), f.x);
    return mix(top, bottom, f.y);
}

#endif
