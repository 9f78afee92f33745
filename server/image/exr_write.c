// EXR files written by OpenEXR's core: the same bytes for the same planes.

#include <string.h>

#include "base/assert.h"
#include "image/exr.h"
#include "image/exr_core.h"

// 4 is OpenEXR's own default since 3.1.3: within 2 % of level 9's size at a third of its time.
// Pinned here, since bytes must not change with the library's taste.
#define ZIP_LEVEL 4

struct write_stream {
    struct bd_exr_complaint complaint; // first: see image/exr_core.h
    struct bd_bytes *out;
};

static int64_t write_bytes(exr_const_context_t context, void *user, const void *buffer,
                           uint64_t size, uint64_t offset, exr_stream_error_func_ptr_t error)
{
    struct write_stream *stream = user;
    if (bd_bytes_put(stream->out, offset, buffer, size)) {
        error(context, EXR_ERR_OUT_OF_MEMORY, "no memory for the file");
        return -1;
    }
    return (int64_t)size;
}

static exr_result_t write_header(exr_context_t context, const struct bd_exr_picture *picture)
{
    int part = 0;
    exr_result_t rv = exr_add_part(context, NULL, EXR_STORAGE_SCANLINE, &part);
    if (rv) return rv;
    rv = exr_initialize_required_attr_simple(context, part, (int32_t)picture->width_px,
                                             (int32_t)picture->height_px,
                                             picture->raw ? EXR_COMPRESSION_NONE
                                                          : EXR_COMPRESSION_ZIP);
    if (!rv && !picture->raw) rv = exr_set_zip_compression_level(context, part, ZIP_LEVEL);
    if (rv) return rv;
    for (size_t i = 0; i < picture->plane_count; i++) {
        rv = exr_add_channel(context, part, picture->planes[i].name,
                             picture->planes[i].half ? EXR_PIXEL_HALF : EXR_PIXEL_FLOAT,
                             EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1);
        if (rv) return rv;
    }
    for (size_t i = 0; i < picture->manifest.count; i++) {
        const struct bd_manifest_entry *entry = &picture->manifest.entries[i];
        rv = exr_attr_set_string(context, part, entry->key, entry->value);
        if (rv) return rv;
    }
    return exr_write_header(context);
}

static const struct bd_exr_plane *plane_named(const struct bd_exr_picture *picture,
                                              const char *name)
{
    for (size_t i = 0; i < picture->plane_count; i++)
        if (strcmp(picture->planes[i].name, name) == 0) return &picture->planes[i];
    BD_ASSERT(!"the core names a channel that it was not given");
    return NULL;
}

// The core keeps its channels sorted by name, whatever order they came in.
static void aim_at_rows(exr_encode_pipeline_t *pipe, const struct bd_exr_picture *picture, int y_px)
{
    for (int i = 0; i < pipe->channel_count; i++) {
        exr_coding_channel_info_t *channel = &pipe->channels[i];
        const struct bd_exr_plane *plane = plane_named(picture, channel->channel_name);
        size_t pixel = (size_t)y_px * picture->width_px;
        channel->encode_from_ptr = (const uint8_t *)(plane->samples + pixel * plane->stride);
        channel->user_bytes_per_element = sizeof(float);
        channel->user_data_type = EXR_PIXEL_FLOAT;
        channel->user_pixel_stride = (int32_t)(plane->stride * sizeof(float));
        channel->user_line_stride = (int32_t)(plane->stride * sizeof(float) * picture->width_px);
    }
}

typedef exr_result_t (*compress_fn)(exr_encode_pipeline_t *);

// Readers take a chunk that is as long as its pixels for the pixels themselves. The core stores
// those only where compression made it longer; where it comes out exactly as long, which happens
// to chunks of a few pixels, we do.
static exr_result_t compress(exr_encode_pipeline_t *pipe)
{
    const compress_fn *by_core = pipe->encoding_user_data;
    exr_result_t rv = (*by_core)(pipe);
    if (!rv && pipe->compressed_bytes == pipe->packed_bytes)
        memcpy(pipe->compressed_buffer, pipe->packed_buffer, pipe->packed_bytes);
    return rv;
}

