// The point that stands for where a ray ended. Private to pass/.
//
// Thread: any.

#ifndef BD_PASS_POINT_ENDS_H
#define BD_PASS_POINT_ENDS_H

#include "lights/point_clusters.h"
#include "lights/surface_hits.h"
#include "rays/rays.h"

// In distances between points: so near one stands for a place.
#define BD_POINT_END_REACH 4.0f

// As bd_point_clusters_near, on the side that the ray came to; BD_NO_POINT_NEAR, too, where it met
// nothing that sends light on.
static inline uint32_t bd_point_at_end(const struct bd_surface_hits *surfaces,
                                       const struct bd_point_clusters *points,
                                       const struct bd_ray *ray, const struct bd_ray_hit *hit)
{
    const float *d = ray->direction;
    const float reach = BD_POINT_END_REACH * f_sqrt(points->area);
    struct bd_surface_point at;
    if (hit->triangle == BD_NO_TRIANGLE ||
        !bd_surface_hit_at(surfaces, hit->triangle, hit->u, hit->v, f3_of(d[0], d[1], d[2]), &at))
        return BD_NO_POINT_NEAR;
    return bd_point_clusters_near(points, at.position, at.normal, reach);
}

#endif
