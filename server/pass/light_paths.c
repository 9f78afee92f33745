#include "pass/light_paths.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "lights/surface_points.h"
#include "pass/area_samples.h"
#include "pass/caustic_photons.h"
#include "pass/far.h"
#include "pass/first_vpls.h"
#include "pass/light_patches.h"
#include "pass/light_walk.h"
#include "pass/receivers.h"
#include "pass/straight.h"
#include "pass/vpl_order.h"

#define POINTS_PER_VPL 16u
#define POINTS_LEAST   16384u
#define POINTS_MOST    131072u
// Photons of punctual lights are as many as points, and more of them tell little: 8,192 VPLs of 256
// spots in Sponza, 12.9 and 12.0 % of the indirect light, 285 and 150 ms.
#define POINTS_MOST_OF_PUNCTUALS 65536u
#define RAYS_PER_POINT           4u
// Of those that a final gather asks for.
#define POINTS_PER_WALK_VPL 4u
// Points whose rays are on their way at once.
#define POINTS_AT_ONCE 4096u
// Of the slicer, one for each evaluation of a VPL.
#define UNITS_PER_RAY 60.0

struct paths {
    struct bd_pass_context context;      // with the pool's threads, whatever the device
    const struct bd_pass_context *frame; // whose it is
    const struct bd_light_paths_inputs *inputs;
    struct bd_area_sampling sampling;
    struct bd_surface_points points;
    // Of the points on their way.
    uint32_t first, at_once;
    struct bd_segment *segments;
    struct bd_area_light_found *found;
    uint32_t *occluded;
    struct bd_lit_points lit;
    struct bd_err_detail *detail;
};

static enum bd_err no_memory(const struct paths *p)
{
    return bd_err_set(p->detail, BD_ERR_NO_MEMORY, "vpls", "no memory for %u light paths",
                      p->inputs->count);
}

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
        bd_area_sample(&p->sampling, &at, 1, p->segments + i * rays, p->found + i * rays, NULL,
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
        p->lit.others[p->first + i] = sum;
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
            err = bd_straight_ask(&p->context, &p->inputs->visibility, p->segments,
                                  (size_t)groups * BD_LANES * p->sampling.rays, p->occluded,
                                  &p->found->irradiance, BD_AREA_LIGHT_PARTS, &traced, p->detail);
        if (!err) sum_rays(p);
    }
    return err;
}

// What comes to them of the sky round by glass, along which no segment to it goes.
static enum bd_err light_behind(struct paths *p)
{
    const struct bd_light_paths_inputs *in = p->inputs;
    const struct bd_first_light lights = {.lights = in->lights, .space = &in->scene->space};
    const struct bd_far_inputs far = {.snapshot = in->snapshot,
                                      .visibility = &in->visibility,
                                      .first = &lights,
                                      .rays = RAYS_PER_POINT,
                                      .seed = in->seed,
                                      .sends = in->sends,
                                      .glass = BD_GLASS_SHOWS_SKY};
    struct bd_ray_counts traced = {0};
    p->lit.behind = calloc(p->points.count + 1, sizeof *p->lit.behind);
    if (!p->lit.behind) return no_memory(p);
    for (uint32_t i = 0; i < p->points.count; i++) p->points.points[i].number = i;
    return bd_far_of_points(&p->context, &far, p->points.points, p->points.count, p->lit.behind,
                            &traced, p->detail);
}

// --- points -------------------------------------------------------------------------------------

static uint32_t points_of(const struct bd_light_paths_inputs *in)
{
    uint32_t count = POINTS_PER_VPL * in->count;
    if (in->walk_vpls > 0) count = POINTS_PER_WALK_VPL * in->walk_vpls;
    const uint32_t least = in->walk_vpls > 0 ? 1 : POINTS_LEAST;
    const uint32_t most = in->punctuals_fall ? POINTS_MOST_OF_PUNCTUALS : POINTS_MOST;
    return count < least ? least : count > most ? most : count;
}

static enum bd_err spread_points(struct paths *p)
{
    const struct bd_surface_points_how how = {
        .count = points_of(p->inputs),
        .sends = p->inputs->sends,
        .by_coverage = p->inputs->visibility.alpha == BD_RAYS_ALPHA_COVERAGE,
    };
    bd_slicer_work(p->context.slicer, "surface points");
    return bd_surface_points_init(&p->points, p->inputs->snapshot, &how, bd_slicer_pause,
                                  p->context.slicer, p->detail);
}

