#include "image/png.h"

#include <spng.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"

static int append(spng_ctx *ctx, void *user, void *source, size_t size)
{
    (void)ctx;
    struct bd_bytes *out = user;
    return bd_bytes_put(out, out->size_bytes, source, size) ? SPNG_IO_ERROR : 0;
}

static bool is_ascii(const char *text)
{
    for (; *text; text++)
        if ((unsigned char)*text >= 0x80) return false;
    return true;
}

static int set_text(spng_ctx *ctx, const struct bd_manifest *manifest)
{
    if (!manifest->count) return 0;
    struct spng_text *texts = calloc(manifest->count, sizeof *texts);
    if (!texts) return SPNG_EMEM;
    static char none[1] = "";
    for (size_t i = 0; i < manifest->count; i++) {
        const struct bd_manifest_entry *entry = &manifest->entries[i];
        BD_ASSERT_CMP(strlen(entry->key), <=, (size_t)BD_MANIFEST_KEY_MAX);
        memcpy(texts[i].keyword, entry->key, strlen(entry->key) + 1);
        texts[i].type = is_ascii(entry->value) ? SPNG_TEXT : SPNG_ITXT;
        texts[i].text = (char *)entry->value; // libspng copies what it is given
        texts[i].length = strlen(entry->value);
        texts[i].language_tag = none;
        texts[i].translated_keyword = none;
    }
    int rv = spng_set_text(ctx, texts, (uint32_t)manifest->count);
    // libspng keeps the array until the chunks are written.
    if (!rv) rv = spng_encode_chunks(ctx);
    free(texts);
    return rv;
}

static int encode(spng_ctx *ctx, const struct bd_pixels8 *pixels,
                  const struct bd_manifest *manifest, struct bd_bytes *out)
{
    struct spng_ihdr header = {
        .width = pixels->width_px,
        .height = pixels->height_px,
        .bit_depth = 8,
        .color_type = pixels->channel_count == 4 ? SPNG_COLOR_TYPE_TRUECOLOR_ALPHA
                                                 : SPNG_COLOR_TYPE_TRUECOLOR,
    };
    int rv = spng_set_png_stream(ctx, append, out);
    if (!rv) rv = spng_set_ihdr(ctx, &header);
    if (!rv) rv = spng_set_srgb(ctx, 0);
    // Level 3 costs a third of zlib's default 6 for 3 % more bytes. Pinned with the filters, since
    // bytes must not change with a library's taste.
    if (!rv) rv = spng_set_option(ctx, SPNG_IMG_COMPRESSION_LEVEL, 3);
    if (!rv) rv = spng_set_option(ctx, SPNG_FILTER_CHOICE, SPNG_FILTER_CHOICE_ALL);
    if (!rv) rv = set_text(ctx, manifest);
    size_t size = (size_t)pixels->width_px * pixels->height_px * pixels->channel_count;
    if (!rv) rv = spng_encode_image(ctx, pixels->samples, size, SPNG_FMT_PNG, SPNG_ENCODE_FINALIZE);
    return rv;
}

enum bd_err bd_png_encode(const struct bd_pixels8 *pixels, const struct bd_manifest *manifest,
                          struct bd_bytes *out, struct bd_err_detail *detail)
{
    BD_ASSERT(pixels->channel_count == 3 || pixels->channel_count == 4);
    spng_ctx *ctx = spng_ctx_new(SPNG_CTX_ENCODER);
    if (!ctx) return bd_err_set(detail, BD_ERR_NO_MEMORY, "png", "no memory for a PNG encoder");
    int rv = encode(ctx, pixels, manifest, out);
    spng_ctx_free(ctx);
    if (!rv) return BD_ERR_OK;
    bd_bytes_finish(out);
    return bd_err_set(detail,
                      rv == SPNG_EMEM || rv == SPNG_IO_ERROR ? BD_ERR_NO_MEMORY : BD_ERR_INTERNAL,
                      "png", "cannot encode PNG: %s", spng_strerror(rv));
}
