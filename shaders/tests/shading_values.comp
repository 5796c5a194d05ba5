#version 460
// Test kernel: values of the scattering functions for given directions.
#extension GL_GOOGLE_include_directive : require
#include "tests/shading_case.glsl"

layout(local_size_x = 64) in;

const uint KIND_BSDF = 0u;       // f cosθ, pdf; a: wo, b: wi
const uint KIND_MICROFACET = 1u; // D(b), visibility(a.z, a.x), pdf, root; the case's roughness is α
const uint KIND_FRESNEL = 2u;    // with a as F0, b as F90 and the case's number as bits of the cosine
const uint KIND_MIS = 3u;        // of (a.x, a.y) and of (a.y, a.x)

struct Query {
    vec3 a;
    uint index; // of the case
    vec3 b;
};

layout(binding = BIND_TEST_INPUT, scalar) readonly buffer QueriesBlock { Query queries[]; };
layout(binding = BIND_TEST_OUTPUT, scalar) writeonly buffer ValuesBlock { vec4 values[]; };
layout(push_constant, scalar) uniform PushBlock { uint kind; uint count; } push;

void main()
{
    uint i = gl_GlobalInvocationID.x;
    if (i >= push.count) {
        return;
    }
    Query q = queries[i];
    if (push.kind == KIND_FRESNEL) {
        values[i] = vec4(fresnel_schlick(q.a, q.b, uintBitsToFloat(q.index)), 0.0);
    } else if (push.kind == KIND_MIS) {
        values[i] = vec4(mis_weight(q.a.x, q.a.y), mis_weight(q.a.y, q.a.x), 0.0, 0.0);
    } else if (push.kind == KIND_MICROFACET) {
        float alpha = cases[q.index].roughness;
        values[i] = vec4(ggx_d(q.b, alpha), ggx_visibility(q.a.z, q.a.x, alpha),
                         ggx_pdf(q.a.z, q.b, alpha), ggx_root(q.a.z, alpha));
    } else {
        BsdfValue v = bsdf_eval(case_bsdf(cases[q.index], q.a.z), q.a, q.b);
        values[i] = vec4(v.f_cos, v.pdf);
    }
}
