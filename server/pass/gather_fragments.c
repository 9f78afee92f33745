#include "pass/gather_fragments.h"

#include "pass/gather_native.h"
#include "pass/kernels.h"
#include "shared/bindings.h"
#include "shared/gather_fragments.h"
#include "shared/vpl.h"

#define GROUPS_MAX        65535u // of one dispatch
// The irradiance vector takes as long again as the sum.
#define VECTOR_UNITS 2.0

struct gather {
    const struct bd_pass_context *context;
    const struct bd_gather_fragments_inputs *inputs;
    const struct bd_program *program;
    struct bd_view view;
    struct bd_multires_light *out;
    bool fine;                               // the texture of level 0, or the stack
    uint32_t first_fragment, fragment_count; // of the visit by list
    uint32_t ranges_done;                    // of VPLs, over all lists
    struct bd_segments *segments;            // of a slice; NULL without visibility
};

// --- what both visits share -------------------------------------------------------------------

static struct bd_bindings bind_common(const struct gather *g,
                                      const struct bd_gather_fragments_args *args)
{
    struct bd_bindings bindings = {
        .textures[BD_UNIT_BLOCK_REPRESENTATIVE] = {.tex = g->inputs->discontinuity->representative},
        .uniforms[BD_UNIFORM_VIEW] = {&g->view, sizeof g->view},
        .uniforms[BD_UNIFORM_MULTIRES] = {&g->out->layout, sizeof g->out->layout},
        .uniforms[BD_UNIFORM_ARGS] = {args, sizeof *args},
    };
    bd_gbuffer_bind(g->inputs->gbuffer, &bindings);
    bd_bind_image(&bindings, 0, g->fine ? g->out->fine : g->out->coarse, true, true);
    bd_bind_image(&bindings, 1, g->fine ? g->out->fine_vector : g->out->coarse_vector, true, true);
    return bindings;
}

static void bind_vpls(const struct bd_vpl_list *list, struct bd_bindings *bindings)
{
    bindings->arrays[BD_UNIT_VPLS] = list->vpls;
    bindings->arrays[BD_UNIT_VPL_QUADS] = list->quads;
}

// Where no block is split into pixels, nothing is interpolated from theirs, and nobody asks for it.
static bool has_vector(const struct gather *g)
{
    return (g->fine ? g->out->fine_vector : g->out->coarse_vector) != NULL;
}

static double units_per_vpl(const struct gather *g)
{
    return has_vector(g) ? VECTOR_UNITS : 1;
}

// Pixels are not split: nobody asks for their spread.
static struct bd_program_source with_defines(const struct gather *g,
                                             struct bd_program_source source)
{
    if (g->inputs->near_patches) bd_define(&source.defines, "BD_VPL_PATCH", 1);
    if (has_vector(g)) bd_define(&source.defines, "BD_VECTOR", 1);
    if (g->inputs->spread && !g->fine) bd_define(&source.defines, "BD_SPREAD", 1);
    if (g->fine) bd_define(&source.defines, "BD_FINE", 1);
    if (g->segments) bd_define(&source.defines, "BD_VISIBLE", 1);
    return source;
}

// Calls `visit` for every range of VPLs, in the order of the sums.
static enum bd_err
for_each_range(struct gather *g,
               enum bd_err (*visit)(struct gather *g, const struct bd_vpl_list *list,
                                    uint32_t first, uint32_t count, struct bd_err_detail *detail),
               struct bd_err_detail *detail)
{
    g->ranges_done = 0;
    for (uint32_t l = 0; l < g->inputs->list_count; l++) {
        const struct bd_vpl_list *list = g->inputs->lists[l];
        for (uint32_t at = 0; at < list->count; at += BD_VPLS_PER_SUM) {
            uint32_t left = list->count - at;
            enum bd_err err =
                visit(g, list, at, left < BD_VPLS_PER_SUM ? left : BD_VPLS_PER_SUM, detail);
            if (err) return err;
            g->ranges_done++;
        }
    }
    return BD_ERR_OK;
}

// Fragments of the level 0 texture, or of the stack.
static uint32_t fragments_of(const struct bd_fragments *fragments, bool fine)
{
    return fine ? fragments->level_count[0] : fragments->count - fragments->level_count[0];
}

// --- the list -----------------------------------------------------------------------------------

