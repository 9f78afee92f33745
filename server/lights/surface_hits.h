// What a ray met, as light that goes on finds it: where it is, and which way it faces.
//
// Thread: any; initialised by one.

#ifndef BD_LIGHTS_SURFACE_HITS_H
#define BD_LIGHTS_SURFACE_HITS_H

#include <stdbool.h>
#include <stdint.h>

#include "lights/sent.h"
#include "lights/surface_points.h"
#include "scene/model/render_space.h"
#include "scene/model/triangle_order.h"

// Borrows the scene.
struct bd_surface_hits {
    float roughest; // of metals that are mirrors; at first brushed ones are (scene/model/scene.h)
    const struct bd_scene *scene;
    struct bd_render_space space;
    struct bd_triangle_order order;
};

// A triangle of the scene.
struct bd_surface_hit {
    const struct bd_triangle_run *run;
    const struct bd_instance *instance;
    const struct bd_primitive *primitive;
    uint32_t of_primitive; // its number there
};
struct bd_surface_hit bd_surface_hit_of(const struct bd_surface_hits *hits, uint32_t triangle);

void bd_surface_hits_init(struct bd_surface_hits *hits, const struct bd_scene *scene);
void bd_surface_hits_finish(struct bd_surface_hits *hits);

// Where a triangle lies, in render space.
struct bd_hit_triangle {
    f3 corner[3], normal; // unit, to its front
    bool two_sided;
};
// False if it has no area.
bool bd_surface_hit_triangle(const struct bd_surface_hits *hits, uint32_t triangle,
                             struct bd_hit_triangle *out);

// The point that was met but for `diffuse`; its normal is to the side that `direction` comes from.
// False where nothing goes on: what is unlit, and the rear of a surface that has but one side.
bool bd_surface_hit_at(const struct bd_surface_hits *hits, uint32_t triangle, float u, float v,
                       f3 direction, struct bd_surface_point *point);

// Its `diffuse`, of what it sends on of light under an angle of that cosine to its normal, or
// BD_FROM_EVERYWHERE.
f3 bd_surface_hit_diffuse(const struct bd_surface_hits *hits, uint32_t triangle, float u, float v,
                          enum bd_sends sends, float cosine);
// The same for who keeps it as a point: of glass, what does not pass.
f3 bd_surface_hit_sent(const struct bd_surface_hits *hits, uint32_t triangle, float u, float v,
                       enum bd_sends sends, float cosine);

#endif
