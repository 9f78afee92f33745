// The environment as a light. A map is read bilinearly and sampled in proportion to its luminance,
// a uniform sky not at all: scattering alone finds it as well as anything could.
//
// Built on one thread, then read by all.

#ifndef BD_REFERENCE_SKY_H
#define BD_REFERENCE_SKY_H

#include <stdbool.h>
#include <stdint.h>

#include "base/err.h"
#include "scene/model/scene.h"

struct bd_sky {
    const struct bd_environment *environment;
    bool shines;      // at all
    bool is_sampled;  // bd_sky_sample may be called
    bd_dvec3 axes[3]; // of the map, in the world
    double *rows;     // cumulated probability of rows, then of the texels within each row
    double *columns;  // width a row
};

BD_MUST_CHECK
enum bd_err bd_sky_init(struct bd_sky *sky, const struct bd_environment *environment,
                        struct bd_err_detail *detail);
void bd_sky_finish(struct bd_sky *sky);

// Luminance in cd/m^2 from a unit direction.
void bd_sky_radiance(const struct bd_sky *sky, const float direction[3], float out[3]);

// A direction, and the pdf per steradian of choosing it.
void bd_sky_sample(const struct bd_sky *sky, const uint32_t bits[2], float direction[3],
                   float *pdf);
// 0 if the sky is not sampled.
float bd_sky_pdf(const struct bd_sky *sky, const float direction[3]);

#endif
