// Pixel buffers of scene-linear floats: what a frame's layers are once they left the GPU.
//
// Rows run from the top of the picture to its bottom. Any thread; immutable once shared.

#ifndef BD_IMAGE_IMAGE_H
#define BD_IMAGE_IMAGE_H

#include <stddef.h>
#include <stdint.h>

#include "base/err.h"

struct bd_image {
    uint32_t width_px;
    uint32_t height_px;
    uint32_t channel_count; // 1, 3 or 4, interleaved
    float *pixels;          // width_px * height_px * channel_count, owned
};

// NULL if there is no memory. Pixels start at zero.
struct bd_image *bd_image_create(uint32_t width_px, uint32_t height_px, uint32_t channel_count);
// Destroys and nulls; takes NULL.
void bd_image_destroy(struct bd_image **image);

static inline float *bd_image_at(const struct bd_image *image, uint32_t x_px, uint32_t y_px)
{
    return image->pixels + ((size_t)y_px * image->width_px + x_px) * image->channel_count;
}

#endif
