#include "pass/discontinuity.h"

#include <math.h>
#include <stdlib.h>

#include "base/assert.h"
#include "pass/kernels.h"
#include "shared/bindings.h"
#include "shared/discontinuity.h"

_Static_assert(BD_DEPTH_TEST_MINMAX == BD_TEST_RANGE, "C and GLSL agree");
_Static_assert(BD_DEPTH_TEST_DERIVATIVE == BD_TEST_JUMP, "C and GLSL agree");
_Static_assert(BD_DEPTH_TEST_OFF == BD_TEST_NONE, "C and GLSL agree");
_Static_assert(BD_DEPTH_TEST_STEP == BD_TEST_STEP, "C and GLSL agree");
_Static_assert(BD_NORMAL_TEST_MINMAX == BD_TEST_RANGE, "C and GLSL agree");
_Static_assert(BD_NORMAL_TEST_CHORD == BD_TEST_JUMP, "C and GLSL agree");
_Static_assert(BD_NORMAL_TEST_OFF == BD_TEST_NONE, "C and GLSL agree");

// One block of any kernel in the slicer's unit, an evaluation of a VPL: about what the dearest
// take.
#define UNITS_PER_BLOCK 40.0

// Measures of one level. Two of these take turns: a level reads one and writes the other.
struct pyramid {
    struct bd_tex *depth;        // RG32F: greatest, negative least; or R32F: greatest slope
    struct bd_tex *normal;       // RGBA32F: greatest components; or R32F: greatest chord
    struct bd_tex *normal_least; // RGBA32F: negative least components; NULL for chords
};

struct work {
    const struct bd_pass_context *context;
    const struct bd_discontinuity_inputs *inputs;
    enum bd_depth_test depth_test;
    enum bd_normal_test normal_test;
    struct bd_view view;
    struct bd_discontinuity_args args;
    struct pyramid pyramids[2];
    // R32UI stack, what blocks are by themselves: where no neighbours are asked that is what they
    // are, and there is none beside the flags.
    struct bd_tex *own;
    double recorded_units;
    struct bd_discontinuity *out;
};

// --- textures -----------------------------------------------------------------------------

static enum bd_err create_texture(struct bd_gpu *gpu, const char *name, enum bd_format format,
                                  uint32_t width_px, uint32_t height_px, struct bd_tex **out,
                                  struct bd_err_detail *detail)
{
    const struct bd_tex_desc desc = {
        .name = name, .format = format, .width_px = width_px, .height_px = height_px};
    return bd_tex_create(gpu, &desc, out, detail);
}

static enum bd_err create_stacks(struct work *w, struct bd_err_detail *detail)
{
    struct bd_gpu *gpu = w->context->gpu;
    const enum bd_format format = BD_FORMAT_R32UI;
    uint32_t width, height;
    bd_multires_stack_size(&w->args.multires, &width, &height);
    enum bd_err err =
        create_texture(gpu, "block flags", format, width, height, &w->out->flags, detail);
    if (!err)
        err = create_texture(gpu, "block representatives", format, width, height,
                             &w->out->representative, detail);
    if (!err && w->args.neighbour_count > 0)
        err = create_texture(gpu, "block own tests", format, width, height, &w->own, detail);
    return err;
}

