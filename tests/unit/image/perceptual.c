// Filters, display, SSIM and FLIP: known answers and known properties.

#include <math.h>
#include <stdlib.h>

#include "image/display.h"
#include "image/filter.h"
#include "image/flip.h"
#include "image/ssim.h"
#include "tests/unit/cmocka_all.h"

#define SIDE 48

static void assert_near(double got, double want, double tolerance)
{
    if (!(fabs(got - want) <= tolerance)) fail_msg("%.9g is not %.9g", got, want);
}

static struct bd_image *flat(float r, float g, float b)
{
    struct bd_image *image = bd_image_create(SIDE, SIDE, 3);
    assert_non_null(image);
    for (int p = 0; p < SIDE * SIDE; p++) {
        image->pixels[3 * p] = r;
        image->pixels[3 * p + 1] = g;
        image->pixels[3 * p + 2] = b;
    }
    return image;
}

// Something with edges, points, gradients and colours.
static struct bd_image *busy(float shift)
{
    struct bd_image *image = flat(0, 0, 0);
    for (int y = 0; y < SIDE; y++) {
        for (int x = 0; x < SIDE; x++) {
            float *rgb = bd_image_at(image, (uint32_t)x, (uint32_t)y);
            rgb[0] = x > 20 ? 0.8f : 0.1f;
            rgb[1] = (float)y / SIDE;
            rgb[2] = (x * 7 + y * 3) % 11 == 0 ? 0.9f : 0.2f;
            for (int c = 0; c < 3; c++) rgb[c] = fminf(rgb[c] + shift, 1);
        }
    }
    return image;
}

// --- filters --------------------------------------------------------------------------------

static float sample_at(const float *plane, int width, int height, int x, int y)
{
    x = x < 0 ? 0 : (x >= width ? width - 1 : x);
    y = y < 0 ? 0 : (y >= height ? height - 1 : y);
    return plane[y * width + x];
}

// Against the definition, on planes wider and narrower than the kernel.
static void filters_repeat_the_edge(void **state)
{
    (void)state;
    static const int sizes[][2] = {{13, 3}, {2, 9}, {1, 1}, {6, 6}};
    struct bd_kernel kernel;
    bd_kernel_gaussian(1.5, 3, &kernel);
    kernel.weights[0] *= 3; // not symmetric
    for (int s = 0; s < 4; s++) {
        int width = sizes[s][0], height = sizes[s][1];
        struct bd_plane_size size = {(size_t)width, (size_t)height};
        float in[64], rows[64], columns[64];
        for (int i = 0; i < width * height; i++) in[i] = (float)(i * 37 % 17);
        bd_filter_rows(in, size, &kernel, rows);
        bd_filter_columns(in, size, &kernel, columns);
        for (int y = 0; y < height; y++) {
            for (int x = 0; x < width; x++) {
                double across = 0, down = 0;
                for (int k = -3; k <= 3; k++) {
                    double weight = (double)kernel.weights[k + 3];
                    across += weight * (double)sample_at(in, width, height, x + k, y);
                    down += weight * (double)sample_at(in, width, height, x, y + k);
                }
                assert_near((double)rows[y * width + x], across, 1e-5);
                assert_near((double)columns[y * width + x], down, 1e-5);
            }
        }
    }
}

static void gaussians_sum_to_one_and_drop_what_is_nothing(void **state)
{
    (void)state;
    struct bd_kernel kernel;
    double sum = bd_kernel_gaussian(2, 20, &kernel), weights = 0;
    assert_near(sum, 2 * sqrt(2 * acos(-1)), 1e-6);
    assert_int_equal(kernel.radius, 12); // exp(-13^2 / 8) = 6.7e-10
    for (int i = 0; i <= 2 * kernel.radius; i++) weights += (double)kernel.weights[i];
    assert_near(weights, 1, 1e-6);
}

// --- display --------------------------------------------------------------------------------

static void the_curve_and_its_inverse(void **state)
{
    (void)state;
    assert_near((double)bd_display_curve(1), 0.9216 / 1.3688, 1e-6);
    for (double level = 0.05; level < 1; level += 0.1)
        assert_near((double)bd_display_curve((float)bd_display_curve_inverse(level)), level, 1e-5);
    assert_true(bd_display_curve(-1) == 0 && bd_display_curve(NAN) == 0);
    assert_true(bd_display_curve(100) == 1 && bd_display_curve(1e30f) == 1 &&
                bd_display_curve(INFINITY) == 1);
    assert_near((double)bd_display_srgb(0.5f), 0.735357, 1e-5);
    assert_near((double)bd_display_srgb(0.001f), 0.01292, 1e-6);
}

