// What a surface sends on, all directions together: for whoever takes it for a diffuse one of that
// colour.
//
// glTF's BRDF (Appendix B). The GGX lobe returns f0 (A - B) + B, Schlick's term split as by Karis
// (2013): A is what it returns with a Fresnel term of 1, less than all since light that meets a
// rough surface twice is lost to the model; B with (1 - v.h)^5. The diffuse lobe returns what
// Schlick's term leaves, (1 - f0)(1 - .0037) of light from everywhere; flat light, of which it
// returns less, is taken alike; of light under one angle bright colours are limited as those that
// are rendered (kernel/diffuse_limit.h). Any thread.

#ifndef BD_LIGHTS_SENT_H
#define BD_LIGHTS_SENT_H

#include "kernel/diffuse_limit.h"
#include "kernel/math.h"
#include "lights/sent_albedo.h"

// Instead of a cosine: light that is the same from all sides, each weighed by its cosine.
#define BD_FROM_EVERYWHERE (-1.0f)

struct bd_sent_lobe {
    float a, b;
};

// Fits of degree 4 to 400,000 samples for each of 21 roughnesses, within .0022 and .0006.
static inline struct bd_sent_lobe bd_sent_lobe_from_everywhere(float r)
{
    return (struct bd_sent_lobe){
        0.9996f + r * (-0.0069f + r * (0.2928f + r * (-2.1343f + r * 1.2598f))),
        0.0471f + r * (0.0422f + r * (-0.4207f + r * (0.5596f - r * 0.2257f))),
    };
}

// Between the table's.
static inline struct bd_sent_lobe bd_sent_lobe_from(float roughness, float cosine)
{
    const float r = BD_SENT_STEPS * f_min(f_max(roughness, 0), 1);
    const float c = BD_SENT_STEPS * f_sqrt(f_min(f_max(cosine, 0), 1));
    const int row = r < BD_SENT_STEPS ? (int)r : BD_SENT_STEPS - 1;
    const int column = c < BD_SENT_STEPS ? (int)c : BD_SENT_STEPS - 1;
    const float down = r - (float)row, across = c - (float)column;
    float both[2];
    for (int k = 0; k < 2; k++) {
        const float(*near)[2] = &bd_sent_albedo[row][column];
        const float(*next)[2] = &bd_sent_albedo[row + 1][column];
        const float above = near[0][k] + across * (near[1][k] - near[0][k]);
        const float below = next[0][k] + across * (next[1][k] - next[0][k]);
        both[k] = above + down * (below - above);
    }
    return (struct bd_sent_lobe){both[0], both[1]};
}

// Of light under an angle of that cosine to the normal.
static inline f3 bd_sent_by_all(f3 base_color, float metallic, float roughness, float f0_dielectric,
                                float cosine)
{
    const struct bd_sent_lobe lobe =
        cosine < 0 ? bd_sent_lobe_from_everywhere(roughness) : bd_sent_lobe_from(roughness, cosine);
    const float dielectric = 1 - metallic, a = lobe.a - lobe.b;
    const float coat = dielectric * (f0_dielectric * a + lobe.b) + metallic * lobe.b;
    const f3 diffuse =
        cosine < 0 ? base_color : f3_min(base_color, diffuse_limit(cosine, roughness));
    const f3 sum = f3_add(f3_scale(diffuse, dielectric * (1 - f0_dielectric) * (1 - 0.0037f)),
                          f3_scale(base_color, metallic * a));
    return f3_add(sum, f3_of(coat, coat, coat));
}

#endif
