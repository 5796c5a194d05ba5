// Radiance from infinity: a constant, or a latitude–longitude map that is
// reconstructed bilinearly and sampled by an alias table over its texels. The
// table's weights are the means of the reconstruction over each texel, so that
// no direction with light has density zero.
//
// [Vose91] Vose, A Linear Algorithm for Generating Random Numbers.

#ifndef ENVIRONMENT_GLSL
#define ENVIRONMENT_GLSL

#include "math.glsl"
#include "scene.glsl"

struct EnvironmentSample {
    vec3 wi;
    vec3 radiance;
    float pdf;     // per steradian
};

// World direction → (u, v) in the map. The centre looks along −Z, u grows towards +X.
vec2 environment_uv(vec3 d)
{
    float x = params.env_cos_rotation * d.x - params.env_sin_rotation * d.z;
    float z = params.env_sin_rotation * d.x + params.env_cos_rotation * d.z;
    // The arc tangent keeps its precision at the poles, unlike acos.
    return vec2(0.5 + atan(x, -z) / TWO_PI, atan(sqrt(x * x + z * z), d.y) * INV_PI);
}

vec3 environment_texel(int x, int y)
{
    int width = int(params.env_width);
    x = x < 0 ? x + width : (x >= width ? x - width : x);
    y = clamp(y, 0, int(params.env_height) - 1);
    return texelFetch(env_map, y * width + x).rgb;
}

// Texel that holds (u, v).
uint environment_cell(vec2 uv)
{
    uint x = min(uint(uv.x * float(params.env_width)), params.env_width - 1u);
    uint y = min(uint(uv.y * float(params.env_height)), params.env_height - 1u);
    return y * params.env_width + x;
}

vec3 environment_lookup(vec2 uv)
{
    vec2 at = uv * vec2(params.env_width, params.env_height) - 0.5;
    vec2 base = floor(at);
    vec2 f = at - base;
    int x = int(base.x);
    int y = int(base.y);
    vec3 top = mix(environment_texel(x, y), environment_texel(x + 1, y), f.x);
    vec3 bottom = mix(environment_texel(x, y + 1), environment_texel(x + 1, y + 1), f.x);
    return params.env_radiance * mix(top, bottom, f.y);
}

// Radiance that arrives along −d, and the density with which direct light would have sampled d.
vec3 environment_radiance(vec3 d, out float pdf)
{
    pdf = 0.0;
    if (!HAS_ENVIRONMENT) {
        return params.env_radiance;
    }
    vec2 uv = environment_uv(d);
    pdf = params.env_choice * env_table[environment_cell(uv)].pdf;
    return environment_lookup(uv);
}

// A direction by the map's radiance. The pdf includes the choice of the map.
EnvironmentSample environment_sample(vec3 u, float coin)
{
    uint count = params.env_width * params.env_height;
    uint cell = min(uint(u.x * float(count)), count - 1u);
    EnvTexel entry = env_table[cell];
    if (coin >= entry.keep) {
        cell = entry.alias;
        entry = env_table[cell];
    }
    uint row = cell / params.env_width;
    uint column = cell - row * params.env_width;
    // Uniform in solid angle within the texel: uniform in φ and in cosθ.
    float theta0 = PI * float(row) / float(params.env_height);
    float theta1 = PI * float(row + 1u) / float(params.env_height);
    float y = mix(cos(theta0), cos(theta1), u.z);
    float sine = sqrt(max(1.0 - y * y, 0.0));
    vec2 uv = vec2((float(column) + u.y) / float(params.env_width), atan(sine, y) * INV_PI);
    float phi = TWO_PI * (uv.x - 0.5);
    float x = sine * sin(phi);
    float z = -sine * cos(phi);
    EnvironmentSample s;
    s.wi = normalize(vec3(params.env_cos_rotation * x + params.env_sin_rotation * z, y,
                          params.env_cos_rotation * z - params.env_sin_rotation * x));
    s.radiance = environment_lookup(uv);
    s.pdf = params.env_choice * entry.pdf;
    return s;
}

#endif