static uint32_t fragments_of_slice(const struct gather *g, double units_per_fragment, uint32_t left)
{
    uint32_t group[3];
    bd_program_group_size(g->program, group);
    double groups = bd_slicer_units(g->context->slicer) / (units_per_fragment * group[0]);
    uint32_t whole = groups < 1 ? 1 : groups > GROUPS_MAX ? GROUPS_MAX : (uint32_t)groups;
    return left / group[0] < whole ? left : whole * group[0];
}

struct bd_askers bd_fragment_askers(const struct bd_gather_fragments_inputs *inputs)
{
    return (struct bd_askers){
        .viewpoint = inputs->viewpoint,
        .space = &inputs->scene->space,
        .gbuffer = inputs->gbuffer,
        .near_patches = inputs->near_patches,
        .fragments = inputs->fragments,
        .discontinuity = inputs->discontinuity,
        .finest_level = inputs->finest_level,
        .vector = inputs->vector,
    };
}

// What the fragments of the slice see of the range.
static enum bd_err look(const struct gather *g, const struct bd_vpl_list *list,
                        const struct bd_gather_fragments_args *args, struct bd_err_detail *detail)
{
    const struct bd_askers askers = bd_fragment_askers(g->inputs);
    const struct bd_askers_slice slice =
        bd_askers_of_list(args->first_fragment, args->fragment_count);
    enum bd_err err = bd_choose_all(g->context, &askers, &slice, list, args->first_vpl,
                                    args->vpl_count, g->inputs->visibility, g->segments, detail);
    bd_slicer_work(g->context->slicer, "gather_fragments");
    return err;
}

static enum bd_err visit_list(struct gather *g, const struct bd_vpl_list *list, uint32_t first_vpl,
                              uint32_t vpl_count, struct bd_err_detail *detail)
{
    const struct bd_fragments *fragments = g->inputs->fragments;
    const uint32_t end = g->first_fragment + g->fragment_count;
    double units_per_fragment = vpl_count * units_per_vpl(g);
    bd_slicer_work(g->context->slicer, "gather_fragments");
    uint32_t group[3];
    bd_program_group_size(g->program, group);
    for (uint32_t at = g->first_fragment; at < end;) {
        uint32_t count = fragments_of_slice(g, units_per_fragment, end - at);
        if (g->segments && count > bd_choose_all_max(vpl_count))
            count = bd_choose_all_max(vpl_count);
        const struct bd_gather_fragments_args args = {
            .first_fragment = at,
            .fragment_count = count,
            .is_first = g->ranges_done == 0,
            .finest_level = g->inputs->finest_level,
            .first_vpl = first_vpl,
            .vpl_count = vpl_count,
            .words_per_receiver = bd_divided_up(vpl_count, 32),
        };
        enum bd_err err = g->segments ? look(g, list, &args, detail) : BD_ERR_OK;
        if (err) return err;
        struct bd_bindings bindings = bind_common(g, &args);
        bind_vpls(list, &bindings);
        bd_bind_storage(&bindings, BD_STORAGE_FRAGMENTS, fragments->list, true, false);
        if (g->segments)
            bd_bind_storage(&bindings, BD_STORAGE_OCCLUDED, g->segments->occluded, true, false);
        bd_gpu_pass_begin(g->context->gpu, "gather");
        bd_gpu_dispatch(g->context->gpu, g->program, &bindings, (count + group[0] - 1) / group[0],
                        1, 1);
        bd_gpu_pass_end(g->context->gpu);
        err = bd_slicer_checkpoint(g->context->slicer, units_per_fragment * count);
        if (err) return err;
        at += count;
    }
    return BD_ERR_OK;
}

// Fragments of level 0, or the others, which come first.
static enum bd_err gather_list(struct gather *g, bool fine, struct bd_err_detail *detail)
{
    const struct bd_fragments *fragments = g->inputs->fragments;
    g->fine = fine;
    g->first_fragment = fine ? fragments->level_first[0] : 0;
    g->fragment_count = fragments_of(fragments, fine);
    if (g->fragment_count == 0) return BD_ERR_OK;
    const struct bd_program_source source = with_defines(
        g, (struct bd_program_source){.compute = "pass/gather_fragments/gather_fragments.comp"});
    struct bd_program *program;
    enum bd_err err = bd_program_get(g->context->gpu, &source, &program, detail);
    if (err) return err;
    g->program = program;
    return for_each_range(g, visit_list, detail);
}

