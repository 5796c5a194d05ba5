// Where light comes from that mirrors and interfaces have gathered: scattering of surfaces chooses some of its directions from
// what photons found before the render [Jensen95]. Directions aim at points, so that neighbours share them [Ruppert20].
//
// [Jensen95] Jensen, Importance Driven Path Tracing using the Photon Map.
// [Ruppert20] Ruppert, Herholz, Lensch, Robust Fitting of Parallax-Aware Mixtures for Path Guiding.

#ifndef GUIDE_GLSL
#define GUIDE_GLSL

#include "bsdf.glsl"
#include "math.glsl"
#include "scene.glsl"

// Of the directions that the base of a surface would choose, so many are the guide's where there is one.
const float GUIDE_SHARE = 0.25;

// Directions about one, a von Mises–Fisher lobe.
struct GuideLobe {
    vec3 middle;     // unit
    float weight;    // by the cosine of its middle; 0: there is none
    float kappa;
};

// Lobes of a point of a surface.
struct Guide {
    GuideLobe lobes[GUIDE_LOBES];
    float total;     // of the weights; 0: nothing is known
};

uvec4 guide_texel(uint at)
{
#ifdef WGPU
    return uvec4(0u);
#else
    return texelFetch(guide_texels, int(at));
#endif
}

// The leaf that holds a point: its first texel and how many lobes it has, none outside its box.
uvec2 guide_leaf(vec3 position)
{
    uvec4 node = guide_texel(0u);
    for (uint depth = 0u; depth < GUIDE_DEPTH && (node.y & GUIDE_AXIS_MASK) != GUIDE_LEAF; depth++) {
        uint axis = node.y & GUIDE_AXIS_MASK;
        float at = axis == 0u ? position.x : axis == 1u ? position.y : position.z;
        node = guide_texel((node.y >> GUIDE_LINK_SHIFT) + (at < uintBitsToFloat(node.x) ? 0u : 1u));
    }
    uint first = node.y >> GUIDE_LINK_SHIFT;
    vec3 low = uintBitsToFloat(guide_texel(first).xyz);
    vec3 high = uintBitsToFloat(guide_texel(first + 1u).xyz);
    bool is_outside = any(lessThan(position, low)) || any(greaterThan(position, high));
    return uvec2(first, is_outside ? 0u : node.z);
}

// What is known about a point of a surface; normal: about which its base scatters.
Guide guide_at(vec3 position, vec3 normal)
{
    Guide guide;
    guide.total = 0.0;
    uvec2 leaf = guide_leaf(position);
    for (uint k = 0u; k < GUIDE_LOBES; k++) {
        guide.lobes[k] = GuideLobe(normal, 0.0, 1.0);
        if (k < leaf.y) {
            vec4 place = uintBitsToFloat(guide_texel(leaf.x + 2u + 2u * k));
            float weight = uintBitsToFloat(guide_texel(leaf.x + 3u + 2u * k).x);
            vec3 to = place.xyz - position;
            vec3 middle = to * inversesqrt(larger(dot(to, to), 1.0e-30));
            guide.lobes[k] = GuideLobe(middle, weight * larger(dot(middle, normal), 0.0), place.w);
            guide.total += guide.lobes[k].weight;
        }
    }
    return guide;
}

// Density of its directions, per steradian.
float guide_pdf(Guide guide, vec3 d)
{
    float sum = 0.0;
    for (uint k = 0u; k < GUIDE_LOBES; k++) {
        GuideLobe lobe = guide.lobes[k];
        // 1 − cosine by the chord: exact where the lobe is narrow
        vec3 chord = d - lobe.middle;
        sum += lobe.weight * lobe.kappa * exp(-0.5 * lobe.kappa * dot(chord, chord)) / (1.0 - exp(-2.0 * lobe.kappa));
    }
    return sum / (TWO_PI * guide.total);
}

// One of its directions. u.x chooses the lobe.
vec3 guide_direction(Guide guide, vec3 u)
{
    GuideLobe lobe = guide.lobes[0];
    float left = u.x * guide.total - lobe.weight;
    for (uint k = 1u; k < GUIDE_LOBES; k++) {
        if (left >= 0.0 && guide.lobes[k].weight > 0.0) {
            lobe = guide.lobes[k];
            left -= lobe.weight;
        }
    }
    // 1 − cosine
    float w = limited(-log(u.y + (1.0 - u.y) * exp(-2.0 * lobe.kappa)) / lobe.kappa, 0.0, 2.0);
    float phi = TWO_PI * u.z;
    float r = sqrt(w * (2.0 - w));
    return normalize(frame_from_z(lobe.middle) * vec3(r * cos(phi), r * sin(phi), 1.0 - w));
}

// Gives some of the directions of a surface's base to the guide, and all their density; by how much that made the direction more
// likely. `u_lobe` chose the lobe of the surface. next.pdf stays that of the surface by itself, by which it shares the work
// with direct light: any function of the direction will do.
float guide_sample(vec3 position, Bsdf bsdf, mat3 frame, vec3 wo, float u_lobe, vec4 u, inout BsdfSample next)
{
    float base = (1.0 - bsdf.p_glass) * (1.0 - bsdf.p_specular);
    Guide guide = guide_at(position, frame[2]);
    if (base <= 0.0 || guide.total <= 0.0) {
        return 1.0;
    }
    bool is_turned = u_lobe >= 1.0 - base && u.x < GUIDE_SHARE;
    if (is_turned) {
        next.wi = guide_direction(guide, vec3(u.x / GUIDE_SHARE, u.yz)) * frame;
        next.is_transmitted = false;
        next.is_straight = false;
    } else if (next.pdf == 0.0 || next.wi.z <= 0.0) {
        return 1.0;
    }
    BsdfValue value = bsdf_eval(bsdf, wo, next.wi);
    next.pdf = value.pdf;
    next.is_valid = value.pdf > 0.0 && next.wi.z > 0.0;
    if (!next.is_valid) {
        return 1.0;
    }
    float pdf = value.pdf + GUIDE_SHARE * base * (guide_pdf(guide, frame * next.wi) - next.wi.z * INV_PI);
    next.weight = value.f_cos / pdf;
    return pdf / value.pdf;
}

#endif
