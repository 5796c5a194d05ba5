// glTF's metallic-roughness surface: a Lambert base under a GGX dielectric coat,
// blended with a GGX metal and, where it transmits, with a dielectric interface.
// Local frame: z is the shading normal.
//
// The specular part is that of the glTF 2.0 specification, appendix B. Its sample
// coupling of base and coat, base · (1 − F(v·h)), gains energy at grazing angles
// (the appendix says so) although it requires conservation of accurate implementations. We use
// base · (1 − F(n·v)) (1 − F(n·l)) / (1 − F0): reciprocal, conserving, equal at
// normal incidence. See docs/decisions.md.

#ifndef BSDF_GLSL
#define BSDF_GLSL

#include "dielectric.glsl"
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
    float glass;     // share of the interface; the rest is as above
    float p_glass;   // probability of sampling the interface
    Dielectric dielectric;
};

struct BsdfSample {
    vec3 wi;
    vec3 weight;     // f cosθ / pdf; of a mirror, its reflectance / probability
    float pdf;       // per steradian; 0: a mirror
    bool is_valid;
    bool is_transmitted;
    bool is_straight; // passed on as if nothing was there but a filter
};

struct BsdfValue {
    vec3 f_cos;      // f · cosθi, 1/sr
    float pdf;       // per steradian, all lobes
};

// Normal about which a smooth interface refracts: the shading normal unless that would
// send the refracted light to the wrong side of the surface.
vec3 bsdf_interface_normal(SurfacePoint s, vec3 wo, float eta)
{
    if (!s.is_solid || square(s.roughness) >= GGX_MIN_ALPHA) {
        return s.ns;
    }
    Fresnel f = fresnel_dielectric(dot(s.ns, wo), eta);
    bool is_wrong = f.t > 0.0 && dot(dielectric_refract(eta, wo, s.ns, f.g), s.ng) >= 0.0;
    return is_wrong ? s.ng : s.ns;
}

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
    float base = larger(1.0 - b.coat_f0, 1.0e-6);
    return b.diffuse * (INV_PI * bsdf_coat_transmission(b, cos_o) * bsdf_coat_transmission(b, cos_i) / base);
}

// The surface for light on the side of wo; eta: index beyond it over index here.
Bsdf bsdf_of(SurfacePoint s, float cos_o, float eta)
{
    Bsdf b;
    b.diffuse = s.base_color;
    b.p_specular = 0.0;
    b.alpha = 1.0;
    b.f0 = b.f90 = vec3(0.0);
    b.coat_f0 = b.coat_f90 = 0.0;
    b.glass = b.p_glass = 0.0;
    if (HAS_SPECULAR) {
        float metallic = s.metallic;
        float alpha = s.roughness * s.roughness;
        b.alpha = alpha < GGX_MIN_ALPHA ? 0.0 : alpha;
        if (HAS_DIELECTRIC) {
            b.glass = s.transmission;
            metallic = b.glass < 1.0 ? smaller(metallic / (1.0 - b.glass), 1.0) : 0.0;
            // A dielectric loses little; what the rest reflects is at most its share.
            b.p_glass = b.glass;
            bool is_bent = !s.is_solid || abs(eta - 1.0) >= ETA_MATCHED || eta == IOR_INFINITE;
            b.dielectric = Dielectric(eta, is_bent ? b.alpha : 0.0, s.base_color, s.strength, !s.is_solid);
        }
        b.diffuse = s.base_color * (1.0 - metallic);
        b.coat_f0 = max_component(s.dielectric_f0);
        b.coat_f90 = s.dielectric_f90;
        b.f0 = mix(s.dielectric_f0, s.base_color, metallic);
        b.f90 = mix(vec3(s.dielectric_f90), vec3(1.0), metallic);
        vec3 specular = fresnel_schlick(b.f0, b.f90, cos_o);
        float w_specular = specular.x + specular.y + specular.z;
        vec3 base = b.diffuse * bsdf_coat_transmission(b, cos_o);
        float w_diffuse = base.x + base.y + base.z;
        float total = w_specular + w_diffuse;
        b.p_specular = total > 0.0 ? w_specular / total : 0.0;
    }
    return b;
}

