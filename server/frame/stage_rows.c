#include "frame/stage_rows.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "frame/memo.h"
#include "frame/stages.h"
#include "frame/sub_frames.h"

// --- who needs it, and why not ---------------------------------------------------------------

static bool is_reference(const struct bd_plan *plan)
{
    return plan->technique->is_reference;
}

static bool is_filtered(const struct bd_plan *plan)
{
    return plan->technique->is_reference && plan->params.noise_filter;
}

static bool is_rendered(const struct bd_plan *plan)
{
    return !plan->technique->is_reference;
}

static bool is_lit(const struct bd_plan *plan)
{
    return plan->light_count > 0 && is_rendered(plan) && !plan->punctuals_by_rays;
}

static bool is_indirect(const struct bd_plan *plan)
{
    return plan->indirect;
}

static bool has_rays(const struct bd_plan *plan)
{
    return plan->rays || plan->light_paths || bd_plan_asks_processor(plan);
}

static bool has_area_lights(const struct bd_plan *plan)
{
    return plan->area_lights;
}

static bool has_punctuals(const struct bd_plan *plan)
{
    return plan->punctuals_by_rays;
}

static bool is_lit_by_rays(const struct bd_plan *plan)
{
    return plan->area_lights || plan->punctuals_by_rays;
}

static bool is_shared(const struct bd_plan *plan)
{
    return plan->shared;
}

static bool takes(const struct bd_plan *plan, uint32_t inputs)
{
    return (plan->technique->inputs & inputs) != 0;
}

static bool reflects_punctuals(const struct bd_plan *plan)
{
    return plan->indirect && plan->light_count > 0 && !plan->punctuals_by_rays;
}

static bool has_light_paths(const struct bd_plan *plan)
{
    return plan->light_paths;
}

static bool has_env_maps(const struct bd_plan *plan)
{
    return plan->images;
}

static bool has_photons(const struct bd_plan *plan)
{
    return plan->photons;
}

static bool has_points(const struct bd_plan *plan)
{
    return plan->points;
}

static bool has_map(const struct bd_plan *plan)
{
    return reflects_punctuals(plan) && takes(plan, BD_INPUT_VPL_GRID | BD_INPUT_VPL_CLUSTERS);
}

static bool has_grid(const struct bd_plan *plan)
{
    return reflects_punctuals(plan) && takes(plan, BD_INPUT_VPL_GRID);
}

static bool has_clusters(const struct bd_plan *plan)
{
    return reflects_punctuals(plan) && takes(plan, BD_INPUT_VPL_CLUSTERS);
}

static bool has_tree(const struct bd_plan *plan)
{
    return reflects_punctuals(plan) && takes(plan, BD_INPUT_VPL_TREE);
}

static bool has_order(const struct bd_plan *plan)
{
    return bd_plan_gathers_in_order(plan) || (plan->shows_glass && plan->indirect);
}

static bool shows_glass(const struct bd_plan *plan)
{
    return plan->shows_glass;
}

static bool has_imperfect_shadows(const struct bd_plan *plan)
{
    return plan->imperfect;
}

static bool has_fragments(const struct bd_plan *plan)
{
    return plan->indirect && takes(plan, BD_INPUT_FRAGMENTS);
}

static const char *no_light(const struct bd_plan *plan)
{
    if (plan->punctuals_by_rays) return "many punctual lights: by rays";
    return is_rendered(plan) ? "no punctual light shines" : NULL;
}

static const char *no_rays(const struct bd_plan *plan)
{
    if (!bd_plan_reads(plan, BD_PARAM_INDIRECT_VISIBILITY) || is_reference(plan)) return NULL;
    if (plan->imperfect) return "indirect_visibility=ism";
    return is_indirect(plan) ? "indirect_visibility=none" : "no light to reflect";
}

static const char *no_area_light(const struct bd_plan *plan)
{
    if (!is_rendered(plan)) return NULL;
    return plan->params.light_rays ? "no surface emits, no sky shines" : "light_rays=0";
}

static const char *no_filter(const struct bd_plan *plan)
{
    return is_reference(plan) ? "noise_filter=off" : NULL;
}

static const char *no_indirect(const struct bd_plan *plan)
{
    if (!is_rendered(plan)) return NULL;
    return plan->technique->indirect ? "no light to reflect"
                                     : "the technique has no indirect light";
}

static const char *no_map(const struct bd_plan *plan)
{
    if (plan->points) return "rays light points";
    if (plan->follows) return "photons find where light first falls";
    return plan->indirect ? no_light(plan) : no_indirect(plan);
}

static const char *no_light_paths(const struct bd_plan *plan)
{
    if (!plan->area_lights || !plan->technique->indirect) return NULL;
    return "the technique has no indirect light of emitters and skies";
}

static const char *no_env_maps(const struct bd_plan *plan)
{
    return plan->photons ? "intersections=rays" : NULL;
}

