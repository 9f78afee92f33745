// Baseline `rsm` (algorithms.md A0.7 N1): one diffuse bounce from a regular grid of VPLs over each
// light's reflective shadow map, gathered at every pixel, without visibility of the VPLs
// or with it (pass/gather_chosen.h).
//
// Paper:  Dachsbacher and Stamminger 2005 (reflective shadow maps); kernel of Nichols, Shopf and
//         Wyman 2009, Eq. 1, with the near-field rule of A2.2
// Exact when: `vpls` grows, nothing stands between VPL and receiver or indirect_visibility=rays,
//         surfaces that send light on are diffuse
// Known:  ignores occlusion of VPLs unless told otherwise; metals send no light on (their lobe is
//         not diffuse); VPLs show as dots on glossy receivers, whose roughness is held to .25
//         (kernel/brdf.h); rough dielectrics reflect by base colour / pi alone
//         (common/gbuffer.glsl); beside a crease, with very many VPLs, a receiver may all but touch
//         a patch of the next facet and get twice its light

#include "technique/fragment_light.h"
#include "technique/technique.h"
#include "technique/visible_light.h"

static const struct bd_technique_pass passes[] = {
    {"weigh", BD_WHEN_CHOSEN},     {"choose", BD_WHEN_ASKED},
    {"visibility", BD_WHEN_ASKED}, {"gather", 0},
    {"filter", BD_WHEN_FILTERED},  {NULL, 0},
};
static const struct bd_param_default defaults[] = {
    BD_DEFAULT_VISIBILITY,
};
static const char *const ladder[] = {"vpls=16",   "vpls=64",    "vpls=256",   "vpls=1024",
                                     "vpls=4096", "vpls=16384", "vpls=65536", NULL};

const struct bd_technique bd_technique_rsm = {
    .name = "rsm",
    .summary = "one bounce from a grid of virtual lights, gathered at every pixel",
    .model = {.indirect_bounces = 1,
              .lights = BD_LIGHTS_ALL,
              .indirect_lights = BD_LIGHTS_ALL,
              .glossy_receivers = true,
              .transmission = true,
              .coverage = true},
    .inputs = BD_INPUT_VPL_GRID,
    .passes = passes,
    .params_read = BD_READS_VPL_GRID | BD_READS_LIGHT_PATHS | BD_READS_VISIBILITY |
                   BD_READS(BD_PARAM_SUB_FRAMES),
    .defaults = defaults,
    .default_count = sizeof defaults / sizeof *defaults,
    .tolerance = {.direct = 1e-3, .indirect = 1e-2},
    .hazard_codes = "",
    .ladder = ladder,
    .indirect = bd_visible_light,
    .light_pixels = bd_fragments_gather,
};
