// A frame's layers to the bytes of a picture file: the one call that the daemon makes.
//
// Half is the first of `layers` as it is, without a head: rows from the top, four 16-bit floats a
// pixel (R G B A, one channel three times; A is 1 where the layer has none), little-endian. What is
// beyond their range becomes the largest, what is no number 0.
//
// EXR keeps every layer, scene-linear and unexposed. PNG and JPEG hold one, the first of
// `layers`, opaque (what the scene does not cover is black), shown like this:
//
//   beauty direct indirect emission    exposure, tone curve, sRGB; `auto` exposure is taken from
//                                      the layer called beauty if it is among `layers`, else from
//                                      the one that is shown
//   albedo                             0..1, sRGB; no exposure, no curve
//   normal                             (n + 1) / 2, not sRGB-coded: 128 128 255 looks along +Z
//   depth                              nearest white to farthest 10 % grey, linear in between,
//                                      nothing there (1e10, infinity) black; not sRGB-coded
//   any other of one channel           0..1 as grey, not sRGB-coded; of three: as beauty
//
// Thread: any; a megapixel takes tens of milliseconds, so keep it off the event loop.

#ifndef BD_IMAGE_ENCODE_H
#define BD_IMAGE_ENCODE_H

#include <stdbool.h>
#include <stddef.h>

#include "base/err.h"
#include "image/bytes.h"
#include "image/layers.h"
#include "image/manifest.h"
#include "image/tonemap.h"

enum bd_encode_format { BD_ENCODE_PNG, BD_ENCODE_JPEG, BD_ENCODE_EXR, BD_ENCODE_HALF, BD_ENCODE_FORMAT_COUNT };

// "png", "jpg", "exr", "half".
const char *bd_encode_format_name(enum bd_encode_format format);
// "image/png", "image/jpeg", "image/x-exr", "application/octet-stream".
const char *bd_encode_content_type(enum bd_encode_format format);
// By name: png, jpg, jpeg, exr, half, in any case. False, and `*out` untouched, if there is none.
bool bd_encode_format_from_name(const char *name, enum bd_encode_format *out);

struct bd_encode_request {
    enum bd_encode_format format;
    bool exposure_auto;
    float exposure_stops; // unless auto; within +-BD_EXPOSURE_STOPS_MAX
    enum bd_tonemap tonemap;
    bool exr_half;    // 16-bit floats, but for planes that they cannot hold
    bool exr_raw;     // not compressed
    int jpeg_quality; // 1 to 100
};

// PNG, exposure auto, neutral, 32-bit EXR, quality 90.
extern const struct bd_encode_request bd_encode_request_default;

struct bd_encoded {
    struct bd_bytes bytes; // owned by the caller; free with bd_bytes_finish
    float exposure_stops;  // what was used; of an EXR, what `auto` would use, or what was asked
};

// Encodes. Every size in `layers` (at least one) is the same. The manifest is written along, with
// two entries of ours behind it: exposure_stops and, not in EXR, tonemap; half has none of it. The same arguments give
// the same bytes. BD_ERR_USAGE names the field that is out of range.
BD_MUST_CHECK
enum bd_err bd_encode(const struct bd_encode_request *request, const struct bd_named_layer *layers,
                      size_t layer_count, const struct bd_manifest *manifest,
                      struct bd_encoded *out, struct bd_err_detail *detail);

#endif
