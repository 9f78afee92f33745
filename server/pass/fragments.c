#include "pass/fragments.h"

#include <inttypes.h>
#include <stdlib.h>

#include "base/assert.h"
#include "pass/kernels.h"
#include "shared/bindings.h"
#include "shared/fragments.h"

// In the slicer's unit, an evaluation of a VPL.
#define UNITS_PER_HALF_TILE 60.0
#define UNITS_PER_PARENT    10.0

_Static_assert(BD_FRAGMENT_GROUP == BD_LIST_GROUP, "slices of lists are of whole groups");

struct work {
    const struct bd_pass_context *context;
    const struct bd_discontinuity_inputs *inputs;
    const struct bd_discontinuity *discontinuity;
    const struct bd_fragments *parents; // whose children are listed
    struct bd_fragments_args args;
    bool lone_pixels;
    struct bd_view view;
    struct bd_buf *masks;   // of what is to be listed; borrowed
    struct bd_buf *reached; // a word for each half tile, of the iterative way
    struct bd_buf *split;   // a word for each fragment that may be split
    struct bd_buf *scan, *summary;
    struct bd_fragments *out;
};

// --- tiles and buffers --------------------------------------------------------------------

// Tiles are numbered from the coarsest level.
static void lay_out_tiles(struct bd_fragments_args *args)
{
    uint32_t tiles = 0;
    for (uint32_t k = args->multires.level_count; k-- > 0;) {
        uint32_t columns = bd_divided_up(args->multires.levels[k].columns, BD_FRAGMENT_TILE_SIDE);
        uint32_t rows = bd_divided_up(args->multires.levels[k].rows, BD_FRAGMENT_TILE_SIDE);
        args->tiles[k] = (struct bd_fragment_tiles){tiles, columns, 2 * tiles, 0};
        tiles += columns * rows;
    }
    args->number_count = tiles;
}

static uint32_t end_half_tile(const struct bd_fragments_args *args, uint32_t level)
{
    return 2 * (level > 0 ? args->tiles[level - 1].first : args->number_count);
}

// Numbers in all levels of the prefix sum.
static size_t scan_size(uint32_t numbers)
{
    size_t all = numbers;
    do {
        numbers = bd_divided_up(numbers, BD_FRAGMENT_SCAN_RUN);
        all += numbers;
    } while (numbers > 1);
    return all;
}

// With a mask of all blocks.
static enum bd_err create_out(struct work *w, struct bd_err_detail *detail)
{
    struct bd_gpu *gpu = w->context->gpu;
    w->out = calloc(1, sizeof *w->out);
    BD_ASSERT(w->out);
    w->out->layout = w->args.multires;
    const size_t mask_bytes = 2 * sizeof(uint32_t) * w->args.number_count;
    enum bd_err err =
        bd_buf_create(gpu, "fragment masks", mask_bytes, NULL, &w->out->masks, detail);
    if (!err)
        err = bd_buf_create(gpu, "fragment dispatch", 4 * sizeof(uint32_t), NULL, &w->out->dispatch,
                            detail);
    return err;
}

static enum bd_err create_scan(struct work *w, struct bd_err_detail *detail)
{
    struct bd_gpu *gpu = w->context->gpu;
    enum bd_err err =
        bd_buf_create(gpu, "fragment scan", sizeof(uint32_t) * scan_size(w->args.number_count),
                      NULL, &w->scan, detail);
    if (!err)
        err = bd_buf_create(gpu, "fragment summary", sizeof(struct bd_fragments_summary), NULL,
                            &w->summary, detail);
    return err;
}

static void destroy_work(struct work *w)
{
    struct bd_gpu *gpu = w->context->gpu;
    bd_buf_destroy(gpu, &w->reached);
    bd_buf_destroy(gpu, &w->split);
    bd_buf_destroy(gpu, &w->scan);
    bd_buf_destroy(gpu, &w->summary);
}

// --- kernels ------------------------------------------------------------------------------

// One invocation for each item of [first, end).
static void dispatch(struct work *w, const struct bd_program *program, struct bd_bindings *bindings,
                     uint32_t first, uint32_t end)
{
    w->args.first_item = first;
    w->args.end_item = end;
    w->args.face = w->inputs->face;
    bindings->uniforms[BD_UNIFORM_ARGS].bytes = &w->args;
    bindings->uniforms[BD_UNIFORM_ARGS].size_bytes = sizeof w->args;
    bd_gpu_dispatch(w->context->gpu, program, bindings,
                    bd_divided_up(end - first, BD_FRAGMENT_GROUP), 1, 1);
}

