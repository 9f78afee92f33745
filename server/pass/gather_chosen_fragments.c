#include "pass/gather_chosen_fragments.h"

#include "pass/kernels.h"

struct gather {
    const struct bd_pass_context *context;
    const struct bd_gather_chosen_fragments_inputs *inputs;
    const struct bd_program *program;
    struct bd_chooser *chooser;
    struct bd_multires_light *out;
};

static enum bd_err gather_slice(const struct gather *g, const struct bd_askers_slice *slice,
                                struct bd_asking *asking)
{
    bd_bind_image(&asking->bindings, 0, g->out->fine, false, true);
    bd_bind_image(&asking->bindings, 1, g->out->coarse, false, true);
    bd_bind_image(&asking->bindings, 2, g->out->fine_vector, false, true);
    bd_bind_image(&asking->bindings, 3, g->out->coarse_vector, false, true);
    bd_bind_image(&asking->bindings, 4, g->out->fine_noise, false, true);
    bd_bind_image(&asking->bindings, 5, g->out->coarse_noise, false, true);
    bd_slicer_work(g->context->slicer, "gather chosen");
    bd_gpu_pass_begin(g->context->gpu, "gather");
    bd_askers_dispatch(g->context->gpu, g->program, asking);
    bd_gpu_pass_end(g->context->gpu);
    return bd_slicer_checkpoint(g->context->slicer, (double)slice->count * g->inputs->rays);
}

static enum bd_err gather_all(const struct gather *g, struct bd_fault *fault)
{
    struct bd_askers_slice slice;
    struct bd_asking asking;
    enum bd_err err = BD_ERR_OK;
    while (!err && bd_chooser_next(g->chooser, &slice, &asking, &err, fault))
        err = gather_slice(g, &slice, &asking);
    return err;
}

static enum bd_err run(struct gather *g, struct bd_fault *fault)
{
    const struct bd_gather_fragments_inputs *gather = g->inputs->gather;
    const struct bd_chooser_inputs choose = {
        .askers = bd_fragment_askers(gather),
        .list = g->inputs->list,
        .choice = g->inputs->choice,
        .rays = g->inputs->rays,
        .seed = g->inputs->seed,
        .spread = gather->spread,
        .visibility = gather->visibility,
    };
    struct bd_defines defines = {0};
    bd_askers_define(&choose.askers, &defines);
    if (gather->spread) bd_define(&defines, "BD_SPREAD", 1);
    if (g->out->fine_noise) bd_define(&defines, "BD_NOISE", 1);
    enum bd_err err = bd_compute_get(g->context->gpu, "pass/gather_fragments/chosen.comp", &defines,
                                     &g->program, fault);
    if (!err) err = bd_chooser_create(g->context, &choose, &g->chooser, fault);
    if (!err) err = gather_all(g, fault);
    if (!err) bd_ray_counts_add(&g->out->rays, bd_chooser_rays(g->chooser));
    return err;
}

enum bd_err bd_gather_chosen_fragments_run(const struct bd_pass_context *context,
                                           const struct bd_gather_chosen_fragments_inputs *inputs,
                                           struct bd_multires_light **out, struct bd_fault *fault)
{
    struct gather g = {.context = context, .inputs = inputs, .out = inputs->gather->into};
    enum bd_err err = BD_ERR_OK;
    if (!g.out)
        err = bd_multires_light_create(context->gpu, &inputs->gather->fragments->layout,
                                       bd_fragment_vectors(inputs->gather), &g.out, fault);
    if (!err && inputs->noise && !inputs->gather->into)
        err = bd_multires_light_add_noise(context->gpu, g.out, fault);
    if (!err) err = run(&g, fault);
    bd_chooser_destroy(context->gpu, &g.chooser);
    if (err && !inputs->gather->into) bd_multires_light_destroy(context->gpu, &g.out);
    if (!err) *out = g.out;
    return err;
}
