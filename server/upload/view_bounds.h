// Which boxes of a mesh can show in a viewpoint's picture: its bounds, taken into the mesh's space.
//
// Conservative: what is called outside draws no pixel on a device that keeps to GL, whatever the
// rounding of its shaders and of its pixel grid. Bounds are a little wider than the picture.
//
// Pure arithmetic. Thread: any.

#ifndef BD_UPLOAD_VIEW_BOUNDS_H
#define BD_UPLOAD_VIEW_BOUNDS_H

#include "scene/model/render_space.h"
#include "upload/viewpoint.h"

#define BD_VIEW_PLANES_MAX 6

// In any space: inside where dot(normal, p) + offset <= 0 for every plane.
struct bd_view_bounds {
    uint32_t plane_count;
    struct {
        double normal[3], offset;
    } planes[BD_VIEW_PLANES_MAX];
};

struct bd_box {
    float min[3], max[3];
};

enum bd_view_share {
    BD_VIEW_NONE, // of the box shows
    BD_VIEW_SOME, // may show
    BD_VIEW_ALL,  // lies within the bounds
};

// Of a viewpoint, in its own space (x right, y up, z backwards, render units from its position).
struct bd_view_bounds bd_view_bounds_of(const struct bd_viewpoint *viewpoint,
                                        const struct bd_render_space *space);

// Those of a viewpoint in the space of a mesh. `rows` are the first three of the instance in the
// device's array (shared/instance.h), `box` holds all of the mesh that will be asked about: how far
// shaders may round follows from it.
struct bd_view_bounds bd_view_bounds_in_mesh(const struct bd_view_bounds *bounds,
                                             const float rows[12], const struct bd_box *box);

enum bd_view_share bd_view_bounds_share(const struct bd_view_bounds *bounds,
                                        const struct bd_box *box);

#endif
