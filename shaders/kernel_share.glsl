// Renders a batch whose pixels share what their paths find (share.glsl): the lanes of a subgroup take pixels of whole blocks
// and compute each sample together.

#include "film.glsl"
#include "path.glsl"
#include "pixels.glsl"

// The pixel that the lane takes next. Eight that follow each other are a block.
uint share_take(bool is_first)
{
    uint k = INVOCATION_GROUP * invocation_group() + invocation_place();
    if (batch.is_shared != 0u) {
        uint count = subgroupAdd(1u);
        uint first = 0u;
        if (subgroupElect()) {
            first = atomicAdd(ledger[LEDGER_TAKEN], count) - batch.taken;
        }
        k = subgroupBroadcastFirst(first) + subgroupExclusiveAdd(1u);
    } else if (!is_first) {
        return NONE;
    }
    return k < TILE * TILE * batch.tile_count ? k : NONE;
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
    uint rays = 0u;
    uint non_finite = 0u;
    bool is_first = true;
    while (true) {
        uint k = share_take(is_first);
        // Tiles are whole blocks, so that the pixels of one are there together.
        if (!subgroupAny(k != NONE)) {
            break;
        }
        is_first = false;
        uvec2 at = pixels_at(pixels_number(k));
        uvec2 pixel = uvec2(params.window_x, params.window_y) + at;
        // Pixels beyond the frame have no numbers of their own; those beyond the window are what they are in the whole frame.
        bool is_there = k != NONE && pixel.x < params.width && pixel.y < params.height;
        bool is_kept = is_there && at.x < params.window_width && at.y < params.window_height;
        uint truncated = 0u;
        // rounded for each sample, so that the sum is the same however samples are split
        uint truncated_throughput = 0u;
        FilmNode node;
        for (uint i = 0u; i < batch.sample_count; i++) {
            PathResult result = path_result();
            share_start();
            if (is_there) {
                PathState path = path_start(pixels_key(base, pixel, batch.first_sample_low + i), pixel);
                while (path_goes_on(path)) {
                    path_step(path, result);
                }
            }
            vec3 radiance = share_finish(result.radiance);
            radiance += share_gather(result.rays);
            rays += result.rays;
            bool is_dropped = !is_finite(radiance);
            if (is_kept) {
                truncated += result.truncated > 0.0 ? 1u : 0u;
                truncated_throughput += whole_long(floor(smaller(result.truncated * 65536.0 + 0.5, 4294967040.0)));
                non_finite += is_dropped ? 1u : 0u;
            }
            node = FilmNode(is_dropped ? vec3(0.0) : radiance, vec3(0.0), vec3(0.0), result.first.albedo, result.first.normal,
                            result.first.depth, result.first.coverage, is_dropped ? 1.0 : 0.0);
            // as in kernel_path.glsl
            for (uint level = 0u; level < FILM_LEVELS; level++) {
                if ((i >> level & 1u) == 0u) {
                    levels[level] = node;
                    break;
                }
                node = film_merge(levels[level], node, level);
            }
        }
        if (is_kept) {
            film_write(at.y * params.window_width + at.x - batch.film_first_pixel, node);
        }
        if (truncated != 0u) {
            atomicAdd(ledger[LEDGER_TRUNCATED], truncated);
            ledger_add(LEDGER_THROUGHPUT_LOW, truncated_throughput);
        }
    }
    if (non_finite != 0u) {
        atomicAdd(ledger[LEDGER_NON_FINITE], non_finite);
    }
    uint rays_together = invocation_sum(rays);
    if (invocation_adds()) {
        ledger_add(LEDGER_RAYS_LOW, rays_together);
    }
}