static exr_result_t choose_routines(exr_context_t context, exr_encode_pipeline_t *pipe,
                                    compress_fn *by_core)
{
    exr_result_t rv = exr_encoding_choose_default_routines(context, 0, pipe);
    if (rv || !pipe->compress_fn) return rv;
    *by_core = pipe->compress_fn;
    pipe->encoding_user_data = by_core;
    pipe->compress_fn = compress;
    return rv;
}

static exr_result_t write_rows(exr_context_t context, const struct bd_exr_picture *picture)
{
    int32_t rows_per_chunk = 0;
    exr_result_t rv = exr_get_scanlines_per_chunk(context, 0, &rows_per_chunk);
    if (rv) return rv;
    exr_encode_pipeline_t pipe = EXR_ENCODE_PIPELINE_INITIALIZER;
    compress_fn by_core = NULL;
    for (int y_px = 0; !rv && y_px < (int)picture->height_px; y_px += rows_per_chunk) {
        exr_chunk_info_t chunk = {0};
        rv = exr_write_scanline_chunk_info(context, 0, y_px, &chunk);
        if (rv) break;
        rv = y_px == 0 ? exr_encoding_initialize(context, 0, &chunk, &pipe)
                       : exr_encoding_update(context, 0, &chunk, &pipe);
        if (rv) break;
        aim_at_rows(&pipe, picture, y_px);
        if (y_px == 0) rv = choose_routines(context, &pipe, &by_core);
        if (!rv) rv = exr_encoding_run(context, 0, &pipe);
    }
    exr_encoding_destroy(context, &pipe);
    return rv;
}

static void assert_well_formed(const struct bd_exr_picture *picture)
{
    BD_ASSERT_CMP(picture->plane_count, >, 0u);
    BD_ASSERT_CMP(picture->plane_count, <=, (size_t)BD_EXR_CHANNEL_MAX);
    // Line strides are 32-bit in the core: 2^29 bytes leave room for four channels of 32768.
    BD_ASSERT(picture->width_px > 0 && picture->width_px <= 1u << 24);
    BD_ASSERT(picture->height_px > 0 && picture->height_px <= 1u << 24);
    for (size_t i = 0; i < picture->plane_count; i++)
        BD_ASSERT_CMP(picture->planes[i].stride * picture->width_px, <=, (size_t)1 << 28);
}

enum bd_err bd_exr_write(const struct bd_exr_picture *picture, struct bd_bytes *out,
                         struct bd_err_detail *detail)
{
    assert_well_formed(picture);
    struct write_stream stream = {.out = out};
    exr_context_initializer_t init = EXR_DEFAULT_CONTEXT_INITIALIZER;
    init.user_data = &stream;
    init.write_fn = write_bytes;
    init.error_handler_fn = bd_exr_keep_complaint;
    exr_context_t context = NULL;
    exr_result_t rv = exr_start_write(&context, "memory", EXR_WRITE_FILE_DIRECTLY, &init);
    if (!rv) rv = write_header(context, picture);
    if (!rv) rv = write_rows(context, picture);
    // The offset table is written on the way out, so closing can fail like any write.
    exr_result_t closed = context ? exr_finish(&context) : EXR_ERR_SUCCESS;
    if (!rv) rv = closed;
    if (!rv) return BD_ERR_OK;
    bd_bytes_finish(out);
    return bd_err_set(detail, rv == EXR_ERR_OUT_OF_MEMORY ? BD_ERR_NO_MEMORY : BD_ERR_INTERNAL,
                      "exr", "cannot encode EXR: %s", bd_exr_why(&stream.complaint, rv));
}
