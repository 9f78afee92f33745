#include "pass/gather_chosen.h"

#include "pass/gather_native.h"
#include "pass/kernels.h"

struct gather {
    const struct bd_pass_context *context;
    const struct bd_gather_chosen_inputs *inputs;
    struct bd_chooser *chooser;
    struct bd_indirect *out;
};

static void bind_outputs(const void *user, struct bd_bindings *bindings)
{
    const struct bd_indirect *out = user;
    bd_bind_image(bindings, 0, out->irradiance, false, true);
    bd_bind_image(bindings, 1, out->glossy, false, true);
    bd_bind_image(bindings, 2, out->noise, false, true);
    bd_bind_image(bindings, 3, out->noise_glossy, false, true);
}

static enum bd_err create_out(struct gather *g, struct bd_err_detail *detail)
{
    const struct bd_gather_inputs *gather = g->inputs->gather;
    enum bd_err err =
        bd_indirect_create(g->context->gpu, gather->viewpoint, gather->glossy, &g->out, detail);
    struct bd_tex_desc desc = {
        .name = "noise of indirect irradiance",
        .format = BD_FORMAT_RGBA32F,
        .width_px = gather->viewpoint->width_px,
        .height_px = gather->viewpoint->height_px,
    };
    if (!err) err = bd_tex_create(g->context->gpu, &desc, &g->out->noise, detail);
    desc.name = "noise of indirect glossy";
    if (!err && gather->glossy)
        err = bd_tex_create(g->context->gpu, &desc, &g->out->noise_glossy, detail);
    return err;
}

static enum bd_err run(struct gather *g, struct bd_err_detail *detail)
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
    enum bd_err err = create_out(g, detail);
    struct bd_chosen_use use = {bd_gather_pass(gather), NULL, bind_outputs, g->out};
    if (!err)
        err = bd_compute_get(g->context->gpu, "pass/gather/chosen.comp", &defines, &use.program,
                             detail);
    if (!err) err = bd_chooser_create(g->context, &choose, &g->chooser, detail);
    if (!err) err = bd_chooser_run(g->chooser, &use, detail);
    if (!err) g->out->rays = bd_chooser_rays(g->chooser);
    return err;
}

static void bind_native(const void *user, struct bd_bindings *bindings)
{
    const struct bd_indirect *out = user;
    bd_bind_image(bindings, 0, out->irradiance, false, true);
    bd_bind_image(bindings, 2, out->noise, false, true);
}

static enum bd_err run_native(struct gather *g, struct bd_err_detail *detail)
{
    const struct bd_gather_inputs *gather = g->inputs->gather;
    enum bd_err err = create_out(g, detail);
    const struct bd_gather_chosen_native_inputs native = {
        .receivers =
            {
                .pass = bd_gather_pass(gather),
                .askers = bd_gather_askers(gather),
                .noise = true,
                .seed = g->inputs->seed,
                .bind = bind_native,
                .out = g->out,
            },
        .list = g->inputs->list,
        .rays = g->inputs->rays,
        .visibility = gather->visibility,
    };
    if (!err) err = bd_gather_chosen_native_run(g->context, &native, &g->out->rays, detail);
    return err;
}

// By loops of the processor, as far as there are any.
static bool is_native(const struct gather *g)
{
    const struct bd_gather_inputs *gather = g->inputs->gather;
    return bd_gather_may_be_native(g->context, gather->visibility) && !gather->glossy;
}

enum bd_err bd_gather_chosen_run(const struct bd_pass_context *context,
                                 const struct bd_gather_chosen_inputs *inputs,
                                 struct bd_indirect **out, struct bd_err_detail *detail)
{
    struct gather g = {.context = context, .inputs = inputs};
    enum bd_err err = is_native(&g) ? run_native(&g, detail) : run(&g, detail);
    bd_chooser_destroy(context->gpu, &g.chooser);
    if (err && g.out) bd_indirect_destroy(context->gpu, &g.out);
    *out = g.out;
    return err;
}
