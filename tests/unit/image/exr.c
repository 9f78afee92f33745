// EXR: what goes in comes out to the bit, in the same bytes each time; broken files are refused.

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "image/exr.h"
#include "image/layers.h"
#include "tests/unit/cmocka_all.h"

#define WIDTH  33 // odd, and more than one chunk of 16 lines high
#define HEIGHT 35

static float sample_at(size_t i)
{
    static const float odd[] = {0, -0.0f, 1e-40f, 65504, 1e30f, INFINITY, -3.5f};
    if (i % 11 == 0) return odd[i / 11 % 7];
    return sinf((float)i) * (float)i;
}

static struct bd_image *test_image(uint32_t channel_count, size_t shift)
{
    struct bd_image *image = bd_image_create(WIDTH, HEIGHT, channel_count);
    assert_non_null(image);
    for (size_t i = 0; i < (size_t)WIDTH * HEIGHT * channel_count; i++)
        image->pixels[i] = sample_at(i + shift);
    return image;
}

static const struct bd_manifest_entry entries[] = {{"scene", "sha256:00ff"},
                                                   {"camera", "K\xc3\xbc"
                                                              "che"},
                                                   {"empty", ""}};

// The four kinds of layer in one file.
static struct bd_bytes write_layers(bool half)
{
    struct bd_image *beauty = test_image(4, 0), *normal = test_image(3, 1);
    struct bd_image *depth = test_image(1, 2), *direct = test_image(3, 3);
    const struct bd_named_layer layers[] = {
        {"beauty", beauty}, {"normal", normal}, {"depth", depth}, {"direct", direct}};
    struct bd_exr_plane planes[BD_EXR_CHANNEL_MAX];
    struct bd_exr_picture picture = {.width_px = WIDTH,
                                     .height_px = HEIGHT,
                                     .planes = planes,
                                     .manifest = {entries, 3}};
    struct bd_bytes bytes = {0};
    assert_int_equal(bd_layers_to_planes(layers, 4, planes, &picture.plane_count, NULL), BD_ERR_OK);
    for (size_t i = 0; i < picture.plane_count; i++) planes[i].half = half;
    assert_int_equal(bd_exr_write(&picture, &bytes, NULL), BD_ERR_OK);
    bd_image_destroy(&beauty);
    bd_image_destroy(&normal);
    bd_image_destroy(&depth);
    bd_image_destroy(&direct);
    return bytes;
}

static struct bd_exr *read_back(const struct bd_bytes *bytes)
{
    struct bd_exr *exr = NULL;
    struct bd_err_detail detail = {0};
    if (bd_exr_read(bytes->data, bytes->size_bytes, &bd_exr_limits_default, &exr, &detail))
        fail_msg("%s", detail.message);
    return exr;
}

static void assert_layer(const struct bd_exr *exr, const char *layer, const char *const *channels,
                         uint32_t channel_count, size_t shift)
{
    struct bd_image *want = test_image(channel_count, shift);
    for (uint32_t c = 0; c < channel_count; c++) {
        const float *got = bd_exr_channel(exr, channels[c]);
        if (!got) fail_msg("%s: no channel %s", layer, channels[c]);
        for (size_t p = 0; p < (size_t)WIDTH * HEIGHT; p++)
            assert_memory_equal(&got[p], &want->pixels[p * channel_count + c], sizeof(float));
    }
    bd_image_destroy(&want);
}

static void floats_round_trip_to_the_bit(void **state)
{
    (void)state;
    struct bd_bytes bytes = write_layers(false);
    struct bd_exr *exr = read_back(&bytes);
    assert_int_equal(exr->width_px, WIDTH);
    assert_int_equal(exr->height_px, HEIGHT);
    assert_int_equal(exr->channel_count, 11);
    assert_layer(exr, "beauty", (const char *const[]){"R", "G", "B", "A"}, 4, 0);
    assert_layer(exr, "normal", (const char *const[]){"normal.X", "normal.Y", "normal.Z"}, 3, 1);
    assert_layer(exr, "depth", (const char *const[]){"depth.Z"}, 1, 2);
    assert_layer(exr, "direct", (const char *const[]){"direct.R", "direct.G", "direct.B"}, 3, 3);
    for (size_t i = 0; i < 3; i++)
        assert_string_equal(bd_exr_attribute(exr, entries[i].key), entries[i].value);
    assert_null(bd_exr_attribute(exr, "nobody"));
    bd_exr_destroy(&exr);
    bd_bytes_finish(&bytes);
}

static void halves_round_to_eleven_bits(void **state)
{
    (void)state;
    struct bd_bytes bytes = write_layers(true), full = write_layers(false);
    assert_true(bytes.size_bytes < full.size_bytes);
    struct bd_exr *exr = read_back(&bytes);
    const float *depth = bd_exr_channel(exr, "depth.Z");
    for (size_t p = 0; p < (size_t)WIDTH * HEIGHT; p++) {
        float want = sample_at(p + 2);
        if (fabsf(want) > 65519)
            assert_true(isinf(depth[p]));
        else
            assert_true(fabsf(depth[p] - want) <= fabsf(want) / 2048 + 0x1p-24f);
    }
    bd_exr_destroy(&exr);
    bd_bytes_finish(&bytes);
    bd_bytes_finish(&full);
}

