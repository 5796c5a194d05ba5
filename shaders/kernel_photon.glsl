// Traces photons: light that meets a given point of a surface that bends it, backwards to where it comes from and forwards to
// the first surface that scatters it. Only a guide is made of them (guide.glsl), so that they need not be exact.

#include "invocation.glsl"
#include "path.glsl"

#ifdef ADDRESSES
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer PhotonStarts { PhotonStart list[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) writeonly buffer Photons { Photon list[]; };
#define photon_starts PhotonStarts(addresses[BIND_PHOTON_STARTS]).list
#define photons Photons(addresses[BIND_PHOTONS]).list
#else
layout(binding = BIND_PHOTON_STARTS, scalar) readonly buffer PhotonStartsBlock { PhotonStart photon_starts[]; };
layout(binding = BIND_PHOTONS, scalar) writeonly buffer PhotonsBlock { Photon photons[]; };
#endif

layout(push_constant, scalar) uniform BatchBlock { Batch batch; };

// Light that bounces between mirrors longer than this is left to the paths.
const uint PHOTON_STEPS = 16u;

// Light that meets a surface straight from one sample of a light, W/m².
float photon_direct(vec3 origin, vec3 normal, vec4 u, inout LightSample light, inout uint rays)
{
    light = light_sample(origin, light_view_surface(origin, vec3(0.0)), u);
    float cosine = dot(normal, light.wi);
    if (light.pdf <= 0.0 || cosine <= 0.0) {
        return 0.0;
    }
    float value = (light.radiance.x + light.radiance.y + light.radiance.z) * cosine / (3.0 * light.pdf);
    return shadow_arrives(shadow_of(interior_empty(), origin, NONE, light, vec3(value)), rays).x;
}

void main()
{
    uint i = INVOCATION_GROUP * invocation_group() + invocation_place();
    if (i >= batch.sample_count) {
        return;
    }
    scene_start();
    trace_start();
    photon = Photon(vec3(0.0), 0.0, vec3(0.0), 0.0);
    photon_is_bent = false;
    PhotonStart start = photon_starts[i];
    uvec4 key = rng_key(rng_base(uvec2(0u), 0u), NONE, i);
    PathResult result = path_result();
    LightSample light;
    // every other one on each side
    vec3 normal = (i & 1u) == 0u ? start.normal : -start.normal;
    vec3 origin = start.point + start.offset * normal;
    float weight = 2.0 * start.weight * photon_direct(origin, normal, rng_uniform(key, 0u, SLOT_LIGHT), light, result.rays);
    PathState path = path_start(key, uvec2(0u));
    path.ray = Ray(origin, -light.wi);
    path.scattered_at = origin;
    path.is_sensor = false;
    path.is_search = false;
    // no path meets a light without extent, so there is nothing to look for
    path.is_alive = weight > 0.0 && !light.is_delta;
    for (uint k = 0u; k < PHOTON_STEPS && path_goes_on(path); k++) {
        path_step(path, result);
    }
    photon.weight *= weight;
    if (photon.weight > 0.0) {
        normal = dot(photon_normal, photon.direction) > 0.0 ? photon_normal : -photon_normal;
        origin = photon.position + start.offset * normal;
        photon.direct = photon_direct(origin, normal, rng_uniform(key, 0u, SLOT_SEGMENT), light, result.rays);
        if (!HAS_ENVIRONMENT) {
            photon.direct += PI * (params.env_radiance.x + params.env_radiance.y + params.env_radiance.z) / 3.0;
        }
    }
    photons[i] = photon;
}
