// Encoded pictures, PNG and JPEG, to 8-bit RGBA: the textures of a scene.
//
// The input is a stranger's. Width and height are read and checked before anything is allocated
// for them, and the libraries get limits of their own. Only the import child calls this for bytes
// that a client sent (scene/import/import.h); tests/layers holds the rest to it. Thread: any.

#ifndef BD_IMAGE_DECODE_H
#define BD_IMAGE_DECODE_H

#include <stddef.h>
#include <stdint.h>

#include "base/err.h"

struct bd_decode_limits {
    uint32_t side_px; // of width and of height
    uint64_t texels;  // width x height
};

struct bd_picture_size {
    uint32_t width_px, height_px;
    uint64_t decode_bytes; // about what decoding takes, the result included
};

// What the head of a PNG or a JPEG says, without decoding anything. The same errors as below.
BD_MUST_CHECK
enum bd_err bd_picture_measure(const void *bytes, size_t size, uint32_t side_max_px,
                               const char *field, struct bd_picture_size *out,
                               struct bd_err_detail *detail);

// Every PNG (palette, grey, 16 bits a channel: all become 8-bit RGBA; gamma chunks are ignored, as
// glTF asks) and every JPEG that libjpeg-turbo reads (CMYK too). On success `*rgba` is the
// caller's to free, rows from the top. On failure BD_ERR_BAD_INPUT for broken bytes,
// BD_ERR_UNSUPPORTED for another format, BD_ERR_LIMIT or BD_ERR_NO_MEMORY; `field` goes into the
// error as it is.
BD_MUST_CHECK
enum bd_err bd_picture_decode(const void *bytes, size_t size, const struct bd_decode_limits *limits,
                              const char *field, uint32_t *width_px, uint32_t *height_px,
                              uint8_t **rgba, struct bd_err_detail *detail);

#endif
