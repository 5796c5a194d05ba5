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

// The path of sample i of the batch at a pixel of the window, which takes 2^exponent times as many as others; `base` is that of
// pixels which take as many as others.
PathState kernel_start(uint i, uvec2 at, uint exponent, uvec4 base)
{
    uvec2 pixel = uvec2(params.window_x, params.window_y) + at;
    uint low = batch.first_sample_low;
    if (HAS_ALLOTMENT) {
        // no shift by 32, which is undefined
        base = pixels_base(batch.first_sample_high << exponent | low >> 1u >> (31u - exponent));
        low <<= exponent;
    }
    return path_start(pixels_key(base, pixel, low + i), pixel);
}

// What an invocation has computed of its pixel, and what it is computing.
struct KernelLane {
    uint number;    // of the pixel, counted tile by tile
    uvec2 at;       // in the window
    uint exponent;  // where others take one sample, the pixel takes 2 to this power
    uint i;         // sample that is being taken
    uint count;     // of samples; before the first pixel all of the one before it are taken
    bool is_first;  // nothing was taken yet
    bool is_done;   // there are no more pixels
    uint rays;
    uint non_finite;
    uint truncated;
    uint truncated_throughput; // rounded for each sample, so that the sum is the same however samples are split
};

// Notes the sample whose path has ended, and starts the next one, of the pixel or of the next pixel.
void kernel_next(inout KernelLane lane, inout FilmNode levels[FILM_LEVELS], inout PathState path, inout PathResult result, uvec4 base)
{
    if (lane.i < lane.count) {
        lane.rays += result.rays;
        lane.truncated += result.truncated > 0.0 ? 1u : 0u;
        lane.truncated_throughput += whole_long(floor(smaller(result.truncated * 65536.0 + 0.5, 4294967040.0)));
        bool is_dropped = !is_finite(result.radiance);
        lane.non_finite += is_dropped ? 1u : 0u;

        FilmNode node = FilmNode(is_dropped ? vec3(0.0) : result.radiance, vec3(0.0), vec3(0.0), result.first.albedo,
                                 result.first.normal, result.first.depth, result.first.coverage, is_dropped ? 1.0 : 0.0);
        // A binary counter: each set bit of i is a finished sibling. The bounds
        // are constant so that the levels stay in registers.
        for (uint level = 0u; level < FILM_LEVELS; level++) {
            if ((lane.i >> level & 1u) == 0u) {
                levels[level] = node;
                break;
            }
            node = film_merge(levels[level], node, level);
        }
        lane.i++;
        if (lane.i == lane.count) {
            // a power of two: the last node holds all
            film_write(lane.at.y * params.window_width + lane.at.x - batch.film_first_pixel, node);
            // in 32 bits for a pixel, whose samples are few
            if (lane.truncated != 0u) {
                atomicAdd(ledger[LEDGER_TRUNCATED], lane.truncated);
                ledger_add(LEDGER_THROUGHPUT_LOW, lane.truncated_throughput);
                lane.truncated = 0u;
                lane.truncated_throughput = 0u;
            }
#ifdef TRACE_RECORDS
            stream_finish(lane.number);
#endif
        }
    }
    if (lane.i == lane.count) {
        uint k = pixels_take(lane.is_first);
        lane.is_done = k == NONE;
        if (lane.is_done) {
            return;
        }
        lane.is_first = false;
        lane.number = pixels_number(k);
        lane.at = pixels_at(lane.number);
        if (lane.at.x >= params.window_width || lane.at.y >= params.window_height) {
            return;
        }
        lane.i = 0u;
        lane.exponent = kernel_exponent(lane.at);
        lane.count = batch.sample_count << lane.exponent;
#if defined(TRACE_RECORDS) || defined(TRAVERSE_RECALL)
        stream_pixel(lane.number);
#endif
    }
#ifdef TRACE_RECORDS
    stream_sample();
#endif
    path = kernel_start(lane.i, lane.at, lane.exponent, base);
    result = path_result();
}

void main()
{
    if (batch.sample_count == 0u) {
        return;
    }
    scene_start();
    trace_start();
    uvec4 base = pixels_base(batch.first_sample_high);
    FilmNode levels[FILM_LEVELS];
    KernelLane lane = KernelLane(0u, uvec2(0u), 0u, batch.sample_count, batch.sample_count, true, false, 0u, 0u, 0u, 0u);
    PathResult result;
    PathState path;
    path.is_alive = false;
    path.shadow.is_waiting = false;
    // A lane whose path has ended starts its next sample at once, or waits until the paths of all in its subgroup have: the
    // bits are the same, the host measures which is faster.
    while (!lane.is_done) {
        while (path_goes_on(path)) {
            path_step(path, result);
            if (batch.is_together == 0u) {
                break;
            }
        }
        if (!path_goes_on(path)) {
            kernel_next(lane, levels, path, result, base);
        }
    }

    if (lane.non_finite != 0u) {
        atomicAdd(ledger[LEDGER_NON_FINITE], lane.non_finite);
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
    uint rays_together = invocation_sum(lane.rays);
    if (invocation_adds()) {
        ledger_add(LEDGER_RAYS_LOW, rays_together);
    }
}
