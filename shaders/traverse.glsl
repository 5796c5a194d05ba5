// The traversal contract: what a ray meets. The entry chooses the backend.
// Directions are unit length, t is in metres and strictly inside (t_min, t_max);
// nothing is culled; a cut-out triangle is asked through surface_is_opaque.
// `from` is the record of the hit that the ray leaves, or NONE: a plane is not met
// twice, so a traversal may pass over what the record stands for. The ray must start
// off the plane, on the side that it goes to.

#ifndef TRAVERSE_GLSL
#define TRAVERSE_GLSL

#include "scene.glsl"

struct Hit {
    float t;        // metres
    vec2 bary;      // weights of the second and third vertex
    uint instance;
    uint primitive; // within the instance's group
    uint record;    // names triangles in one plane, this one among them, for `from`; NONE where there is no name
};

// Deterministic alpha test; defined in surface.glsl.
bool surface_is_opaque(uint instance, uint primitive, vec2 bary);
// Corners in the space of their group; defined in surface.glsl.
void surface_corners(uint instance, uint primitive, out vec3 a, out vec3 b, out vec3 c);

#include "surface_skip.glsl"

#ifdef TRAVERSE_QUERY
#include "traverse_query.glsl"
#endif
#ifdef TRAVERSE_PIPELINE
#include "traverse_pipeline.glsl"
#endif
#ifdef TRAVERSE_SOFTWARE
#include "traverse_software.glsl"
#endif
#ifdef TRAVERSE_RECALL
#include "traverse_recall.glsl"
#endif
#ifdef TRAVERSE_NOTHING
#include "traverse_nothing.glsl"
#endif

#endif