// --- the mask -----------------------------------------------------------------------------------

// The depth of the mask is in front of that of the gather (depth is reversed).
#define DEPTH_OF_MASK   1.0f
#define DEPTH_OF_GATHER 0.5f

static void draw_over_all(const struct gather *g, const struct bd_program *program,
                          const struct bd_bindings *bindings, enum bd_draw_depth depth)
{
    const struct bd_draw draw = {
        .program = program,
        .bindings = *bindings,
        .index_count = 3,
        .instance_count = 1,
        .depth = depth,
    };
    bd_gpu_draw(g->context->gpu, &draw);
}

static enum bd_err draw_mask(const struct gather *g, bool fine, struct bd_err_detail *detail)
{
    struct bd_program_source source = {.vertex = "pass/gather_fragments/level.vert",
                                       .fragment = "pass/gather_fragments/mask.frag"};
    if (fine) bd_define(&source.defines, "BD_FINE", 1);
    struct bd_program *program;
    enum bd_err err = bd_program_get(g->context->gpu, &source, &program, detail);
    if (err) return err;
    const struct bd_gather_fragments_args args = {.depth = DEPTH_OF_MASK};
    struct bd_bindings bindings = {
        .storage[BD_STORAGE_FRAGMENT_MASKS] = {.buf = g->inputs->fragments->masks, .read = true},
        .uniforms[BD_UNIFORM_MULTIRES] = {&g->out->layout, sizeof g->out->layout},
        .uniforms[BD_UNIFORM_ARGS] = {&args, sizeof args},
    };
    draw_over_all(g, program, &bindings, BD_DRAW_DEPTH_WRITE);
    return BD_ERR_OK;
}

static enum bd_err visit_target(struct gather *g, bool fine, const struct bd_vpl_list *list,
                                uint32_t first_vpl, uint32_t vpl_count)
{
    const struct bd_tex_desc *desc = bd_tex_desc(fine ? g->out->fine : g->out->coarse);
    const struct bd_gather_fragments_args args = {
        .is_first = g->ranges_done == 0,
        .finest_level = g->inputs->finest_level,
        .first_vpl = first_vpl,
        .vpl_count = vpl_count,
        .depth = DEPTH_OF_GATHER,
    };
    struct bd_bindings bindings = bind_common(g, &args);
    bind_vpls(list, &bindings);
    // What is behind the mask costs nothing; on the average over rows that is known.
    double units_per_row = (double)fragments_of(g->inputs->fragments, fine) * vpl_count *
                           units_per_vpl(g) / desc->height_px;
    bd_slicer_work(g->context->slicer, "gather_fragments drawn");
    for (uint32_t row = 0; row < desc->height_px;) {
        uint32_t rows = bd_slicer_rows(g->context->slicer, units_per_row, desc->height_px - row);
        bd_gpu_target_rows(g->context->gpu, row, rows);
        draw_over_all(g, g->program, &bindings, BD_DRAW_DEPTH_TEST);
        enum bd_err err = bd_slicer_checkpoint(g->context->slicer, units_per_row * rows);
        if (err) return err;
        row += rows;
    }
    return BD_ERR_OK;
}

static enum bd_err visit_fine(struct gather *g, const struct bd_vpl_list *list, uint32_t first_vpl,
                              uint32_t vpl_count, struct bd_err_detail *detail)
{
    (void)detail;
    return visit_target(g, true, list, first_vpl, vpl_count);
}

static enum bd_err visit_coarse(struct gather *g, const struct bd_vpl_list *list,
                                uint32_t first_vpl, uint32_t vpl_count,
                                struct bd_err_detail *detail)
{
    (void)detail;
    return visit_target(g, false, list, first_vpl, vpl_count);
}

