#include "pass/gather.h"

#include <math.h>
#include <stdlib.h>

#include "base/assert.h"
#include "pass/gather_native.h"
#include "pass/kernels.h"
#include "shared/bindings.h"
#include "shared/gather.h"
#include "shared/vpl.h"

#define GLOSSY_UNITS      4.0 // one evaluation of the whole BRDF against a diffuse one

struct gather {
    const struct bd_pass_context *context;
    const struct bd_gather_inputs *inputs;
    const struct bd_program *program;
    struct bd_view view;
    struct bd_segments *segments; // of a tile; NULL without visibility
    const char *kind;             // of work
    struct bd_indirect *out;
};

static void dispatch(const struct gather *g, const struct bd_vpl_list *list,
                     const struct bd_gather_args *args)
{
    struct bd_bindings bindings = {0};
    bd_gbuffer_bind(g->inputs->gbuffer, &bindings);
    bindings.arrays[BD_UNIT_VPLS] = list->vpls;
    bindings.arrays[BD_UNIT_VPL_QUADS] = list->quads;
    bindings.images[0].tex = g->out->irradiance;
    bindings.images[0].read = bindings.images[0].write = true;
    bindings.images[1].tex = g->out->glossy;
    bindings.images[1].read = bindings.images[1].write = g->out->glossy != NULL;
    if (g->segments) {
        bindings.storage[BD_STORAGE_OCCLUDED].buf = g->segments->occluded;
        bindings.storage[BD_STORAGE_OCCLUDED].read = true;
    }
    bindings.uniforms[BD_UNIFORM_VIEW].bytes = &g->view;
    bindings.uniforms[BD_UNIFORM_VIEW].size_bytes = sizeof g->view;
    bindings.uniforms[BD_UNIFORM_ARGS].bytes = args;
    bindings.uniforms[BD_UNIFORM_ARGS].size_bytes = sizeof *args;
    uint32_t group[3];
    bd_program_group_size(g->program, group);
    bd_gpu_dispatch(g->context->gpu, g->program, &bindings,
                    (args->tile_width_px + group[0] - 1) / group[0],
                    (args->tile_height_px + group[1] - 1) / group[1], 1);
}

// What the pixels of the tile see of the range.
static enum bd_err look(const struct gather *g, const struct bd_vpl_list *list,
                        const struct bd_gather_args *args, struct bd_err_detail *detail)
{
    const struct bd_askers askers = bd_gather_askers(g->inputs);
    const struct bd_askers_slice slice = {
        .tile = {args->tile_x_px, args->tile_y_px, args->tile_width_px, args->tile_height_px}};
    enum bd_err err = bd_choose_all(g->context, &askers, &slice, list, args->first_vpl,
                                    args->vpl_count, g->inputs->visibility, g->segments, detail);
    bd_slicer_work(g->context->slicer, g->kind);
    return err;
}

// Of the slicer's next tile, so that its segments fit.
static double units_of_pixel(const struct gather *g, uint32_t vpl_count)
{
    const double units = vpl_count * (g->inputs->glossy ? GLOSSY_UNITS : 1);
    if (!g->segments) return units;
    return fmax(units, bd_slicer_units(g->context->slicer) / bd_choose_all_max(vpl_count));
}

static enum bd_err gather_range(const struct gather *g, const struct bd_vpl_list *list,
                                uint32_t first_vpl, uint32_t vpl_count, bool first,
                                struct bd_err_detail *detail)
{
    const uint32_t width = g->view.size_px.x, height = g->view.size_px.y;
    struct bd_tile tile = {0};
    enum bd_err err = BD_ERR_OK;
    while (!err && bd_slicer_next_tile(g->context->slicer, units_of_pixel(g, vpl_count), width,
                                       height, &tile)) {
        const struct bd_gather_args args = {
            .tile_x_px = tile.x,
            .tile_y_px = tile.y,
            .tile_width_px = tile.width,
            .tile_height_px = tile.height,
            .first_vpl = first_vpl,
            .vpl_count = vpl_count,
            .is_first = first,
        };
        if (g->segments) err = look(g, list, &args, detail);
        if (err) return err;
        bd_gpu_pass_begin(g->context->gpu, bd_gather_pass(g->inputs));
        dispatch(g, list, &args);
        bd_gpu_pass_end(g->context->gpu);
        const double pixels = (double)tile.width * tile.height;
        err = bd_slicer_checkpoint(g->context->slicer,
                                   pixels * vpl_count * (g->inputs->glossy ? GLOSSY_UNITS : 1));
    }
    return err;
}

static enum bd_err gather_list(const struct gather *g, const struct bd_vpl_list *list, bool *first,
                               struct bd_err_detail *detail)
{
    for (uint32_t at = 0; at < list->count; at += BD_VPLS_PER_SUM) {
        uint32_t left = list->count - at;
        enum bd_err err = gather_range(g, list, at, left < BD_VPLS_PER_SUM ? left : BD_VPLS_PER_SUM,
                                       *first, detail);
        if (err) return err;
        *first = false;
    }
    return BD_ERR_OK;
}

static enum bd_err gather_all(struct gather *g, struct bd_err_detail *detail)
{
    struct bd_program_source source = {.compute = "pass/gather/gather.comp"};
    if (g->inputs->near_patches) bd_define(&source.defines, "BD_VPL_PATCH", 1);
    if (g->inputs->glossy) bd_define(&source.defines, "BD_GLOSSY", 1);
    if (g->segments) bd_define(&source.defines, "BD_VISIBLE", 1);
    if (g->inputs->lobes_alone) bd_define(&source.defines, "BD_LOBES_ALONE", 1);
    struct bd_program *program;
    enum bd_err err = bd_program_get(g->context->gpu, &source, &program, detail);
    if (err) return err;
    g->program = program;
    g->kind = g->inputs->glossy ? "gather glossy" : "gather";
    bd_slicer_work(g->context->slicer, g->kind);
    bool first = true;
    for (uint32_t i = 0; !err && i < g->inputs->list_count; i++)
        err = gather_list(g, g->inputs->lists[i], &first, detail);
    return err;
}

