// A view: a camera, or one face of a light. Render space: the scene's own origin, scaled by a
// power of two to a size of about one (scene/model/render_space.h).
#ifndef BD_SHARED_VIEW_H
#define BD_SHARED_VIEW_H

#include "shared/types.h"

struct bd_view {
    BD_VEC4 position; // xyz render space; w = 1 for an orthographic view, else 0
    BD_VEC4 axis_x;   // xyz to the right; w = tangent of the half width (orthographic: half width)
    BD_VEC4 axis_y;   // xyz up; w = the same of the height
    BD_VEC4 axis_z;   // xyz backwards, the view looks along -z; w = near distance
    BD_VEC4 sample_px; // xy = where in its pixel the sample lies, (.5, .5) = centre, y down;
                       // z = far distance (orthographic), w = unused
    BD_UVEC4 size_px;  // xy = width and height
};

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_view) == 96, "std140 size");
#endif

#endif
