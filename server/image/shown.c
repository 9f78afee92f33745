#include "image/shown.h"

#include <math.h>
#include <spng.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "image/decode.h"

static const uint8_t png_magic[] = {0x89, 'P', 'N', 'G'};
static const uint8_t jpeg_magic[] = {0xff, 0xd8, 0xff};

static bool begins_with(const void *bytes, size_t size_bytes, const uint8_t *magic, size_t count)
{
    return size_bytes >= count && memcmp(bytes, magic, count) == 0;
}

bool bd_shown_is(const void *bytes, size_t size_bytes)
{
    return begins_with(bytes, size_bytes, png_magic, sizeof png_magic) ||
           begins_with(bytes, size_bytes, jpeg_magic, sizeof jpeg_magic);
}

static float linear_of(double code)
{
    return (float)(code <= 0.04045 ? code / 12.92 : pow((code + 0.055) / 1.055, 2.4));
}

// --- planes ---------------------------------------------------------------------------------

static enum bd_err no_memory(struct bd_err_detail *detail)
{
    return bd_err_set(detail, BD_ERR_NO_MEMORY, "picture", "no memory for the picture");
}

static enum bd_err create(uint32_t width_px, uint32_t height_px, const struct bd_exr_limits *limits,
                          struct bd_exr **out, struct bd_err_detail *detail)
{
    uint64_t pixels = (uint64_t)width_px * height_px;
    if (width_px > limits->side_px_max || height_px > limits->side_px_max ||
        pixels * 3 * sizeof(float) > limits->size_bytes_max)
        return bd_err_set(detail, BD_ERR_LIMIT, "picture",
                          "%ux%u pixels, limits %u a side and %llu bytes of planes", width_px,
                          height_px, limits->side_px_max,
                          (unsigned long long)limits->size_bytes_max);
    *out = calloc(1, sizeof **out);
    if (!*out) return no_memory(detail);
    (*out)->width_px = width_px;
    (*out)->height_px = height_px;
    (*out)->channel_count = 3;
    for (uint32_t c = 0; c < 3; c++) {
        (*out)->channels[c].name[0] = "RGB"[c];
        (*out)->channels[c].samples = malloc(pixels * sizeof(float));
        if (!(*out)->channels[c].samples) return no_memory(detail);
    }
    return BD_ERR_OK;
}

static bool add_attribute(struct bd_exr *exr, const char *key, size_t key_length, const char *value,
                          size_t value_length)
{
    struct bd_exr_attribute *grown =
        realloc(exr->attributes, (exr->attribute_count + 1) * sizeof *grown);
    if (!grown) return false;
    exr->attributes = grown;
    struct bd_exr_attribute *added = &grown[exr->attribute_count++];
    added->key = strndup(key, key_length);
    added->value = strndup(value, value_length);
    return added->key && added->value;
}

// --- PNG ------------------------------------------------------------------------------------

// Texts are kept, up to what a manifest of ours has at most.
#define PNG_TEXT_BYTES_MAX ((size_t)1 << 20)

static enum bd_err read_texts(spng_ctx *png, struct bd_exr *exr, struct bd_err_detail *detail)
{
    uint32_t count = 0;
    if (spng_get_text(png, NULL, &count) || count == 0) return BD_ERR_OK;
    struct spng_text *texts = calloc(count, sizeof *texts);
    if (!texts) return no_memory(detail);
    bool kept = true;
    if (spng_get_text(png, texts, &count) == 0)
        for (uint32_t i = 0; kept && i < count; i++)
            kept = add_attribute(exr, texts[i].keyword, sizeof texts[i].keyword, texts[i].text,
                                 texts[i].length);
    free(texts);
    return kept ? BD_ERR_OK : no_memory(detail);
}

static enum bd_err png_err(int code, struct bd_err_detail *detail)
{
    if (code == SPNG_EMEM) return no_memory(detail);
    return bd_err_set(detail, BD_ERR_BAD_INPUT, "picture", "broken PNG: %s", spng_strerror(code));
}

static enum bd_err decode_png(spng_ctx *png, struct bd_exr *exr, struct bd_err_detail *detail)
{
    size_t pixels = (size_t)exr->width_px * exr->height_px;
    uint16_t *rgba = malloc(pixels * 4 * sizeof *rgba);
    if (!rgba) return no_memory(detail);
    int code = spng_decode_image(png, rgba, pixels * 4 * sizeof *rgba, SPNG_FMT_RGBA16,
                                 SPNG_DECODE_TRNS);
    for (size_t i = 0; !code && i < pixels; i++)
        for (uint32_t c = 0; c < 3; c++)
            exr->channels[c].samples[i] = linear_of(rgba[4 * i + c] / 65535.0);
    free(rgba);
    return code ? png_err(code, detail) : read_texts(png, exr, detail);
}

static enum bd_err read_png(const void *bytes, size_t size_bytes,
                            const struct bd_exr_limits *limits, struct bd_exr **out,
                            struct bd_err_detail *detail)
{
    struct spng_ihdr header = {0};
    spng_ctx *png = spng_ctx_new(0);
    if (!png) return no_memory(detail);
    int code = spng_set_chunk_limits(png, PNG_TEXT_BYTES_MAX, PNG_TEXT_BYTES_MAX);
    if (!code) code = spng_set_crc_action(png, SPNG_CRC_ERROR, SPNG_CRC_DISCARD);
    if (!code) code = spng_set_png_buffer(png, bytes, size_bytes);
    if (!code) code = spng_get_ihdr(png, &header);
    enum bd_err err =
        code ? png_err(code, detail) : create(header.width, header.height, limits, out, detail);
    if (!err) err = decode_png(png, *out, detail);
    spng_ctx_free(png);
    return err;
}