static void same_picture_same_bytes(void **state)
{
    (void)state;
    struct bd_bytes a = write_layers(false), b = write_layers(false);
    assert_int_equal(a.size_bytes, b.size_bytes);
    assert_memory_equal(a.data, b.data, a.size_bytes);
    bd_bytes_finish(&a);
    bd_bytes_finish(&b);
}

// Some of them compress to exactly their own length, which readers take for "not compressed".
static void pixels_by_the_handful(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < 2000; i++) {
        struct bd_image *image = bd_image_create(1 + i % 5, 1, 3);
        size_t count = 3 * (size_t)image->width_px;
        for (size_t s = 0; s < count; s++)
            image->pixels[s] = (i + s) % 4 ? (float)((i * 7 + s) % 3) : sample_at(i * 17 + s);
        const struct bd_named_layer layers[] = {{"beauty", image}, {"direct", image}};
        struct bd_exr_plane planes[BD_EXR_CHANNEL_MAX] = {0};
        struct bd_exr_picture picture = {.width_px = image->width_px, .height_px = 1,
                                         .planes = planes};
        assert_int_equal(bd_layers_to_planes(layers, 2, planes, &picture.plane_count, NULL), 0);
        struct bd_bytes bytes = {0};
        assert_int_equal(bd_exr_write(&picture, &bytes, NULL), BD_ERR_OK);
        struct bd_exr *exr = read_back(&bytes);
        struct bd_image *back = NULL;
        assert_int_equal(bd_layer_from_exr(exr, "direct", &back, NULL), BD_ERR_OK);
        assert_memory_equal(back->pixels, image->pixels, count * sizeof(float));
        bd_image_destroy(&back);
        bd_image_destroy(&image);
        bd_exr_destroy(&exr);
        bd_bytes_finish(&bytes);
    }
}

static void layer_comes_back_as_an_image(void **state)
{
    (void)state;
    struct bd_bytes bytes = write_layers(false);
    struct bd_exr *exr = read_back(&bytes);
    struct bd_image *image = NULL;
    assert_int_equal(bd_layer_from_exr(exr, "beauty", &image, NULL), BD_ERR_OK);
    assert_int_equal(image->channel_count, 3);
    for (size_t p = 0; p < (size_t)WIDTH * HEIGHT; p++)
        for (size_t c = 0; c < 3; c++) {
            float want = sample_at(p * 4 + c);
            assert_memory_equal(&image->pixels[p * 3 + c], &want, sizeof want);
        }
    bd_image_destroy(&image);
    assert_int_equal(bd_layer_from_exr(exr, "depth", &image, NULL), BD_ERR_OK);
    assert_int_equal(image->channel_count, 1);
    bd_image_destroy(&image);
    struct bd_err_detail detail;
    assert_int_equal(bd_layer_from_exr(exr, "indirect", &image, &detail), BD_ERR_NOT_FOUND);
    assert_non_null(strstr(detail.message, "direct.R"));
    bd_exr_destroy(&exr);
    bd_bytes_finish(&bytes);
}

static void layers_of_different_size_are_refused(void **state)
{
    (void)state;
    struct bd_image *a = bd_image_create(4, 4, 3), *b = bd_image_create(4, 5, 3);
    const struct bd_named_layer layers[] = {{"beauty", a}, {"direct", b}};
    struct bd_exr_plane planes[BD_EXR_CHANNEL_MAX];
    size_t count;
    struct bd_err_detail detail;
    assert_int_equal(bd_layers_to_planes(layers, 2, planes, &count, &detail), BD_ERR_USAGE);
    assert_non_null(strstr(detail.message, "direct"));
    bd_image_destroy(&a);
    bd_image_destroy(&b);
}

// Every length short of the whole file is refused, and with a reason.
static void every_truncation_is_refused(void **state)
{
    (void)state;
    struct bd_bytes bytes = write_layers(false);
    for (size_t size = 0; size < bytes.size_bytes; size += size < 1500 ? 1 : 97) {
        // A copy of that size alone, so that a sanitiser sees a read beyond it.
        uint8_t *cut = malloc(size ? size : 1);
        memcpy(cut, bytes.data, size);
        struct bd_exr *exr = NULL;
        struct bd_err_detail detail = {0};
        enum bd_err err = bd_exr_read(cut, size, &bd_exr_limits_default, &exr, &detail);
        if (err == BD_ERR_OK) fail_msg("%zu of %zu bytes were read", size, bytes.size_bytes);
        assert_null(exr);
        assert_true(detail.message[0]);
        free(cut);
    }
    bd_bytes_finish(&bytes);
}

