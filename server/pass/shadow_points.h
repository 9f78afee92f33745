// Points of all surfaces, each of which stands for a disk that hides what is behind it: what
// imperfect shadow maps are made of (pass/imperfect_shadows.h). Spread evenly by area over every
// instance as it is bent, unlit ones too, on one side; where alpha cuts a surface out there is none
// (lights/surface_points.h).
//
// They are in BD_SURFACE_POINT_SETS sets, one behind the other, each of which covers all surfaces:
// a map is made of one set, so that what one has missed others have.
//
// Cost: twice through all triangles, some 40 ns each.
//
// Thread: render thread.

#ifndef BD_PASS_SHADOW_POINTS_H
#define BD_PASS_SHADOW_POINTS_H

#include "lights/surface_hits.h"
#include "pass/pass.h"
#include "rays/rays.h"
#include "shared/imperfect_shadows.h"

struct bd_scene;

#define BD_SHADOW_POINTS_MIN 64u
#define BD_SHADOW_POINTS_MAX 65535u // of a set

struct bd_shadow_points {
    uint32_t per_set;               // as many as were asked for
    struct bd_shadow_point *points; // of all sets; what is cut out has radius 0
    struct bd_buf *buf;             // the same for a device; NULL where the processor has loops
};

// `per_set`: BD_SHADOW_POINTS_MIN to _MAX. `glass` hides nothing; NULL: it does.
BD_MUST_CHECK
enum bd_err bd_shadow_points_run(const struct bd_pass_context *context,
                                 const struct bd_scene *scene, uint32_t per_set,
                                 enum bd_rays_alpha alpha, const struct bd_surface_hits *glass,
                                 struct bd_shadow_points **out, struct bd_err_detail *detail);
void bd_shadow_points_destroy(struct bd_gpu *gpu, struct bd_shadow_points **points);
uint64_t bd_shadow_points_bytes(const struct bd_shadow_points *points);

#endif
