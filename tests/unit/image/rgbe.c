// Radiance pictures made by hand, as any writer may lay them out; broken ones are refused.

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "image/rgbe.h"
#include "tests/unit/cmocka_all.h"

#define WIDTH    10
#define HEIGHT   3
#define SIDE_MAX 8192

struct file {
    uint8_t bytes[4096];
    size_t size;
};

static void put(struct file *file, const void *bytes, size_t size)
{
    memcpy(file->bytes + file->size, bytes, size);
    file->size += size;
}

static void put_text(struct file *file, const char *text)
{
    put(file, text, strlen(text));
}

static const char plain_head[] = "#?RADIANCE\n# by hand\nFORMAT=32-bit_rle_rgbe\n\n";

// Two halves of a row of one pixel each, and one of its own at the end.
static void pixel_at(int x, int y, uint8_t out[4])
{
    const uint8_t pixel[4] = {(uint8_t)(10 * y + (x < 5 ? 128 : 3)), 0, 200, 130};
    memcpy(out, x == WIDTH - 1 ? (const uint8_t[4]){255, 1, 7, (uint8_t)y} : pixel, 4);
}

static void put_flat(struct file *file, int y)
{
    for (int x = 0; x < WIDTH; x++) {
        uint8_t pixel[4];
        pixel_at(x, y, pixel);
        put(file, pixel, 4);
    }
}

static void put_repeats(struct file *file, int y)
{
    uint8_t pixel[4];
    pixel_at(0, y, pixel);
    put(file, pixel, 4);
    put(file, (const uint8_t[4]){1, 1, 1, 4}, 4);
    pixel_at(5, y, pixel);
    put(file, pixel, 4);
    put(file, (const uint8_t[4]){1, 1, 1, 3}, 4);
    pixel_at(WIDTH - 1, y, pixel);
    put(file, pixel, 4);
}

static void put_planes(struct file *file, int y)
{
    put(file, (const uint8_t[4]){2, 2, 0, WIDTH}, 4);
    for (int plane = 0; plane < 4; plane++) {
        uint8_t left[4], right[4], last[4];
        pixel_at(0, y, left);
        pixel_at(5, y, right);
        pixel_at(WIDTH - 1, y, last);
        put(file, (const uint8_t[2]){128 + 5, left[plane]}, 2);
        put(file, (const uint8_t[2]){128 + 4, right[plane]}, 2);
        put(file, (const uint8_t[2]){1, last[plane]}, 2);
    }
}

typedef void (*row_fn)(struct file *, int y);
static const row_fn rows[] = {put_flat, put_repeats, put_planes};

static struct file make(const char *head, const char *size, row_fn put_row)
{
    struct file file = {.size = 0};
    put_text(&file, head);
    put_text(&file, size);
    for (int y = 0; y < HEIGHT; y++) put_row(&file, y);
    return file;
}

static struct bd_image *read_file(const struct file *file)
{
    struct bd_image *image = NULL;
    struct bd_err_detail detail = {0};
    if (bd_rgbe_read(file->bytes, file->size, SIDE_MAX, &image, &detail))
        fail_msg("%s", detail.message);
    return image;
}

static float value_of(const uint8_t pixel[4], int c)
{
    return pixel[3] ? ldexpf((float)pixel[c] + .5f, pixel[3] - 136) : 0;
}

static void assert_pixels(const struct file *file, bool upwards, bool leftwards, float factor)
{
    struct bd_image *image = read_file(file);
    assert_int_equal(image->width_px, WIDTH);
    assert_int_equal(image->height_px, HEIGHT);
    assert_int_equal(image->channel_count, 3);
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            uint8_t pixel[4];
            pixel_at(leftwards ? WIDTH - 1 - x : x, upwards ? HEIGHT - 1 - y : y, pixel);
            for (int c = 0; c < 3; c++)
                assert_true(bd_image_at(image, (uint32_t)x, (uint32_t)y)[c] ==
                            value_of(pixel, c) * factor);
        }
    bd_image_destroy(&image);
}

static void rows_in_every_form_are_read(void **state)
{
    (void)state;
    for (size_t i = 0; i < 3; i++) {
        struct file file = make(plain_head, "-Y 3 +X 10\n", rows[i]);
        assert_pixels(&file, false, false, 1);
        file = make("#?RGBE\r\n\r\n", "+Y 3 +X 10\r\n", rows[i]);
        assert_pixels(&file, true, false, 1);
        file = make("#?RGBE\n\n", "-Y 3 -X 10\n", rows[i]);
        assert_pixels(&file, false, true, 1);
    }
}

static void exposures_are_undone(void **state)
{
    (void)state;
    struct file file =
        make("#?RADIANCE\nEXPOSURE=4\nEXPOSURE= 0.5\n\n", "-Y 3 +X 10\n", put_planes);
    assert_pixels(&file, false, false, .5f);
}

// 1, 1, 1, n behind another counts 256 times as much.
static void long_repeats_are_read(void **state)
{
    (void)state;
    struct file file = {.size = 0};
    put_text(&file, "#?RADIANCE\n\n-Y 1 +X 600\n");
    put(&file, (const uint8_t[12]){9, 8, 7, 128, 1, 1, 1, 87, 1, 1, 1, 2}, 12);
    struct bd_image *image = read_file(&file);
    assert_int_equal(image->width_px, 600);
    assert_true(bd_image_at(image, 599, 0)[0] == 9.5f / 256);
    bd_image_destroy(&image);
}

