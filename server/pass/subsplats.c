#include "pass/subsplats.h"

#include <math.h>

#include "base/assert.h"
#include "pass/kernels.h"
#include "shared/bindings.h"
#include "shared/subsplats.h"

// Of the slicer, one for each diffuse evaluation of a VPL by a gather.
#define UNITS_PER_POINT 4.0
#define UNITS_PER_PIXEL 40.0
#define GROUPS_MAX      65535u
#define VPLS_PER_GATHER 1024u // as in pass/gather: it sets the order of the sums
#define NEVER_SPLIT     3e38f
#define ALWAYS_SPLIT    (-1.0f)
#define BLOCK_LIMIT_MIN 64u

_Static_assert(BD_SUBSPLAT_GROUP == BD_SUBSPLAT_RUN, "a dispatch of the scan is sized by either");

struct list {
    struct bd_buf *blocks, *masks;
};

struct work {
    const struct bd_pass_context *context;
    const struct bd_subsplats_inputs *inputs;
    const struct bd_program *test, *scan, *split, *pixels;
    struct bd_view view;
    struct bd_tex *fine, *coarse, *slope_x, *slope_y; // RGBA32F, the multiresolution image
    struct bd_buf *split_masks, *sums, *counts;
    struct list lists[2]; // the one that is worked through, from the second on, and the next
    uint32_t capacity;    // of each
    struct bd_subsplats_args args;
    struct bd_subsplat_counts *sum;
};

// --- textures and buffers -----------------------------------------------------------------------

static enum bd_err create_image(struct bd_gpu *gpu, const char *name, uint32_t width_px,
                                uint32_t height_px, struct bd_tex **out,
                                struct bd_err_detail *detail)
{
    static const float none[4];
    const struct bd_tex_desc desc = {
        .name = name, .format = BD_FORMAT_RGBA32F, .width_px = width_px, .height_px = height_px};
    enum bd_err err = bd_tex_create(gpu, &desc, out, detail);
    if (!err) bd_tex_clear(gpu, *out, none);
    return err;
}

static enum bd_err create_images(struct work *w, struct bd_err_detail *detail)
{
    struct bd_gpu *gpu = w->context->gpu;
    const struct bd_multires_layout *layout = &w->inputs->start->layout;
    uint32_t wide, high;
    bd_multires_stack_size(layout, &wide, &high);
    enum bd_err err = create_image(gpu, "glossy light of pixels", layout->width_px,
                                   layout->height_px, &w->fine, detail);
    if (!err) err = create_image(gpu, "glossy light of blocks", wide, high, &w->coarse, detail);
    if (!err) err = create_image(gpu, "its slope along x", wide, high, &w->slope_x, detail);
    if (!err) err = create_image(gpu, "its slope along y", wide, high, &w->slope_y, detail);
    return err;
}

// Numbers in all levels of the prefix sum.
static size_t scan_size(uint32_t blocks)
{
    size_t numbers = blocks;
    do {
        blocks = bd_divided_up(blocks, BD_SUBSPLAT_RUN);
        numbers += blocks;
    } while (blocks > 1);
    return numbers;
}

// The first list goes from the coarsest level down: blocks, then pixels.
static uint32_t block_count(const struct bd_fragments *start)
{
    return start->count - start->level_count[0];
}

// No list is longer than there are pixels in the blocks.
static uint32_t capacity_of(const struct bd_subsplats_inputs *inputs)
{
    uint64_t pixels = 0;
    for (uint32_t k = 1; k < inputs->start->layout.level_count; k++)
        pixels += (uint64_t)inputs->start->level_count[k] << 2 * k;
    uint64_t limit = inputs->block_limit > BLOCK_LIMIT_MIN ? inputs->block_limit : BLOCK_LIMIT_MIN;
    return (uint32_t)(pixels < BLOCK_LIMIT_MIN ? BLOCK_LIMIT_MIN : pixels < limit ? pixels : limit);
}

