#include "image/jpeg.h"

#include <string.h>
#include <turbojpeg.h>

#include "base/assert.h"

#define COMMENT_BYTES_MAX 65533u // a segment's length is 16 bits and counts itself

static enum bd_err append(struct bd_bytes *bytes, const char *text)
{
    return bd_bytes_put(bytes, bytes->size_bytes, text, strlen(text));
}

static enum bd_err build_comment(const struct bd_manifest *manifest, struct bd_bytes *comment)
{
    enum bd_err err = BD_ERR_OK;
    for (size_t i = 0; !err && i < manifest->count; i++) {
        const struct bd_manifest_entry *entry = &manifest->entries[i];
        size_t size = strlen(entry->key) + strlen(entry->value) + 2;
        if (comment->size_bytes + size > COMMENT_BYTES_MAX) break;
        err = append(comment, entry->key);
        if (!err) err = append(comment, "=");
        if (!err) err = append(comment, entry->value);
        if (!err) err = append(comment, "\n");
    }
    return err;
}

// TurboJPEG's own API writes no comments, so it is spliced in: after SOI (2 bytes) and the APP0
// segment, which JFIF wants to come first.
static enum bd_err splice_comment(struct bd_bytes *jpeg, const struct bd_bytes *comment)
{
    if (!comment->size_bytes) return BD_ERR_OK;
    BD_ASSERT(jpeg->size_bytes > 6 && jpeg->data[2] == 0xff && jpeg->data[3] == 0xe0);
    size_t at = 4 + ((size_t)jpeg->data[4] << 8 | jpeg->data[5]);
    size_t length = comment->size_bytes + 2;
    const uint8_t head[4] = {0xff, 0xfe, (uint8_t)(length >> 8), (uint8_t)length};
    enum bd_err err = bd_bytes_open_gap(jpeg, at, sizeof head + comment->size_bytes);
    if (!err) err = bd_bytes_put(jpeg, at, head, sizeof head);
    if (!err) err = bd_bytes_put(jpeg, at + sizeof head, comment->data, comment->size_bytes);
    return err;
}

static enum bd_err compress(const struct bd_pixels8 *pixels, int quality, struct bd_bytes *out,
                            struct bd_err_detail *detail)
{
    tjhandle turbo = tjInitCompress();
    if (!turbo) return bd_err_set(detail, BD_ERR_NO_MEMORY, "jpeg", "no memory for a JPEG encoder");
    unsigned char *jpeg = NULL;
    unsigned long size_bytes = 0;
    enum bd_err err = BD_ERR_OK;
    if (tjCompress2(turbo, pixels->samples, (int)pixels->width_px, 0, (int)pixels->height_px,
                    TJPF_RGB, &jpeg, &size_bytes, TJSAMP_444, quality, TJFLAG_ACCURATEDCT))
        err = bd_err_set(detail, BD_ERR_LIMIT, "jpeg", "cannot encode JPEG: %s",
                         tjGetErrorStr2(turbo));
    else if (bd_bytes_put(out, 0, jpeg, size_bytes))
        err = bd_err_set(detail, BD_ERR_NO_MEMORY, "jpeg", "no memory for the JPEG");
    tjFree(jpeg);
    tjDestroy(turbo);
    return err;
}

enum bd_err bd_jpeg_encode(const struct bd_pixels8 *pixels, int quality,
                           const struct bd_manifest *manifest, struct bd_bytes *out,
                           struct bd_err_detail *detail)
{
    BD_ASSERT_CMP(pixels->channel_count, ==, 3u);
    BD_ASSERT(quality >= 1 && quality <= 100);
    enum bd_err err = compress(pixels, quality, out, detail);
    if (err) return err;
    struct bd_bytes comment = {0};
    err = build_comment(manifest, &comment);
    if (!err) err = splice_comment(out, &comment);
    bd_bytes_finish(&comment);
    if (!err) return BD_ERR_OK;
    bd_bytes_finish(out);
    return bd_err_set(detail, err, "jpeg", "no memory for the JPEG's comment");
}
