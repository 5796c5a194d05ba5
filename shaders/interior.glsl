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

// Where faces are looked for that coincide with one, and what is too close together to have an order, in bounds on the
// error of the place (interior_boundary). By a model in single precision of rays past corners of eight blocks: with these none of
// 11 400 is lost, with 4 instead of 6 up to 12 of 3000, with an order of everything up to 214 of 3000.
const float SEARCH_BEFORE = 2.0;
const float SEARCH_BEYOND = 6.0;
const float SEARCH_TIE = 0.1;

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
    surface_skip.is_search = true;
    surface_skip.direction = d;
    // What lies there is met once more, backwards from a little beyond: of the faces of each solid the last one says whether
    // the ray is in it afterwards. So it does not matter where a search ends, nor that the next one meets some of them again.
    // Where the order of a front and a back is not known, a corner or an edge was touched, and the solid stays what it was.
    float cosine = max(-dot(s.ng, d), 0.01);
    float bound = max_component(s.error);
    float step = bound / cosine;
    vec3 origin = s.position + SEARCH_BEYOND * (cosine > MIN_STRAIGHT_COSINE ? step * d : -bound * s.ng);
    float at[SKIP_SIZE];
    uvec2 own = uvec2(s.material, hit.instance);
    bool fits = true;
    // At first the face that the ray met is believed. Where two other solids are found an edge is near, which the way back, rounded
    // anew, may pass on another side: then that face counts only if it is met again.
    for (uint attempt = 0u; attempt < 2u; attempt++) {
        surface_skip.count = here.count;
        for (uint k = 0u; k < here.count; k++) {
            surface_skip.solids[k] = uvec2(here.entered[k].x | SKIP_HELD | SKIP_HOLDS, here.entered[k].y);
        }
        uint others = 0u;
        float t_min = 0.0;
        for (uint k = 0u; k < 2u * SKIP_SIZE; k++) {
            bool is_own = attempt == 0u && k == 0u;
            uvec2 solid = own;
            bool is_front = s.is_front;
            float t = SEARCH_BEYOND * step;
            if (!is_own) {
                rays++;
                if (!trace_closest(origin, -d, t_min, (SEARCH_BEFORE + SEARCH_BEYOND) * step, NONE, hit)) {
                    break;
                }
                SurfaceSide other = surface_side(hit.instance, hit.primitive, d);
                if (!other.is_solid) {
                    t_min = hit.t;
                    continue;
                }
                solid = uvec2(other.material, hit.instance);
                is_front = other.is_front;
                t = hit.t;
            }
            uint slot = surface_skip_slot(solid);
            fits = slot < SKIP_SIZE;
            if (!fits) {
                break;
            }
            if (slot == surface_skip.count) {
                surface_skip.solids[slot] = solid;
                surface_skip.count++;
            }
            uint flags = surface_skip.solids[slot].x & SKIP_FLAGS;
            bool was_held = (flags & SKIP_HELD) != 0u;
            bool holds = is_front;
            if ((flags & SKIP_FOUND) != 0u) {
                float later = at[slot] - t;
                holds = abs(later) <= SEARCH_TIE * step ? was_held : (later > 0.0) == is_front;
                flags |= SKIP_SETTLED;
            } else {
                flags |= SKIP_FOUND | (!is_own && is_front == was_held ? SKIP_SETTLED : 0u);
                at[slot] = t;
                others += solid == own ? 0u : 1u;
            }
            surface_skip.solids[slot].x = solid.x | (flags & ~SKIP_HOLDS) | (holds ? SKIP_HOLDS : 0u);
        }
        if (others < 2u) {
            break;
        }
    }
    b.beyond.count = 0u;
    for (uint k = 0u; k < surface_skip.count; k++) {
        uvec2 held = surface_skip.solids[k];
        if ((held.x & SKIP_HOLDS) == 0u) {
            continue;
        }
        if (b.beyond.count < INTERIOR_SIZE) {
            b.beyond.entered[b.beyond.count] = uvec2(held.x & ~SKIP_FLAGS, held.y);
            b.beyond.count++;
        } else {
            fits = false;
        }
    }
    interior_overflows += fits ? 0u : 1u;
    surface_skip_triangle(uvec2(NONE));
    b.beyond.current = interior_highest(b.beyond);
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
