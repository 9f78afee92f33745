#include "pass/gather_native.h"

#include <stdlib.h>

#include "pass/kernels.h"
#include "pass/native_glossy.h"
#include "pass/native_lists.h"
#include "shared/vpl.h"

struct gather {
    const struct bd_pass_context *context;
    const struct bd_gather_native_inputs *inputs;
    struct bd_native_wishes wishes;
    struct bd_native_vpls *lists;
    struct bd_segments *segments; // of a part; NULL without visibility
    const struct bd_receiver_part *part;
    struct bd_native_vpls turn;
    struct bd_native_hidden hidden;
    struct bd_glossy_groups glossy; // of the part
    struct bd_err_detail *detail;
};

static void gather_group(void *user, uint32_t group)
{
    const struct gather *g = user;
    struct bd_native_hidden hidden = g->hidden;
    if (hidden.bits) hidden.bits += (size_t)group * BD_LANES * hidden.words;
    g->context->processor->loops->gather(&g->part->receivers[group], &g->turn, &hidden, &g->wishes,
                                         &g->part->light[group]);
}

#define HIDDEN_WORDS_MAX (BD_VPLS_PER_SUM / 32)

static void gather_glossy_group(void *user, uint32_t index)
{
    const struct gather *g = user;
    struct bd_glossy_group *group = &g->glossy.groups[index];
    struct bd_native_hidden hidden = g->hidden;
    uint32_t bits[BD_LANES * HIDDEN_WORDS_MAX];
    if (hidden.bits) {
        bd_glossy_hidden(group, &g->hidden, bits);
        hidden.bits = bits;
    }
    g->context->processor->loops->gather_glossy(&group->receivers, &group->surfaces, &g->turn,
                                                &hidden, &g->wishes, &group->light);
}

// What the part's receivers see of the turn's VPLs. Passes do not nest.
static enum bd_err look(struct gather *g, const struct bd_vpl_list *list)
{
    const uint32_t count = g->turn.end - g->turn.first;
    bd_gpu_pass_end(g->context->gpu);
    enum bd_err err =
        bd_choose_all(g->context, g->part->askers, &g->part->slice, list, g->turn.first, count,
                      g->inputs->visibility, g->segments, g->detail);
    bd_gpu_pass_begin(g->context->gpu, g->inputs->receivers.pass);
    g->hidden = (struct bd_native_hidden){g->segments->host_bits, bd_divided_up(count, 32)};
    return err;
}

static const char *kind_of(const struct bd_native_wishes *wishes)
{
    if (wishes->spread) return "native gather, spread";
    return wishes->vector ? "native gather, vector" : "native gather";
}

static enum bd_err light_all(struct gather *g, double units)
{
    if (g->inputs->receivers.askers.lobes_alone) return BD_ERR_OK;
    bd_slicer_work(g->context->slicer, kind_of(&g->wishes));
    return bd_receivers_each(g->context, g->part->group_count, units, gather_group, g);
}

static enum bd_err light_glossy(struct gather *g, double units)
{
    bd_slicer_work(g->context->slicer, "native gather, glossy");
    return bd_receivers_each(g->context, g->glossy.count, units, gather_glossy_group, g);
}

static enum bd_err take_turn(struct gather *g, const struct bd_vpl_list *list)
{
    const double units = (double)(g->turn.end - g->turn.first) * BD_LANES;
    enum bd_err err = g->segments ? look(g, list) : BD_ERR_OK;
    if (!err) err = light_all(g, units);
    return err ? err : light_glossy(g, units);
}

static enum bd_err gather_lists(void *user, const struct bd_receiver_part *part)
{
    struct gather *g = user;
    g->part = part;
    const uint32_t step = g->segments ? BD_VPLS_PER_SUM : BD_TURN_EVALUATIONS;
    enum bd_err err = part->surfaces ? bd_glossy_groups_of(part, &g->glossy, g->detail) : BD_ERR_OK;
    for (uint32_t l = 0; l < g->inputs->list_count; l++) {
        for (uint32_t at = 0; !err && at < g->lists[l].end; at += step) {
            g->turn = g->lists[l];
            g->turn.first = at;
            if (g->turn.end - at > step) g->turn.end = at + step;
            err = take_turn(g, g->inputs->lists[l]);
        }
    }
    if (!err) bd_glossy_groups_keep(&g->glossy, part);
    return err;
}

bool bd_gather_may_be_native(const struct bd_pass_context *context,
                             const struct bd_visibility_inputs *visibility)
{
    return context->processor && (!visibility || bd_visibility_is_native(visibility));
}

static enum bd_err run(struct gather *g)
{
    struct bd_receivers_inputs receivers = g->inputs->receivers;
    receivers.light = gather_lists;
    receivers.user = g;
    if (g->segments) receivers.receivers_max = bd_choose_all_max(BD_VPLS_PER_SUM);
    return bd_receivers_run(g->context, &receivers, g->detail);
}

enum bd_err bd_gather_native_run(const struct bd_pass_context *context,
                                 const struct bd_gather_native_inputs *inputs,
                                 struct bd_ray_counts *rays, struct bd_err_detail *detail)
{
    struct gather g = {
        .context = context,
        .inputs = inputs,
        .wishes = bd_native_wishes_of(&inputs->receivers),
        .detail = detail,
    };
    enum bd_err err =
        bd_native_lists_borrow(context->gpu, inputs->lists, inputs->list_count, &g.lists, detail);
    if (!err && inputs->visibility)
        err = bd_choose_all_room(context->gpu, &inputs->receivers.askers, inputs->lists,
                                 inputs->list_count, &g.segments, detail);
    if (!err) err = run(&g);
    if (!err && g.segments) bd_ray_counts_add(rays, g.segments->traced);
    bd_segments_destroy(context->gpu, &g.segments);
    bd_glossy_groups_free(&g.glossy);
    bd_native_lists_return(context->gpu, inputs->lists, inputs->list_count, &g.lists);
    return err;
}
