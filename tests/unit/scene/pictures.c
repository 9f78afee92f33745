// A file's pictures: what becomes of them where they are too many, and that no thread shows.

#include <math.h>
#include <spng.h>
#include <stdlib.h>
#include <string.h>

#include "image/shrink.h"
#include "scene/gltf/picture_queue.h"
#include "scene/import/import.h"
#include "tests/unit/cmocka_all.h"

static void assert_shrunk(enum bd_texel_kind kind, uint32_t from_width, uint32_t from_height,
                          uint8_t *from, uint32_t width, uint32_t height, const uint8_t *expected)
{
    uint8_t result[64];
    const struct bd_texels in = {from_width, from_height, from}, out = {width, height, result};
    assert_true(bd_shrink(&in, kind, &out));
    for (uint32_t i = 0; i < 4 * width * height; i++)
        if (result[i] != expected[i]) fail_msg("byte %u: %u, not %u", i, result[i], expected[i]);
}

static void colours_are_averaged_as_light(void **state)
{
    (void)state;
    uint8_t two[] = {0, 255, 100, 0, 255, 255, 100, 255};
    // Half the light of white is code 188, not 128; alpha is no light.
    assert_shrunk(BD_TEXEL_COLOR, 2, 1, two, 1, 1, (uint8_t[]){188, 255, 100, 128});
    assert_shrunk(BD_TEXEL_DATA, 2, 1, two, 1, 1, (uint8_t[]){128, 255, 100, 128});
}

static void every_colour_comes_back_as_itself(void **state)
{
    (void)state;
    for (int code = 0; code < 256; code++) {
        uint8_t texels[3 * 3 * 4], expected[4];
        memset(texels, code, sizeof texels);
        memset(expected, code, sizeof expected);
        assert_shrunk(BD_TEXEL_COLOR, 3, 3, texels, 1, 1, expected);
        assert_shrunk(BD_TEXEL_DATA, 3, 3, texels, 2, 1,
                      (uint8_t[]){(uint8_t)code, (uint8_t)code, (uint8_t)code, (uint8_t)code,
                                  (uint8_t)code, (uint8_t)code, (uint8_t)code, (uint8_t)code});
    }
}

static void odd_sides_lose_nothing(void **state)
{
    (void)state;
    uint8_t texels[5 * 3 * 4] = {0};
    for (int i = 0; i < 15; i++) texels[4 * i] = (uint8_t)(10 * (i % 5) + 50 * (i / 5));
    // Of five columns, two and a half each: (0 + 10 + 20 / 2) / 2.5 = 8, (20 / 2 + 30 + 40) / 2.5 =
    // 32; and the mean row is 50.
    assert_shrunk(BD_TEXEL_DATA, 5, 3, texels, 2, 1, (uint8_t[]){58, 0, 0, 0, 82, 0, 0, 0});
}

static void normals_stay_as_long_as_one(void **state)
{
    (void)state;
    // (0.6, 0, 0.8) and (-0.6, 0, 0.8): straight up, where a plain mean would be 0.8 long.
    uint8_t two[] = {204, 128, 230, 255, 51, 128, 230, 255};
    uint8_t up[4];
    const struct bd_texels in = {2, 1, two}, out = {1, 1, up};
    assert_true(bd_shrink(&in, BD_TEXEL_NORMAL, &out));
    assert_in_range(up[0], 127, 128);
    assert_in_range(up[1], 127, 128);
    assert_int_equal(up[2], 255);
    // Opposite ones: no direction is in the middle, and none is not a number.
    uint8_t opposite[] = {255, 0, 0, 255, 0, 255, 255, 255};
    assert_shrunk(BD_TEXEL_NORMAL, 2, 1, opposite, 1, 1, (uint8_t[]){128, 128, 255, 255});
}

// --- the queue ------------------------------------------------------------------------------

#define PICTURES 24

struct encoded {
    void *bytes;
    size_t size;
};

