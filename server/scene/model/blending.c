// From which alpha on a surface is there, of several pictures of one view.

#include <math.h>

#include "scene/model/scene.h"

// Steps of so much, times the sub-frame's number: square roots of primes are no multiples of each
// other, and these spread the first 8, 16, 32 and 64 numbers most evenly. An alpha is off by .03
// with 16 sub-frames and .01 with 64 (root mean squares), two of them, one behind the other, by .06
// and .03. Numbers in even parts (van der Corput's), permuted, would be off by .11 there, however
// many: all of them begin with .5, and then take turns above and below it.
static const double steps_squared[] = {11, 137, 19, 233, 281, 173, 191, 193};
#define STEP_COUNT (sizeof steps_squared / sizeof *steps_squared)

float bd_scene_least_alpha(const struct bd_scene *scene, int32_t material, uint32_t sub_frame)
{
    const struct bd_material *m = &scene->materials[material];
    if (m->alpha_mode == BD_ALPHA_MASK) return m->alpha_cutoff;
    const double step = sqrt(steps_squared[(uint32_t)material % STEP_COUNT]);
    return (float)fmod(0.5 + sub_frame * step, 1);
}
