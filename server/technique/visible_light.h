// What techniques share that light every pixel from lists of VPLs, hidden by the scene or not.

#ifndef BD_TECHNIQUE_VISIBLE_LIGHT_H
#define BD_TECHNIQUE_VISIBLE_LIGHT_H

#include "technique/technique.h"

// A gather without rays, with one to every VPL, or with a few of them and their noise filtered.
// Reads BD_READS_VISIBILITY; its passes are weigh, choose, visibility, gather and filter.
BD_MUST_CHECK
enum bd_err bd_visible_light(const struct bd_pass_context *context,
                             const struct bd_technique_inputs *inputs, struct bd_indirect **out,
                             struct bd_err_detail *detail);

// What the whole BRDF reflects beyond that, added as `glossy` of light that has irradiance; at
// pixels with a specular lobe. Its pass is glossy, where that of the other is gather; with a few
// rays its noise is filtered, too.
BD_MUST_CHECK
enum bd_err bd_visible_lobes(const struct bd_pass_context *context,
                             const struct bd_technique_inputs *inputs, struct bd_indirect *indirect,
                             struct bd_err_detail *detail);

#endif