static struct encoded encode(uint32_t width, uint32_t height, uint32_t seed)
{
    struct encoded out;
    int code;
    spng_ctx *ctx = spng_ctx_new(SPNG_CTX_ENCODER);
    struct spng_ihdr header = {width, height, 8, SPNG_COLOR_TYPE_TRUECOLOR_ALPHA, 0, 0, 0};
    uint8_t *texels = malloc(4 * (size_t)width * height);
    for (size_t i = 0; i < 4 * (size_t)width * height; i++)
        texels[i] = (uint8_t)(seed + i * (seed + 7) / 5);
    spng_set_option(ctx, SPNG_ENCODE_TO_BUFFER, 1);
    spng_set_ihdr(ctx, &header);
    assert_int_equal(spng_encode_image(ctx, texels, 4 * (size_t)width * height, SPNG_FMT_PNG,
                                       SPNG_ENCODE_FINALIZE),
                     0);
    out.bytes = spng_get_png_buffer(ctx, &out.size, &code);
    spng_ctx_free(ctx);
    free(texels);
    return out;
}

static struct encoded files[PICTURES];

// Sides 8, 16, 32, 64 and again.
static int make_files(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < PICTURES; i++) files[i] = encode(8u << i % 4, 8u << i % 4, i);
    return 0;
}

static int free_files(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < PICTURES; i++) free(files[i].bytes);
    return 0;
}

static struct bd_picture_queue *queue_of(uint32_t threads)
{
    struct bd_picture_queue *queue = bd_picture_queue_create(threads);
    assert_non_null(queue);
    for (uint32_t i = 0; i < PICTURES; i++) {
        const struct bd_encoded_picture encoded = {files[i].bytes, files[i].size,
                                                   (enum bd_texel_kind)(i % 3), i, i % 2 == 0};
        assert_true(bd_picture_queue_add(queue, &encoded));
    }
    return queue;
}

static struct bd_import_limits limits_of(uint64_t texels_kept)
{
    struct bd_import_limits limits = bd_import_default_limits;
    limits.picture_texels_kept = texels_kept;
    return limits;
}

// All texels, one picture behind the other.
static uint8_t *take_all(uint32_t threads, const struct bd_import_limits *limits,
                         struct bd_shrunk_pictures *shrunk, size_t *size)
{
    struct bd_err_detail detail = {0};
    struct bd_picture_queue *queue = queue_of(threads);
    if (bd_picture_queue_begin(queue, limits, shrunk, &detail)) fail_msg("%s", detail.message);
    uint8_t *all = malloc(4 * shrunk->texels_after);
    *size = 0;
    for (uint32_t i = 0; i < PICTURES; i++) {
        uint32_t width_px, height_px;
        uint8_t *rgba;
        bd_picture_queue_size(queue, i, &width_px, &height_px);
        if (bd_picture_queue_take(queue, &rgba, &detail)) fail_msg("%s", detail.message);
        assert_true(*size + 4 * (size_t)width_px * height_px <= 4 * shrunk->texels_after);
        memcpy(all + *size, rgba, 4 * (size_t)width_px * height_px);
        *size += 4 * (size_t)width_px * height_px;
        free(rgba);
    }
    bd_picture_queue_destroy(&queue);
    assert_int_equal(*size, 4 * shrunk->texels_after);
    return all;
}

static void the_same_texels_whoever_decodes(void **state)
{
    (void)state;
    struct bd_import_limits limits = limits_of(9000);
    struct bd_shrunk_pictures shrunk, again;
    size_t size, size_again;
    uint8_t *alone = take_all(0, &limits, &shrunk, &size);
    for (uint32_t threads = 1; threads <= 8; threads *= 2) {
        // A window of one picture at a time, and one of all.
        limits.memory_bytes = threads == 2 ? 8 : 4ull << 30;
        uint8_t *together = take_all(threads, &limits, &again, &size_again);
        assert_int_equal(size_again, size);
        assert_memory_equal(together, alone, size);
        free(together);
    }
    free(alone);
}

