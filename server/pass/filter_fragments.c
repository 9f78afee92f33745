#include "pass/filter_fragments.h"

#include "pass/kernels.h"
#include "shared/bindings.h"
#include "shared/gather_fragments.h"

// Blocks that a fragment looks at.
#define UNITS_PER_FRAGMENT 50.0

struct filter {
    const struct bd_pass_context *context;
    const struct bd_gather_fragments_inputs *inputs;
    float variance_part;
    const struct bd_multires_light *from;
    struct bd_multires_light *to;
    struct bd_view view;
};

static void bind(const struct filter *f, const struct bd_fragments *list, bool fine,
                 struct bd_bindings *bindings)
{
    bd_gbuffer_bind(f->inputs->gbuffer, bindings);
    bindings->textures[BD_UNIT_BLOCK_REPRESENTATIVE].tex = f->inputs->discontinuity->representative;
    bindings->textures[BD_UNIT_NOISY_LIGHT].tex = fine ? f->from->fine : f->from->coarse;
    bindings->textures[BD_UNIT_NOISY_VECTOR].tex =
        fine ? f->from->fine_vector : f->from->coarse_vector;
    bindings->textures[BD_UNIT_NOISE].tex = fine ? f->from->fine_noise : f->from->coarse_noise;
    bindings->uniforms[BD_UNIFORM_VIEW].bytes = &f->view;
    bindings->uniforms[BD_UNIFORM_VIEW].size_bytes = sizeof f->view;
    bindings->uniforms[BD_UNIFORM_MULTIRES].bytes = &f->from->layout;
    bindings->uniforms[BD_UNIFORM_MULTIRES].size_bytes = sizeof f->from->layout;
    bd_bind_storage(bindings, BD_STORAGE_FRAGMENTS, list->list, true, false);
    bd_bind_image(bindings, 0, fine ? f->to->fine : f->to->coarse, false, true);
    bd_bind_image(bindings, 1, fine ? f->to->fine_vector : f->to->coarse_vector, false, true);
}

// Fragments of level 0, or the others, which come first.
static enum bd_err filter_list(const struct filter *f, const struct bd_fragments *list, bool fine,
                               struct bd_err_detail *detail)
{
    struct bd_defines defines = {0};
    const struct bd_program *program;
    if (fine ? f->to->fine_vector : f->to->coarse_vector) bd_define(&defines, "BD_VECTOR", 1);
    enum bd_err err = bd_compute_get(f->context->gpu, "pass/filter_fragments/filter_fragments.comp",
                                     &defines, &program, detail);
    const uint32_t first = fine ? list->level_first[0] : 0;
    const uint32_t end = fine ? first + list->level_count[0] : list->count - list->level_count[0];
    for (uint32_t at = first, count; !err && at < end; at += count) {
        struct bd_bindings bindings = {0};
        count = bd_list_slice(f->context->slicer, UNITS_PER_FRAGMENT, end - at);
        const struct bd_gather_fragments_args args = {
            .first_fragment = at, .fragment_count = count, .variance_part = f->variance_part};
        bind(f, list, fine, &bindings);
        bindings.uniforms[BD_UNIFORM_ARGS].bytes = &args;
        bindings.uniforms[BD_UNIFORM_ARGS].size_bytes = sizeof args;
        bd_gpu_dispatch(f->context->gpu, program, &bindings, bd_divided_up(count, BD_LIST_GROUP), 1,
                        1);
        err = bd_slicer_checkpoint(f->context->slicer, UNITS_PER_FRAGMENT * count);
    }
    return err;
}

enum bd_err bd_filter_fragments_run(const struct bd_pass_context *context,
                                    const struct bd_gather_fragments_inputs *inputs,
                                    const struct bd_fragments *const *lists, uint32_t list_count,
                                    float variance_part, struct bd_multires_light **light,
                                    struct bd_err_detail *detail)
{
    struct filter f = {
        .context = context,
        .inputs = inputs,
        .variance_part = variance_part,
        .from = *light,
        .view = bd_viewpoint_uniform(inputs->viewpoint, &inputs->scene->space),
    };
    bd_gpu_pass_begin(context->gpu, "filter");
    bd_slicer_work(context->slicer, "filter_fragments");
    enum bd_err err = bd_multires_light_create(context->gpu, &(*light)->layout,
                                               bd_fragment_vectors(inputs), &f.to, detail);
    for (uint32_t l = 0; !err && l < 2 * list_count; l++)
        err = filter_list(&f, lists[l / 2], l % 2, detail);
    bd_gpu_pass_end(context->gpu);
    if (err) {
        bd_multires_light_destroy(context->gpu, &f.to);
        return err;
    }
    f.to->rays = (*light)->rays;
    bd_multires_light_destroy(context->gpu, light);
    *light = f.to;
    return BD_ERR_OK;
}
