// Points spread over all surfaces of a snapshot, evenly by area: of solid surfaces over their
// fronts, of double-sided ones over both sides. What is unlit has none, for it sends on nothing;
// nor has what alpha cuts out. Points of what hides light (enum bd_sends) differ in that.
//
// Stratified along the triangles of one shape after the other, and within triangles by a sequence:
// a function of the snapshot's geometry, of what is unlit and double-sided, and of the number. Or
// of each shape by itself (is_kept).
// Cost: twice through all triangles, some 40 ns each.
//
// Thread: any.

#ifndef BD_LIGHTS_SURFACE_POINTS_H
#define BD_LIGHTS_SURFACE_POINTS_H

#include <stdbool.h>
#include <stdint.h>

#include "base/err.h"
#include "kernel/math.h"
#include "scene/model/scene.h"

#define BD_SURFACE_POINTS_MAX (UINT32_C(1) << 20)

// Points that hide are of so many sets, which take turns: each is spread evenly by itself.
#define BD_SURFACE_POINT_SETS 16u

// What of the light that comes to it a surface sends on as a diffuse one would.
enum bd_sends {
    BD_SENDS_DIFFUSE,              // what its diffuse lobe reflects
    BD_SENDS_DIFFUSE_BESIDE_GLASS, // the same, but for what passes
    BD_SENDS_LAMBERT,              // its base colour: metals have such a lobe, too
    BD_SENDS_ALL,                  // what all of its BRDF reflects, of light from everywhere
    // The same, but for what goes on at glass and mirrors (lights/interface.h), of which brushed
    // metal is one, or is none.
    BD_SENDS_BESIDE_INTERFACES,
    BD_SENDS_BESIDE_MIRRORS,
    // Nothing is asked of what it sends on, but that it hides what is behind it: what is unlit has
    // points, too, and nothing has any on its back.
    BD_SENDS_NOTHING,
};

struct bd_surface_point {
    f3 position, normal; // render space; unit, the triangle's own, to the side it lies on
    f3 diffuse;          // albedo, of what it sends on
    uint32_t triangle;
    bool is_two_sided; // the triangle
    // By which it draws what is left to chance; whoever finds it says which, but where points are
    // kept, which have their own. Of what hides: its place among those that were asked for, some
    // of which are cut out.
    uint32_t number;
};

struct bd_surface_points {
    uint32_t count; // at most as many as asked for
    float area;     // that each stands for, render units squared
    struct bd_surface_point *points;
};

struct bd_surface_points_how {
    uint32_t count; // 1 to BD_SURFACE_POINTS_MAX
    enum bd_sends sends;
    bool by_coverage;
    // Points of both sides are one, on the front; what is unlit has some, too.
    bool once;
    // What is moved keeps its points, and others theirs: a little less even, and up to a sixtieth
    // fewer than asked for.
    bool is_kept;
    uint32_t seed; // of where they lie within their parts of triangles
};

// What blends has points as often as it is opaque, or where it is so by half. `pause` as in
// lights/area_lights.h.
// BD_ERR_NO_MEMORY, or what `pause` returns.
BD_MUST_CHECK
enum bd_err bd_surface_points_init(struct bd_surface_points *points, const struct bd_scene *scene,
                                   const struct bd_surface_points_how *how,
                                   enum bd_err (*pause)(void *user), void *user,
                                   struct bd_err_detail *detail);
void bd_surface_points_finish(struct bd_surface_points *points);

#endif
