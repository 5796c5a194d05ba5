#version 460
// Test kernel: the functions of media for given cases, and many draws from each case.
#extension GL_GOOGLE_include_directive : require
#include "medium.glsl"
#include "rng.glsl"

layout(local_size_x = 64) in;

const uint KIND_TRANSMITTANCE = 0u; // over the distance end
const uint KIND_PHASE = 1u;         // value for d and wi = beta
const uint KIND_EQUIANGULAR = 2u;   // density at the distance sigma_t.x; the point is at beta, and
                                    // shines into the cone about sigma_s, of cosine g, where that is not 0
const uint KIND_FLIGHT = 3u;        // draws: distance and weight
const uint KIND_SCATTER = 4u;       // draws: direction and value
const uint KIND_APPROACH = 5u;      // draws: distance and density, equiangular

struct Case {
    vec3 sigma_t;
    uint phase;
    vec3 sigma_s;
    float g;
    vec3 beta;
    float end;
    vec3 d;
    uint reserved;
};

layout(binding = 21, scalar) readonly buffer CasesBlock { Case cases[]; };
layout(binding = 22, scalar) writeonly buffer AnswersBlock { vec4 answers[]; };
layout(push_constant) uniform PushBlock {
    uint kind;
    uint cases;
    uint draws; // of each case; 1 for values
    uint each;  // of one invocation
    uint seed;
} push;

vec4 answer(Case c, vec4 u)
{
    Medium m = Medium(c.sigma_t, c.phase, c.sigma_s, c.g, 1.0, 1u, 0u, 0u);
    if (push.kind == KIND_TRANSMITTANCE) {
        return vec4(medium_transmittance(m, c.end), 0.0);
    }
    if (push.kind == KIND_PHASE) {
        return vec4(phase_value(m, c.d, c.beta), 0.0, 0.0, 0.0);
    }
    if (push.kind == KIND_FLIGHT) {
        MediumSample s = medium_sample(m, c.beta, c.end, u.xy);
        return vec4(s.is_scattered ? s.distance : -1.0, s.weight);
    }
    if (push.kind == KIND_SCATTER) {
        vec3 wi = phase_sample(m, c.d, u.xy);
        return vec4(wi, phase_value(m, c.d, wi));
    }
    Equiangular e = equiangular_of(vec3(0.0), c.d, c.end, c.beta);
    if (c.sigma_s != vec3(0.0)) {
        equiangular_within(e, vec3(0.0), c.d, c.beta, c.sigma_s, c.g);
    }
    float distance = push.kind == KIND_EQUIANGULAR ? c.sigma_t.x : equiangular_sample(e, c.end, u.x);
    return vec4(distance, equiangular_pdf(e, distance), 0.0, 0.0);
}

void main()
{
    for (uint k = 0u; k < push.each; k++) {
        uint i = gl_GlobalInvocationID.x * push.each + k;
        if (i >= push.cases * push.draws) {
            return;
        }
        uvec4 key = rng_key(rng_base(uvec2(push.seed, push.kind), 0u), i, 0u);
        answers[i] = answer(cases[i / push.draws], rng_uniform(key, 1u, SLOT_MEDIUM));
    }
}
