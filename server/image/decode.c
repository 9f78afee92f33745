#include "image/decode.h"

#include <limits.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include <spng.h>
#include <turbojpeg.h>

struct decoding {
    const uint8_t *bytes;
    size_t size;
    const struct bd_decode_limits *limits;
    const char *field;
    struct bd_err_detail *detail;
    uint32_t width_px, height_px;
    uint8_t *rgba;
};

static enum bd_err check_sides(const struct decoding *d)
{
    if (d->width_px == 0 || d->height_px == 0)
        return bd_err_set(d->detail, BD_ERR_BAD_INPUT, d->field, "picture of %u x %u pixels",
                          d->width_px, d->height_px);
    if (d->width_px > d->limits->side_px || d->height_px > d->limits->side_px)
        return bd_err_set(d->detail, BD_ERR_LIMIT, d->field,
                          "picture of %u x %u pixels, limit %u a side", d->width_px, d->height_px,
                          d->limits->side_px);
    return BD_ERR_OK;
}

static enum bd_err allocate(struct decoding *d)
{
    uint64_t texels = (uint64_t)d->width_px * d->height_px;
    enum bd_err err = check_sides(d);
    if (err) return err;
    if (texels > d->limits->texels)
        return bd_err_set(d->detail, BD_ERR_LIMIT, d->field,
                          "pictures together have more than %llu texels",
                          (unsigned long long)d->limits->texels);
    d->rgba = malloc(texels * 4);
    if (!d->rgba)
        return bd_err_set(d->detail, BD_ERR_NO_MEMORY, d->field, "no memory for %u x %u pixels",
                          d->width_px, d->height_px);
    return BD_ERR_OK;
}

static enum bd_err png_err(struct decoding *d, int code)
{
    return bd_err_set(d->detail, code == SPNG_EMEM ? BD_ERR_NO_MEMORY : BD_ERR_BAD_INPUT, d->field,
                      "broken PNG: %s", spng_strerror(code));
}

// Ancillary chunks are of no use here; libspng would keep them in memory without these limits.
static int png_header(spng_ctx *png, struct decoding *d, struct spng_ihdr *header)
{
    const size_t chunk_bytes_max = 1 << 20;
    int code = spng_set_chunk_limits(png, chunk_bytes_max, chunk_bytes_max);
    if (!code) code = spng_set_crc_action(png, SPNG_CRC_ERROR, SPNG_CRC_DISCARD);
    if (!code) code = spng_set_png_buffer(png, d->bytes, d->size);
    if (!code) code = spng_get_ihdr(png, header);
    return code;
}

static enum bd_err begin_png(struct decoding *d, spng_ctx *png)
{
    struct spng_ihdr header;
    int code = png_header(png, d, &header);
    if (code) return png_err(d, code);
    d->width_px = header.width;
    d->height_px = header.height;
    return BD_ERR_OK;
}

static enum bd_err measure_png(struct decoding *d)
{
    spng_ctx *png = spng_ctx_new(0);
    if (!png) return png_err(d, SPNG_EMEM);
    enum bd_err err = begin_png(d, png);
    spng_ctx_free(png);
    return err;
}

static enum bd_err decode_png(struct decoding *d)
{
    spng_ctx *png = spng_ctx_new(0);
    if (!png) return png_err(d, SPNG_EMEM);
    enum bd_err err = begin_png(d, png);
    if (err == BD_ERR_OK) err = allocate(d);
    if (err == BD_ERR_OK) {
        int code = spng_decode_image(png, d->rgba, (size_t)d->width_px * d->height_px * 4,
                                     SPNG_FMT_RGBA8, SPNG_DECODE_TRNS);
        if (code) err = png_err(d, code);
    }
    spng_ctx_free(png);
    return err;
}

static enum bd_err jpeg_err(struct decoding *d, tjhandle jpeg)
{
    return bd_err_set(d->detail, BD_ERR_BAD_INPUT, d->field, "broken JPEG: %s",
                      tjGetErrorStr2(jpeg));
}

// Rubbish between markers and a newer JFIF number leave the whole picture; whatever else libjpeg
// warns of, such as a file that ends early, makes part of it up. Its words are the only way to
// tell: libjpeg-turbo 2.1 calls even "no image" a warning.
static bool is_broken(tjhandle jpeg)
{
    const char *words = tjGetErrorStr2(jpeg);
    return !strstr(words, "extraneous bytes") && !strstr(words, "JFIF revision");
}

// Adobe's CMYK is stored inverted, and libjpeg-turbo hands it over as it is.
static void rgba_from_cmyk(uint8_t *pixels, size_t count)
{
    for (size_t i = 0; i < count; i++, pixels += 4) {
        unsigned k = pixels[3];
        for (int c = 0; c < 3; c++) pixels[c] = (uint8_t)(pixels[c] * k / 255);
        pixels[3] = 255;
    }
}

