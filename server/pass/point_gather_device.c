#include "pass/point_gather_device.h"

#include <stdlib.h>
#include <string.h>

#include "pass/f3_arrays.h"
#include "pass/kernels.h"
#include "pass/map_rays.h"
#include "pass/point_surfaces.h"
#include "shared/bindings.h"

// Sets that are cut before the device lights them.
#define SETS_AT_ONCE   64u
#define ASKERS_AT_ONCE (SETS_AT_ONCE * BD_SET_MOST)

// Of a set the cut of each of its surfaces.
struct set_cuts {
    struct bd_point_surfaces surfaces;
    struct bd_point_cut of[BD_POINT_SURFACES_MAX];
};

struct bd_point_gather_device {
    const struct bd_pass_context *context;
    const struct bd_point_gather_inputs *inputs;
    bool spread;
    const struct bd_program *program;
    struct bd_buf *points, *names, *radiance, *lobes, *texels, *clusters, *askers, *light;
    // Of a batch.
    const struct bd_receiver_part *part;
    const struct bd_receiver_sets *sets;
    uint32_t first_set;
    struct set_cuts *cuts;
    struct bd_point_cluster *all_clusters;
    struct bd_point_asker *all_askers;
    uint32_t *asker_is; // which receiver of the part
    char *all_light;    // each a struct bd_point_light, and its rays
    struct bd_map_ray *chosen;
};

// --- room ---------------------------------------------------------------------------------------

static size_t most_clusters(const struct bd_point_gather_device *d)
{
    return (size_t)SETS_AT_ONCE * BD_POINT_SURFACES_MAX * d->inputs->clusters;
}

static size_t light_bytes(const struct bd_point_gather_device *d)
{
    return sizeof(struct bd_point_light) + bd_map_ray_slots(d->inputs) * sizeof(struct bd_map_ray);
}

static enum bd_err make_room(struct bd_point_gather_device *d, struct bd_err_detail *detail)
{
    d->cuts = malloc(SETS_AT_ONCE * sizeof *d->cuts);
    d->all_clusters = malloc(most_clusters(d) * sizeof *d->all_clusters);
    d->all_askers = malloc(ASKERS_AT_ONCE * sizeof *d->all_askers);
    d->asker_is = malloc(ASKERS_AT_ONCE * sizeof *d->asker_is);
    d->all_light = malloc(ASKERS_AT_ONCE * light_bytes(d));
    if (d->cuts && d->all_clusters && d->all_askers && d->asker_is && d->all_light)
        return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_NO_MEMORY, "clusters", "no memory for cuts of %u",
                      d->inputs->clusters);
}

static enum bd_err upload_texels(struct bd_point_gather_device *d, const struct bd_microbuffer *map,
                                 struct bd_err_detail *detail)
{
    const uint32_t count = map->side * map->side;
    struct bd_point_texel *texels = malloc(count * sizeof *texels);
    if (!texels)
        return bd_err_set(detail, BD_ERR_NO_MEMORY, "microbuffer", "no memory for %u texels",
                          count);
    for (uint32_t t = 0; t < count; t++) {
        const f3 weight = map->weight[t], way = map->way[t];
        texels[t] = (struct bd_point_texel){{weight.x, weight.y, weight.z, 0},
                                            {way.x, way.y, way.z, map->solid_angle[t]}};
    }
    const enum bd_err err = bd_buf_create(d->context->gpu, "texels of maps", count * sizeof *texels,
                                          texels, &d->texels, detail);
    free(texels);
    return err;
}

static enum bd_err upload_points(struct bd_point_gather_device *d, struct bd_err_detail *detail)
{
    const struct bd_lit_points *lit = d->inputs->points;
    const size_t count = lit->clusters.count;
    enum bd_err err = bd_buf_create(d->context->gpu, "points", count * sizeof *lit->clusters.points,
                                    lit->clusters.points, &d->points, detail);
    if (!err)
        err = bd_buf_create(d->context->gpu, "names of points", count * sizeof *lit->clusters.names,
                            lit->clusters.names, &d->names, detail);
    if (!err)
        err = bd_buf_create(d->context->gpu, "light of points", 2 * count * sizeof *lit->radiance,
                            lit->radiance, &d->radiance, detail);
    return err;
}

