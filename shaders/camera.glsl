// Rays from the camera. The pixel filter is a box: a sample is uniform over the
// area of its pixel, so a pixel is the mean radiance over it.

#ifndef CAMERA_GLSL
#define CAMERA_GLSL

#include "math.glsl"
#include "scene.glsl"

struct Ray {
    vec3 origin;
    vec3 direction; // unit length
};

// A ray that meets a sphere from outside: the direction is uniform, and the place over the disc that it sees.
Ray camera_sphere_ray(vec3 centre, float radius, vec4 u)
{
    float z = 1.0 - 2.0 * u.x;
    float sine = sqrt(larger(1.0 - z * z, 0.0));
    float phi = TWO_PI * u.y;
    vec3 out_of = vec3(sine * cos(phi), sine * sin(phi), z);
    float r = radius * sqrt(u.z);
    float turn = TWO_PI * u.w;
    return Ray(centre + frame_from_z(out_of) * vec3(r * cos(turn), r * sin(turn), radius), -out_of);
}

// `pixel` counts in the full frame, row 0 at the top; `u.yz` is the place in the pixel.
Ray camera_ray(uvec2 pixel, vec4 u)
{
    if (HAS_SENSOR && params.camera_kind == CAMERA_FLUX) {
        return camera_sphere_ray(params.camera_position, params.camera_right.x, u);
    }
    if (HAS_SENSOR && params.camera_kind == CAMERA_IRRADIANCE) {
        return Ray(params.camera_position, -params.camera_forward);
    }
    vec2 at = (vec2(pixel) + u.yz) / vec2(params.width, params.height);
    vec3 offset = (2.0 * at.x - 1.0) * params.camera_right + (1.0 - 2.0 * at.y) * params.camera_up;
    if (params.camera_kind == CAMERA_ORTHOGRAPHIC) {
        return Ray(params.camera_position + offset, params.camera_forward);
    }
    return Ray(params.camera_position, normalize(params.camera_forward + offset));
}

#endif