static enum bd_err gather_on_device(struct gather *g, struct bd_err_detail *detail)
{
    struct bd_gpu *gpu = g->context->gpu;
    enum bd_err err = BD_ERR_OK;
    const struct bd_askers askers = bd_gather_askers(g->inputs);
    if (g->inputs->visibility)
        err = bd_choose_all_room(gpu, &askers, g->inputs->lists, g->inputs->list_count,
                                 &g->segments, detail);
    if (!err) err = gather_all(g, detail);
    if (!err && g->segments) bd_ray_counts_add(&g->out->rays, g->segments->traced);
    bd_segments_destroy(gpu, &g->segments);
    return err;
}

static void bind_outputs(const void *user, struct bd_bindings *bindings)
{
    const struct bd_indirect *out = user;
    bd_bind_image(bindings, 0, out->irradiance, false, true);
    bd_bind_image(bindings, 1, out->glossy, false, true);
}

static enum bd_err gather_native(const struct gather *g, struct bd_err_detail *detail)
{
    const struct bd_gather_native_inputs native = {
        .receivers =
            {
                .pass = bd_gather_pass(g->inputs),
                .askers = bd_gather_askers(g->inputs),
                .glossy = g->inputs->glossy,
                .bind = bind_outputs,
                .out = g->out,
            },
        .lists = g->inputs->lists,
        .list_count = g->inputs->list_count,
        .visibility = g->inputs->visibility,
    };
    return bd_gather_native_run(g->context, &native, &g->out->rays, detail);
}

struct bd_askers bd_gather_askers(const struct bd_gather_inputs *inputs)
{
    return (struct bd_askers){
        .viewpoint = inputs->viewpoint,
        .space = &inputs->scene->space,
        .gbuffer = inputs->gbuffer,
        .near_patches = inputs->near_patches,
        .lobes_alone = inputs->lobes_alone,
    };
}

enum bd_err bd_gather_run(const struct bd_pass_context *context,
                          const struct bd_gather_inputs *inputs, struct bd_indirect **out,
                          struct bd_err_detail *detail)
{
    struct gather g = {
        .context = context,
        .inputs = inputs,
        .view = bd_viewpoint_uniform(inputs->viewpoint, &inputs->scene->space),
    };
    enum bd_err err =
        bd_indirect_create(context->gpu, inputs->viewpoint, inputs->glossy, &g.out, detail);
    const bool is_native = bd_gather_may_be_native(context, inputs->visibility);
    if (!err) err = is_native ? gather_native(&g, detail) : gather_on_device(&g, detail);
    if (err) {
        bd_indirect_destroy(context->gpu, &g.out);
        return err;
    }
    *out = g.out;
    return BD_ERR_OK;
}

enum bd_err bd_indirect_create(struct bd_gpu *gpu, const struct bd_viewpoint *viewpoint,
                               bool glossy, struct bd_indirect **out, struct bd_err_detail *detail)
{
    struct bd_indirect *indirect = *out = calloc(1, sizeof **out);
    BD_ASSERT(indirect);
    indirect->fragment_count = (uint64_t)viewpoint->width_px * viewpoint->height_px;
    struct bd_tex_desc desc = {
        .name = "indirect irradiance",
        .format = BD_FORMAT_RGBA32F,
        .width_px = viewpoint->width_px,
        .height_px = viewpoint->height_px,
    };
    enum bd_err err = bd_tex_create(gpu, &desc, &indirect->irradiance, detail);
    desc.name = "indirect glossy";
    if (!err && glossy) err = bd_tex_create(gpu, &desc, &indirect->glossy, detail);
    if (err) bd_indirect_destroy(gpu, out);
    return err;
}

void bd_indirect_destroy(struct bd_gpu *gpu, struct bd_indirect **indirect)
{
    if (!*indirect) return;
    bd_tex_destroy(gpu, &(*indirect)->irradiance);
    bd_tex_destroy(gpu, &(*indirect)->glossy);
    bd_tex_destroy(gpu, &(*indirect)->gathered);
    bd_tex_destroy(gpu, &(*indirect)->vector);
    bd_tex_destroy(gpu, &(*indirect)->noise);
    bd_tex_destroy(gpu, &(*indirect)->noise_glossy);
    bd_tex_destroy(gpu, &(*indirect)->rough);
    bd_tex_destroy(gpu, &(*indirect)->noise_rough);
    bd_irradiance_cells_destroy(&(*indirect)->cells);
    free(*indirect);
    *indirect = NULL;
}

uint64_t bd_indirect_bytes(const struct bd_indirect *indirect)
{
    const struct bd_tex *textures[] = {
        indirect->irradiance, indirect->glossy,       indirect->gathered, indirect->vector,
        indirect->noise,      indirect->noise_glossy, indirect->rough,    indirect->noise_rough};
    uint64_t bytes = indirect->cells ? bd_irradiance_cells_bytes(indirect->cells) : 0;
    for (size_t i = 0; i < sizeof textures / sizeof *textures; i++)
        if (textures[i]) bytes += bd_tex_bytes(textures[i]);
    return bytes;
}
