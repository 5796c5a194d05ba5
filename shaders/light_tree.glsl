// The choice of a light by what it can give where it is asked for: at each node of
// the tree (src/render/light_tree.rs) one of two clusters, in proportion to a bound.
//
// [Conty18] Conty Estevez, Kulla, Importance Sampling of Many Lights with Adaptive Tree Splitting.

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

// One over what stands for one in words of clusters: 2¹⁶ (2¹⁵ − 1).
const float CLUSTER_UNIT = 1.0 / 2147418112.0;

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

// What a node knows of a child.
struct LightCluster {
    vec3 centre;     // of a sphere about the emitters
    float radius;
    vec3 axis;       // of the cone of their normals, or of all that spots shine to
    vec2 angle;      // cosine and sine of its half angle; cosine −1: all directions
    float intensity;
    bool is_sharp;   // nothing goes beyond the cone
    uint link;
};

// A cluster in two texels. Words of two numbers are taken for the upper one: what the lower one adds is less than its last bit.
LightCluster light_cluster(uvec4 sphere, uvec4 cone)
{
    ivec2 upper = ivec2(cone.xy);
    ivec2 lower = upper << 16;
    LightCluster c;
    c.centre = uintBitsToFloat(sphere.xyz);
    c.radius = uintBitsToFloat(sphere.w);
    c.axis = vec3(lower.x, upper.x, lower.y) * CLUSTER_UNIT;
    c.angle = vec2(float(upper.y) * CLUSTER_UNIT, float(sphere.w & 0xFFFFu) / 65535.0);
    c.intensity = abs(uintBitsToFloat(cone.z));
    c.is_sharp = HAS_PUNCTUAL && uintBitsToFloat(cone.z) < 0.0;
    c.link = cone.w;
    return c;
}

// Cosine and sine of max(a − b, 0) for angles in [0, π].
vec2 light_angle_beyond(vec2 a, vec2 b)
{
    return a.x >= b.x ? vec2(1.0, 0.0) : vec2(a.x * b.x + a.y * b.y, a.y * b.x - a.x * b.y);
}

// Cosine and sine of an angle in [0, π].
vec2 light_angle(float cosine)
{
    return vec2(cosine, sqrt(larger(1.0 - cosine * cosine, 0.0)));
}

// The largest cosine that an angle can have that is smaller by `reach` at most.
float light_cosine_bound(vec2 angle, vec2 reach)
{
    return larger(light_angle_beyond(angle, reach).x + CLUSTER_SLACK, 0.0);
}

// About as much, without a root, for an angle of that cosine and another of that sine; 0 for the same ones.
float light_horizon_bound(float cosine, float sine)
{
    return limited(cosine + sine + CLUSTER_SLACK, 0.0, 1.0);
}

// The most that a cluster sends to where `cosine` is that of the angle with its axis, as part of its intensity.
float light_cone_bound(LightCluster c, float cosine, vec2 reach)
{
    vec2 beyond = light_angle_beyond(light_angle(cosine), c.angle);
    bool is_dark = c.is_sharp && light_angle_beyond(beyond, reach).x < 1.0;
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
    vec2 at = a > 0.0 ? vec2(limited(b * c / a, x.x, x.y)) : x;
    vec2 cosines = (a + b * at) * inversesqrt(c + at * at);
    return larger(cosines.x, cosines.y);
}

// In proportion to the most that a cluster can give at a point of a surface. Roots and quotients take most of the time.
float light_surface_importance(LightCluster c, LightView view)
{
    vec3 to = c.centre - view.origin;
    float distance2 = dot(to, to);
    float radius2 = square(c.radius);
    precise float nearest2 = distance2 > radius2 ? distance2 : radius2;
    float inverse = inversesqrt(nearest2);
    // of the angle at which the sphere is seen
    float sine = c.radius * inverse;
    vec2 reach = vec2(sqrt(larger(1.0 - sine * sine, 0.0)), sine);
    to *= inverse;
    float cosines = light_cone_bound(c, -dot(c.axis, to), reach);
    if (!HAS_DIELECTRIC || view.direction != vec3(0.0)) {
        cosines *= light_horizon_bound(dot(view.direction, to), sine);
    }
    cosines = distance2 > radius2 ? cosines : 1.0;
    return c.intensity * cosines * square(inverse);
}

// The same for a segment as a whole, over which 1/distance² is summed: by its smallest distance alone, what passes
// close by one light would hardly ever see the others.
float light_segment_importance(LightCluster cluster, LightView view)
{
    vec3 to = cluster.centre - view.origin;
    // lines that pass closer are not told apart
    float radius2 = larger(square(cluster.radius), CLOSE * dot(to, to));
    float along = dot(to, view.direction);
    vec3 apart = along * view.direction - to;
    float span = smaller(view.end, SEGMENT_MOST);
    vec2 x = vec2(-along, span - along);
    float apart2 = dot(apart, apart);
    float distance2 = apart2 + square(larger(larger(x.x, -x.y), 0.0));
    float cosines = 1.0;
    if (distance2 > radius2) {
        float sine2 = radius2 / distance2;
        vec2 reach = vec2(sqrt(1.0 - sine2), sqrt(sine2));
        cosines = light_cone_bound(cluster, light_segment_cosine(cluster.axis, apart, view.direction, x), reach);
    }
    // ∫ dx / (c + x²) = 2 atan(t) / √c, where t = span √c / (√(c + x₀²) √(c + x₁²) + c + x₀ x₁); 2 t / (1 + 2 t / π) for 2 atan t
    float c = larger(larger(apart2, radius2), CLOSEST);
    vec2 ends = sqrt(c + x * x);
    float around = ends.x * ends.y + c + x.x * x.y;
    return cluster.intensity * cosines * span / (around + 2.0 / PI * span * sqrt(c));
}

float light_importance(LightCluster c, LightView view)
{
    bool is_segment = HAS_SCATTERING && view.end >= 0.0;
    return is_segment ? light_segment_importance(c, view) : light_surface_importance(c, view);
}

// Importance of both children of a node, and their links.
vec2 light_children(uint node, LightView view, out uvec2 links)
{
    Row row = row_of(BIND_LIGHTS, params.light_nodes + LIGHT_NODE_TEXELS * node);
    LightCluster left = light_cluster(row_fetch(lights, row, 0), row_fetch(lights, row, 1));
    LightCluster right = light_cluster(row_fetch(lights, row, 2), row_fetch(lights, row, 3));
    links = uvec2(left.link, right.link);
    return vec2(light_importance(left, view), light_importance(right, view));
}

// A way from the root to a leaf.
struct LightWay {
    uint link;         // of what it has come to
    float u;           // uniform, for the rest of the way and in the leaf
    float probability; // of the way so far; 0: no light can be seen
};

bool light_arrived(LightWay way)
{
    return (way.link & LIGHT_LEAF) != 0u;
}

// Goes on to one of two children; nowhere from a leaf.
void light_step(LightView view, inout LightWay way)
{
    bool is_done = light_arrived(way);
    uvec2 links;
    vec2 importance = light_children(is_done ? 0u : way.link, view, links);
    float sum = importance.x + importance.y;
    vec2 share = importance / sum;
    bool is_right = way.u >= share.x;
    float taken = is_right ? share.y : share.x;
    LightWay next;
    next.link = is_right ? links.y : links.x;
    next.u = limited((is_right ? way.u - share.x : way.u) / taken, 0.0, 1.0 - EPSILON);
    next.probability = way.probability * taken;
    if (!(sum > 0.0)) {
        next = LightWay(LIGHT_LEAF, 0.0, 0.0);
    }
    if (!is_done) {
        way = next;
    }
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