// Damage anywhere gives a picture or an error, never a crash: sanitisers do the judging.
static void damage_never_crashes(void **state)
{
    (void)state;
    struct bd_bytes bytes = write_layers(true);
    uint32_t x = 99;
    unsigned refused = 0;
    for (int round = 0; round < 3000; round++) {
        uint8_t *copy = malloc(bytes.size_bytes);
        memcpy(copy, bytes.data, bytes.size_bytes);
        for (int hit = 0; hit < 1 + round % 3; hit++) {
            x = x * 1664525u + 1013904223u;
            // Most of the damage goes to the header and the chunk table.
            size_t range = round % 4 ? 900 : bytes.size_bytes;
            copy[(x >> 8) % range] = (uint8_t)(x >> 3);
        }
        struct bd_exr *exr = NULL;
        refused += bd_exr_read(copy, bytes.size_bytes, &bd_exr_limits_default, &exr, NULL) != 0;
        bd_exr_destroy(&exr);
        free(copy);
    }
    assert_true(refused > 500);
    bd_bytes_finish(&bytes);
}

static size_t find(const struct bd_bytes *bytes, const char *text)
{
    void *at = memmem(bytes->data, bytes->size_bytes, text, strlen(text) + 1);
    assert_non_null(at);
    return (size_t)((uint8_t *)at - bytes->data);
}

// A header that promises a huge picture: refused by size, before memory is taken.
static void huge_windows_are_refused_before_allocation(void **state)
{
    (void)state;
    struct bd_bytes bytes = write_layers(false);
    // name, type, u32 size, then min x, min y, max x, max y
    size_t at = find(&bytes, "dataWindow") + strlen("dataWindow") + 1 + strlen("box2i") + 1 + 4;
    static const int32_t windows[][2] = {{32766, 32766}, {1 << 30, 3}, {3, 1 << 30}, {20000, 1000}};
    for (size_t i = 0; i < sizeof windows / sizeof windows[0]; i++) {
        memcpy(bytes.data + at + 8, windows[i], 8);
        struct bd_exr *exr = NULL;
        struct bd_err_detail detail = {0};
        enum bd_err err =
            bd_exr_read(bytes.data, bytes.size_bytes, &bd_exr_limits_default, &exr, &detail);
        assert_true(err == BD_ERR_LIMIT || err == BD_ERR_BAD_INPUT);
        assert_null(exr);
        // Within the limits, but not what ten kilobytes can hold.
        if (windows[i][0] == 20000 && !strstr(detail.message, "bomb"))
            fail_msg("%s", detail.message);
    }
    bd_bytes_finish(&bytes);
}

static void limits_are_named(void **state)
{
    (void)state;
    struct bd_bytes bytes = write_layers(false);
    struct bd_exr *exr = NULL;
    struct bd_err_detail detail = {0};
    struct bd_exr_limits small = {.side_px_max = 32768, .size_bytes_max = 1 << 15};
    assert_int_equal(bd_exr_read(bytes.data, bytes.size_bytes, &small, &exr, &detail),
                     BD_ERR_LIMIT);
    assert_null(exr);
    bd_bytes_finish(&bytes);
}

static void reads_the_references(void **state)
{
    (void)state;
    const char *folder = getenv("BD_TEST_REFERENCES");
    char path[4096];
    snprintf(path, sizeof path, "%s/cornell_box.lambert.1.exr", folder ? folder : ".");
    FILE *file = fopen(path, "rb");
    if (!file) {
        print_message("no %s: skipped\n", path);
        skip();
    }
    struct bd_bytes bytes = {0};
    uint8_t chunk[4096];
    for (size_t got; (got = fread(chunk, 1, sizeof chunk, file)) > 0;)
        assert_int_equal(bd_bytes_put(&bytes, bytes.size_bytes, chunk, got), BD_ERR_OK);
    fclose(file);
    struct bd_exr *exr = read_back(&bytes);
    assert_int_equal(exr->width_px, 192);
    // MANIFEST.md: means of beauty, direct, indirect of half 1.
    static const struct {
        const char *layer;
        double mean;
    } want[] = {{"beauty", .19244}, {"direct", .12008}, {"indirect", .072358}};
    for (size_t i = 0; i < 3; i++) {
        struct bd_image *image = NULL;
        assert_int_equal(bd_layer_from_exr(exr, want[i].layer, &image, NULL), BD_ERR_OK);
        double sum = 0;
        for (size_t s = 0; s < (size_t)192 * 192 * 3; s++) sum += (double)image->pixels[s];
        assert_true(fabs(sum / (192 * 192 * 3) - want[i].mean) < 1e-5);
        bd_image_destroy(&image);
    }
    assert_non_null(bd_exr_channel(exr, "depth.Z"));
    bd_exr_destroy(&exr);
    bd_bytes_finish(&bytes);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(floats_round_trip_to_the_bit),
        cmocka_unit_test(halves_round_to_eleven_bits),
        cmocka_unit_test(same_picture_same_bytes),
        cmocka_unit_test(pixels_by_the_handful),
        cmocka_unit_test(layer_comes_back_as_an_image),
        cmocka_unit_test(layers_of_different_size_are_refused),
        cmocka_unit_test(every_truncation_is_refused),
        cmocka_unit_test(damage_never_crashes),
        cmocka_unit_test(huge_windows_are_refused_before_allocation),
        cmocka_unit_test(limits_are_named),
        cmocka_unit_test(reads_the_references),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
