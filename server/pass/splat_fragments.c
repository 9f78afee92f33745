#include "pass/splat_fragments.h"

#include "shared/bindings.h"
#include "shared/splat.h"

// Of the slicer, one for each evaluation of a VPL by a gather: 480 million of those a second on the
// software device, seven million points.
#define UNITS_PER_SPLAT   70.0
#define VPLS_PER_DRAW_MAX 65536u

struct splat {
    const struct bd_pass_context *context;
    const struct bd_gather_fragments_inputs *inputs;
    const struct bd_program *program;
    struct bd_view view;
    struct bd_multires_light *out;
    const struct bd_tex_desc *size;          // of the target
    uint32_t first_fragment, fragment_count; // that lie in it
};

// The part of the fragments and of a list's VPLs that one draw puts together.
struct range {
    uint32_t first_fragment, fragment_count;
    uint32_t first_vpl, vpl_count;
};

static void draw(const struct splat *s, uint32_t list, const struct range *range)
{
    const struct bd_splat_fragments_args args = {
        .first_vpl = range->first_vpl,
        .is_first_list = list == 0,
        .size_px = {s->size->width_px, s->size->height_px, 0, 0},
    };
    struct bd_draw draw = {
        .program = s->program,
        .bindings =
            {
                .textures[BD_UNIT_BLOCK_REPRESENTATIVE] =
                    {.tex = s->inputs->discontinuity->representative},
                .arrays[BD_UNIT_VPLS] = s->inputs->lists[list]->vpls,
                .arrays[BD_UNIT_VPL_QUADS] = s->inputs->lists[list]->quads,
                .uniforms[BD_UNIFORM_VIEW] = {&s->view, sizeof s->view},
                .uniforms[BD_UNIFORM_MULTIRES] = {&s->out->layout, sizeof s->out->layout},
                .uniforms[BD_UNIFORM_ARGS] = {&args, sizeof args},
            },
        .attributes[0] = {.buf = s->inputs->fragments->list,
                          .offset_bytes = range->first_fragment * sizeof(uint32_t),
                          .stride_bytes = sizeof(uint32_t),
                          .component_count = 1,
                          .is_uint = true},
        .index_count = range->fragment_count,
        .instance_count = range->vpl_count,
        .topology = BD_TOPOLOGY_POINTS,
        .blend = BD_BLEND_ADD,
    };
    bd_gbuffer_bind(s->inputs->gbuffer, &draw.bindings);
    bd_gpu_draw(s->context->gpu, &draw);
}

static uint32_t part_of_slice(const struct splat *s, double units_each, uint32_t left)
{
    double fit = bd_slicer_units(s->context->slicer) / units_each;
    if (fit >= left) return left;
    return fit < 1 ? 1 : (uint32_t)fit;
}

// All fragments, for VPLs whose order does not depend on how they are cut.
static enum bd_err splat_vpls(const struct splat *s, uint32_t list, uint32_t first, uint32_t count)
{
    const uint32_t end = s->first_fragment + s->fragment_count;
    for (uint32_t at = s->first_fragment; at < end;) {
        const struct range range = {
            .first_fragment = at,
            .fragment_count = part_of_slice(s, UNITS_PER_SPLAT * count, end - at),
            .first_vpl = first,
            .vpl_count = count,
        };
        draw(s, list, &range);
        enum bd_err err = bd_slicer_checkpoint(s->context->slicer,
                                               UNITS_PER_SPLAT * count * range.fragment_count);
        if (err) return err;
        at += range.fragment_count;
    }
    return BD_ERR_OK;
}

static enum bd_err splat_list(const struct splat *s, uint32_t list)
{
    const uint32_t vpl_count = s->inputs->lists[list]->count;
    for (uint32_t at = 0; at < vpl_count;) {
        uint32_t left = vpl_count - at < VPLS_PER_DRAW_MAX ? vpl_count - at : VPLS_PER_DRAW_MAX;
        uint32_t count = part_of_slice(s, UNITS_PER_SPLAT * s->fragment_count, left);
        enum bd_err err = splat_vpls(s, list, at, count);
        if (err) return err;
        at += count;
    }
    return BD_ERR_OK;
}

static enum bd_err splat_target(struct splat *s, bool fine, struct bd_err_detail *detail)
{
    const struct bd_fragments *fragments = s->inputs->fragments;
    struct bd_program_source source = {.vertex = "pass/splat/fragments.vert",
                                       .fragment = "pass/splat/fragments.frag"};
    if (fine) bd_define(&source.defines, "BD_FINE", 1);
    if (s->inputs->near_patches) bd_define(&source.defines, "BD_VPL_PATCH", 1);
    if (s->inputs->vector) bd_define(&source.defines, "BD_VECTOR", 1);
    const struct bd_target target = {
        .color = {{fine ? s->out->fine : s->out->coarse, 0},
                  {fine ? s->out->fine_vector : s->out->coarse_vector, 0}},
    };
    // The list goes from the coarsest level down.
    s->first_fragment = fine ? fragments->count - fragments->level_count[0] : 0;
    s->fragment_count = (fine ? fragments->count : fragments->count - fragments->level_count[0]) -
                        s->first_fragment;
    s->size = bd_tex_desc(target.color[0].tex);
    if (s->fragment_count == 0) return BD_ERR_OK;
    struct bd_program *program;
    enum bd_err err = bd_program_get(s->context->gpu, &source, &program, detail);
    if (err) return err;
    s->program = program;
    bd_slicer_work(s->context->slicer, "splat_fragments");
    bd_gpu_target_begin(s->context->gpu, &target);
    for (uint32_t i = 0; !err && i < s->inputs->list_count; i++) err = splat_list(s, i);
    bd_gpu_target_end(s->context->gpu);
    return err;
}

enum bd_err bd_splat_fragments_run(const struct bd_pass_context *context,
                                   const struct bd_gather_fragments_inputs *inputs,
                                   struct bd_multires_light **out, struct bd_err_detail *detail)
{
    struct splat s = {
        .context = context,
        .inputs = inputs,
        .view = bd_viewpoint_uniform(inputs->viewpoint, &inputs->scene->space),
    };
    enum bd_err err = bd_multires_light_create(
        context->gpu, &inputs->fragments->layout,
        inputs->vector ? BD_LIGHT_VECTORS_ALL : BD_LIGHT_VECTORS_NONE, &s.out, detail);
    if (!err) err = splat_target(&s, true, detail);
    if (!err) err = splat_target(&s, false, detail);
    if (err) {
        bd_multires_light_destroy(context->gpu, &s.out);
        return err;
    }
    *out = s.out;
    return BD_ERR_OK;
}
