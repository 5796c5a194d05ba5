// A ray meets a triangle in coordinates in which the ray is the z axis [Woop13], without the fall-back to double
// precision, which only reduces the number of rays that hit both triangles of an edge.
//
// No gaps: edge functions get the same sign (or zero, which counts as inside) in both triangles of an edge, because a
// vertex is sheared by the same operations in each and every product is rounded once (`precise`).
//
// [Woop13] Woop, Benthin, Wald: Watertight ray/triangle intersection. Journal of Computer Graphics Techniques 2(1), 2013.

#ifndef SHEAR_GLSL
#define SHEAR_GLSL

// Rows of the shear that takes a direction to the z axis, and its largest component to one.
struct Shear {
    vec3 x;
    vec3 y;
    vec3 z;
};

Shear shear_along(vec3 d) {
    // Factors 0 and 1 are exact, so that this equals [Woop13] without its permutation of axes.
    vec3 a = abs(d);
    Shear shear;
    if (a.x >= a.y && a.x >= a.z) {
        shear.x = vec3(-d.y / d.x, 1.0, 0.0);
        shear.y = vec3(-d.z / d.x, 0.0, 1.0);
        shear.z = vec3(1.0 / d.x, 0.0, 0.0);
    } else if (a.y >= a.z) {
        shear.x = vec3(0.0, -d.z / d.y, 1.0);
        shear.y = vec3(1.0, -d.x / d.y, 0.0);
        shear.z = vec3(0.0, 1.0 / d.y, 0.0);
    } else {
        shear.x = vec3(1.0, 0.0, -d.x / d.z);
        shear.y = vec3(0.0, 1.0, -d.y / d.z);
        shear.z = vec3(0.0, 0.0, 1.0 / d.z);
    }
    return shear;
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

// Whether the edge functions have one sign; zero is both. Comparisons instead of min and max, which take three
// instructions each on lavapipe for the sake of NaN; `precise` keeps them.
bool shear_inside(vec3 edges) {
    precise float least = edges.x < edges.y ? edges.x : edges.y;
    least = edges.z < least ? edges.z : least;
    precise float most = edges.x > edges.y ? edges.x : edges.y;
    most = edges.z > most ? edges.z : most;
    return least >= 0.0 || most <= 0.0;
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
