// Irradiance that is known at points of all surfaces (lights/surface_points.h), for places
// anywhere: that of the points which stand for a place (lights/point_tree.h), as far as they are
// seen from where somebody looks at it.
//
// Off by what light changes between two points and by their noise: both go as points become many.
//
// Thread: made by one, then read by all.

#ifndef BD_LIGHTS_IRRADIANCE_POINTS_H
#define BD_LIGHTS_IRRADIANCE_POINTS_H

#include "lights/point_tree.h"

// Points that a place is told of, at most.
#define BD_IRRADIANCE_POINTS_ASKED 4u

struct bd_irradiance_points {
    struct bd_surface_points points;
    f3 *irradiance; // of each
    struct bd_point_tree tree;
};

// Takes points and irradiance over, in any case. `pause` as in lights/point_tree.h.
// BD_ERR_NO_MEMORY, or what `pause` returns.
BD_MUST_CHECK
enum bd_err bd_irradiance_points_create(struct bd_surface_points *points, f3 *irradiance,
                                        enum bd_err (*pause)(void *user), void *user,
                                        struct bd_irradiance_points **out,
                                        struct bd_err_detail *detail);
void bd_irradiance_points_destroy(struct bd_irradiance_points **known);
uint64_t bd_irradiance_points_bytes(const struct bd_irradiance_points *known);

// Which stand for a place with that unit normal.
void bd_irradiance_points_find(const struct bd_irradiance_points *known, f3 position, f3 normal,
                               struct bd_point_neighbours *out);
// What they tell of it, but for those that are `hidden`, bits of their numbers among themselves.
// False where none is left.
bool bd_irradiance_points_tell(const struct bd_irradiance_points *known,
                               const struct bd_point_neighbours *near, uint32_t hidden,
                               f3 *irradiance);

#endif
