// Texture pictures: every kind of PNG ends as RGBA8, and sizes are checked before memory is.

#include <spng.h>
#include <stdlib.h>
#include <string.h>
#include <turbojpeg.h>

#include "image/decode.h"
#include "tests/unit/cmocka_all.h"

static const struct bd_decode_limits limits = {1024, 1 << 20};

struct decoded {
    uint32_t width_px, height_px;
    uint8_t *rgba;
    struct bd_err_detail detail;
};

static enum bd_err decode(const void *bytes, size_t size, struct decoded *out)
{
    *out = (struct decoded){0};
    return bd_picture_decode(bytes, size, &limits, "images[0]", &out->width_px, &out->height_px,
                             &out->rgba, &out->detail);
}

static void *png(uint32_t width, uint32_t height, int type, int bits, const void *pixels,
                 size_t pixel_bytes, size_t *size)
{
    int code = 0;
    spng_ctx *ctx = spng_ctx_new(SPNG_CTX_ENCODER);
    struct spng_ihdr header = {width, height, (uint8_t)bits, (uint8_t)type, 0, 0, 0};
    struct spng_plte palette = {2, {{10, 20, 30, 0}, {200, 210, 220, 0}}};
    spng_set_option(ctx, SPNG_ENCODE_TO_BUFFER, 1);
    spng_set_ihdr(ctx, &header);
    if (type == SPNG_COLOR_TYPE_INDEXED) spng_set_plte(ctx, &palette);
    assert_int_equal(
        spng_encode_image(ctx, pixels, pixel_bytes, SPNG_FMT_PNG, SPNG_ENCODE_FINALIZE), 0);
    void *bytes = spng_get_png_buffer(ctx, size, &code);
    assert_non_null(bytes);
    spng_ctx_free(ctx);
    return bytes;
}

static void assert_png(int type, int bits, const void *pixels, size_t pixel_bytes,
                       const uint8_t expected[8])
{
    size_t size;
    struct decoded out;
    void *bytes = png(2, 1, type, bits, pixels, pixel_bytes, &size);
    if (decode(bytes, size, &out)) fail_msg("%s", out.detail.message);
    assert_int_equal(out.width_px, 2);
    assert_memory_equal(out.rgba, expected, 8);
    free(out.rgba);
    free(bytes);
}

static void all_kinds_of_png(void **state)
{
    (void)state;
    const uint8_t grey[] = {7, 250}, index[] = {0x40}, rgb[] = {1, 2, 3, 4, 5, 6};
    const uint16_t deep[] = {0xff10, 0x8000, 0x0100, 0xffff, 0, 0, 0, 0x7fff};
    assert_png(SPNG_COLOR_TYPE_GRAYSCALE, 8, grey, 2,
               (uint8_t[]){7, 7, 7, 255, 250, 250, 250, 255});
    assert_png(SPNG_COLOR_TYPE_INDEXED, 1, index, 1,
               (uint8_t[]){10, 20, 30, 255, 200, 210, 220, 255});
    assert_png(SPNG_COLOR_TYPE_TRUECOLOR, 8, rgb, 6, (uint8_t[]){1, 2, 3, 255, 4, 5, 6, 255});
    assert_png(SPNG_COLOR_TYPE_TRUECOLOR_ALPHA, 16, deep, 16,
               (uint8_t[]){255, 128, 1, 255, 0, 0, 0, 127});
}

static void every_cut_of_a_png_is_refused(void **state)
{
    (void)state;
    static uint8_t pixels[64 * 64 * 4];
    for (size_t i = 0; i < sizeof pixels; i++) pixels[i] = (uint8_t)(i * i >> 3);
    size_t size;
    struct decoded out;
    uint8_t *bytes = png(64, 64, SPNG_COLOR_TYPE_TRUECOLOR_ALPHA, 8, pixels, sizeof pixels, &size);
    // The last 12 bytes are the IEND chunk, which carries no pixel.
    for (size_t cut = 0; cut < size - 12; cut += 7) {
        assert_int_not_equal(decode(bytes, cut, &out), BD_ERR_OK);
        assert_null(out.rgba);
    }
    assert_int_equal(decode(bytes, size, &out), BD_ERR_OK);
    assert_memory_equal(out.rgba, pixels, sizeof pixels);
    free(out.rgba);
    free(bytes);
}

// 60,000 by 60,000 in a hundred bytes; and one that is only a little too wide.
static void size_is_checked_first(void **state)
{
    (void)state;
    uint8_t huge[] = "\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\xea\x60\0\0\xea\x60\x08\x06\0\0\0"
                     "\xf3\x50\x9a\xd6";
    struct decoded out;
    assert_int_not_equal(decode(huge, sizeof huge - 1, &out), BD_ERR_OK);
    static uint8_t row[1025];
    size_t size;
    void *bytes = png(1025, 1, SPNG_COLOR_TYPE_GRAYSCALE, 8, row, sizeof row, &size);
    assert_int_equal(decode(bytes, size, &out), BD_ERR_LIMIT);
    assert_non_null(strstr(out.detail.message, "1025 x 1"));
    assert_string_equal(out.detail.field, "images[0]");
    free(bytes);
}

static void jpegs_of_every_colour_space(void **state)
{
    (void)state;
    static const int samplings[] = {TJSAMP_444, TJSAMP_420, TJSAMP_GRAY};
    static uint8_t grey[16 * 16];
    memset(grey, 180, sizeof grey);
    tjhandle jpeg = tjInitCompress();
    for (size_t i = 0; i < 3; i++) {
        unsigned char *bytes = NULL;
        unsigned long size = 0;
        struct decoded out;
        assert_int_equal(
            tjCompress2(jpeg, grey, 16, 0, 16, TJPF_GRAY, &bytes, &size, TJSAMP_GRAY, 95, 0), 0);
        if (samplings[i] != TJSAMP_GRAY) {
            static uint8_t rgb[16 * 16 * 3];
            memset(rgb, 180, sizeof rgb);
            tjCompress2(jpeg, rgb, 16, 0, 16, TJPF_RGB, &bytes, &size, samplings[i], 95, 0);
        }
        assert_int_equal(decode(bytes, size, &out), BD_ERR_OK);
        assert_in_range(out.rgba[0], 178, 182);
        assert_in_range(out.rgba[4 * 255 + 2], 178, 182);
        assert_int_equal(out.rgba[3], 255);
        free(out.rgba);
        // The last two bytes are the end marker.
        for (unsigned long cut = 0; cut < size - 2; cut++)
            assert_int_not_equal(decode(bytes, cut, &out), BD_ERR_OK);
        tjFree(bytes);
    }
    tjDestroy(jpeg);
}

static void other_formats_are_named(void **state)
{
    (void)state;
    struct decoded out;
    assert_int_equal(decode("RIFF....WEBP", 12, &out), BD_ERR_UNSUPPORTED);
    assert_int_equal(decode("", 0, &out), BD_ERR_UNSUPPORTED);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(all_kinds_of_png),        cmocka_unit_test(every_cut_of_a_png_is_refused),
        cmocka_unit_test(size_is_checked_first),   cmocka_unit_test(jpegs_of_every_colour_space),
        cmocka_unit_test(other_formats_are_named),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
