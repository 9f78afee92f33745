// One layer as 8-bit RGB for the eye, by the table in image/encode.h. Any thread.

#ifndef BD_IMAGE_SHOW_H
#define BD_IMAGE_SHOW_H

#include <stdint.h>

#include "image/image.h"
#include "image/tonemap.h"

// `rgb8`: three bytes a pixel. `tonemap` and `stops` matter to layers of radiance only.
void bd_show_layer(const char *layer, const struct bd_image *image, enum bd_tonemap tonemap,
                   float stops, uint8_t *rgb8);

#endif
