// GGX microfacets: distribution, masking, visible-normal sampling. Local frame:
// z is the shading normal; wo, wi, m point away from the surface; α is the square
// of glTF's roughness.
//
// [Walter07] Walter et al., Microfacet Models for Refraction, EGSR 2007.
// [Heitz14] Heitz, Understanding the Masking-Shadowing Function, JCGT 3(2).
// [Dupuy23] Dupuy, Benyoub, Sampling Visible GGX Normals with Spherical Caps, HPG 2023.

#ifndef MICROFACET_GLSL
#define MICROFACET_GLSL

#include "math.glsl"

// Below this α the lobe is narrower than fp32 directions can carry, and the
// surface is treated as a perfect mirror.
const float GGX_MIN_ALPHA = 1.0e-3;

// Density of microfacet normals, 1/sr. In this form nothing cancels for small α. [Walter07] Eq. 33
float ggx_d(vec3 m, float alpha)
{
    float stretched = (m.x * m.x + m.y * m.y) / (alpha * alpha) + m.z * m.z;
    return 1.0 / (PI * alpha * alpha * stretched * stretched);
}

// sqrt(α² + (1 − α²) cos²): the common root of Smith's functions.
float ggx_root(float cosine, float alpha)
{
    return sqrt(alpha * alpha + (1.0 - alpha * alpha) * cosine * cosine);
}

// G₂ / (4 cosθo cosθi) with height-correlated masking and shadowing. [Heitz14] Eq. 99
float ggx_visibility(float cos_o, float cos_i, float alpha)
{
    return 0.5 / (cos_i * ggx_root(cos_o, alpha) + cos_o * ggx_root(cos_i, alpha));
}

// Density per solid angle of the direction reflected about a visible normal m:
// G₁(wo) D(m) / (4 cosθo).
float ggx_pdf(float cos_o, vec3 m, float alpha)
{
    return ggx_d(m, alpha) * 0.5 / (cos_o + ggx_root(cos_o, alpha));
}

// A microfacet normal seen from wo. [Dupuy23]
vec3 ggx_sample_normal(vec3 wo, float alpha, vec2 u)
{
    vec3 stretched = normalize(vec3(alpha * wo.xy, wo.z));
    float phi = TWO_PI * u.x;
    float z = (1.0 - u.y) * (1.0 + stretched.z) - stretched.z;
    float sine = sqrt(limited(1.0 - z * z, 0.0, 1.0));
    vec3 cap = vec3(sine * cos(phi), sine * sin(phi), z) + stretched;
    return normalize(vec3(alpha * cap.xy, cap.z));
}

// Schlick's Fresnel factor with the cosine between direction and microfacet.
vec3 fresnel_schlick(vec3 f0, vec3 f90, float cosine)
{
    float m = limited(1.0 - cosine, 0.0, 1.0);
    float m2 = m * m;
    return f0 + (f90 - f0) * (m2 * m2 * m);
}

#endif
