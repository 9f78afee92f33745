// A picture at a fraction of its size, by a box filter: every texel of the result is the mean of
// the area that it covers.
//
// Integers until the last step, in one order: the same bytes from every compiler. Thread: any.

#ifndef BD_IMAGE_SHRINK_H
#define BD_IMAGE_SHRINK_H

#include <stdbool.h>
#include <stdint.h>

// What the bytes of a picture mean, and so what their mean is.
enum bd_texel_kind {
    BD_TEXEL_COLOR,  // sRGB: averaged as light; alpha as it is
    BD_TEXEL_NORMAL, // directions in tangent space: averaged, and made as long as one again
    BD_TEXEL_DATA,   // numbers
};

struct bd_texels {
    uint32_t width_px, height_px;
    uint8_t *rgba; // rows from the top
};

// Fills `to->rgba`, which the caller gives, from `from`; neither side of `to` is larger than the
// same of `from`, nor 0. False without memory for a row of sums.
bool bd_shrink(const struct bd_texels *from, enum bd_texel_kind kind, const struct bd_texels *to)
    __attribute__((warn_unused_result));

#endif
