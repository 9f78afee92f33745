// Technique `photon` (algorithms.md A5): light of all kinds, reflected any number of times, as the
// density of photons where they land. Blocks of pixels in which nothing jumps are told once, and
// interpolated between; caustics and specular lobes are told at every pixel, the latter by rays
// that end in cells of photons.
//
// Paper:  Yao, Wang, Chan, Yong and Paul 2010. Beyond it: density by a pilot's radius, whole at
//         edges; roulette by flux; lamps of all kinds; glass that is seen and glass that is passed
// Exact when: `photons` grow: blur and noise shrink with their cube root; thresholds of 0 leave
//         blocks only where depth and normals are the same
// Known:  for diffuse light `many_light` is several times nearer in the same time; a shadow of
//         indirect light is as soft as photons are sparse, and light bleeds round thin walls' edges
//         within that

#include "pass/photon_density.h"
#include "pass/photons.h"
#include "technique/far_light.h"
#include "technique/fragment_light.h"
#include "technique/technique.h"

static enum bd_err light_fragments(const struct bd_pass_context *context,
                                   const struct bd_technique_inputs *inputs,
                                   const struct bd_unlit *unlit, struct bd_multires_light **out,
                                   struct bd_err_detail *detail)
{
    const struct bd_gather_fragments_inputs fragments = bd_fragment_inputs(inputs, unlit);
    const struct bd_visibility_inputs visibility = bd_technique_visibility(inputs);
    const struct bd_photon_density_inputs density = {.map = inputs->photons->global,
                                                     .snapshot = inputs->snapshot,
                                                     .visibility = &visibility,
                                                     .pool = inputs->pool,
                                                     .lambert = inputs->params->lambert,
                                                     .pass = "density"};
    return bd_photon_density_of_fragments(context, &density, &fragments, out, detail);
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
    enum bd_err err = bd_fragment_light(context, inputs, "density", light_fragments, out, detail);
    if (err) return err;
    err = bd_far_light_beside(context, inputs, *out, detail);
    if (err) bd_indirect_destroy(context->gpu, out);
    return err;
}

static const struct bd_technique_pass passes[] = {
    {"density", 0},
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
    {BD_PARAM_INDIRECT_BOUNCES, 64},
};
static const char *const ladder[] = {
    "photons=32768 far_rays=2 depth_threshold=0.02 normal_threshold=0.5 finest=4 light_rays=16",
    "photons=131072 far_rays=4 depth_threshold=0.01 normal_threshold=0.25 finest=2 light_rays=16",
    "photons=524288 far_rays=8 depth_threshold=0.005 normal_threshold=0.1 finest=1 light_rays=32",
    "photons=1048576 far_rays=32 depth_threshold=0 normal_threshold=0 finest=1 light_rays=64",
    NULL,
};

const struct bd_technique bd_technique_photon = {
    .name = "photon",
    .summary = "all light, any number of reflections, as the density of photons",
    .model = {.indirect_bounces = BD_MODEL_BOUNCES_UNLIMITED,
              .indirect_visibility = true,
              .lights = BD_LIGHTS_ALL,
              .glossy_receivers = true,
              .glossy_senders = true,
              .transmission = true,
              .coverage = true,
              .indirect_lights = BD_LIGHTS_ALL},
    .inputs = BD_INPUT_PHOTONS | BD_INPUT_FRAGMENTS,
    .passes = passes,
    .params_read = BD_READS_DIRECT | BD_READS(BD_PARAM_ALPHA) | BD_READS_LIGHT_PATHS |
                   BD_READS_FRAGMENTS | BD_READS(BD_PARAM_FAR_RAYS) |
                   BD_READS(BD_PARAM_SUB_FRAMES) | BD_READS(BD_PARAM_NOISE_FILTER) |
                   BD_READS(BD_PARAM_PAPER_MODE) | BD_READS_CAUSTICS |
                   BD_READS(BD_PARAM_PHOTON_RADIUS) | BD_READS(BD_PARAM_INTERSECTIONS) |
                   BD_READS(BD_PARAM_ENV_MAPS) | BD_READS(BD_PARAM_ENV_MAP_SIZE),
    .defaults = defaults,
    .default_count = sizeof defaults / sizeof *defaults,
    .tolerance = {.direct = 1e-3, .indirect = 5e-2}, // blur at edges, noise of few photons
    .hazard_codes = "P",
    .ladder = ladder,
    .is_sampled = true,
    .indirect = light,
    .light_pixels = light_pixels,
    .light_glossy = bd_far_light_anew,
};
