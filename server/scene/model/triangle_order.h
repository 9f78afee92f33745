// Which triangle has which number: the order in which a snapshot's triangles are drawn, kept on
// the device, named in the G-buffer and found by rays.
//
// Instances stand in groups of one mesh and one winding, meshes in the order in which the instances
// come to them; instances are ordered by content (draw_order.c), so equal scenes have equal numbers
// whatever was edited to get there. A run is one primitive in one group: triangle t of its i-th
// instance has the number first_triangle + i * triangles_per_instance + t.
//
// Thread: any, on a snapshot.

#ifndef BD_SCENE_MODEL_TRIANGLE_ORDER_H
#define BD_SCENE_MODEL_TRIANGLE_ORDER_H

#include <stdbool.h>
#include <stdint.h>

#include "scene/model/scene.h"

struct bd_triangle_run {
    uint32_t mesh, primitive;                // of the scene, and of that mesh
    uint32_t first_instance, instance_count; // places in `instances`
    uint64_t first_triangle;
    uint32_t triangles_per_instance; // at least 1
    bool mirrored;                   // the instances turn the winding round
};

struct bd_triangle_order {
    uint32_t run_count;
    struct bd_triangle_run *runs; // of one group one after the other
    uint32_t instance_count;
    uint32_t *instances; // indices of the scene's, grouped
    uint64_t triangle_count;
};

// Of the scene; owns its arrays.
void bd_triangle_order_init(struct bd_triangle_order *order, const struct bd_scene *scene);
void bd_triangle_order_finish(struct bd_triangle_order *order);

// The run in which a number is, which must be one of the order's.
uint32_t bd_triangle_order_run(const struct bd_triangle_order *order, uint64_t number);

#endif
