#include "pass/light_paths.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "lights/surface_points.h"
#include "pass/area_samples.h"
#include "pass/light_patches.h"
#include "pass/light_walk.h"
#include "pass/receivers.h"

#define POINTS_PER_VPL 16u
#define POINTS_LEAST   16384u
#define POINTS_MOST    131072u
// Photons of lamps are as many as points, and more of them tell little: 8,192 VPLs of 256 spots in
// Sponza, 12.9 and 12.0 % of the indirect light, 285 and 150 ms.
#define POINTS_MOST_OF_LAMPS 65536u
#define RAYS_PER_POINT       4u
// Points whose rays are on their way at once.
#define POINTS_AT_ONCE 4096u
// Of the slicer, one for each evaluation of a VPL.
#define UNITS_PER_RAY 60.0

struct paths {
    struct bd_pass_context context;
    const struct bd_light_paths_inputs *inputs;
    struct bd_area_sampling sampling;
    struct bd_surface_points points;
    // Of the points on their way.
    uint32_t first, at_once;
    struct bd_segment *segments;
    struct bd_area_light_found *found;
    uint32_t *occluded;
    // Of all points.
    f3 *irradiance;
    struct bd_fault *fault;
};

// --- their light --------------------------------------------------------------------------------

static void sample_group(void *user, uint32_t group)
{
    const struct paths *p = user;
    const size_t rays = p->sampling.rays;
    for (uint32_t lane = 0; lane < BD_LANES; lane++) {
        const uint32_t i = group * BD_LANES + lane;
        memset(p->segments + i * rays, 0, rays * sizeof *p->segments);
        memset(p->found + i * rays, 0, rays * sizeof *p->found);
        if (i >= p->at_once) continue;
        const struct bd_surface_point *point = &p->points.points[p->first + i];
        const struct bd_area_receiver at = {
            .position = point->position,
            .normal = point->normal,
            .normal_geometric = point->normal,
            .viewer = point->normal,
            .triangle = point->triangle,
            .place = p->first + i,
        };
        struct bd_area_shares shares = {0};
        bd_area_sample(&p->sampling, &at, 0, p->segments + i * rays, p->found + i * rays, NULL,
                       &shares);
    }
}

static void sum_rays(struct paths *p)
{
    const size_t rays = p->sampling.rays;
    for (uint32_t i = 0; i < p->at_once; i++) {
        f3 sum = f3_of(0, 0, 0);
        for (size_t r = i * rays; r < (i + 1) * rays; r++)
            if (!(p->occluded[r / 32] >> r % 32 & 1)) sum = f3_add(sum, p->found[r].irradiance);
        p->irradiance[p->first + i] = sum;
    }
}

static enum bd_err light_points(struct paths *p)
{
    struct bd_ray_counts traced = {0};
    enum bd_err err = BD_ERR_OK;
    for (p->first = 0; !err && p->first < p->points.count; p->first += p->at_once) {
        const uint32_t left = p->points.count - p->first;
        p->at_once = left < POINTS_AT_ONCE ? left : POINTS_AT_ONCE;
        const uint32_t groups = (p->at_once + BD_LANES - 1) / BD_LANES;
        bd_slicer_work(p->context.slicer, "area sample");
        err = bd_receivers_each(&p->context, groups, UNITS_PER_RAY * BD_LANES * p->sampling.rays,
                                sample_group, p);
        if (!err)
            err = bd_visibility_ask(&p->context, &p->inputs->visibility, p->segments,
                                    (size_t)groups * BD_LANES * p->sampling.rays, p->occluded,
                                    &traced, p->fault);
        if (!err) sum_rays(p);
    }
    return err;
}

// --- the pass -----------------------------------------------------------------------------------

static enum bd_err no_memory(const struct paths *p)
{
    return bd_fault_set(p->fault, BD_ERR_NO_MEMORY, "vpls", "no memory for %u light paths",
                        p->inputs->count);
}

static enum bd_err spread_points(struct paths *p)
{
    uint32_t count = POINTS_PER_VPL * p->inputs->count;
    if (count < POINTS_LEAST) count = POINTS_LEAST;
    const uint32_t most = p->inputs->lamps_fall ? POINTS_MOST_OF_LAMPS : POINTS_MOST;
    if (count > most) count = most;
    bd_slicer_work(p->context.slicer, "surface points");
    return bd_surface_points_init(&p->points, p->inputs->snapshot, count, p->inputs->lambert,
                                  bd_slicer_pause, p->context.slicer, p->fault);
}

static enum bd_err make_room(struct paths *p)
{
    const size_t rays = (size_t)POINTS_AT_ONCE * p->sampling.rays;
    p->segments = malloc(rays * sizeof *p->segments);
    p->found = malloc(rays * sizeof *p->found);
    p->occluded = malloc((rays + 31) / 32 * sizeof *p->occluded);
    p->irradiance = calloc(p->points.count + 1, sizeof *p->irradiance);
    const bool all = p->segments && p->found && p->occluded && p->irradiance;
    return all ? BD_ERR_OK : no_memory(p);
}

