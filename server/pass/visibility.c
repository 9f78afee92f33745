#include "pass/visibility.h"

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/clock.h"

enum bd_err bd_segments_create(struct bd_gpu *gpu, size_t count_max, struct bd_segments **out,
                               struct bd_fault *fault)
{
    struct bd_segments *s = *out = calloc(1, sizeof *s);
    BD_ASSERT(s);
    s->count_max = (count_max + 31) & ~(size_t)31;
    BD_ASSERT_CMP(s->count_max * sizeof *s->host, <=, BD_SEGMENTS_BYTES_MAX);
    s->host = malloc(s->count_max * sizeof *s->host);
    s->host_bits = malloc(s->count_max / 8);
    enum bd_err err = BD_ERR_OK;
    if (!s->host || !s->host_bits)
        err = bd_fault_set(fault, BD_ERR_NO_MEMORY, "rays", "no memory for %zu segments",
                           s->count_max);
    if (!err)
        err = bd_buf_create_unset(gpu, "segments", s->count_max * sizeof *s->host, &s->segments,
                                  fault);
    if (!err) err = bd_buf_create_unset(gpu, "occluded", s->count_max / 8, &s->occluded, fault);
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
    free(s->host);
    free(s->host_bits);
    free(s);
}

// Rays of a slice: a multiple of 32.
static size_t slice_of(const struct bd_slicer *slicer, size_t left)
{
    const double units = bd_slicer_units(slicer);
    if (units >= (double)left) return left;
    const size_t rays = (size_t)units & ~(size_t)31;
    return rays < 1024 ? (left < 1024 ? left : 1024) : rays;
}

enum bd_err bd_visibility_run(const struct bd_pass_context *context,
                              const struct bd_visibility_inputs *inputs,
                              struct bd_segments *segments, size_t count, struct bd_fault *fault)
{
    (void)fault;
    BD_ASSERT_CMP(count, <=, segments->count_max);
    bd_slicer_work(context->slicer, "visibility");
    enum bd_err err = bd_buf_read(context->gpu, segments->segments, 0, segments->host,
                                  count * sizeof *segments->host);
    for (size_t at = 0, rays; !err && at < count; at += rays) {
        rays = slice_of(context->slicer, count - at);
        const uint64_t start_ns = bd_clock_ns();
        segments->traced.count +=
            bd_rays_occluded(inputs->rays, inputs->pool, inputs->alpha, segments->host + at, rays,
                             segments->host_bits + at / 32);
        segments->traced.ms += bd_ms_since(start_ns);
        err = bd_slicer_checkpoint(context->slicer, (double)rays);
    }
    if (!err)
        bd_buf_upload(context->gpu, segments->occluded, 0, segments->host_bits,
                      (count + 31) / 32 * sizeof *segments->host_bits);
    return err;
}