static enum bd_err create_buffers(struct work *w, struct bd_err_detail *detail)
{
    struct bd_gpu *gpu = w->context->gpu;
    const size_t number = sizeof(uint32_t), mask_bytes = number * BD_SUBSPLAT_WORDS * w->capacity;
    enum bd_err err =
        bd_buf_create(gpu, "subsplats to split", mask_bytes, NULL, &w->split_masks, detail);
    if (!err)
        err = bd_buf_create(gpu, "subsplat scan", number * scan_size(w->capacity), NULL, &w->sums,
                            detail);
    if (!err)
        err = bd_buf_create(gpu, "subsplat counts", sizeof(struct bd_subsplats_counts), NULL,
                            &w->counts, detail);
    for (int i = 0; !err && i < 2; i++) {
        err = bd_buf_create(gpu, "subsplats", number * w->capacity, NULL, &w->lists[i].blocks,
                            detail);
        if (!err)
            err =
                bd_buf_create(gpu, "subsplat masks", mask_bytes, NULL, &w->lists[i].masks, detail);
    }
    return err;
}

static void destroy_work(struct work *w)
{
    struct bd_gpu *gpu = w->context->gpu;
    bd_tex_destroy(gpu, &w->fine);
    bd_tex_destroy(gpu, &w->coarse);
    bd_tex_destroy(gpu, &w->slope_x);
    bd_tex_destroy(gpu, &w->slope_y);
    bd_buf_destroy(gpu, &w->split_masks);
    bd_buf_destroy(gpu, &w->sums);
    bd_buf_destroy(gpu, &w->counts);
    for (int i = 0; i < 2; i++) {
        bd_buf_destroy(gpu, &w->lists[i].blocks);
        bd_buf_destroy(gpu, &w->lists[i].masks);
    }
}

// --- bindings -----------------------------------------------------------------------------------

static void bind_images(const struct work *w, struct bd_bindings *bindings, bool write)
{
    bd_bind_image(bindings, BD_IMAGE_GLOSSY_FINE, w->fine, true, write);
    bd_bind_image(bindings, BD_IMAGE_GLOSSY_COARSE, w->coarse, true, write);
    bd_bind_image(bindings, BD_IMAGE_GLOSSY_SLOPE_X, w->slope_x, true, write);
    bd_bind_image(bindings, BD_IMAGE_GLOSSY_SLOPE_Y, w->slope_y, true, write);
}

// `list`: NULL for the first one.
static struct bd_bindings bind(const struct work *w, const struct list *list)
{
    const struct bd_multires_layout *layout = &w->inputs->start->layout;
    struct bd_bindings bindings = {
        .uniforms[BD_UNIFORM_VIEW] = {&w->view, sizeof w->view},
        .uniforms[BD_UNIFORM_MULTIRES] = {layout, sizeof *layout},
        .uniforms[BD_UNIFORM_ARGS] = {&w->args, sizeof w->args},
    };
    bd_bind_storage(&bindings, BD_STORAGE_SUBSPLATS, list ? list->blocks : w->inputs->start->list,
                    true, false);
    bd_bind_storage(&bindings, BD_STORAGE_SPLIT_MASKS, w->split_masks, true, true);
    bd_bind_storage(&bindings, BD_STORAGE_SUBSPLAT_SCAN, w->sums, true, true);
    bd_bind_storage(&bindings, BD_STORAGE_SUBSPLAT_COUNTS, w->counts, true, true);
    return bindings;
}

static void bind_receivers(const struct work *w, const struct bd_vpl_list *vpls,
                           struct bd_bindings *bindings)
{
    bd_gbuffer_bind(w->inputs->gbuffer, bindings);
    bind_images(w, bindings, true);
    bindings->textures[BD_UNIT_ALL_IRRADIANCE].tex = w->inputs->irradiance;
    bindings->arrays[BD_UNIT_VPLS] = vpls->vpls;
    bindings->arrays[BD_UNIT_VPL_QUADS] = vpls->quads;
}

static void bind_test(const struct work *w, const struct bd_vpl_list *vpls, const struct list *list,
                      struct bd_bindings *bindings)
{
    bind_receivers(w, vpls, bindings);
    // The first list has no masks; what is bound in their place is not read.
    bd_bind_storage(bindings, BD_STORAGE_SUBSPLAT_MASKS, list ? list->masks : w->lists[1].masks,
                    true, false);
}

// --- one list -----------------------------------------------------------------------------------

