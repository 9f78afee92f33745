// A surface's scattering asked about one pair of directions, for tests that have no path.

#ifndef BD_TESTS_TOOLS_BSDF_ONCE_H
#define BD_TESTS_TOOLS_BSDF_ONCE_H

#include "reference/bsdf.h"

static inline void eval_once(const struct bd_surface *surface, const float wo[3], const float wi[3],
                             float out[3], float *density)
{
    struct bd_bsdf bsdf = {.surface = *surface};
    bd_bsdf_look(&bsdf, wo);
    bd_bsdf_eval(&bsdf, wi, out, density);
}

static inline bool sample_once(const struct bd_surface *surface, const float wo[3],
                               const float u[3], struct bd_bsdf_sample *out)
{
    struct bd_bsdf bsdf = {.surface = *surface};
    bd_bsdf_look(&bsdf, wo);
    return bd_bsdf_sample(&bsdf, u, out);
}

#endif