// Only what the tests read.
static enum bd_err create_pyramid(const struct work *w, uint32_t level, struct pyramid *pyramid,
                                  struct bd_err_detail *detail)
{
    struct bd_gpu *gpu = w->context->gpu;
    const struct bd_multires_level size = w->args.multires.levels[level];
    bool depth_range = w->depth_test == BD_DEPTH_TEST_MINMAX;
    bool normal_range = w->normal_test == BD_NORMAL_TEST_MINMAX;
    enum bd_err err = BD_ERR_OK;
    if (w->depth_test != BD_DEPTH_TEST_OFF)
        err = create_texture(gpu, "depth pyramid", depth_range ? BD_FORMAT_RG32F : BD_FORMAT_R32F,
                             size.columns, size.rows, &pyramid->depth, detail);
    if (!err && w->normal_test != BD_NORMAL_TEST_OFF)
        err =
            create_texture(gpu, "normal pyramid", normal_range ? BD_FORMAT_RGBA32F : BD_FORMAT_R32F,
                           size.columns, size.rows, &pyramid->normal, detail);
    if (!err && normal_range)
        err = create_texture(gpu, "normal pyramid, least", BD_FORMAT_RGBA32F, size.columns,
                             size.rows, &pyramid->normal_least, detail);
    return err;
}

static enum bd_err create_pyramids(struct work *w, struct bd_err_detail *detail)
{
    enum bd_err err = BD_ERR_OK;
    for (uint32_t level = 1; !err && level < 3 && level < w->args.multires.level_count; level++)
        err = create_pyramid(w, level, &w->pyramids[level - 1], detail);
    return err;
}

static void destroy_work(struct work *w)
{
    struct bd_gpu *gpu = w->context->gpu;
    for (int i = 0; i < 2; i++) {
        bd_tex_destroy(gpu, &w->pyramids[i].depth);
        bd_tex_destroy(gpu, &w->pyramids[i].normal);
        bd_tex_destroy(gpu, &w->pyramids[i].normal_least);
    }
    bd_tex_destroy(gpu, &w->own);
}

// --- bindings -----------------------------------------------------------------------------

static void bind_seen(const struct work *w, struct bd_bindings *bindings)
{
    const struct bd_rsm *rsm = w->inputs->rsm;
    if (rsm) {
        bindings->textures[BD_UNIT_RSM_POSITION].tex = rsm->position;
        bindings->textures[BD_UNIT_RSM_NORMAL].tex = rsm->normals;
        bindings->uniforms[BD_UNIFORM_VIEW].bytes = &w->view;
        bindings->uniforms[BD_UNIFORM_VIEW].size_bytes = sizeof w->view;
    } else {
        bd_gbuffer_bind(w->inputs->gbuffer, bindings);
    }
}

static void bind_measured(const struct work *w, const struct pyramid *to,
                          struct bd_bindings *bindings)
{
    bd_bind_image(bindings, BD_IMAGE_WORDS, w->own ? w->own : w->out->flags, true, true);
    bd_bind_image(bindings, BD_IMAGE_DEPTH_MEASURES, to->depth, false, true);
    bd_bind_image(bindings, BD_IMAGE_NORMAL_MEASURES, to->normal, false, true);
    bd_bind_image(bindings, BD_IMAGE_NORMAL_LEAST_MEASURES, to->normal_least, false, true);
}

static void bind_finer(const struct pyramid *from, struct bd_bindings *bindings)
{
    bindings->textures[BD_UNIT_FINER_DEPTH].tex = from->depth;
    bindings->textures[BD_UNIT_FINER_NORMAL].tex = from->normal;
    bindings->textures[BD_UNIT_FINER_NORMAL_LEAST].tex = from->normal_least;
}

// --- kernels ------------------------------------------------------------------------------

static enum bd_err get_program(const struct work *w, const char *compute, bool measures, bool seen,
                               const struct bd_program **out, struct bd_err_detail *detail)
{
    struct bd_program_source source = {.compute = compute};
    if (measures) bd_define(&source.defines, "BD_DEPTH_TEST", (int32_t)w->depth_test);
    if (measures) bd_define(&source.defines, "BD_NORMAL_TEST", (int32_t)w->normal_test);
    if (seen && w->inputs->rsm) bd_define(&source.defines, "BD_RSM", 1);
    if (seen && measures && w->inputs->settings.geometric_normals)
        bd_define(&source.defines, "BD_GEOMETRIC_NORMALS", 1);
    struct bd_program *program = NULL;
    enum bd_err err = bd_program_get(w->context->gpu, &source, &program, detail);
    *out = program;
    return err;
}

