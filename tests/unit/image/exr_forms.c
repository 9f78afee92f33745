// EXR files of the forms that others write and we do not: tiles, every lossless compression, half
// and uint samples, a data window away from the origin. Written by OpenEXR's core itself.

#include <openexr.h>
#include <stdlib.h>
#include <string.h>

#include "image/bytes.h"
#include "image/exr.h"
#include "tests/unit/cmocka_all.h"

#define WIDTH  37
#define HEIGHT 41
#define LEFT   (-5)
#define TOP    7
#define TILE   16

static const exr_compression_t compressions[] = {EXR_COMPRESSION_NONE, EXR_COMPRESSION_RLE,
                                                 EXR_COMPRESSION_ZIPS, EXR_COMPRESSION_ZIP,
                                                 EXR_COMPRESSION_PIZ};
#define COMPRESSION_COUNT (sizeof compressions / sizeof compressions[0])

// Whole numbers below 2048: exact in half, float and uint alike.
static uint32_t value_at(int x_px, int y_px, int channel)
{
    return (uint32_t)(x_px * 7 + y_px * 3 + channel * 11) % 97;
}

static float plane_f[HEIGHT * WIDTH];
static uint32_t plane_u[HEIGHT * WIDTH];

static int64_t write_bytes(exr_const_context_t context, void *user, const void *buffer,
                           uint64_t size, uint64_t offset, exr_stream_error_func_ptr_t error)
{
    (void)context, (void)error;
    return bd_bytes_put(user, offset, buffer, size) ? -1 : (int64_t)size;
}

#define core_ok(call) assert_int_equal((call), EXR_ERR_SUCCESS)

// Channels in the file's order: F float, H half, U uint.
static void aim(exr_encode_pipeline_t *pipe, int x_px, int y_px)
{
    assert_int_equal(pipe->channel_count, 3);
    for (int c = 0; c < 3; c++) {
        exr_coding_channel_info_t *channel = &pipe->channels[c];
        size_t at = (size_t)y_px * WIDTH + (size_t)x_px;
        bool is_uint = channel->channel_name[0] == 'U';
        channel->encode_from_ptr =
            is_uint ? (const uint8_t *)(plane_u + at) : (const uint8_t *)(plane_f + at);
        channel->user_data_type = is_uint ? EXR_PIXEL_UINT : EXR_PIXEL_FLOAT;
        channel->user_bytes_per_element = 4;
        channel->user_pixel_stride = 4;
        channel->user_line_stride = 4 * WIDTH;
    }
}

static void encode(exr_context_t context, const exr_chunk_info_t *chunk, int x_px, int y_px)
{
    exr_encode_pipeline_t pipe = EXR_ENCODE_PIPELINE_INITIALIZER;
    core_ok(exr_encoding_initialize(context, 0, chunk, &pipe));
    aim(&pipe, x_px, y_px);
    core_ok(exr_encoding_choose_default_routines(context, 0, &pipe));
    core_ok(exr_encoding_run(context, 0, &pipe));
    core_ok(exr_encoding_destroy(context, &pipe));
}

static void write_chunks(exr_context_t context, bool tiled)
{
    exr_chunk_info_t chunk;
    int32_t rows = 0;
    if (!tiled) core_ok(exr_get_scanlines_per_chunk(context, 0, &rows));
    for (int y = 0; !tiled && y < HEIGHT; y += rows) {
        core_ok(exr_write_scanline_chunk_info(context, 0, TOP + y, &chunk));
        encode(context, &chunk, 0, y);
    }
    for (int y = 0; tiled && y < HEIGHT; y += TILE)
        for (int x = 0; x < WIDTH; x += TILE) {
            core_ok(exr_write_tile_chunk_info(context, 0, x / TILE, y / TILE, 0, 0, &chunk));
            encode(context, &chunk, x, y);
        }
}

