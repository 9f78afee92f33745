// Arithmetic of punctual lights' light, side by side, so that the compiler packs it: what each of a
// block's punctual lights would give a receiver, and what chosen ones give theirs. Formulas are
// kernel/light.h's and kernel/brdf.h's. Private to pass/.
//
// Thread: any.

#ifndef BD_PASS_PUNCTUAL_LANES_H
#define BD_PASS_PUNCTUAL_LANES_H

#include "lights/punctual_tree.h"
#include "pass/area_samples.h"
#include "shared/receivers.h"

// Punctual lights of a block.
struct bd_punctual_lanes {
    float x[BD_PUNCTUAL_CUT_MAX], y[BD_PUNCTUAL_CUT_MAX], z[BD_PUNCTUAL_CUT_MAX];
    float ahead_x[BD_PUNCTUAL_CUT_MAX], ahead_y[BD_PUNCTUAL_CUT_MAX], ahead_z[BD_PUNCTUAL_CUT_MAX];
    float cos_outer[BD_PUNCTUAL_CUT_MAX], per_cosine[BD_PUNCTUAL_CUT_MAX],
        inverse_range[BD_PUNCTUAL_CUT_MAX];
    float parallel[BD_PUNCTUAL_CUT_MAX], brightest[BD_PUNCTUAL_CUT_MAX];
};
void bd_punctual_lanes_put(struct bd_punctual_lanes *lanes, uint32_t i,
                           const struct bd_light_uniform *punctual);
// The brightest channel of each one's irradiance, where nothing stands between.
void bd_punctual_lanes_weigh(const struct bd_punctual_lanes *lanes, uint32_t count,
                             const struct bd_area_receiver *at, float *weight);

// Receivers and a punctual light of each.
struct bd_punctual_pairs {
    struct bd_lanes3 span, ahead, intensity, normal, viewer,
        base_color; // span: to the punctual light
    float cos_outer[BD_LANES], per_cosine[BD_LANES], inverse_range[BD_LANES];
    float metallic[BD_LANES], roughness[BD_LANES], f0_dielectric[BD_LANES];
    struct bd_lanes3 irradiance, beyond; // what comes of it, as struct bd_area_light_found
};
void bd_punctual_pairs_put(struct bd_punctual_pairs *pairs, uint32_t i,
                           const struct bd_area_receiver *at,
                           const struct bd_light_uniform *punctual);
// All BD_LANES of them, whatever was put into the last.
void bd_punctual_pairs_light(struct bd_punctual_pairs *pairs, bool lambert);

#endif
