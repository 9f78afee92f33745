// Radiance pictures (.hdr, .pic): three bytes and a common exponent a pixel, with and without runs.
//
// Ward, "Real Pixels", Graphics Gems II, 1991, and Radiance's color.c: a byte m stands for
// (m + 1/2) / 256 * 2^(exponent - 128), and the head's EXPOSURE lines are what pixels were
// multiplied by; both are undone. The input is a stranger's: width and height are held to the
// limits and to the bytes before memory is taken. Thread: any.

#ifndef BD_IMAGE_RGBE_H
#define BD_IMAGE_RGBE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/err.h"
#include "image/image.h"

// Whether the bytes begin as such a picture does.
bool bd_rgbe_is(const void *bytes, size_t size_bytes);

// Three channels, rows from the top, for the caller to destroy. Rows may run up or down and left or
// right in the file; pictures on their side, and those in XYZ, are BD_ERR_UNSUPPORTED. Broken or
// truncated bytes are BD_ERR_BAD_INPUT, more than `side_px_max` a side BD_ERR_LIMIT.
BD_MUST_CHECK
enum bd_err bd_rgbe_read(const void *bytes, size_t size_bytes, uint32_t side_px_max,
                         struct bd_image **out, struct bd_err_detail *detail);

#endif
