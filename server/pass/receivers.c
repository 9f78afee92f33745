#include "pass/receivers.h"

#include <stdlib.h>
#include <string.h>

#include "lights/sequence.h"
#include "pass/f3_arrays.h"
#include "pass/fragment_order.h"
#include "pass/kernels.h"
#include "shared/bindings.h"

// Numbers that nobody else of a frame draws by its seed.
#define OF_POINTS 0x706f696eu
// Groups at once: 16 MiB of receivers.
#define GROUPS_MAX 5461u

struct receivers {
    const struct bd_pass_context *context;
    const struct bd_receivers_inputs *inputs;
    struct bd_askers askers;
    struct bd_fragments in_order; // of fragments: theirs, in an order of our own
    const struct bd_program *write, *store;
    struct bd_buf *receivers, *starts, *surfaces, *light, *glossy;
    uint32_t groups_max;
    struct bd_receiver_part part;
};

// --- room ---------------------------------------------------------------------------------------

static bool has_surfaces(const struct bd_receivers_inputs *inputs)
{
    return inputs->surfaces || inputs->glossy;
}

static enum bd_err get_programs(struct receivers *r, struct bd_err_detail *detail)
{
    struct bd_defines defines = {0};
    struct bd_gpu *gpu = r->context->gpu;
    bd_askers_define(&r->inputs->askers, &defines);
    if (r->inputs->spread) bd_define(&defines, "BD_SPREAD", 1);
    struct bd_defines write = defines, store = defines;
    if (has_surfaces(r->inputs)) bd_define(&write, "BD_GLOSSY", 1);
    if (r->inputs->glossy) bd_define(&store, "BD_GLOSSY", 1);
    if (r->inputs->rough_apart) bd_define(&store, "BD_ROUGH", 1);
    if (r->inputs->starts) bd_define(&write, "BD_CHOSEN", 1);
    if (r->inputs->noise) bd_define(&store, "BD_NOISE", 1);
    if (r->inputs->adds) bd_define(&store, "BD_ADDS", 1);
    enum bd_err err =
        bd_compute_get(gpu, "pass/receivers/receivers.comp", &write, &r->write, detail);
    if (err || !r->inputs->bind) return err;
    return bd_compute_get(gpu, "pass/receivers/light.comp", &store, &r->store, detail);
}

static uint32_t groups_of(uint64_t receivers)
{
    return (uint32_t)((receivers + BD_LANES - 1) / BD_LANES);
}

static uint64_t receiver_count(const struct bd_receivers_inputs *inputs)
{
    return inputs->points ? inputs->point_count : bd_askers_count_all(&inputs->askers);
}

// No more than there are.
static uint32_t groups_at_once(const struct bd_receivers_inputs *inputs)
{
    const uint64_t all = receiver_count(inputs);
    const uint64_t asked = inputs->receivers_max ? inputs->receivers_max : all;
    const uint32_t most = groups_of(asked < all ? asked : all);
    return most < GROUPS_MAX ? most : GROUPS_MAX;
}

// Here, and but for points on the device: of all groups.
static enum bd_err make_both(const struct receivers *r, const char *name, size_t group_bytes,
                             struct bd_buf **buf, void **copy, struct bd_err_detail *detail)
{
    const size_t bytes = r->groups_max * group_bytes;
    *copy = malloc(bytes);
    if (!*copy)
        return bd_err_set(detail, BD_ERR_NO_MEMORY, "size", "no memory for %u groups of %s",
                          r->groups_max, name);
    if (r->inputs->points) return BD_ERR_OK;
    return bd_buf_create_unset(r->context->gpu, name, bytes, buf, detail);
}

#define MAKE(name, field)                                                                          \
    make_both(r, name, sizeof *r->part.field, &r->field, (void **)&r->part.field, detail)

static enum bd_err make_room(struct receivers *r, struct bd_err_detail *detail)
{
    r->groups_max = groups_at_once(r->inputs);
    enum bd_err err = MAKE("receivers", receivers);
    if (!err) err = MAKE("light of receivers", light);
    if (!err && r->inputs->starts) err = MAKE("starts of rays", starts);
    if (!err && has_surfaces(r->inputs)) err = MAKE("surfaces of receivers", surfaces);
    if (!err && r->inputs->glossy) err = MAKE("glossy light of receivers", glossy);
    return err;
}

static void free_room(struct receivers *r)
{
    struct bd_buf **bufs[] = {&r->receivers, &r->starts, &r->surfaces, &r->light, &r->glossy};
    void *copies[] = {r->part.receivers, r->part.starts, r->part.surfaces, r->part.light,
                      r->part.glossy};
    for (size_t i = 0; i < sizeof bufs / sizeof *bufs; i++) {
        bd_buf_destroy(r->context->gpu, bufs[i]);
        free(copies[i]);
    }
}

