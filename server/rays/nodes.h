// The triangles of a snapshot as a device asks them: a binary tree of boxes by Embree's builder and
// the triangles of its leaves, and what tells the alpha of those that are not opaque: arrays to be
// uploaded as they are (shared/rays.h).
//
// All triangles are placed: instances of a mesh are so many times its triangles. A scene that this
// would be too much for is left to the processor (rays.h).
//
// Which of a triangle's sides counts is the snapshot's: a structure that outlives an edit of that
// (frame/stage_rows.c) answers nobody who passes backs.
//
// The same scene gives the same bytes, whatever the number of threads.
//
// Wald, Woop, Benthin, Johnson, Ernst 2014 (Embree); Smits 1998 (walks without a stack).
//
// Thread: built on one thread and any of Embree's.

#ifndef BD_RAYS_NODES_H
#define BD_RAYS_NODES_H

#include "rays/rays.h"

#define BD_RAY_NODES_TRIANGLES_MAX (UINT32_C(1) << 24) // some 1.4 GiB

struct bd_ray_nodes {
    uint32_t node_count, triangle_count; // 0 where there is nothing
    struct bd_ray_node *nodes;
    struct bd_ray_triangle *triangles; // in the order of the leaves
    // NULL where all is opaque.
    size_t cutout_count, texel_word_count;
    struct bd_uvec4 *cutouts;
    uint32_t *texels;
    uint32_t cutout_triangles; // where those begin in `cutouts`
};

// Arrays of up to `bytes_max` each. `repeated_max` of `build` is not read. Errors: as
// bd_rays_create; BD_ERR_UNSUPPORTED also where the scene is the processor's.
BD_MUST_CHECK
enum bd_err bd_ray_nodes_create(struct bd_scene *scene, const struct bd_rays_build *build,
                                uint64_t bytes_max, struct bd_ray_nodes **out,
                                struct bd_err_detail *detail);
void bd_ray_nodes_destroy(struct bd_ray_nodes **nodes);

#endif