static enum bd_err gather_behind_mask(struct gather *g, bool fine, struct bd_err_detail *detail)
{
    g->fine = fine;
    if (fragments_of(g->inputs->fragments, fine) == 0) return BD_ERR_OK;
    struct bd_program_source source = with_defines(
        g, (struct bd_program_source){.vertex = "pass/gather_fragments/level.vert",
                                      .fragment = "pass/gather_fragments/gather_fragments.frag"});
    const struct bd_tex_desc *size = bd_tex_desc(fine ? g->out->fine : g->out->coarse);
    const struct bd_tex_desc desc = {
        .name = "mask of fragments",
        .format = BD_FORMAT_DEPTH32F,
        .width_px = size->width_px,
        .height_px = size->height_px,
    };
    struct bd_target target = {0};
    struct bd_program *program;
    enum bd_err err = bd_program_get(g->context->gpu, &source, &program, detail);
    if (!err) err = bd_tex_create(g->context->gpu, &desc, &target.depth.tex, detail);
    if (err) return err;
    g->program = program;
    bd_gpu_pass_begin(g->context->gpu, "gather");
    bd_gpu_target_begin(g->context->gpu, &target);
    err = draw_mask(g, fine, detail);
    if (!err) err = for_each_range(g, fine ? visit_fine : visit_coarse, detail);
    bd_gpu_target_end(g->context->gpu);
    bd_gpu_pass_end(g->context->gpu);
    bd_tex_destroy(g->context->gpu, &target.depth.tex);
    return err;
}

// --- the pass -----------------------------------------------------------------------------------

static enum bd_err gather_all(struct gather *g, struct bd_err_detail *detail)
{
    bool by_list = g->inputs->visit == BD_FRAGMENT_VISIT_LIST || g->inputs->visibility;
    enum bd_err (*gather)(struct gather * g, bool fine, struct bd_err_detail *detail) =
        by_list ? gather_list : gather_behind_mask;
    enum bd_err err = gather(g, true, detail);
    return err ? err : gather(g, false, detail);
}

static enum bd_err gather_on_device(struct gather *g, struct bd_err_detail *detail)
{
    struct bd_gpu *gpu = g->context->gpu;
    enum bd_err err = BD_ERR_OK;
    const struct bd_askers askers = bd_fragment_askers(g->inputs);
    if (g->inputs->visibility)
        err = bd_choose_all_room(gpu, &askers, g->inputs->lists, g->inputs->list_count,
                                 &g->segments, detail);
    if (!err) err = gather_all(g, detail);
    if (!err && g->segments) bd_ray_counts_add(&g->out->rays, g->segments->traced);
    bd_segments_destroy(gpu, &g->segments);
    return err;
}

// --- the processor ------------------------------------------------------------------------------

static enum bd_err gather_native(const struct gather *g, struct bd_err_detail *detail)
{
    const struct bd_gather_native_inputs native = {
        .receivers =
            {
                .pass = "gather",
                .askers = bd_fragment_askers(g->inputs),
                .spread = g->inputs->spread,
                .bind = bd_multires_light_bind,
                .out = g->out,
            },
        .lists = g->inputs->lists,
        .list_count = g->inputs->list_count,
        .visibility = g->inputs->visibility,
    };
    return bd_gather_native_run(g->context, &native, &g->out->rays, detail);
}

static bool is_native(const struct gather *g)
{
    return bd_gather_may_be_native(g->context, g->inputs->visibility) &&
           g->inputs->visit == BD_FRAGMENT_VISIT_LIST;
}

enum bd_light_vectors bd_fragment_vectors(const struct bd_gather_fragments_inputs *inputs)
{
    if (!inputs->vector) return BD_LIGHT_VECTORS_NONE;
    return inputs->finest_level > 0 ? BD_LIGHT_VECTORS_OF_BLOCKS : BD_LIGHT_VECTORS_ALL;
}

enum bd_err bd_gather_fragments_run(const struct bd_pass_context *context,
                                    const struct bd_gather_fragments_inputs *inputs,
                                    struct bd_multires_light **out, struct bd_err_detail *detail)
{
    struct gather g = {
        .context = context,
        .inputs = inputs,
        .view = bd_viewpoint_uniform(inputs->viewpoint, &inputs->scene->space),
    };
    enum bd_err err = BD_ERR_OK;
    if (inputs->into)
        g.out = inputs->into;
    else
        err = bd_multires_light_create(context->gpu, &inputs->fragments->layout,
                                       bd_fragment_vectors(inputs), &g.out, detail);
    if (!err) err = is_native(&g) ? gather_native(&g, detail) : gather_on_device(&g, detail);
    if (err) {
        if (!inputs->into) bd_multires_light_destroy(context->gpu, &g.out);
        return err;
    }
    *out = g.out;
    return BD_ERR_OK;
}
