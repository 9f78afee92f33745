#include "pass/visibility.h"

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/clock.h"
#include "pass/straight.h"

enum bd_err bd_segments_create(struct bd_gpu *gpu, size_t count_max, struct bd_segments **out,
                               struct bd_err_detail *detail)
{
    struct bd_segments *s = *out = calloc(1, sizeof *s);
    BD_ASSERT(s);
    s->count_max = (count_max + 31) & ~(size_t)31;
    BD_ASSERT_CMP(s->count_max * sizeof *s->host, <=, BD_SEGMENTS_BYTES_MAX);
    enum bd_err err =
        bd_buf_create_unset(gpu, "segments", s->count_max * sizeof *s->host, &s->segments, detail);
    if (!err) err = bd_buf_create_unset(gpu, "occluded", s->count_max / 8, &s->occluded, detail);
    if (err) bd_segments_destroy(gpu, out);
    return err;
}

void bd_segments_destroy(struct bd_gpu *gpu, struct bd_segments **segments)
{
    struct bd_segments *s = *segments;
    *segments = NULL;
    if (!s) return;
    bd_buf_destroy(gpu, &s->segments);
    bd_buf_destroy(gpu, &s->occluded);
    bd_ray_walks_finish(gpu, &s->walks);
    free(s->host);
    free(s->host_bits);
    free(s);
}

// --- maps ---------------------------------------------------------------------------------------

bool bd_visibility_is_native(const struct bd_visibility_inputs *inputs)
{
    if (inputs->maps) return !inputs->maps->shadows->texels;
    return inputs->nothing_hides || inputs->images || inputs->occluders->rays;
}

static enum bd_err ask_maps(const struct bd_pass_context *context,
                            const struct bd_visibility_inputs *inputs,
                            const struct bd_segment *segments, size_t count, uint32_t *occluded)
{
    enum bd_err err = BD_ERR_OK;
    bd_slicer_work(context->slicer, "imperfect visibility");
    for (size_t at = 0, now; !err && at < count; at += now) {
        now = bd_rays_of_slice(context->slicer, count - at);
        bd_imperfect_ask(inputs->maps, inputs->pool, segments + at, now, occluded + at / 32);
        err = bd_slicer_checkpoint(context->slicer, (double)now);
    }
    return err;
}

static enum bd_err run_on_maps(const struct bd_pass_context *context,
                               const struct bd_visibility_inputs *inputs,
                               struct bd_segments *segments, size_t count,
                               struct bd_err_detail *detail)
{
    enum bd_err err = BD_ERR_OK;
    bd_slicer_work(context->slicer, "imperfect visibility");
    for (size_t at = 0, now; !err && at < count; at += now) {
        now = bd_rays_of_slice(context->slicer, count - at);
        err = bd_imperfect_ask_device(context, inputs->maps, segments->segments, segments->occluded,
                                      at, now, detail);
        if (!err) err = bd_slicer_checkpoint(context->slicer, (double)now);
    }
    return err;
}

// --- the processor ------------------------------------------------------------------------------

static enum bd_err make_host_room(struct bd_segments *s, struct bd_err_detail *detail)
{
    if (s->host) return BD_ERR_OK;
    s->host = malloc(s->count_max * sizeof *s->host);
    s->host_bits = malloc(s->count_max / 8);
    if (s->host && s->host_bits) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_NO_MEMORY, "rays", "no memory for %zu segments", s->count_max);
}

static enum bd_err ask_rays(const struct bd_pass_context *context,
                            const struct bd_visibility_inputs *inputs,
                            const struct bd_segment *segments, size_t count, uint32_t *occluded,
                            struct bd_ray_counts *traced)
{
    const bool by_chance = inputs->by_chance && bd_visibility_looks_through(inputs);
    const enum bd_rays_alpha alpha =
        by_chance ? bd_visibility_alpha_of_lights(inputs) : inputs->alpha;
    bd_slicer_work(context->slicer, "visibility");
    enum bd_err err = BD_ERR_OK;
    for (size_t at = 0, rays; !err && at < count; at += rays) {
        rays = bd_rays_of_slice(context->slicer, count - at);
        const uint64_t start_ns = bd_clock_ns();
        traced->count += bd_rays_occluded(inputs->occluders->rays, inputs->pool, alpha,
                                          segments + at, rays, occluded + at / 32);
        if (by_chance) bd_straight_by_chance(inputs, segments + at, rays, occluded + at / 32);
        traced->ms += bd_ms_since(start_ns);
        err = bd_slicer_checkpoint(context->slicer, (double)rays);
    }
    return err;
}

