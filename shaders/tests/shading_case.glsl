// Test kernels of shading: materials by number, turned into the renderer's own Bsdf.

#ifndef SHADING_CASE_GLSL
#define SHADING_CASE_GLSL

#include "bsdf.glsl"

const uint BIND_TEST_CASES = 20u;
const uint BIND_TEST_INPUT = 21u;
const uint BIND_TEST_OUTPUT = 22u;
const uint BIND_TEST_COUNTS = 23u;

struct Case {
    vec3 wo;
    float roughness;
    vec3 base_color;
    float metallic;
    vec3 f0;    // of the dielectric
    float f90;  // of the dielectric
    float transmission;
    float eta;  // of the interface: index beyond it over index here
    float strength;
    uint is_solid;
};

layout(binding = BIND_TEST_CASES, scalar) readonly buffer CasesBlock { Case cases[]; };

Bsdf case_bsdf(Case c, float cos_o)
{
    SurfacePoint s;
    s.base_color = c.base_color;
    s.metallic = c.metallic;
    s.roughness = c.roughness;
    s.dielectric_f0 = c.f0;
    s.dielectric_f90 = c.f90;
    s.transmission = c.transmission;
    s.strength = vec3(c.strength);
    s.is_solid = c.is_solid != 0u;
    return bsdf_of(s, cos_o, c.eta);
}

#endif
