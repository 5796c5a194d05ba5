// The choice of a light by what it can give where it is asked for: at each node of
// the tree (src/render/light_tree.rs) one of two clusters, in proportion to a bound.
//
// [Conty18] Conty Estevez, Kulla, Importance Sampling of Many Lights with Adaptive Tree Splitting.
// [Cigolle14] Cigolle et al., A Survey of Efficient Representations for Independent Unit Vectors.

#ifndef LIGHT_TREE_GLSL
#define LIGHT_TREE_GLSL

#include "math.glsl"
#include "scene.glsl"

// What the choice errs on the generous side by, in cosines: bounds are rounded.
const float CLUSTER_SLACK = 1.0e-3;

// Where light is asked for: a point of a surface, or a segment in a medium, whose light may be scattered anywhere on it.
struct LightView {
    vec3 origin;
    vec3 direction;  // unit; of a surface: its normal, or 0 where light from both sides counts
    float end;       // metres; below 0: a surface
};

LightView light_view_surface(vec3 point, vec3 normal)
{
    return LightView(point, normal, -1.0);
}

vec3 light_axis(uint packed)
{
    vec2 e = unpackSnorm2x16(packed);
    vec3 v = vec3(e, 1.0 - abs(e.x) - abs(e.y));
    float fold = max(-v.z, 0.0);
    v.xy += vec2(v.x >= 0.0 ? -fold : fold, v.y >= 0.0 ? -fold : fold);
    return normalize(v);
}

// Cosine and sine of max(a − b, 0) for angles in [0, π].
vec2 light_angle_beyond(vec2 a, vec2 b)
{
    return a.x >= b.x ? vec2(1.0, 0.0) : vec2(a.x * b.x + a.y * b.y, a.y * b.x - a.x * b.y);
}

// Cosine and sine of an angle in [0, π].
vec2 light_angle(float cosine)
{
    return vec2(cosine, sqrt(max(1.0 - cosine * cosine, 0.0)));
}

// The largest cosine that an angle can have that is smaller by `reach` at most.
float light_cosine_bound(vec2 angle, vec2 reach)
{
    return max(light_angle_beyond(angle, reach).x + CLUSTER_SLACK, 0.0);
}

// In proportion to the most that the cluster in two texels can give at the view.
float light_importance(uvec4 sphere, uvec4 cone, LightView view)
{
    vec3 to = uintBitsToFloat(sphere.xyz) - view.origin;
    bool is_segment = HAS_SCATTERING && view.end >= 0.0;
    if (is_segment) {
        to -= clamp(dot(to, view.direction), 0.0, view.end) * view.direction;
    }
    float radius2 = square(uintBitsToFloat(sphere.w));
    float distance2 = dot(to, to);
    float cosine_cone = uintBitsToFloat(cone.y);
    float cosines = 1.0;
    if (distance2 > radius2 && !is_segment) {
        to *= inversesqrt(distance2);
        float sine2 = radius2 / distance2;
        vec2 reach = vec2(sqrt(1.0 - sine2), sqrt(sine2));
        if (cosine_cone > -1.0) {
            vec2 angle = light_angle_beyond(light_angle(-dot(light_axis(cone.x), to)), light_angle(cosine_cone));
            cosines = light_cosine_bound(angle, reach);
        }
        if (!HAS_DIELECTRIC || view.direction != vec3(0.0)) {
            cosines *= light_cosine_bound(light_angle(dot(view.direction, to)), reach);
        }
    }
    return uintBitsToFloat(cone.z) * cosines / max(distance2, radius2);
}

// Importance of both children of a node, and their links.
vec2 light_children(uint node, LightView view, out uvec2 links)
{
    int at = int(params.light_nodes + LIGHT_NODE_TEXELS * node);
    uvec4 left = texelFetch(lights, at + 1);
    uvec4 right = texelFetch(lights, at + 3);
    links = uvec2(left.w, right.w);
    return vec2(light_importance(texelFetch(lights, at), left, view), light_importance(texelFetch(lights, at + 2), right, view));
}

// Goes to a leaf by u, which is uniform in the leaf afterwards. Gives the link of the leaf and the
// probability of the way there; 0: no light can be seen.
uint light_descend(LightView view, inout float u, out float probability)
{
    probability = 1.0;
    uint link = 0u;
    do {
        uvec2 links;
        vec2 importance = light_children(link, view, links);
        float sum = importance.x + importance.y;
        if (!(sum > 0.0)) {
            probability = 0.0;
            return LIGHT_LEAF;
        }
        vec2 share = importance / sum;
        bool is_right = u >= share.x;
        probability *= is_right ? share.y : share.x;
        u = is_right ? (u - share.x) / share.y : u / share.x;
        u = clamp(u, 0.0, 1.0 - EPSILON);
        link = is_right ? links.y : links.x;
    } while ((link & LIGHT_LEAF) == 0u);
    return link;
}

// Probability of the way to a leaf, a bit for each step.
float light_way_probability(LightView view, uint trail)
{
    float probability = 1.0;
    uint link = 0u;
    do {
        uvec2 links;
        vec2 importance = light_children(link, view, links);
        bool is_right = (trail & 1u) != 0u;
        float sum = importance.x + importance.y;
        probability *= sum > 0.0 ? (is_right ? importance.y : importance.x) / sum : 0.0;
        link = is_right ? links.y : links.x;
        trail >>= 1u;
    } while ((link & LIGHT_LEAF) == 0u);
    return probability;
}

// Probability of the leaf that holds an emissive triangle, over the leaf's power.
float light_tree_density(LightView view, uint placement, uint triangle)
{
    uint low = 0u;
    uint high = params.light_key_count - 1u;
    while (low < high) {
        uint middle = (low + high + 1u) / 2u;
        uvec4 key = texelFetch(lights, int(params.light_keys + middle));
        bool is_beyond = key.x > placement || (key.x == placement && key.y > triangle);
        low = is_beyond ? low : middle;
        high = is_beyond ? middle - 1u : high;
    }
    uvec4 key = texelFetch(lights, int(params.light_keys + low));
    // A triangle without area is no light.
    bool is_there = key.x == placement && key.y == triangle;
    return is_there ? light_way_probability(view, key.z) / uintBitsToFloat(key.w) : 0.0;
}

#endif
