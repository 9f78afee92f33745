// How far from their surfaces rays and segments begin and end.
#ifndef BD_KERNEL_LIFT_H
#define BD_KERNEL_LIFT_H

#include "kernel/math.h"

// Segments are lifted off their surfaces by what a position loses on its way through G-buffer and
// map, so that neighbours in the same plane do not hide them.
#define LIFT       3.8e-6f // times the largest coordinate
#define LIFT_LEAST 4.8e-7f // where all are small: lights and eyes are not

KERNEL float largest_coordinate(f3 v)
{
    return f_max(f_abs(v.x), f_max(f_abs(v.y), f_abs(v.z)));
}

// `view` = the largest of the view's position.
KERNEL float lift_of_segment(float view, f3 from, f3 to)
{
    float most = f_max(view, f_max(largest_coordinate(from), largest_coordinate(to)));
    return LIFT * most + LIFT_LEAST;
}

#endif
