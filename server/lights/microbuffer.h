// Texels of a map of the hemisphere (kernel/hemi_octahedral.h): what each is worth, exactly. A
// texel is bounded by arcs of great circles, on the map's creases, too: it is two spherical
// triangles (algorithms.md A4).
//
// Thread: any.

#ifndef BD_LIGHTS_MICROBUFFER_H
#define BD_LIGHTS_MICROBUFFER_H

#include <stdint.h>

#include "base/err.h"
#include "kernel/math.h"

// Row by row, in the map's axes.
struct bd_microbuffer {
    uint32_t side; // even
    f3 *way;       // unit, through a texel's middle
    float *solid_angle;
    // The integral of the ways through it: with a normal, its solid angle weighed by the cosine. Of
    // all together that is pi along the map's own.
    f3 *weight;
};

BD_MUST_CHECK
enum bd_err bd_microbuffer_init(struct bd_microbuffer *map, uint32_t side,
                                struct bd_err_detail *detail);
// As printed: texels are alike, and their ways those of their middles. 3.5 % of a white hemisphere
// are lost.
BD_MUST_CHECK
enum bd_err bd_microbuffer_init_even(struct bd_microbuffer *map, uint32_t side,
                                     struct bd_err_detail *detail);
void bd_microbuffer_finish(struct bd_microbuffer *map);

#endif
