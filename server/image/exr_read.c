// EXR files and maps read by OpenEXR's core, within limits that hold before anything is allocated.

#include <stdlib.h>
#include <string.h>

#include "image/exr.h"
#include "image/exr_core.h"
#include "image/exr_lossy.h"

const struct bd_exr_limits bd_exr_limits_default = {
    .side_px_max = 32768,
    .size_bytes_max = (uint64_t)1 << 30,
};

// How much smaller a picture of halves can get, by compression: deflate's best is 1032, and RLE is
// worse; B44A keeps 3 bytes of 16 samples; DWA deflates runs of which two bytes hold 128, and its
// other ways are worse; PIZ has no such bound (0).
static const uint32_t ratio_max[EXR_COMPRESSION_LAST_TYPE] = {
    [EXR_COMPRESSION_NONE] = 1,     [EXR_COMPRESSION_RLE] = 1032, [EXR_COMPRESSION_ZIPS] = 1032,
    [EXR_COMPRESSION_ZIP] = 1032,   [EXR_COMPRESSION_PIZ] = 0,    [EXR_COMPRESSION_PXR24] = 1032,
    [EXR_COMPRESSION_B44] = 11,     [EXR_COMPRESSION_B44A] = 11,  [EXR_COMPRESSION_DWAA] = 66048,
    [EXR_COMPRESSION_DWAB] = 66048,
};

struct read_stream {
    struct bd_exr_complaint complaint; // first: see image/exr_core.h
    const uint8_t *bytes;
    uint64_t size_bytes;
};

static int64_t stream_size(exr_const_context_t context, void *user)
{
    (void)context;
    return (int64_t)((struct read_stream *)user)->size_bytes;
}

// As pread does, gives what there is: the core asks for whole blocks of 4096 bytes while it parses
// the header and insists on the full count where it matters.
static int64_t read_bytes(exr_const_context_t context, void *user, void *buffer, uint64_t size,
                          uint64_t offset, exr_stream_error_func_ptr_t error)
{
    (void)context, (void)error;
    const struct read_stream *stream = user;
    if (offset >= stream->size_bytes) return 0;
    uint64_t left = stream->size_bytes - offset;
    if (size > left) size = left;
    memcpy(buffer, stream->bytes + offset, size);
    return (int64_t)size;
}

// The core leaves buffers half-filled when a damaged chunk unpacks to less than it should. Zeroes
// there keep a picture from showing what was on the heap.
static void *allocate_zeroed(size_t size)
{
    return calloc(1, size);
}

static enum bd_err err_of(exr_result_t rv, const struct read_stream *stream,
                          struct bd_err_detail *detail)
{
    enum bd_err err = BD_ERR_BAD_INPUT;
    if (rv == EXR_ERR_OUT_OF_MEMORY) err = BD_ERR_NO_MEMORY;
    if (rv == EXR_ERR_FEATURE_NOT_IMPLEMENTED) err = BD_ERR_UNSUPPORTED;
    return bd_err_set(detail, err, "exr", "cannot read EXR: %s",
                      bd_exr_why(&stream->complaint, rv));
}

struct layout {
    exr_storage_t storage;
    exr_compression_t compression;
    exr_attr_box2i_t window;
    const exr_attr_chlist_t *channels;
};

static exr_result_t get_layout(exr_context_t context, struct layout *layout)
{
    exr_result_t rv = exr_get_storage(context, 0, &layout->storage);
    if (!rv) rv = exr_get_compression(context, 0, &layout->compression);
    if (!rv) rv = exr_get_data_window(context, 0, &layout->window);
    if (!rv) rv = exr_get_channels(context, 0, &layout->channels);
    return rv;
}