static enum bd_err put_in_order(struct receivers *r, struct bd_err_detail *detail)
{
    struct bd_gpu *gpu = r->context->gpu;
    const uint32_t count = r->in_order.count;
    uint32_t *list = malloc(count * sizeof *list);
    uint64_t *spare = malloc(count * sizeof *spare);
    enum bd_err err = BD_ERR_OK;
    if (!list || !spare)
        err = bd_err_set(detail, BD_ERR_NO_MEMORY, "size", "no memory for %u fragments", count);
    if (!err) err = bd_buf_read(gpu, r->in_order.list, 0, list, count * sizeof *list);
    r->in_order.list = NULL;
    if (!err) bd_fragment_order(list, spare, count);
    if (!err)
        err = bd_buf_create(gpu, "fragments in order", count * sizeof *list, list,
                            &r->in_order.list, detail);
    free(list);
    free(spare);
    return err;
}

static enum bd_err set_askers(struct receivers *r, struct bd_err_detail *detail)
{
    if (r->inputs->points) return BD_ERR_OK;
    r->askers = r->inputs->askers;
    r->part.askers = &r->askers;
    if (!r->askers.fragments) return BD_ERR_OK;
    r->in_order = *r->askers.fragments;
    r->askers.fragments = &r->in_order;
    return put_in_order(r, detail);
}

// --- a part -------------------------------------------------------------------------------------

static void dispatch(const struct receivers *r, const struct bd_program *program,
                     struct bd_asking *asking)
{
    bd_askers_set_uniforms(asking);
    bd_gpu_dispatch(r->context->gpu, program, &asking->bindings, r->part.group_count, 1, 1);
}

static enum bd_err fetch(const struct receivers *r)
{
    struct bd_gpu *gpu = r->context->gpu;
    const uint32_t groups = r->part.group_count;
    struct bd_asking asking;
    bd_askers_bind(&r->askers, &r->part.slice, &asking);
    bd_bind_storage(&asking.bindings, BD_STORAGE_RECEIVERS, r->receivers, false, true);
    if (r->starts) bd_bind_storage(&asking.bindings, BD_STORAGE_RAY_STARTS, r->starts, false, true);
    if (r->surfaces)
        bd_bind_storage(&asking.bindings, BD_STORAGE_GLOSSY_RECEIVERS, r->surfaces, false, true);
    asking.args.seed = bd_askers_seed(r->inputs->seed);
    dispatch(r, r->write, &asking);
    enum bd_err err =
        bd_buf_read(gpu, r->receivers, 0, r->part.receivers, groups * sizeof *r->part.receivers);
    if (!err && r->starts)
        err = bd_buf_read(gpu, r->starts, 0, r->part.starts, groups * sizeof *r->part.starts);
    if (!err && r->surfaces)
        err = bd_buf_read(gpu, r->surfaces, 0, r->part.surfaces, groups * sizeof *r->part.surfaces);
    return err;
}

// A part of the whole that no point near it in the list has.
static float place_of_point(uint64_t seed, uint32_t number)
{
    const struct bd_sequence sequence = bd_sequence_of(bd_askers_seed(seed), OF_POINTS);
    float pair[2];
    bd_sequence_pair(&sequence, number, pair);
    return pair[0];
}

static void take_points(struct receivers *r)
{
    const struct bd_surface_point *points = r->inputs->points + r->part.slice.first;
    r->part.points = points;
    memset(r->part.receivers, 0, r->part.group_count * sizeof *r->part.receivers);
    memset(r->part.starts, 0, r->part.group_count * sizeof *r->part.starts);
    for (uint32_t i = 0; i < r->part.count; i++) {
        struct bd_receivers *receivers = &r->part.receivers[i / BD_LANES];
        struct bd_ray_starts *starts = &r->part.starts[i / BD_LANES];
        const uint32_t lane = i % BD_LANES;
        f3_put_at(&receivers->position, lane, points[i].position);
        f3_put_at(&receivers->normal, lane, points[i].normal);
        f3_put_at(&receivers->normal_geometric, lane, points[i].normal);
        receivers->lit[lane] = 1;
        f3_put_at(&starts->position, lane, points[i].position);
        f3_put_at(&starts->normal_geometric, lane, points[i].normal);
        starts->triangle[lane] = points[i].triangle;
        starts->place[lane] = place_of_point(r->inputs->seed, points[i].number);
    }
}

void bd_receivers_keep(const struct bd_receiver_part *part, f3 *irradiance)
{
    for (uint32_t i = 0; i < part->count; i++) {
        f3 *to = &irradiance[part->slice.first + i];
        *to = f3_add(*to, f3_at(&part->light[i / BD_LANES].irradiance, i % BD_LANES));
    }
}

