// Technique `isr`, image-space radiosity (algorithms.md A2.3): one diffuse bounce from VPLs that
// stand for blocks of each light's map, large where the map is smooth, gathered at fragments.
//
// Paper:  Nichols, Shopf and Wyman 2009, 3.4
// Exact when: as `multires_gather` is
// Known:  what is known of `multires_gather`; `vpls` is the number of the largest blocks: how many
//         VPLs there are in all changes with the light, and shows in the frame's report; light of
//         receivers' specular lobes is left out (`glossy_as_diffuse`)

#include "technique/fragment_light.h"

static enum bd_err light_fragments(const struct bd_pass_context *context,
                                   const struct bd_technique_inputs *inputs,
                                   struct bd_indirect **out, struct bd_err_detail *detail)
{
    return bd_fragment_light(context, inputs, "gather", bd_fragments_gather, out, detail);
}

static const struct bd_technique_pass passes[] = {BD_FRAGMENT_PASSES, {NULL, 0}};
static const struct bd_param_default defaults[] = {BD_DEFAULT_VISIBILITY};
static const char *const ladder[] = {
    "vpls=64 cluster_levels=1 depth_threshold=0.2 normal_threshold=1",
    "vpls=256 cluster_levels=2 depth_threshold=0.1 normal_threshold=0.5",
    "vpls=1024 cluster_levels=2 depth_threshold=0.05 normal_threshold=0.25",
    "vpls=1024 cluster_levels=3 depth_threshold=0.05 normal_threshold=0.25",
    "vpls=4096 cluster_levels=3 depth_threshold=0.02 normal_threshold=0.1",
    "vpls=16384 cluster_levels=3 depth_threshold=0.01 normal_threshold=0.05",
    "vpls=65536 cluster_levels=2 depth_threshold=0.01 normal_threshold=0.05",
    "vpls=65536 cluster_levels=2 depth_threshold=0.005 normal_threshold=0.02",
    "vpls=65536 cluster_levels=2 depth_threshold=0 normal_threshold=0",
    NULL,
};

const struct bd_technique bd_technique_isr = {
    .name = "isr",
    .summary =
        "one bounce from blocks of each light's view, large where it is smooth, gathered once "
        "for each smooth block of pixels",
    .model = {.indirect_bounces = 1,
              .lights = BD_LIGHTS_ALL,
              .indirect_lights = BD_LIGHTS_ALL,
              .transmission = true,
              .coverage = true},
    .inputs = BD_INPUT_VPL_CLUSTERS | BD_INPUT_FRAGMENTS,
    .passes = passes,
    .params_read = BD_READS_VPL_GRID | BD_READS_LIGHT_PATHS | BD_READS_VISIBILITY |
                   BD_READS_FRAGMENTS | BD_READS(BD_PARAM_LIGHT_THRESHOLD) |
                   BD_READS(BD_PARAM_VISIT) | BD_READS(BD_PARAM_CLUSTER_LEVELS) |
                   BD_READS(BD_PARAM_CLUSTER_DEPTH_THRESHOLD) |
                   BD_READS(BD_PARAM_CLUSTER_NORMAL_THRESHOLD) | BD_READS(BD_PARAM_SUB_FRAMES),
    .defaults = defaults,
    .default_count = sizeof defaults / sizeof *defaults,
    .tolerance = {.direct = 1e-3, .indirect = 1e-2},
    .hazard_codes = "TN",
    .ladder = ladder,
    .indirect = light_fragments,
    .light_pixels = bd_fragments_gather,
};
