// What OpenEXR's C core of 3.1 does not decode, or not rightly (DWAA, DWAB, B44, B44A), by its C++
// library: the pixels alone, of a file whose header was read and whose sizes were checked
// (exr_read.c). Private to exr_*.
//
// Thread: any.

#ifndef BD_IMAGE_EXR_LOSSY_H
#define BD_IMAGE_EXR_LOSSY_H

#include <stdbool.h>
#include <stddef.h>

#include "base/err.h"
#include "image/exr.h"

#ifdef __cplusplus
extern "C" {
#endif

// Into the channels of `exr`, of the first part's size and names, whose data window begins at
// `left_px`, `top_px`. On failure `why`, of `why_bytes` bytes, says what the library said.
BD_MUST_CHECK
enum bd_err bd_exr_lossy_read(const void *bytes, size_t size_bytes, int left_px, int top_px,
                              struct bd_exr *exr, char *why, size_t why_bytes);

#ifdef __cplusplus
}
#endif

#endif