static enum bd_err check_kind(const struct layout *layout, struct bd_err_detail *detail)
{
    if (layout->storage != EXR_STORAGE_SCANLINE && layout->storage != EXR_STORAGE_TILED)
        return bd_err_set(detail, BD_ERR_UNSUPPORTED, "exr", "deep EXR data is not read");
    if ((unsigned)layout->compression >= EXR_COMPRESSION_LAST_TYPE)
        return bd_err_set(detail, BD_ERR_UNSUPPORTED, "exr",
                          "EXR compression %d is unknown; those from 0 (NONE) to %d (DWAB) are "
                          "read",
                          (int)layout->compression, EXR_COMPRESSION_LAST_TYPE - 1);
    int32_t count = layout->channels->num_channels;
    if (count < 1 || count > BD_EXR_CHANNEL_MAX)
        return bd_err_set(detail, BD_ERR_LIMIT, "exr", "%d EXR channels; 1 to %d are read", count,
                          BD_EXR_CHANNEL_MAX);
    for (int32_t i = 0; i < count; i++) {
        const exr_attr_chlist_entry_t *channel = &layout->channels->entries[i];
        if (channel->x_sampling != 1 || channel->y_sampling != 1)
            return bd_err_set(detail, BD_ERR_UNSUPPORTED, "exr", "EXR channel %.40s is subsampled",
                              channel->name.str);
        if (channel->name.length >= BD_EXR_CHANNEL_NAME_MAX)
            return bd_err_set(detail, BD_ERR_LIMIT, "exr",
                              "EXR channel name of %d bytes; %d are allowed", channel->name.length,
                              BD_EXR_CHANNEL_NAME_MAX - 1);
    }
    return BD_ERR_OK;
}

// Sizes, before anything of that size is allocated.
static enum bd_err check_size(const struct layout *layout, uint64_t file_bytes,
                              const struct bd_exr_limits *limits, struct bd_err_detail *detail)
{
    int64_t width = (int64_t)layout->window.max.x - layout->window.min.x + 1;
    int64_t height = (int64_t)layout->window.max.y - layout->window.min.y + 1;
    if (width < 1 || height < 1)
        return bd_err_set(detail, BD_ERR_BAD_INPUT, "exr", "the EXR data window is empty");
    if (width > limits->side_px_max || height > limits->side_px_max)
        return bd_err_set(detail, BD_ERR_LIMIT, "exr", "EXR of %lldx%lld; at most %u a side",
                          (long long)width, (long long)height, limits->side_px_max);
    uint64_t samples =
        (uint64_t)width * (uint64_t)height * (uint64_t)layout->channels->num_channels;
    if (samples > limits->size_bytes_max / sizeof(float))
        return bd_err_set(detail, BD_ERR_LIMIT, "exr", "EXR of %llu MiB; at most %llu",
                          (unsigned long long)(samples * sizeof(float) >> 20),
                          (unsigned long long)(limits->size_bytes_max >> 20));
    // Two bytes is the smallest sample (half).
    const uint32_t ratio = ratio_max[layout->compression];
    if (ratio && samples * 2 / ratio > file_bytes)
        return bd_err_set(detail, BD_ERR_BAD_INPUT, "exr",
                          "EXR of %lldx%lld in %llu bytes is truncated or a bomb", (long long)width,
                          (long long)height, (unsigned long long)file_bytes);
    return BD_ERR_OK;
}

static enum bd_err allocate(const struct layout *layout, struct bd_exr **out)
{
    struct bd_exr *exr = calloc(1, sizeof *exr);
    if (!exr) return BD_ERR_NO_MEMORY;
    exr->width_px = (uint32_t)(layout->window.max.x - layout->window.min.x + 1);
    exr->height_px = (uint32_t)(layout->window.max.y - layout->window.min.y + 1);
    for (int32_t i = 0; i < layout->channels->num_channels; i++) {
        const exr_attr_string_t *name = &layout->channels->entries[i].name;
        memcpy(exr->channels[i].name, name->str, (size_t)name->length);
        exr->channels[i].samples = calloc((size_t)exr->width_px * exr->height_px, sizeof(float));
        exr->channel_count++;
        if (!exr->channels[i].samples) bd_exr_destroy(&exr);
        if (!exr) return BD_ERR_NO_MEMORY;
    }
    *out = exr;
    return BD_ERR_OK;
}

// Points every channel of the pipeline at pixel (x, y) of its plane. The pipeline's channels
// stand in the order of the file's list, which is also ours.
static void aim_at(exr_decode_pipeline_t *pipe, struct bd_exr *exr, size_t x_px, size_t y_px)
{
    for (int i = 0; i < pipe->channel_count; i++) {
        exr_coding_channel_info_t *channel = &pipe->channels[i];
        float *samples = exr->channels[i].samples + y_px * exr->width_px + x_px;
        channel->decode_to_ptr = (uint8_t *)samples;
        channel->user_bytes_per_element = sizeof(float);
        channel->user_data_type = EXR_PIXEL_FLOAT;
        channel->user_pixel_stride = sizeof(float);
        channel->user_line_stride = (int32_t)(sizeof(float) * exr->width_px);
    }
}

