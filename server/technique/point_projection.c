// Technique `point_projection` (algorithms.md A4): light of all kinds, reflected any number of
// times, at points of all surfaces. Each receiver projects some of them into a small map of what it
// sees over its plane, drawn where they may give it much.
//
// Paper:  Maletz, Wang and Bowers 2011. Beyond it: systematic counts, splats by how many were
//         drawn, exact disks and texels, thin edges; a filter that goes by noise; all reflections,
//         by rays between points; points of both sides; lamps of all kinds, however near;
//         glass; lobes of receivers by rays; rays through the map that bring what it misses
//         (pass/map_rays.h). As it has them, up to four lobes of points that send
// Exact when: `points` and `map_rays` grow, for diffuse light
// Known:  without `map_rays` what hides light is a map of a thousand texels: a sixth of Sponza's
//         first reflection is lost, and thin walls let light through. Of blocks of 2 pixels one may
//         show two surfaces: a lamp just under a ceiling

#include "pass/point_gather.h"
#include "technique/far_light.h"
#include "technique/fragment_light.h"
#include "technique/technique.h"

static enum bd_err light_fragments(const struct bd_pass_context *context,
                                   const struct bd_technique_inputs *inputs,
                                   const struct bd_unlit *unlit, struct bd_multires_light **out,
                                   struct bd_err_detail *detail)
{
    const struct bd_params *params = inputs->params;
    const struct bd_gather_fragments_inputs fragments = bd_fragment_inputs(inputs, unlit);
    const struct bd_visibility_inputs visibility = bd_technique_visibility(inputs);
    const struct bd_point_gather_inputs gather = {
        .points = inputs->points,
        .clusters = params->clusters,
        .as_printed = params->paper_mode,
        .explore = params->explore,
        .exploit = params->exploit,
        .side = params->microbuffer,
        .projection = (enum bd_projection)params->projection,
        .rays = params->paper_mode ? 0 : params->map_rays,
        .snapshot = inputs->snapshot,
        .visibility = &visibility,
        .glass = inputs->glass,
        .noise = inputs->filtered,
        .pool = inputs->pool,
        .seed = inputs->seed_of_sub_frame,
    };
    return bd_point_gather_of_fragments(context, &gather, &fragments, out, detail);
}

static enum bd_err light_pixels(const struct bd_pass_context *context,
                                const struct bd_technique_inputs *inputs,
                                const struct bd_unlit *unlit, struct bd_multires_light **out,
                                struct bd_err_detail *detail)
{
    const struct bd_gather_fragments_inputs fragments = bd_fragment_inputs(inputs, unlit);
    const enum bd_err err = light_fragments(context, inputs, unlit, out, detail);
    return err ? err : bd_far_light_add_caustics(context, inputs, &fragments, *out, detail);
}

static enum bd_err light(const struct bd_pass_context *context,
                         const struct bd_technique_inputs *inputs, struct bd_indirect **out,
                         struct bd_err_detail *detail)
{
    enum bd_err err = bd_fragment_light(context, inputs, "project", light_fragments, out, detail);
    if (err) return err;
    bd_ray_counts_add(&(*out)->rays, inputs->points->traced);
    err = bd_far_light_beside(context, inputs, *out, detail);
    if (err) bd_indirect_destroy(context->gpu, out);
    return err;
}

static const struct bd_technique_pass passes[] = {
    {"project", 0},
    {"upsample", 0},
    {"gloss", BD_WHEN_GLOSSY},
    {"rough", BD_WHEN_ROUGH | BD_WHEN_FIRST},
    {"filter", BD_WHEN_FILTERED},
    {"caustics", BD_WHEN_CAUSTICS},
    {NULL, 0},
};
static const struct bd_param_default defaults[] = {
    {BD_PARAM_DEPTH_TEST, BD_DEPTH_TEST_STEP},
    {BD_PARAM_DEPTH_THRESHOLD, 0.01},
    {BD_PARAM_FINEST, 1}, // 2 pixels
    {BD_PARAM_LIGHT_THRESHOLD, 0.2},
    {BD_PARAM_INDIRECT_BOUNCES, 64},
    {BD_PARAM_CACHE_CELLS, 131072},
};
static const char *const ladder[] = {
    "points=65536 exploit=512 explore=1 microbuffer=16 map_rays=16 far_rays=2 depth_threshold=0.02 "
    "normal_threshold=0.5 light_threshold=1 finest=4 light_rays=16",
    "points=262144 exploit=2048 explore=2 microbuffer=32 map_rays=64 far_rays=4 "
    "depth_threshold=0.01 normal_threshold=0.25 light_threshold=0.2 finest=2 light_rays=16",
    "points=262144 exploit=3072 explore=2 microbuffer=32 map_rays=64 far_rays=8 "
    "depth_threshold=0.005 normal_threshold=0.1 light_threshold=0.1 finest=1 light_rays=32",
    "points=524288 exploit=2048 explore=2 microbuffer=32 map_rays=128 far_rays=16 "
    "depth_threshold=0 normal_threshold=0 finest=1 light_rays=32",
    "points=1048576 exploit=16384 explore=2 microbuffer=48 map_rays=512 far_rays=32 "
    "depth_threshold=0 normal_threshold=0 finest=1 light_rays=64",
    NULL,
};

const struct bd_technique bd_technique_point_projection = {
    .name = "point_projection",
    .summary = "all light, any number of reflections: points of surfaces in maps of what is seen",
    .model = {.indirect_bounces = BD_MODEL_BOUNCES_UNLIMITED,
              .indirect_visibility = true,
              .lights = BD_LIGHTS_ALL,
              .glossy_receivers = true,
              .transmission = true,
              .coverage = true,
              .indirect_lights = BD_LIGHTS_ALL},
    .inputs = BD_INPUT_POINTS | BD_INPUT_FRAGMENTS,
    .passes = passes,
    .params_read = BD_READS_DIRECT | BD_READS(BD_PARAM_ALPHA) | BD_READS_LIGHT_PATHS |
                   BD_READS_FRAGMENTS | BD_READS(BD_PARAM_LIGHT_THRESHOLD) |
                   BD_READS(BD_PARAM_FAR_RAYS) | BD_READS(BD_PARAM_SUB_FRAMES) |
                   BD_READS(BD_PARAM_NOISE_FILTER) | BD_READS(BD_PARAM_PAPER_MODE) |
                   BD_READS_CAUSTICS | BD_READS(BD_PARAM_CACHE_CELLS) | BD_READS(BD_PARAM_POINTS) |
                   BD_READS(BD_PARAM_CLUSTERS) | BD_READS(BD_PARAM_EXPLORE) |
                   BD_READS(BD_PARAM_EXPLOIT) | BD_READS(BD_PARAM_MICROBUFFER) |
                   BD_READS(BD_PARAM_PROJECTION) | BD_READS(BD_PARAM_MAP_RAYS),
    .defaults = defaults,
    .default_count = sizeof defaults / sizeof *defaults,
    .tolerance = {.direct = 1e-3, .indirect = 5e-2},
    .hazard_codes = "I",
    .ladder = ladder,
    .is_sampled = true,
    .indirect = light,
    .light_pixels = light_pixels,
    .light_glossy = bd_far_light_anew,
};
