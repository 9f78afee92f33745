#include "image/layers.h"

#include <stdio.h>
#include <string.h>

#include "base/assert.h"

// One letter a channel, in the order of the image's interleaving.
static const char *channel_letters(const char *layer, uint32_t channel_count)
{
    if (strcmp(layer, "normal") == 0) return "XYZ";
    if (strcmp(layer, "depth") == 0) return "Z";
    return channel_count == 1 ? "Y" : "RGBA";
}

static void channel_name(char name[BD_EXR_CHANNEL_NAME_MAX], const char *layer, char letter)
{
    if (strcmp(layer, "beauty") == 0)
        snprintf(name, BD_EXR_CHANNEL_NAME_MAX, "%c", letter);
    else
        snprintf(name, BD_EXR_CHANNEL_NAME_MAX, "%.48s.%c", layer, letter);
}

void bd_layer_half_name(enum bd_half half, const char *layer, char name[BD_EXR_CHANNEL_NAME_MAX])
{
    BD_ASSERT_CMP(half, <, BD_HALF_COUNT);
    const char *prefix = half == BD_HALF_A ? "half_a" : "half_b";
    if (strcmp(layer, "beauty") == 0)
        snprintf(name, BD_EXR_CHANNEL_NAME_MAX, "%s", prefix);
    else
        snprintf(name, BD_EXR_CHANNEL_NAME_MAX, "%s.%.40s", prefix, layer);
}

enum bd_err bd_layers_to_planes(const struct bd_named_layer *layers, size_t layer_count,
                                struct bd_exr_plane planes[BD_EXR_CHANNEL_MAX], size_t *plane_count,
                                struct bd_err_detail *detail)
{
    *plane_count = 0;
    for (size_t i = 0; i < layer_count; i++) {
        const struct bd_image *image = layers[i].image;
        const char *letters = channel_letters(layers[i].name, image->channel_count);
        if (image->width_px != layers[0].image->width_px ||
            image->height_px != layers[0].image->height_px)
            return bd_err_set(detail, BD_ERR_USAGE, "layers", "layer %s has another size",
                              layers[i].name);
        if (image->channel_count > strlen(letters) ||
            *plane_count + image->channel_count > BD_EXR_CHANNEL_MAX)
            return bd_err_set(detail, BD_ERR_LIMIT, "layers",
                              "layer %s has %u planes, which is more than fit", layers[i].name,
                              image->channel_count);
        for (uint32_t c = 0; c < image->channel_count; c++) {
            struct bd_exr_plane *plane = &planes[(*plane_count)++];
            channel_name(plane->name, layers[i].name, letters[c]);
            plane->samples = image->pixels + c;
            plane->stride = image->channel_count;
        }
    }
    return BD_ERR_OK;
}

static enum bd_err no_such_layer(const struct bd_exr *exr, const char *layer,
                                 struct bd_err_detail *detail)
{
    char names[400] = "";
    size_t used = 0;
    for (uint32_t i = 0; i < exr->channel_count && used < sizeof names - 1; i++)
        used += (size_t)snprintf(names + used, sizeof names - used, " %s", exr->channels[i].name);
    return bd_err_set(detail, BD_ERR_NOT_FOUND, "layer", "no layer %.40s; the file's channels:%s",
                      layer, names);
}

// The planes of a layer, tried as three channels and then as one. Returns how many there are.
static uint32_t find_planes(const struct bd_exr *exr, const char *layer, const float *planes[3])
{
    static const struct {
        uint32_t count;
        const char *letters;
    } forms[] = {{3, "RGB"}, {3, "XYZ"}, {1, "Z"}, {1, "Y"}};
    for (size_t f = 0; f < sizeof forms / sizeof forms[0]; f++) {
        uint32_t found = 0;
        for (; found < forms[f].count; found++) {
            char name[BD_EXR_CHANNEL_NAME_MAX];
            channel_name(name, layer, forms[f].letters[found]);
            planes[found] = bd_exr_channel(exr, name);
            if (!planes[found]) break;
        }
        if (found == forms[f].count) return found;
    }
    return 0;
}

enum bd_err bd_layer_from_exr(const struct bd_exr *exr, const char *layer, struct bd_image **out,
                              struct bd_err_detail *detail)
{
    const float *planes[3];
    uint32_t count = find_planes(exr, layer, planes);
    if (!count) return no_such_layer(exr, layer, detail);
    struct bd_image *image = bd_image_create(exr->width_px, exr->height_px, count);
    if (!image) return bd_err_set(detail, BD_ERR_NO_MEMORY, "layer", "no memory for a layer");
    size_t pixel_count = (size_t)exr->width_px * exr->height_px;
    for (size_t p = 0; p < pixel_count; p++)
        for (uint32_t c = 0; c < count; c++) image->pixels[p * count + c] = planes[c][p];
    *out = image;
    return BD_ERR_OK;
}