// Sides, then those that have lobes, by where they begin.
static enum bd_err upload_lobes(struct bd_point_gather_device *d, struct bd_err_detail *detail)
{
    const struct bd_point_lobes *lobes = &d->inputs->points->lobes;
    const uint32_t sides = 2 * d->inputs->points->clusters.count;
    const size_t uints = sides + (size_t)lobes->count * BD_SENDING_UINTS;
    if (lobes->count == 0) return BD_ERR_OK;
    uint32_t *all = malloc(uints * sizeof *all);
    if (!all) return bd_err_set(detail, BD_ERR_NO_MEMORY, "points", "no memory for their lobes");
    for (uint32_t i = 0; i < sides; i++)
        all[i] = lobes->of_side[i] == BD_NO_LOBE ? BD_NO_LOBE
                                                 : sides + lobes->of_side[i] * BD_SENDING_UINTS;
    memcpy(all + sides, lobes->sending, lobes->count * sizeof *lobes->sending);
    const enum bd_err err = bd_buf_create(d->context->gpu, "lobes of points", uints * sizeof *all,
                                          all, &d->lobes, detail);
    free(all);
    return err;
}

static enum bd_err make_buffers(struct bd_point_gather_device *d, struct bd_err_detail *detail)
{
    struct bd_gpu *gpu = d->context->gpu;
    enum bd_err err = bd_buf_create_unset(
        gpu, "cuts of points", most_clusters(d) * sizeof *d->all_clusters, &d->clusters, detail);
    if (!err)
        err = bd_buf_create_unset(gpu, "who asks points", ASKERS_AT_ONCE * sizeof *d->all_askers,
                                  &d->askers, detail);
    if (!err)
        err = bd_buf_create_unset(gpu, "light by points", ASKERS_AT_ONCE * light_bytes(d),
                                  &d->light, detail);
    return err;
}

enum bd_err bd_point_gather_device_begin(const struct bd_pass_context *context,
                                         const struct bd_point_gather_inputs *inputs,
                                         const struct bd_microbuffer *map, bool spread,
                                         struct bd_point_gather_device **out,
                                         struct bd_err_detail *detail)
{
    struct bd_point_gather_device *d = *out = calloc(1, sizeof *d);
    if (!d) return bd_err_set(detail, BD_ERR_NO_MEMORY, "points", "no memory to gather");
    *d = (struct bd_point_gather_device){.context = context, .inputs = inputs, .spread = spread};
    if (inputs->points->clusters.count == 0) return BD_ERR_OK;
    struct bd_defines defines = {0};
    bd_define(&defines, "BD_SIDE", (int)map->side);
    if (inputs->points->lobes.count > 0) bd_define(&defines, "BD_LOBES", 1);
    enum bd_err err = bd_compute_get(context->gpu, "pass/point_gather/point_gather.comp", &defines,
                                     &d->program, detail);
    if (!err) err = make_room(d, detail);
    if (!err) err = make_buffers(d, detail);
    if (!err) err = upload_texels(d, map, detail);
    if (!err) err = upload_points(d, detail);
    if (!err) err = upload_lobes(d, detail);
    if (err) bd_point_gather_device_end(out);
    return err;
}

void bd_point_gather_device_end(struct bd_point_gather_device **device)
{
    struct bd_point_gather_device *d = *device;
    *device = NULL;
    if (!d) return;
    struct bd_buf **bufs[] = {&d->points, &d->names,    &d->radiance, &d->lobes,
                              &d->texels, &d->clusters, &d->askers,   &d->light};
    void *rooms[] = {d->cuts, d->all_clusters, d->all_askers, d->asker_is, d->all_light};
    for (size_t i = 0; i < sizeof bufs / sizeof *bufs; i++)
        bd_buf_destroy(d->context->gpu, bufs[i]);
    for (size_t i = 0; i < sizeof rooms / sizeof *rooms; i++) free(rooms[i]);
    free(d);
}