static void luminance_range_of_ranks(void **state)
{
    (void)state;
    struct bd_image *image = bd_image_create(10, 10, 3);
    for (int p = 0; p < 100; p++)
        for (int c = 0; c < 3; c++) image->pixels[3 * p + c] = (float)((p * 31) % 100 + 1);
    struct bd_luminance_range range;
    assert_true(bd_luminance_range(image, &range));
    assert_near(range.median, 50.5, 1e-4);
    assert_near(range.high, 99, 1e-4);
    assert_near(range.max, 100, 1e-4);
    // Black for the most part: of what is lit.
    for (int p = 0; p < 100; p++)
        for (int c = 0; c < 3; c++) image->pixels[3 * p + c] = p < 97 ? 0 : (float)(p - 96);
    assert_true(bd_luminance_range(image, &range));
    assert_near(range.median, 2, 1e-4);
    bd_image_destroy(&image);
}

// --- SSIM -----------------------------------------------------------------------------------

static double ssim_mean(const float *a, const float *b)
{
    static float map[SIDE * SIDE];
    struct bd_plane_size size = {SIDE, SIDE};
    assert_int_equal(bd_ssim(a, b, size, map, NULL), BD_ERR_OK);
    double sum = 0;
    for (int p = 0; p < SIDE * SIDE; p++) sum += (double)map[p];
    return sum / (SIDE * SIDE);
}

static void ssim_by_hand(void **state)
{
    (void)state;
    static float a[SIDE * SIDE], b[SIDE * SIDE], negative[SIDE * SIDE];
    for (int p = 0; p < SIDE * SIDE; p++) {
        a[p] = (p * 7 % 13) / 13.0f;
        negative[p] = 1 - a[p];
    }
    assert_true(ssim_mean(a, a) == 1);
    assert_true(ssim_mean(a, negative) < -0.8);
    assert_near(ssim_mean(a, negative), ssim_mean(negative, a), 0);
    // Constants: only the term of means is left.
    for (int p = 0; p < SIDE * SIDE; p++) a[p] = 0.5f, b[p] = 0.6f;
    assert_near(ssim_mean(a, b), (2 * 0.3 + 1e-4) / (0.25 + 0.36 + 1e-4), 1e-4);
    // The same structure at half the contrast and the same mean: (2 s/2 s + C2) / (s^2 + s^2/4 +
    // C2) with a large s is 0.8. A checkerboard has nearly the same moments in every window.
    for (int p = 0; p < SIDE * SIDE; p++) {
        float sign = (p / SIDE + p) % 2 ? 0.5f : -0.5f;
        a[p] = 0.5f + sign;
        b[p] = 0.5f + sign / 2;
    }
    assert_near(ssim_mean(a, b), (2 * 0.125 + 9e-4) / (0.25 + 0.0625 + 9e-4), 2e-3);
}

// --- FLIP -----------------------------------------------------------------------------------

static double flip_mean(const struct bd_image *reference, const struct bd_image *image)
{
    static float error[SIDE * SIDE];
    assert_int_equal(bd_flip_ldr(reference, image, BD_FLIP_PPD_DEFAULT, error, NULL), BD_ERR_OK);
    double sum = 0;
    for (int p = 0; p < SIDE * SIDE; p++) {
        assert_true(error[p] >= 0 && error[p] <= 1);
        sum += (double)error[p];
    }
    return sum / (SIDE * SIDE);
}

static double flip_of_flats(float ra, float ga, float ba, float rb, float gb, float bb)
{
    struct bd_image *a = flat(ra, ga, ba), *b = flat(rb, gb, bb);
    double mean = flip_mean(a, b);
    bd_image_destroy(&a);
    bd_image_destroy(&b);
    return mean;
}

// Without edges or points FLIP is the colour difference alone, which the paper's formulas give:
// HyAB^0.7 of L* and Hunt-adjusted a*, b*; up to 0.4 of the largest it is scaled to 0.95.
static void flip_of_flat_colours(void **state)
{
    (void)state;
    assert_near(flip_of_flats(0, 1, 0, 0, 0, 1), 1, 1e-5); // the largest there is
    // L* 0 and 100: 100^0.7 = 25.1189; the largest distance is 203.302 (41.2761 after the power).
    double largest = 41.276096, knee = 0.4 * largest;
    assert_near(flip_of_flats(0, 0, 0, 1, 1, 1),
                0.95 + 0.05 * (pow(100, 0.7) - knee) / (largest - knee), 1e-5);
    assert_near(flip_of_flats(0.2f, 0.3f, 0.4f, 0.2f, 0.3f, 0.4f), 0, 0);
    // A grey of Y 0.18 has L* 49.496: 49.496^0.7 / (0.4 largest) * 0.95.
    assert_near(flip_of_flats(0, 0, 0, 0.18f, 0.18f, 0.18f), pow(49.496, 0.7) / knee * 0.95, 1e-4);
}

