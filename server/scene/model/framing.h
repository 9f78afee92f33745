// What frames a picture: a camera of the scene, or a pose that the scene does not hold. Those who
// draw it and those who trace it look through the same one.
//
// Plain data; any thread.

#ifndef BD_SCENE_MODEL_FRAMING_H
#define BD_SCENE_MODEL_FRAMING_H

#include <stdbool.h>

#include "base/vec.h"
#include "scene/model/scene.h"

// What is seen follows from its numbers alone.
struct bd_pose {
    bool is_set;       // otherwise one of the scene's cameras
    bd_dvec3 eye_m;    // world space
    bd_dvec3 target_m; // in the middle of the picture; not the eye
    bd_dvec3 up;       // of any length; not along the line of sight
    double yfov;       // radians, ]0, pi[; 0 = that of the scene's first camera
};

// How far rays pass by a pixel's place, as parts of the picture's width and height, to the right
// and up: a place exactly on an edge, as in the diagonals of a symmetric room, shows a rasteriser
// the surface on that side, and a ray whichever its last bit falls to. Some bits beyond what 32
// tell, and a thousandth of a pixel of a picture of a thousand.
#define BD_TIE_RIGHT (1.0 / (1 << 20))
#define BD_TIE_UP    (1.0 / (1 << 21))

struct bd_framing {
    bd_dvec3 position_m;             // world space
    bd_dvec3 axis_x, axis_y, axis_z; // right, up, backwards; orthonormal
    bool orthographic;
    double half_height;   // tangent; metres if orthographic
    double near_m, far_m; // +inf = none
};

// By a pose that is set, perspective, its near plane at a ten thousandth of the scene's diagonal;
// or else by a placed camera.
struct bd_framing bd_framing_of(const struct bd_scene *scene, const struct bd_pose *pose,
                                uint32_t placed_camera);

#endif