// --- JPEG -----------------------------------------------------------------------------------

// Lines KEY=VALUE of the first comment, as bd_jpeg_encode writes them.
static enum bd_err read_comment(const uint8_t *bytes, size_t size_bytes, struct bd_exr *exr,
                                struct bd_err_detail *detail)
{
    size_t at = 2;
    while (at + 4 <= size_bytes && bytes[at] == 0xff && bytes[at + 1] != 0xda) {
        size_t length = (size_t)bytes[at + 2] << 8 | bytes[at + 3];
        bool is_comment = bytes[at + 1] == 0xfe;
        if (length < 2 || length > size_bytes - at - 2) return BD_ERR_OK;
        const char *line = (const char *)bytes + at + 4, *end = line + length - 2;
        at += 2 + length;
        if (!is_comment) continue;
        while (line < end) {
            const char *stop = memchr(line, '\n', (size_t)(end - line));
            if (!stop) stop = end;
            const char *equals = memchr(line, '=', (size_t)(stop - line));
            if (equals && !add_attribute(exr, line, (size_t)(equals - line), equals + 1,
                                         (size_t)(stop - equals - 1)))
                return no_memory(detail);
            line = stop + 1;
        }
        return BD_ERR_OK;
    }
    return BD_ERR_OK;
}

static enum bd_err read_jpeg(const void *bytes, size_t size_bytes,
                             const struct bd_exr_limits *limits, struct bd_exr **out,
                             struct bd_err_detail *detail)
{
    const struct bd_decode_limits decode = {limits->side_px_max,
                                            limits->size_bytes_max / (3 * sizeof(float))};
    uint32_t width_px, height_px;
    uint8_t *rgba = NULL;
    enum bd_err err = bd_picture_decode(bytes, size_bytes, &decode, "picture", &width_px,
                                        &height_px, &rgba, detail);
    if (err) return err;
    err = create(width_px, height_px, limits, out, detail);
    size_t pixels = (size_t)width_px * height_px;
    for (size_t i = 0; !err && i < pixels; i++)
        for (uint32_t c = 0; c < 3; c++)
            (*out)->channels[c].samples[i] = linear_of(rgba[4 * i + c] / 255.0);
    free(rgba);
    return err ? err : read_comment(bytes, size_bytes, *out, detail);
}

enum bd_err bd_shown_read(const void *bytes, size_t size_bytes, const struct bd_exr_limits *limits,
                          struct bd_exr **out, struct bd_err_detail *detail)
{
    *out = NULL;
    bool is_png = begins_with(bytes, size_bytes, png_magic, sizeof png_magic);
    enum bd_err err = is_png ? read_png(bytes, size_bytes, limits, out, detail)
                             : read_jpeg(bytes, size_bytes, limits, out, detail);
    if (err) bd_exr_destroy(out);
    return err;
}

// --- showing --------------------------------------------------------------------------------

bool bd_showing_of(const struct bd_exr *picture, struct bd_showing *out)
{
    *out = (struct bd_showing){.tonemap = BD_TONEMAP_LINEAR};
    const char *stops = bd_exr_attribute(picture, "exposure_stops");
    const char *tonemap = bd_exr_attribute(picture, "tonemap");
    char *end = NULL;
    double value = stops ? strtod(stops, &end) : 0;
    if (!stops || !tonemap || end == stops || *end ||
        !(fabs(value) <= (double)BD_EXPOSURE_STOPS_MAX))
        return false;
    if (!bd_tonemap_from_name(tonemap, &out->tonemap)) return false;
    out->stops = (float)value;
    return true;
}

// Drops every other channel. False if one of the three is not there.
static bool keep_colours(struct bd_exr *exr, float *planes[3])
{
    static const char colours[] = "RGB";
    uint32_t kept = 0;
    for (int c = 0; c < 3; c++) planes[c] = NULL;
    for (uint32_t i = 0; i < exr->channel_count; i++) {
        const char *name = exr->channels[i].name;
        const char *colour = name[0] && !name[1] ? strchr(colours, name[0]) : NULL;
        if (colour) {
            planes[colour - colours] = exr->channels[i].samples;
            exr->channels[kept++] = exr->channels[i];
        } else {
            free(exr->channels[i].samples);
        }
    }
    exr->channel_count = kept;
    return planes[0] && planes[1] && planes[2];
}

enum bd_err bd_show_exr(struct bd_exr *exr, const struct bd_showing *showing,
                        struct bd_err_detail *detail)
{
    float *planes[3];
    if (!keep_colours(exr, planes))
        return bd_err_set(detail, BD_ERR_NOT_FOUND, "layer",
                          "no R, G and B, which a PNG or JPEG shows");
    const float scale = exp2f(showing->stops);
    for (size_t p = 0; p < (size_t)exr->width_px * exr->height_px; p++) {
        const float rgb[3] = {planes[0][p], planes[1][p], planes[2][p]};
        float shown[3];
        bd_tonemap_apply(showing->tonemap, scale, rgb, shown);
        for (int c = 0; c < 3; c++) planes[c][p] = isfinite(rgb[c]) ? shown[c] : rgb[c];
    }
    return BD_ERR_OK;
}
