#include "pass/choose.h"

#include <math.h>
#include <stdlib.h>

#include "base/assert.h"
#include "pass/kernels.h"
#include "pass/vpl_groups.h"
#include "shared/bindings.h"
#include "shared/vpl.h"

#define VPLS_PER_DISPATCH 1024u
#define GROUP_VPLS        16u
// Of a list: more of them take longer to be written than larger ones to be searched.
#define GROUPS_MAX     384u
#define GROUP_VPLS_MAX 16384u // in which a search still ends by itself
// The software device ends all loops of an invocation after 65,535 rounds.
#define ROUNDS_MAX 60000u
#define PICK_BYTES ((size_t)BD_PICK_VEC4S * sizeof(struct bd_vec4))

static void bind_vpls(const struct bd_vpl_list *list, struct bd_bindings *bindings)
{
    bindings->arrays[BD_UNIT_VPLS] = list->vpls;
    bindings->arrays[BD_UNIT_VPL_QUADS] = list->quads;
    if (list->groups) bindings->arrays[BD_UNIT_VPL_GROUPS] = list->groups;
}

// --- all ----------------------------------------------------------------------------------------

static uint32_t words_of(uint32_t vpl_count)
{
    return (vpl_count + 31) / 32;
}

uint32_t bd_choose_all_max(uint32_t vpl_count)
{
    const size_t of_receiver = 32 * (size_t)words_of(vpl_count) * sizeof(struct bd_segment);
    return (uint32_t)(BD_SEGMENTS_BYTES_MAX / of_receiver);
}

enum bd_err bd_choose_all_room(struct bd_gpu *gpu, const struct bd_askers *askers,
                               const struct bd_vpl_list *const *lists, uint32_t list_count,
                               struct bd_segments **out, struct bd_err_detail *detail)
{
    uint32_t most = 0;
    for (uint32_t i = 0; i < list_count; i++)
        if (lists[i]->count > most) most = lists[i]->count;
    if (most > BD_VPLS_PER_SUM) most = BD_VPLS_PER_SUM;
    // One more: a buffer is of something, where nobody asks, too.
    const uint64_t asked = bd_askers_count_all(askers) * words_of(most) * 32 + 32;
    return bd_segments_create(gpu, asked < BD_SEGMENTS_MAX ? (size_t)asked : BD_SEGMENTS_MAX, out,
                              detail);
}

void bd_asking_set_maps(const struct bd_visibility_inputs *visibility,
                        const struct bd_vpl_list *list, struct bd_asking *asking)
{
    const struct bd_shadow_maps_of_list maps = bd_imperfect_maps_of(visibility->maps, list);
    asking->args.first_map = maps.first;
    asking->args.vpls_per_map = maps.vpls_each;
}

static enum bd_err ask_all(const struct bd_pass_context *context, const struct bd_askers *askers,
                           const struct bd_askers_slice *slice, const struct bd_vpl_list *list,
                           uint32_t first_vpl, uint32_t vpl_count,
                           const struct bd_visibility_inputs *visibility,
                           struct bd_segments *segments, struct bd_err_detail *detail)
{
    struct bd_defines defines = {0};
    const struct bd_program *program;
    bd_askers_define(askers, &defines);
    if (askers->near_patches) bd_define(&defines, "BD_VPL_PATCH", 1);
    enum bd_err err =
        bd_compute_get(context->gpu, "pass/choose/all.comp", &defines, &program, detail);
    if (err) return err;
    struct bd_asking asking;
    bd_askers_bind(askers, slice, &asking);
    asking.args.first_item = first_vpl;
    asking.args.item_count = vpl_count;
    asking.args.words_per_receiver = words_of(vpl_count);
    bd_asking_set_maps(visibility, list, &asking);
    bind_vpls(list, &asking.bindings);
    bd_bind_storage(&asking.bindings, BD_STORAGE_SEGMENTS, segments->segments, false, true);
    bd_askers_dispatch(context->gpu, program, &asking);
    return BD_ERR_OK;
}

