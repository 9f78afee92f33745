#include "pass/visibility.h"

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/clock.h"
#include "pass/kernels.h"
#include "shared/bindings.h"

// Nodes and triangles that one dispatch looks at for a segment. The software device ends the loops
// of up to sixteen invocations after 65,535 rounds in all; elsewhere it is some milliseconds.
#define LOOKS_SOFTWARE 4000u
#define LOOKS_HARDWARE 16384u

enum bd_err bd_segments_create(struct bd_gpu *gpu, size_t count_max, struct bd_segments **out,
                               struct bd_fault *fault)
{
    struct bd_segments *s = *out = calloc(1, sizeof *s);
    BD_ASSERT(s);
    s->count_max = (count_max + 31) & ~(size_t)31;
    BD_ASSERT_CMP(s->count_max * sizeof *s->host, <=, BD_SEGMENTS_BYTES_MAX);
    enum bd_err err =
        bd_buf_create_unset(gpu, "segments", s->count_max * sizeof *s->host, &s->segments, fault);
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
    bd_buf_destroy(gpu, &s->places);
    bd_buf_destroy(gpu, &s->counts);
    free(s->host);
    free(s->host_bits);
    free(s);
}

// Segments of a slice: a multiple of 64.
static size_t slice_of(const struct bd_slicer *slicer, size_t left)
{
    const double units = bd_slicer_units(slicer);
    if (units >= (double)left) return left;
    const size_t rays = (size_t)units & ~(size_t)63;
    return rays < 1024 ? (left < 1024 ? left : 1024) : rays;
}

// --- the processor ------------------------------------------------------------------------------

static enum bd_err make_host_room(struct bd_segments *s, struct bd_fault *fault)
{
    if (s->host) return BD_ERR_OK;
    s->host = malloc(s->count_max * sizeof *s->host);
    s->host_bits = malloc(s->count_max / 8);
    if (s->host && s->host_bits) return BD_ERR_OK;
    return bd_fault_set(fault, BD_ERR_NO_MEMORY, "rays", "no memory for %zu segments",
                        s->count_max);
}

enum bd_err bd_visibility_ask(const struct bd_pass_context *context,
                              const struct bd_visibility_inputs *inputs,
                              const struct bd_segment *segments, size_t count, uint32_t *occluded,
                              struct bd_ray_counts *traced)
{
    bd_slicer_work(context->slicer, "visibility");
    enum bd_err err = BD_ERR_OK;
    for (size_t at = 0, rays; !err && at < count; at += rays) {
        rays = slice_of(context->slicer, count - at);
        const uint64_t start_ns = bd_clock_ns();
        traced->count += bd_rays_occluded(inputs->occluders->rays, inputs->pool, inputs->alpha,
                                          segments + at, rays, occluded + at / 32);
        traced->ms += bd_ms_since(start_ns);
        err = bd_slicer_checkpoint(context->slicer, (double)rays);
    }
    return err;
}

static enum bd_err ask_processor(const struct bd_pass_context *context,
                                 const struct bd_visibility_inputs *inputs,
                                 struct bd_segments *segments, size_t count, struct bd_fault *fault)
{
    enum bd_err err = make_host_room(segments, fault);
    if (!err)
        err = bd_buf_read(context->gpu, segments->segments, 0, segments->host,
                          count * sizeof *segments->host);
    if (!err)
        err = bd_visibility_ask(context, inputs, segments->host, count, segments->host_bits,
                                &segments->traced);
    if (!err)
        bd_buf_upload(context->gpu, segments->occluded, 0, segments->host_bits,
                      (count + 31) / 32 * sizeof *segments->host_bits);
    return err;
}

// --- the device ---------------------------------------------------------------------------------

static enum bd_err make_device_room(struct bd_gpu *gpu, struct bd_segments *s,
                                    struct bd_fault *fault)
{
    if (s->counts) return BD_ERR_OK;
    enum bd_err err = bd_buf_create_unset(gpu, "places of walks", s->count_max * sizeof(uint32_t),
                                          &s->places, fault);
    if (!err)
        err = bd_buf_create_unset(gpu, "counts of walks", BD_RAY_COUNTS * sizeof(uint32_t),
                                  &s->counts, fault);
    return err;
}