// --- who asks -----------------------------------------------------------------------------------

static void cut_set(void *user, uint32_t i)
{
    const struct bd_point_gather_device *d = user;
    const struct bd_receiver_set set = bd_receiver_set_at(d->sets, d->first_set + i);
    struct set_cuts *cuts = &d->cuts[i];
    bd_point_surfaces_of(d->part, &set, &cuts->surfaces);
    for (uint32_t k = 0; k < cuts->surfaces.count; k++)
        bd_point_clusters_cut(&d->inputs->points->clusters, d->inputs->clusters,
                              &cuts->surfaces.about[k].view, &cuts->of[k]);
}

static struct bd_point_asker asker_of(const struct bd_point_gather_device *d, uint32_t place_of)
{
    const uint32_t group = place_of / BD_LANES, lane = place_of % BD_LANES;
    const struct bd_ray_starts *starts = &d->part->starts[group];
    const struct bd_receivers *receivers = &d->part->receivers[group];
    const struct bd_native_place place = bd_point_gather_place(d->inputs, starts, lane);
    struct bd_point_asker asker = {
        .chance = place.chance,
        .radius = d->spread ? receivers->radius[lane] : 0,
        .off_plane = receivers->off_plane[lane],
    };
    f3_store(asker.position, place.position);
    f3_store(asker.across, place.across);
    f3_store(asker.along, place.along);
    f3_store(asker.up, place.normal);
    f3_store(asker.normal, f3_at(&receivers->normal, lane));
    return asker;
}

struct filled {
    uint32_t clusters, askers;
};

static void add_surface(struct bd_point_gather_device *d, uint32_t i, uint32_t surface,
                        struct filled *filled)
{
    const struct bd_receiver_set set = bd_receiver_set_at(d->sets, d->first_set + i);
    const struct bd_point_cut *cut = &d->cuts[i].of[surface];
    const uint32_t first_cluster = filled->clusters;
    for (uint32_t k = 0; k < cut->count; k++)
        d->all_clusters[filled->clusters++] = cut->clusters[k];
    for (uint32_t place = 0; place < set.count; place++) {
        if (d->cuts[i].surfaces.of_place[place] != surface) continue;
        struct bd_point_asker asker = asker_of(d, set.places[place]);
        asker.first_cluster = first_cluster;
        asker.cluster_count = cut->count;
        d->asker_is[filled->askers] = set.places[place];
        d->all_askers[filled->askers++] = asker;
    }
}

static enum bd_err list_askers(struct bd_point_gather_device *d, uint32_t set_count,
                               uint32_t *count)
{
    struct filled filled = {0};
    const enum bd_err err = bd_pool_run(d->inputs->pool, set_count, cut_set, NULL, d);
    for (uint32_t i = 0; !err && i < set_count; i++)
        for (uint32_t k = 0; k < d->cuts[i].surfaces.count; k++) add_surface(d, i, k, &filled);
    bd_buf_upload(d->context->gpu, d->clusters, 0, d->all_clusters,
                  filled.clusters * sizeof *d->all_clusters);
    bd_buf_upload(d->context->gpu, d->askers, 0, d->all_askers,
                  filled.askers * sizeof *d->all_askers);
    *count = filled.askers;
    return err;
}

// --- their light --------------------------------------------------------------------------------