// One chunk whose top left pixel is (x, y) of the picture. The core's chunk sizes come from the
// header; they are checked against the planes again, because a mistake here would be a heap write.
static exr_result_t decode_chunk(exr_context_t context, const exr_chunk_info_t *chunk, size_t x_px,
                                 size_t y_px, exr_decode_pipeline_t *pipe, struct bd_exr *exr)
{
    if (chunk->width < 1 || chunk->height < 1 || x_px + (size_t)chunk->width > exr->width_px ||
        y_px + (size_t)chunk->height > exr->height_px)
        return EXR_ERR_BAD_CHUNK_LEADER;
    bool first = pipe->context == NULL;
    exr_result_t rv = first ? exr_decoding_initialize(context, 0, chunk, pipe)
                            : exr_decoding_update(context, 0, chunk, pipe);
    if (rv) return rv;
    if (pipe->channel_count != (int)exr->channel_count) return EXR_ERR_INVALID_ATTR;
    aim_at(pipe, exr, x_px, y_px);
    if (first) rv = exr_decoding_choose_default_routines(context, 0, pipe);
    return rv ? rv : exr_decoding_run(context, 0, pipe);
}

static exr_result_t decode_scanlines(exr_context_t context, int top, exr_decode_pipeline_t *pipe,
                                     struct bd_exr *exr)
{
    int32_t rows_per_chunk = 0;
    exr_result_t rv = exr_get_scanlines_per_chunk(context, 0, &rows_per_chunk);
    if (!rv && rows_per_chunk < 1) rv = EXR_ERR_INVALID_ATTR;
    for (uint32_t y = 0; !rv && y < exr->height_px; y += (uint32_t)rows_per_chunk) {
        exr_chunk_info_t chunk = {0};
        rv = exr_read_scanline_chunk_info(context, 0, top + (int)y, &chunk);
        if (!rv) rv = decode_chunk(context, &chunk, 0, y, pipe, exr);
    }
    return rv;
}

static exr_result_t decode_tiles(exr_context_t context, exr_decode_pipeline_t *pipe,
                                 struct bd_exr *exr)
{
    int32_t tile_width = 0, tile_height = 0;
    exr_result_t rv = exr_get_tile_sizes(context, 0, 0, 0, &tile_width, &tile_height);
    if (!rv && (tile_width < 1 || tile_height < 1)) rv = EXR_ERR_INVALID_ATTR;
    if (rv) return rv;
    uint32_t columns = (exr->width_px - 1) / (uint32_t)tile_width + 1;
    uint32_t rows = (exr->height_px - 1) / (uint32_t)tile_height + 1;
    for (uint64_t tile = 0; !rv && tile < (uint64_t)columns * rows; tile++) {
        int column = (int)(tile % columns), row = (int)(tile / columns);
        exr_chunk_info_t chunk = {0};
        rv = exr_read_tile_chunk_info(context, 0, column, row, 0, 0, &chunk);
        if (!rv)
            rv = decode_chunk(context, &chunk, (size_t)column * (size_t)tile_width,
                              (size_t)row * (size_t)tile_height, pipe, exr);
    }
    return rv;
}

static enum bd_err decode(exr_context_t context, const struct read_stream *stream,
                          const struct layout *layout, struct bd_exr *exr,
                          struct bd_err_detail *detail)
{
    exr_decode_pipeline_t pipe = EXR_DECODE_PIPELINE_INITIALIZER;
    exr_result_t rv = layout->storage == EXR_STORAGE_TILED
                          ? decode_tiles(context, &pipe, exr)
                          : decode_scanlines(context, layout->window.min.y, &pipe, exr);
    exr_decoding_destroy(context, &pipe);
    return rv ? err_of(rv, stream, detail) : BD_ERR_OK;
}

// Of which the core makes nothing, or nothing right. PXR24 it knows.
static bool is_lossy(exr_compression_t compression)
{
    return compression >= EXR_COMPRESSION_B44;
}

static enum bd_err decode_lossy(const struct read_stream *stream, const struct layout *layout,
                                struct bd_exr *exr, struct bd_err_detail *detail)
{
    char why[256];
    const exr_attr_v2i_t first = layout->window.min;
    enum bd_err err = bd_exr_lossy_read(stream->bytes, stream->size_bytes, first.x, first.y, exr,
                                        why, sizeof why);
    return err ? bd_err_set(detail, err, "exr", "cannot read EXR: %s", why) : err;
}

