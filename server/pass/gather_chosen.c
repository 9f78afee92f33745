#include "pass/gather_chosen.h"

#include <math.h>
#include <stdlib.h>

#include "base/assert.h"
#include "pass/kernels.h"
#include "shared/bindings.h"
#include "shared/choose.h"

#define VPLS_PER_DISPATCH 1024u
#define GROUP_VPLS        8u
// Of a list: more of them take longer to be written than larger ones to be searched.
#define GROUPS_MAX     384u
#define GROUP_VPLS_MAX 16384u // in which a search still ends by itself
// The software device ends all loops of an invocation after 65,535 rounds.
#define ROUNDS_MAX 60000u
#define TILE_BYTES BD_SEGMENTS_BYTES_MAX
#define PICK_BYTES ((size_t)BD_PICK_VEC4S * sizeof(struct bd_vec4))

struct chosen {
    const struct bd_pass_context *context;
    const struct bd_gather_chosen_inputs *inputs;
    const struct bd_gbuffer *gbuffer;
    struct bd_view view;
    const struct bd_vpl_list *list;
    uint32_t group_vpls, group_count, pixels_max;
    const struct bd_program *weigh, *choose, *gather;
    struct bd_buf *prefix, *picks;
    struct bd_segments *segments;
    struct bd_indirect *out;
};

// --- how much at once -------------------------------------------------------------------------

static void lay_out(struct chosen *c)
{
    const uint32_t count = c->list->count;
    c->group_vpls = GROUP_VPLS;
    while (bd_divided_up(count, c->group_vpls) > GROUPS_MAX && c->group_vpls < GROUP_VPLS_MAX)
        c->group_vpls *= 2;
    c->group_count = bd_divided_up(count, c->group_vpls);
    const size_t of_pixel =
        c->group_count * sizeof(float) + c->inputs->rays * (sizeof(struct bd_segment) + PICK_BYTES);
    c->pixels_max = (uint32_t)(TILE_BYTES / of_pixel);
    const size_t pixels = (size_t)c->view.size_px.x * c->view.size_px.y;
    if (c->pixels_max > pixels) c->pixels_max = (uint32_t)pixels;
    // A tile is eight pixels square at least, whatever that takes.
    if (c->pixels_max < 64) c->pixels_max = 64;
}

static enum bd_err make_room(struct chosen *c, struct bd_fault *fault)
{
    struct bd_gpu *gpu = c->context->gpu;
    const size_t pixels = c->pixels_max;
    enum bd_err err = bd_buf_create_unset(
        gpu, "sums over vpls", pixels * c->group_count * sizeof(float), &c->prefix, fault);
    if (!err)
        err = bd_buf_create_unset(gpu, "vpls chosen", pixels * c->inputs->rays * PICK_BYTES,
                                  &c->picks, fault);
    if (!err) err = bd_segments_create(gpu, pixels * c->inputs->rays, &c->segments, fault);
    return err;
}

static enum bd_err get_programs(struct chosen *c, struct bd_fault *fault)
{
    struct bd_defines glossy = {0}, both = {0};
    if (c->inputs->gather->glossy) bd_define(&glossy, "BD_GLOSSY", 1);
    both = glossy;
    if (c->inputs->gather->near_patches) bd_define(&both, "BD_VPL_PATCH", 1);
    struct bd_gpu *gpu = c->context->gpu;
    enum bd_err err = bd_compute_get(gpu, "pass/choose/weigh.comp", &both, &c->weigh, fault);
    if (!err) err = bd_compute_get(gpu, "pass/choose/choose.comp", &both, &c->choose, fault);
    if (!err) err = bd_compute_get(gpu, "pass/gather/chosen.comp", &glossy, &c->gather, fault);
    return err;
}

// --- a tile -----------------------------------------------------------------------------------

static struct bd_choose_args args_of(const struct chosen *c, const struct bd_tile *tile)
{
    return (struct bd_choose_args){
        .tile = {tile->x, tile->y, tile->width, tile->height},
        .vpls = {0, c->list->count, c->group_vpls, c->group_count},
        .rays = {c->inputs->rays, (uint32_t)(c->inputs->seed ^ c->inputs->seed >> 32),
                 c->list->count, 0},
    };
}

