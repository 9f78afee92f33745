// Render space: the frame in which the GPU works.
//
// World positions minus the scene's own origin (in double precision), times a power of two that
// brings the scene's diagonal to between 1 and 2; light in units of a power of two near the
// strongest light. So a scene of 1e-4 m and one of 1e6 m, lit by 1e-6 cd or by 1e9 cd, are the
// same numbers to every shader, and the factors out of it are exact (algorithms.md C 7, 8, 9, 55).

#ifndef BD_SCENE_MODEL_RENDER_SPACE_H
#define BD_SCENE_MODEL_RENDER_SPACE_H

#include "base/vec.h"
#include "scene/model/scene.h"

struct bd_render_space {
    bd_dvec3 origin_m;
    double render_per_m;  // power of two
    double unit_cd_m2;    // power of two: radiance of 1.0 in render space
    double radius;        // of a sphere about the render origin that holds the scene
};

struct bd_render_space bd_render_space_of(const struct bd_scene *scene);

static inline bd_dvec3 bd_render_from_world(const struct bd_render_space *space, bd_dvec3 p_m)
{
    return bd_dvec3_scale(bd_dvec3_sub(p_m, space->origin_m), space->render_per_m);
}

// Point and spot: cd. An intensity spreads over areas that shrink with the square of the scale.
static inline double bd_render_intensity(const struct bd_render_space *space, double cd)
{
    return cd * space->render_per_m * space->render_per_m / space->unit_cd_m2;
}

#endif
