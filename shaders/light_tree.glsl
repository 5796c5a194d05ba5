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
// The square of how much closer than its start a segment passes at most by a light, relative …
const float CLOSE = 1.0e-8;
// … in square metres, so that a light on it is no division by zero …
const float CLOSEST = 1.0e-30;
// … and the longest that is told from longer ones, metres: the squares of more overflow.
const float SEGMENT_MOST = 1.0e12;

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

// The most that a cluster sends to where `cosine` is that of the angle with its axis, as part of its intensity.
float light_cone_bound(uvec4 cone, float cosine, vec2 reach)
{
    vec2 beyond = light_angle_beyond(light_angle(cosine), light_angle(uintBitsToFloat(cone.y)));
    bool is_dark = uintBitsToFloat(cone.z) < 0.0 && light_angle_beyond(beyond, reach).x < 1.0;
    return is_dark ? 0.0 : light_cosine_bound(beyond, reach);
}

// The largest cosine between `axis` and a direction from a light to a segment, whose line is `apart` from it at the
// closest and which goes from x.x to x.y metres from there.
float light_segment_cosine(vec3 axis, vec3 apart, vec3 direction, vec2 x)
{
    // (a + b x) / √(c + x²) has one extremum, the largest value if a > 0
    float a = dot(axis, apart);
    float b = dot(axis, direction);
    float c = dot(apart, apart);
    vec2 at = a > 0.0 ? vec2(clamp(b * c / a, x.x, x.y)) : x;
    vec2 cosines = (a + b * at) * inversesqrt(c + at * at);
    return max(cosines.x, cosines.y);
}

// In proportion to the most that the cluster in two texels can give at a point of a surface.
float light_surface_importance(uvec4 sphere, uvec4 cone, LightView view)
{
    vec3 to = uintBitsToFloat(sphere.xyz) - view.origin;
    float radius2 = square(uintBitsToFloat(sphere.w));
    float distance2 = dot(to, to);
    float cosines = 1.0;
    if (distance2 > radius2) {
        to *= inversesqrt(distance2);
        float sine2 = radius2 / distance2;
        vec2 reach = vec2(sqrt(1.0 - sine2), sqrt(sine2));
        if (uintBitsToFloat(cone.y) > -1.0) {
            cosines = light_cone_bound(cone, -dot(light_axis(cone.x), to), reach);
        }
        if (!HAS_DIELECTRIC || view.direction != vec3(0.0)) {
            cosines *= light_cosine_bound(light_angle(dot(view.direction, to)), reach);
        }
    }
    return abs(uintBitsToFloat(cone.z)) * cosines / max(distance2, radius2);
}

// The same for a segment as a whole, over which 1/distance² is summed: by its smallest distance alone, what passes
// close by one light would hardly ever see the others.
float light_segment_importance(uvec4 sphere, uvec4 cone, LightView view)
{
    vec3 to = uintBitsToFloat(sphere.xyz) - view.origin;
    // lines that pass closer are not told apart
    float radius2 = max(square(uintBitsToFloat(sphere.w)), CLOSE * dot(to, to));
    float along = dot(to, view.direction);
    vec3 apart = along * view.direction - to;
    float span = min(view.end, SEGMENT_MOST);
    vec2 x = vec2(-along, span - along);
    float apart2 = dot(apart, apart);
    float distance2 = apart2 + square(max(max(x.x, -x.y), 0.0));
    float cosines = 1.0;
    if (distance2 > radius2 && uintBitsToFloat(cone.y) > -1.0) {
        float sine2 = radius2 / distance2;
        vec2 reach = vec2(sqrt(1.0 - sine2), sqrt(sine2));
        cosines = light_cone_bound(cone, light_segment_cosine(light_axis(cone.x), apart, view.direction, x), reach);
    }
    // ∫ dx / (c + x²) = 2 atan(t) / √c, where t = span √c / (√(c + x₀²) √(c + x₁²) + c + x₀ x₁); 2 t / (1 + 2 t / π) for 2 atan t
    float c = max(max(apart2, radius2), CLOSEST);
    vec2 ends = sqrt(c + x * x);
    float around = ends.x * ends.y + c + x.x * x.y;
    return abs(uintBitsToFloat(cone.z)) * cosines * span / (around + 2.0 / PI * span * sqrt(c));
}

float light_importance(uvec4 sphere, uvec4 cone, LightView view)
{
    bool is_segment = HAS_SCATTERING && view.end >= 0.0;
    return is_segment ? light_segment_importance(sphere, cone, view) : light_surface_importance(sphere, cone, view);
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
