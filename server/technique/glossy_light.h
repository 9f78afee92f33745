// What techniques share that light glossy receivers apart from the diffuse ones: the specular lobe
// is radiance towards the viewer, which cannot be interpolated with the irradiance.

#ifndef BD_TECHNIQUE_GLOSSY_LIGHT_H
#define BD_TECHNIQUE_GLOSSY_LIGHT_H

#include "technique/technique.h"

enum bd_glossy_light {
    BD_GLOSSY_LIGHT_AT_PIXELS, // every VPL at every glossy pixel, in a pass "glossy"
    BD_GLOSSY_LIGHT_AT_BLOCKS, // each VPL at blocks of its own, in a pass "subsplats"
};

// Adds `glossy` to indirect light that has irradiance. The latter wants BD_INPUT_FRAGMENTS.
BD_MUST_CHECK
enum bd_err bd_glossy_light(const struct bd_pass_context *context,
                            const struct bd_technique_inputs *inputs, enum bd_glossy_light where,
                            struct bd_indirect *indirect, struct bd_err_detail *detail);

#endif