// Words [first, end) of the mask, in slices. The last slice is left to the next checkpoint.
static enum bd_err run_words(struct work *w, const struct bd_program *program,
                             struct bd_bindings *bindings, double units, uint32_t first,
                             uint32_t end)
{
    enum bd_err err = BD_ERR_OK;
    bd_slicer_work(w->context->slicer, "fragments");
    while (!err && first < end) {
        uint32_t count = bd_list_slice(w->context->slicer, units, end - first);
        dispatch(w, program, bindings, first, first + count);
        first += count;
        if (first < end) err = bd_slicer_checkpoint(w->context->slicer, units * count);
    }
    return err;
}

static void bind_surfaces(const struct work *w, struct bd_bindings *bindings)
{
    bd_gbuffer_bind(w->inputs->gbuffer, bindings);
    bindings->textures[BD_UNIT_BLOCK_REPRESENTATIVE].tex = w->discontinuity->representative;
    bindings->uniforms[BD_UNIFORM_VIEW].bytes = &w->view;
    bindings->uniforms[BD_UNIFORM_VIEW].size_bytes = sizeof w->view;
}

static void bind_classify(const struct work *w, struct bd_bindings *bindings)
{
    const struct bd_rsm *rsm = w->inputs->rsm;
    if (rsm)
        bindings->textures[BD_UNIT_RSM_POSITION].tex = rsm->position;
    else
        bindings->textures[BD_UNIT_GBUFFER_MATERIAL].tex = w->inputs->gbuffer->material;
    if (w->lone_pixels) bind_surfaces(w, bindings);
    if (w->discontinuity->glossy)
        bindings->textures[BD_UNIT_GBUFFER_ALBEDO].tex = w->inputs->gbuffer->albedo;
    bindings->textures[BD_UNIT_LIT].tex = w->discontinuity->lit;
    bindings->textures[BD_UNIT_BLOCK_FLAGS].tex = w->discontinuity->flags;
    bd_bind_storage(bindings, BD_STORAGE_FRAGMENT_MASKS, w->masks, false, true);
    if (w->reached) bd_bind_storage(bindings, BD_STORAGE_REACHED_MASKS, w->reached, true, true);
}

static enum bd_err classify(struct work *w, enum bd_fragment_refinement refinement,
                            struct bd_err_detail *detail)
{
    const struct bd_program *program;
    struct bd_bindings bindings = {0};
    struct bd_defines defines = {0};
    bool iterative = refinement == BD_REFINEMENT_ITERATIVE;
    if (w->lone_pixels) bd_define(&defines, "BD_LONE_PIXELS", 1);
    if (iterative) bd_define(&defines, "BD_ITERATIVE", 1);
    if (w->inputs->rsm) bd_define(&defines, "BD_RSM", 1);
    if (w->args.multires.level_count == 1) bd_define(&defines, "BD_ONE_LEVEL", 1);
    if (w->discontinuity->glossy) bd_define(&defines, "BD_GLOSSY", 1);
    if (w->discontinuity->lit) bd_define(&defines, "BD_UNLIT", 1);
    enum bd_err err =
        bd_compute_get(w->context->gpu, "pass/fragments/classify.comp", &defines, &program, detail);
    if (err) return err;
    bind_classify(w, &bindings);
    if (!iterative)
        return run_words(w, program, &bindings, UNITS_PER_HALF_TILE, 0, 2 * w->args.number_count);
    for (uint32_t k = w->args.multires.level_count; !err && k-- > 0;)
        err = run_words(w, program, &bindings, UNITS_PER_HALF_TILE, w->args.tiles[k].first_word,
                        end_half_tile(&w->args, k));
    return err;
}

static enum bd_err scan(struct work *w, struct bd_err_detail *detail)
{
    const struct bd_program *program;
    enum bd_err err =
        bd_compute_get(w->context->gpu, "pass/fragments/scan.comp", NULL, &program, detail);
    if (err) return err;
    struct bd_bindings bindings = {0};
    bd_bind_storage(&bindings, BD_STORAGE_FRAGMENT_MASKS, w->masks, true, false);
    bd_bind_storage(&bindings, BD_STORAGE_FRAGMENT_SCAN, w->scan, true, true);
    uint32_t numbers = w->args.number_count;
    w->args.scan_level = 0;
    do {
        numbers = bd_divided_up(numbers, BD_FRAGMENT_SCAN_RUN);
        dispatch(w, program, &bindings, 0, numbers);
        w->args.scan_level++;
    } while (numbers > 1);
    return BD_ERR_OK;
}

static void read_counts(const struct bd_fragments_summary *summary, struct bd_fragments *out)
{
    uint32_t end = out->count = summary->fragment_count;
    for (uint32_t k = 0; k < out->layout.level_count; k++) {
        out->level_first[k] = summary->first[k];
        out->level_count[k] = end - summary->first[k];
        end = summary->first[k];
    }
}

