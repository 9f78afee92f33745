// Texel weights of a reflective shadow map: how much of a light goes through each texel
// (algorithms.md A0.2). Depends on the light's shape alone, not on the scene.
//
// Computed on the host in double precision: texel solid angles are differences of nearly equal
// numbers, and in 32 bits they keep three digits. No GL; any thread.

#ifndef BD_PASS_RSM_WEIGHTS_H
#define BD_PASS_RSM_WEIGHTS_H

#include <stdbool.h>
#include <stdint.h>

#include "pass/slicer.h"
#include "upload/light_setup.h"

struct bd_rsm_weights {
    uint32_t side_px;
    uint32_t layer_count; // 1 if all faces are alike, otherwise 6
    // Two floats a texel: flux per unit of intensity (sr, attenuation included; directional: area
    // in render units squared), and the texel's own solid angle or area.
    float *values;
    // Sum of the fluxes over all faces before they were normalised to the closed form.
    double raw_sum;
    double exact_sum;
};

// `paper_mode` gives every texel the same solid angle, as the papers do; it is not normalised. The
// slicer is asked between rows whether to stop (BD_ERR_CANCELLED, BD_ERR_DEADLINE); NULL = nobody.
BD_MUST_CHECK
enum bd_err bd_rsm_weights_create(const struct bd_light_setup *light, double render_per_m,
                                  uint32_t side_px, bool paper_mode, struct bd_slicer *slicer,
                                  struct bd_rsm_weights *out);
void bd_rsm_weights_destroy(struct bd_rsm_weights *weights);

// Solid angle of the rectangle [u0,u1] x [v0,v1] on the plane at distance 1.
double bd_rectangle_solid_angle_sr(double u0, double u1, double v0, double v1);

#endif