static void walk(const struct bd_pass_context *context, const struct bd_program *program,
                 const struct bd_occluders *occluders, const struct bd_segments *segments,
                 const struct bd_occluded_args *args)
{
    struct bd_bindings bindings = {0};
    bd_bind_storage(&bindings, BD_STORAGE_SEGMENTS, segments->segments, true, false);
    bd_bind_storage(&bindings, BD_STORAGE_OCCLUDED, segments->occluded, true, true);
    bd_bind_storage(&bindings, BD_STORAGE_RAY_NODES, occluders->nodes, true, false);
    bd_bind_storage(&bindings, BD_STORAGE_RAY_TRIANGLES, occluders->triangles, true, false);
    bd_bind_storage(&bindings, BD_STORAGE_RAY_PLACES, segments->places, true, true);
    bd_bind_storage(&bindings, BD_STORAGE_RAY_COUNTS, segments->counts, true, true);
    bd_bind_storage(&bindings, BD_STORAGE_RAY_CUTOUTS, occluders->cutouts, true, false);
    bd_bind_storage(&bindings, BD_STORAGE_RAY_TEXELS, occluders->texels, true, false);
    bindings.uniforms[BD_UNIFORM_ARGS].bytes = args;
    bindings.uniforms[BD_UNIFORM_ARGS].size_bytes = sizeof *args;
    bd_gpu_dispatch(context->gpu, program, &bindings,
                    bd_divided_up(args->slice.y - args->slice.x, BD_LIST_GROUP), 1, 1);
}

// All walks, from the first node on or from where each one is. Time is that of whole slices.
static enum bd_err walk_all(const struct bd_pass_context *context, const struct bd_program *program,
                            const struct bd_visibility_inputs *inputs, struct bd_segments *segments,
                            size_t count, bool begins)
{
    const struct bd_occluders *occluders = inputs->occluders;
    const uint32_t looks = bd_gpu_caps(context->gpu)->software ? LOOKS_SOFTWARE : LOOKS_HARDWARE;
    enum bd_err err = BD_ERR_OK;
    for (size_t at = 0, rays; !err && at < count; at += rays) {
        rays = slice_of(context->slicer, count - at);
        const struct bd_occluded_args args = {
            .slice = {(uint32_t)at, (uint32_t)(at + rays), occluders->node_count, looks},
            .walk = {begins, inputs->alpha == BD_RAYS_ALPHA_COVERAGE, occluders->cutout_triangles,
                     0}};
        const uint64_t start_ns = bd_clock_ns();
        walk(context, program, occluders, segments, &args);
        err = bd_gpu_wait(context->gpu);
        segments->traced.ms += bd_ms_since(start_ns);
        if (!err) err = bd_slicer_checkpoint(context->slicer, (double)rays);
    }
    return err;
}

static enum bd_err ask_device(const struct bd_pass_context *context,
                              const struct bd_visibility_inputs *inputs,
                              struct bd_segments *segments, size_t count, struct bd_fault *fault)
{
    const struct bd_program *program;
    struct bd_defines defines = {0};
    if (inputs->occluders->cutouts) bd_define(&defines, "BD_CUTOUT", 1);
    enum bd_err err =
        bd_compute_get(context->gpu, "pass/visibility/occluded.comp", &defines, &program, fault);
    if (!err) err = make_device_room(context->gpu, segments, fault);
    uint32_t counts[BD_RAY_COUNTS] = {[BD_RAY_COUNT_UNFINISHED] = 1};
    for (bool begins = true; !err && counts[BD_RAY_COUNT_UNFINISHED] > 0; begins = false) {
        bd_slicer_work(context->slicer, begins ? "walks" : "long walks");
        bd_buf_clear(context->gpu, segments->counts);
        err = walk_all(context, program, inputs, segments, count, begins);
        if (!err) err = bd_buf_read(context->gpu, segments->counts, 0, counts, sizeof counts);
        if (!err) segments->traced.count += counts[BD_RAY_COUNT_ASKED];
    }
    return err;
}

enum bd_err bd_visibility_run(const struct bd_pass_context *context,
                              const struct bd_visibility_inputs *inputs,
                              struct bd_segments *segments, size_t count, struct bd_fault *fault)
{
    BD_ASSERT_CMP(count, <=, segments->count_max);
    return inputs->occluders->rays ? ask_processor(context, inputs, segments, count, fault)
                                   : ask_device(context, inputs, segments, count, fault);
}
