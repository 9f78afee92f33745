// Light of virtual lights that each pixel chooses, seen by rays, on the processor.

#include <stdlib.h>

#include "base/assert.h"
#include "kernel/choice.h"
#include "kernel/lift.h"
#include "pass/f3_arrays.h"
#include "pass/gather_native.h"
#include "pass/native_lists.h"
#include "shared/vpl.h"

struct gather {
    const struct bd_pass_context *context;
    const struct bd_gather_chosen_native_inputs *inputs;
    struct bd_native_wishes wishes;
    struct bd_native_vpls *list;
    struct bd_native_choice choice;
    struct bd_shadow_maps_of_list maps; // of the list
    const struct bd_receiver_part *part;
    struct bd_native_part turn; // groups of VPLs, or rays
    float *sums;                // of a group each
    struct bd_native_pick *picks;
    struct bd_segment *segments;
    uint32_t *occluded;
    struct bd_ray_counts traced;
    struct bd_err_detail *detail;
};

// --- room ---------------------------------------------------------------------------------------

// Receivers whose segments, picks and sums fit; a group at least.
static uint32_t receivers_at_once(const struct gather *g)
{
    const size_t of_group = g->choice.group_count * BD_LANES * sizeof *g->sums +
                            g->choice.rays * sizeof *g->picks +
                            g->choice.rays * BD_LANES * sizeof *g->segments;
    const size_t groups = BD_SEGMENTS_BYTES_MAX / of_group;
    return (uint32_t)(groups > 1 ? groups : 1) * BD_LANES;
}

static enum bd_err make_room(struct gather *g, uint32_t group_count)
{
    const size_t groups = group_count, rays = g->choice.rays;
    if (g->sums) return BD_ERR_OK; // the first part is the largest
    g->sums = malloc(groups * g->choice.group_count * BD_LANES * sizeof *g->sums);
    g->picks = malloc(groups * rays * sizeof *g->picks);
    g->segments = malloc(groups * rays * BD_LANES * sizeof *g->segments);
    g->occluded = malloc(groups * rays * BD_LANES / 8);
    if (g->sums && g->picks && g->segments && g->occluded) return BD_ERR_OK;
    return bd_err_set(g->detail, BD_ERR_NO_MEMORY, "rays", "no memory for %zu rays",
                      groups * rays * BD_LANES);
}

static void free_room(struct gather *g)
{
    free(g->sums);
    free(g->picks);
    free(g->segments);
    free(g->occluded);
    bd_native_lists_return(g->context->gpu, &g->inputs->list, 1, &g->list);
}

// --- a part -------------------------------------------------------------------------------------

static float *sums_of(const struct gather *g, uint32_t group)
{
    return g->sums + (size_t)group * g->choice.group_count * BD_LANES;
}

static void weigh_group(void *user, uint32_t group)
{
    const struct gather *g = user;
    g->context->processor->loops->weigh(&g->part->receivers[group], &g->choice, &g->wishes,
                                        &g->turn, sums_of(g, group), &g->part->light[group]);
}

static void aim(const struct gather *g, const struct bd_ray_starts *starts, uint32_t i,
                uint32_t vpl_index, struct bd_segment *segment)
{
    const struct bd_vec4 *vpl = &g->choice.vpls.vpls[(size_t)vpl_index * BD_VPL_VEC4S];
    const struct bd_vec4 *quad = &g->choice.vpls.quads[(size_t)vpl_index * BD_VPL_QUAD_VEC4S];
    const f3 from = f3_at(&starts->position, i);
    const f3 to = end_of_segment(f3_from(vpl), f3_from(quad), f3_from(quad + 1), quad->w, vpl[2].w,
                                 quad[1].w);
    const float lift = lift_of_segment(g->choice.view_reach, from, to);
    f3_store(segment->from, f3_add(from, f3_scale(f3_at(&starts->normal_geometric, i), lift)));
    f3_store(segment->to, f3_add(to, f3_scale(f3_from(vpl + 1), lift)));
    segment->from_triangle = starts->triangle[i];
    if (g->maps.vpls_each == 0) return;
    segment->to_triangle = g->maps.first + vpl_index / g->maps.vpls_each;
    f3_store(segment->to, f3_at(&starts->normal_geometric, i));
}

// Those of a lane side by side. One asks nothing where nothing was found.
static void put_segments(const struct gather *g, const struct bd_ray_starts *starts,
                         const struct bd_native_pick *picks, struct bd_segment *segments)
{
    for (uint32_t ray = g->turn.first; ray < g->turn.end; ray++)
        for (uint32_t i = 0; i < BD_LANES; i++) {
            struct bd_segment *segment = &segments[(size_t)i * g->choice.rays + ray];
            *segment =
                (struct bd_segment){.from_triangle = BD_NO_TRIANGLE, .to_triangle = BD_NO_TRIANGLE};
            const uint32_t vpl = picks[ray].vpl[i];
            if (vpl != BD_NATIVE_NO_VPL) aim(g, starts, i, vpl, segment);
        }
}

static void choose_group(void *user, uint32_t group)
{
    const struct gather *g = user;
    const size_t rays = g->choice.rays;
    struct bd_native_pick *picks = g->picks + group * rays;
    const struct bd_ray_starts *starts = &g->part->starts[group];
    g->context->processor->loops->choose(&g->part->receivers[group], starts, &g->choice, &g->wishes,
                                         &g->turn, sums_of(g, group), picks);
    put_segments(g, starts, picks, g->segments + group * rays * BD_LANES);
}