static enum bd_err ask_processor(const struct bd_pass_context *context,
                                 const struct bd_visibility_inputs *inputs,
                                 const struct bd_segment *segments, size_t count,
                                 uint32_t *occluded, struct bd_ray_counts *traced)
{
    if (inputs->maps) return ask_maps(context, inputs, segments, count, occluded);
    if (!inputs->nothing_hides && inputs->images)
        return bd_env_rays_occluded(context, inputs->images, inputs->pool, segments, count,
                                    occluded, traced);
    if (!inputs->nothing_hides) return ask_rays(context, inputs, segments, count, occluded, traced);
    memset(occluded, 0, (count + 31) / 32 * sizeof *occluded);
    return BD_ERR_OK;
}

static enum bd_err run_on_processor(const struct bd_pass_context *context,
                                    const struct bd_visibility_inputs *inputs,
                                    struct bd_segments *segments, size_t count,
                                    struct bd_err_detail *detail)
{
    enum bd_err err = make_host_room(segments, detail);
    if (!err)
        err = bd_buf_read(context->gpu, segments->segments, 0, segments->host,
                          count * sizeof *segments->host);
    if (!err)
        err = ask_processor(context, inputs, segments->host, count, segments->host_bits,
                            &segments->traced);
    if (!err)
        bd_buf_upload(context->gpu, segments->occluded, 0, segments->host_bits,
                      (count + 31) / 32 * sizeof *segments->host_bits);
    return err;
}

// --- the device ---------------------------------------------------------------------------------

static enum bd_err run_on_device(const struct bd_pass_context *context,
                                 const struct bd_visibility_inputs *inputs,
                                 struct bd_segments *segments, size_t count,
                                 struct bd_err_detail *detail)
{
    if (inputs->maps) return run_on_maps(context, inputs, segments, count, detail);
    const struct bd_ray_walks_inputs walk = {.question = BD_RAY_QUESTION_OCCLUDED,
                                             .occluders = inputs->occluders,
                                             .alpha = inputs->alpha,
                                             .asked = segments->segments,
                                             .answers = segments->occluded,
                                             .count = count,
                                             .count_max = segments->count_max};
    return bd_ray_walks_run(context, &walk, &segments->walks, &segments->traced, detail);
}

static enum bd_err ask_device(const struct bd_pass_context *context,
                              const struct bd_visibility_inputs *inputs,
                              const struct bd_segment *segments, size_t count, uint32_t *occluded,
                              struct bd_ray_counts *traced, struct bd_err_detail *detail)
{
    struct bd_gpu *gpu = context->gpu;
    struct bd_segments *part = NULL;
    const size_t most = count < BD_SEGMENTS_MAX ? count : BD_SEGMENTS_MAX;
    enum bd_err err = bd_segments_create(gpu, most, &part, detail);
    for (size_t at = 0, now; !err && at < count; at += now) {
        now = count - at < most ? count - at : most;
        bd_buf_upload(gpu, part->segments, 0, segments + at, now * sizeof *segments);
        err = run_on_device(context, inputs, part, now, detail);
        if (!err)
            err = bd_buf_read(gpu, part->occluded, 0, occluded + at / 32,
                              (now + 31) / 32 * sizeof *occluded);
    }
    if (!err) bd_ray_counts_add(traced, part->traced);
    bd_segments_destroy(gpu, &part);
    return err;
}

// --- either -------------------------------------------------------------------------------------

enum bd_err bd_visibility_ask(const struct bd_pass_context *context,
                              const struct bd_visibility_inputs *inputs,
                              const struct bd_segment *segments, size_t count, uint32_t *occluded,
                              struct bd_ray_counts *traced, struct bd_err_detail *detail)
{
    if (count == 0) return BD_ERR_OK;
    return bd_visibility_is_native(inputs)
               ? ask_processor(context, inputs, segments, count, occluded, traced)
               : ask_device(context, inputs, segments, count, occluded, traced, detail);
}

enum bd_err bd_visibility_run(const struct bd_pass_context *context,
                              const struct bd_visibility_inputs *inputs,
                              struct bd_segments *segments, size_t count,
                              struct bd_err_detail *detail)
{
    BD_ASSERT_CMP(count, <=, segments->count_max);
    if (inputs->nothing_hides && !context->processor) {
        bd_buf_clear(context->gpu, segments->occluded);
        return BD_ERR_OK;
    }
    return bd_visibility_is_native(inputs)
               ? run_on_processor(context, inputs, segments, count, detail)
               : run_on_device(context, inputs, segments, count, detail);
}