static void dispatch(const struct chosen *c, const struct bd_program *program,
                     const struct bd_choose_args *args, struct bd_bindings *bindings)
{
    uint32_t group[3];
    bindings->uniforms[BD_UNIFORM_VIEW].bytes = &c->view;
    bindings->uniforms[BD_UNIFORM_VIEW].size_bytes = sizeof c->view;
    bindings->uniforms[BD_UNIFORM_ARGS].bytes = args;
    bindings->uniforms[BD_UNIFORM_ARGS].size_bytes = sizeof *args;
    bd_program_group_size(program, group);
    bd_gpu_dispatch(c->context->gpu, program, bindings, bd_divided_up(args->tile.z, group[0]),
                    bd_divided_up(args->tile.w, group[1]), 1);
}

static void bind_lights(const struct chosen *c, struct bd_bindings *bindings)
{
    bd_gbuffer_bind(c->gbuffer, bindings);
    bindings->textures[BD_UNIT_GBUFFER_TRIANGLE].tex = c->gbuffer->triangle;
    bindings->arrays[BD_UNIT_VPLS] = c->list->vpls;
    bindings->arrays[BD_UNIT_VPL_QUADS] = c->list->quads;
    bd_bind_storage(bindings, BD_STORAGE_SEGMENTS, c->segments->segments, false, true);
    bd_bind_storage(bindings, BD_STORAGE_PREFIX, c->prefix, true, true);
    bd_bind_storage(bindings, BD_STORAGE_PICKS, c->picks, false, true);
}

static double pixels_of(const struct bd_tile *tile)
{
    return (double)tile->width * tile->height;
}

// A whole number of groups.
static uint32_t vpls_of_dispatch(const struct chosen *c)
{
    return c->group_vpls > VPLS_PER_DISPATCH ? c->group_vpls : VPLS_PER_DISPATCH;
}

// A program for VPLs, or rays, from 0 to `count`: `step` in a dispatch.
struct parts {
    const char *pass;
    const struct bd_program *program;
    uint32_t count, step;
    double units; // of each, at a pixel
};

static enum bd_err run_parts(const struct chosen *c, const struct bd_tile *tile,
                             const struct parts *parts)
{
    struct bd_choose_args args = args_of(c, tile);
    struct bd_bindings bindings = {0};
    bind_lights(c, &bindings);
    enum bd_err err = BD_ERR_OK;
    bd_slicer_work(c->context->slicer, parts->pass);
    for (uint32_t at = 0; !err && at < parts->count; at += parts->step) {
        const uint32_t left = parts->count - at;
        args.vpls.x = at;
        args.vpls.y = left < parts->step ? left : parts->step;
        bd_gpu_pass_begin(c->context->gpu, parts->pass);
        dispatch(c, parts->program, &args, &bindings);
        bd_gpu_pass_end(c->context->gpu);
        err =
            bd_slicer_checkpoint(c->context->slicer, pixels_of(tile) * args.vpls.y * parts->units);
    }
    return err;
}

static enum bd_err weigh(const struct chosen *c, const struct bd_tile *tile)
{
    const struct parts parts = {"weigh", c->weigh, c->list->count, vpls_of_dispatch(c), 1};
    return run_parts(c, tile, &parts);
}

// So many rays that the search for their VPLs, twice for near ones, ends by itself.
static uint32_t rays_of_dispatch(const struct chosen *c)
{
    const uint32_t rounds_of_ray = 2 * (c->group_vpls + 24);
    return rounds_of_ray < ROUNDS_MAX ? ROUNDS_MAX / rounds_of_ray : 1;
}

static enum bd_err choose(const struct chosen *c, const struct bd_tile *tile)
{
    const struct parts parts = {"choose", c->choose, c->inputs->rays, rays_of_dispatch(c),
                                c->group_vpls};
    return run_parts(c, tile, &parts);
}

static enum bd_err look(const struct chosen *c, const struct bd_tile *tile, struct bd_fault *fault)
{
    bd_gpu_pass_begin(c->context->gpu, "visibility");
    enum bd_err err =
        bd_visibility_run(c->context, c->inputs->gather->visibility, c->segments,
                          (size_t)tile->width * tile->height * c->inputs->rays, fault);
    bd_gpu_pass_end(c->context->gpu);
    return err;
}

