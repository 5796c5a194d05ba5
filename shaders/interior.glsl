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

// Where faces are looked for that coincide with one, in bounds on the error of the place (interior_find).
const float SEARCH_BEFORE = 2.0;
const float SEARCH_BEYOND = 6.0;
// Opaque surfaces that may hide a face for which a ray is sent (interior_ask); more are counted in the ledger.
const uint ASK_OPAQUE = 32u;

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

// The solid at a place. Indices are constants here and below, so that arrays are registers: a driver may search its way
// to an index that is not, by branches at each use.
uvec2 interior_at(Interior i, uint place)
{
    uvec2 solid = i.entered[0];
    for (uint k = 1u; k < INTERIOR_SIZE; k++) {
        solid = k == place ? i.entered[k] : solid;
    }
    return solid;
}

void interior_put(inout Interior i, uint place, uvec2 solid)
{
    for (uint k = 0u; k < INTERIOR_SIZE; k++) {
        i.entered[k] = k == place ? solid : i.entered[k];
    }
}

// Place of a solid among those that hold the point, or their number.
uint interior_slot(Interior i, uvec2 solid)
{
    uint slot = i.count;
    for (uint k = 0u; k < INTERIOR_SIZE; k++) {
        slot = k < i.count && i.entered[k] == solid ? k : slot;
    }
    return slot;
}

// Material of the highest rank among the solids.
uint interior_highest(Interior i)
{
    uint rank = 0u;
    uint highest = NONE;
    for (uint k = 0u; k < i.count; k++) {
        uint material = interior_at(i, k).x;
        uint other = scene_medium(material).rank;
        if (other > rank) {
            rank = other;
            highest = material;
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
        interior_put(i, slot, interior_at(i, i.count));
    } else if (i.count < INTERIOR_SIZE) {
        interior_put(i, i.count, solid);
        i.count++;
    } else {
        interior_overflows++;
    }
    i.current = interior_highest(i);
    return i;
}

// Notes the solids that have a face at s and are not settled, and by the last of it whether they hold what is beyond. Returns whether an edge is
// so near that a ray may pass it on another side; `fits` becomes false where there are too many solids.
bool interior_find(SurfacePoint s, vec3 d, inout bool fits, inout uint rays)
{
    float cosine = larger(-dot(s.ng, d), 0.01);
    float bound = max_component(s.error);
    float step = bound / cosine;
    float end = (SEARCH_BEFORE + SEARCH_BEYOND) * step;
    vec3 origin = s.position + SEARCH_BEYOND * (cosine > MIN_STRAIGHT_COSINE ? step * d : -bound * s.ng);
    float t_min = 0.0;
    float edge = s.edge;
    bool is_shared = false;
    for (uint k = 0u; k < 2u * SKIP_SIZE && fits; k++) {
        Hit hit;
        rays++;
        if (!trace_closest(origin, -d, t_min, end, NONE, hit)) {
            break;
        }
        SurfaceSide side = surface_side(hit, d);
        if (side.is_solid) {
            is_shared = true;
            edge = smaller(edge, side.edge);
            fits = surface_skip_settle(uvec2(side.material, hit.instance), side.is_front);
        } else {
            t_min = hit.t;
        }
    }
    return is_shared && edge < end;
}

// Asks anew which of the solids that are noted hold `origin`, where a ray goes straight on along d: the first face of each that this ray
// will meet says it, so that what is thought fits what is met. False where too much hides them.
bool interior_ask(vec3 origin, vec3 d, inout uint rays)
{
    surface_skip.is_closed = true;
    for (uint k = 0u; k < SKIP_SIZE; k++) {
        surface_skip.solids[k].x &= ~SKIP_FLAGS;
    }
    float t_min = 0.0;
    bool is_missed = false;
    for (uint k = 0u; k < SKIP_SIZE + ASK_OPAQUE && !is_missed; k++) {
        Hit hit;
        rays++;
        is_missed = !trace_closest(origin, d, t_min, T_FAR, NONE, hit);
        if (!is_missed) {
            SurfaceSide side = surface_side(hit, d);
            if (side.is_solid) {
                surface_skip_settle(uvec2(side.material, hit.instance), !side.is_front);
            } else {
                t_min = hit.t;
            }
        }
    }
    surface_skip.is_closed = false;
    return is_missed;
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
    surface_skip.count = here.count;
    for (uint k = 0u; k < INTERIOR_SIZE; k++) {
        surface_skip.solids[k] = uvec2(here.entered[k].x | SKIP_HOLDS, here.entered[k].y);
    }
    bool fits = surface_skip_settle(uvec2(s.material, hit.instance), s.is_front);
    if (interior_find(s, d, fits, rays)) {
        fits = interior_ask(s.position + surface_step(s, d), d, rays) && fits;
    }
    b.beyond.count = 0u;
    for (uint k = 0u; k < surface_skip.count; k++) {
        uvec2 solid = surface_skip_at(k);
        if ((solid.x & SKIP_HOLDS) != 0u && b.beyond.count < INTERIOR_SIZE) {
            interior_put(b.beyond, b.beyond.count, uvec2(solid.x & ~SKIP_FLAGS, solid.y));
            b.beyond.count++;
        } else {
            fits = fits && (solid.x & SKIP_HOLDS) == 0u;
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
