// The scene's triangles as the reference traces them: flattened into one Embree scene in reference
// space, which is the world less the scene's own origin, scaled by a power of two so that the
// scene's diagonal lies in [1, 2). Origin and scale are applied in double precision: neither the
// size of a scene nor its place costs digits.
//
// Thread: built on one, then read by all. Rays count for the thread that traces them.

#ifndef BD_REFERENCE_GEOMETRY_H
#define BD_REFERENCE_GEOMETRY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/err.h"
#include "base/vec.h"
#include "reference/reference.h"
#include "reference/surface.h"
#include "reference/triangle.h"

struct RTCSceneTy;

// One primitive of one instance; its index is Embree's geometry id.
struct bd_part {
    const struct bd_instance *instance;
    const struct bd_primitive *primitive;
    const struct bd_material *material;
    const float *position; // 3 a vertex, reference space
    const struct bd_triangle *triangles;
    const struct bd_triangle_tangents *tangents; // NULL: no normal map
    bool mirrored;
    uint32_t first_emitter; // of its triangles, in struct bd_emitters; UINT32_MAX: none
};

struct bd_flat_counts {
    size_t parts, vertices, triangles;
    size_t bent_triangles; // of parts with a normal map
};

// Where the triangles are and how they are curved: what is large and takes its time, and is no
// other one while light, colours and roughness change. Shared by counting.
struct bd_shape;

struct bd_geometry {
    const struct bd_scene *scene;
    struct bd_shape *shape;
    bd_dvec3 origin_m;
    double units_per_m;        // a power of two
    double radius;             // everything is within this of reference space's origin
    struct RTCSceneTy *embree; // the shape's
    struct bd_part *parts;     // the snapshot's own
    uint32_t part_count;
};

// Arrays of a shape, to be filled (flatten.c).
struct bd_shape_arrays {
    float *positions; // 3 a vertex, of all parts
    struct bd_triangle *triangles;
    struct bd_triangle_tangents *tangents;
};
struct bd_shape_arrays bd_shape_arrays_of(const struct bd_shape *shape);

// As bd_reference_create. What was begun stays in `geometry` after a failure, to be finished.
BD_MUST_CHECK
enum bd_err bd_geometry_init(struct bd_geometry *geometry, const struct bd_scene *scene,
                             uint32_t thread_count, bd_reference_should_stop should_stop,
                             void *user, struct bd_err_detail *detail);
// The same with the shape of another one, without building anything; false where that is another
// shape, by the aspects of the two snapshots. `like` may be finished before or after.
BD_MUST_CHECK
bool bd_geometry_init_like(struct bd_geometry *geometry, const struct bd_scene *scene,
                           const struct bd_geometry *like);
void bd_geometry_finish(struct bd_geometry *geometry);

// Of the shape, which others may have too, and of the rest.
uint64_t bd_shape_memory_bytes(const struct bd_shape *shape);
uint64_t bd_geometry_own_bytes(const struct bd_geometry *geometry);

// Reference space from the world.
bd_dvec3 bd_geometry_place(const struct bd_geometry *geometry, bd_dvec3 world);

// What a ray meets. All in reference space.
enum bd_sight {
    BD_SIGHT_ALL,         // triangles have two sides
    BD_SIGHT_FRONTS_ONLY, // single-sided ones are absent from behind
};

struct bd_ray {
    float origin[3], direction[3]; // the direction need not be unit
    float near, far;               // in lengths of the direction
    enum bd_alpha_reading alpha;
    uint64_t coverage_seed; // for surfaces that are there with a probability; mixed when asked for
};

struct bd_intersection {
    const struct bd_part *part;
    struct bd_hit hit;
    float distance; // in lengths of the direction
    float position[3];
    float clearance; // rays that leave start this far off the triangle
};

// The first surface along the ray. False: none, or a ray that Embree cannot trace (origin or
// direction beyond 1.8e18, a negative start, anything that is no number): it meets nothing, and is
// counted.
bool bd_geometry_intersect(const struct bd_geometry *geometry, const struct bd_ray *ray,
                           enum bd_sight sight, struct bd_intersection *out);
// Whether anything lies between the ray's near and far; false for rays that cannot be traced, too.
bool bd_geometry_is_blocked(const struct bd_geometry *geometry, const struct bd_ray *ray);

// The point of a triangle at Embree's barycentrics, without a ray.
void bd_geometry_point(const struct bd_part *part, uint32_t triangle, float u, float v,
                       struct bd_intersection *out);
// How often it is there: what blends as often as it is opaque, a mask is or is not.
float bd_geometry_presence(const struct bd_geometry *geometry,
                           const struct bd_intersection *intersection, enum bd_alpha_reading alpha);
// True if the material has one side and `direction` points away from behind it.
bool bd_intersection_is_behind(const struct bd_intersection *intersection,
                               const float direction[3]);

// Rays traced by the calling thread.
uint64_t bd_geometry_ray_count(void);
// Those of them that could not be.
uint64_t bd_geometry_refused_ray_count(void);

#endif
