// Where a frame and the reference see different surfaces through the middle of a pixel: ties on the
// edges of what is drawn, gaps, texels. A frame of 96x96 may owe nine tenths of its error to one
// such pixel, and nothing in it gives away which: so each pixel on an edge is looked at, by a ray
// from the camera without a path behind it. Places exactly on an edge are none: rays pass by them
// on the side that rasterisers take (BD_TIE_RIGHT, scene/model/framing.h). Private to reference/.

#ifndef BD_REFERENCE_CHECK_TIES_H
#define BD_REFERENCE_CHECK_TIES_H

#include "reference/check.h"

// Pixels that are looked at, at most: of a frame with more of them every second, third, ... one.
#define BD_CHECK_TIES_MAX (1u << 18)

struct bd_check_ties {
    uint8_t *differs; // of each pixel, rows from the top; NULL: nobody looked
};

// Where tracer->first_surface is NULL nobody looks. The caller frees out->differs, also after an
// error. The same frame and tracer make the same ties.
BD_MUST_CHECK
enum bd_err bd_check_find_ties(const struct bd_check_frame *frame,
                               const struct bd_check_tracer *tracer, struct bd_check_ties *out,
                               struct bd_err_detail *detail);

#endif