// Of the busy picture: turned, its channels changed round.
static struct bd_image *turned_busy(void)
{
    struct bd_image *image = flat(0, 0, 0), *busy_image = busy(0);
    for (uint32_t y = 0; y < SIDE; y++) {
        for (uint32_t x = 0; x < SIDE; x++) {
            const float *from = bd_image_at(busy_image, y, x);
            float *to = bd_image_at(image, x, y);
            for (int c = 0; c < 3; c++) to[c] = from[(c + 2) % 3];
        }
    }
    bd_image_destroy(&busy_image);
    return image;
}

// Darker by 6 stops on the left (0) or top (1) edge, up to 5.75 brighter at the other.
static void expose_across(struct bd_image *image, int down)
{
    for (uint32_t y = 0; y < SIDE; y++)
        for (uint32_t x = 0; x < SIDE; x++)
            for (int c = 0; c < 3; c++)
                bd_image_at(image, x, y)[c] *= exp2f((float)(down ? y : x) * 0.25f - 6);
}

struct makers_figure {
    double mean, pixels[5]; // those below
};

static void assert_as_the_makers(const char *what, const float *error,
                                 const struct makers_figure *expected, double tolerance)
{
    static const uint32_t at[5][2] = {{0, 0}, {30, 10}, {12, 40}, {47, 25}, {20, 20}};
    double sum = 0, off = 0;
    for (int p = 0; p < SIDE * SIDE; p++) sum += (double)error[p];
    off = fabs(sum / (SIDE * SIDE) - expected->mean);
    for (int i = 0; i < 5; i++)
        off = fmax(off, fabs((double)error[at[i][1] * SIDE + at[i][0]] - expected->pixels[i]));
    print_message("    %s: off by at most %.1e\n", what, off);
    assert_true(off < tolerance);
}

// Figures of the makers' algorithm (image/flip.h says how they were had) for pictures with edges in
// both directions, points, gradients, every colour channel, and what is repeated beyond the edges.
static void flip_is_what_its_makers_compute(void **state)
{
    (void)state;
    static const struct makers_figure turned = {0.796298,
                                                {0.961923, 0.919102, 0.483175, 0.967228, 0.707636}};
    static const struct makers_figure turned_20 = {
        0.797417, {0.968206, 0.956905, 0.359271, 0.928818, 0.976483}};
    static const struct makers_figure shifted = {
        0.176020, {0.320956, 0.164265, 0.178970, 0.143476, 0.156623}};
    static const struct makers_figure hdr = {0.894162,
                                             {0.144894, 0.982432, 0.985359, 0.977294, 0.880434}};
    static float error[SIDE * SIDE];
    struct bd_image *a = busy(0), *b = turned_busy(), *c = busy(0.05f);
    assert_int_equal(bd_flip_ldr(a, b, BD_FLIP_PPD_DEFAULT, error, NULL), BD_ERR_OK);
    assert_as_the_makers("turned", error, &turned, 1e-6);
    assert_int_equal(bd_flip_ldr(a, b, 20, error, NULL), BD_ERR_OK);
    assert_as_the_makers("turned, 20 pixels per degree", error, &turned_20, 1e-6);
    assert_int_equal(bd_flip_ldr(a, c, BD_FLIP_PPD_DEFAULT, error, NULL), BD_ERR_OK);
    // Many features are alike on both sides: the square root of rounding.
    assert_as_the_makers("shifted", error, &shifted, 1e-4);
    expose_across(a, 0);
    expose_across(b, 1);
    struct bd_luminance_range range;
    assert_true(bd_luminance_range(a, &range));
    struct bd_flip_exposures exposures = bd_flip_exposures(range.median, range.max);
    assert_near(exposures.start, -4.490159, 1e-5);
    assert_near(exposures.stop, 2.231296, 1e-5);
    assert_int_equal(exposures.count, 7);
    assert_int_equal(bd_flip_hdr(a, b, BD_FLIP_PPD_DEFAULT, &exposures, error, NULL), BD_ERR_OK);
    assert_as_the_makers("HDR", error, &hdr, 1e-6);
    bd_image_destroy(&a);
    bd_image_destroy(&b);
    bd_image_destroy(&c);
}