// Whether light samples can meet the surface: anything but mirrors and smooth interfaces.
bool bsdf_has_density(Bsdf b)
{
    bool is_mirror = HAS_SPECULAR && b.alpha == 0.0 && b.p_specular == 1.0;
    if (!HAS_DIELECTRIC) {
        return !is_mirror;
    }
    return (b.glass < 1.0 && !is_mirror) || (b.glass > 0.0 && b.dielectric.alpha > 0.0);
}

// Whether light can come from the far side other than straight on or refracted by a smooth interface.
bool bsdf_transmits_widely(Bsdf b)
{
    return HAS_DIELECTRIC && b.glass > 0.0 && b.dielectric.alpha > 0.0;
}

// Whether some light passes on without a change of direction.
bool bsdf_is_straight(Bsdf b)
{
    return HAS_DIELECTRIC && b.glass > 0.0 && dielectric_is_straight(b.dielectric);
}

// What passes straight on, for a direction at the cosine cos_o.
vec3 bsdf_straight(Bsdf b, float cos_o)
{
    return bsdf_is_straight(b) ? b.glass * dielectric_straight(b.dielectric, cos_o) : vec3(0.0);
}

// Base, coat and metal without mirrors.
BsdfValue bsdf_eval_opaque(Bsdf b, vec3 wo, vec3 wi)
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

// Value and density of everything but mirrors and smooth interfaces. Transmission conserves power (dielectric.glsl).
BsdfValue bsdf_eval(Bsdf b, vec3 wo, vec3 wi)
{
    BsdfValue v = bsdf_eval_opaque(b, wo, wi);
    if (bsdf_transmits_widely(b)) {
        vec3 f_cos;
        float pdf;
        dielectric_eval(b.dielectric, wo, wi, f_cos, pdf);
        v.f_cos = mix(v.f_cos, f_cos, b.glass);
        v.pdf = mix(v.pdf, pdf, b.p_glass);
    } else if (HAS_DIELECTRIC) {
        v.f_cos *= 1.0 - b.glass;
        v.pdf *= 1.0 - b.p_glass;
    }
    return v;
}

// A direction with its weight. u.x chooses the lobe, u.yz the direction.
BsdfSample bsdf_sample(Bsdf b, vec3 wo, vec3 u)
{
    BsdfSample result;
    result.is_valid = true;
    result.is_transmitted = false;
    result.is_straight = false;
    result.pdf = 0.0;
    float p_opaque = 1.0;
    bool is_glass = HAS_DIELECTRIC && u.x < b.p_glass;
    if (is_glass) {
        DielectricSample s = dielectric_sample(b.dielectric, wo, vec3(u.x / b.p_glass, u.yz));
        result.wi = s.wi;
        result.is_transmitted = s.is_transmitted;
        if (b.dielectric.alpha == 0.0) {
            result.weight = s.weight * (b.glass / b.p_glass);
            result.is_straight = s.is_transmitted && dielectric_is_straight(b.dielectric);
            return result;
        }
    } else if (HAS_DIELECTRIC) {
        p_opaque = 1.0 - b.p_glass;
        u.x = (u.x - b.p_glass) / p_opaque;
    }
    if (!is_glass && HAS_SPECULAR && u.x < b.p_specular) {
        if (b.alpha == 0.0) {
            result.wi = vec3(-wo.xy, wo.z);
            result.weight = fresnel_schlick(b.f0, b.f90, wo.z) * ((1.0 - b.glass) / (p_opaque * b.p_specular));
            return result;
        }
        vec3 m = ggx_sample_normal(wo, b.alpha, u.yz);
        result.wi = 2.0 * dot(wo, m) * m - wo;
    } else if (!is_glass) {
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
    result.is_valid = v.pdf > 0.0 && (result.wi.z < 0.0) == result.is_transmitted;
    result.weight = result.is_valid ? v.f_cos / v.pdf : vec3(0.0);
    return result;
}

#endif
