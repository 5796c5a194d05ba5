// Traces the rays that a render traced, and shades nothing: what of a render's time is traversal. One invocation traces
// those of its pixel, in order, as the kernel that rendered did: after a ray of the path the shadow ray that follows it.

#include "pixels.glsl"
#include "stream.glsl"
#include "surface.glsl"

// To, flags and the triangle that was met, of the next ray.
uvec4 replay_names;

bool replay_is(uint flag) { return stream_at < stream_end && (replay_names.y & flag) != 0u; }

// Reads of the next ray, where there is one, what kind it is.
void replay_look()
{
    replay_names = stream_at < stream_end ? stream_texel(stream_at, 2u) : uvec4(0u);
}

// Traces the next ray; whether what it meets is what was recorded.
bool replay_ray(bool is_shadow)
{
    uvec4 start = stream_texel(stream_at, 0u);
    uvec4 way = stream_texel(stream_at, 1u);
    uvec4 names = replay_names;
    stream_at++;
    replay_look();
    vec3 origin = uintBitsToFloat(start.xyz);
    vec3 direction = uintBitsToFloat(way.xyz);
    float t_max = uintBitsToFloat(start.w);
    if (is_shadow) {
        return trace_occluded(origin, direction, 0.0, t_max, way.w, names.x) == (names.w != NONE);
    }
    Hit hit;
    bool is_hit = trace_closest(origin, direction, 0.0, t_max, way.w, hit);
    return is_hit ? hit.instance == names.z && hit.primitive == names.w : names.w == NONE;
}

void main()
{
    if (batch.sample_count == 0u) {
        return;
    }
    scene_start();
    trace_start();
    uint rays = 0u;
    uint different = 0u;
    stream_at = 0u;
    stream_end = 0u;
    bool goes_on = false;
    bool is_first = true;
    while (true) {
        if (goes_on) {
            if (!replay_is(STREAM_IS_SHADOW)) {
                different += replay_ray(false) ? 0u : 1u;
                rays++;
            }
            if (replay_is(STREAM_IS_SHADOW)) {
                different += replay_ray(true) ? 0u : 1u;
                rays++;
            }
            goes_on = stream_at < stream_end && !replay_is(STREAM_IS_FIRST);
        }
        if (batch.is_together != 0u ? invocation_any(goes_on) : goes_on) {
            continue;
        }
        if (stream_at == stream_end) {
            uint k = pixels_take(is_first);
            if (k == NONE) {
                break;
            }
            is_first = false;
            stream_pixel(pixels_number(k));
            replay_look();
        }
        goes_on = stream_at < stream_end;
    }
    uint rays_together = invocation_sum(rays);
    uint different_together = invocation_sum(different);
    if (invocation_adds()) {
        ledger_add(LEDGER_RAYS_LOW, rays_together);
        atomicAdd(ledger[LEDGER_DIFFERENT], different_together);
    }
}
