#include "image/encode.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "base/assert.h"
#include "image/exr.h"
#include "image/half.h"
#include "image/jpeg.h"
#include "image/png.h"
#include "image/show.h"

#define HALF_NORMAL_MIN 0x1p-14f
#define HALF_MAX        65504.0f

const struct bd_encode_request bd_encode_request_default = {
    .format = BD_ENCODE_PNG,
    .exposure_auto = true,
    .tonemap = BD_TONEMAP_NEUTRAL,
    .jpeg_quality = 90,
};

static const struct {
    const char *name, *content_type;
} formats[BD_ENCODE_FORMAT_COUNT] = {
    [BD_ENCODE_PNG] = {"png", "image/png"},
    [BD_ENCODE_JPEG] = {"jpg", "image/jpeg"},
    [BD_ENCODE_EXR] = {"exr", "image/x-exr"},
    [BD_ENCODE_HALF] = {"half", "application/octet-stream"},
};

const char *bd_encode_format_name(enum bd_encode_format format)
{
    BD_ASSERT_CMP(format, <, BD_ENCODE_FORMAT_COUNT);
    return formats[format].name;
}

const char *bd_encode_content_type(enum bd_encode_format format)
{
    BD_ASSERT_CMP(format, <, BD_ENCODE_FORMAT_COUNT);
    return formats[format].content_type;
}

bool bd_encode_format_from_name(const char *name, enum bd_encode_format *out)
{
    if (strcasecmp(name, "jpeg") == 0) name = "jpg";
    for (int i = 0; i < BD_ENCODE_FORMAT_COUNT; i++) {
        if (strcasecmp(formats[i].name, name) != 0) continue;
        *out = (enum bd_encode_format)i;
        return true;
    }
    return false;
}

static enum bd_err check(const struct bd_encode_request *request, size_t layer_count,
                         struct bd_err_detail *detail)
{
    if (layer_count == 0) return bd_err_set(detail, BD_ERR_USAGE, "layers", "no layer to encode");
    if (!(fabsf(request->exposure_stops) <= BD_EXPOSURE_STOPS_MAX))
        return bd_err_set(detail, BD_ERR_USAGE, "exposure",
                          "exposure of %g stops; -%g to %g are allowed",
                          (double)request->exposure_stops, (double)BD_EXPOSURE_STOPS_MAX,
                          (double)BD_EXPOSURE_STOPS_MAX);
    if (request->jpeg_quality < 1 || request->jpeg_quality > 100)
        return bd_err_set(detail, BD_ERR_USAGE, "jpeg_quality",
                          "JPEG quality %d; 1 to 100 are allowed", request->jpeg_quality);
    return BD_ERR_OK;
}

static float choose_exposure(const struct bd_encode_request *request,
                             const struct bd_named_layer *layers, size_t layer_count)
{
    if (!request->exposure_auto) return request->exposure_stops;
    const struct bd_image *measured = layers[0].image;
    for (size_t i = 0; i < layer_count; i++)
        if (strcmp(layers[i].name, "beauty") == 0) measured = layers[i].image;
    return bd_exposure_auto(measured);
}

// The caller's manifest and our entries behind it.
struct full_manifest {
    struct bd_manifest_entry *entries;
    size_t count;
    char exposure[32];
};

static enum bd_err extend_manifest(struct full_manifest *full, const struct bd_manifest *manifest,
                                   const struct bd_encode_request *request, float stops)
{
    full->entries = malloc((manifest->count + 2) * sizeof *full->entries);
    if (!full->entries) return BD_ERR_NO_MEMORY;
    full->count = manifest->count;
    for (size_t i = 0; i < manifest->count; i++) full->entries[i] = manifest->entries[i];
    snprintf(full->exposure, sizeof full->exposure, "%.9g", (double)stops);
    full->entries[full->count++] = (struct bd_manifest_entry){"exposure_stops", full->exposure};
    if (request->format != BD_ENCODE_EXR)
        full->entries[full->count++] =
            (struct bd_manifest_entry){"tonemap", bd_tonemap_name(request->tonemap)};
    return BD_ERR_OK;
}

// Whether 16 bits hold a plane: nothing beyond their range, which would come back as infinity
// (depth where nothing is, a highlight), and not all of it below their full precision.
static bool fits_half(const struct bd_exr_picture *picture, const struct bd_exr_plane *plane)
{
    float largest = 0;
    for (size_t p = 0; p < (size_t)picture->width_px * picture->height_px; p++)
        largest = fmaxf(largest, fabsf(plane->samples[p * plane->stride]));
    return largest == 0 || (largest >= HALF_NORMAL_MIN && largest <= HALF_MAX);
}

static enum bd_err encode_exr(const struct bd_encode_request *request,
                              const struct bd_named_layer *layers, size_t layer_count,
                              struct bd_manifest manifest, struct bd_bytes *out,
                              struct bd_err_detail *detail)
{
    struct bd_exr_plane planes[BD_EXR_CHANNEL_MAX];
    struct bd_exr_picture picture = {
        .width_px = layers[0].image->width_px,
        .height_px = layers[0].image->height_px,
        .planes = planes,
        .manifest = manifest,
        .raw = request->exr_raw,
    };
    enum bd_err err =
        bd_layers_to_planes(layers, layer_count, planes, &picture.plane_count, detail);
    if (err) return err;
    for (size_t i = 0; i < picture.plane_count; i++)
        planes[i].half = request->exr_half && fits_half(&picture, &planes[i]);
    return bd_exr_write(&picture, out, detail);
}

static enum bd_err encode_shown(const struct bd_encode_request *request,
                                const struct bd_named_layer *layer, float stops,
                                struct bd_manifest manifest, struct bd_bytes *out,
                                struct bd_err_detail *detail)
{
    const struct bd_image *image = layer->image;
    uint8_t *rgb8 = malloc((size_t)image->width_px * image->height_px * 3);
    if (!rgb8) return bd_err_set(detail, BD_ERR_NO_MEMORY, "size", "no memory for the picture");
    bd_show_layer(layer->name, image, request->tonemap, stops, rgb8);
    struct bd_pixels8 pixels = {image->width_px, image->height_px, 3, rgb8};
    enum bd_err err = request->format == BD_ENCODE_JPEG
                          ? bd_jpeg_encode(&pixels, request->jpeg_quality, &manifest, out, detail)
                          : bd_png_encode(&pixels, &manifest, out, detail);
    free(rgb8);
    return err;
}

enum bd_err bd_encode(const struct bd_encode_request *request, const struct bd_named_layer *layers,
                      size_t layer_count, const struct bd_manifest *manifest,
                      struct bd_encoded *out, struct bd_err_detail *detail)
{
    *out = (struct bd_encoded){0};
    enum bd_err err = check(request, layer_count, detail);
    if (err) return err;
    out->exposure_stops = choose_exposure(request, layers, layer_count);
    if (request->format == BD_ENCODE_HALF)
        return bd_half_encode(layers[0].image, &out->bytes, detail);
    struct full_manifest full;
    err = extend_manifest(&full, manifest, request, out->exposure_stops);
    if (err) return bd_err_set(detail, err, "manifest", "no memory for the manifest");
    struct bd_manifest all = {full.entries, full.count};
    err = request->format == BD_ENCODE_EXR
              ? encode_exr(request, layers, layer_count, all, &out->bytes, detail)
              : encode_shown(request, &layers[0], out->exposure_stops, all, &out->bytes, detail);
    free(full.entries);
    return err;
}
