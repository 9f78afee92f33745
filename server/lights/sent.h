// What a surface sends on, all directions together, by the angle under which light comes: for
// whoever takes it for a diffuse one of that colour (kernel/sent.h). Flat light, of which the
// diffuse lobe returns less, is taken alike there; bright colours are limited as those that are
// rendered (kernel/diffuse_limit.h). Any thread.

#ifndef BD_LIGHTS_SENT_H
#define BD_LIGHTS_SENT_H

#include "kernel/sent.h"
#include "lights/sent_albedo.h"

// Instead of a cosine: light that is the same from all sides.
#define BD_FROM_EVERYWHERE (-1.0f)

struct bd_sent_lobe {
    float white, grazing;
};

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
    if (cosine < 0) return sent_from_everywhere(base_color, metallic, roughness, f0_dielectric);
    const struct bd_sent_lobe lobe = bd_sent_lobe_from(roughness, cosine);
    const f3 diffuse = diffuse_limited(base_color, roughness, cosine);
    return sent_by_lobes(base_color, diffuse, metallic, f0_dielectric, lobe.white, lobe.grazing);
}

#endif
