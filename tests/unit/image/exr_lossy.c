// Every compression of OpenEXR, lossy ones included, as OpenEXR's C++ library writes them: read as
// that library reads them, near to what was written, and whatever damage does to them.

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "image/exr.h"
#include "tests/unit/cmocka_all.h"
#include "tests/unit/image/exr_cxx.h"

#define WIDTH  45
#define HEIGHT 267 // more than one chunk of 256 lines, and no multiple of 8
#define PIXELS (WIDTH * HEIGHT)

enum compression { NONE, RLE, ZIPS, ZIP, PIZ, PXR24, B44, B44A, DWAA, DWAB, COMPRESSION_COUNT };
enum { UINT, HALF, FLOAT };

// A sky: a gradient with some noise, a sun of a few pixels, a black half of the ground.
static float sky_at(int x_px, int y_px, int channel)
{
    const uint32_t hash = (uint32_t)(x_px * 7919 + y_px * 104729 + channel * 31) * 2654435761u;
    if (y_px > HEIGHT / 2 && x_px > WIDTH / 2) return 0;
    if (abs(x_px - 20) < 2 && abs(y_px - 40) < 2) return 22672;
    return (0.1f + (float)y_px / HEIGHT * (float)(channel + 1)) * (1 + (float)(hash >> 24) / 2560);
}

static float planes[6][PIXELS];
static float around[PIXELS]; // the largest colour within a block's side

static float largest_around(int x_px, int y_px)
{
    float largest = 0;
    for (int y = y_px - 7; y <= y_px + 7; y++)
        for (int x = x_px - 7; x <= x_px + 7; x++)
            if (x >= 0 && x < WIDTH && y >= 0 && y < HEIGHT)
                for (int c = 0; c < 3; c++) largest = fmaxf(largest, planes[c][y * WIDTH + x]);
    return largest;
}

static void fill_planes(void)
{
    for (int c = 0; c < 5; c++)
        for (int p = 0; p < PIXELS; p++) planes[c][p] = sky_at(p % WIDTH, p / WIDTH, c);
    for (int p = 0; p < PIXELS; p++) planes[3][p] = p % WIDTH < 40; // cover
    for (int p = 0; p < PIXELS; p++) planes[4][p] = (float)(p / 7 % 1000);
    // Any finite numbers: no compression makes them smaller.
    for (int p = 0; p < PIXELS; p++) {
        uint32_t bits = (uint32_t)p * 2654435761u;
        bits = (bits ^ bits >> 15) * 2246822519u;
        bits = (bits ^ bits >> 13) * 3266489917u;
        bits = (bits ^ bits >> 16) & 0xbfffffffu; // below 2 in size
        memcpy(&planes[5][p], &bits, sizeof bits);
    }
    for (int p = 0; p < PIXELS; p++) around[p] = largest_around(p % WIDTH, p / WIDTH);
}

// Kinds of pictures: names with types, each of a plane of its own.
static const struct kind {
    const char *what;
    int count;
    struct {
        const char *name;
        int type, plane;
    } channels[6];
} kinds[] = {
    {"halves", 3, {{"R", HALF, 0}, {"G", HALF, 1}, {"B", HALF, 2}}},
    {"floats", 3, {{"R", FLOAT, 0}, {"G", FLOAT, 1}, {"B", FLOAT, 2}}},
    {"all sorts",
     6,
     {{"R", HALF, 0},
      {"G", HALF, 1},
      {"B", HALF, 2},
      {"A", HALF, 3},
      {"Z", FLOAT, 4},
      {"id", UINT, 4}}},
    {"luminance", 1, {{"Y", HALF, 1}}},
    {"layers",
     5,
     {{"sun.R", HALF, 2},
      {"sun.G", FLOAT, 1},
      {"sun.B", HALF, 0},
      {"Y", FLOAT, 2},
      {"A", UINT, 4}}},
};
#define KIND_COUNT (sizeof kinds / sizeof kinds[0])

struct form {
    int compression, tile_px;
    bool second_part;
};

static unsigned char *write_form(const struct kind *kind, struct form form, size_t *size_bytes)
{
    struct exr_cxx_channel channels[6];
    for (int c = 0; c < kind->count; c++)
        channels[c] = (struct exr_cxx_channel){kind->channels[c].name, kind->channels[c].type,
                                               planes[kind->channels[c].plane]};
    const struct exr_cxx_picture picture = {.width_px = WIDTH,
                                            .height_px = HEIGHT,
                                            .left_px = -3,
                                            .top_px = 5,
                                            .compression = form.compression,
                                            .tile_px = form.tile_px,
                                            .second_part = form.second_part,
                                            .channels = channels,
                                            .channel_count = kind->count};
    return exr_cxx_write(&picture, size_bytes);
}

// Quantisation in a colour under a power keeps some percent of the largest one around.
static bool is_near_to_the_source(float got, const float *source, int p, const struct kind *kind,
                                  int c, int compression)
{
    const int type = kind->channels[c].type;
    const float want = source[p];
    if (type == UINT || (compression < PXR24 && type == FLOAT)) return got == want;
    if (compression <= PXR24) return fabsf(got - want) <= fabsf(want) / 1024;
    if (type == FLOAT && compression < DWAA) return got == want;
    return fabsf(got - want) <= .12f * fmaxf(around[p], want) + .005f;
}

