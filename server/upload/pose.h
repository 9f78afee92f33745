// A viewpoint that the scene does not hold. Plain data: what is seen follows from its numbers alone.

#ifndef BD_UPLOAD_POSE_H
#define BD_UPLOAD_POSE_H

#include <stdbool.h>

#include "base/vec.h"

struct bd_pose {
    bool is_set;       // otherwise one of the scene's cameras
    bd_dvec3 eye_m;    // world space
    bd_dvec3 target_m; // in the middle of the picture; not the eye
    bd_dvec3 up;       // of any length; not along the line of sight
    double yfov;       // radians, ]0, pi[; 0 = that of the scene's first camera
};

#endif
