// A frame's own estimate of its error: of all its light, and of what a picture shows of it.

#include <math.h>

#include "frame/report.h"
#include "image/tonemap.h"
#include "tests/unit/cmocka_all.h"

#define SIDE   16u
#define PIXELS (SIDE * SIDE)

struct estimates {
    double own, shown;
};

// Of grey pixels, all of `light` and with a standard deviation of `doubt`, but one.
static struct estimates estimates_of(double light, double doubt, double light_of_one,
                                     double doubt_of_one)
{
    struct bd_report report = {.width_px = SIDE, .height_px = SIDE};
    struct bd_image *beauty = bd_image_create(SIDE, SIDE, 4),
                    *noise = bd_image_create(SIDE, SIDE, 3), *blur = bd_image_create(SIDE, SIDE, 1);
    assert_true(beauty && noise && blur);
    for (uint32_t i = 0; i < PIXELS; i++) {
        for (uint32_t c = 0; c < 4; c++)
            beauty->pixels[4 * i + c] = c == 3 ? 1 : (float)(i == 7 ? light_of_one : light);
        for (uint32_t c = 0; c < 3; c++)
            noise->pixels[3 * i + c] = (float)(i == 7 ? doubt_of_one : doubt);
    }
    struct bd_doubt_sums sums = bd_doubt_sums_of(bd_exposure_auto(beauty));
    for (uint32_t y = 0; y < SIDE; y++) bd_doubt_sums_add_row(&sums, beauty, noise, blur, y);
    bd_report_own_estimate(&report, &sums);
    assert_true(report.has_own_estimate);
    bd_image_destroy(&beauty);
    bd_image_destroy(&noise);
    bd_image_destroy(&blur);
    return (struct estimates){report.own_estimate, report.shown_estimate};
}

#define ASSERT_NEAR(a, b, part) assert_true(fabs((a) - (b)) <= (part)*fabs(b))

static void below_white_both_are_the_same(void **state)
{
    (void)state;
    const struct estimates e = estimates_of(1, .1, 2, .3);
    ASSERT_NEAR(e.own, .1015, .01);
    ASSERT_NEAR(e.shown, e.own, 1e-9);
}

// As white as it is sure to be, it is off by nothing that shows.
static void a_highlight_that_is_white_for_sure_is_not_off(void **state)
{
    (void)state;
    const struct estimates e = estimates_of(1, .1, 1000, 500);
    assert_true(e.own > 5);
    ASSERT_NEAR(e.shown, .1, .03); // white is 5.6
}

// One that may not be there at all is off by white: 5.6, of 256 pixels the sixteenth part.
static void one_that_may_not_be_there_is_off_by_white(void **state)
{
    (void)state;
    const struct estimates e = estimates_of(1, 0, 1000, 1000);
    assert_true(e.own > 10);
    ASSERT_NEAR(e.shown, 5.6 / 16, .05);
}

static void how_bright_it_is_changes_nothing(void **state)
{
    (void)state;
    const struct estimates one = estimates_of(1, .1, 30, 20);
    const struct estimates dark = estimates_of(0x1p-40, .1 * 0x1p-40, 30 * 0x1p-40, 20 * 0x1p-40);
    ASSERT_NEAR(dark.own, one.own, 1e-6);
    ASSERT_NEAR(dark.shown, one.shown, 1e-6);
}

// No number counts nowhere, and nothing is a part of black.
static void what_is_no_number_does_not_count(void **state)
{
    (void)state;
    const struct estimates with = estimates_of(1, .1, NAN, .1),
                           doubtful = estimates_of(1, .1, 1, NAN);
    assert_true(isfinite(with.own) && isfinite(with.shown));
    ASSERT_NEAR(doubtful.shown, .1, .01);
    struct bd_report black = {.width_px = 1, .height_px = 1};
    const struct bd_doubt_sums none = bd_doubt_sums_of(0);
    bd_report_own_estimate(&black, &none);
    assert_false(black.has_own_estimate);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(below_white_both_are_the_same),
        cmocka_unit_test(a_highlight_that_is_white_for_sure_is_not_off),
        cmocka_unit_test(one_that_may_not_be_there_is_off_by_white),
        cmocka_unit_test(how_bright_it_is_changes_nothing),
        cmocka_unit_test(what_is_no_number_does_not_count),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
