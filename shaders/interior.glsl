// Which solid surrounds a ray. A closed mesh whose material is MATERIAL_SOLID is a
// solid; where solids overlap, the one of the highest rank fills the space and the
// boundaries of the others inside it are not there. Materials are named by their
// record; NONE is the space outside all solids.
//
// [Schmidt02] Schmidt, Budge, Simple Nested Dielectrics in Ray Traced Images.

#ifndef INTERIOR_GLSL
#define INTERIOR_GLSL

#include "dielectric.glsl"
#include "surface.glsl"

// Solids that may hold one point; more are counted in the ledger.
const uint INTERIOR_SIZE = 8u;

struct Interior {
    uint current;                 // material that fills the space
    // Only with HAS_NESTED:
    uint count;
    uvec2 entered[INTERIOR_SIZE]; // (material, instance) of every solid that holds the point
};

// What a surface separates, in the direction of travel.
struct Boundary {
    uint before;
    uint after;
    Interior beyond;
};

uint interior_overflows = 0u;

Interior interior_empty()
{
    Interior i;
    i.current = NONE;
    i.count = 0u;
    return i;
}

// Index of refraction; where it is infinite no light travels, and 1 stands for it.
float interior_ior(uint material)
{
    float ior = scene_medium(material).ior;
    return ior == 0.0 ? 1.0 : ior;
}

// Index beyond a boundary over the index before it; IOR_INFINITE where no light gets through.
float interior_eta(Boundary b)
{
    float before = scene_medium(b.before).ior;
    float after = scene_medium(b.after).ior;
    return before == IOR_INFINITE || after == IOR_INFINITE ? IOR_INFINITE : after / before;
}

// Place of a solid among those that hold the point, or their number.
uint interior_slot(Interior i, uvec2 solid)
{
    for (uint k = 0u; k < i.count; k++) {
        if (i.entered[k] == solid) {
            return k;
        }
    }
    return i.count;
}

// Material of the highest rank among the solids.
uint interior_highest(Interior i)
{
    uint rank = 0u;
    uint highest = NONE;
    for (uint k = 0u; k < i.count; k++) {
        uint other = scene_medium(i.entered[k].x).rank;
        if (other > rank) {
            rank = other;
            highest = i.entered[k].x;
        }
    }
    return highest;
}

// The interior beyond a face of a solid. A solid that holds the point already is
// not entered again, nor left where it does not.
Interior interior_cross(Interior i, uvec2 solid, bool is_entered)
{
    uint slot = interior_slot(i, solid);
    if ((slot < i.count) == is_entered) {
        return i;
    }
    if (!is_entered) {
        i.count--;
        i.entered[slot] = i.entered[i.count];
    } else if (i.count < INTERIOR_SIZE) {
        i.entered[i.count] = solid;
        i.count++;
    } else {
        interior_overflows++;
    }
    i.current = interior_highest(i);
    return i;
}

// The boundary of the solid at s for a ray along d, together with those that coincide
// with it: between touching solids there is no gap.
Boundary interior_boundary(Interior here, Hit hit, SurfacePoint s, vec3 d, inout uint rays)
{
    Boundary b;
    b.beyond = here;
    if (!HAS_NESTED) {
        // The side that was hit says it all.
        b.before = s.is_front ? NONE : s.material;
        b.after = s.is_front ? s.material : NONE;
        b.beyond.current = b.after;
        return b;
    }
    b.before = here.current;
    b.beyond = interior_cross(here, uvec2(s.material, hit.instance), s.is_front);
    // The plane is met once more from just before it, to see what else lies there: twice the way
    // to it; where the ray only grazes it, faces count as apart.
    vec3 origin = offset_origin(s.position, s.error, s.ng);
    float t_max = 2.0 * distance(origin, s.position) / max(-dot(s.ng, d), 0.01);
    for (uint k = 0u; k < INTERIOR_SIZE; k++) {
        surface_skip = uvec2(hit.instance, hit.primitive);
        rays++;
        if (!trace_closest(origin, d, 0.0, t_max, NONE, hit)) {
            break;
        }
        SurfaceSide other = surface_side(hit, d);
        uint count = b.beyond.count;
        if (other.is_solid) {
            b.beyond = interior_cross(b.beyond, uvec2(other.material, hit.instance), other.is_front);
        }
        if (b.beyond.count == count) {
            break; // nothing new: the first face was met again
        }
    }
    surface_skip = uvec2(NONE);
    b.after = b.beyond.current;
    return b;
}

// A search for the solids that hold the camera: those that a ray from it leaves without having entered them.
struct InteriorSearch {
    Interior holds;
    Interior ahead;
    uvec2 last;        // triangle that was met last, and the one before
    uvec2 before_last;
};

InteriorSearch interior_search()
{
    return InteriorSearch(interior_empty(), interior_empty(), uvec2(NONE), uvec2(NONE));
}

// Takes note of what the ray met at s; returns where it goes on. Ends the search by `is_found`.
vec3 interior_note(inout InteriorSearch search, Hit hit, SurfacePoint s, out bool is_found)
{
    is_found = !HAS_NESTED && s.is_solid;
    if (is_found) {
        search.holds.current = s.is_front ? NONE : s.material;
    }
    if (!HAS_NESTED) {
        return offset_origin(s.position, s.error, -s.ng);
    }
    // Faces that coincide are met one by one: the ray goes on from before the plane
    // and skips the last triangle; once the first is met again, it goes on beyond.
    uvec2 id = uvec2(hit.instance, hit.primitive);
    bool is_again = id == search.before_last;
    uvec2 solid = uvec2(s.material, hit.instance);
    if (s.is_solid && !is_again) {
        if (s.is_front || interior_slot(search.ahead, solid) < search.ahead.count) {
            search.ahead = interior_cross(search.ahead, solid, s.is_front);
        } else {
            search.holds = interior_cross(search.holds, solid, true);
        }
    }
    search.before_last = is_again ? uvec2(NONE) : search.last;
    search.last = is_again ? uvec2(NONE) : id;
    return offset_origin(s.position, s.error, is_again ? -s.ng : s.ng);
}

#endif
