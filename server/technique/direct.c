// Direct light alone: exact shadows of punctual lights, the glTF BRDF, emission. The baseline
// that every other technique adds to.
//
// Exact when: always, up to occluders smaller than a texel of the shadow map.

#include "technique/technique.h"

const struct bd_technique bd_technique_direct = {
    .name = "direct",
    .summary = "direct light with exact shadows, no indirect light",
    .params_read = 1u << BD_PARAM_BRDF | 1u << BD_PARAM_SHADOW_SIZE,
};
