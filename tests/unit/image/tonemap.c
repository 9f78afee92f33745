// Tone curves at points worked out by hand from the published formulas, and the auto exposure's
// promises.

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "image/tonemap.h"
#include "tests/unit/cmocka_all.h"

#define assert_near(a, b, tolerance) assert_true(fabs((double)(a) - (double)(b)) <= (tolerance))

static void map_grey(enum bd_tonemap tonemap, float stops, float level, float out[3])
{
    const float rgb[3] = {level, level, level};
    bd_tonemap_apply(tonemap, exp2f(stops), rgb, out);
}

static void black_is_black_in_every_curve(void **state)
{
    (void)state;
    for (int t = 0; t < BD_TONEMAP_COUNT; t++) {
        const float bad[4] = {0, -1, -INFINITY, NAN};
        for (int i = 0; i < 4; i++) {
            float out[3];
            map_grey((enum bd_tonemap)t, 0, bad[i], out);
            for (int c = 0; c < 3; c++) assert_int_equal(bd_srgb8(out[c]), 0);
        }
    }
}

static void infinity_is_white_not_nan(void **state)
{
    (void)state;
    for (int t = 0; t < BD_TONEMAP_COUNT; t++) {
        float out[3];
        map_grey((enum bd_tonemap)t, 0, INFINITY, out);
        for (int c = 0; c < 3; c++) assert_true(bd_srgb8(out[c]) >= 254);
    }
}

static void linear_is_exposure_and_clamp(void **state)
{
    (void)state;
    float out[3];
    const float rgb[3] = {0.25f, 1.0f, 3.0f};
    bd_tonemap_apply(BD_TONEMAP_LINEAR, exp2f(-1), rgb, out);
    assert_true(out[0] == 0.125f && out[1] == 0.5f && out[2] == 1.0f);
    map_grey(BD_TONEMAP_LINEAR, 0, 1, out);
    assert_int_equal(bd_srgb8(out[0]), 255); // 1 cd/m^2 is white at 0 stops
}

static void neutral_at_known_greys(void **state)
{
    (void)state;
    float out[3];
    // Above 2 F90 = 0.08 the toe takes F90 away: 0.18 -> 0.14.
    map_grey(BD_TONEMAP_NEUTRAL, 0, 0.18f, out);
    assert_near(out[0], 0.14, 1e-6);
    // Below it x^2 / (4 F90) is left: 0.04 -> 0.0016 / 0.16 = 0.01.
    map_grey(BD_TONEMAP_NEUTRAL, 0, 0.04f, out);
    assert_near(out[0], 0.01, 1e-6);
    // 0.76 + 0.04 is where compression starts: 0.8 -> 0.76 exactly from both sides.
    map_grey(BD_TONEMAP_NEUTRAL, 0, 0.8f, out);
    assert_near(out[0], 0.76, 1e-6);
    // 1.04 -> peak 1, d = 0.24: 1 - 0.0576 / 0.48 = 0.88. Grey stays grey whatever g is.
    map_grey(BD_TONEMAP_NEUTRAL, 0, 1.04f, out);
    for (int c = 0; c < 3; c++) assert_near(out[c], 0.88, 1e-6);
}

static void neutral_desaturates_a_bright_red(void **state)
{
    (void)state;
    // (2, 0, 0): offset 0, peak 2, compressed 1 - 0.0576 / 1.48 = 0.9610811,
    // g = 1 - 1 / (0.15 * 1.0389189 + 1) = 0.1348274, so green = 0.9610811 g = 0.1295801.
    const float rgb[3] = {2, 0, 0};
    float out[3];
    bd_tonemap_apply(BD_TONEMAP_NEUTRAL, 1, rgb, out);
    assert_near(out[0], 0.9610811, 1e-5);
    assert_near(out[1], 0.1295801, 1e-5);
    assert_near(out[2], 0.1295801, 1e-5);
}

static void agx_at_known_greys(void **state)
{
    (void)state;
    float out[3];
    // Middle grey is EV log2(0.18) = -2.473931, which is 0.606061 of the 16.5 stops. There the
    // polynomial is
    //   15.5 x^6 - 40.14 x^5 + 31.96 x^4 - 6.868 x^3 + 0.4298 x^2 + 0.1191 x - 0.00232 = 0.49673
    // and 0.49673^2.2 = 0.21452. Rows of all matrices add up to 1 within 1e-3.
    map_grey(BD_TONEMAP_AGX, 0, 0.18f, out);
    double x = (log2(0.18) + 12.47393) / 16.5;
    double poly =
        ((((((15.5 * x - 40.14) * x + 31.96) * x - 6.868) * x + 0.4298) * x + 0.1191) * x) -
        0.00232;
    assert_near(x, 0.606061, 1e-6);
    assert_near(poly, 0.49673, 1e-5);
    for (int c = 0; c < 3; c++) assert_near(out[c], 0.21452, 1e-3);
    // White: 6.5 stops above middle grey the logarithm is 1, where the polynomial gives 0.99858.
    map_grey(BD_TONEMAP_AGX, 0, 0.18f * 128, out);
    for (int c = 0; c < 3; c++) assert_near(out[c], pow(0.99858, 2.2), 2e-3);
}

static void curves_never_fall(void **state)
{
    (void)state;
    for (int t = 0; t < BD_TONEMAP_COUNT; t++) {
        float before = 0;
        for (int i = -200; i < 200; i++) {
            float out[3];
            map_grey((enum bd_tonemap)t, 0, exp2f((float)i / 16), out);
            assert_true(out[1] >= before - 1e-6f);
            before = out[1];
        }
    }
}