static enum bd_err begin_jpeg(struct decoding *d, tjhandle jpeg, bool *cmyk)
{
    // A file that ends before its frame header is only warned of, and leaves these as they are.
    int width = 0, height = 0, subsampling = 0, colorspace = 0;
    if (tjDecompressHeader3(jpeg, d->bytes, d->size, &width, &height, &subsampling, &colorspace))
        return jpeg_err(d, jpeg);
    d->width_px = (uint32_t)width;
    d->height_px = (uint32_t)height;
    *cmyk = colorspace == TJCS_CMYK || colorspace == TJCS_YCCK;
    return BD_ERR_OK;
}

static enum bd_err no_memory_for_jpeg(const struct decoding *d)
{
    return bd_err_set(d->detail, BD_ERR_NO_MEMORY, d->field, "no memory for a JPEG");
}

static enum bd_err measure_jpeg(struct decoding *d)
{
    bool cmyk = false;
    tjhandle jpeg = tjInitDecompress();
    if (!jpeg) return no_memory_for_jpeg(d);
    enum bd_err err = begin_jpeg(d, jpeg, &cmyk);
    tjDestroy(jpeg);
    return err;
}

static enum bd_err decode_jpeg(struct decoding *d)
{
    bool cmyk = false;
    tjhandle jpeg = tjInitDecompress();
    if (!jpeg) return no_memory_for_jpeg(d);
    enum bd_err err = begin_jpeg(d, jpeg, &cmyk);
    if (err == BD_ERR_OK) err = allocate(d);
    if (err != BD_ERR_OK) goto jpeg;
    // LIMITSCANS stops progressive files that were made to take minutes.
    if (tjDecompress2(jpeg, d->bytes, d->size, d->rgba, (int)d->width_px, 0, (int)d->height_px,
                      cmyk ? TJPF_CMYK : TJPF_RGBA, TJFLAG_ACCURATEDCT | TJFLAG_LIMITSCANS) &&
        is_broken(jpeg))
        err = jpeg_err(d, jpeg);
    else if (cmyk)
        rgba_from_cmyk(d->rgba, (size_t)d->width_px * d->height_px);
jpeg:
    tjDestroy(jpeg);
    return err;
}

enum format { FORMAT_NONE, FORMAT_PNG, FORMAT_JPEG };

static enum format format_of(const void *bytes, size_t size)
{
    static const uint8_t png_magic[] = {0x89, 'P', 'N', 'G'};
    static const uint8_t jpeg_magic[] = {0xff, 0xd8, 0xff};
    if (size >= sizeof png_magic && memcmp(bytes, png_magic, sizeof png_magic) == 0)
        return FORMAT_PNG;
    if (size >= sizeof jpeg_magic && memcmp(bytes, jpeg_magic, sizeof jpeg_magic) == 0)
        return FORMAT_JPEG;
    return FORMAT_NONE;
}

static enum bd_err unknown_format(const struct decoding *d)
{
    return bd_err_set(d->detail, BD_ERR_UNSUPPORTED, d->field, "neither a PNG nor a JPEG");
}

static enum bd_err measure(struct decoding *d, enum format format)
{
    switch (format) {
    case FORMAT_PNG:
        return measure_png(d);
    case FORMAT_JPEG:
        return measure_jpeg(d);
    case FORMAT_NONE:
        break;
    }
    return unknown_format(d);
}

static enum bd_err decode(struct decoding *d)
{
    switch (format_of(d->bytes, d->size)) {
    case FORMAT_PNG:
        return decode_png(d);
    case FORMAT_JPEG:
        return decode_jpeg(d);
    case FORMAT_NONE:
        break;
    }
    return unknown_format(d);
}

// A progressive JPEG keeps 16-bit coefficients of three planes beside its texels until its last
// scan; libspng keeps two rows.
static uint64_t decode_bytes(const struct decoding *d, enum format format)
{
    const uint64_t texel_bytes = format == FORMAT_JPEG ? 4 + 3 * sizeof(int16_t) : 4;
    return texel_bytes * d->width_px * d->height_px;
}

enum bd_err bd_picture_measure(const void *bytes, size_t size, uint32_t side_max_px,
                               const char *field, struct bd_picture_size *out,
                               struct bd_err_detail *detail)
{
    const struct bd_decode_limits limits = {.side_px = side_max_px};
    const enum format format = format_of(bytes, size);
    struct decoding d = {bytes, size, &limits, field, detail, 0, 0, NULL};
    enum bd_err err = measure(&d, format);
    if (!err) err = check_sides(&d);
    if (err) return err;
    *out = (struct bd_picture_size){d.width_px, d.height_px, decode_bytes(&d, format)};
    return BD_ERR_OK;
}

enum bd_err bd_picture_decode(const void *bytes, size_t size, const struct bd_decode_limits *limits,
                              const char *field, uint32_t *width_px, uint32_t *height_px,
                              uint8_t **rgba, struct bd_err_detail *detail)
{
    struct decoding d = {bytes, size, limits, field, detail, 0, 0, NULL};
    enum bd_err err = decode(&d);
    if (err != BD_ERR_OK) {
        free(d.rgba);
        return err;
    }
    *width_px = d.width_px;
    *height_px = d.height_px;
    *rgba = d.rgba;
    return BD_ERR_OK;
}