// Over the list, with `units` for a block, in slices.
static enum bd_err run_slices(struct work *w, const struct bd_program *program,
                              const struct bd_bindings *bindings, double units)
{
    const uint32_t end = w->args.list_block_count;
    bd_slicer_work(w->context->slicer, "subsplats");
    for (uint32_t at = 0; at < end;) {
        double fit = bd_slicer_units(w->context->slicer) / (units * BD_SUBSPLAT_GROUP);
        uint32_t groups = fit < 1 ? 1 : fit > GROUPS_MAX ? GROUPS_MAX : (uint32_t)fit;
        uint32_t most = groups * BD_SUBSPLAT_GROUP, count = end - at < most ? end - at : most;
        w->args.first_block = at;
        w->args.end_block = at + count;
        bd_gpu_dispatch(w->context->gpu, program, bindings, bd_divided_up(count, BD_SUBSPLAT_GROUP),
                        1, 1);
        enum bd_err err = bd_slicer_checkpoint(w->context->slicer, units * count);
        if (err) return err;
        at += count;
    }
    return BD_ERR_OK;
}

static void run_scan(struct work *w, const struct bd_bindings *bindings)
{
    uint32_t numbers = w->args.list_block_count;
    w->args.scan_level = 0;
    do {
        numbers = bd_divided_up(numbers, BD_SUBSPLAT_RUN);
        bd_gpu_dispatch(w->context->gpu, w->scan, bindings,
                        bd_divided_up(numbers, BD_SUBSPLAT_GROUP), 1, 1);
        w->args.scan_level++;
    } while (numbers > 1);
}

static void run_split(struct work *w, struct bd_bindings bindings, const struct list *next)
{
    bd_bind_storage(&bindings, BD_STORAGE_NEXT_SUBSPLATS, next->blocks, false, true);
    bd_bind_storage(&bindings, BD_STORAGE_NEXT_MASKS, next->masks, false, true);
    bd_gpu_dispatch(w->context->gpu, w->split, &bindings,
                    bd_divided_up(w->args.list_block_count, BD_SUBSPLAT_GROUP), 1, 1);
}

// What has found no room is drawn as it is.
static enum bd_err draw_left_over(struct work *w, const struct bd_bindings *bindings, double units)
{
    const float limit = w->args.threshold_absolute;
    const uint32_t members = w->args.members;
    w->args.threshold_absolute = NEVER_SPLIT;
    w->args.members = BD_SUBSPLAT_LEFT_OVER;
    enum bd_err err = run_slices(w, w->test, bindings, units);
    w->args.threshold_absolute = limit;
    w->args.members = members;
    w->sum->is_limited = true;
    return err;
}

// Tests a list and makes the next one, which may stay empty; `now` = the counts after it.
static enum bd_err run_list(struct work *w, const struct bd_vpl_list *vpls, const struct list *list,
                            const struct list *next, double units, struct bd_subsplats_counts *now)
{
    struct bd_bindings bindings = bind(w, list), test = bindings;
    bind_test(w, vpls, list, &test);
    w->args.members = list ? BD_SUBSPLAT_MASKED : BD_SUBSPLAT_ALL;
    enum bd_err err = run_slices(w, w->test, &test, units);
    if (err) return err;
    run_scan(w, &bindings);
    run_split(w, bindings, next);
    err = bd_buf_read(w->context->gpu, w->counts, 0, now, sizeof *now);
    if (err || now->next_wanted <= w->capacity) return err;
    err = draw_left_over(w, &test, units);
    return err ? err : bd_buf_read(w->context->gpu, w->counts, 0, now, sizeof *now);
}

// The lists of a batch, from a range of the first one on.
static enum bd_err work_through(struct work *w, const struct bd_vpl_list *vpls)
{
    const struct list *list = NULL;
    double units = UNITS_PER_POINT * 4 * w->args.vpl_count;
    struct bd_subsplats_counts before = {0}, now = {0};
    bd_buf_clear(w->context->gpu, w->counts);
    while (w->args.list_block_count > 0) {
        const struct list *next = list == &w->lists[0] ? &w->lists[1] : &w->lists[0];
        enum bd_err err = run_list(w, vpls, list, next, units, &now);
        if (err) return err;
        uint32_t splits = now.split - before.split;
        units = now.next_fitting > 0 ? UNITS_PER_POINT * 16 * splits / now.next_fitting : 0;
        before = now;
        list = next;
        w->args.list_first_block = 0;
        w->args.list_block_count = now.next_fitting;
    }
    w->sum->tested += now.tested;
    w->sum->split += now.split;
    w->sum->drawn += now.drawn;
    return BD_ERR_OK;
}

