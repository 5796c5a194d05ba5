// Interfaces between dielectrics: exact unpolarised Fresnel equations, smooth and
// rough refraction, and sheets without thickness. Local frame: z is the normal on
// the side of wo; eta is the index on the far side over that on the side of wo.
//
// Transmission here conserves power: the factor n² by which radiance changes
// from medium to medium is kept apart (path.glsl), since roulette must not see it.
//
// [Walter07] Walter et al., Microfacet Models for Refraction, EGSR 2007.
// [Born99] Born, Wolf, Principles of Optics, §1.5 (Fresnel's equations) and §7.6 (plates).

#ifndef DIELECTRIC_GLSL
#define DIELECTRIC_GLSL

#include "microfacet.glsl"

// Index that stands for an infinite one: everything is reflected (KHR_materials_ior).
const float IOR_INFINITE = 0.0;
// Rough interfaces this close to index-matched deflect by less than fp32 resolves in
// the half vector, and are treated as smooth.
const float ETA_MATCHED = 1.0e-4;

struct Fresnel {
    float r;      // fraction of power that is reflected
    float t;      // fraction that is transmitted; r + t = 1, each without cancellation
    float g;      // eta times the cosine of refraction; 0 at total reflection
};

// Fresnel's equations for a cosine c > 0. Squares of sines never appear as
// 1 − x: r loses nothing near eta = 1, t nothing at grazing incidence.
Fresnel fresnel_dielectric(float c, float eta)
{
    float m = (eta - 1.0) * (eta + 1.0);
    float g2 = m + c * c;
    if (eta == IOR_INFINITE || g2 <= 0.0) {
        return Fresnel(1.0, 0.0, 0.0);
    }
    float g = sqrt(g2);
    float n2 = eta * eta;
    float s = 1.0 / (c + g);
    float p = 1.0 / (n2 * c + g);
    float r_s = m * s * s;
    float r_p = (m * p) * ((c * c * (n2 + 1.0) - 1.0) * p);
    float r = 0.5 * (r_s * r_s + r_p * r_p);
    // The larger is what the smaller leaves: each formula may be a rounding above 1,
    // and just above the critical angle both follow the rounding of g² differently.
    if (r < 0.5) {
        return Fresnel(r, 1.0 - r, g);
    }
    float t = 2.0 * c * g * (s * s + p * (n2 * p));
    return Fresnel(1.0 - t, t, g);
}

struct Dielectric {
    float eta;
    float alpha;    // 0: smooth
    vec3 tint;      // of what is transmitted
    vec3 strength;  // scales reflection (KHR_materials_specular); 1 is physical
    bool is_thin;   // a sheet without thickness, of index eta
};

// What is reflected and what transmitted, each with its tint.
struct DielectricSplit {
    vec3 r;
    vec3 t;
    float p_reflect; // probability of sampling reflection
    float g;
};

DielectricSplit dielectric_split(Dielectric d, float c)
{
    Fresnel f = fresnel_dielectric(c, d.eta);
    DielectricSplit split;
    split.g = f.g;
    if (d.is_thin) {
        // All reflections between the two faces: R = 2r/(1 + r), T = (1 − r)/(1 + r). [Born99] §7.6, incoherent
        float sum = 1.0 / (1.0 + f.r);
        f.r = 2.0 * f.r * sum;
        f.t *= sum;
    }
    // What a strength below 1 does not reflect is transmitted; nothing weakens total reflection.
    split.r = f.t > 0.0 ? smaller(f.r * d.strength, vec3(1.0)) : vec3(1.0);
    split.t = f.t > 0.0 ? d.tint * larger(f.t + f.r * (1.0 - d.strength), vec3(0.0)) : vec3(0.0);
    float sum_r = split.r.x + split.r.y + split.r.z;
    split.p_reflect = sum_r / (sum_r + split.t.x + split.t.y + split.t.z);
    return split;
}

