#include "reference/bsdf_albedo.h"

#include <math.h>
#include <stdint.h>

#include "reference/bsdf_albedo_table.h"
#include "reference/vec3f.h"

// Between two nodes of an axis.
struct node {
    uint32_t below;
    float share;
};

static struct node node_of(float position)
{
    float x = bd_minf(bd_maxf(position, 0), 1) * (BD_ALBEDO_NODES - 1);
    uint32_t below = (uint32_t)bd_minf(x, BD_ALBEDO_NODES - 2);
    return (struct node){below, x - (float)below};
}

static float along(const float *row, struct node at)
{
    return row[at.below] + (row[at.below + 1] - row[at.below]) * at.share;
}

static float brightest_of(const float color[3])
{
    return bd_maxf(color[0], bd_maxf(color[1], color[2]));
}

// Between nodes the table is a mean of its neighbours, and the ratio of two means is never less
// than the least ratio.
bool bd_albedo_is_plain(const float base_color[3], float roughness)
{
    uint32_t row = node_of(roughness).below;
    return brightest_of(base_color) <= bd_minf(bd_albedo_plain[row], bd_albedo_plain[row + 1]);
}

void bd_albedo_diffuse_factor(const float base_color[3], float roughness, float cosine,
                              float out[3])
{
    if (cosine >= 0.5f && brightest_of(base_color) <= 1 - BD_ALBEDO_SPECULAR_FLAT) {
        out[0] = out[1] = out[2] = 1;
        return;
    }
    struct node row = node_of(roughness), column = node_of(sqrtf(bd_maxf(cosine, 0)));
    float smoother = along(bd_albedo_specular[row.below], column);
    float rougher = along(bd_albedo_specular[row.below + 1], column);
    float specular = smoother + (rougher - smoother) * row.share;
    // Both divided by 1 - f0.
    float left = 1 - specular, white = 1 - along(bd_albedo_diffuse, column);
    for (int k = 0; k < 3; k++)
        out[k] = base_color[k] * white > left ? left / (base_color[k] * white) : 1;
}
