// JPEG out: 8 bits, 4:4:4, with the manifest as a comment. Any thread.

#ifndef BD_IMAGE_JPEG_H
#define BD_IMAGE_JPEG_H

#include "base/err.h"
#include "image/bytes.h"
#include "image/manifest.h"
#include "image/png.h"

// `quality` 1 to 100. Three channels only. The manifest goes, as KEY=VALUE lines, into one COM
// segment right behind the JFIF header, as far as its 65533 bytes hold it: whole pairs only.
// The same pixels give the same bytes.
// `*out` must be empty; free it with bd_bytes_finish.
BD_MUST_CHECK
enum bd_err bd_jpeg_encode(const struct bd_pixels8 *pixels, int quality,
                           const struct bd_manifest *manifest, struct bd_bytes *out,
                           struct bd_err_detail *detail);

#endif