static enum bd_err summarize(struct work *w, struct bd_err_detail *detail)
{
    const struct bd_program *program;
    enum bd_err err =
        bd_compute_get(w->context->gpu, "pass/fragments/summary.comp", NULL, &program, detail);
    if (err) return err;
    struct bd_bindings bindings = {0};
    bd_bind_storage(&bindings, BD_STORAGE_FRAGMENT_MASKS, w->masks, true, false);
    bd_bind_storage(&bindings, BD_STORAGE_FRAGMENT_SCAN, w->scan, true, false);
    bd_bind_storage(&bindings, BD_STORAGE_FRAGMENT_SUMMARY, w->summary, false, true);
    bd_bind_storage(&bindings, BD_STORAGE_FRAGMENT_DISPATCH, w->out->dispatch, false, true);
    dispatch(w, program, &bindings, 0, 1);
    struct bd_fragments_summary summary;
    err = bd_buf_read(w->context->gpu, w->summary, 0, &summary, sizeof summary);
    if (!err) read_counts(&summary, w->out);
    return err;
}

static enum bd_err create_list(struct work *w, struct bd_err_detail *detail)
{
    const uint64_t bytes = sizeof(uint32_t) * (uint64_t)(w->out->count ? w->out->count : 1);
    uint64_t max_bytes = bd_gpu_caps(w->context->gpu)->storage_block_max_bytes;
    if (bytes > max_bytes)
        return bd_err_set(detail, BD_ERR_LIMIT, "size",
                          "a picture of %" PRIu32 " fragments; the device's lists hold %" PRIu64,
                          w->out->count, max_bytes / sizeof(uint32_t));
    return bd_buf_create(w->context->gpu, "fragments", bytes, NULL, &w->out->list, detail);
}

static struct bd_bindings bind_places(const struct work *w)
{
    struct bd_bindings bindings = {0};
    bd_bind_storage(&bindings, BD_STORAGE_FRAGMENT_MASKS, w->masks, true, false);
    bd_bind_storage(&bindings, BD_STORAGE_FRAGMENT_SCAN, w->scan, true, false);
    bd_bind_storage(&bindings, BD_STORAGE_FRAGMENT_LIST, w->out->list, false, true);
    return bindings;
}

// Counts what the mask has, and makes room for it.
static enum bd_err find_places(struct work *w, struct bd_err_detail *detail)
{
    enum bd_err err = create_scan(w, detail);
    if (!err) err = scan(w, detail);
    if (!err) err = summarize(w, detail);
    return err ? err : create_list(w, detail);
}

static enum bd_err finish(struct work *w, enum bd_err err, struct bd_fragments **out)
{
    destroy_work(w);
    if (err) {
        bd_fragments_destroy(w->context->gpu, &w->out);
        return err;
    }
    *out = w->out;
    return BD_ERR_OK;
}

// --- by what is seen ----------------------------------------------------------------------

static enum bd_err write_blocks(struct work *w, struct bd_err_detail *detail)
{
    const struct bd_program *program;
    enum bd_err err =
        bd_compute_get(w->context->gpu, "pass/fragments/list.comp", NULL, &program, detail);
    if (err) return err;
    struct bd_bindings bindings = bind_places(w);
    return run_words(w, program, &bindings, UNITS_PER_HALF_TILE, 0, 2 * w->args.number_count);
}

static enum bd_err list_blocks(struct work *w, enum bd_fragment_refinement refinement,
                               struct bd_err_detail *detail)
{
    enum bd_err err = create_out(w, detail);
    if (err) return err;
    w->masks = w->out->masks;
    if (refinement == BD_REFINEMENT_ITERATIVE)
        err = bd_buf_create(w->context->gpu, "reached blocks", bd_buf_size_bytes(w->masks), NULL,
                            &w->reached, detail);
    if (!err) err = classify(w, refinement, detail);
    if (!err) err = find_places(w, detail);
    return err ? err : write_blocks(w, detail);
}

enum bd_err bd_fragments_run(const struct bd_pass_context *context,
                             const struct bd_discontinuity_inputs *inputs,
                             const struct bd_discontinuity *discontinuity,
                             enum bd_fragment_refinement refinement, struct bd_fragments **out,
                             struct bd_err_detail *detail)
{
    struct work w = {
        .context = context,
        .inputs = inputs,
        .discontinuity = discontinuity,
        .args.multires = discontinuity->layout,
    };
    lay_out_tiles(&w.args);
    const uint32_t finest = inputs->settings.finest_level, levels = w.args.multires.level_count;
    w.args.finest_level = finest < levels ? finest : levels - 1;
    w.lone_pixels = inputs->settings.lone_pixels && w.args.finest_level > 0;
    if (w.lone_pixels) w.view = bd_viewpoint_uniform(inputs->viewpoint, inputs->space);
    return finish(&w, list_blocks(&w, refinement, detail), out);
}

