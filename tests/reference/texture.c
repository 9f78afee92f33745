// Texels as a GPU reads them, by hand.

#include "reference/texture.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "reference/surface.h"

// Two columns, three rows. Red is the texel's number, green its square, alpha counts down.
static uint8_t texels[] = {
    0,  0,   0, 250, 10, 100, 0, 240, // row 0
    20, 40,  0, 230, 30, 90,  0, 220, // row 1
    40, 160, 0, 210, 50, 250, 0, 200, // row 2
};
static struct bd_picture picture = {1, .width_px = 2, .height_px = 3, .rgba = texels};
static struct bd_picture *pictures[] = {&picture};
static const struct bd_scene scene = {.picture_count = 1, .pictures = pictures};

static float red_at(const struct bd_texture *texture, float u, float v)
{
    float out[4];
    bd_texture_at(&scene, texture, false, u, v, out);
    return out[0] * 255;
}

static void assert_red(const struct bd_texture *texture, float u, float v, double expected)
{
    assert_true(fabs(red_at(texture, u, v) - expected) < 1e-3);
}

static void every_byte_of_srgb(void **state)
{
    (void)state;
    for (int i = 0; i < 256; i++) {
        double c = i / 255.0, linear = c <= 0.04045 ? c / 12.92 : pow((c + 0.055) / 1.055, 2.4);
        assert_true(bd_srgb_to_linear((uint8_t)i) == (float)linear);
    }
}

static void centres_are_at_half(void **state)
{
    (void)state;
    for (int wrap = BD_WRAP_REPEAT; wrap <= BD_WRAP_MIRROR; wrap++) {
        const enum bd_wrap both = (enum bd_wrap)wrap;
        const struct bd_texture linear = {0, both, both, .nearest = false};
        const struct bd_texture nearest = {0, both, both, .nearest = true};
        for (int y = 0; y < 3; y++) {
            for (int x = 0; x < 2; x++) {
                float u = ((float)x + .5f) / 2, v = ((float)y + .5f) / 3;
                assert_red(&linear, u, v, 10 * (2 * y + x));
                assert_red(&nearest, u, v, 10 * (2 * y + x));
                assert_red(&nearest, u + .24f, v - .16f, 10 * (2 * y + x));
            }
        }
        assert_red(&linear, .5f, .5f, 25); // between the two of the middle row
        assert_red(&linear, .375f, .5f, 22.5);
        assert_red(&linear, .5f, 1.0f / 3, 15); // among four
    }
}

static void wraps_by_axis(void **state)
{
    (void)state;
    struct bd_texture t = {0, BD_WRAP_REPEAT, BD_WRAP_CLAMP, .nearest = false};
    assert_red(&t, 0, .5f, 25); // the seam: half of the last, half of the first
    assert_red(&t, 1, .5f, 25);
    assert_red(&t, -3.75f, .5f, 20);
    assert_red(&t, 7.25f, .5f, 20);
    assert_red(&t, .25f, -9, 0); // clamped rows
    assert_red(&t, .25f, 1, 40);
    assert_red(&t, .25f, 5, 40);
    t.wrap_s = BD_WRAP_CLAMP, t.wrap_t = BD_WRAP_REPEAT;
    assert_red(&t, 0, .5f, 20);
    assert_red(&t, 1, .5f, 30);
    assert_red(&t, .25f, 0, 20); // rows 2 and 0
    assert_red(&t, .25f, -1 / 6.0f, 40);
    t.wrap_s = BD_WRAP_MIRROR, t.wrap_t = BD_WRAP_MIRROR;
    assert_red(&t, 0, .5f, 20);
    assert_red(&t, 1, .5f, 30);
    assert_red(&t, 1.25f, .5f, 30); // turned round
    assert_red(&t, 1.75f, .5f, 20);
    assert_red(&t, 2.25f, .5f, 20);
    assert_red(&t, -.25f, .5f, 20);
    assert_red(&t, -.75f, .5f, 30);
    assert_red(&t, .25f, 1 + 5 / 6.0f, 0);
    t.nearest = true;
    assert_red(&t, -.01f, .5f, 20);
    assert_red(&t, 1.01f, .5f, 30);
    assert_red(&t, 2, .5f, 20);
    t.wrap_s = t.wrap_t = BD_WRAP_REPEAT;
    assert_red(&t, -.01f, .5f, 30);
    assert_red(&t, 1, .5f, 20);
    assert_red(&t, 1 - 0x1p-25f, .5f, 20); // rounds to 1
    t.wrap_s = t.wrap_t = BD_WRAP_CLAMP;
    assert_red(&t, 1, 1, 50);
}

// Decoding comes before filtering: the middle of two texels is the mean of two amounts of light.
static void srgb_is_decoded_first(void **state)
{
    (void)state;
    const struct bd_texture t = {0, BD_WRAP_CLAMP, BD_WRAP_CLAMP, .nearest = false};
    float out[4];
    bd_texture_at(&scene, &t, true, .5f, 5 / 6.0f, out);
    float expected = .5f * (bd_srgb_to_linear(160) + bd_srgb_to_linear(250));
    assert_true(fabsf(out[1] - expected) < 1e-6f);
    assert_true(fabsf(out[3] - 205 / 255.0f) < 1e-6f);
    assert_true(fabsf(bd_texture_alpha_at(&scene, &t, .5f, 5 / 6.0f) - out[3]) < 1e-7f);
}

static void odd_coordinates(void **state)
{
    (void)state;
    static const float odd[] = {NAN, INFINITY, -INFINITY, 3e38f, -3e38f, 1e10f, -1e-30f, -0.0f};
    for (int wrap = BD_WRAP_REPEAT; wrap <= BD_WRAP_MIRROR; wrap++) {
        for (int nearest = 0; nearest < 2; nearest++) {
            const enum bd_wrap both = (enum bd_wrap)wrap;
            const struct bd_texture t = {0, both, both, .nearest = nearest};
            for (size_t i = 0; i < sizeof odd / sizeof *odd; i++) {
                float red = red_at(&t, odd[i], odd[(i + 3) % 8]);
                assert_true(red >= 0 && red <= 50);
            }
        }
    }
    const struct bd_texture missing = {BD_NONE, BD_WRAP_REPEAT, BD_WRAP_REPEAT, .nearest = false};
    assert_red(&missing, .1f, .2f, 255);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_byte_of_srgb), cmocka_unit_test(centres_are_at_half),
        cmocka_unit_test(wraps_by_axis),      cmocka_unit_test(srgb_is_decoded_first),
        cmocka_unit_test(odd_coordinates),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
