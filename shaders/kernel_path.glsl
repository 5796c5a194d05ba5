// Renders a batch: some tiles of the window, an aligned power of two of samples.
// One invocation computes all samples of its pixel, in order.

#include "film.glsl"
#include "path.glsl"
#include "pixels.glsl"

#if defined(ADDRESSES)
#define allotment(i) scene_single(BIND_ALLOTMENT, i)
#elif !defined(WGPU)
layout(binding = BIND_ALLOTMENT) uniform usamplerBuffer allotment;
#endif

// Where others take one sample, a pixel of the window takes 2 to this power.
uint kernel_exponent(uvec2 at)
{
    uint exponent = 0u;
#ifndef WGPU
    if (HAS_ALLOTMENT) {
        exponent = texelFetch(allotment, int(at.y * params.window_width + at.x)).x;
    }
#endif
    return exponent;
}

// The path of sample i of the batch at a pixel of the window, which takes 2^exponent times as many as others.
PathState kernel_start(uint i, uvec2 at, uint exponent)
{
    uvec2 pixel = uvec2(params.window_x, params.window_y) + at;
    uint low = batch.first_sample_low;
    uint high = batch.first_sample_high;
    if (HAS_ALLOTMENT) {
        // no shift by 32, which is undefined
        high = high << exponent | low >> 1u >> (31u - exponent);
        low <<= exponent;
    }
    return path_start(pixels_key(pixel, low + i, high), pixel);
}

void main()
{
    if (batch.sample_count == 0u) {
        return;
    }
    trace_start();
    FilmNode levels[FILM_LEVELS];
    uint rays = 0u;
    uint truncated = 0u;
    // rounded for each sample, so that the sum is the same however samples are split
    uint truncated_throughput = 0u;
    uint non_finite = 0u;
    PathResult result;
    PathState path;
    path.is_alive = false;
    path.shadow.is_waiting = false;
    uint number;
    uvec2 at;
    // Of the pixel, and of its sample that is being taken. Before the first pixel all of the one before it are.
    uint exponent = 0u;
    uint count = batch.sample_count;
    uint i = count;
    bool is_first = true;
    // A lane whose path has ended starts its next sample at once, or waits for its subgroup: the
    // bits are the same, the host measures which is faster.
    while (true) {
        if (path_goes_on(path)) {
            path_step(path, result);
        }
        bool goes_on = path_goes_on(path);
        if (batch.is_together != 0u ? invocation_any(goes_on) : goes_on) {
            continue;
        }
        if (i < count) {
            rays += result.rays;
            truncated += result.truncated > 0.0 ? 1u : 0u;
            truncated_throughput += uint(result.truncated * 65536.0 + 0.5);
            bool is_dropped = !is_finite(result.radiance);
            non_finite += is_dropped ? 1u : 0u;

            FilmNode node = FilmNode(is_dropped ? vec3(0.0) : result.radiance, vec3(0.0), vec3(0.0), result.first.albedo,
                                     result.first.normal, result.first.depth, result.first.coverage, is_dropped ? 1.0 : 0.0);
            // A binary counter: each set bit of i is a finished sibling. The bounds
            // are constant so that the levels stay in registers.
            for (uint level = 0u; level < FILM_LEVELS; level++) {
                if ((i >> level & 1u) == 0u) {
                    levels[level] = node;
                    break;
                }
                node = film_merge(levels[level], node, level);
            }
            i++;
            if (i == count) {
                // a power of two: the last node holds all
                film_write(at.y * params.window_width + at.x - batch.film_first_pixel, node);
                // in 32 bits for a pixel, whose samples are few
                if (truncated != 0u) {
                    atomicAdd(ledger[LEDGER_TRUNCATED], truncated);
                    ledger_add(LEDGER_THROUGHPUT_LOW, truncated_throughput);
                    truncated = 0u;
                    truncated_throughput = 0u;
                }
#ifdef TRACE_RECORDS
                stream_finish(number);
#endif
            }
        }
        if (i == count) {
            uint k = pixels_take(is_first);
            if (k == NONE) {
                break;
            }
            is_first = false;
            number = pixels_number(k);
            at = pixels_at(number);
            if (at.x >= params.window_width || at.y >= params.window_height) {
                continue;
            }
            i = 0u;
            exponent = kernel_exponent(at);
            count = batch.sample_count << exponent;
#if defined(TRACE_RECORDS) || defined(TRAVERSE_RECALL)
            stream_pixel(number);
#endif
        }
#ifdef TRACE_RECORDS
        stream_sample();
#endif
        path = kernel_start(i, at, exponent);
        result = path_result();
    }

    if (non_finite != 0u) {
        atomicAdd(ledger[LEDGER_NON_FINITE], non_finite);
    }
    if (HAS_NESTED && interior_overflows != 0u) {
        atomicAdd(ledger[LEDGER_INTERIOR_OVERFLOWS], interior_overflows);
    }
#ifdef TRACE_COUNTS
    uvec4 counts = uvec4(invocation_sum(bvh_nodes_visited), invocation_sum(bvh_records_read), invocation_sum(bvh_steps),
                         invocation_sum(bvh_lane_steps));
    if (invocation_adds()) {
        ledger_add(LEDGER_NODES_LOW, counts.x);
        ledger_add(LEDGER_RECORDS_LOW, counts.y);
        ledger_add(LEDGER_STEPS_LOW, counts.z);
        ledger_add(LEDGER_LANES_LOW, counts.w);
    }
#endif
    uint rays_together = invocation_sum(rays);
    if (invocation_adds()) {
        ledger_add(LEDGER_RAYS_LOW, rays_together);
    }
}