// --- by light -----------------------------------------------------------------------------

static enum bd_err mark_children(struct work *w, const struct bd_fragments *first,
                                 const struct bd_light_of_blocks *light,
                                 struct bd_err_detail *detail)
{
    const struct bd_program *program;
    enum bd_err err =
        bd_compute_get(w->context->gpu, "pass/fragments/refine.comp", NULL, &program, detail);
    if (err) return err;
    struct bd_bindings bindings = {
        .textures[BD_UNIT_BLOCK_FLAGS] = {.tex = w->discontinuity->flags},
        .textures[BD_UNIT_FINE] = {.tex = light->irradiance},
        .textures[BD_UNIT_FINE_VECTOR] = {.tex = light->vector},
    };
    bd_bind_storage(&bindings, BD_STORAGE_FRAGMENT_PARENTS, w->parents->list, true, false);
    bd_bind_storage(&bindings, BD_STORAGE_FIRST_MASKS, first->masks, true, false);
    bd_bind_storage(&bindings, BD_STORAGE_FRAGMENT_MASKS, w->masks, false, true);
    return run_words(w, program, &bindings, UNITS_PER_PARENT, 0, w->parents->level_first[0]);
}

static enum bd_err write_children(struct work *w, struct bd_err_detail *detail)
{
    const struct bd_program *program;
    enum bd_err err =
        bd_compute_get(w->context->gpu, "pass/fragments/children.comp", NULL, &program, detail);
    if (err) return err;
    struct bd_bindings bindings = bind_places(w);
    bd_bind_storage(&bindings, BD_STORAGE_FRAGMENT_PARENTS, w->parents->list, true, false);
    bd_bind_storage(&bindings, BD_STORAGE_BLOCK_MASKS, w->out->masks, true, true);
    return run_words(w, program, &bindings, UNITS_PER_PARENT, 0, w->parents->level_first[0]);
}

// From now on a word is one of the parents, which pixels are not: those come last in their list.
static void lay_out_parents(struct work *w)
{
    const uint32_t coarsest = w->args.multires.level_count - 1;
    for (uint32_t k = 0; k < coarsest; k++)
        w->args.tiles[k].first_word = w->parents->level_first[k + 1];
    w->args.tiles[coarsest].first_word = 0;
    w->args.number_count = bd_divided_up(w->parents->level_first[0], 2);
}

static enum bd_err list_children(struct work *w, const struct bd_fragments *first,
                                 const struct bd_light_of_blocks *light,
                                 struct bd_err_detail *detail)
{
    enum bd_err err = create_out(w, detail);
    if (err) return err;
    lay_out_parents(w);
    err = bd_buf_create(w->context->gpu, "children of fragments",
                        2 * sizeof(uint32_t) * w->args.number_count, NULL, &w->split, detail);
    if (err) return err;
    w->masks = w->split;
    err = mark_children(w, first, light, detail);
    if (!err) err = find_places(w, detail);
    return err || w->out->count == 0 ? err : write_children(w, detail);
}

enum bd_err bd_fragments_refine(const struct bd_pass_context *context,
                                const struct bd_discontinuity_inputs *inputs,
                                const struct bd_discontinuity *discontinuity,
                                const struct bd_fragments *first,
                                const struct bd_fragments *parents,
                                const struct bd_light_of_blocks *light, double threshold,
                                struct bd_fragments **out, struct bd_err_detail *detail)
{
    BD_ASSERT_CMP(parents->count, >, parents->level_count[0]);
    struct work w = {
        .context = context,
        .inputs = inputs,
        .discontinuity = discontinuity,
        .parents = parents,
        .args.multires = discontinuity->layout,
        .args.spread_threshold = (float)threshold,
    };
    lay_out_tiles(&w.args);
    return finish(&w, list_children(&w, first, light, detail), out);
}

void bd_fragments_destroy(struct bd_gpu *gpu, struct bd_fragments **fragments)
{
    if (!*fragments) return;
    bd_buf_destroy(gpu, &(*fragments)->masks);
    bd_buf_destroy(gpu, &(*fragments)->list);
    bd_buf_destroy(gpu, &(*fragments)->dispatch);
    free(*fragments);
    *fragments = NULL;
}

uint64_t bd_fragments_bytes(const struct bd_fragments *fragments)
{
    return bd_buf_size_bytes(fragments->masks) + bd_buf_size_bytes(fragments->list) +
           bd_buf_size_bytes(fragments->dispatch);
}
