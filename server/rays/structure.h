// What Embree is given of a snapshot, and which triangle it means by an answer. Private to rays/.
//
// A part is what Embree builds at once and nobody writes afterwards: triangles that are placed in
// render space, in two geometries (those that are opaque, and those that are not), and instances of
// meshes that are kept in a frame of their own. Structures share parts: those of snapshots that
// have most instances in common have one that stays and a small one of their own each. Numbers are
// a structure's, so a level is a part and what its triangles are called in one snapshot.
//
// Thread: as rays.h.

#ifndef BD_RAYS_STRUCTURE_H
#define BD_RAYS_STRUCTURE_H

#include <embree3/rtcore.h>

#include "rays/rays.h"
#include "scene/model/render_space.h"
#include "scene/model/triangle_order.h"

enum bd_placed { BD_PLACED_OPAQUE, BD_PLACED_CUTOUT, BD_PLACED_COUNT };

// Triangles of all runs that are placed, of one kind.
struct bd_placed_triangles {
    size_t vertex_count, triangle_count;
    float *positions; // 3 a vertex, and room for Embree's wide reads
    uint32_t *indices;
    uint32_t *numbers; // of each triangle, BD_NO_TRIANGLE where it is no more; a part has none
};

// Where the order has an instance of the scene, and whether it is kept in its mesh's frame. What
// shows no triangle is nowhere.
struct bd_instance_place {
    uint32_t first_run; // of its group, one a primitive that has triangles; BD_NOWHERE
    uint32_t place;     // in the order's instances
    bool is_kept;
};
#define BD_NOWHERE UINT32_MAX

struct bd_ray_device {
    uint32_t reference_count; // atomic
    RTCDevice embree;
    int64_t bytes; // atomic: what Embree holds for all of its parts
};

// Of a mesh that is kept in its own frame: positions there, which lie in [-1, 1], are the mesh's
// less its centre, times `scale`.
struct bd_mesh_frame {
    bd_dvec3 centre;
    double scale; // a power of two
};

struct bd_kept_mesh {
    uint32_t mesh; // of the part's scene
    struct bd_mesh_frame frame;
    RTCScene top;
};

// One instance in a part.
struct bd_shown {
    uint32_t instance; // of the part's scene
    bool is_kept;
    // Of its pieces, one a primitive that has triangles; or what Embree's number of the instance
    // is beyond the placed.
    uint32_t first;
};

struct bd_rays_part {
    uint32_t reference_count;    // atomic
    struct bd_scene *scene;      // retained
    struct bd_rays_part *lender; // retained: whose kept meshes it shows too; NULL: nobody's
    struct bd_ray_device *device;
    RTCScene top;
    struct bd_placed_triangles placed[BD_PLACED_COUNT];
    uint32_t shown_count, piece_count, kept_count, mesh_count;
    struct bd_shown *shown; // as the scene has them
    size_t *pieces;         // the first triangle of each among the placed of its kind
    struct bd_kept_mesh *meshes;
    uint64_t triangle_count; // instanced
    uint64_t embree_bytes;   // roughly, where two are built on one device at once
};

struct bd_rays_level {
    struct bd_rays_part *part;
    struct bd_placed_triangles placed[BD_PLACED_COUNT]; // the part's, with numbers
    struct bd_instance_place *kept;                     // in place of the part's; may be nowhere
    bool has_stale;                                     // something of the part is no more
    bool is_its_own;                                    // the part was built with this structure
};

#define BD_RAYS_LEVELS_MAX 2

struct bd_rays {
    struct bd_scene *scene; // retained
    struct bd_triangle_order order;
    struct bd_render_space space;
    struct bd_instance_place *places; // of each of the scene's instances
    uint32_t level_count;
    struct bd_rays_level levels[BD_RAYS_LEVELS_MAX];
    // Triangles that stayed and were yet built again beside the first part, since that was.
    uint64_t wasted;
};

// --- what is placed and what is kept (place.c) ------------------------------------------------

// Fills `places`: the scene alone decides.
void bd_rays_decide(struct bd_rays *rays, uint64_t repeated_max);
// Fills the part's `placed` and `pieces`, and where each of `shown` begins.
BD_MUST_CHECK
enum bd_err bd_rays_place(const struct bd_rays *rays, struct bd_rays_part *part,
                          struct bd_err_detail *detail);
struct bd_mesh_frame bd_mesh_frame_of(const struct bd_mesh *mesh);
// Render space from the frame, for an instance: three columns and an offset. False where 32 bits
// would cost more than rounding does: uneven scales, or too large or small for the inverse.
bool bd_mesh_frame_matrix(const struct bd_mesh_frame *frame, const struct bd_render_space *space,
                          const struct bd_instance *instance, float matrix[12]);
// Of the placed triangles with that material.
enum bd_placed bd_placed_kind(const struct bd_scene *scene, int32_t material);
// Behind the runs of the group that begins there.
uint32_t bd_rays_group_end(const struct bd_triangle_order *order, uint32_t first_run);

// --- structures (structure.c) -----------------------------------------------------------------

// Nothing built yet: the snapshot's order, and what becomes of each instance.
BD_MUST_CHECK
enum bd_err bd_rays_begin(struct bd_scene *scene, const struct bd_rays_build *build,
                          struct bd_rays **out, struct bd_err_detail *detail);
// What a level is built of, and how.
struct bd_rays_wish {
    const bool *wanted;          // of each of the scene's instances; NULL: all
    struct bd_rays_part *lender; // its device and kept meshes are used; NULL: a device of its own
    enum RTCBuildQuality quality;
    bool is_only_placed; // nothing is built: for who builds something else of the triangles
};
// Asks should_stop for Embree, from any of its threads, several at once.
struct bd_rays_watch {
    const struct bd_rays_build *build;
    _Atomic bool stops;
};
bool bd_rays_go_on(void *watch, double share);
// How building ended.
BD_MUST_CHECK
enum bd_err bd_rays_built(const struct bd_rays_part *part, const struct bd_rays_watch *watch,
                          struct bd_err_detail *detail);
// Builds a part of the snapshot and adds it as a level. After a failure the structure is good for
// bd_rays_destroy alone.
BD_MUST_CHECK
enum bd_err bd_rays_add_built(struct bd_rays *rays, const struct bd_rays_wish *wish,
                              const struct bd_rays_build *build, struct bd_err_detail *detail);
// Adds one that is there: `now` has which of the scene's instances each of those shown is,
// BD_NOWHERE for what is no more.
BD_MUST_CHECK
enum bd_err bd_rays_add_shared(struct bd_rays *rays, struct bd_rays_part *part, const uint32_t *now,
                               struct bd_err_detail *detail);
// Whether two meshes are the same triangles, each opaque or not in both scenes.
bool bd_rays_same_mesh(const struct bd_scene *a, uint32_t mesh_a, const struct bd_scene *b,
                       uint32_t mesh_b);

// The number of what Embree found in a level; BD_NO_TRIANGLE for nothing, and for what is no more.
uint32_t bd_rays_number(const struct bd_rays *rays, const struct bd_rays_level *level,
                        const struct RTCHit *hit);
// In which run that triangle is, and which of its primitive's triangles.
const struct bd_triangle_run *bd_rays_run(const struct bd_rays *rays, uint32_t number,
                                          uint32_t *triangle);
// Whose triangle that is, and which of its triangles.
const struct bd_primitive *bd_rays_primitive(const struct bd_rays *rays, uint32_t number,
                                             uint32_t *triangle);

// Embree's answer to a triangle that is not opaque (trace.c).
void bd_rays_filter_cutout(const struct RTCFilterFunctionNArguments *arguments);

#endif
