#include "pass/splat_vpls.h"

#include <stdlib.h>

#include "base/assert.h"
#include "shared/bindings.h"
#include "shared/splat.h"

// Against one evaluation of the gather: a fragment reads its receiver anew and is blended.
#define FRAGMENT_UNITS    10.0
#define VPLS_PER_DRAW_MAX 65536u

struct splat {
    const struct bd_pass_context *context;
    const struct bd_gather_inputs *inputs;
    const struct bd_program *program;
    struct bd_view view;
    float bound;
    double fragments_per_vpl; // on average, at least 1
};

static void draw(const struct splat *s, const struct bd_vpl_list *list, uint32_t first,
                 uint32_t count)
{
    const struct bd_splat_args args = {.first_vpl = first, .bound = s->bound};
    struct bd_draw draw = {
        .program = s->program,
        .index_count = 6,
        .instance_count = count,
        .blend = BD_BLEND_ADD,
    };
    bd_gbuffer_bind(s->inputs->gbuffer, &draw.bindings);
    draw.bindings.arrays[BD_UNIT_VPLS] = list->vpls;
    draw.bindings.arrays[BD_UNIT_VPL_QUADS] = list->quads;
    draw.bindings.uniforms[BD_UNIFORM_VIEW].bytes = &s->view;
    draw.bindings.uniforms[BD_UNIFORM_VIEW].size_bytes = sizeof s->view;
    draw.bindings.uniforms[BD_UNIFORM_ARGS].bytes = &args;
    draw.bindings.uniforms[BD_UNIFORM_ARGS].size_bytes = sizeof args;
    bd_gpu_draw(s->context->gpu, &draw);
}

// In bands of rows where even one VPL's splat is long. Neither bands nor ranges change the order in
// which a pixel's splats come.
static enum bd_err splat_range(const struct splat *s, const struct bd_vpl_list *list,
                               uint32_t first, uint32_t count)
{
    const uint32_t height = s->view.size_px.y;
    double units_per_row = FRAGMENT_UNITS * s->fragments_per_vpl * count / height;
    for (uint32_t row = 0; row < height;) {
        uint32_t rows = bd_slicer_rows(s->context->slicer, units_per_row, height - row);
        bd_gpu_target_rows(s->context->gpu, row, rows);
        draw(s, list, first, count);
        enum bd_err err = bd_slicer_checkpoint(s->context->slicer, units_per_row * rows);
        if (err) return err;
        row += rows;
    }
    return BD_ERR_OK;
}

static enum bd_err splat_list(const struct splat *s, const struct bd_vpl_list *list)
{
    for (uint32_t at = 0; at < list->count;) {
        double fit = bd_slicer_units(s->context->slicer) / (FRAGMENT_UNITS * s->fragments_per_vpl);
        uint32_t most = fit < 1 ? 1 : fit < VPLS_PER_DRAW_MAX ? (uint32_t)fit : VPLS_PER_DRAW_MAX;
        uint32_t count = list->count - at < most ? list->count - at : most;
        enum bd_err err = splat_range(s, list, at, count);
        if (err) return err;
        at += count;
    }
    return BD_ERR_OK;
}

static enum bd_err splat_all(struct splat *s, struct bd_indirect *out, struct bd_err_detail *detail)
{
    struct bd_program_source source = {.vertex = "pass/splat/splat.vert",
                                       .fragment = "pass/splat/splat.frag"};
    if (s->inputs->near_patches) bd_define(&source.defines, "BD_VPL_PATCH", 1);
    if (s->inputs->glossy) bd_define(&source.defines, "BD_GLOSSY", 1);
    struct bd_program *program;
    enum bd_err err = bd_program_get(s->context->gpu, &source, &program, detail);
    if (err) return err;
    s->program = program;
    bd_slicer_work(s->context->slicer, "splat_vpls");
    const struct bd_target target = {.color = {{out->irradiance, 0}, {out->glossy, 0}}};
    bd_gpu_target_begin(s->context->gpu, &target);
    for (uint32_t i = 0; !err && i < s->inputs->list_count; i++)
        err = splat_list(s, s->inputs->lists[i]);
    bd_gpu_target_end(s->context->gpu);
    return err;
}

static double fragments_per_vpl(const struct bd_gather_inputs *inputs, uint64_t fragments)
{
    uint64_t vpls = 0;
    for (uint32_t i = 0; i < inputs->list_count; i++) vpls += inputs->lists[i]->count;
    return fragments > vpls ? (double)fragments / (double)vpls : 1;
}

enum bd_err bd_splat_vpls_run(const struct bd_pass_context *context,
                              const struct bd_gather_inputs *inputs,
                              const struct bd_splat_bound *bound, struct bd_indirect **out,
                              struct bd_err_detail *detail)
{
    struct splat s = {
        .context = context,
        .inputs = inputs,
        .view = bd_viewpoint_uniform(inputs->viewpoint, &inputs->scene->space),
        .bound = bound->irradiance,
        .fragments_per_vpl = fragments_per_vpl(inputs, bound->fragment_count),
    };
    struct bd_indirect *made = NULL;
    enum bd_err err =
        bd_indirect_create(context->gpu, inputs->viewpoint, inputs->glossy, &made, detail);
    if (!err) err = splat_all(&s, made, detail);
    if (err) {
        bd_indirect_destroy(context->gpu, &made);
        return err;
    }
    made->fragment_count = bound->fragment_count;
    *out = made;
    return BD_ERR_OK;
}