// Ends a slice when one's worth of work is recorded: levels are many, and most are small.
static enum bd_err note_work(struct work *w, double units)
{
    w->recorded_units += units;
    if (w->recorded_units < bd_slicer_units(w->context->slicer)) return BD_ERR_OK;
    enum bd_err err = bd_slicer_checkpoint(w->context->slicer, w->recorded_units);
    w->recorded_units = 0;
    return err;
}

static enum bd_err run_level(struct work *w, const struct bd_program *program,
                             struct bd_bindings *bindings, uint32_t level)
{
    const uint32_t width = w->args.multires.levels[level].columns;
    const uint32_t height = w->args.multires.levels[level].rows;
    const double units_per_row = UNITS_PER_BLOCK * width;
    w->args.level = level;
    uint32_t group[3];
    bd_program_group_size(program, group);
    bindings->uniforms[BD_UNIFORM_ARGS].bytes = &w->args;
    bindings->uniforms[BD_UNIFORM_ARGS].size_bytes = sizeof w->args;
    bd_slicer_work(w->context->slicer, "discontinuity");
    for (uint32_t row = 0; row < height;) {
        uint32_t rows = bd_slicer_rows(w->context->slicer, units_per_row, height - row);
        w->args.first_row = row;
        w->args.row_count = rows;
        bd_gpu_dispatch(w->context->gpu, program, bindings, (width + group[0] - 1) / group[0],
                        (rows + group[1] - 1) / group[1], 1);
        enum bd_err err = note_work(w, units_per_row * rows);
        if (err) return err;
        row += rows;
    }
    return BD_ERR_OK;
}

static enum bd_err measure(struct work *w, struct bd_err_detail *detail)
{
    const struct bd_program *program;
    enum bd_err err =
        get_program(w, "pass/discontinuity/measure.comp", true, true, &program, detail);
    if (err) return err;
    struct bd_bindings bindings = {0};
    bind_seen(w, &bindings);
    bind_measured(w, &w->pyramids[0], &bindings);
    bd_bind_image(&bindings, BD_IMAGE_REPRESENTATIVES, w->out->representative, false, true);
    return run_level(w, program, &bindings, 1);
}

static enum bd_err reduce(struct work *w, struct bd_err_detail *detail)
{
    const struct bd_program *program;
    enum bd_err err =
        get_program(w, "pass/discontinuity/reduce.comp", true, false, &program, detail);
    for (uint32_t level = 2; !err && level < w->args.multires.level_count; level++) {
        struct bd_bindings bindings = {0};
        bind_finer(&w->pyramids[level % 2], &bindings);
        bind_measured(w, &w->pyramids[(level + 1) % 2], &bindings);
        err = run_level(w, program, &bindings, level);
    }
    return err;
}

static enum bd_err settle(struct work *w, struct bd_err_detail *detail)
{
    const struct bd_program *program;
    enum bd_err err =
        get_program(w, "pass/discontinuity/settle.comp", false, false, &program, detail);
    for (uint32_t level = 1; !err && level < w->args.multires.level_count; level++) {
        struct bd_bindings bindings = {0};
        bindings.textures[BD_UNIT_OWN_TESTS].tex = w->own;
        bd_bind_image(&bindings, BD_IMAGE_WORDS, w->out->flags, true, true);
        err = run_level(w, program, &bindings, level);
    }
    return err;
}

// Level 1 has them from the pixels that it measured.
static enum bd_err find_representatives(struct work *w, struct bd_err_detail *detail)
{
    const struct bd_program *program;
    enum bd_err err =
        get_program(w, "pass/discontinuity/representative.comp", false, true, &program, detail);
    if (err) return err;
    struct bd_bindings bindings = {0};
    bind_seen(w, &bindings);
    bindings.textures[BD_UNIT_BLOCK_FLAGS].tex = w->out->flags;
    bd_bind_image(&bindings, BD_IMAGE_REPRESENTATIVES, w->out->representative, false, true);
    for (uint32_t level = 2; !err && level < w->args.multires.level_count; level++)
        err = run_level(w, program, &bindings, level);
    return err;
}

