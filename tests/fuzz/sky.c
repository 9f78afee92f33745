// Maps of the sky: EXR in every compression, and Radiance pictures.

#include <math.h>

#include "base/assert.h"
#include "image/exr.h"
#include "image/rgbe.h"

#include "target.h"

#define SIDE_MAX_PX    300
#define SIZE_MAX_BYTES (4u << 20)

static void read_exr(const uint8_t *bytes, size_t size)
{
    const struct bd_exr_limits limits = {SIDE_MAX_PX, SIZE_MAX_BYTES};
    struct bd_exr *exr = NULL;
    struct bd_err_detail detail = {0};
    const enum bd_err err = bd_exr_read(bytes, size, &limits, &exr, &detail);
    BD_ASSERT(!err == (exr != NULL));
    BD_ASSERT(!err || detail.message[0]);
    if (err) return;
    BD_ASSERT(exr->width_px <= SIDE_MAX_PX && exr->height_px <= SIDE_MAX_PX);
    // Every sample is there to be read.
    const size_t pixels = (size_t)exr->width_px * exr->height_px;
    size_t finite = 0;
    for (uint32_t c = 0; c < exr->channel_count; c++)
        for (size_t p = 0; p < pixels; p++) finite += isfinite(exr->channels[c].samples[p]) != 0;
    BD_ASSERT(finite <= pixels * exr->channel_count);
    bd_exr_destroy(&exr);
}

static void read_rgbe(const uint8_t *bytes, size_t size)
{
    struct bd_image *image = NULL;
    struct bd_err_detail detail = {0};
    const enum bd_err err = bd_rgbe_read(bytes, size, SIDE_MAX_PX, &image, &detail);
    BD_ASSERT(!err == (image != NULL));
    BD_ASSERT(!err || detail.message[0]);
    if (image) BD_ASSERT(image->width_px <= SIDE_MAX_PX && image->height_px <= SIDE_MAX_PX);
    const size_t samples = image ? 3 * (size_t)image->width_px * image->height_px : 0;
    for (size_t s = 0; s < samples; s++) BD_ASSERT(image->pixels[s] >= 0);
    bd_image_destroy(&image);
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
    if (bd_rgbe_is(bytes, size))
        read_rgbe(bytes, size);
    else
        read_exr(bytes, size);
    return 0;
}