// --- all of them --------------------------------------------------------------------------------

// So many of the first list from `first` on that all their pixels have room in a list, and at least
// a group.
static uint32_t part_of_start(const struct work *w, uint32_t first)
{
    const struct bd_fragments *start = w->inputs->start;
    uint64_t room = w->capacity;
    uint32_t end = first;
    for (uint32_t k = start->layout.level_count; k-- > 1;) {
        const uint32_t level_end = start->level_first[k] + start->level_count[k];
        if (level_end <= end) continue;
        uint64_t fit = room >> 2 * k;
        uint32_t count = fit < level_end - end ? (uint32_t)fit : level_end - end;
        end += count;
        room -= (uint64_t)count << 2 * k;
        if (end < level_end) break;
    }
    const uint32_t least = first + BLOCK_LIMIT_MIN, all = block_count(start);
    if (end < least) end = least < all ? least : all;
    return end - first;
}

static enum bd_err run_batch(struct work *w, const struct bd_vpl_list *vpls, uint32_t first_vpl)
{
    const uint32_t left = vpls->count - first_vpl, count = block_count(w->inputs->start);
    enum bd_err err = BD_ERR_OK;
    for (uint32_t at = 0; !err && at < count;) {
        uint32_t part = part_of_start(w, at);
        w->args.list_first_block = at;
        w->args.list_block_count = part;
        w->args.first_vpl = first_vpl;
        w->args.vpl_count = left < BD_SUBSPLAT_VPLS ? left : BD_SUBSPLAT_VPLS;
        err = work_through(w, vpls);
        at += part;
    }
    return err;
}

static enum bd_err run_blocks(struct work *w, const struct bd_vpl_list *vpls)
{
    enum bd_err err = BD_ERR_OK;
    for (uint32_t at = 0; !err && at < vpls->count; at += BD_SUBSPLAT_VPLS)
        err = run_batch(w, vpls, at);
    return err;
}

static enum bd_err run_pixels(struct work *w, const struct bd_vpl_list *vpls)
{
    const uint32_t first = block_count(w->inputs->start), count = w->inputs->start->level_count[0];
    enum bd_err err = BD_ERR_OK;
    for (uint32_t at = 0; !err && at < vpls->count; at += VPLS_PER_GATHER) {
        const uint32_t left = vpls->count - at;
        w->args.list_first_block = first;
        w->args.list_block_count = count;
        w->args.first_vpl = at;
        w->args.vpl_count = left < VPLS_PER_GATHER ? left : VPLS_PER_GATHER;
        struct bd_bindings bindings = bind(w, NULL);
        bind_receivers(w, vpls, &bindings);
        err = run_slices(w, w->pixels, &bindings, UNITS_PER_POINT * w->args.vpl_count);
    }
    w->sum->tested += (uint64_t)count * vpls->count;
    w->sum->drawn += (uint64_t)count * vpls->count;
    return err;
}

static enum bd_err run_all(struct work *w)
{
    for (uint32_t l = 0; l < w->inputs->list_count; l++) {
        enum bd_err err = run_pixels(w, w->inputs->lists[l]);
        if (!err && block_count(w->inputs->start) > 0) err = run_blocks(w, w->inputs->lists[l]);
        if (err) return err;
    }
    return BD_ERR_OK;
}

static enum bd_err get_programs(struct work *w, struct bd_err_detail *detail)
{
    struct bd_defines defines = {0};
    bd_define(&defines, "BD_GLOSSY", 1);
    if (w->inputs->near_patches) bd_define(&defines, "BD_VPL_PATCH", 1);
    enum bd_err err =
        bd_compute_get(w->context->gpu, "pass/subsplats/pixels.comp", &defines, &w->pixels, detail);
    if (err || block_count(w->inputs->start) == 0) return err;
    err = bd_compute_get(w->context->gpu, "pass/subsplats/test.comp", &defines, &w->test, detail);
    if (!err)
        err = bd_compute_get(w->context->gpu, "pass/subsplats/scan.comp", NULL, &w->scan, detail);
    if (!err)
        err = bd_compute_get(w->context->gpu, "pass/subsplats/split.comp", NULL, &w->split, detail);
    return err;
}