enum bd_err bd_choose_all(const struct bd_pass_context *context, const struct bd_askers *askers,
                          const struct bd_askers_slice *slice, const struct bd_vpl_list *list,
                          uint32_t first_vpl, uint32_t vpl_count,
                          const struct bd_visibility_inputs *visibility,
                          struct bd_segments *segments, struct bd_err_detail *detail)
{
    const size_t receivers = bd_askers_count(askers, slice);
    BD_ASSERT_CMP(receivers, <=, bd_choose_all_max(vpl_count));
    bd_gpu_pass_begin(context->gpu, "choose");
    enum bd_err err =
        ask_all(context, askers, slice, list, first_vpl, vpl_count, visibility, segments, detail);
    bd_gpu_pass_end(context->gpu);
    if (err) return err;
    bd_gpu_pass_begin(context->gpu, "visibility");
    err = bd_visibility_run(context, visibility, segments,
                            (size_t)words_of(vpl_count) * 32 * receivers, detail);
    bd_gpu_pass_end(context->gpu);
    return err;
}

// --- a few: how much at once --------------------------------------------------------------------

struct bd_chooser {
    const struct bd_pass_context *context;
    struct bd_chooser_inputs inputs;
    uint32_t width, height; // of the picture
    struct bd_list_groups groups;
    uint32_t sum_count; // a receiver
    uint32_t receivers_max;
    const struct bd_program *weigh, *choose;
    struct bd_buf *prefix, *picks;
    struct bd_segments *segments;
    struct bd_askers_slice slice; // the last one
};

struct bd_list_groups bd_list_groups_of(const struct bd_vpl_list *list, bool glossy)
{
    struct bd_list_groups groups = {GROUP_VPLS, 0, list->groups && !glossy};
    if (groups.as_one) groups.vpls = bd_vpl_group_size(list->count);
    while (!groups.as_one && bd_divided_up(list->count, groups.vpls) > GROUPS_MAX &&
           groups.vpls < GROUP_VPLS_MAX)
        groups.vpls *= 2;
    groups.count = bd_divided_up(list->count, groups.vpls);
    return groups;
}

static void group_list(struct bd_chooser *c)
{
    c->groups = bd_list_groups_of(c->inputs.list, c->inputs.glossy);
    c->sum_count = c->groups.count + c->inputs.spread;
}

static void lay_out(struct bd_chooser *c)
{
    if (c->inputs.choice)
        c->sum_count = c->inputs.choice->sum_count;
    else
        group_list(c);
    const size_t of_receiver =
        c->sum_count * sizeof(float) + c->inputs.rays * (sizeof(struct bd_segment) + PICK_BYTES);
    const struct bd_fragments *fragments = c->inputs.askers.fragments;
    const size_t receivers =
        fragments ? (size_t)fragments->count + BD_ASKERS_ROW : (size_t)c->width * c->height;
    size_t most = BD_SEGMENTS_BYTES_MAX / of_receiver;
    if (most > receivers) most = receivers;
    // A tile is eight pixels square at least, whatever that takes.
    c->receivers_max = most < 64 ? 64 : (uint32_t)most;
}

static enum bd_err make_room(struct bd_chooser *c, struct bd_err_detail *detail)
{
    struct bd_gpu *gpu = c->context->gpu;
    const size_t receivers = c->receivers_max;
    enum bd_err err = bd_buf_create_unset(
        gpu, "sums over vpls", receivers * c->sum_count * sizeof(float), &c->prefix, detail);
    if (!err)
        err = bd_buf_create_unset(gpu, "vpls chosen", receivers * c->inputs.rays * PICK_BYTES,
                                  &c->picks, detail);
    if (!err) err = bd_segments_create(gpu, receivers * c->inputs.rays, &c->segments, detail);
    return err;
}

static enum bd_err get_programs(struct bd_chooser *c, struct bd_err_detail *detail)
{
    if (c->inputs.choice) return BD_ERR_OK;
    struct bd_defines defines = {0}, weigh;
    struct bd_gpu *gpu = c->context->gpu;
    bd_askers_define(&c->inputs.askers, &defines);
    if (c->inputs.glossy) bd_define(&defines, "BD_GLOSSY", 1);
    if (c->inputs.askers.near_patches) bd_define(&defines, "BD_VPL_PATCH", 1);
    if (c->groups.as_one) bd_define(&defines, "BD_GROUPED", 1);
    weigh = defines;
    if (c->inputs.spread) bd_define(&weigh, "BD_SPREAD", 1);
    enum bd_err err = bd_compute_get(gpu, "pass/choose/weigh.comp", &weigh, &c->weigh, detail);
    return err ? err : bd_compute_get(gpu, "pass/choose/choose.comp", &defines, &c->choose, detail);
}

