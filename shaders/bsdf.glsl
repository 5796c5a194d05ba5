// glTF's metallic-roughness surface: a Lambert base under a GGX dielectric coat,
// blended with a GGX metal. Local frame: z is the shading normal.
//
// The specular part is that of the glTF 2.0 specification, appendix B. Its sample
// coupling of base and coat, base · (1 − F(v·h)), gains energy at grazing angles
// (the appendix says so) although it requires conservation of accurate implementations. We use
// base · (1 − F(n·v)) (1 − F(n·l)) / (1 − F0): reciprocal, conserving, equal at
// normal incidence. See docs/decisions.md.

#ifndef BSDF_GLSL
#define BSDF_GLSL

#include "microfacet.glsl"
#include "sampling.glsl"
#include "surface.glsl"

struct Bsdf {
    vec3 diffuse;    // albedo of the base, not yet coupled
    float coat_f0;   // the coat's largest channel, for the coupling
    float coat_f90;
    vec3 f0;         // of coat and metal together
    vec3 f90;
    float alpha;     // 0: mirror
    float p_specular; // probability of sampling the specular lobe
};

struct BsdfSample {
    vec3 wi;
    vec3 weight;     // f cosθ / pdf; of a mirror, its reflectance / probability
    float pdf;       // per steradian; 0: a mirror
    bool is_valid;
};

struct BsdfValue {
    vec3 f_cos;      // f · cosθi, 1/sr
    float pdf;       // per steradian, all lobes
};

// What the coat lets through to the base and back, one direction.
float bsdf_coat_transmission(Bsdf b, float cosine)
{
    return 1.0 - fresnel_schlick(vec3(b.coat_f0), vec3(b.coat_f90), cosine).x;
}

vec3 bsdf_diffuse(Bsdf b, float cos_o, float cos_i)
{
    if (!HAS_SPECULAR) {
        return b.diffuse * INV_PI;
    }
    float base = max(1.0 - b.coat_f0, 1.0e-6);
    return b.diffuse * (INV_PI * bsdf_coat_transmission(b, cos_o) * bsdf_coat_transmission(b, cos_i) / base);
}

Bsdf bsdf_of(SurfacePoint s, float cos_o)
{
    Bsdf b;
    b.diffuse = s.base_color;
    b.p_specular = 0.0;
    b.alpha = 1.0;
    b.f0 = b.f90 = vec3(0.0);
    b.coat_f0 = b.coat_f90 = 0.0;
    if (HAS_SPECULAR) {
        b.diffuse = s.base_color * (1.0 - s.metallic);
        b.coat_f0 = max_component(s.dielectric_f0);
        b.coat_f90 = s.dielectric_f90;
        b.f0 = mix(s.dielectric_f0, s.base_color, s.metallic);
        b.f90 = mix(vec3(s.dielectric_f90), vec3(1.0), s.metallic);
        float alpha = s.roughness * s.roughness;
        b.alpha = alpha < GGX_MIN_ALPHA ? 0.0 : alpha;
        vec3 specular = fresnel_schlick(b.f0, b.f90, cos_o);
        float w_specular = specular.x + specular.y + specular.z;
        vec3 base = b.diffuse * bsdf_coat_transmission(b, cos_o);
        float w_diffuse = base.x + base.y + base.z;
        float total = w_specular + w_diffuse;
        b.p_specular = total > 0.0 ? w_specular / total : 0.0;
    }
    return b;
}

// Value and density of everything but mirrors.
BsdfValue bsdf_eval(Bsdf b, vec3 wo, vec3 wi)
{
    if (wi.z <= 0.0 || wo.z <= 0.0) {
        return BsdfValue(vec3(0.0), 0.0);
    }
    BsdfValue v;
    v.f_cos = bsdf_diffuse(b, wo.z, wi.z) * wi.z;
    v.pdf = (1.0 - b.p_specular) * wi.z * INV_PI;
    if (HAS_SPECULAR && b.alpha > 0.0 && b.p_specular > 0.0) {
        vec3 m = normalize(wo + wi);
        vec3 f = fresnel_schlick(b.f0, b.f90, dot(wo, m));
        v.f_cos += f * (ggx_d(m, b.alpha) * ggx_visibility(wo.z, wi.z, b.alpha) * wi.z);
        v.pdf += b.p_specular * ggx_pdf(wo.z, m, b.alpha);
    }
    return v;
}

// A direction with its weight. u.x chooses the lobe, u.yz the direction.
BsdfSample bsdf_sample(Bsdf b, vec3 wo, vec3 u)
{
    BsdfSample result;
    result.is_valid = false;
    if (HAS_SPECULAR && u.x < b.p_specular) {
        if (b.alpha == 0.0) {
            result.wi = vec3(-wo.xy, wo.z);
            result.weight = fresnel_schlick(b.f0, b.f90, wo.z) / b.p_specular;
            result.pdf = 0.0;
            result.is_valid = true;
            return result;
        }
        vec3 m = ggx_sample_normal(wo, b.alpha, u.yz);
        result.wi = 2.0 * dot(wo, m) * m - wo;
    } else {
        result.wi = sample_cosine_hemisphere(u.yz);
        if (!HAS_SPECULAR) {
            result.weight = b.diffuse;
            result.pdf = result.wi.z * INV_PI;
            result.is_valid = result.wi.z > 0.0;
            return result;
        }
    }
    BsdfValue v = bsdf_eval(b, wo, result.wi);
    result.pdf = v.pdf;
    result.is_valid = v.pdf > 0.0;
    result.weight = result.is_valid ? v.f_cos / v.pdf : vec3(0.0);
    return result;
}

#endif
