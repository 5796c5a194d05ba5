#version 460
// Test kernel: the functions of interfaces between dielectrics for given directions.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "dielectric.glsl"

layout(local_size_x = 64) in;

const uint KIND_FRESNEL = 0u; // for the cosine a.x
const uint KIND_SPLIT = 1u;   // for the cosine a.x
const uint KIND_EVAL = 2u;    // a: wo, b: wi
const uint KIND_SAMPLE = 3u;  // a: wo, b: random numbers

struct Query {
    vec3 a;
    float eta;
    vec3 b;
    float alpha;
    vec3 tint;
    uint is_thin;
    vec3 strength;
    uint reserved;
};

struct Answer {
    vec4 a;
    vec4 b;
};

layout(binding = 21, scalar) readonly buffer QueriesBlock { Query queries[]; };
layout(binding = 22, scalar) writeonly buffer AnswersBlock { Answer answers[]; };
layout(push_constant) uniform PushBlock { uint kind; uint count; } push;

void main()
{
    uint i = gl_GlobalInvocationID.x;
    if (i >= push.count) {
        return;
    }
    Query q = queries[i];
    Dielectric d = Dielectric(q.eta, q.alpha, q.tint, q.strength, q.is_thin != 0u);
    if (push.kind == KIND_FRESNEL) {
        Fresnel f = fresnel_dielectric(q.a.x, q.eta);
        answers[i] = Answer(vec4(f.r, f.t, f.g, 0.0), vec4(0.0));
    } else if (push.kind == KIND_SPLIT) {
        DielectricSplit s = dielectric_split(d, q.a.x);
        answers[i] = Answer(vec4(s.r, s.p_reflect), vec4(s.t, s.g));
    } else if (push.kind == KIND_EVAL) {
        vec3 f_cos;
        float pdf;
        dielectric_eval(d, q.a, q.b, f_cos, pdf);
        answers[i] = Answer(vec4(f_cos, pdf), vec4(0.0));
    } else {
        DielectricSample s = dielectric_sample(d, q.a, q.b);
        answers[i] = Answer(vec4(s.wi, s.is_transmitted ? 1.0 : 0.0), vec4(s.weight, 0.0));
    }
}
