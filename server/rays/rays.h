// Rays against the triangles of a snapshot: what lies between two points, and what a ray meets
// first. Asked in batches, in render space (scene/model/render_space.h); triangles go by their
// numbers (scene/model/triangle_order.h).
//
// Triangles are placed in render space in double precision and traced as one structure. Where the
// instances of meshes would be too many triangles for that, such a mesh is kept once, in a frame of
// its own whose scale is a power of two, and traced through the instance's matrix, which takes up
// to twice as long; instances whose matrix would cost digits are placed all the same. Every
// triangle has two sides, as in the shadow maps.
//
// No ray is blocked by, or meets, what it starts or ends on: the triangles named at its ends, and
// anything within BD_RAY_BIAS of them. Rays with a number that is none, or beyond 1.8e18, are
// blocked by nothing and meet nothing. Answers depend on the snapshot and on the ray: not on
// threads, nor on the other rays of the batch, nor on what was built before. Of triangles at one
// distance the first is the first by number. Where a ray goes through an edge to within rounding,
// which of the triangles there it meets is Embree's to say, and its tree's: of rays aimed at
// corners of a lattice, 3 of 100,000 were told another neighbour; of those blocked or not, none of
// 600,000.
//
// A device is asked with nodes of its own (rays/nodes.h), and answers alike.
//
// Wald, Woop, Benthin, Johnson, Ernst 2014 (Embree).
//
// Thread: a structure is built on one thread and any of Embree's, then read by all.

#ifndef BD_RAYS_RAYS_H
#define BD_RAYS_RAYS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/err.h"
#include "base/pool.h"
#include "scene/model/scene.h"
#include "shared/rays.h"

struct bd_rays;

#define BD_RAYS_REPEATED_MAX (UINT64_C(1) << 21) // some 130 MiB

struct bd_rays_build {
    uint32_t thread_count; // 0 = as many as the machine runs at once
    // Triangles of meshes with many instances, over all of them, up to which they are placed.
    uint64_t repeated_max;
    // Asked from any of Embree's threads, several at once: true to give up. May be NULL.
    bool (*should_stop)(void *user);
    void *user;
};

// Retains the scene. Errors: BD_ERR_CANCELLED by should_stop, BD_ERR_NO_MEMORY, BD_ERR_LIMIT for
// more triangles than have numbers, BD_ERR_UNSUPPORTED where Embree does not start.
BD_MUST_CHECK
enum bd_err bd_rays_create(struct bd_scene *scene, const struct bd_rays_build *build,
                           struct bd_rays **out, struct bd_err_detail *detail);
// The same, sooner: made of what an earlier snapshot's structure has of it, and what is new or
// moved beside that. Answers are those of one that is built anew, to the bit; rays may take half as
// long again, and where they would take longer it is built anew. The earlier one stays as it is,
// may be traced meanwhile and destroyed afterwards. It gives what snapshots of one render space
// have in common; of another, nothing.
BD_MUST_CHECK
enum bd_err bd_rays_follow(const struct bd_rays *earlier, struct bd_scene *scene,
                           const struct bd_rays_build *build, struct bd_rays **out,
                           struct bd_err_detail *detail);
bool bd_rays_could_follow(const struct bd_rays *earlier, const struct bd_scene *scene);
// Whether the one was built on what the other has.
bool bd_rays_share(const struct bd_rays *a, const struct bd_rays *b);
void bd_rays_destroy(struct bd_rays **rays);
// What it was built with; without what it took over.
uint64_t bd_rays_bytes(const struct bd_rays *rays);

// Of triangles whose material is not opaque. A mask is one in either reading.
enum bd_rays_alpha {
    BD_RAYS_ALPHA_MASK,     // what blends is there where it is at least half opaque
    BD_RAYS_ALPHA_COVERAGE, // it is there as often as it is opaque, by a hash of ray and triangle
    BD_RAYS_ALPHA_ANY,      // it is there where it is opaque at all; not of a device's
};

// Sets bit i % 32 of bits[i / 32] where something lies between the ends of segments[i], and clears
// it where nothing does. `bits` has (count + 31) / 32 words; those behind the last are cleared.
// Segments without a length are asked by nobody: returns how many of the others there are. Without
// a pool this thread alone asks.
uint64_t bd_rays_occluded(const struct bd_rays *rays, struct bd_pool *pool,
                          enum bd_rays_alpha alpha, const struct bd_segment *segments, size_t count,
                          uint32_t *bits);

// The first triangle along each ray (shared/rays.h), or none.
void bd_rays_nearest(const struct bd_rays *rays, struct bd_pool *pool, enum bd_rays_alpha alpha,
                     const struct bd_ray *queries, size_t count, struct bd_ray_hit *hits);

// The same of what a sub-frame of a picture sees (bd_scene_least_alpha).
void bd_rays_nearest_seen(const struct bd_rays *rays, struct bd_pool *pool, uint32_t sub_frame,
                          const struct bd_ray *queries, size_t count, struct bd_ray_hit *hits);

// How opaque a triangle is at a point that a ray met: less than 1 where it blends.
float bd_rays_opacity(const struct bd_rays *rays, const struct bd_ray_hit *hit);

// A number in [0, 1) that two points, or a point and a direction, have together with a triangle:
// what goes by it is the same whoever asks.
float bd_rays_chance(const float a[3], const float b[3], uint32_t triangle);

#endif
