// Emissive triangles as lights: chosen in proportion to the flux that they emit, then a point
// uniformly by area. A double-sided triangle emits on both sides, a single-sided one in front.
//
// Built on one thread, then read by all.

#ifndef BD_REFERENCE_EMITTERS_H
#define BD_REFERENCE_EMITTERS_H

#include <stdbool.h>
#include <stdint.h>

#include "base/err.h"
#include "reference/geometry.h"

struct bd_emitters {
    uint32_t count;    // triangles
    uint32_t *part;    // of each
    uint32_t *triangle;
    double *cumulated; // probability of all up to and with this
    float *density;    // probability per area in reference space
};

// Numbers the triangles and sets `first_emitter` of the parts.
BD_MUST_CHECK
enum bd_err bd_emitters_init(struct bd_emitters *emitters, struct bd_geometry *geometry,
                             struct bd_fault *fault);
void bd_emitters_finish(struct bd_emitters *emitters);

// The density per area with which bd_emitters_sample chooses points of this triangle; 0 for one
// that emits nothing.
float bd_emitters_density(const struct bd_emitters *emitters, const struct bd_part *part,
                          uint32_t triangle);

// `choice`: uniform over 32 bits. Not to be called without emitters.
void bd_emitters_sample(const struct bd_emitters *emitters, const struct bd_geometry *geometry,
                        uint32_t choice, const float u[2], struct bd_meeting *out);

// Luminance towards `wo` in cd/m^2.
void bd_emission_at(const struct bd_geometry *geometry, const struct bd_meeting *at,
                    const float wo[3], float out[3]);

#endif
