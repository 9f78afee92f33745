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
    struct bd_fault *fault;
    uint32_t width_px, height_px;
    uint8_t *rgba;
};

static enum bd_err allocate(struct decoding *d)
{
    uint64_t texels = (uint64_t)d->width_px * d->height_px;
    if (texels == 0)
        return bd_fault_set(d->fault, BD_ERR_BAD_INPUT, d->field, "picture of %u x %u pixels",
                            d->width_px, d->height_px);
    if (d->width_px > d->limits->side_px || d->height_px > d->limits->side_px)
        return bd_fault_set(d->fault, BD_ERR_LIMIT, d->field,
                            "picture of %u x %u pixels, limit %u a side", d->width_px, d->height_px,
                            d->limits->side_px);
    if (texels > d->limits->texels)
        return bd_fault_set(d->fault, BD_ERR_LIMIT, d->field,
                            "pictures together have more than %llu texels",
                            (unsigned long long)d->limits->texels);
    d->rgba = malloc(texels * 4);
    if (!d->rgba)
        return bd_fault_set(d->fault, BD_ERR_NO_MEMORY, d->field, "no memory for %u x %u pixels",
                            d->width_px, d->height_px);
    return BD_ERR_OK;
}

static enum bd_err png_fault(struct decoding *d, int code)
{
    return bd_fault_set(d->fault, code == SPNG_EMEM ? BD_ERR_NO_MEMORY : BD_ERR_BAD_INPUT, d->field,
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

static enum bd_err decode_png(struct decoding *d)
{
    struct spng_ihdr header;
    spng_ctx *png = spng_ctx_new(0);
    if (!png) return png_fault(d, SPNG_EMEM);
    int code = png_header(png, d, &header);
    enum bd_err err = code ? png_fault(d, code) : BD_ERR_OK;
    if (err == BD_ERR_OK) {
        d->width_px = header.width;
        d->height_px = header.height;
        err = allocate(d);
    }
    if (err == BD_ERR_OK) {
        code = spng_decode_image(png, d->rgba, (size_t)d->width_px * d->height_px * 4,
                                 SPNG_FMT_RGBA8, SPNG_DECODE_TRNS);
        if (code) err = png_fault(d, code);
    }
    spng_ctx_free(png);
    return err;
}

static enum bd_err jpeg_fault(struct decoding *d, tjhandle jpeg)
{
    return bd_fault_set(d->fault, BD_ERR_BAD_INPUT, d->field, "broken JPEG: %s",
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

static enum bd_err decode_jpeg(struct decoding *d)
{
    tjhandle jpeg = tjInitDecompress();
    if (!jpeg) return bd_fault_set(d->fault, BD_ERR_NO_MEMORY, d->field, "no memory for a JPEG");
    // A file that ends before its frame header is only warned of, and leaves these as they are.
    int width = 0, height = 0, subsampling = 0, colorspace = 0;
    enum bd_err err;
    if (tjDecompressHeader3(jpeg, d->bytes, d->size, &width, &height, &subsampling, &colorspace)) {
        err = jpeg_fault(d, jpeg);
        goto jpeg;
    }
    d->width_px = (uint32_t)width;
    d->height_px = (uint32_t)height;
    err = allocate(d);
    if (err != BD_ERR_OK) goto jpeg;
    bool cmyk = colorspace == TJCS_CMYK || colorspace == TJCS_YCCK;
    // LIMITSCANS stops progressive files that were made to take minutes.
    if (tjDecompress2(jpeg, d->bytes, d->size, d->rgba, width, 0, height,
                      cmyk ? TJPF_CMYK : TJPF_RGBA, TJFLAG_ACCURATEDCT | TJFLAG_LIMITSCANS) &&
        is_broken(jpeg))
        err = jpeg_fault(d, jpeg);
    else if (cmyk)
        rgba_from_cmyk(d->rgba, (size_t)d->width_px * d->height_px);
jpeg:
    tjDestroy(jpeg);
    return err;
}

enum bd_err bd_picture_decode(const void *bytes, size_t size, const struct bd_decode_limits *limits,
                              const char *field, uint32_t *width_px, uint32_t *height_px,
                              uint8_t **rgba, struct bd_fault *fault)
{
    static const uint8_t png_magic[] = {0x89, 'P', 'N', 'G'};
    static const uint8_t jpeg_magic[] = {0xff, 0xd8, 0xff};
    struct decoding d = {bytes, size, limits, field, fault, 0, 0, NULL};
    enum bd_err err;
    if (size >= sizeof png_magic && memcmp(bytes, png_magic, sizeof png_magic) == 0)
        err = decode_png(&d);
    else if (size >= sizeof jpeg_magic && memcmp(bytes, jpeg_magic, sizeof jpeg_magic) == 0)
        err = decode_jpeg(&d);
    else
        err = bd_fault_set(fault, BD_ERR_UNSUPPORTED, field, "neither a PNG nor a JPEG");
    if (err != BD_ERR_OK) {
        free(d.rgba);
        return err;
    }
    *width_px = d.width_px;
    *height_px = d.height_px;
    *rgba = d.rgba;
    return BD_ERR_OK;
}
