// The error map's colours and where they are.

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "image/error_map.h"
#include "tests/unit/cmocka_all.h"

// Luma, near enough to tell dark from light.
static double luma(const uint8_t rgb[3])
{
    return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
}

static void lightness_grows_with_the_error(void **state)
{
    (void)state;
    double before = -1;
    for (int i = 0; i <= 64; i++) {
        uint8_t rgb[3];
        bd_error_map_colour(1e-3 * pow(10, 4.0 * i / 64), rgb);
        assert_true(luma(rgb) > before);
        // Never the green of what is not finite.
        assert_false(rgb[1] > rgb[0] + 40 && rgb[1] > rgb[2] + 40);
        before = luma(rgb);
    }
    assert_true(before > 230);
}

static void beyond_the_ends_is_the_end(void **state)
{
    (void)state;
    static const double pairs[][2] = {{0, 1e-3}, {1e-9, 1e-3}, {1e9, 10}, {INFINITY, 10}};
    for (int i = 0; i < 4; i++) {
        uint8_t a[3], b[3];
        bd_error_map_colour(pairs[i][0], a);
        bd_error_map_colour(pairs[i][1], b);
        assert_memory_equal(a, b, 3);
    }
}

static const uint8_t *at(const struct bd_canvas *canvas, uint32_t x, uint32_t y)
{
    return canvas->rgb8 + 3 * ((size_t)y * canvas->width_px + x);
}

static void pixels_are_where_the_picture_has_them(void **state)
{
    (void)state;
    struct bd_image *image = bd_image_create(40, 20, 3), *reference = bd_image_create(40, 20, 3);
    for (int i = 0; i < 40 * 20 * 3; i++) image->pixels[i] = reference->pixels[i] = 2;
    for (int c = 0; c < 3; c++) bd_image_at(image, 7, 3)[c] = 2.2f;
    bd_image_at(image, 8, 3)[1] = INFINITY;
    struct bd_metric_input input = {.reference = {reference, reference}, .image = {image, image}};
    struct bd_canvas canvas;
    assert_int_equal(bd_error_map(&input, 2, &canvas, NULL), BD_ERR_OK);
    assert_true(canvas.width_px > 40 && canvas.height_px > 20);
    uint8_t tenth[3], none[3];
    bd_error_map_colour(0.1, tenth);
    bd_error_map_colour(0, none);
    for (int c = 0; c < 3; c++) assert_in_range(at(&canvas, 7, 3)[c], tenth[c] - 1, tenth[c] + 1);
    assert_memory_equal(at(&canvas, 8, 3), bd_error_map_nonfinite, 3);
    assert_memory_equal(at(&canvas, 39, 19), none, 3);
    free(canvas.rgb8);
    bd_image_destroy(&image);
    bd_image_destroy(&reference);
}

// The bar holds every colour that errors get, from the largest down.
static void the_bar_is_the_scale(void **state)
{
    (void)state;
    struct bd_image *image = bd_image_create(4, 300, 1);
    struct bd_metric_input input = {.reference = {image, image}, .image = {image, image}};
    struct bd_canvas canvas;
    assert_int_equal(bd_error_map(&input, 1, &canvas, NULL), BD_ERR_OK);
    uint8_t high[3], low[3];
    bd_error_map_colour(10, high);
    bd_error_map_colour(0.001, low);
    uint32_t x = 4 + 4, top = 0, bottom = canvas.height_px - 1;
    while (top < bottom && memcmp(at(&canvas, x, top), high, 3) != 0) top++;
    while (bottom > top && memcmp(at(&canvas, x, bottom), low, 3) != 0) bottom--;
    assert_true(bottom - top > 200);
    for (int i = 0; i <= 4; i++) {
        uint8_t want[3];
        bd_error_map_colour(pow(10, 1 - i), want);
        const uint8_t *got = at(&canvas, x, top + (uint32_t)((double)(bottom - top) * i / 4));
        for (int c = 0; c < 3; c++) assert_true(abs(got[c] - want[c]) <= 4);
    }
    free(canvas.rgb8);
    bd_image_destroy(&image);
}

static void letters_are_drawn_at_every_scale(void **state)
{
    (void)state;
    static uint8_t pixels[30 * 30 * 3];
    static const uint8_t white[3] = {255, 255, 255};
    struct bd_canvas canvas = {30, 30, pixels};
    bd_canvas_text(&canvas, 1, 2, 2, "1?", white);
    // The stem of the 1 is its third column, the foot is three wide; unknown letters are blank.
    for (uint32_t y = 0; y < 30; y++)
        for (uint32_t x = 0; x < 30; x++) {
            bool stem = (x == 5 || x == 6) && y >= 2 && y < 16;
            bool foot = x >= 3 && x < 9 && y >= 14 && y < 16;
            bool flag = (x == 3 || x == 4) && y >= 4 && y < 6;
            assert_int_equal(*at(&canvas, x, y), stem || foot || flag ? 255 : 0);
        }
    bd_canvas_text(&canvas, 28, 28, 3, "8", white); // off the edge: cut
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lightness_grows_with_the_error),
        cmocka_unit_test(beyond_the_ends_is_the_end),
        cmocka_unit_test(pixels_are_where_the_picture_has_them),
        cmocka_unit_test(the_bar_is_the_scale),
        cmocka_unit_test(letters_are_drawn_at_every_scale),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