static enum bd_err gather(const struct chosen *c, const struct bd_tile *tile)
{
    const struct bd_choose_args args = args_of(c, tile);
    struct bd_bindings bindings = {0};
    bd_bind_storage(&bindings, BD_STORAGE_OCCLUDED, c->segments->occluded, true, false);
    bd_bind_storage(&bindings, BD_STORAGE_PICKS, c->picks, true, false);
    bd_bind_image(&bindings, 0, c->out->irradiance, false, true);
    bd_bind_image(&bindings, 1, c->out->glossy, false, true);
    bd_bind_image(&bindings, 2, c->out->noise, false, true);
    bd_bind_image(&bindings, 3, c->out->noise_glossy, false, true);
    bd_slicer_work(c->context->slicer, "gather chosen");
    bd_gpu_pass_begin(c->context->gpu, "gather");
    dispatch(c, c->gather, &args, &bindings);
    bd_gpu_pass_end(c->context->gpu);
    return bd_slicer_checkpoint(c->context->slicer, pixels_of(tile) * c->inputs->rays);
}

// --- all tiles --------------------------------------------------------------------------------

// Of the slicer's next tile, so that what it needs fits, and one dispatch is a slice.
static double units_of_pixel(const struct chosen *c)
{
    return fmax(vpls_of_dispatch(c), bd_slicer_units(c->context->slicer) / c->pixels_max);
}

static enum bd_err gather_tiles(struct chosen *c, struct bd_fault *fault)
{
    struct bd_tile tile = {0};
    enum bd_err err = BD_ERR_OK;
    bd_slicer_work(c->context->slicer, "weigh");
    while (!err && bd_slicer_next_tile(c->context->slicer, units_of_pixel(c), c->view.size_px.x,
                                       c->view.size_px.y, &tile)) {
        err = weigh(c, &tile);
        if (!err) err = choose(c, &tile);
        if (!err) err = look(c, &tile, fault);
        if (!err) err = gather(c, &tile);
        bd_slicer_work(c->context->slicer, "weigh");
    }
    return err;
}

static enum bd_err create_out(struct chosen *c, struct bd_fault *fault)
{
    const struct bd_gather_inputs *gather = c->inputs->gather;
    enum bd_err err =
        bd_indirect_create(c->context->gpu, gather->viewpoint, gather->glossy, &c->out, fault);
    struct bd_tex_desc desc = {
        .name = "noise of indirect irradiance",
        .format = BD_FORMAT_RGBA32F,
        .width_px = gather->viewpoint->width_px,
        .height_px = gather->viewpoint->height_px,
    };
    if (!err) err = bd_tex_create(c->context->gpu, &desc, &c->out->noise, fault);
    desc.name = "noise of indirect glossy";
    if (!err && gather->glossy)
        err = bd_tex_create(c->context->gpu, &desc, &c->out->noise_glossy, fault);
    return err;
}

static enum bd_err run(struct chosen *c, struct bd_fault *fault)
{
    enum bd_err err = create_out(c, fault);
    if (err) return err;
    BD_ASSERT(c->list->count > 0 && c->inputs->rays <= BD_RAYS_CHOSEN_MAX);
    lay_out(c);
    err = get_programs(c, fault);
    if (!err) err = make_room(c, fault);
    if (!err) err = gather_tiles(c, fault);
    if (!err) c->out->rays = c->segments->traced;
    return err;
}

enum bd_err bd_gather_chosen_run(const struct bd_pass_context *context,
                                 const struct bd_gather_chosen_inputs *inputs,
                                 struct bd_indirect **out, struct bd_fault *fault)
{
    const struct bd_gather_inputs *gather = inputs->gather;
    struct chosen c = {
        .context = context,
        .inputs = inputs,
        .list = inputs->list,
        .gbuffer = gather->gbuffer,
        .view = bd_viewpoint_uniform(gather->viewpoint, &gather->scene->space),
    };
    enum bd_err err = run(&c, fault);
    bd_buf_destroy(context->gpu, &c.prefix);
    bd_buf_destroy(context->gpu, &c.picks);
    bd_segments_destroy(context->gpu, &c.segments);
    if (err && c.out) bd_indirect_destroy(context->gpu, &c.out);
    *out = c.out;
    return err;
}
