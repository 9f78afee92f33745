// OpenEXR files as named float planes: written deterministically, read defensively.
//
// Knows channels and string attributes, not layers (image/layers.h names those). Uses OpenEXR's C
// core. Any thread; no state is shared between calls.

#ifndef BD_IMAGE_EXR_H
#define BD_IMAGE_EXR_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/err.h"
#include "image/bytes.h"
#include "image/manifest.h"

#define BD_EXR_CHANNEL_MAX      64
#define BD_EXR_CHANNEL_NAME_MAX 64 // bytes with the final zero

// A plane to write: pixel p (rows from the top) is samples[p * stride]. Borrowed.
struct bd_exr_plane {
    char name[BD_EXR_CHANNEL_NAME_MAX];
    const float *samples;
    size_t stride;
    // 16-bit floats: 3 decimal digits; what is beyond 65504 becomes infinity, as rounding says.
    bool half;
};

struct bd_exr_picture {
    uint32_t width_px, height_px;
    const struct bd_exr_plane *planes; // names are unique, in any order
    size_t plane_count;                // 1 to BD_EXR_CHANNEL_MAX
    struct bd_manifest manifest;
    bool raw; // not compressed: for who reads it at once
};

// One part, scan lines from top to bottom, ZIP (lossless) unless `raw`. The same picture gives the same bytes.
// `*out` must be empty; free it with bd_bytes_finish.
BD_MUST_CHECK
enum bd_err bd_exr_write(const struct bd_exr_picture *picture, struct bd_bytes *out,
                         struct bd_err_detail *detail);

struct bd_exr_limits {
    uint32_t side_px_max;
    uint64_t size_bytes_max; // of all planes together, as floats
};

// 32768 pixels a side, 1 GiB of planes.
extern const struct bd_exr_limits bd_exr_limits_default;

struct bd_exr {
    uint32_t width_px, height_px;
    uint32_t channel_count;
    struct {
        char name[BD_EXR_CHANNEL_NAME_MAX];
        float *samples; // width_px * height_px, owned
    } channels[BD_EXR_CHANNEL_MAX];
    size_t attribute_count; // string attributes only
    struct bd_exr_attribute {
        char *key, *value;
    } * attributes;
};

// Reads the first part: half, float and uint channels, scan lines or tiles (of mip maps, the
// largest level), in every compression from NONE to DWAB. Deep data, subsampled channels and
// other compressions are BD_ERR_UNSUPPORTED; broken or truncated bytes BD_ERR_BAD_INPUT; sizes
// above `limits`, or that the file's length cannot justify, are refused before memory is taken.
BD_MUST_CHECK
enum bd_err bd_exr_read(const void *bytes, size_t size_bytes, const struct bd_exr_limits *limits,
                        struct bd_exr **out, struct bd_err_detail *detail);

// The plane of that name, NULL if there is none.
const float *bd_exr_channel(const struct bd_exr *exr, const char *name);
// The string attribute of that name, NULL if there is none.
const char *bd_exr_attribute(const struct bd_exr *exr, const char *key);
// Destroys and nulls; takes NULL.
void bd_exr_destroy(struct bd_exr **exr);

#endif
