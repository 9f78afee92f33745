// Pictures as a display shows them, PNG and JPEG, as planes that are compared: linear, 0 to 1.
//
// Codes are taken for sRGB (IEC 61966-2-1), whatever colour chunks say, and decoded: what a display
// sends out for them, as a part of its white. That is no radiance: exposure and tone curve are in
// it, which the manifests of our own pictures name. Transparency is not looked at. Any thread.

#ifndef BD_IMAGE_SHOWN_H
#define BD_IMAGE_SHOWN_H

#include <stdbool.h>
#include <stddef.h>

#include "base/err.h"
#include "image/exr.h"
#include "image/tonemap.h"

// By the first bytes.
bool bd_shown_is(const void *bytes, size_t size_bytes);

// Channels R, G, B of PNGs of 8 and 16 bits (palettes and greys too) and of JPEGs; the texts of a
// PNG and the lines of a JPEG's comment, where it is ours, as attributes. BD_ERR_BAD_INPUT for
// broken bytes, BD_ERR_LIMIT for sizes above `limits`, before memory is taken for them.
BD_MUST_CHECK
enum bd_err bd_shown_read(const void *bytes, size_t size_bytes, const struct bd_exr_limits *limits,
                          struct bd_exr **out, struct bd_err_detail *detail);

// How a picture was shown, by its attributes. False, and `*out` exposure 0 in `linear`, where they
// do not say.
struct bd_showing {
    enum bd_tonemap tonemap;
    float stops;
};
bool bd_showing_of(const struct bd_exr *picture, struct bd_showing *out);

// Makes of a file of radiance what would have been shown of it: R, G and B through exposure and
// curve, and nothing else. BD_ERR_NOT_FOUND where it lacks one of them.
BD_MUST_CHECK
enum bd_err bd_show_exr(struct bd_exr *exr, const struct bd_showing *showing,
                        struct bd_err_detail *detail);

#endif
