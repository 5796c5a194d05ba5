// Texture look-up in fp32: texels are decoded to linear light, then filtered.
// Done by hand, since texture units filter with 8-bit weights and differ between
// devices.

#ifndef TEXTURE_GLSL
#define TEXTURE_GLSL

#include "scene.glsl"

// Texel coordinate i wrapped into 0 … size − 1.
int texture_wrap(int i, int size, uint mode)
{
    if (mode == WRAP_CLAMP) {
        return clamp(i, 0, size - 1);
    }
    // GLSL leaves % of negative numbers undefined.
    int period = mode == WRAP_MIRROR ? 2 * size : size;
    int k = i - period * int(floor(float(i) / float(period)));
    k = clamp(k, 0, period - 1);
    return k < size ? k : period - 1 - k;
}

float texture_srgb(uint byte)
{
    return uintBitsToFloat(texelFetch(texels, int(byte)).x);
}

// One texel, linear.
vec4 texture_texel(TextureUse use, int x, int y)
{
    uint format = use.format & 15u;
    uint index = uint(y) * use.width + uint(x);
    if (format == FORMAT_RGBA16) {
        uint low = texelFetch(texels, int(use.first_texel + 2u * index)).x;
        uint high = texelFetch(texels, int(use.first_texel + 2u * index + 1u)).x;
        return vec4(unpackUnorm2x16(low), unpackUnorm2x16(high));
    }
    uint word = texelFetch(texels, int(use.first_texel + index)).x;
    vec4 value = unpackUnorm4x8(word);
    if (format == FORMAT_SRGB8) {
        value.rgb = vec3(texture_srgb(word & 255u), texture_srgb(word >> 8u & 255u), texture_srgb(word >> 16u & 255u));
    }
    return value;
}

// Value at the coordinates of the mesh, before the use's transform.
vec4 texture_sample(TextureUse use, vec2 mesh_uv)
{
    vec3 h = vec3(mesh_uv, 1.0);
    vec2 uv = vec2(dot(use.uv_row_u, h), dot(use.uv_row_v, h));
    uint wrap_u = use.format >> 4u & 15u;
    uint wrap_v = use.format >> 8u & 15u;
    ivec2 size = ivec2(use.width, use.height);
    // Whole periods are removed first: large coordinates keep their precision.
    uv -= vec2(wrap_u == WRAP_CLAMP ? 0.0 : 2.0 * floor(0.5 * uv.x), wrap_v == WRAP_CLAMP ? 0.0 : 2.0 * floor(0.5 * uv.y));
    vec2 at = clamp(uv, vec2(-4.0), vec2(4.0)) * vec2(size);
    if ((use.format >> 12u) == FILTER_NEAREST) {
        ivec2 i = ivec2(floor(at));
        return texture_texel(use, texture_wrap(i.x, size.x, wrap_u), texture_wrap(i.y, size.y, wrap_v));
    }
    at -= 0.5;
    vec2 base = floor(at);
    vec2 f = at - base;
    ivec2 i = ivec2(base);
    int x0 = texture_wrap(i.x, size.x, wrap_u);
    int x1 = texture_wrap(i.x + 1, size.x, wrap_u);
    int y0 = texture_wrap(i.y, size.y, wrap_v);
    int y1 = texture_wrap(i.y + 1, size.y, wrap_v);
    vec4 top = mix(texture_texel(use, x0, y0), texture_texel(use, x1, y0), f.x);
    vec4 bottom = mix(texture_texel(use, x0, y1), texture_texel(use, x1, y1), f.x);
    return mix(top, bottom, f.y);
}

#endif