static enum bd_err spread(struct work *w, struct bd_tex *glossy, struct bd_err_detail *detail)
{
    const struct bd_multires_layout *layout = &w->inputs->start->layout;
    const uint32_t width = layout->width_px, height = layout->height_px;
    const double units_per_row = UNITS_PER_PIXEL * width;
    const struct bd_program *program;
    enum bd_err err =
        bd_compute_get(w->context->gpu, "pass/subsplats/spread.comp", NULL, &program, detail);
    bd_slicer_work(w->context->slicer, "subsplats spread");
    for (uint32_t row = 0; !err && row < height;) {
        uint32_t rows = bd_slicer_rows(w->context->slicer, units_per_row, height - row);
        struct bd_bindings bindings = {
            .uniforms[BD_UNIFORM_VIEW] = {&w->view, sizeof w->view},
            .uniforms[BD_UNIFORM_MULTIRES] = {layout, sizeof *layout},
            .uniforms[BD_UNIFORM_ARGS] = {&w->args, sizeof w->args},
        };
        w->args.first_row = row;
        w->args.row_count = rows;
        bd_gbuffer_bind(w->inputs->gbuffer, &bindings);
        bind_images(w, &bindings, false);
        bindings.images[BD_IMAGE_GLOSSY].tex = glossy;
        bindings.images[BD_IMAGE_GLOSSY].write = true;
        bd_gpu_dispatch(w->context->gpu, program, &bindings, bd_divided_up(width, 8),
                        bd_divided_up(rows, 8), 1);
        err = bd_slicer_checkpoint(w->context->slicer, units_per_row * rows);
        row += rows;
    }
    return err;
}

static void set_limits(struct work *w)
{
    const struct bd_subsplats_inputs *inputs = w->inputs;
    uint64_t vpls = 0;
    for (uint32_t i = 0; i < inputs->list_count; i++) vpls += inputs->lists[i]->count;
    const double of_mean_vpl = vpls > 0 ? 1 / (M_PI * (double)vpls) : 0;
    const float threshold = (float)inputs->threshold;
    const float in_unit = (float)(inputs->threshold / inputs->scene->space.unit_cd_m2);
    if (inputs->threshold == 0) {
        w->args.threshold_absolute = ALWAYS_SPLIT;
    } else if (inputs->test == BD_RADIANCE_TEST_ABSOLUTE) {
        w->args.threshold_absolute = in_unit;
    } else {
        w->args.threshold_relative = threshold;
        w->args.of_mean_vpl = (float)of_mean_vpl;
    }
}

enum bd_err bd_subsplats_run(const struct bd_pass_context *context,
                             const struct bd_subsplats_inputs *inputs, struct bd_tex **glossy,
                             struct bd_subsplat_counts *counts, struct bd_err_detail *detail)
{
    const struct bd_multires_layout *layout = &inputs->start->layout;
    struct work w = {
        .context = context,
        .inputs = inputs,
        .view = bd_viewpoint_uniform(inputs->viewpoint, &inputs->scene->space),
        .capacity = capacity_of(inputs),
        .sum = counts,
    };
    struct bd_tex *made = NULL;
    w.args.next_block_count_max = w.capacity;
    set_limits(&w);
    *counts = (struct bd_subsplat_counts){0};
    enum bd_err err = create_image(context->gpu, "indirect glossy", layout->width_px,
                                   layout->height_px, &made, detail);
    if (!err) err = create_images(&w, detail);
    if (!err && block_count(inputs->start) > 0) err = create_buffers(&w, detail);
    if (!err) err = get_programs(&w, detail);
    if (!err) err = run_all(&w);
    if (!err) err = spread(&w, made, detail);
    destroy_work(&w);
    if (err) {
        bd_tex_destroy(context->gpu, &made);
        return err;
    }
    *glossy = made;
    return BD_ERR_OK;
}
