// A photon on its way: light that surfaces bend, to the first surface that scatters it.

#ifndef PHOTON_GLSL
#define PHOTON_GLSL

#include "bsdf.glsl"
#include "surface.glsl"

// Scattering at least so dense bends light as a mirror or an interface does, 1/sr.
const float PHOTON_PDF = 2.0;

Photon photon;
bool photon_is_bent; // it was bent before
vec3 photon_normal;  // of the surface where it arrived

// The photon meets s along d. Whether it has arrived.
bool photon_meet(SurfacePoint s, Bsdf bsdf, vec3 d, vec3 beta)
{
    bool has_base = (1.0 - bsdf.p_glass) * (1.0 - bsdf.p_specular) > 0.0;
    if (!photon_is_bent || !has_base) {
        return false;
    }
    photon = Photon(s.position, (beta.x + beta.y + beta.z) / 3.0, -d, 0.0);
    photon_normal = s.ng;
    return true;
}

// It leaves a surface. Whether that bent it.
bool photon_leave(BsdfSample next)
{
    photon_is_bent = photon_is_bent || !next.is_straight;
    return next.pdf == 0.0 || next.pdf >= PHOTON_PDF;
}

#endif