static enum bd_err run(struct work *w, struct bd_err_detail *detail)
{
    enum bd_err err = create_stacks(w, detail);
    if (err || w->args.multires.level_count == 1) return err;
    err = create_pyramids(w, detail);
    if (!err) err = measure(w, detail);
    if (!err) err = reduce(w, detail);
    if (!err && w->own) err = settle(w, detail);
    if (!err) err = find_representatives(w, detail);
    return err;
}

// --- the pass -----------------------------------------------------------------------------

static float depth_scale(const struct bd_viewpoint *viewpoint, const struct bd_view *view)
{
    return viewpoint->orthographic ? fmaxf(view->axis_x.w, view->axis_y.w) : 0;
}

static uint32_t neighbour_count(enum bd_neighbourhood neighbourhood)
{
    switch (neighbourhood) {
    case BD_NEIGHBOURHOOD_DIAGONAL:
        return 4;
    case BD_NEIGHBOURHOOD_ADJACENT:
        return 8;
    default:
        return 0;
    }
}

static struct work work_of(const struct bd_pass_context *context,
                           const struct bd_discontinuity_inputs *inputs)
{
    const struct bd_discontinuity_settings *settings = &inputs->settings;
    const struct bd_viewpoint *viewpoint = inputs->viewpoint;
    struct work w = {
        .context = context,
        .inputs = inputs,
        .depth_test = isinf(settings->depth_threshold) ? BD_DEPTH_TEST_OFF : settings->depth_test,
        .normal_test =
            isinf(settings->normal_threshold) ? BD_NORMAL_TEST_OFF : settings->normal_test,
        .view = bd_viewpoint_uniform(viewpoint, inputs->space),
        .args.multires = bd_multires_layout_of(viewpoint->width_px, viewpoint->height_px,
                                               settings->coarsest_side),
        .args.face = inputs->face,
        .args.neighbour_count = neighbour_count(settings->neighbourhood),
        .args.depth_threshold = (float)settings->depth_threshold,
        .args.normal_threshold = (float)settings->normal_threshold,
    };
    w.args.depth_scale = depth_scale(viewpoint, &w.view);
    return w;
}

enum bd_err bd_discontinuity_run(const struct bd_pass_context *context,
                                 const struct bd_discontinuity_inputs *inputs,
                                 struct bd_discontinuity **out, struct bd_err_detail *detail)
{
    BD_ASSERT(!inputs->gbuffer != !inputs->rsm);
    BD_ASSERT(inputs->settings.depth_threshold >= 0 && inputs->settings.normal_threshold >= 0);
    struct work w = work_of(context, inputs);
    w.out = calloc(1, sizeof *w.out);
    BD_ASSERT(w.out);
    w.out->layout = w.args.multires;
    enum bd_err err = run(&w, detail);
    destroy_work(&w);
    if (err) {
        bd_discontinuity_destroy(context->gpu, &w.out);
        return err;
    }
    *out = w.out;
    return BD_ERR_OK;
}

void bd_discontinuity_destroy(struct bd_gpu *gpu, struct bd_discontinuity **discontinuity)
{
    if (!*discontinuity) return;
    bd_tex_destroy(gpu, &(*discontinuity)->flags);
    bd_tex_destroy(gpu, &(*discontinuity)->representative);
    free(*discontinuity);
    *discontinuity = NULL;
}

uint64_t bd_discontinuity_bytes(const struct bd_discontinuity *discontinuity)
{
    return bd_tex_bytes(discontinuity->flags) + bd_tex_bytes(discontinuity->representative);
}