static void the_largest_are_halved_until_they_fit(void **state)
{
    (void)state;
    // Six each of 64, 256, 1024 and 4096 texels: 32640.
    const struct {
        uint64_t kept, after;
        uint32_t count;
    } cases[] = {{32640, 32640, 0},
                 {32639, 32640 - 3072, 1}, // the first of 64 x 64
                 {20000, 32640 - 5 * 3072, 5},
                 {14208, 32640 - 6 * 3072, 6}, // all of them: twelve of 32 x 32
                 {14207, 14208 - 768, 7},      // and the first of those, in the file's order
                 {24, 24, 24}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const struct bd_import_limits limits = limits_of(cases[i].kept);
        struct bd_shrunk_pictures shrunk;
        size_t size;
        free(take_all(0, &limits, &shrunk, &size));
        assert_int_equal(shrunk.texels_before, 32640);
        assert_int_equal(shrunk.texels_after, cases[i].after);
        assert_int_equal(shrunk.count, cases[i].count);
    }
}

static void assert_refused(const struct bd_import_limits *limits, const char *field)
{
    struct bd_shrunk_pictures shrunk;
    struct bd_err_detail detail = {0};
    struct bd_picture_queue *queue = queue_of(2);
    assert_int_equal(bd_picture_queue_begin(queue, limits, &shrunk, &detail), BD_ERR_LIMIT);
    assert_string_equal(detail.field, field);
    bd_picture_queue_destroy(&queue);
}

static void what_cannot_fit_is_refused(void **state)
{
    (void)state;
    struct bd_import_limits limits = limits_of(23);
    assert_refused(&limits, "images[23].uri");
    // To be shrunk to as many is not to be let in with as many.
    limits = limits_of(32640);
    limits.picture_texels = 32639;
    assert_refused(&limits, "images[23].uri");
    limits = limits_of(32640);
    limits.picture_side_px = 63;
    assert_refused(&limits, "images[3].uri");
}

// Of several broken ones the first is told of, however late it is found.
static void the_first_fault_is_told(void **state)
{
    (void)state;
    const struct bd_import_limits limits = limits_of(1 << 20);
    for (uint32_t threads = 0; threads <= 4; threads += 4) {
        struct bd_shrunk_pictures shrunk;
        struct bd_err_detail detail = {0};
        struct bd_picture_queue *queue = bd_picture_queue_create(threads);
        uint32_t taken = 0;
        uint8_t *rgba;
        for (uint32_t i = 0; i < PICTURES; i++) {
            const size_t cut = i % 6 == 5 ? files[i].size / 2 : 0;
            const struct bd_encoded_picture encoded = {files[i].bytes, files[i].size - cut,
                                                       BD_TEXEL_COLOR, i, false};
            assert_true(bd_picture_queue_add(queue, &encoded));
        }
        assert_int_equal(bd_picture_queue_begin(queue, &limits, &shrunk, &detail), BD_ERR_OK);
        while (bd_picture_queue_take(queue, &rgba, &detail) == BD_ERR_OK) {
            free(rgba);
            taken++;
        }
        assert_int_equal(taken, 5);
        assert_string_equal(detail.field, "images[5].uri");
        bd_picture_queue_destroy(&queue); // with some of them done and not taken
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(colours_are_averaged_as_light),
        cmocka_unit_test(every_colour_comes_back_as_itself),
        cmocka_unit_test(odd_sides_lose_nothing),
        cmocka_unit_test(normals_stay_as_long_as_one),
        cmocka_unit_test(the_same_texels_whoever_decodes),
        cmocka_unit_test(the_largest_are_halved_until_they_fit),
        cmocka_unit_test(what_cannot_fit_is_refused),
        cmocka_unit_test(the_first_fault_is_told),
    };
    return cmocka_run_group_tests(tests, make_files, free_files);
}