static void flip_is_symmetric_and_grows(void **state)
{
    (void)state;
    struct bd_image *reference = busy(0);
    double before = 0;
    for (int i = 0; i < 4; i++) {
        struct bd_image *image = busy(0.05f * (float)i);
        double mean = flip_mean(reference, image);
        assert_near(flip_mean(image, reference), mean, 1e-6);
        if (i) assert_true(mean > before + 0.01);
        if (!i) assert_true(mean == 0);
        before = mean;
        bd_image_destroy(&image);
    }
    bd_image_destroy(&reference);
}

// A difference that the eye cannot resolve from so far away is no difference; from nearer it is.
static void flip_sees_less_from_afar(void **state)
{
    (void)state;
    static float error[SIDE * SIDE];
    struct bd_image *grey = flat(0.5f, 0.5f, 0.5f), *checks = flat(0, 0, 0);
    for (int p = 0; p < SIDE * SIDE; p++)
        for (int c = 0; c < 3; c++) checks->pixels[3 * p + c] = (p / SIDE + p) % 2 ? 0.6f : 0.4f;
    double means[3] = {0};
    static const double ppd[3] = {20, 67, 200};
    for (int i = 0; i < 3; i++) {
        assert_int_equal(bd_flip_ldr(grey, checks, ppd[i], error, NULL), BD_ERR_OK);
        for (int p = 0; p < SIDE * SIDE; p++) means[i] += (double)error[p] / (SIDE * SIDE);
    }
    assert_true(means[0] > 0.2 && means[1] < 0.01 && means[2] < 0.01);
    bd_image_destroy(&grey);
    bd_image_destroy(&checks);
}

static void hdr_flip_takes_exposures_from_the_reference(void **state)
{
    (void)state;
    // curve(x) = 0.85 at x = 2.03; brightest 64, median 0.25: eight stops apart.
    double x = bd_display_curve_inverse(0.85);
    struct bd_flip_exposures exposures = bd_flip_exposures(0.25, 64);
    assert_near(exposures.start, log2(x / 64), 1e-9);
    assert_near(exposures.stop, log2(x / 0.25), 1e-9);
    assert_int_equal(exposures.count, 8);
    // The makers' own test picture.
    assert_int_equal(bd_flip_exposures(x / exp2(0.9427), x / exp2(-12.5423)).count, 14);
    assert_int_equal(bd_flip_exposures(1, 1).count, 2);
    assert_int_equal(bd_flip_exposures(0, 0).count, 2);
    assert_int_equal(bd_flip_exposures(1e-30, 1e30).count, BD_FLIP_EXPOSURE_MAX);
}

// An error in the dark that no exposure for the highlights shows, and that the longest one does.
static void hdr_flip_looks_into_the_dark(void **state)
{
    (void)state;
    static float error[SIDE * SIDE];
    struct bd_image *reference = flat(0.01f, 0.01f, 0.01f), *image = flat(0.01f, 0.01f, 0.01f);
    for (int c = 0; c < 3; c++) {
        bd_image_at(reference, 40, 40)[c] = bd_image_at(image, 40, 40)[c] = 50;
        bd_image_at(image, 10, 10)[c] = 0.02f;
    }
    struct bd_flip_exposures bright = {log2(1 / 50.0), log2(1 / 50.0), 2};
    assert_int_equal(bd_flip_hdr(reference, image, BD_FLIP_PPD_DEFAULT, &bright, error, NULL),
                     BD_ERR_OK);
    assert_true(error[10 * SIDE + 10] < 0.05f);
    struct bd_flip_exposures all = bd_flip_exposures(0.01, 50);
    assert_int_equal(bd_flip_hdr(reference, image, BD_FLIP_PPD_DEFAULT, &all, error, NULL),
                     BD_ERR_OK);
    assert_true(error[10 * SIDE + 10] > 0.1f);
    assert_true(error[30 * SIDE + 30] == 0);
    bd_image_destroy(&reference);
    bd_image_destroy(&image);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(filters_repeat_the_edge),
        cmocka_unit_test(gaussians_sum_to_one_and_drop_what_is_nothing),
        cmocka_unit_test(the_curve_and_its_inverse),
        cmocka_unit_test(luminance_range_of_ranks),
        cmocka_unit_test(ssim_by_hand),
        cmocka_unit_test(flip_of_flat_colours),
        cmocka_unit_test(flip_is_what_its_makers_compute),
        cmocka_unit_test(flip_is_symmetric_and_grows),
        cmocka_unit_test(flip_sees_less_from_afar),
        cmocka_unit_test(hdr_flip_takes_exposures_from_the_reference),
        cmocka_unit_test(hdr_flip_looks_into_the_dark),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