// Light that goes on without a change of direction: through smooth sheets and index-matched boundaries.
bool dielectric_is_straight(Dielectric d)
{
    return d.alpha == 0.0 && (d.is_thin || d.eta == 1.0);
}

// Direction of refraction of wo about the unit normal m, with g of the split.
vec3 dielectric_refract(float eta, vec3 wo, vec3 m, float g)
{
    return ((dot(wo, m) - g) * m - wo) / eta;
}

// G₁ of Smith. [Heitz14]
float dielectric_masking(float cosine, float alpha)
{
    return 2.0 * cosine / (cosine + ggx_root(cosine, alpha));
}

// f · |cosθi| of a rough interface, with the density of dielectric_sample; smooth ones have none.
void dielectric_eval(Dielectric d, vec3 wo, vec3 wi, out vec3 f_cos, out float pdf)
{
    f_cos = vec3(0.0);
    pdf = 0.0;
    if (d.alpha == 0.0 || wo.z <= 0.0 || wi.z == 0.0) {
        return;
    }
    bool is_reflected = wi.z > 0.0;
    // What passes a rough sheet leaves like the mirror image of what it reflects.
    bool is_refracted = !is_reflected && !d.is_thin;
    // [Walter07] Eq. 13 and 16
    vec3 m = is_refracted ? wo + d.eta * wi : wo + vec3(wi.xy, abs(wi.z));
    m = normalize(m.z < 0.0 ? -m : m);
    float cos_o = dot(wo, m);
    DielectricSplit split = dielectric_split(d, cos_o);
    vec3 share = is_reflected ? split.r : split.t;
    float p = is_reflected ? split.p_reflect : 1.0 - split.p_reflect;
    float distribution = ggx_d(m, d.alpha);
    if (!is_refracted) {
        f_cos = share * (distribution * ggx_visibility(wo.z, abs(wi.z), d.alpha) * abs(wi.z));
        pdf = p * ggx_pdf(wo.z, m, d.alpha);
        return;
    }
    float cos_i = dot(wi, m);
    if (cos_o <= 0.0 || cos_i >= 0.0) {
        return;
    }
    // [Walter07] Eq. 17 and 21; radiance's n² left out.
    float root = cos_o + d.eta * cos_i;
    float jacobian = d.eta * d.eta * -cos_i / (root * root);
    float visible = distribution * dielectric_masking(wo.z, d.alpha) * cos_o / wo.z;
    f_cos = share * (visible * dielectric_masking(-wi.z, d.alpha) * jacobian);
    pdf = p * visible * jacobian;
}

struct DielectricSample {
    vec3 wi;
    vec3 weight;   // smooth only: f cosθ / pdf
    bool is_transmitted;
};

// A direction; u.x chooses reflection, u.yz the microfacet. Rough weights come from dielectric_eval.
DielectricSample dielectric_sample(Dielectric d, vec3 wo, vec3 u)
{
    vec3 m = d.alpha == 0.0 ? vec3(0.0, 0.0, 1.0) : ggx_sample_normal(wo, d.alpha, u.yz);
    DielectricSplit split = dielectric_split(d, dot(wo, m));
    DielectricSample result;
    result.is_transmitted = u.x >= split.p_reflect;
    if (!result.is_transmitted) {
        result.wi = 2.0 * dot(wo, m) * m - wo;
        result.weight = split.r / split.p_reflect;
        return result;
    }
    result.weight = split.t / (1.0 - split.p_reflect);
    if (d.is_thin) {
        result.wi = 2.0 * dot(wo, m) * m - wo;
        result.wi.z = -result.wi.z;
    } else {
        result.wi = dielectric_refract(d.eta, wo, m, split.g);
    }
    return result;
}

// Factor on light that passes straight through, for a cosine on the side of wo.
vec3 dielectric_straight(Dielectric d, float c)
{
    return dielectric_split(d, c).t;
}

#endif
