// What fills space: absorption, scattering, phase functions. Homogeneous, with a
// coefficient for each channel; distances in metres.
//
// [Wilkie14] Wilkie et al., Hero Wavelength Spectral Sampling, on one sample for all channels.
// [Kulla12] Kulla, Fajardo, Importance Sampling Techniques for Path Tracing in Participating Media.
// [Henyey41] Henyey, Greenstein, Diffuse Radiation in the Galaxy.
// [Chandrasekhar60] Chandrasekhar, Radiative Transfer, §3 (Rayleigh's phase function).

#ifndef MEDIUM_GLSL
#define MEDIUM_GLSL

#include "math.glsl"
#include "scene.glsl"

bool medium_scatters(Medium m)
{
    return max_component(m.sigma_s) > 0.0;
}

// Fraction of light left after `distance`. [Beer's law]
vec3 medium_transmittance(Medium m, float distance)
{
    // Else a driver may scale the coefficient for exp2 first, which overflows: the largest one over no distance is then NaN.
    precise vec3 depth = m.sigma_t * distance;
    return exp(-depth);
}

// Transmittance of each channel relative to that of the clearest: no channel underflows with the others.
vec3 medium_relative(Medium m, float distance)
{
    float least = smaller(m.sigma_t.x, smaller(m.sigma_t.y, m.sigma_t.z));
    precise vec3 depth = (m.sigma_t - least) * distance;
    return exp(-depth);
}

// Probability of drawing a distance by each channel: its share of the throughput.
vec3 medium_channels(vec3 beta)
{
    return beta / (beta.x + beta.y + beta.z);
}

// Density of medium_sample at `distance`, 1/m.
float medium_pdf(Medium m, vec3 channels, float distance)
{
    return dot(channels, m.sigma_t * medium_transmittance(m, distance));
}

struct MediumSample {
    float distance;
    bool is_scattered; // else the end was reached
    vec3 weight;       // of either; at most the number of channels
};

// How far light of throughput beta goes before it scatters, `end` at most. One channel draws
// the distance and all share it by the balance heuristic. [Wilkie14]
MediumSample medium_sample(Medium m, vec3 beta, float end, vec2 u)
{
    vec3 channels = medium_channels(beta);
    float sigma = u.x < channels.x ? m.sigma_t.x : (u.x < channels.x + channels.y ? m.sigma_t.y : m.sigma_t.z);
    MediumSample s;
    // u.y is in (0, 1): the distance is positive, and at most 16.6 mean free paths.
    s.distance = sigma > 0.0 ? -log(u.y) / sigma : T_FAR;
    s.is_scattered = s.distance < end;
    s.distance = smaller(s.distance, end);
    vec3 relative = medium_relative(m, s.distance);
    s.weight = s.is_scattered ? m.sigma_s * relative / dot(channels, m.sigma_t * relative)
                              : relative / dot(channels, relative);
    return s;
}

// Density, 1/sr, of going on in direction wi for light that travelled along d (both unit).
// The phase function is normalised, so that it is its own density.
float phase_value(Medium m, vec3 d, vec3 wi)
{
    if (m.phase == PHASE_RAYLEIGH) {
        float cosine = dot(d, wi);
        return 3.0 / (16.0 * PI) * (1.0 + cosine * cosine);
    }
    // Henyey–Greenstein in 1 − cosθ, which keeps its precision where the lobe is narrow; g = 0 is isotropic.
    float g = abs(m.g);
    vec3 between = m.g < 0.0 ? d + wi : d - wi;
    float root = (1.0 - g) * (1.0 - g) + g * dot(between, between);
    return (1.0 - g) * (1.0 + g) / (2.0 * TWO_PI * root * sqrt(root));
}

// A direction after scattering of light that travelled along d.
vec3 phase_sample(Medium m, vec3 d, vec2 u)
{
    float away; // 1 − cosθ
    if (m.phase == PHASE_RAYLEIGH) {
        // ¾ isotropic + ¼ with density ∝ cos²θ, whose inverse is a cube root: nothing cancels.
        float cosine;
        if (u.x < 0.75) {
            cosine = 2.0 * (u.x / 0.75) - 1.0;
        } else {
            float v = 8.0 * (u.x - 0.75) - 1.0;
            cosine = sign(v) * pow(abs(v), 1.0 / 3.0);
        }
        away = 1.0 - limited(cosine, -1.0, 1.0);
    } else {
        // Inverse of Henyey–Greenstein's distribution, solved for 1 − cosθ.
        float g = abs(m.g);
        float root = 1.0 - g + 2.0 * g * u.x;
        float k = (1.0 - g) / root;
        away = smaller(k * (1.0 - u.x) * (k * (1.0 + g) + (1.0 - g)), 2.0);
        away = m.g < 0.0 ? 2.0 - away : away;
    }
    float sine = sqrt(larger(away * (2.0 - away), 0.0));
    float phi = TWO_PI * u.y;
    return normalize(frame_from_z(d) * vec3(sine * cos(phi), sine * sin(phi), 1.0 - away));
}

// Distances along a ray by the angle at which a point sees them. [Kulla12]
struct Equiangular {
    float closest;     // along the ray, where it passes the point
    float apart;       // how far from it; 0: the density is singular and not used
    float angle_start; // of the segment's ends, seen from the point
    float angle_end;
};

Equiangular equiangular_of(vec3 origin, vec3 d, float end, vec3 point)
{
    Equiangular e;
    vec3 to = point - origin;
    e.closest = dot(to, d);
    e.apart = length(to - e.closest * d);
    e.angle_start = atan(-e.closest, e.apart);
    e.angle_end = atan(end - e.closest, e.apart);
    return e;
}

// Radians that arc tangent and arc cosine may be off together: 4096 ulp each, by Vulkan's bounds.
const float EQUIANGULAR_MARGIN = 2.0e-3;

// The same for a point that shines into a cone about `axis`, of at most 90°: drawn is where the segment is in it, or a
// little more. In the plane of both the cosine to the axis is reach · cos(angle − peak).
void equiangular_within(inout Equiangular e, vec3 origin, vec3 d, vec3 point, vec3 axis, float cos_cone)
{
    float x = dot(axis, e.closest * d - (point - origin)) / e.apart;
    float y = dot(axis, d);
    float reach = sqrt(x * x + y * y);
    float peak = atan(y, x);
    float half_width = acos(smaller(cos_cone / reach, 1.0)) + EQUIANGULAR_MARGIN;
    // An interval that ends before it starts is empty.
    half_width = reach > cos_cone - 1.0e-6 ? half_width : -PI;
    e.angle_start = larger(e.angle_start, peak - half_width);
    e.angle_end = smaller(e.angle_end, peak + half_width);
}

// Density, 1/m, of equiangular_sample at `distance`, which is where the point shines; 0 where it is not used.
float equiangular_pdf(Equiangular e, float distance)
{
    float angle = e.angle_end - e.angle_start;
    float from = distance - e.closest;
    return angle > 0.0 && e.apart > 0.0 ? e.apart / (angle * (e.apart * e.apart + from * from)) : 0.0;
}

float equiangular_sample(Equiangular e, float end, float u)
{
    return limited(e.closest + e.apart * tan(mix(e.angle_start, e.angle_end, u)), 0.0, end);
}

#endif
