// No traversal: nothing is met. For the limit report: what reading recorded rays takes by itself.

#ifndef TRAVERSE_NOTHING_GLSL
#define TRAVERSE_NOTHING_GLSL

void trace_start() {}

bool trace_closest(vec3 origin, vec3 dir, float t_min, float t_max, uint from, out Hit hit)
{
    hit = Hit(t_max, vec2(0.0), NONE, from, NONE);
    // never, but so all that was read is needed
    return dot(origin, dir) + t_max < -T_FAR;
}

bool trace_occluded(vec3 origin, vec3 dir, float t_min, float t_max, uint from, uint to)
{
    Hit hit;
    return trace_closest(origin, dir, t_min, t_max, from, hit);
}

#endif
