// Rays from the camera. The pixel filter is a box: a sample is uniform over the
// area of its pixel, so a pixel is the mean radiance over it.

#ifndef CAMERA_GLSL
#define CAMERA_GLSL

#include "scene.glsl"

struct Ray {
    vec3 origin;
    vec3 direction; // unit length
};

// `pixel` counts in the full frame, row 0 at the top; `u` is the place in the pixel.
Ray camera_ray(uvec2 pixel, vec2 u)
{
    vec2 at = (vec2(pixel) + u) / vec2(params.width, params.height);
    vec3 offset = (2.0 * at.x - 1.0) * params.camera_right + (1.0 - 2.0 * at.y) * params.camera_up;
    if (params.camera_kind == CAMERA_ORTHOGRAPHIC) {
        return Ray(params.camera_position + offset, params.camera_forward);
    }
    return Ray(params.camera_position, normalize(params.camera_forward + offset));
}

#endif
