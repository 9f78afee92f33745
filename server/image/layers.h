// A frame's layers as channels of an EXR file, both ways: the one place that knows the names.
//
//   beauty               R G B A (the root, so that any viewer shows it)
//   normal               normal.X normal.Y normal.Z
//   depth                depth.Z
//   any other, 3 planes  NAME.R NAME.G NAME.B
//   any other, 1 plane   NAME.Y
//
// A reference also holds each layer of light twice more, as means over two halves of its samples
// that share no random number, and the layer itself is their mean:
//
//   beauty               half_a.R half_a.G half_a.B               half_b alike
//   any other            half_a.NAME.R half_a.NAME.G half_a.NAME.B
//
// Any thread.

#ifndef BD_IMAGE_LAYERS_H
#define BD_IMAGE_LAYERS_H

#include <stddef.h>

#include "base/err.h"
#include "image/exr.h"
#include "image/image.h"

struct bd_named_layer {
    const char *name;             // "beauty", "depth", ...
    const struct bd_image *image; // borrowed
};

// Fills `planes` with borrowed pointers into the layers. BD_ERR_LIMIT if they have more than
// BD_EXR_CHANNEL_MAX planes, BD_ERR_USAGE if their sizes differ.
BD_MUST_CHECK
enum bd_err bd_layers_to_planes(const struct bd_named_layer *layers, size_t layer_count,
                                struct bd_exr_plane planes[BD_EXR_CHANNEL_MAX], size_t *plane_count,
                                struct bd_err_detail *detail);

enum bd_half { BD_HALF_A, BD_HALF_B, BD_HALF_COUNT };

// The name of the layer that holds one half of `layer`: "half_a" of beauty, "half_a.direct". Goes
// wherever a layer's name does. Cut where it would not fit.
void bd_layer_half_name(enum bd_half half, const char *layer, char name[BD_EXR_CHANNEL_NAME_MAX]);

// Copies one layer out of a file: three channels, or one where the file has one; "beauty" without
// its alpha, since nothing is measured on it. BD_ERR_NOT_FOUND names what the file does have.
BD_MUST_CHECK
enum bd_err bd_layer_from_exr(const struct bd_exr *exr, const char *layer, struct bd_image **out,
                              struct bd_err_detail *detail);

#endif
