// What a pixel of the G-buffer says, and the way from it into render space.
#ifndef BD_KERNEL_PIXEL_H
#define BD_KERNEL_PIXEL_H

#include "kernel/math.h"

// Normalised device coordinates of a place in the picture, in [-1, 1]: to the right, and up.
KERNEL float ndc_to_right(float at_px, float width_px) { return 2.0f * (at_px / width_px) - 1.0f; }
KERNEL float ndc_up(float at_px, float height_px) { return 1.0f - 2.0f * (at_px / height_px); }

// Of a place relative to the view's own, from the depth along its axis. Slopes are per `reach`: the
// depth, or 1 of an orthographic view.
KERNEL f3 place_in_view(f3 axis_x, f3 axis_y, f3 axis_z, float slope_x, float slope_y, float reach,
                        float depth)
{
    f3 lateral = f3_add(f3_scale(axis_x, slope_x * reach), f3_scale(axis_y, slope_y * reach));
    return f3_sub(lateral, f3_scale(axis_z, depth));
}

// Something is there, and light can reach it.
KERNEL bool surface_is_lit(float unlit, float covered)
{
    return b_and(covered > 0.0f, unlit == 0.0f);
}

#endif
