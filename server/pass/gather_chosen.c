#include "pass/gather_chosen.h"

#include "pass/kernels.h"
#include "shared/bindings.h"

struct gather {
    const struct bd_pass_context *context;
    const struct bd_gather_chosen_inputs *inputs;
    const struct bd_program *program;
    struct bd_chooser *chooser;
    struct bd_indirect *out;
};

static enum bd_err gather_slice(const struct gather *g, const struct bd_askers_slice *slice,
                                struct bd_asking *asking)
{
    bd_bind_image(&asking->bindings, 0, g->out->irradiance, false, true);
    bd_bind_image(&asking->bindings, 1, g->out->glossy, false, true);
    bd_bind_image(&asking->bindings, 2, g->out->noise, false, true);
    bd_bind_image(&asking->bindings, 3, g->out->noise_glossy, false, true);
    bd_slicer_work(g->context->slicer, "gather chosen");
    bd_gpu_pass_begin(g->context->gpu, bd_gather_pass(g->inputs->gather));
    bd_askers_dispatch(g->context->gpu, g->program, asking);
    bd_gpu_pass_end(g->context->gpu);
    const double pixels = (double)slice->tile.width * slice->tile.height;
    return bd_slicer_checkpoint(g->context->slicer, pixels * g->inputs->rays);
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

static enum bd_err create_out(struct gather *g, struct bd_fault *fault)
{
    const struct bd_gather_inputs *gather = g->inputs->gather;
    enum bd_err err =
        bd_indirect_create(g->context->gpu, gather->viewpoint, gather->glossy, &g->out, fault);
    struct bd_tex_desc desc = {
        .name = "noise of indirect irradiance",
        .format = BD_FORMAT_RGBA32F,
        .width_px = gather->viewpoint->width_px,
        .height_px = gather->viewpoint->height_px,
    };
    if (!err) err = bd_tex_create(g->context->gpu, &desc, &g->out->noise, fault);
    desc.name = "noise of indirect glossy";
    if (!err && gather->glossy)
        err = bd_tex_create(g->context->gpu, &desc, &g->out->noise_glossy, fault);
    return err;
}

static enum bd_err run(struct gather *g, struct bd_fault *fault)
{
    const struct bd_gather_inputs *gather = g->inputs->gather;
    const struct bd_chooser_inputs choose = {
        .askers = bd_gather_askers(gather),
        .list = g->inputs->list,
        .rays = g->inputs->rays,
        .seed = g->inputs->seed,
        .glossy = gather->glossy,
        .visibility = gather->visibility,
    };
    struct bd_defines defines = {0};
    if (gather->glossy) bd_define(&defines, "BD_GLOSSY", 1);
    enum bd_err err = create_out(g, fault);
    if (!err)
        err = bd_compute_get(g->context->gpu, "pass/gather/chosen.comp", &defines, &g->program,
                             fault);
    if (!err) err = bd_chooser_create(g->context, &choose, &g->chooser, fault);
    if (!err) err = gather_all(g, fault);
    if (!err) g->out->rays = bd_chooser_rays(g->chooser);
    return err;
}

enum bd_err bd_gather_chosen_run(const struct bd_pass_context *context,
                                 const struct bd_gather_chosen_inputs *inputs,
                                 struct bd_indirect **out, struct bd_fault *fault)
{
    struct gather g = {.context = context, .inputs = inputs};
    enum bd_err err = run(&g, fault);
    bd_chooser_destroy(context->gpu, &g.chooser);
    if (err && g.out) bd_indirect_destroy(context->gpu, &g.out);
    *out = g.out;
    return err;
}
