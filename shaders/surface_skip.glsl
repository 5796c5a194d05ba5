// With HAS_NESTED: what rays pass as if it were not there. Nothing of it is used elsewhere.

#ifndef SURFACE_SKIP_GLSL
#define SURFACE_SKIP_GLSL

// Solids that are of concern at one place: those that hold it, and those with a face there.
const uint SKIP_SIZE = 16u;
// Beside the material of a solid, in bits that materials leave free (TRIANGLE_MATERIAL_MASK).
const uint SKIP_HOLDS = 0x80000000u;   // it holds the place that is asked about
const uint SKIP_SETTLED = 0x40000000u; // nothing else is asked of this solid
const uint SKIP_FLAGS = 0xC0000000u;

struct SurfaceSkip {
    bool is_search;          // for faces of solids that are not settled
    bool is_closed;          // of those below alone
    uvec2 triangle;          // else (instance, primitive), or NONE
    uint count;              // in a search, of solids: (material and flags, instance)
    uvec2 solids[SKIP_SIZE];
};

SurfaceSkip surface_skip;

// Rays pass the triangle; none where it is NONE.
void surface_skip_triangle(uvec2 triangle)
{
    surface_skip.is_search = false;
    surface_skip.is_closed = false;
    surface_skip.triangle = triangle;
}

// The solid at a place; indices are constants (interior_at).
uvec2 surface_skip_at(uint place)
{
    uvec2 solid = surface_skip.solids[0];
    for (uint k = 1u; k < SKIP_SIZE; k++) {
        solid = k == place ? surface_skip.solids[k] : solid;
    }
    return solid;
}

// Place of a solid, or `count`.
uint surface_skip_slot(uvec2 solid)
{
    uint slot = surface_skip.count;
    for (uint k = 0u; k < SKIP_SIZE; k++) {
        bool is_it = uvec2(surface_skip.solids[k].x & ~SKIP_FLAGS, surface_skip.solids[k].y) == solid;
        slot = k < surface_skip.count && is_it ? k : slot;
    }
    return slot;
}

// Notes of a solid whether it holds the place, and that no more is asked of it; false where there is no room for another.
bool surface_skip_settle(uvec2 solid, bool holds)
{
    uint slot = surface_skip_slot(solid);
    if (slot == SKIP_SIZE) {
        return false;
    }
    uvec2 settled = uvec2(solid.x | SKIP_SETTLED | (holds ? SKIP_HOLDS : 0u), solid.y);
    for (uint k = 0u; k < SKIP_SIZE; k++) {
        surface_skip.solids[k] = k == slot ? settled : surface_skip.solids[k];
    }
    surface_skip.count = max(surface_skip.count, slot + 1u);
    return true;
}

// Whether a search asks for a face of the solid.
bool surface_skip_asks(uvec2 solid)
{
    uint slot = surface_skip_slot(solid);
    return slot < surface_skip.count ? (surface_skip_at(slot).x & SKIP_SETTLED) == 0u : !surface_skip.is_closed;
}

#endif
