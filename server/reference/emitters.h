// Emissive triangles as lights: chosen by what they can give to a point (light_tree.h), or in
// proportion to the flux that they emit; then a point uniformly by area. A double-sided triangle
// emits on both sides, a single-sided one in front.
//
// Built on one thread, then read by all.

#ifndef BD_REFERENCE_EMITTERS_H
#define BD_REFERENCE_EMITTERS_H

#include <stdbool.h>
#include <stdint.h>

#include "base/err.h"
#include "reference/geometry.h"
#include "reference/light_tree.h"

struct bd_emitters {
    uint32_t count; // triangles of materials that emit; 0 if nothing comes of any
    uint32_t *part; // of each
    uint32_t *triangle;
    float *inverse_area; // per area in reference space
    struct bd_light_tree tree;
};

// Numbers the triangles and sets `first_emitter` of the parts.
BD_MUST_CHECK
enum bd_err bd_emitters_init(struct bd_emitters *emitters, struct bd_geometry *geometry,
                             struct bd_err_detail *detail);
void bd_emitters_finish(struct bd_emitters *emitters);

// Emitters for that receiver (NULL: by flux), as bd_light_tree_choose. Not to be called without
// any.
void bd_emitters_choose(const struct bd_emitters *emitters, const struct bd_receiver *receiver,
                        uint32_t count, struct bd_light_draw *draws);
// The pdf per area with which points of a drawn one are chosen.
float bd_emitters_drawn_pdf(const struct bd_emitters *emitters, const struct bd_light_draw *draw);
// A point of it, uniformly by area.
void bd_emitters_point(const struct bd_emitters *emitters, const struct bd_geometry *geometry,
                       uint32_t emitter, const float u[2], struct bd_intersection *out);
// The pdf per area with which both choose points of this triangle; 0 for one that emits nothing
// or can give nothing to the receiver.
float bd_emitters_pdf(const struct bd_emitters *emitters, const struct bd_receiver *receiver,
                      const struct bd_part *part, uint32_t triangle);
uint64_t bd_emitters_bytes(const struct bd_emitters *emitters);

// Luminance towards `wo` in cd/m^2.
void bd_emission_at(const struct bd_geometry *geometry, const struct bd_intersection *at,
                    const float wo[3], float out[3]);

#endif
