// The rays of a render, those of each pixel in order, and what they met, for the limit report. Other kernels than those
// that are named here keep nothing.

#ifndef STREAM_GLSL
#define STREAM_GLSL

#include "scene.glsl"

#if defined(TRACE_RECORDS)
layout(binding = BIND_STREAM, scalar) writeonly buffer StreamBlock { StreamRay stream[]; };
layout(binding = BIND_STREAM_COUNTS, scalar) writeonly buffer StreamCountsBlock { uint stream_counts[]; };
#elif defined(ADDRESSES)
#define stream(i) scene_quad(BIND_STREAM, i)
#else
layout(binding = BIND_STREAM) uniform usamplerBuffer stream;
#endif
#ifdef ADDRESSES
#define stream_starts(i) scene_single(BIND_STREAM_STARTS, i)
#else
layout(binding = BIND_STREAM_STARTS) uniform usamplerBuffer stream_starts;
#endif

// The next ray of the pixel, and the end of what there is of it.
uint stream_at;
uint stream_end;

// Pixels are counted tile by tile.
void stream_pixel(uint pixel)
{
    stream_at = texelFetch(stream_starts, int(pixel)).x;
    stream_end = texelFetch(stream_starts, int(pixel) + 1).x;
}

#ifdef TRACE_RECORDS

uint stream_flags; // of the next ray

// A sample of the pixel begins.
void stream_sample() { stream_flags = STREAM_IS_FIRST; }

// Keeps a ray where there is room; all are counted.
void stream_keep(vec3 origin, vec3 dir, float t_max, uint from, uint to, uint flags, Hit hit)
{
    if (stream_at < stream_end) {
        stream[stream_at] = StreamRay(origin, t_max, dir, from, to, flags | stream_flags, hit.instance, hit.primitive, hit.t,
                                      hit.bary, hit.record);
    }
    stream_at++;
    stream_flags = 0u;
}

// All samples of the pixel have ended.
void stream_finish(uint pixel) { stream_counts[pixel] = stream_at - texelFetch(stream_starts, int(pixel)).x; }

#else

// The texel of a ray.
uvec4 stream_texel(uint ray, uint k) { return texelFetch(stream, int(STREAM_RAY_TEXELS * ray + k)); }

#endif

#endif
