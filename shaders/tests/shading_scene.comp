#version 460
// Test kernel: the functions of shading that read the scene's buffers.
#extension GL_GOOGLE_include_directive : require
#include "camera.glsl"
#include "sampling.glsl"
#include "lights.glsl"

layout(local_size_x = 64) in;

const uint KIND_ENVIRONMENT = 0u; // sample u.xyz, u.w; the same direction looked up again
const uint KIND_LIGHT = 1u;       // sample u from the origin
const uint KIND_TEXTURE = 2u;     // use index.x at u.xy
const uint KIND_CAMERA = 3u;      // pixel index, place u.xy
const uint KIND_RADIANCE = 4u;    // environment along u.xyz

struct Query {
    vec4 u;
    uvec2 index;
};

struct Answer {
    vec4 a;
    vec4 b;
    vec4 c;
};

layout(binding = 21, scalar) readonly buffer QueriesBlock { Query queries[]; };
layout(binding = 22, scalar) writeonly buffer AnswersBlock { Answer answers[]; };
layout(push_constant) uniform PushBlock { uint kind; uint count; } push;

Answer environment_answer(vec4 u)
{
    EnvironmentSample s = environment_sample(u.xyz, u.w);
    float pdf;
    vec3 radiance = environment_radiance(s.wi, pdf);
    return Answer(vec4(s.wi, s.pdf), vec4(s.radiance, pdf), vec4(radiance, 0.0));
}

Answer light_answer(vec4 u)
{
    LightSample s = light_sample(vec3(0.0), light_view_surface(vec3(0.0), vec3(0.0)), u);
    if (!(s.pdf > 0.0)) {
        return Answer(vec4(0.0), vec4(0.0), vec4(0.0));
    }
    vec3 target = s.is_infinite ? vec3(0.0) : s.target;
    float kind = (s.is_infinite ? 1.0 : 0.0) + (s.is_delta ? 2.0 : 0.0);
    return Answer(vec4(s.wi, s.pdf), vec4(s.radiance, kind), vec4(target, 0.0));
}

void main()
{
    uint i = gl_GlobalInvocationID.x;
    if (i >= push.count) {
        return;
    }
    Query q = queries[i];
    if (push.kind == KIND_ENVIRONMENT) {
        answers[i] = environment_answer(q.u);
    } else if (push.kind == KIND_LIGHT) {
        answers[i] = light_answer(q.u);
    } else if (push.kind == KIND_TEXTURE) {
        answers[i] = Answer(texture_sample(scene_texture_use(q.index.x), TEXTURE_BASE_COLOR, q.u.xy), vec4(0.0), vec4(0.0));
    } else if (push.kind == KIND_CAMERA) {
        Ray ray = camera_ray(q.index, q.u);
        answers[i] = Answer(vec4(ray.origin, 0.0), vec4(ray.direction, 0.0), vec4(0.0));
    } else {
        float pdf;
        vec3 radiance = environment_radiance(q.u.xyz, pdf);
        answers[i] = Answer(vec4(radiance, pdf), vec4(environment_uv(q.u.xyz), 0.0, 0.0), vec4(0.0));
    }
}
