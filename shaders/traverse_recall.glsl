// Traversal by memory: what the rays of a pass met was recorded, and is looked up. For the limit report: what a render
// takes without traversal. Another pass than that which was recorded meets nothing that makes sense.

#ifndef TRAVERSE_RECALL_GLSL
#define TRAVERSE_RECALL_GLSL

#include "stream.glsl"

void trace_start() {}

bool trace_closest(vec3 origin, vec3 dir, float t_min, float t_max, uint from, out Hit hit)
{
    hit = Hit(t_max, vec2(0.0), NONE, NONE, NONE);
    if (stream_at < stream_end) {
        uvec4 names = stream_texel(stream_at, 2u);
        uvec4 place = stream_texel(stream_at, 3u);
        hit = Hit(uintBitsToFloat(place.x), uintBitsToFloat(place.yz), names.z, names.w, place.w);
        stream_at++;
    }
    return hit.primitive != NONE;
}

bool trace_occluded(vec3 origin, vec3 dir, float t_min, float t_max, uint from, uint to)
{
    Hit hit;
    return trace_closest(origin, dir, t_min, t_max, from, hit);
}

#endif
