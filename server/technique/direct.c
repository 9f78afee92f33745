// Direct light alone: exact shadows of punctual lights, the glTF BRDF, emission. The baseline
// that every other technique adds to.
//
// Exact when: always, up to occluders smaller than a texel of the shadow map.

#include "technique/technique.h"

static const char *const ladder[] = {"shadow_size=256",  "shadow_size=512",  "shadow_size=1024",
                                     "shadow_size=2048", "shadow_size=4096", NULL};

const struct bd_technique bd_technique_direct = {
    .name = "direct",
    .summary = "direct light with exact shadows, no indirect light",
    .model = {.lights = BD_LIGHTS_PUNCTUAL},
    .params_read = BD_READS(BD_PARAM_BRDF) | BD_READS(BD_PARAM_SHADOW_SIZE) |
                   BD_READS(BD_PARAM_EXECUTOR),
    .tolerance = {.direct = 1e-3},
    .hazard_codes = "",
    .ladder = ladder,
};