enum bd_err bd_chooser_create(const struct bd_pass_context *context,
                              const struct bd_chooser_inputs *inputs, struct bd_chooser **out,
                              struct bd_err_detail *detail)
{
    struct bd_chooser *c = *out = calloc(1, sizeof *c);
    BD_ASSERT(c);
    BD_ASSERT(inputs->choice || inputs->list->count > 0);
    BD_ASSERT_CMP(inputs->rays, <=, BD_RAYS_CHOSEN_MAX);
    c->context = context;
    c->inputs = *inputs;
    c->width = inputs->askers.viewpoint->width_px;
    c->height = inputs->askers.viewpoint->height_px;
    lay_out(c);
    enum bd_err err = get_programs(c, detail);
    if (!err) err = make_room(c, detail);
    if (err) bd_chooser_destroy(context->gpu, out);
    return err;
}

void bd_chooser_destroy(struct bd_gpu *gpu, struct bd_chooser **chooser)
{
    struct bd_chooser *c = *chooser;
    *chooser = NULL;
    if (!c) return;
    bd_buf_destroy(gpu, &c->prefix);
    bd_buf_destroy(gpu, &c->picks);
    bd_segments_destroy(gpu, &c->segments);
    free(c);
}

struct bd_ray_counts bd_chooser_rays(const struct bd_chooser *chooser)
{
    return chooser->segments->traced;
}

// --- a few: a slice -----------------------------------------------------------------------------

static size_t receivers_of(const struct bd_chooser *c)
{
    return bd_askers_count(&c->inputs.askers, &c->slice);
}

// A whole number of groups; those that count as one VPL are few to look at.
static uint32_t vpls_of_dispatch(const struct bd_chooser *c)
{
    if (c->groups.as_one) return VPLS_PER_DISPATCH * GROUP_VPLS;
    return c->groups.vpls > VPLS_PER_DISPATCH ? c->groups.vpls : VPLS_PER_DISPATCH;
}

static void bind(const struct bd_chooser *c, struct bd_asking *asking)
{
    const struct bd_chooser_inputs *in = &c->inputs;
    bd_askers_bind(&in->askers, &c->slice, asking);
    asking->args.rays_per_receiver = in->rays;
    asking->args.seed = bd_askers_seed(in->seed);
    if (in->choice) {
        asking->args.running_sum_count = in->choice->spread_row;
        return;
    }
    asking->args.vpls_per_group = c->groups.vpls;
    asking->args.running_sum_count = c->groups.count;
    asking->args.list_vpl_count = in->list->count;
    bd_asking_set_maps(in->visibility, in->list, asking);
}

static void bind_choice(const struct bd_chooser *c, struct bd_asking *asking)
{
    if (c->inputs.list) bind_vpls(c->inputs.list, &asking->bindings);
    bd_bind_storage(&asking->bindings, BD_STORAGE_SEGMENTS, c->segments->segments, false, true);
    bd_bind_storage(&asking->bindings, BD_STORAGE_PREFIX, c->prefix, true, true);
    bd_bind_storage(&asking->bindings, BD_STORAGE_PICKS, c->picks, true, true);
}

// A program for VPLs, or rays, from 0 to `count`: `step` in a dispatch.
struct parts {
    const char *pass;
    const struct bd_program *program;
    uint32_t count, step;
    double units; // of each, at a receiver
};

// A dispatch is a slice, and a tile many of them: of a tile so small that all VPLs are one slice a
// dispatch would be four work groups.
static enum bd_err run_parts(const struct bd_chooser *c, const struct parts *parts)
{
    struct bd_asking asking;
    bind(c, &asking);
    bind_choice(c, &asking);
    enum bd_err err = BD_ERR_OK;
    bd_slicer_work(c->context->slicer, parts->pass);
    for (uint32_t at = 0; !err && at < parts->count; at += parts->step) {
        const uint32_t left = parts->count - at;
        asking.args.first_item = at;
        asking.args.item_count = left < parts->step ? left : parts->step;
        bd_gpu_pass_begin(c->context->gpu, parts->pass);
        bd_askers_dispatch(c->context->gpu, parts->program, &asking);
        bd_gpu_pass_end(c->context->gpu);
        err = bd_slicer_checkpoint(c->context->slicer,
                                   (double)receivers_of(c) * asking.args.item_count * parts->units);
    }
    return err;
}

