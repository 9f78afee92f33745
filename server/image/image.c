#include "image/image.h"

#include <stdlib.h>

struct bd_image *bd_image_create(uint32_t width_px, uint32_t height_px, uint32_t channel_count)
{
    struct bd_image *image = malloc(sizeof *image);
    if (!image) return NULL;
    *image = (struct bd_image){width_px, height_px, channel_count, NULL};
    image->pixels = calloc((size_t)width_px * height_px * channel_count, sizeof(float));
    if (!image->pixels) bd_image_destroy(&image);
    return image;
}

void bd_image_destroy(struct bd_image **image)
{
    if (!*image) return;
    free((*image)->pixels);
    free(*image);
    *image = NULL;
}
