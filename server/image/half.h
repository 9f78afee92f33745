// A picture as bare 16-bit floats, for a client that shows it by its own means.
//
// Thread: any.

#ifndef BD_IMAGE_HALF_H
#define BD_IMAGE_HALF_H

#include <stdint.h>

#include "base/err.h"
#include "image/bytes.h"
#include "image/image.h"

// The nearest of binary16, ties to even. Beyond its range the largest finite one, of the sign; NaN
// is 0.
uint16_t bd_half_from_float(float value);

// Rows from the top, four halves a pixel, little-endian (image/encode.h).
BD_MUST_CHECK
enum bd_err bd_half_encode(const struct bd_image *image, struct bd_bytes *out,
                           struct bd_err_detail *detail);

#endif
