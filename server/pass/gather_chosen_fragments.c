#include "pass/gather_chosen_fragments.h"

#include "pass/gather_native.h"
#include "pass/kernels.h"

struct gather {
    const struct bd_pass_context *context;
    const struct bd_gather_chosen_fragments_inputs *inputs;
    struct bd_chooser *chooser;
    struct bd_multires_light *out;
};

static enum bd_err run(struct gather *g, struct bd_err_detail *detail)
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
    struct bd_chosen_use use = {"gather", NULL, bd_multires_light_bind, g->out};
    struct bd_defines defines = {0};
    bd_askers_define(&choose.askers, &defines);
    if (gather->spread) bd_define(&defines, "BD_SPREAD", 1);
    if (g->out->fine_noise) bd_define(&defines, "BD_NOISE", 1);
    enum bd_err err = bd_compute_get(g->context->gpu, "pass/gather_fragments/chosen.comp", &defines,
                                     &use.program, detail);
    if (!err) err = bd_chooser_create(g->context, &choose, &g->chooser, detail);
    if (!err) err = bd_chooser_run(g->chooser, &use, detail);
    if (!err) bd_ray_counts_add(&g->out->rays, bd_chooser_rays(g->chooser));
    return err;
}

static enum bd_err run_native(struct gather *g, struct bd_err_detail *detail)
{
    const struct bd_gather_fragments_inputs *gather = g->inputs->gather;
    const struct bd_gather_chosen_native_inputs native = {
        .receivers =
            {
                .pass = "gather",
                .askers = bd_fragment_askers(gather),
                .spread = gather->spread,
                .noise = g->out->fine_noise != NULL,
                .seed = g->inputs->seed,
                .bind = bd_multires_light_bind,
                .out = g->out,
            },
        .list = g->inputs->list,
        .rays = g->inputs->rays,
        .visibility = gather->visibility,
    };
    return bd_gather_chosen_native_run(g->context, &native, &g->out->rays, detail);
}

// By loops of the processor, as far as there are any.
static bool is_native(const struct gather *g)
{
    return bd_gather_may_be_native(g->context, g->inputs->gather->visibility) && !g->inputs->choice;
}

enum bd_err bd_gather_chosen_fragments_run(const struct bd_pass_context *context,
                                           const struct bd_gather_chosen_fragments_inputs *inputs,
                                           struct bd_multires_light **out,
                                           struct bd_err_detail *detail)
{
    struct gather g = {.context = context, .inputs = inputs, .out = inputs->gather->into};
    enum bd_err err = BD_ERR_OK;
    if (!g.out)
        err = bd_multires_light_create(context->gpu, &inputs->gather->fragments->layout,
                                       bd_fragment_vectors(inputs->gather), &g.out, detail);
    if (!err && inputs->noise && !inputs->gather->into)
        err = bd_multires_light_add_noise(context->gpu, g.out, detail);
    if (!err) err = is_native(&g) ? run_native(&g, detail) : run(&g, detail);
    bd_chooser_destroy(context->gpu, &g.chooser);
    if (err && !inputs->gather->into) bd_multires_light_destroy(context->gpu, &g.out);
    if (!err) *out = g.out;
    return err;
}
