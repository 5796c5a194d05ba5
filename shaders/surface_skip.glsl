// With HAS_NESTED: what rays pass as if it were not there. Nothing of it is used elsewhere.

#ifndef SURFACE_SKIP_GLSL
#define SURFACE_SKIP_GLSL

// Solids that are of concern at one place: those that hold it, and those with a face there.
const uint SKIP_SIZE = 16u;
// Beside the material of a solid, in bits that materials leave free (TRIANGLE_MATERIAL_MASK).
const uint SKIP_HELD = 0x80000000u;    // the ray was in it before
const uint SKIP_HOLDS = 0x40000000u;   // the ray is in it afterwards, as far as is known
const uint SKIP_FOUND = 0x20000000u;   // a face was found; one of the other side may still change what it says
const uint SKIP_SETTLED = 0x10000000u; // nothing else is asked of this solid
const uint SKIP_FLAGS = 0xF0000000u;

struct SurfaceSkip {
    bool is_search;          // for faces that coincide, fronts being those that a ray along `direction` enters by
    vec3 direction;
    uvec2 triangle;          // else (instance, primitive), or NONE
    uint count;              // in a search, of solids: (material and flags, instance)
    uvec2 solids[SKIP_SIZE];
};

SurfaceSkip surface_skip;

// Rays pass the triangle; none where it is NONE.
void surface_skip_triangle(uvec2 triangle)
{
    surface_skip.is_search = false;
    surface_skip.triangle = triangle;
}

// Place of a solid, or `count`.
uint surface_skip_slot(uvec2 solid)
{
    uint slot = surface_skip.count;
    for (uint k = 0u; k < surface_skip.count; k++) {
        slot = uvec2(surface_skip.solids[k].x & ~SKIP_FLAGS, surface_skip.solids[k].y) == solid ? k : slot;
    }
    return slot;
}

// Whether a search asks for a face of the solid.
bool surface_skip_asks(uvec2 solid, bool is_front)
{
    uint slot = surface_skip_slot(solid);
    uint flags = slot < surface_skip.count ? surface_skip.solids[slot].x : 0u;
    return (flags & SKIP_SETTLED) == 0u && ((flags & SKIP_FOUND) == 0u || ((flags & SKIP_HOLDS) != 0u) != is_front);
}

#endif