static void assert_picture(const struct kind *kind, struct form form)
{
    size_t size_bytes;
    unsigned char *bytes = write_form(kind, form, &size_bytes);
    struct bd_exr *exr = NULL;
    struct bd_err_detail detail = {0};
    if (bd_exr_read(bytes, size_bytes, &bd_exr_limits_default, &exr, &detail))
        fail_msg("%s, compression %d: %s", kind->what, form.compression, detail.message);
    assert_int_equal(exr->width_px, WIDTH);
    assert_int_equal(exr->height_px, HEIGHT);
    assert_int_equal(exr->channel_count, kind->count);
    static float library[PIXELS];
    for (int c = 0; c < kind->count; c++) {
        const float *got = bd_exr_channel(exr, kind->channels[c].name);
        const float *source = planes[kind->channels[c].plane];
        assert_non_null(got);
        assert_true(exr_cxx_read(bytes, size_bytes, kind->channels[c].name, library));
        for (int p = 0; p < PIXELS; p++)
            if (got[p] != library[p] ||
                !is_near_to_the_source(got[p], source, p, kind, c, form.compression))
                fail_msg("%s, compression %d, tiles of %d, channel %s at %d, %d: %g, by the "
                         "library %g, written %g",
                         kind->what, form.compression, form.tile_px, kind->channels[c].name,
                         p % WIDTH, p / WIDTH, (double)got[p], (double)library[p],
                         (double)source[p]);
    }
    bd_exr_destroy(&exr);
    free(bytes);
}

static void every_compression_is_read(void **state)
{
    (void)state;
    for (size_t k = 0; k < KIND_COUNT; k++)
        for (int compression = NONE; compression < COMPRESSION_COUNT; compression++) {
            assert_picture(&kinds[k], (struct form){.compression = compression});
            assert_picture(&kinds[k], (struct form){.compression = compression, .tile_px = 40});
        }
}

static void what_gets_no_smaller_is_read(void **state)
{
    (void)state;
    static const struct kind noise = {"noise", 1, {{"R", FLOAT, 5}}};
    for (int compression = NONE; compression < DWAA; compression++) {
        size_t size_bytes;
        free(write_form(&noise, (struct form){.compression = compression}, &size_bytes));
        if (size_bytes < PIXELS * sizeof(float) && compression != PXR24)
            fail_msg("compression %d: %zu bytes", compression, size_bytes);
        assert_picture(&noise, (struct form){.compression = compression});
        assert_picture(&noise, (struct form){.compression = compression, .tile_px = 16});
    }
}

static void the_first_of_several_parts_is_read(void **state)
{
    (void)state;
    for (int compression = NONE; compression < COMPRESSION_COUNT; compression++)
        for (int tile_px = 0; tile_px < 80; tile_px += 40)
            assert_picture(&kinds[compression % 3],
                           (struct form){compression, tile_px, .second_part = true});
}

// Compressed, so that damage within the chunks matters: smaller than the same as plain halves.
static void lossy_files_are_small(void **state)
{
    (void)state;
    for (int compression = PXR24; compression < COMPRESSION_COUNT; compression++) {
        size_t size_bytes;
        free(write_form(&kinds[0], (struct form){.compression = compression}, &size_bytes));
        assert_true(size_bytes < PIXELS * 3 * 2);
    }
}

static bool read_copy(const unsigned char *bytes, size_t size)
{
    struct bd_exr *exr = NULL;
    struct bd_err_detail detail = {0};
    enum bd_err err = bd_exr_read(bytes, size, &bd_exr_limits_default, &exr, &detail);
    assert_true((err == BD_ERR_OK) == (exr != NULL));
    assert_true(!err || detail.message[0]);
    bd_exr_destroy(&exr);
    return !err;
}

static void every_truncation_is_refused(void **state)
{
    (void)state;
    for (int i = 0; i < 2 * COMPRESSION_COUNT; i++) {
        size_t size_bytes;
        const struct form form = {.compression = i / 2, .tile_px = i % 2 ? 64 : 0};
        unsigned char *bytes = write_form(&kinds[2], form, &size_bytes);
        for (size_t size = 0; size < size_bytes; size += 1 + size / 40) {
            // A copy of that size alone, so that a sanitiser sees a read beyond it.
            unsigned char *cut = malloc(size ? size : 1);
            memcpy(cut, bytes, size);
            if (read_copy(cut, size))
                fail_msg("compression %d: %zu of %zu bytes were read", i / 2, size, size_bytes);
            free(cut);
        }
        free(bytes);
    }
}

static void damage_never_crashes(void **state)
{
    (void)state;
    uint32_t x = 5;
    for (int i = 0; i < 2 * COMPRESSION_COUNT; i++) {
        size_t size_bytes;
        unsigned refused = 0;
        const struct form form = {.compression = i / 2, .tile_px = i % 2 ? 64 : 0};
        unsigned char *bytes = write_form(&kinds[2], form, &size_bytes);
        unsigned char *copy = malloc(size_bytes);
        for (int round = 0; round < 80; round++) {
            memcpy(copy, bytes, size_bytes);
            for (int hit = 0; hit < round % 4 + 1; hit++) {
                x = x * 1664525u + 1013904223u;
                size_t range = round % 3 == 0 && size_bytes > 900 ? 900 : size_bytes;
                copy[(x >> 4) % range] ^= (uint8_t)(1u << (x >> 28) % 8);
            }
            refused += !read_copy(copy, size_bytes);
        }
        assert_true(refused > 5);
        free(copy);
        free(bytes);
    }
}

int main(void)
{
    fill_planes();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_compression_is_read),
        cmocka_unit_test(what_gets_no_smaller_is_read),
        cmocka_unit_test(the_first_of_several_parts_is_read),
        cmocka_unit_test(lossy_files_are_small),
        cmocka_unit_test(every_truncation_is_refused),
        cmocka_unit_test(damage_never_crashes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
