// Radiance from infinity: a constant, or a latitude–longitude map that is
// reconstructed bilinearly. Directions are sampled in proportion to a bilinear function too, whose values at
// the centres of texels stand beside the radiance: a table chooses the cell between
// four centres, and within it the warp is exact. So a sun of few texels has no noise of its own, and since neighbours on
// the map are neighbours in the table, numbers that are spread evenly are directions that are.
//
// [PBRT4] Pharr, Jakob, Humphreys, Physically Based Rendering, 4th edition, §A.5.2 (bilinear functions).

#ifndef ENVIRONMENT_GLSL
#define ENVIRONMENT_GLSL

#include "math.glsl"
#include "sampling.glsl"
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

// Radiance without its factor, and the density in (u, v) over 2π².
vec4 environment_texel(int x, int y)
{
    int width = int(params.env_width);
    // bounds also for what became of a NaN
    x = clamp(x < 0 ? x + width : (x >= width ? x - width : x), 0, width - 1);
    y = clamp(y, 0, int(params.env_height) - 1);
    return texelFetch(env_map, y * width + x);
}

vec4 environment_lookup(vec2 uv)
{
    vec2 at = uv * vec2(params.env_width, params.env_height) - 0.5;
    vec2 base = floor(at);
    vec2 f = at - base;
    // -1 at least
    int x = whole(base.x + 1.0) - 1;
    int y = whole(base.y + 1.0) - 1;
    vec4 top = mix(environment_texel(x, y), environment_texel(x + 1, y), f.x);
    vec4 bottom = mix(environment_texel(x, y + 1), environment_texel(x + 1, y + 1), f.x);
    return mix(top, bottom, f.y);
}

// Density per steradian, without the choice of the map, where (u, v) is sampled with `density` · 2π².
float environment_pdf(float density, float sine)
{
    return density > 0.0 ? density / sine : 0.0;
}

// Radiance that arrives along −d, and the density with which direct light would have sampled d.
vec3 environment_radiance(vec3 d, out float pdf)
{
    pdf = 0.0;
    if (!HAS_ENVIRONMENT) {
        return params.env_radiance;
    }
    vec4 value = environment_lookup(environment_uv(d));
    pdf = params.env_choice * environment_pdf(value.w, length(d.xz));
    return params.env_radiance * value.rgb;
}

// The cell that holds a place: u chooses one of 2²³ parts of all places, and `fine` the place in it.
uint environment_cell(float u, float fine)
{
    // Where the map is chosen among others, u takes larger steps, and `fine` fills them.
    float part = u * 8388608.0;
    float whole_part = floor(part);
    part = part - whole_part + (fine - 0.5) / params.env_choice;
    float carry = floor(part);
    uint place = uint(whole(whole_part) + int(carry)) * 512u + uint(whole(floor((part - carry) * 512.0)));
    uvec2 run = texelFetch(env_table, int(place >> params.env_shift)).xy;
    if (run.y == NONE) {
        return run.x;
    }
    while (run.x < run.y) {
        uint middle = (run.x + run.y) >> 1u;
        run = place > texelFetch(env_table, int(middle)).x ? uvec2(middle + 1u, run.y) : uvec2(run.x, middle);
    }
    return texelFetch(env_table, int(run.x)).y;
}

// A direction by the map's density. The pdf includes the choice of the map.
EnvironmentSample environment_sample(vec3 u, float fine)
{
    uint cell = environment_cell(u.x, fine);
    // A row of cells between two rows of texels, and half a row at each pole.
    int height = int(params.env_height);
    // Integers are divided lane by lane on CPUs. The quotient of floats is off by one at most.
    int width = int(params.env_width);
    int row = whole(floor(float(cell) / float(width)));
    int column = int(cell) - row * width;
    row += column < 0 ? -1 : (column >= width ? 1 : 0);
    column += column < 0 ? width : (column >= width ? -width : 0);
    vec4 a = environment_texel(column, row - 1);
    vec4 b = environment_texel(column + 1, row - 1);
    vec4 c = environment_texel(column, row);
    vec4 d = environment_texel(column + 1, row);
    float y = sample_linear(u.z, a.w + b.w, c.w + d.w);
    float x = sample_linear(u.y, mix(a.w, c.w, y), mix(b.w, d.w, y));
    vec4 value = mix(mix(a, b, x), mix(c, d, x), y);

    // In rows from the nearer pole, where angles are small and exact.
    bool is_south = 2 * row > height;
    float north = row == 0 ? 0.5 * y : float(row) - 0.5 + y;
    float south = row == height ? 0.5 - 0.5 * y : float(height - row) + 0.5 - y;
    float theta = PI * (is_south ? south : north) / float(height);
    float sine = sin(theta);
    float phi = TWO_PI * ((float(column) + 0.5 + x) / float(params.env_width) - 0.5);
    float east = sine * sin(phi);
    float back = -sine * cos(phi);
    EnvironmentSample s;
    s.wi = normalize(vec3(params.env_cos_rotation * east + params.env_sin_rotation * back, is_south ? -cos(theta) : cos(theta),
                          params.env_cos_rotation * back - params.env_sin_rotation * east));
    s.radiance = params.env_radiance * value.rgb;
    s.pdf = params.env_choice * environment_pdf(value.w, sine);
    return s;
}

#endif