static void store(const struct receivers *r)
{
    struct bd_gpu *gpu = r->context->gpu;
    const uint32_t groups = r->part.group_count;
    struct bd_asking asking;
    bd_askers_bind(&r->askers, &r->part.slice, &asking);
    bd_buf_upload(gpu, r->light, 0, r->part.light, groups * sizeof *r->part.light);
    bd_bind_storage(&asking.bindings, BD_STORAGE_RECEIVER_LIGHT, r->light, true, false);
    if (r->glossy) {
        bd_buf_upload(gpu, r->glossy, 0, r->part.glossy, groups * sizeof *r->part.glossy);
        bd_bind_storage(&asking.bindings, BD_STORAGE_GLOSSY_LIGHT, r->glossy, true, false);
    }
    r->inputs->bind(r->inputs->out, &asking.bindings);
    dispatch(r, r->store, &asking);
}

static enum bd_err light_part(struct receivers *r)
{
    r->part.count = r->inputs->points ? r->part.slice.count
                                      : (uint32_t)bd_askers_count(&r->askers, &r->part.slice);
    r->part.group_count = groups_of(r->part.count);
    for (uint32_t i = 0; i < r->part.group_count; i++)
        r->part.light[i] = (struct bd_receiver_light){0};
    for (uint32_t i = 0; r->glossy && i < r->part.group_count; i++)
        r->part.glossy[i] = (struct bd_lanes3){0};
    enum bd_err err = BD_ERR_OK;
    if (r->inputs->points)
        take_points(r);
    else
        err = fetch(r);
    if (!err) err = r->inputs->light(r->inputs->user, &r->part);
    if (!err && r->inputs->bind) store(r);
    return err;
}

// Rows of pixels, or a part of one.
static bool next_tile(const struct receivers *r, uint32_t most, struct bd_tile *tile)
{
    const struct bd_viewpoint *viewpoint = r->askers.viewpoint;
    const bool row_goes_on = tile->height > 0 && tile->x + tile->width < viewpoint->width_px;
    tile->x = row_goes_on ? tile->x + tile->width : 0;
    tile->y += row_goes_on ? 0 : tile->height;
    const uint32_t across = viewpoint->width_px - tile->x, down = viewpoint->height_px - tile->y;
    tile->width = across < most ? across : most;
    const uint32_t rows = tile->width < viewpoint->width_px ? 1 : most / tile->width;
    tile->height = rows < down ? rows : down;
    return down > 0;
}

// False after the last.
static bool next_part(struct receivers *r)
{
    const uint32_t most =
        r->inputs->receivers_max < r->groups_max * BD_LANES && r->inputs->receivers_max > 0
            ? r->inputs->receivers_max
            : r->groups_max * BD_LANES;
    struct bd_askers_slice *slice = &r->part.slice;
    if (!r->askers.fragments && !r->inputs->points) return next_tile(r, most, &slice->tile);
    const uint32_t done = slice->first + slice->count;
    const uint32_t left = (uint32_t)receiver_count(r->inputs) - done;
    *slice = bd_askers_of_list(done, left < most ? left : most);
    return left > 0;
}

enum bd_err bd_receivers_run(const struct bd_pass_context *context,
                             const struct bd_receivers_inputs *inputs, struct bd_err_detail *detail)
{
    struct receivers r = {.context = context, .inputs = inputs};
    if (receiver_count(inputs) == 0) return BD_ERR_OK;
    if (inputs->pass) bd_gpu_pass_begin(context->gpu, inputs->pass);
    enum bd_err err = set_askers(&r, detail);
    if (!err && !inputs->points) err = get_programs(&r, detail);
    if (!err) err = make_room(&r, detail);
    while (!err && next_part(&r)) err = light_part(&r);
    if (inputs->pass) bd_gpu_pass_end(context->gpu);
    bd_buf_destroy(context->gpu, &r.in_order.list);
    free_room(&r);
    return err;
}

// --- slices -------------------------------------------------------------------------------------

struct turn {
    void (*work)(void *user, uint32_t group);
    void *user;
    uint32_t first;
};

static void work_on(void *user, uint32_t i)
{
    const struct turn *turn = user;
    turn->work(turn->user, turn->first + i);
}

// A slice of as many as its threads share evenly: three groups on two of them would leave one idle
// for a quarter of the time. The last takes what is left.
static uint32_t groups_of_slice(const struct bd_slicer *slicer, double units, uint32_t threads,
                                uint32_t left)
{
    const double fit = bd_slicer_units(slicer) / units;
    if (fit >= left || threads >= left) return left;
    const uint32_t most = fit > threads ? (uint32_t)fit : threads;
    return most - most % threads;
}

enum bd_err bd_receivers_each(const struct bd_pass_context *context, uint32_t group_count,
                              double units, void (*work)(void *user, uint32_t group), void *user)
{
    struct turn turn = {work, user, 0};
    const uint32_t threads = bd_pool_thread_count(context->processor->pool);
    enum bd_err err = BD_ERR_OK;
    while (!err && turn.first < group_count) {
        const uint32_t count =
            groups_of_slice(context->slicer, units, threads, group_count - turn.first);
        err = bd_pool_run(context->processor->pool, count, work_on, NULL, &turn);
        turn.first += count;
        if (!err) err = bd_slicer_checkpoint(context->slicer, units * count);
    }
    return err;
}