static void bind(const struct bd_point_gather_device *d, const struct bd_point_gather_args *args,
                 struct bd_bindings *bindings)
{
    bd_bind_storage(bindings, BD_STORAGE_POINTS, d->points, true, false);
    bd_bind_storage(bindings, BD_STORAGE_POINT_NAMES, d->names, true, false);
    bd_bind_storage(bindings, BD_STORAGE_POINT_RADIANCE, d->radiance, true, false);
    bd_bind_storage(bindings, BD_STORAGE_POINT_TEXELS, d->texels, true, false);
    bd_bind_storage(bindings, BD_STORAGE_POINT_CLUSTERS, d->clusters, true, false);
    bd_bind_storage(bindings, BD_STORAGE_POINT_ASKERS, d->askers, true, false);
    bd_bind_storage(bindings, BD_STORAGE_POINT_LIGHT, d->light, false, true);
    if (d->lobes) bd_bind_storage(bindings, BD_STORAGE_POINT_LOBES, d->lobes, true, false);
    bindings->uniforms[BD_UNIFORM_ARGS].bytes = args;
    bindings->uniforms[BD_UNIFORM_ARGS].size_bytes = sizeof *args;
}

static enum bd_err light_askers(struct bd_point_gather_device *d, uint32_t count)
{
    const double units = bd_point_gather_units(d->inputs);
    struct bd_point_gather_args args = {
        .explore = d->inputs->explore,
        .exploit = d->inputs->exploit,
        .all = d->inputs->projection == BD_PROJECTION_ALL,
        .is_uniform = d->inputs->projection == BD_PROJECTION_UNIFORM,
        .area = d->inputs->points->clusters.area,
        .rays = d->inputs->rays,
    };
    struct bd_bindings bindings = {0};
    bind(d, &args, &bindings);
    enum bd_err err = BD_ERR_OK;
    bd_slicer_work(d->context->slicer, "project points");
    for (uint32_t askers; !err && args.first_asker < count; args.first_asker += askers) {
        askers = bd_list_slice(d->context->slicer, units, count - args.first_asker);
        bd_gpu_dispatch(d->context->gpu, d->program, &bindings, askers, 1, 1);
        err = bd_slicer_checkpoint(d->context->slicer, units * askers);
    }
    return err;
}

static enum bd_err keep_light(const struct bd_point_gather_device *d, uint32_t count)
{
    const size_t slots = bd_map_ray_slots(d->inputs);
    const enum bd_err err =
        bd_buf_read(d->context->gpu, d->light, 0, d->all_light, count * light_bytes(d));
    for (uint32_t i = 0; !err && i < count; i++) {
        const struct bd_point_light *from = (const void *)(d->all_light + i * light_bytes(d));
        struct bd_receiver_light *to = &d->part->light[d->asker_is[i] / BD_LANES];
        const uint32_t lane = d->asker_is[i] % BD_LANES;
        f3_add_at(&to->irradiance, lane, f3_loaded(from->irradiance));
        f3_add_at(&to->vector, lane, f3_loaded(from->vector));
        f3_add_at(&to->noise, lane, f3_loaded(from->noise));
        to->spread[lane] += from->spread;
        if (slots > 0)
            memcpy(d->chosen + d->asker_is[i] * slots, from + 1, slots * sizeof *d->chosen);
    }
    return err;
}

enum bd_err bd_point_gather_device_light(struct bd_point_gather_device *d,
                                         const struct bd_receiver_part *part,
                                         const struct bd_receiver_sets *sets,
                                         struct bd_map_ray *chosen)
{
    enum bd_err err = BD_ERR_OK;
    d->part = part;
    d->sets = sets;
    d->chosen = chosen;
    if (!d->program) return BD_ERR_OK;
    for (d->first_set = 0; !err && d->first_set < sets->count; d->first_set += SETS_AT_ONCE) {
        const uint32_t left = sets->count - d->first_set;
        uint32_t askers = 0;
        err = list_askers(d, left < SETS_AT_ONCE ? left : SETS_AT_ONCE, &askers);
        if (!err) err = light_askers(d, askers);
        if (!err) err = keep_light(d, askers);
    }
    return err;
}