static enum bd_err make_room(struct paths *p)
{
    const size_t rays = (size_t)POINTS_AT_ONCE * p->sampling.rays;
    p->segments = malloc(rays * sizeof *p->segments);
    p->found = malloc(rays * sizeof *p->found);
    p->occluded = malloc((rays + 31) / 32 * sizeof *p->occluded);
    p->lit.others = calloc(p->points.count + 1, sizeof *p->lit.others);
    const bool all = p->segments && p->found && p->occluded && p->lit.others;
    return all ? BD_ERR_OK : no_memory(p);
}

static enum bd_err make_tree(const struct bd_pass_context *context,
                             const struct bd_light_paths_inputs *inputs,
                             const struct bd_light_patches *patches, struct bd_light_paths *paths,
                             struct bd_err_detail *detail)
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
    return bd_vpl_tree_run(context, &tree, &paths->tree, detail);
}

// What VPLs send on is of all that they have room for: maps hold where punctual lights' light first
// falls, a final gather has lists of its own for what comes further.
static f3 *irradiance_of_vpls(struct paths *p)
{
    f3 *sum = malloc((p->points.count + 1) * sizeof *sum);
    BD_ASSERT(sum);
    for (uint32_t i = 0; i < p->points.count; i++) {
        sum[i] = p->lit.others[i];
        if (p->inputs->walk_vpls > 0) continue;
        if (p->lit.first && p->inputs->punctuals_fall) sum[i] = f3_add(sum[i], p->lit.first[i]);
        if (p->lit.further) sum[i] = f3_add(sum[i], p->lit.further[i]);
    }
    return sum;
}

static enum bd_err upload_list(struct paths *p, const void *lights, const void *quads,
                               uint32_t count, struct bd_vpl_list **out)
{
    struct bd_gpu *gpu = p->context.gpu;
    enum bd_err err = bd_vpl_list_create(gpu, count, out, p->detail);
    if (err || count == 0) return err;
    bd_buf_upload(gpu, (*out)->vpls, 0, lights, count * BD_VPL_VEC4S * sizeof(struct bd_vec4));
    bd_buf_upload(gpu, (*out)->quads, 0, quads, count * BD_VPL_QUAD_VEC4S * sizeof(struct bd_vec4));
    return BD_ERR_OK;
}

// Of the points, and what comes to them.
static enum bd_err write_patches(struct paths *p, const f3 *irradiance, uint32_t count,
                                 struct bd_vpl_list **list, struct bd_light_paths *paths)
{
    const struct bd_light_paths_inputs *in = p->inputs;
    const struct bd_light_patches_inputs how = {
        .points = &p->points,
        .irradiance = irradiance,
        .count = count,
        .kernel = in->kernel,
        .near_field = in->near_field,
        .root_side = in->root_side,
        .slicer = p->context.slicer,
    };
    struct bd_light_patches patches;
    enum bd_err err = bd_light_patches_init(&patches, &how, p->detail);
    if (err) return err;
    err = upload_list(p, patches.lights, patches.quads, count, list);
    if (!err && in->root_side > 0) err = make_tree(p->frame, in, &patches, paths, p->detail);
    bd_light_patches_finish(&patches);
    return err;
}

static enum bd_err write_vpls(struct paths *p, struct bd_light_paths *paths)
{
    if (p->inputs->count == 0) return BD_ERR_OK;
    f3 *irradiance = irradiance_of_vpls(p);
    const enum bd_err err = write_patches(p, irradiance, p->inputs->count, &paths->vpls, paths);
    free(irradiance);
    return err;
}

// --- for a final gather -------------------------------------------------------------------------

static enum bd_err too_many(const struct paths *p, uint32_t photons)
{
    return bd_err_set(p->detail, BD_ERR_LIMIT, "vpls", "vpls=%u; with a final gather at most %u",
                      photons, BD_FIRST_VPLS_MAX);
}

