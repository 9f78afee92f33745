// PNG out: 8 bits a channel, sRGB, with the manifest as text. Any thread.

#ifndef BD_IMAGE_PNG_H
#define BD_IMAGE_PNG_H

#include <stdint.h>

#include "base/err.h"
#include "image/bytes.h"
#include "image/manifest.h"

struct bd_pixels8 {
    uint32_t width_px, height_px;
    uint32_t channel_count; // 3 = RGB, 4 = RGBA with straight alpha
    const uint8_t *samples; // sRGB-coded, interleaved, rows from the top
};

// With an sRGB chunk (perceptual intent) and one text chunk a pair: tEXt where the value is
// ASCII, iTXt where it is not. The same pixels give the same bytes.
// `*out` must be empty; free it with bd_bytes_finish.
BD_MUST_CHECK
enum bd_err bd_png_encode(const struct bd_pixels8 *pixels, const struct bd_manifest *manifest,
                          struct bd_bytes *out, struct bd_err_detail *detail);

#endif
