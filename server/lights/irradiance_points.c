#include "lights/irradiance_points.h"

#include <stdlib.h>

#include "base/assert.h"

enum bd_err bd_irradiance_points_create(struct bd_surface_points *points, f3 *irradiance,
                                        enum bd_err (*pause)(void *user), void *user,
                                        struct bd_irradiance_points **out,
                                        struct bd_err_detail *detail)
{
    struct bd_irradiance_points *known = calloc(1, sizeof *known);
    BD_ASSERT(known);
    known->points = *points;
    known->irradiance = irradiance;
    *points = (struct bd_surface_points){0};
    enum bd_err err = bd_point_tree_init(&known->tree, &known->points, pause, user, detail);
    if (err) bd_irradiance_points_destroy(&known);
    *out = known;
    return err;
}

void bd_irradiance_points_destroy(struct bd_irradiance_points **known)
{
    if (!*known) return;
    bd_point_tree_finish(&(*known)->tree);
    bd_surface_points_finish(&(*known)->points);
    free((*known)->irradiance);
    free(*known);
    *known = NULL;
}

uint64_t bd_irradiance_points_bytes(const struct bd_irradiance_points *known)
{
    const uint64_t point =
        sizeof *known->points.points + sizeof *known->irradiance + sizeof *known->tree.nodes;
    return sizeof *known + known->points.count * point;
}

void bd_irradiance_points_find(const struct bd_irradiance_points *known, f3 position, f3 normal,
                               struct bd_point_neighbours *out)
{
    bd_point_tree_find(&known->tree, position, normal, BD_IRRADIANCE_POINTS_ASKED, out);
}

bool bd_irradiance_points_tell(const struct bd_irradiance_points *known,
                               const struct bd_point_neighbours *near, uint32_t hidden,
                               f3 *irradiance)
{
    f3 sum = f3_of(0, 0, 0);
    float shares = 0;
    for (uint32_t i = 0; i < near->count; i++) {
        if (hidden >> i & 1) continue;
        sum = f3_add(sum, f3_scale(known->irradiance[near->point[i]], near->share[i]));
        shares += near->share[i];
    }
    *irradiance = f3_scale(sum, shares > 0 ? 1 / shares : 0);
    return shares > 0;
}