static enum bd_err make_tree(const struct bd_pass_context *context,
                             const struct bd_light_paths_inputs *inputs,
                             const struct bd_light_patches *patches, struct bd_light_paths *paths,
                             struct bd_fault *fault)
{
    const struct bd_vpl_tree_inputs tree = {
        .leaves = paths->vpls,
        .leaf_side = (uint32_t)lround(sqrt(inputs->count)),
        .face_count = 1,
        .root_side = inputs->root_side,
        .space = &inputs->scene->space,
        .area = patches->area,
        .flux = patches->flux,
    };
    return bd_vpl_tree_run(context, &tree, &paths->tree, fault);
}

static enum bd_err write_vpls(const struct bd_pass_context *context, const struct paths *p,
                              struct bd_light_paths *paths)
{
    const struct bd_light_paths_inputs *in = p->inputs;
    const struct bd_light_patches_inputs how = {
        .points = &p->points,
        .irradiance = p->irradiance,
        .count = in->count,
        .kernel = in->kernel,
        .near_field = in->near_field,
        .root_side = in->root_side,
        .slicer = context->slicer,
    };
    struct bd_light_patches patches;
    enum bd_err err = bd_light_patches_init(&patches, &how, p->fault);
    if (err) return err;
    err = bd_vpl_list_create(context->gpu, in->count, &paths->vpls, p->fault);
    if (!err) {
        bd_buf_upload(context->gpu, paths->vpls->vpls, 0, patches.lights,
                      in->count * sizeof *patches.lights);
        bd_buf_upload(context->gpu, paths->vpls->quads, 0, patches.quads,
                      in->count * sizeof *patches.quads);
    }
    if (!err && in->root_side > 0) err = make_tree(context, in, &patches, paths, p->fault);
    bd_light_patches_finish(&patches);
    return err;
}

static enum bd_err walk(struct paths *p)
{
    const struct bd_light_walk_inputs inputs = {
        .snapshot = p->inputs->snapshot,
        .points = &p->points,
        .visibility = p->inputs->visibility,
        .lamps = p->inputs->lamps,
        .lamp_count = p->inputs->lamp_count,
        .lamps_fall = p->inputs->lamps_fall,
        .reflections = p->inputs->reflections,
        .lambert = p->inputs->lambert,
    };
    return bd_light_walk_run(&p->context, &inputs, &p->irradiance, p->fault);
}

static enum bd_err find_points(struct paths *p)
{
    enum bd_err err = spread_points(p);
    if (!err) err = make_room(p);
    if (!err && p->inputs->lights) err = light_points(p);
    if (!err && (p->inputs->reflections > 0 || p->inputs->lamps_fall)) err = walk(p);
    return err ? err : bd_slicer_pause(p->context.slicer);
}

enum bd_err bd_light_paths_run(const struct bd_pass_context *context,
                               const struct bd_light_paths_inputs *inputs,
                               struct bd_light_paths **out, struct bd_fault *fault)
{
    BD_ASSERT(inputs->count > 0 && inputs->count <= BD_LIGHT_PATHS_MAX);
    const struct bd_render_space *space = &inputs->scene->space;
    const struct bd_processor processor = {inputs->visibility.pool, NULL};
    struct paths p = {
        .context = *context,
        .inputs = inputs,
        .sampling = inputs->lights ? bd_area_sampling_of(inputs->lights, 2 * RAYS_PER_POINT, 0)
                                   : (struct bd_area_sampling){0},
        .fault = fault,
    };
    p.context.processor = &processor;
    p.sampling.reach = 1.01f * (float)space->radius;
    p.sampling.from_cd_m2 = (float)(1 / space->unit_cd_m2);
    p.sampling.lambert = true;
    *out = calloc(1, sizeof **out);
    BD_ASSERT(*out);
    enum bd_err err = find_points(&p);
    if (!err) err = write_vpls(context, &p, *out);
    if (err) bd_light_paths_destroy(context->gpu, out);
    bd_surface_points_finish(&p.points);
    free(p.segments);
    free(p.found);
    free(p.occluded);
    free(p.irradiance);
    return err;
}

void bd_light_paths_destroy(struct bd_gpu *gpu, struct bd_light_paths **paths)
{
    if (!*paths) return;
    bd_vpl_list_destroy(gpu, &(*paths)->vpls);
    bd_vpl_tree_destroy(gpu, &(*paths)->tree);
    free(*paths);
    *paths = NULL;
}

uint64_t bd_light_paths_bytes(const struct bd_light_paths *paths)
{
    return bd_vpl_list_bytes(paths->vpls) + (paths->tree ? bd_vpl_tree_bytes(paths->tree) : 0);
}