static enum bd_err write_first(struct paths *p, struct bd_vpl_list **list)
{
    const struct bd_light_paths_inputs *in = p->inputs;
    const struct bd_first_vpls_inputs how = {
        .snapshot = in->snapshot,
        .visibility = &in->visibility,
        .punctuals = in->punctuals,
        .punctual_count = in->punctual_count,
        .emitters = in->lights,
        .from_cd_m2 = p->sampling.from_cd_m2,
        .of_punctuals = in->punctual_vpls,
        .of_emitters = in->emitter_vpls,
        .seed = in->seed,
        .sends = in->sends,
        .glass = in->photons > 0 || in->visibility.panes,
        .straight_alone = in->photons == 0,
    };
    if (in->punctual_vpls > BD_FIRST_VPLS_MAX) return too_many(p, in->punctual_vpls);
    if (in->emitter_vpls > BD_FIRST_VPLS_MAX) return too_many(p, in->emitter_vpls);
    const uint32_t count = in->punctual_vpls + in->emitter_vpls;
    struct bd_vec4(*lights)[BD_VPL_VEC4S] = malloc((count + 1) * sizeof *lights);
    struct bd_vec4(*quads)[BD_VPL_QUAD_VEC4S] = malloc((count + 1) * sizeof *quads);
    enum bd_err err = BD_ERR_OK;
    if (!lights || !quads)
        err = bd_err_set(p->detail, BD_ERR_NO_MEMORY, "vpls", "no memory for %u photons", count);
    if (!err) err = bd_first_vpls_run(&p->context, &how, lights, quads, p->detail);
    if (!err) err = upload_list(p, lights, quads, count, list);
    free(lights);
    free(quads);
    return err;
}

// The sky's patches belong to the first set.
static enum bd_err put_in_order(struct paths *p, const struct bd_vpl_list *first,
                                const struct bd_vpl_list *walked, struct bd_light_paths *paths)
{
    const struct bd_vpl_list *all[3] = {first, walked, paths->vpls};
    const struct bd_vpl_list *of_first[2] = {first, paths->vpls};
    const uint32_t sky = paths->vpls ? 1 : 0;
    const struct bd_vpl_order_how soft = {.radius = (float)p->inputs->scene->space.radius,
                                          .softness = BD_VPLS_SOFT};
    const struct bd_vpl_order_how clamped = {
        .radius = soft.radius, .softness = BD_VPLS_CLAMPED, .clamp = p->inputs->clamp};
    enum bd_err err =
        bd_vpl_order_run(&p->context, of_first, 1 + sky, &soft, &paths->first, p->detail);
    if (!err) err = bd_vpl_order_run(&p->context, all, 2 + sky, &soft, &paths->all, p->detail);
    if (err || !p->inputs->clamped) return err;
    return bd_vpl_order_run(&p->context, all, 2 + sky, &clamped, &paths->clamped, p->detail);
}

static enum bd_err write_sets(struct paths *p, struct bd_light_paths *paths)
{
    struct bd_vpl_list *first = NULL, *walked = NULL;
    enum bd_err err = write_first(p, &first);
    if (!err) err = write_patches(p, p->lit.further, p->inputs->walk_vpls, &walked, paths);
    if (!err) err = put_in_order(p, first, walked, paths);
    bd_vpl_list_destroy(p->context.gpu, &first);
    bd_vpl_list_destroy(p->context.gpu, &walked);
    bd_vpl_list_destroy(p->context.gpu, &paths->vpls);
    return err;
}

// Of what comes to the points further, which is kept.
static enum bd_err keep_points(struct paths *p, struct bd_light_paths *paths)
{
    bd_slicer_work(p->context.slicer, "point tree");
    f3 *further = p->lit.further;
    p->lit.further = NULL;
    return bd_irradiance_points_create(&p->points, further, bd_slicer_pause, p->context.slicer,
                                       &paths->further, p->detail);
}

static enum bd_err write_lists(struct paths *p, struct bd_light_paths *paths)
{
    enum bd_err err = write_vpls(p, paths);
    if (err || p->inputs->walk_vpls == 0) return err;
    err = write_sets(p, paths);
    return err ? err : keep_points(p, paths);
}

static enum bd_err send_photons(struct paths *p, struct bd_light_paths *paths)
{
    const struct bd_light_paths_inputs *in = p->inputs;
    const struct bd_caustic_photons_inputs how = {
        .snapshot = in->snapshot,
        .visibility = &in->visibility,
        .punctuals = in->punctuals,
        .punctual_count = in->punctual_count,
        .emitters = in->lights && in->lights->count > 0 ? in->lights : NULL,
        .from_cd_m2 = (float)(1 / in->scene->space.unit_cd_m2),
        .sends = in->sends,
        .count = in->photons,
        .seed = in->seed,
    };
    return bd_caustic_photons_run(&p->context, &how, &paths->caustics, &paths->caustics_again,
                                  p->detail);
}

// --- the pass -----------------------------------------------------------------------------------