static const char *no_photons(const struct bd_plan *plan)
{
    return takes(plan, BD_INPUT_PHOTONS) ? no_indirect(plan) : NULL;
}

static const char *no_points(const struct bd_plan *plan)
{
    return takes(plan, BD_INPUT_POINTS) ? no_indirect(plan) : NULL;
}

static const char *no_grid(const struct bd_plan *plan)
{
    return takes(plan, BD_INPUT_VPL_CLUSTERS) ? NULL : no_map(plan);
}

static const char *no_clusters(const struct bd_plan *plan)
{
    return takes(plan, BD_INPUT_VPL_CLUSTERS) ? no_map(plan) : NULL;
}

static const char *no_tree(const struct bd_plan *plan)
{
    return takes(plan, BD_INPUT_VPL_TREE) ? no_map(plan) : NULL;
}

static const char *no_order(const struct bd_plan *plan)
{
    if (!plan->rays && !plan->imperfect) return no_rays(plan);
    return plan->chosen ? NULL : "every VPL is asked";
}

static const char *no_fragments(const struct bd_plan *plan)
{
    return takes(plan, BD_INPUT_FRAGMENTS) ? no_indirect(plan) : NULL;
}

// --- parts that are left out ------------------------------------------------------------------

static bool has_no_map(const struct bd_plan *plan, const struct bd_features *f)
{
    (void)plan;
    return !f->has_base_color_map && !f->has_metallic_roughness_map && !f->has_normal_map &&
           !f->has_emissive_map;
}

static bool is_opaque(const struct bd_plan *plan, const struct bd_features *f)
{
    (void)plan;
    return !f->has_mask && !f->has_blend;
}

static bool emits_nothing(const struct bd_plan *plan, const struct bd_features *f)
{
    (void)f;
    return !plan->emission;
}

static const struct bd_stage_part parts_of_surfaces[] = {
    {has_no_map, "texture code: no material has a map"},
    {is_opaque, "alpha code: every material is opaque"},
    {emits_nothing, "emission: no surface emits"},
    {NULL, NULL},
};

static bool tests_no_depth(const struct bd_plan *plan, const struct bd_features *f)
{
    (void)f;
    return plan->params.depth_test == BD_DEPTH_TEST_OFF;
}

static bool takes_any_depth(const struct bd_plan *plan, const struct bd_features *f)
{
    return !tests_no_depth(plan, f) && isinf(plan->params.depth_threshold);
}

static bool tests_no_normal(const struct bd_plan *plan, const struct bd_features *f)
{
    (void)f;
    return plan->params.normal_test == BD_NORMAL_TEST_OFF;
}

static bool takes_any_normal(const struct bd_plan *plan, const struct bd_features *f)
{
    return !tests_no_normal(plan, f) && isinf(plan->params.normal_threshold);
}

static const struct bd_stage_part parts_of_tests[] = {
    {tests_no_depth, "depth pyramid: depth_test=off"},
    {takes_any_depth, "depth pyramid: depth_threshold=inf"},
    {tests_no_normal, "normal pyramid: normal_test=off"},
    {takes_any_normal, "normal pyramid: normal_threshold=inf"},
    {NULL, NULL},
};

// --- what becomes of outputs ------------------------------------------------------------------

#define OUTPUT(what, type)                                                                         \
    static uint64_t what##_bytes(const void *output)                                               \
    {                                                                                              \
        return bd_##type##_bytes(output);                                                          \
    }                                                                                              \
    static void destroy_##what(void *renderer, void *output)                                       \
    {                                                                                              \
        struct bd_##type *own = output;                                                            \
        bd_##type##_destroy(((struct bd_renderer *)renderer)->gpu, &own);                          \
    }

OUTPUT(shadow_map, shadow_map)
OUTPUT(rsm, rsm)
OUTPUT(vpls, vpl_list)
OUTPUT(order, vpl_list)
OUTPUT(tree, vpl_tree)
OUTPUT(shadow_points, shadow_points)
OUTPUT(imperfect_shadows, imperfect_shadows)
OUTPUT(light_paths, light_paths)
OUTPUT(env_maps, env_maps)
OUTPUT(photons, photons)
OUTPUT(lit_points, lit_points)
OUTPUT(gbuffer, gbuffer)
OUTPUT(direct, direct)
OUTPUT(area_light, area_direct)
OUTPUT(discontinuity, discontinuity)
OUTPUT(fragments, fragments)
OUTPUT(surfaces, surfaces)
OUTPUT(indirect, indirect)
OUTPUT(occluders, occluders)
OUTPUT(glass, indirect)

static uint64_t emitters_bytes(const void *output)
{
    return bd_area_lights_bytes(output);
}

static void destroy_emitters(void *renderer, void *output)
{
    (void)renderer;
    struct bd_area_lights *own = output;
    bd_area_lights_destroy(&own);
}