static void srgb_codes_round_to_nearest(void **state)
{
    (void)state;
    for (int code = 0; code < 256; code++) {
        double s = code / 255.0;
        double linear = s <= 0.04045 ? s / 12.92 : pow((s + 0.055) / 1.055, 2.4);
        assert_int_equal(bd_srgb8((float)linear), code);
    }
    for (int i = 0; i <= 20000; i++) {
        double v = i / 20000.0;
        double coded = v <= 0.0031308 ? 12.92 * v : 1.055 * pow(v, 1 / 2.4) - 0.055;
        if (fabs(coded * 255 - floor(coded * 255) - 0.5) < 1e-3) continue; // a tie, to a float
        assert_int_equal(bd_srgb8((float)v), (int)floor(coded * 255 + 0.5));
    }
    assert_int_equal(bd_srgb8(2), 255);
    assert_int_equal(bd_srgb8(-1), 0);
    assert_int_equal(bd_srgb8(NAN), 0);
}

static struct bd_image *noisy_image(uint32_t channel_count)
{
    struct bd_image *image = bd_image_create(37, 23, channel_count);
    assert_non_null(image);
    uint32_t x = 12345;
    for (size_t i = 0; i < (size_t)37 * 23 * channel_count; i++) {
        x = x * 1664525u + 1013904223u;
        image->pixels[i] = (float)(x >> 8) * 0x1p-22f;
    }
    return image;
}

static void auto_exposure_of_a_flat_grey(void **state)
{
    (void)state;
    struct bd_image *image = bd_image_create(4, 4, 3);
    for (int i = 0; i < 48; i++) image->pixels[i] = 0.18f * 8;
    float stops = bd_exposure_auto(image);
    assert_near(stops, -3, 1.0 / 1024);
    bd_image_destroy(&image);
}

static void auto_exposure_follows_the_light_exactly(void **state)
{
    (void)state;
    struct bd_image *image = noisy_image(3);
    float base = bd_exposure_auto(image);
    for (int k = -30; k <= 30; k++) {
        struct bd_image *scaled = noisy_image(3);
        for (size_t i = 0; i < (size_t)37 * 23 * 3; i++)
            scaled->pixels[i] = ldexpf(scaled->pixels[i], k);
        assert_true(bd_exposure_auto(scaled) == base - (float)k);
        assert_true(bd_exposure_auto(scaled) == bd_exposure_auto(scaled));
        bd_image_destroy(&scaled);
    }
    bd_image_destroy(&image);
}

// Indirect light that comes through walls takes no part, however much there is.
static void auto_exposure_of_lit_surfaces_alone(void **state)
{
    (void)state;
    struct bd_image *direct = bd_image_create(2, 2, 3), *emission = bd_image_create(2, 2, 3);
    struct bd_image *all = bd_image_create(2, 2, 4);
    for (int i = 0; i < 4; i++) {
        const float leaked[4] = {1e-3f, 1e-3f, 1e-3f, 1};
        memcpy(all->pixels + 4 * i, leaked, sizeof leaked);
    }
    assert_true(bd_exposure_auto(all) > 7);
    assert_true(bd_exposure_auto_lit(direct, emission, all) == 0); // a dark room stays dark
    for (int i = 0; i < 16; i++) all->pixels[i] = 0.18f * 16;
    assert_near(bd_exposure_auto_lit(direct, NULL, all), -4, 1.0 / 1024); // and is never too bright
    for (int c = 0; c < 3; c++) direct->pixels[c] = emission->pixels[c] = 0.09f / 4;
    assert_near(bd_exposure_auto_lit(direct, emission, all), 2, 1.0 / 512);
    assert_near(bd_exposure_auto_lit(direct, NULL, all), 3, 1.0 / 512);
    bd_image_destroy(&direct);
    bd_image_destroy(&emission);
    bd_image_destroy(&all);
}

static void auto_exposure_sees_covered_pixels_only(void **state)
{
    (void)state;
    struct bd_image *image = bd_image_create(2, 2, 4);
    assert_true(bd_exposure_auto(image) == 0); // nothing there at all
    const float covered[4] = {0.18f, 0.18f, 0.18f, 1};
    const float nothing[4] = {500, 500, 500, 0};
    const float broken[4] = {NAN, 1, 1, 1};
    memcpy(image->pixels, covered, sizeof covered);
    memcpy(image->pixels + 4, nothing, sizeof nothing);
    memcpy(image->pixels + 8, broken, sizeof broken);
    assert_near(bd_exposure_auto(image), 0, 1.0 / 512);
    bd_image_destroy(&image);
}

static void names_go_both_ways(void **state)
{
    (void)state;
    enum bd_tonemap tonemap = BD_TONEMAP_COUNT;
    for (int t = 0; t < BD_TONEMAP_COUNT; t++) {
        assert_true(bd_tonemap_from_name(bd_tonemap_name((enum bd_tonemap)t), &tonemap));
        assert_int_equal(tonemap, t);
    }
    assert_false(bd_tonemap_from_name("filmic", &tonemap));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(black_is_black_in_every_curve),
        cmocka_unit_test(infinity_is_white_not_nan),
        cmocka_unit_test(linear_is_exposure_and_clamp),
        cmocka_unit_test(neutral_at_known_greys),
        cmocka_unit_test(neutral_desaturates_a_bright_red),
        cmocka_unit_test(agx_at_known_greys),
        cmocka_unit_test(curves_never_fall),
        cmocka_unit_test(srgb_codes_round_to_nearest),
        cmocka_unit_test(auto_exposure_of_a_flat_grey),
        cmocka_unit_test(auto_exposure_follows_the_light_exactly),
        cmocka_unit_test(auto_exposure_of_lit_surfaces_alone),
        cmocka_unit_test(auto_exposure_sees_covered_pixels_only),
        cmocka_unit_test(names_go_both_ways),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