static enum bd_err copy_attributes(exr_context_t context, struct bd_exr *exr)
{
    int32_t count = 0;
    if (exr_get_attribute_count(context, 0, &count) || count < 1) return BD_ERR_OK;
    exr->attributes = calloc((size_t)count, sizeof *exr->attributes);
    if (!exr->attributes) return BD_ERR_NO_MEMORY;
    for (int32_t i = 0; i < count; i++) {
        const exr_attribute_t *attribute = NULL;
        exr_result_t rv =
            exr_get_attribute_by_index(context, 0, EXR_ATTR_LIST_FILE_ORDER, i, &attribute);
        if (rv || attribute->type != EXR_ATTR_STRING) continue;
        struct bd_exr_attribute *copy = &exr->attributes[exr->attribute_count++];
        copy->key = strdup(attribute->name);
        copy->value = strndup(attribute->string->str ? attribute->string->str : "",
                              (size_t)attribute->string->length);
        if (!copy->key || !copy->value) return BD_ERR_NO_MEMORY;
    }
    return BD_ERR_OK;
}

static enum bd_err read_part(exr_context_t context, const struct read_stream *stream,
                             const struct bd_exr_limits *limits, struct bd_exr **exr,
                             struct bd_err_detail *detail)
{
    struct layout layout = {0};
    exr_result_t rv = get_layout(context, &layout);
    if (rv) return err_of(rv, stream, detail);
    enum bd_err err = check_kind(&layout, detail);
    if (!err) err = check_size(&layout, stream->size_bytes, limits, detail);
    if (err) return err;
    err = allocate(&layout, exr);
    if (!err) err = copy_attributes(context, *exr);
    if (err) return bd_err_set(detail, err, "exr", "no memory for the EXR's planes");

    return is_lossy(layout.compression) ? decode_lossy(stream, &layout, *exr, detail)
                                        : decode(context, stream, &layout, *exr, detail);
}

enum bd_err bd_exr_read(const void *bytes, size_t size_bytes, const struct bd_exr_limits *limits,
                        struct bd_exr **out, struct bd_err_detail *detail)
{
    *out = NULL;
    struct read_stream stream = {.bytes = bytes, .size_bytes = size_bytes};
    exr_context_initializer_t init = EXR_DEFAULT_CONTEXT_INITIALIZER;
    init.user_data = &stream;
    init.read_fn = read_bytes;
    init.size_fn = stream_size;
    init.alloc_fn = allocate_zeroed;
    init.free_fn = free;
    init.error_handler_fn = bd_exr_keep_complaint;
    init.max_image_width = init.max_image_height = (int)limits->side_px_max;
    // Without this a file whose offset table is damaged is searched for chunks: slow, and the
    // picture would be a guess.
    init.flags = EXR_CONTEXT_FLAG_DISABLE_CHUNK_RECONSTRUCTION;
    exr_context_t context = NULL;
    exr_result_t rv = exr_start_read(&context, "memory", &init);
    if (rv) return err_of(rv, &stream, detail);
    enum bd_err err = read_part(context, &stream, limits, out, detail);
    exr_finish(&context);
    if (err) bd_exr_destroy(out);
    return err;
}

const float *bd_exr_channel(const struct bd_exr *exr, const char *name)
{
    for (uint32_t i = 0; i < exr->channel_count; i++)
        if (strcmp(exr->channels[i].name, name) == 0) return exr->channels[i].samples;
    return NULL;
}

const char *bd_exr_attribute(const struct bd_exr *exr, const char *key)
{
    for (size_t i = 0; i < exr->attribute_count; i++)
        if (strcmp(exr->attributes[i].key, key) == 0) return exr->attributes[i].value;
    return NULL;
}

void bd_exr_destroy(struct bd_exr **exr)
{
    if (!*exr) return;
    for (uint32_t i = 0; i < (*exr)->channel_count; i++) free((*exr)->channels[i].samples);
    for (size_t i = 0; i < (*exr)->attribute_count; i++) {
        free((*exr)->attributes[i].key);
        free((*exr)->attributes[i].value);
    }
    free((*exr)->attributes);
    free(*exr);
    *exr = NULL;
}