static uint64_t lamps_bytes(const void *output)
{
    return bd_punctual_tree_bytes(output);
}

static void destroy_lamps(void *renderer, void *output)
{
    (void)renderer;
    struct bd_punctual_tree *own = output;
    bd_punctual_tree_destroy(&own);
}

#define KEEPS(what, in, place, run_it)                                                             \
    .run = run_it, .bytes = what##_bytes, .destroy = destroy_##what,                               \
    .output = offsetof(struct bd_##in, place)

// --- the rows ---------------------------------------------------------------------------------

#define ASPECT(name) BD_ASPECT_BIT(name)
#define STAGE(name)  BD_STAGE_BIT(name)
#define PARAM(name)  BD_READS(BD_PARAM_##name)

#define READS_PLACES    (ASPECT(GEOMETRY) | ASPECT(TRANSFORMS) | ASPECT(ALPHA))
#define READS_FACING    (ASPECT(SIDES) | ASPECT(NORMALS))
#define READS_BRDF      (ASPECT(COLOUR) | ASPECT(METALNESS) | ASPECT(ROUGHNESS))
#define PARAMS_OF_VPL   (PARAM(VPL_KERNEL) | PARAM(NEAR_FIELD))
#define PARAMS_OF_TESTS (PARAM(DEPTH_TEST) | PARAM(NORMAL_TEST) | PARAM(NEIGHBOURHOOD))
#define STAGES_OF_VPLS                                                                             \
    (STAGE(VPL_GRID) | STAGE(VPL_CLUSTERS) | STAGE(VPL_TREE) | STAGE(LIGHT_PATHS) |                \
     STAGE(VPL_ORDER))

#define STAGES_OF_SCREEN (STAGE(GBUFFER) | STAGE(DIRECT) | STAGE(AREA_LIGHT))

// Rows keep their places when one grows.
// clang-format off
const struct bd_stage_row bd_stage_rows[BD_STAGE_COUNT] = {
    [BD_STAGE_BVH] =
        {
            .pass = "bvh",
            .is_needed = is_reference,
            .reads = READS_PLACES | ASPECT(NORMALS),
        },
    [BD_STAGE_TRACE] = {.pass = "trace", .is_needed = is_reference, .is_keyless = true},
    [BD_STAGE_FILTER] = {.pass = "filter",
                         .is_needed = is_filtered,
                         .why_not = no_filter,
                         .is_keyless = true},
    [BD_STAGE_SEEN] = {.is_needed = is_rendered,
                       .reads = READS_PLACES | READS_FACING | BD_READ_VIEW | BD_READ_VIEW_TRACING},
    [BD_STAGE_GBUFFER] =
        {
            .pass = "gbuffer",
            .of = BD_STAGE_OF_EACH,
            .is_needed = is_rendered,
            .parts = parts_of_surfaces,
            .from = STAGE(SEEN),
            .reads = READS_BRDF | ASPECT(EMISSION) | BD_READ_EMISSION_UNIT,
            .glass = ASPECT(MEDIUM),
            .params = PARAM(BRDF),
            KEEPS(gbuffer, frame, made.gbuffer, bd_run_gbuffer),
        },
    [BD_STAGE_SHADOW_MAP] =
        {
            .pass = "shadow_map",
            .of = BD_STAGE_OF_LIGHT,
            .is_needed = is_lit,
            .why_not = no_light,
            .reads = READS_PLACES | BD_READ_LIGHT_SHAPE | BD_READ_SHADOW_TRACING,
            .params = PARAM(SHADOW_SIZE),
            KEEPS(shadow_map, frame_light, shadow_map, bd_run_shadow_map),
        },
    [BD_STAGE_DIRECT] =
        {
            .pass = "direct",
            .of = BD_STAGE_OF_EACH,
            .is_needed = is_lit,
            .why_not = no_light,
            .from = STAGE(SEEN) | STAGE(SHADOW_MAP),
            .reads = READS_BRDF | BD_READ_LIGHT_POWER | BD_READ_FALLEN,
            .glass = ASPECT(MEDIUM),
            .params = PARAM(BRDF) | PARAM(EXECUTOR),
            KEEPS(direct, frame, made.direct, bd_run_direct),
        },
    [BD_STAGE_RAYS] =
        {
            .pass = "bvh",
            .is_needed = has_rays,
            .why_not = no_rays,
            .reads = READS_PLACES,
            .tracing = ASPECT(SIDES),
            KEEPS(occluders, frame, occluders, bd_run_rays),
        },
    [BD_STAGE_EMITTERS] =
        {
            .pass = "emitters",
            .is_needed = has_area_lights,
            .why_not = no_area_light,
            .reads = READS_PLACES | ASPECT(SIDES) | ASPECT(EMISSION) | ASPECT(ENVIRONMENT),
            KEEPS(emitters, frame, emitters, bd_run_emitters),
        },
    [BD_STAGE_LAMPS] =
        {
            .pass = "lamps",
            .is_needed = has_punctuals,
            .reads = READS_PLACES | BD_READ_LIGHT_SHAPE | BD_READ_LIGHT_POWER,
            KEEPS(lamps, frame, lamps, bd_run_lamps),
        },
    [BD_STAGE_AREA_LIGHT] =
        {
            .pass = "area_light",
            .of = BD_STAGE_OF_EACH,
            .is_needed = is_lit_by_rays,
            .why_not = no_area_light,
            .from = STAGE(SEEN) | STAGE(RAYS) | STAGE(EMITTERS) | STAGE(LAMPS),
            .reads = READS_BRDF | BD_READ_LIGHT_SEED | BD_READ_UNIT | BD_READ_FALLEN,
            .glass = ASPECT(MEDIUM),
            .params = PARAM(BRDF) | PARAM(LIGHT_RAYS) | PARAM(NOISE_FILTER) | PARAM(ALPHA),
            KEEPS(area_light, frame, made.area_light, bd_run_area_light),
        },
    [BD_STAGE_RSM] =
        {
            .pass = "rsm",
            .of = BD_STAGE_OF_LIGHT,
            .is_needed = has_map,
            .why_not = no_map,
            .reads = READS_PLACES | READS_FACING | ASPECT(COLOUR) | ASPECT(METALNESS) |
                     BD_READ_LIGHT_SHAPE | BD_READ_LIGHT_SIDES | BD_READ_RSM_TRACING,
            .params = PARAM(BRDF) | PARAM(PAPER_MODE),
            KEEPS(rsm, frame_light, rsm, bd_run_rsm),
        },
    [BD_STAGE_VPL_GRID] =
        {
            .pass = "vpl_grid",
            .of = BD_STAGE_OF_LIGHT,
            .is_needed = has_grid,
            .why_not = no_grid,
            .from = STAGE(RSM),
            .reads = BD_READ_LIGHT_POWER | BD_READ_LIGHT_SIDES,
            .params = PARAMS_OF_VPL,
            KEEPS(vpls, frame_light, vpls, bd_run_vpl_grid),
        },
    [BD_STAGE_VPL_CLUSTERS] =
        {
            .pass = "vpl_clusters",
            .of = BD_STAGE_OF_LIGHT,
            .is_needed = has_clusters,
            .why_not = no_clusters,
            .from = STAGE(RSM),
            .reads = BD_READ_LIGHT_POWER | BD_READ_LIGHT_SIDES | BD_READ_CLUSTERS_MOST,
            .params = PARAMS_OF_VPL | PARAMS_OF_TESTS | PARAM(CLUSTER_LEVELS) |
                      PARAM(CLUSTER_DEPTH_THRESHOLD) | PARAM(CLUSTER_NORMAL_THRESHOLD),
            KEEPS(vpls, frame_light, vpls, bd_run_vpl_clusters),
        },
    [BD_STAGE_VPL_TREE] =
        {
            .pass = "vpl_tree",
            .of = BD_STAGE_OF_LIGHT,
            .is_needed = has_tree,
            .why_not = no_tree,
            .from = STAGE(VPL_GRID),
            .params = PARAM(TREE_ROOTS) | PARAM(EXECUTOR),
            KEEPS(tree, frame_light, tree, bd_run_vpl_tree),
        },
    [BD_STAGE_LIGHT_PATHS] =
        {
            .pass = "light_paths",
            .is_needed = has_light_paths,
            .why_not = no_light_paths,
            .from = STAGE(RAYS) | STAGE(EMITTERS) | STAGE(LAMPS),
            .reads = READS_PLACES | ASPECT(SIDES) | ASPECT(COLOUR) | ASPECT(METALNESS) |
                     BD_READ_UNIT | BD_READ_PATH_COUNT | BD_READ_PHOTON_SEED,
            .glass = ASPECT(MEDIUM) | ASPECT(ROUGHNESS),
            .walking = BD_READ_LIGHT_SHAPE | BD_READ_LIGHT_POWER,
            .gathering = ASPECT(ROUGHNESS),
            .params = PARAMS_OF_VPL | PARAM(BRDF) | PARAM(ALPHA) | PARAM(EXECUTOR) |
                      PARAM(INDIRECT_BOUNCES) | PARAM(WALK_VPLS) | PARAM(CLAMP) | PARAM(CAUSTICS) |
                      PARAM(PHOTONS),
            KEEPS(light_paths, frame, light_paths, bd_run_light_paths),
        },
    [BD_STAGE_ENV_MAPS] =
        {
            .pass = "env_maps",
            .is_needed = has_env_maps,
            .why_not = no_env_maps,
            .reads = READS_PLACES | ASPECT(SIDES) | BD_READ_ENV_TRACING,
            .glass = ASPECT(MEDIUM),
            .params = PARAM(ENV_MAPS) | PARAM(ENV_MAP_SIZE),
            KEEPS(env_maps, frame, env_maps, bd_run_env_maps),
        },
    [BD_STAGE_PHOTONS] =
        {
            .pass = "photons",
            .is_needed = has_photons,
            .why_not = no_photons,
            .from = STAGE(RAYS) | STAGE(ENV_MAPS) | STAGE(EMITTERS),
            .reads = READS_PLACES | ASPECT(SIDES) | READS_BRDF | BD_READ_UNIT |
                     BD_READ_PHOTON_SEED | BD_READ_LIGHT_SHAPE | BD_READ_LIGHT_POWER,
            .glass = ASPECT(MEDIUM),
            .params = PARAM(BRDF) | PARAM(ALPHA) | PARAM(INDIRECT_BOUNCES) | PARAM(CAUSTICS) |
                      PARAM(PHOTONS) | PARAM(PHOTON_RADIUS) | PARAM(PAPER_MODE),
            KEEPS(photons, frame, photons, bd_run_photons),
        },
    [BD_STAGE_POINTS] =
        {
            .pass = "points",
            .second_pass = "point_clusters",
            .is_needed = has_points,
            .why_not = no_points,
            .from = STAGE(RAYS) | STAGE(EMITTERS),
            .reads = READS_PLACES | ASPECT(SIDES) | READS_BRDF | BD_READ_UNIT |
                     BD_READ_PHOTON_SEED | BD_READ_LIGHT_SHAPE | BD_READ_LIGHT_POWER,
            .glass = ASPECT(MEDIUM),
            .params = PARAM(BRDF) | PARAM(ALPHA) | PARAM(INDIRECT_BOUNCES) | PARAM(POINTS) |
                      PARAM(CLUSTERS) | PARAM(EXPLORE) | PARAM(CACHE_CELLS) | PARAM(CAUSTICS) |
                      PARAM(PHOTONS) | PARAM(PAPER_MODE),
            .brackets_itself = true,
            KEEPS(lit_points, frame, points, bd_run_points),
        },
    [BD_STAGE_VPL_ORDER] =
        {
            .pass = "vpl_order",
            .is_needed = has_order,
            .why_not = no_order,
            .from = STAGE(VPL_GRID) | STAGE(VPL_CLUSTERS) | STAGE(LIGHT_PATHS),
            KEEPS(order, frame, order, bd_run_vpl_order),
        },
    [BD_STAGE_SHADOW_POINTS] =
        {
            .pass = "shadow_points",
            .is_needed = has_imperfect_shadows,
            .reads = READS_PLACES,
            .glass = ASPECT(MEDIUM),
            .params = PARAM(ISM_POINTS) | PARAM(ALPHA) | PARAM(EXECUTOR),
            KEEPS(shadow_points, frame, shadow_points, bd_run_shadow_points),
        },
    [BD_STAGE_IMPERFECT_SHADOWS] =
        {
            .pass = "imperfect_shadows",
            .is_needed = has_imperfect_shadows,
            .from = STAGES_OF_VPLS | STAGE(SHADOW_POINTS),
            .params = PARAM(ISM_SIZE) | PARAM(EXECUTOR),
            KEEPS(imperfect_shadows, frame, imperfect_shadows, bd_run_imperfect_shadows),
        },
    [BD_STAGE_DISCONTINUITY] =
        {
            .pass = "discontinuity",
            .of = BD_STAGE_OF_WHOLE,
            .is_needed = has_fragments,
            .why_not = no_fragments,
            .parts = parts_of_tests,
            .from = STAGE(SEEN),
            .params = PARAMS_OF_TESTS | PARAM(DEPTH_THRESHOLD) | PARAM(NORMAL_THRESHOLD) |
                      PARAM(SURFACE_DETAIL) | PARAM(COARSEST) | PARAM(FINEST),
            KEEPS(discontinuity, frame, made.discontinuity, bd_run_discontinuity),
        },
    [BD_STAGE_FRAGMENTS] =
        {
            .pass = "fragments",
            .of = BD_STAGE_OF_WHOLE,
            .is_needed = has_fragments,
            .why_not = no_fragments,
            .from = STAGE(DISCONTINUITY),
            KEEPS(fragments, frame, made.fragments, bd_run_fragments),
        },
    [BD_STAGE_SURFACES] =
        {
            .pass = "surfaces",
            .of = BD_STAGE_OF_WHOLE,
            .is_needed = has_fragments,
            .why_not = no_fragments,
            .from = STAGE(DISCONTINUITY),
            KEEPS(surfaces, frame, made.surfaces, bd_run_surfaces),
        },
    [BD_STAGE_INDIRECT] =
        {
            .of = BD_STAGE_OF_WHOLE,
            .is_needed = is_indirect,
            .why_not = no_indirect,
            .from = STAGE(SEEN) | STAGES_OF_VPLS | STAGE(ENV_MAPS) | STAGE(PHOTONS) | STAGE(POINTS) |
                    STAGE(FRAGMENTS) | STAGE(SURFACES) | STAGE(RAYS) | STAGE(IMPERFECT_SHADOWS) |
                    STAGES_OF_SCREEN,
            .reads = BD_READ_SEED,
            .glossy = READS_BRDF,
            .glass = READS_BRDF | ASPECT(MEDIUM),
            .reads_all_params = true,
            .brackets_itself = true,
            KEEPS(indirect, frame, made.indirect, bd_run_indirect),
        },
    [BD_STAGE_SHARE] =
        {
            .pass = "share",
            .of = BD_STAGE_OF_SHARER,
            .is_needed = is_shared,
            .from = STAGE(GBUFFER) | STAGE(DIRECT) | STAGE(INDIRECT),
            .reads = BD_READ_ALONE,
            .brackets_itself = true,
            KEEPS(indirect, frame, made.indirect, bd_run_share),
        },
    [BD_STAGE_GLASS] =
        {
            .pass = "glass",
            .of = BD_STAGE_OF_EACH,
            .is_needed = shows_glass,
            .from = STAGE(SEEN) | STAGE(RAYS) | STAGE(EMITTERS) | STAGE(VPL_ORDER) |
                    STAGE(IMPERFECT_SHADOWS),
            .reads = READS_BRDF | ASPECT(MEDIUM) | BD_READ_UNIT | BD_READ_LIGHT_SHAPE |
                     BD_READ_LIGHT_POWER | BD_READ_LIGHT_SEED,
            .params = PARAM(BRDF) | PARAM(ALPHA) | PARAM(LIGHT_RAYS) | PARAM(INDIRECT_VISIBILITY),
            .brackets_itself = true,
            KEEPS(glass, frame, made.glass, bd_run_glass),
        },
    [BD_STAGE_COMPOSITE] = {.pass = "composite",
                            .of = BD_STAGE_OF_EACH,
                            .is_needed = is_rendered,
                            .is_keyless = true},
    [BD_STAGE_READBACK] = {.pass = "readback", .is_needed = is_rendered, .is_keyless = true},
};
// clang-format on

// --- names ------------------------------------------------------------------------------------

static uint32_t what_holds(const struct bd_plan *plan)
{
    return (plan->glossy ? BD_WHEN_GLOSSY : 0) | (plan->rough ? BD_WHEN_ROUGH : 0) |
           (plan->rays || plan->imperfect ? BD_WHEN_ASKED : 0) |
           (plan->chosen ? BD_WHEN_CHOSEN : 0) | (plan->filtered ? BD_WHEN_FILTERED : 0) |
           (plan->from_screen ? BD_WHEN_SCREEN : 0) | (plan->short_rays ? BD_WHEN_SHORT : 0) |
           (plan->caustics ? BD_WHEN_CAUSTICS : 0) | BD_WHEN_FIRST;
}

uint32_t bd_stage_passes(const struct bd_plan *plan, enum bd_stage stage,
                         const char *names[BD_STAGE_PASSES_MAX])
{
    const struct bd_stage_row *row = &bd_stage_rows[stage];
    uint32_t count = 0;
    if (row->pass) names[count++] = row->pass;
    if (row->second_pass) names[count++] = row->second_pass;
    if (stage != BD_STAGE_INDIRECT) return count;
    const struct bd_technique_pass *pass = plan->technique->passes;
    for (; pass && pass->name; pass++) {
        if (pass->when & ~what_holds(plan)) continue;
        BD_ASSERT_CMP(count, <, BD_STAGE_PASSES_MAX);
        names[count++] = pass->name;
    }
    return count;
}

// --- what keys are about ----------------------------------------------------------------------

static void set_up_lights(struct bd_subject *subject)
{
    const struct bd_scene *scene = subject->scene;
    subject->lights = calloc(scene->placed_light_count + 1, sizeof *subject->lights);
    BD_ASSERT(subject->lights);
    for (uint32_t i = 0; i < scene->placed_light_count; i++) {
        if (!bd_plan_light_shines(subject->plan, scene, i)) continue;
        struct bd_frame_light *light = &subject->lights[subject->light_count++];
        light->setup = bd_light_setup_of(scene, i);
        light->grid_side = bd_plan_grid_side(subject->plan, &light->setup);
        light->rsm_size = bd_plan_rsm_size(subject->plan, &light->setup, light->grid_side);
        light->clusters_most =
            bd_plan_clusters_most(subject->plan, &light->setup, light->grid_side);
    }
}

struct bd_subject bd_subject_of(const struct bd_scene *scene, const struct bd_plan *plan,
                                const struct bd_frame_request *request)
{
    struct bd_subject subject = {.scene = scene,
                                 .plan = plan,
                                 .unit_cd_m2 = bd_render_space_of(scene).unit_cd_m2,
                                 .seed = request->seed,
                                 .alone = request->aa == 1};
    set_up_lights(&subject);
    subject.viewpoint = bd_viewpoint_of(scene, &request->pose, (uint32_t)plan->camera,
                                        request->width_px, request->height_px);
    bd_sub_frame_place(&subject.viewpoint, 0);
    return subject;
}

void bd_subject_finish(struct bd_subject *subject)
{
    free(subject->lights);
    subject->lights = NULL;
    subject->light_count = 0;
}

// --- keys -------------------------------------------------------------------------------------
//
// Fields one by one: structs have padding, and padding has no value.

static uint64_t key_dvec3(uint64_t key, bd_dvec3 v)
{
    const double numbers[3] = {v.x, v.y, v.z};
    return bd_key_bytes(key, numbers, sizeof numbers);
}

static uint64_t key_shape(uint64_t key, const struct bd_light_setup *setup)
{
    const double numbers[] = {setup->half_width, setup->half_height, setup->depth_m,
                              setup->light->cone_inner, setup->light->cone_outer};
    key = key_dvec3(key, setup->placement.position);
    key = key_dvec3(key, setup->placement.axis_x);
    key = key_dvec3(key, setup->placement.axis_y);
    key = key_dvec3(key, setup->placement.axis_z);
    key = bd_key_bytes(key, numbers, sizeof numbers);
    return bd_key_number(key, (uint64_t)setup->light->kind << 8 | setup->face_count);
}

static uint64_t key_power(uint64_t key, const struct bd_light_setup *setup, double unit_cd_m2)
{
    const float numbers[] = {setup->light->color[0], setup->light->color[1], setup->light->color[2],
                             setup->light->intensity, setup->light->range_m};
    key = bd_key_bytes(key, numbers, sizeof numbers);
    return bd_key_bytes(key, &unit_cd_m2, sizeof unit_cd_m2);
}

static uint64_t key_light(uint64_t key, const struct bd_subject *subject, uint32_t reads,
                          const struct bd_frame_light *light)
{
    if (reads & BD_READ_LIGHT_SHAPE) key = key_shape(key, &light->setup);
    if (reads & BD_READ_LIGHT_POWER) key = key_power(key, &light->setup, subject->unit_cd_m2);
    if (reads & BD_READ_LIGHT_SIDES)
        key = bd_key_number(key, (uint64_t)light->rsm_size << 32 | light->grid_side);
    const struct bd_plan *plan = subject->plan;
    const uint64_t shadow_texels = bd_light_setup_texels(&light->setup, plan->params.shadow_size);
    const uint64_t rsm_texels = bd_light_setup_texels(&light->setup, light->rsm_size);
    if (reads & BD_READ_SHADOW_TRACING)
        key = bd_key_number(key, bd_plan_traces(plan, shadow_texels));
    if (reads & BD_READ_RSM_TRACING) key = bd_key_number(key, bd_plan_traces(plan, rsm_texels));
    if (reads & BD_READ_CLUSTERS_MOST) key = bd_key_number(key, light->clusters_most);
    return key;
}

static uint64_t key_view(uint64_t key, const struct bd_viewpoint *v)
{
    const double numbers[] = {v->half_width, v->half_height, v->near_m,
                              v->far_m,      v->sample_x_px, v->sample_y_px};
    key = key_dvec3(key, v->position_m);
    key = key_dvec3(key, v->axis_x);
    key = key_dvec3(key, v->axis_y);
    key = key_dvec3(key, v->axis_z);
    key = bd_key_bytes(key, numbers, sizeof numbers);
    key = bd_key_number(key, (uint64_t)v->sub_frame << 1 | v->orthographic);
    return bd_key_number(key, (uint64_t)v->width_px << 32 | v->height_px);
}

// A later round's filters smooth less.
static uint64_t key_seed(uint64_t key, const struct bd_subject *subject)
{
    key = bd_key_number(key, subject->seed);
    return subject->round ? bd_key_number(key, subject->round) : key;
}

// What a row reads of the scene and its view.
static uint64_t key_reads(uint64_t key, const struct bd_subject *subject, uint32_t reads,
                          const struct bd_frame_light *light)
{
    for (uint32_t i = 0; i < BD_ASPECT_COUNT; i++)
        if (reads >> i & 1) key = bd_key_number(key, subject->scene->aspects.counter[i]);
    for (uint32_t i = 0; i < (light ? 1 : subject->light_count); i++)
        key = key_light(key, subject, reads, light ? light : &subject->lights[i]);
    if (reads & BD_READ_VIEW) key = key_view(key, &subject->viewpoint);
    const uint64_t pixels = (uint64_t)subject->viewpoint.width_px * subject->viewpoint.height_px;
    if (reads & BD_READ_VIEW_TRACING)
        key = bd_key_number(key, bd_plan_traces(subject->plan, pixels));
    const struct bd_plan *plan = subject->plan;
    if (reads & BD_READ_SEED && (plan->chosen || plan->follows)) key = key_seed(key, subject);
    if (reads & BD_READ_LIGHT_SEED) key = key_seed(key, subject);
    if (reads & BD_READ_PHOTON_SEED && plan->follows) key = key_seed(key, subject);
    const uint32_t side_px = plan->params.env_map_size;
    if (reads & BD_READ_ENV_TRACING)
        key = bd_key_number(key, (uint64_t)bd_plan_traces(plan, bd_env_map_texels(side_px)) << 1 |
                                     bd_plan_traces(plan, BD_ENV_CHOICE_TEXELS));
    if (reads & BD_READ_FALLEN) key = bd_key_number(key, subject->plan->from_screen);
    if (reads & BD_READ_ALONE) key = bd_key_number(key, subject->alone);
    if (reads & BD_READ_PATH_COUNT)
        key = bd_key_number(key, (uint64_t)bd_plan_light_path_root_side(subject->plan) << 32 |
                                     bd_plan_light_path_count(subject->plan));
    if (reads & BD_READ_PATH_COUNT) key = bd_key_number(key, bd_plan_photon_vpl_count(subject->plan));
    if (reads & BD_READ_PATH_COUNT)
        key = bd_key_number(key, bd_plan_reads(subject->plan, BD_PARAM_CLAMP));
    if (reads & BD_READ_UNIT)
        key = bd_key_bytes(key, &subject->unit_cd_m2, sizeof subject->unit_cd_m2);
    const double emission_unit = subject->plan->emission ? subject->unit_cd_m2 : 0;
    if (reads & BD_READ_EMISSION_UNIT)
        key = bd_key_bytes(key, &emission_unit, sizeof emission_unit);
    return key;
}

static uint64_t key_from(uint64_t key, const struct bd_subject *subject, enum bd_stage from,
                         const struct bd_frame_light *light)
{
    if (light || bd_stage_rows[from].of != BD_STAGE_OF_LIGHT)
        return bd_key_number(key, bd_stage_key(subject, from, light));
    for (uint32_t i = 0; i < subject->light_count; i++)
        key = bd_key_number(key, bd_stage_key(subject, from, &subject->lights[i]));
    return key;
}

// Occluders that only look for lights hide no indirect light, and what is not sent on from the
// screen makes none.
static bool is_made_from(const struct bd_plan *plan, enum bd_stage stage, enum bd_stage from)
{
    const bool indirect = stage == BD_STAGE_INDIRECT;
    if (indirect && from == BD_STAGE_RAYS && !plan->rays) return false;
    if (indirect && STAGES_OF_SCREEN >> from & 1 && !plan->from_screen) return false;
    return bd_stage_rows[stage].from >> from & 1 && bd_plan_has(plan, from);
}

uint64_t bd_stage_key(const struct bd_subject *subject, enum bd_stage stage,
                      const struct bd_frame_light *light)
{
    const struct bd_plan *plan = subject->plan;
    const struct bd_stage_row *row = &bd_stage_rows[stage];
    const uint32_t walking = plan->bounces > 1 || plan->final_gather ? row->walking : 0;
    const uint32_t gathering = plan->final_gather ? row->gathering : 0;
    const uint32_t tracing = plan->tracing != BD_TRACING_NONE ? row->tracing : 0;
    const uint32_t glossy = plan->glossy || plan->rough ? row->glossy : 0;
    const uint32_t glass = plan->glass || plan->panes ? row->glass : 0;
    const uint32_t also = glossy | glass | walking | gathering | tracing;
    uint64_t key = bd_key_begin(row->reads_all_params ? plan->technique->name : "");
    key = bd_key_number(key, (uint64_t)stage << 32 | also);
    key = key_reads(key, subject, row->reads | also, light);
    if (plan->veils) key = bd_key_number(key, BD_RAYS_ALPHA_ANY);
    if (stage == BD_STAGE_RAYS) key = bd_key_number(key, bd_plan_asks_processor(plan));
    if (glass)
        key = bd_key_number(key, (uint64_t)plan->glass | (uint64_t)plan->panes << 1 |
                                     (uint64_t)plan->straight << 2);
    key = bd_params_hash(&plan->params,
                         row->reads_all_params ? plan->technique->params_read : row->params, key);
    for (enum bd_stage from = 0; from < BD_STAGE_COUNT; from++)
        if (is_made_from(plan, stage, from)) key = key_from(key, subject, from, light);
    return key;
}