static struct bd_bytes write_file(exr_compression_t compression, bool tiled)
{
    for (int p = 0; p < WIDTH * HEIGHT; p++) {
        plane_u[p] = value_at(p % WIDTH, p / WIDTH, 0);
        plane_f[p] = (float)plane_u[p];
    }
    struct bd_bytes bytes = {0};
    exr_context_initializer_t init = EXR_DEFAULT_CONTEXT_INITIALIZER;
    init.user_data = &bytes;
    init.write_fn = write_bytes;
    exr_context_t context;
    core_ok(exr_start_write(&context, "memory", EXR_WRITE_FILE_DIRECTLY, &init));
    int part;
    core_ok(exr_add_part(context, NULL, tiled ? EXR_STORAGE_TILED : EXR_STORAGE_SCANLINE, &part));
    exr_attr_box2i_t window;
    window.min.x = LEFT;
    window.min.y = TOP;
    window.max.x = LEFT + WIDTH - 1;
    window.max.y = TOP + HEIGHT - 1;
    exr_attr_v2f_t center;
    center.x = center.y = 0;
    core_ok(exr_initialize_required_attr(context, part, &window, &window, 1, &center, 1,
                                         EXR_LINEORDER_INCREASING_Y, compression));
    if (tiled)
        core_ok(exr_set_tile_descriptor(context, part, TILE, TILE, EXR_TILE_ONE_LEVEL,
                                        EXR_TILE_ROUND_DOWN));
    static const struct {
        const char *name;
        exr_pixel_type_t type;
    } channels[] = {{"F", EXR_PIXEL_FLOAT}, {"H", EXR_PIXEL_HALF}, {"U", EXR_PIXEL_UINT}};
    for (int c = 0; c < 3; c++)
        core_ok(exr_add_channel(context, part, channels[c].name, channels[c].type,
                                EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1));
    core_ok(exr_write_header(context));
    write_chunks(context, tiled);
    core_ok(exr_finish(&context));
    return bytes;
}

static void every_form_is_read(void **state)
{
    (void)state;
    for (size_t i = 0; i < 2 * COMPRESSION_COUNT; i++) {
        struct bd_bytes bytes = write_file(compressions[i / 2], i % 2);
        struct bd_exr *exr = NULL;
        struct bd_err_detail detail = {0};
        if (bd_exr_read(bytes.data, bytes.size_bytes, &bd_exr_limits_default, &exr, &detail))
            fail_msg("compression %d, tiled %d: %s", (int)compressions[i / 2], (int)i % 2,
                     detail.message);
        assert_int_equal(exr->width_px, WIDTH);
        assert_int_equal(exr->height_px, HEIGHT);
        for (int c = 0; c < 3; c++) {
            const float *samples = bd_exr_channel(exr, (const char *const[]){"F", "H", "U"}[c]);
            assert_non_null(samples);
            for (int p = 0; p < WIDTH * HEIGHT; p++)
                assert_true(samples[p] == (float)value_at(p % WIDTH, p / WIDTH, 0));
        }
        bd_exr_destroy(&exr);
        bd_bytes_finish(&bytes);
    }
}

// OpenEXR's core of version 3.1 takes a number that it does not know for ZIP.
static void unknown_compression_gives_no_picture(void **state)
{
    (void)state;
    struct bd_bytes bytes = write_file(EXR_COMPRESSION_PIZ, false);
    uint8_t *at = memmem(bytes.data, bytes.size_bytes, "compression\0compression\0", 24);
    assert_non_null(at);
    at[28] = EXR_COMPRESSION_LAST_TYPE;
    struct bd_exr *exr = NULL;
    struct bd_err_detail detail = {0};
    assert_true(bd_exr_read(bytes.data, bytes.size_bytes, &bd_exr_limits_default, &exr, &detail));
    assert_null(exr);
    assert_true(detail.message[0]);
    bd_bytes_finish(&bytes);
}

// Sanitisers judge: a copy of exactly the file's size, with bytes changed anywhere or cut off.
static void damage_never_crashes(void **state)
{
    (void)state;
    uint32_t x = 7;
    for (size_t i = 0; i < 2 * COMPRESSION_COUNT; i++) {
        struct bd_bytes bytes = write_file(compressions[i / 2], i % 2);
        for (int round = 0; round < 400; round++) {
            x = x * 1664525u + 1013904223u;
            size_t size = round % 4 ? bytes.size_bytes : (x >> 8) % bytes.size_bytes;
            uint8_t *copy = malloc(size + 1);
            memcpy(copy, bytes.data, size);
            for (int hit = 0; size && hit < round % 3 + 1; hit++) {
                x = x * 1664525u + 1013904223u;
                copy[(x >> 8) % (round % 2 && size > 700 ? 700 : size)] = (uint8_t)(x >> 3);
            }
            struct bd_exr *exr = NULL;
            struct bd_err_detail detail = {0};
            if (bd_exr_read(copy, size, &bd_exr_limits_default, &exr, &detail))
                assert_true(detail.message[0] && !exr);
            bd_exr_destroy(&exr);
            free(copy);
        }
        bd_bytes_finish(&bytes);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_form_is_read),
        cmocka_unit_test(unknown_compression_gives_no_picture),
        cmocka_unit_test(damage_never_crashes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
