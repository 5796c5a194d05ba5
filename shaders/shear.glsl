// A ray meets a triangle in coordinates in which the ray is the z axis [Woop13], without the fall-back to double
// precision, which only reduces the number of rays that hit both triangles of an edge.
//
// No gaps: edge functions get the same sign (or zero, which counts as inside) in both triangles of an edge, because a
// vertex is sheared by the same operations in each and every product is rounded once (`precise`).
//
// [Woop13] Woop, Benthin, Wald: Watertight ray/triangle intersection. Journal of Computer Graphics Techniques 2(1), 2013.

#ifndef SHEAR_GLSL
#define SHEAR_GLSL

#include "math.glsl"

// Rows of the shear that takes a direction to the z axis, and its largest component to one.
struct Shear {
    vec3 x;
    vec3 y;
    vec3 z;
};

Shear shear_along(vec3 d) {
    vec3 a = abs(d);
    bool is_x = a.x >= a.y && a.x >= a.z;
    bool is_y = !is_x && a.y >= a.z;
    // Numerators are chosen, not quotients: a CPU takes long to divide.
    float largest = is_x ? d.x : is_y ? d.y : d.z;
    float x = -(is_x ? d.y : is_y ? d.z : d.x) / largest;
    float y = -(is_x ? d.z : is_y ? d.x : d.y) / largest;
    float z = 1.0 / largest;
    // Factors 0 and 1 are exact, so that this equals [Woop13] without its permutation of axes.
    if (is_x) return Shear(vec3(x, 1.0, 0.0), vec3(y, 0.0, 1.0), vec3(z, 0.0, 0.0));
    if (is_y) return Shear(vec3(0.0, x, 1.0), vec3(1.0, y, 0.0), vec3(0.0, z, 0.0));
    return Shear(vec3(1.0, 0.0, x), vec3(0.0, 1.0, y), vec3(0.0, 0.0, z));
}

vec3 shear_vertex(Shear shear, vec3 origin, vec3 vertex) {
    precise vec3 v = vertex - origin;
    precise vec3 sheared = v.x * vec3(shear.x.x, shear.y.x, shear.z.x) +
                           v.y * vec3(shear.x.y, shear.y.y, shear.z.y) +
                           v.z * vec3(shear.x.z, shear.y.z, shear.z.z);
    return sheared;
}

float shear_cross(vec3 a, vec3 b) {
    precise float product = a.x * b.y - a.y * b.x;
    return product;
}

// Whether the edge functions have one sign; zero is both.
bool shear_inside(vec3 edges) {
    return smaller(edges.z, smaller(edges.x, edges.y)) >= 0.0 || larger(edges.z, larger(edges.x, edges.y)) <= 0.0;
}

// Meets a single triangle; `bary` holds the weights of its second and third vertex.
bool shear_meets(Shear shear, vec3 origin, vec3 v0, vec3 v1, vec3 v2, out float t, out vec2 bary) {
    vec3 a = shear_vertex(shear, origin, v0);
    vec3 b = shear_vertex(shear, origin, v1);
    vec3 c = shear_vertex(shear, origin, v2);
    vec3 edges = vec3(shear_cross(c, b), shear_cross(a, c), shear_cross(b, a));
    float sum = edges.x + edges.y + edges.z;
    bary = edges.yz / sum;
    // A mean of the vertices' depths: never beyond the triangle, even where it is seen edge-on.
    t = a.z + (edges.y * (b.z - a.z) + edges.z * (c.z - a.z)) / sum;
    return shear_inside(edges) && sum != 0.0;
}

#endif
