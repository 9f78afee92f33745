// What techniques share that light every pixel from lists of VPLs, hidden by the scene or not.

#ifndef BD_TECHNIQUE_VISIBLE_LIGHT_H
#define BD_TECHNIQUE_VISIBLE_LIGHT_H

#include "technique/technique.h"

// A gather without rays, with one to every VPL, or with a few of them and their noise filtered.
// Reads BD_READS_VISIBILITY; its passes are weigh, choose, visibility, gather and filter.
BD_MUST_CHECK
enum bd_err bd_visible_light(const struct bd_pass_context *context,
                             const struct bd_technique_inputs *inputs, struct bd_indirect **out,
                             struct bd_fault *fault);

#endif