static enum bd_err weigh(const struct bd_chooser *c)
{
    const struct parts parts = {"weigh", c->weigh, c->inputs.list->count, vpls_of_dispatch(c), 1};
    return run_parts(c, &parts);
}

// So many rays that the search for their VPLs, twice for near ones, ends by itself.
static uint32_t rays_of_dispatch(const struct bd_chooser *c)
{
    const uint32_t rounds_of_ray = 2 * (c->groups.vpls + 24);
    return rounds_of_ray < ROUNDS_MAX ? ROUNDS_MAX / rounds_of_ray : 1;
}

static enum bd_err choose(const struct bd_chooser *c)
{
    const struct parts parts = {"choose", c->choose, c->inputs.rays, rays_of_dispatch(c),
                                c->groups.vpls};
    return run_parts(c, &parts);
}

static enum bd_err ask(const struct bd_chooser *c, struct bd_err_detail *detail)
{
    const struct bd_choice *choice = c->inputs.choice;
    if (choice) {
        struct bd_asking asking;
        bind(c, &asking);
        bind_choice(c, &asking);
        return choice->run(choice->user, &c->slice, &asking, detail);
    }
    enum bd_err err = weigh(c);
    return err ? err : choose(c);
}

static enum bd_err look(const struct bd_chooser *c, struct bd_err_detail *detail)
{
    bd_gpu_pass_begin(c->context->gpu, "visibility");
    enum bd_err err = bd_visibility_run(c->context, c->inputs.visibility, c->segments,
                                        receivers_of(c) * c->inputs.rays, detail);
    bd_gpu_pass_end(c->context->gpu);
    return err;
}

// --- a few: all slices --------------------------------------------------------------------------

// Of the slicer's next slice, so that what it needs fits, and one dispatch is a slice.
static double units_of_receiver(const struct bd_chooser *c)
{
    const double units = c->inputs.choice ? c->inputs.choice->units : vpls_of_dispatch(c);
    return fmax(units, bd_slicer_units(c->context->slicer) / c->receivers_max);
}

static bool next_fragments(struct bd_chooser *c)
{
    const uint32_t done = c->slice.first + c->slice.count;
    const uint32_t left = c->inputs.askers.fragments->count - done;
    const uint32_t rows_max = c->receivers_max / BD_ASKERS_ROW;
    uint32_t count = bd_list_slice(c->context->slicer, units_of_receiver(c), left);
    if (count > rows_max * BD_ASKERS_ROW) count = rows_max * BD_ASKERS_ROW;
    c->slice = bd_askers_of_list(done, count);
    return count > 0;
}

static bool next_slice(struct bd_chooser *c)
{
    bd_slicer_work(c->context->slicer, "weigh");
    if (c->inputs.askers.fragments) return next_fragments(c);
    return bd_slicer_next_tile(c->context->slicer, units_of_receiver(c), c->width, c->height,
                               &c->slice.tile);
}

static enum bd_err use_chosen(const struct bd_chooser *c, const struct bd_chosen_use *use)
{
    struct bd_asking asking;
    bind(c, &asking);
    bd_bind_storage(&asking.bindings, BD_STORAGE_OCCLUDED, c->segments->occluded, true, false);
    bd_bind_storage(&asking.bindings, BD_STORAGE_PICKS, c->picks, true, false);
    bd_bind_storage(&asking.bindings, BD_STORAGE_PREFIX, c->prefix, true, false);
    use->bind(use->user, &asking.bindings);
    bd_slicer_work(c->context->slicer, "gather chosen");
    bd_gpu_pass_begin(c->context->gpu, use->pass);
    bd_askers_dispatch(c->context->gpu, use->program, &asking);
    bd_gpu_pass_end(c->context->gpu);
    return bd_slicer_checkpoint(c->context->slicer, (double)receivers_of(c) * c->inputs.rays);
}

enum bd_err bd_chooser_run(struct bd_chooser *c, const struct bd_chosen_use *use,
                           struct bd_err_detail *detail)
{
    enum bd_err err = BD_ERR_OK;
    while (!err && next_slice(c)) {
        err = ask(c, detail);
        if (!err) err = look(c, detail);
        if (!err) err = use_chosen(c, use);
    }
    return err;
}
