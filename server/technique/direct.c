// Direct light alone: exact shadows of punctual lights, light of emissive surfaces and the sky by
// rays, the glTF BRDF, emission. The baseline that every other technique adds to.
//
// Exact when: always, of punctual lights, up to occluders smaller than a texel of the shadow map;
// of what has a size as `light_rays` grows.

#include "technique/technique.h"

static const char *const ladder[] = {"shadow_size=256",  "shadow_size=512",  "shadow_size=1024",
                                     "shadow_size=2048", "shadow_size=4096", NULL};

const struct bd_technique bd_technique_direct = {
    .name = "direct",
    .summary = "direct light with exact shadows, no indirect light",
    .model = {.lights = BD_LIGHTS_ALL, .transmission = true, .coverage = true},
    .params_read = BD_READS_DIRECT,
    .tolerance = {.direct = 1e-3},
    .hazard_codes = "",
    .ladder = ladder,
};