static void assert_refused(const struct file *file, size_t size, enum bd_err err, const char *word)
{
    // A copy of that size alone, so that a sanitiser sees a read beyond it.
    uint8_t *copy = malloc(size ? size : 1);
    memcpy(copy, file->bytes, size);
    struct bd_image *image = NULL;
    struct bd_err_detail detail = {0};
    const enum bd_err got = bd_rgbe_read(copy, size, SIDE_MAX, &image, &detail);
    if (got != err || image || !strstr(detail.message, word))
        fail_msg("%zu bytes: error %d, \"%s\"", size, (int)got, detail.message);
    free(copy);
}

static void broken_pictures_are_refused(void **state)
{
    (void)state;
    static const struct {
        const char *head, *size;
        enum bd_err err;
        const char *word;
    } heads[] = {
        {"#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n", "-Y 3 +X 10\n", BD_ERR_UNSUPPORTED, "xyze"},
        {"#?RADIANCE\nEXPOSURE=0\n\n", "-Y 3 +X 10\n", BD_ERR_BAD_INPUT, "EXPOSURE"},
        {"#?RADIANCE\nEXPOSURE=nan\n\n", "-Y 3 +X 10\n", BD_ERR_BAD_INPUT, "EXPOSURE"},
        {"#?RADIANCE\n\n", "+X 10 -Y 3\n", BD_ERR_UNSUPPORTED, "side"},
        {"#?RADIANCE\n\n", "-Y 0 +X 10\n", BD_ERR_BAD_INPUT, "HEIGHT"},
        {"#?RADIANCE\n\n", "-Y 3 +X -10\n", BD_ERR_BAD_INPUT, "WIDTH"},
        {"#?RADIANCE\n\n", "-Y 3\n", BD_ERR_BAD_INPUT, "WIDTH"},
        {"#?RADIANCE\n\n", "-Y 3 +X 8193\n", BD_ERR_LIMIT, "8192"},
        {"#?RADIANCE\n\n", "-Y 8192 +X 8192\n", BD_ERR_BAD_INPUT, "truncated"},
        {"#?RADIANCE\n\n", "-Y 3 +X 11\n", BD_ERR_BAD_INPUT, "row 2"},
        {"P6\n", "-Y 3 +X 10\n", BD_ERR_BAD_INPUT, "#?"},
    };
    for (size_t i = 0; i < sizeof heads / sizeof heads[0]; i++) {
        struct file file = make(heads[i].head, heads[i].size, put_flat);
        assert_refused(&file, file.size, heads[i].err, heads[i].word);
    }
}

static void every_truncation_is_refused(void **state)
{
    (void)state;
    for (size_t i = 0; i < 3; i++) {
        const struct file file = make(plain_head, "-Y 3 +X 10\n", rows[i]);
        for (size_t size = 0; size < file.size; size++)
            assert_refused(&file, size, BD_ERR_BAD_INPUT, "Radiance");
    }
}

static void runs_beyond_a_row_are_refused(void **state)
{
    (void)state;
    static const uint8_t in_planes[] = {2, 2, 0, 10, 128 + 11, 5}, none[] = {2, 2, 0, 10, 0, 5},
                         repeats[] = {7, 7, 7, 7, 1, 1, 1, 10}, first[] = {1, 1, 1, 1},
                         literal[] = {2, 2, 0, 10, 11, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1};
    static const struct {
        const uint8_t *bytes;
        size_t size;
    } bad[] = {{in_planes, sizeof in_planes},
               {none, sizeof none},
               {repeats, sizeof repeats},
               {first, sizeof first},
               {literal, sizeof literal}};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        struct file file = {.size = 0};
        put_text(&file, "#?RADIANCE\n\n-Y 1 +X 10\n");
        put(&file, bad[i].bytes, bad[i].size);
        assert_refused(&file, file.size, BD_ERR_BAD_INPUT, "row 0");
    }
}

static void damage_never_crashes(void **state)
{
    (void)state;
    uint32_t x = 11;
    for (int round = 0; round < 20000; round++) {
        struct file file = make(plain_head, "-Y 3 +X 10\n", rows[round % 3]);
        for (int hit = 0; hit < 1 + round % 4; hit++) {
            x = x * 1664525u + 1013904223u;
            file.bytes[(x >> 8) % file.size] = (uint8_t)(x >> 3);
        }
        uint8_t *copy = malloc(file.size);
        memcpy(copy, file.bytes, file.size);
        struct bd_image *image = NULL;
        struct bd_err_detail detail = {0};
        const enum bd_err err = bd_rgbe_read(copy, file.size, SIDE_MAX, &image, &detail);
        assert_true((err != BD_ERR_OK) == (image == NULL));
        assert_true(!err || detail.message[0]);
        bd_image_destroy(&image);
        free(copy);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rows_in_every_form_are_read),
        cmocka_unit_test(exposures_are_undone),
        cmocka_unit_test(long_repeats_are_read),
        cmocka_unit_test(broken_pictures_are_refused),
        cmocka_unit_test(every_truncation_is_refused),
        cmocka_unit_test(runs_beyond_a_row_are_refused),
        cmocka_unit_test(damage_never_crashes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
