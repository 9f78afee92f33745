// What Embree is given of a snapshot, and which triangle it means by an answer. Private to rays/.
//
// The top of the structure holds triangles that are placed in render space, in two geometries
// (those that are opaque, and those that are not), and instances of meshes that are kept in a frame
// of their own.
//
// Thread: as rays.h.

#ifndef BD_RAYS_STRUCTURE_H
#define BD_RAYS_STRUCTURE_H

#include <embree3/rtcore.h>

#include "rays/rays.h"
#include "scene/render_space.h"
#include "scene/triangle_order.h"

enum bd_placed { BD_PLACED_OPAQUE, BD_PLACED_CUTOUT, BD_PLACED_COUNT };

// Triangles of all runs that are placed, of one kind.
struct bd_placed_triangles {
    size_t vertex_count, triangle_count;
    float *positions; // 3 a vertex, and room for Embree's wide reads
    uint32_t *indices;
    uint32_t *numbers; // of each triangle
};

// One instance of a mesh that is kept in its own frame: its place in the top, beyond the placed.
struct bd_kept_instance {
    uint32_t first_run; // of its group, in the order; one a primitive that has triangles
    uint32_t place;     // in the order's instances
};

struct bd_rays {
    struct bd_scene *scene; // retained
    struct bd_triangle_order order;
    struct bd_render_space space;
    RTCDevice device;
    RTCScene top;
    struct bd_placed_triangles placed[BD_PLACED_COUNT];
    uint32_t kept_count;
    struct bd_kept_instance *kept;
    int64_t embree_bytes; // atomic: what Embree holds
};

// Fills `placed` and `kept`.
BD_MUST_CHECK
enum bd_err bd_rays_place(struct bd_rays *rays, uint64_t repeated_max, struct bd_fault *fault);

// Of a mesh that is kept in its own frame: positions there, which lie in [-1, 1], are the mesh's
// less its centre, times `scale`.
struct bd_mesh_frame {
    bd_dvec3 centre;
    double scale; // a power of two
};
struct bd_mesh_frame bd_mesh_frame_of(const struct bd_mesh *mesh);
// Render space from the frame, for an instance: three columns and an offset. False where 32 bits
// would cost more than rounding does: uneven scales, or too large or small for the inverse.
bool bd_mesh_frame_matrix(const struct bd_mesh_frame *frame, const struct bd_render_space *space,
                          const struct bd_instance *instance, float matrix[12]);

// The number of what Embree found; BD_NO_TRIANGLE for nothing.
uint32_t bd_rays_number(const struct bd_rays *rays, const struct RTCHit *hit);
// Whose triangle that is, and which of its triangles.
const struct bd_primitive *bd_rays_primitive(const struct bd_rays *rays, uint32_t number,
                                             uint32_t *triangle);

// Embree's answer to a triangle that is not opaque (trace.c).
void bd_rays_filter_cutout(const struct RTCFilterFunctionNArguments *arguments);

#endif