static enum bd_err walk(struct paths *p)
{
    const struct bd_light_walk_inputs inputs = {
        .snapshot = p->inputs->snapshot,
        .points = &p->points,
        .visibility = p->inputs->visibility,
        .punctuals = p->inputs->punctuals,
        .punctual_count = p->inputs->punctual_count,
        .reflections = p->inputs->reflections,
        .sends = p->inputs->sends,
        .glass = p->inputs->glass,
        .caustics_are_first = p->inputs->photons > 0,
        .emitters = p->inputs->walk_vpls > 0 ? p->inputs->lights : NULL,
        .from_cd_m2 = p->sampling.from_cd_m2,
        .seed = p->inputs->walk_vpls > 0 ? bd_askers_seed(p->inputs->seed) : 0,
    };
    return bd_light_walk_run(&p->context, &inputs, &p->lit, p->detail);
}

static enum bd_err find_points(struct paths *p)
{
    const struct bd_light_paths_inputs *in = p->inputs;
    enum bd_err err = spread_points(p);
    if (!err) err = make_room(p);
    if (!err && p->sampling.lights && bd_area_lights_shine(p->sampling.lights))
        err = light_points(p);
    const bool looks_through_all =
        in->visibility.panes && in->visibility.straight == BD_STRAIGHT_ALL;
    if (!err && in->glass && !looks_through_all && in->lights && in->lights->sky.shines)
        err = light_behind(p);
    if (!err && (in->reflections > 0 || in->punctuals_fall || in->walk_vpls > 0)) err = walk(p);
    return err ? err : bd_slicer_pause(p->context.slicer);
}

enum bd_err bd_light_paths_run(const struct bd_pass_context *context,
                               const struct bd_light_paths_inputs *inputs,
                               struct bd_light_paths **out, struct bd_err_detail *detail)
{
    BD_ASSERT(inputs->count > 0 || inputs->walk_vpls > 0);
    BD_ASSERT(inputs->count <= BD_LIGHT_PATHS_MAX);
    const struct bd_render_space *space = &inputs->scene->space;
    const struct bd_processor processor = {inputs->visibility.pool, NULL};
    struct paths p = {
        .context = *context,
        .frame = context,
        .inputs = inputs,
        .sampling = inputs->lights ? bd_area_sampling_of(inputs->lights, 2 * RAYS_PER_POINT, 0)
                                   : (struct bd_area_sampling){0},
        .detail = detail,
    };
    p.context.processor = &processor;
    // Of a final gather emitters' photons find what they light.
    struct bd_area_lights sky = inputs->lights ? *inputs->lights : (struct bd_area_lights){0};
    sky.count = 0;
    if (inputs->lights && inputs->walk_vpls > 0) p.sampling.lights = &sky;
    p.sampling.reach = 1.01f * (float)space->radius;
    p.sampling.from_cd_m2 = (float)(1 / space->unit_cd_m2);
    p.sampling.lambert = true;
    *out = calloc(1, sizeof **out);
    BD_ASSERT(*out);
    enum bd_err err = find_points(&p);
    if (!err) err = write_lists(&p, *out);
    if (!err && inputs->photons > 0) err = send_photons(&p, *out);
    if (err) bd_light_paths_destroy(context->gpu, out);
    bd_surface_points_finish(&p.points);
    free(p.segments);
    free(p.found);
    free(p.occluded);
    free(p.lit.behind);
    free(p.lit.others);
    free(p.lit.first);
    free(p.lit.further);
    return err;
}

void bd_light_paths_destroy(struct bd_gpu *gpu, struct bd_light_paths **paths)
{
    if (!*paths) return;
    bd_vpl_list_destroy(gpu, &(*paths)->vpls);
    bd_vpl_list_destroy(gpu, &(*paths)->first);
    bd_vpl_list_destroy(gpu, &(*paths)->all);
    bd_vpl_list_destroy(gpu, &(*paths)->clamped);
    bd_vpl_tree_destroy(gpu, &(*paths)->tree);
    bd_irradiance_points_destroy(&(*paths)->further);
    bd_photon_map_destroy(&(*paths)->caustics);
    bd_photon_map_destroy(&(*paths)->caustics_again);
    free(*paths);
    *paths = NULL;
}

static uint64_t list_bytes(const struct bd_vpl_list *list)
{
    return list ? bd_vpl_list_bytes(list) : 0;
}

uint64_t bd_light_paths_bytes(const struct bd_light_paths *paths)
{
    return list_bytes(paths->vpls) + list_bytes(paths->first) + list_bytes(paths->all) +
           list_bytes(paths->clamped) + (paths->tree ? bd_vpl_tree_bytes(paths->tree) : 0) +
           (paths->further ? bd_irradiance_points_bytes(paths->further) : 0) +
           (paths->caustics ? bd_photon_map_bytes(paths->caustics) : 0) +
           (paths->caustics_again ? bd_photon_map_bytes(paths->caustics_again) : 0);
}
