#include "pass/ray_walks.h"

#include "base/clock.h"
#include "pass/kernels.h"
#include "shared/bindings.h"

// Nodes and triangles that one dispatch looks at for a line. The software device ends the loops
// of up to sixteen invocations after 65,535 rounds in all; elsewhere it is some milliseconds.
#define LOOKS_SOFTWARE 4000u
#define LOOKS_HARDWARE 16384u

// Of each question: its program, and what slices learn their pace by.
static const struct row {
    const char *program, *begins, *goes_on;
} rows[] = {
    [BD_RAY_QUESTION_OCCLUDED] = {"pass/visibility/occluded.comp", "walks", "long walks"},
    [BD_RAY_QUESTION_NEAREST] = {"pass/visibility/nearest.comp", "ray walks", "long ray walks"},
};

_Static_assert(BD_STORAGE_RAYS == BD_STORAGE_SEGMENTS, "what is asked");
_Static_assert(BD_STORAGE_RAY_HITS == BD_STORAGE_OCCLUDED, "what is answered");

size_t bd_rays_of_slice(const struct bd_slicer *slicer, size_t left)
{
    const double units = bd_slicer_units(slicer);
    if (units >= (double)left) return left;
    const size_t rays = (size_t)units & ~(size_t)63;
    return rays < 1024 ? (left < 1024 ? left : 1024) : rays;
}

static enum bd_err make_room(struct bd_gpu *gpu, size_t count_max, struct bd_ray_walks *walks,
                             struct bd_err_detail *detail)
{
    if (walks->counts) return BD_ERR_OK;
    enum bd_err err = bd_buf_create_unset(gpu, "places of walks", count_max * sizeof(uint32_t),
                                          &walks->places, detail);
    if (!err)
        err = bd_buf_create_unset(gpu, "counts of walks", BD_RAY_COUNTS * sizeof(uint32_t),
                                  &walks->counts, detail);
    return err;
}

void bd_ray_walks_finish(struct bd_gpu *gpu, struct bd_ray_walks *walks)
{
    bd_buf_destroy(gpu, &walks->places);
    bd_buf_destroy(gpu, &walks->counts);
}

static void dispatch(const struct bd_pass_context *context, const struct bd_program *program,
                     const struct bd_ray_walks_inputs *inputs, const struct bd_ray_walks *walks,
                     const struct bd_ray_walk_args *args)
{
    const struct bd_occluders *occluders = inputs->occluders;
    struct bd_bindings bindings = {0};
    bd_bind_storage(&bindings, BD_STORAGE_SEGMENTS, inputs->asked, true, false);
    bd_bind_storage(&bindings, BD_STORAGE_OCCLUDED, inputs->answers, true, true);
    bd_bind_storage(&bindings, BD_STORAGE_RAY_NODES, occluders->nodes, true, false);
    bd_bind_storage(&bindings, BD_STORAGE_RAY_TRIANGLES, occluders->triangles, true, false);
    bd_bind_storage(&bindings, BD_STORAGE_RAY_PLACES, walks->places, true, true);
    bd_bind_storage(&bindings, BD_STORAGE_RAY_COUNTS, walks->counts, true, true);
    bd_bind_storage(&bindings, BD_STORAGE_RAY_CUTOUTS, occluders->cutouts, true, false);
    bd_bind_storage(&bindings, BD_STORAGE_RAY_TEXELS, occluders->texels, true, false);
    bindings.uniforms[BD_UNIFORM_ARGS].bytes = args;
    bindings.uniforms[BD_UNIFORM_ARGS].size_bytes = sizeof *args;
    bd_gpu_dispatch(context->gpu, program, &bindings,
                    bd_divided_up(args->end_ray - args->first_ray, BD_LIST_GROUP), 1, 1);
}

// All walks, from the first node on or from where each one is. Time is that of whole slices.
static enum bd_err walk_all(const struct bd_pass_context *context, const struct bd_program *program,
                            const struct bd_ray_walks_inputs *inputs,
                            const struct bd_ray_walks *walks, bool begins,
                            struct bd_ray_counts *traced)
{
    const struct bd_occluders *occluders = inputs->occluders;
    const uint32_t looks = bd_gpu_caps(context->gpu)->software ? LOOKS_SOFTWARE : LOOKS_HARDWARE;
    enum bd_err err = BD_ERR_OK;
    for (size_t at = 0, rays; !err && at < inputs->count; at += rays) {
        rays = bd_rays_of_slice(context->slicer, inputs->count - at);
        const struct bd_ray_walk_args args = {
            .first_ray = (uint32_t)at,
            .end_ray = (uint32_t)(at + rays),
            .node_count = occluders->node_count,
            .look_count_max = looks,
            .is_first_round = begins,
            .alpha_is_coverage = inputs->alpha == BD_RAYS_ALPHA_COVERAGE,
            .first_cutout_triangle = occluders->cutout_triangles,
        };
        const uint64_t start_ns = bd_clock_ns();
        dispatch(context, program, inputs, walks, &args);
        err = bd_gpu_wait(context->gpu);
        traced->ms += bd_ms_since(start_ns);
        if (!err) err = bd_slicer_checkpoint(context->slicer, (double)rays);
    }
    return err;
}

enum bd_err bd_ray_walks_run(const struct bd_pass_context *context,
                             const struct bd_ray_walks_inputs *inputs, struct bd_ray_walks *walks,
                             struct bd_ray_counts *traced, struct bd_err_detail *detail)
{
    const struct row *row = &rows[inputs->question];
    const struct bd_program *program;
    struct bd_defines defines = {0};
    if (inputs->occluders->cutouts) bd_define(&defines, "BD_CUTOUT", 1);
    enum bd_err err = bd_compute_get(context->gpu, row->program, &defines, &program, detail);
    if (!err) err = make_room(context->gpu, inputs->count_max, walks, detail);
    uint32_t counts[BD_RAY_COUNTS] = {[BD_RAY_COUNT_UNFINISHED] = 1};
    for (bool begins = true; !err && counts[BD_RAY_COUNT_UNFINISHED] > 0; begins = false) {
        bd_slicer_work(context->slicer, begins ? row->begins : row->goes_on);
        bd_buf_clear(context->gpu, walks->counts);
        err = walk_all(context, program, inputs, walks, begins, traced);
        if (!err) err = bd_buf_read(context->gpu, walks->counts, 0, counts, sizeof counts);
        if (!err) traced->count += counts[BD_RAY_COUNT_ASKED];
    }
    return err;
}