static void sum_group(void *user, uint32_t group)
{
    const struct gather *g = user;
    const size_t rays = g->choice.rays;
    g->context->processor->loops->sum_picks(
        &g->part->receivers[group], g->picks + group * rays, g->choice.rays,
        g->occluded + group * rays * BD_LANES / 32, &g->part->light[group]);
}

// Points are of whoever asks for them.
static void go_on_as(struct gather *g, const char *pass)
{
    if (g->inputs->of_points) return;
    bd_gpu_pass_end(g->context->gpu);
    bd_gpu_pass_begin(g->context->gpu, pass);
}

// `count` of something that takes so many evaluations each, in turns.
static enum bd_err take_turns(struct gather *g, uint32_t count, uint32_t vpls_each,
                              void (*work)(void *user, uint32_t group))
{
    const uint32_t step = vpls_each < BD_TURN_EVALUATIONS ? BD_TURN_EVALUATIONS / vpls_each : 1;
    enum bd_err err = BD_ERR_OK;
    for (uint32_t at = 0; !err && at < count; at = g->turn.end) {
        g->turn = (struct bd_native_part){at, count - at < step ? count : at + step};
        const double units = (double)(g->turn.end - at) * vpls_each * BD_LANES;
        err = bd_receivers_each(g->context, g->part->group_count, units, work, g);
    }
    return err;
}

static enum bd_err weigh(struct gather *g)
{
    bd_slicer_work(g->context->slicer, "native weigh");
    return take_turns(g, g->choice.group_count, g->choice.group_vpls, weigh_group);
}

// What is found is loaded and lit beside the search.
#define VPLS_OF_RAY 8u

static enum bd_err choose(struct gather *g)
{
    bd_slicer_work(g->context->slicer, "native choose");
    return take_turns(g, g->choice.rays, g->choice.group_vpls + VPLS_OF_RAY, choose_group);
}

static enum bd_err look(struct gather *g)
{
    const size_t count = (size_t)g->part->group_count * g->choice.rays * BD_LANES;
    return bd_visibility_ask(g->context, g->inputs->visibility, g->segments, count, g->occluded,
                             &g->traced, g->detail);
}

static enum bd_err sum(struct gather *g)
{
    bd_slicer_work(g->context->slicer, "native sum");
    return bd_receivers_each(g->context, g->part->group_count, (double)g->choice.rays * BD_LANES,
                             sum_group, g);
}

static enum bd_err light_part(void *user, const struct bd_receiver_part *part)
{
    struct gather *g = user;
    g->part = part;
    enum bd_err err = make_room(g, part->group_count);
    go_on_as(g, "weigh");
    if (!err) err = weigh(g);
    go_on_as(g, "choose");
    if (!err) err = choose(g);
    go_on_as(g, "visibility");
    if (!err) err = look(g);
    go_on_as(g, g->inputs->receivers.pass);
    if (!err) err = sum(g);
    if (!err && g->inputs->of_points) bd_receivers_keep(part, g->inputs->of_points);
    return err;
}

// --- all ----------------------------------------------------------------------------------------

static enum bd_err run(struct gather *g)
{
    struct bd_receivers_inputs receivers = g->inputs->receivers;
    receivers.light = light_part;
    receivers.user = g;
    receivers.starts = true;
    receivers.receivers_max = receivers_at_once(g);
    return bd_receivers_run(g->context, &receivers, g->detail);
}

static enum bd_err run_by_groups(struct gather *g)
{
    struct bd_gpu *gpu = g->context->gpu;
    const struct bd_list_groups groups = bd_list_groups_of(g->inputs->list, false);
    struct bd_native_block *blocks =
        bd_native_blocks_make(g->list, (size_t)groups.count * (groups.vpls / BD_NATIVE_BLOCK));
    void *as_one = NULL;
    BD_ASSERT_CMP(groups.vpls, <=, BD_NATIVE_GROUP_MAX);
    enum bd_err err = BD_ERR_OK;
    if (!blocks)
        err = bd_err_set(g->detail, BD_ERR_NO_MEMORY, "vpls", "no memory for their blocks");
    if (!err && groups.as_one)
        err = bd_buf_borrow(gpu, g->inputs->list->groups, BD_BORROW_TO_READ, &as_one, g->detail);
    g->choice = (struct bd_native_choice){
        .vpls = *g->list,
        .blocks = blocks,
        .groups = as_one,
        .group_vpls = groups.vpls,
        .group_count = groups.count,
        .rays = g->inputs->rays,
        .view_reach = bd_askers_reach(&g->inputs->receivers.askers),
    };
    if (!err) err = run(g);
    if (as_one) bd_buf_return(gpu, g->inputs->list->groups, BD_BORROW_TO_READ, &as_one);
    free(blocks);
    return err;
}

enum bd_err bd_gather_chosen_native_run(const struct bd_pass_context *context,
                                        const struct bd_gather_chosen_native_inputs *inputs,
                                        struct bd_ray_counts *rays, struct bd_err_detail *detail)
{
    struct gather g = {
        .context = context,
        .inputs = inputs,
        .wishes = bd_native_wishes_of(&inputs->receivers),
        .maps = bd_imperfect_maps_of(inputs->visibility->maps, inputs->list),
        .detail = detail,
    };
    enum bd_err err = bd_native_lists_borrow(context->gpu, &inputs->list, 1, &g.list, detail);
    if (!err) err = run_by_groups(&g);
    if (!err) bd_ray_counts_add(rays, g.traced);
    free_room(&g);
    return err;
}
