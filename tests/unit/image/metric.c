// The metrics on synthetic pictures whose truth and noise are known, and on tiny ones by hand.

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "image/metric.h"
#include "tests/unit/cmocka_all.h"

#define SIDE 256

static uint64_t rng_state;

static double uniform(void)
{
    rng_state = rng_state * 6364136223846793005u + 1442695040888963407u;
    return (double)(rng_state >> 11) * 0x1p-53;
}

// Variance 1, mean 0: a sum of twelve uniform numbers.
static double noise(void)
{
    double sum = -6;
    for (int i = 0; i < 12; i++) sum += uniform();
    return sum;
}

static double truth(size_t i)
{
    return 1.0 + 0.5 * sin((double)i * 0.01);
}

// truth * (1 + bias) + sigma * noise
static struct bd_image *picture(double bias, double sigma)
{
    struct bd_image *image = bd_image_create(SIDE, SIDE, 3);
    assert_non_null(image);
    for (size_t i = 0; i < (size_t)SIDE * SIDE * 3; i++)
        image->pixels[i] = (float)(truth(i) * (1 + bias) + sigma * noise());
    return image;
}

static struct bd_metrics of(struct bd_image *a, struct bd_image *b, struct bd_image *i1,
                            struct bd_image *i2)
{
    struct bd_metric_input input = {.reference = {a, b}, .image = {i1, i2}};
    struct bd_metrics metrics;
    assert_int_equal(bd_metrics_measure(&input, &metrics, NULL), BD_ERR_OK);
    return metrics;
}

static double value(const struct bd_metrics *metrics, enum bd_metric metric)
{
    return metrics->figures[metric].value;
}

static void assert_near(double got, double want, double tolerance)
{
    if (!(fabs(got - want) <= tolerance)) fail_msg("%.9g is not %.9g", got, want);
}

static struct bd_metrics measure(double bias, double image_sigma, double reference_sigma)
{
    struct bd_image *image = picture(bias, image_sigma);
    struct bd_image *a = picture(0, reference_sigma), *b = picture(0, reference_sigma);
    struct bd_metrics metrics = of(a, b, image, image);
    bd_image_destroy(&image);
    bd_image_destroy(&a);
    bd_image_destroy(&b);
    return metrics;
}

static double truth_mean(double power)
{
    double sum = 0;
    for (size_t i = 0; i < (size_t)SIDE * SIDE * 3; i++) sum += pow(truth(i), power);
    return sum / (SIDE * SIDE * 3);
}

// A reference ten times as noisy as the error is large still tells the error: the naive RMSE
// against R would report sqrt(0.02^2 + 0.2^2 / 2) = 14 %.
static void reference_noise_drops_out(void **state)
{
    (void)state;
    rng_state = 1;
    struct bd_metrics metrics = measure(0.02, 0, 0.2);
    // Standard error of mean d: sqrt(2 error^2 sigma^2 + sigma^4) / sqrt(196608) = 1e-4; of d's
    // root at 0.02: 1e-4 / (2 * 0.02) = 0.0025.
    assert_near(value(&metrics, BD_METRIC_REL_RMSE), 0.02 * sqrt(truth_mean(2)) / truth_mean(1),
                3 * 0.0025);
    assert_near(value(&metrics, BD_METRIC_SIGNED_ERROR), 0.02, 0.002);
    assert_near(value(&metrics, BD_METRIC_NOISE_FLOOR), 0.2 / sqrt(2) / truth_mean(1), 0.002);
    assert_int_equal(metrics.pixel_count, SIDE * SIDE);
    assert_true(metrics.reference_debiased && !metrics.image_debiased);
}

static void debiased_square_is_unbiased(void **state)
{
    (void)state;
    rng_state = 2;
    double sum = 0;
    for (int round = 0; round < 16; round++) {
        struct bd_metrics metrics = measure(0, 0, 0.3);
        sum += value(&metrics, BD_METRIC_MEAN_SQUARE);
    }
    // Truth 0; standard error 0.09 / sqrt(16 * 196608) = 5.1e-5. Biased it would be 0.045.
    assert_near(sum / 16, 0, 4 * 5.1e-5);
}

static void noise_of_the_image_is_error(void **state)
{
    (void)state;
    rng_state = 3;
    struct bd_metrics metrics = measure(0, 0.1, 0.01);
    assert_near(value(&metrics, BD_METRIC_REL_RMSE), 0.1 / truth_mean(1), 0.002);
}

// A reference against a reference: only what both means differ by is left.
static void halves_of_the_image_take_its_noise_out(void **state)
{
    (void)state;
    rng_state = 4;
    struct bd_image *i1 = picture(0.05, 0.2), *i2 = picture(0.05, 0.2);
    struct bd_image *a = picture(0, 0.3), *b = picture(0, 0.3);
    struct bd_metrics both = of(a, b, i1, i2);
    struct bd_metrics naive = of(a, a, i1, i1);
    double want = 0.05 * sqrt(truth_mean(2)) / truth_mean(1);
    assert_near(value(&both, BD_METRIC_REL_RMSE), want, 0.005);
    // sqrt(0.05^2 + 0.2^2 + 0.3^2) and more: what counting both noises says.
    assert_true(value(&naive, BD_METRIC_REL_RMSE) > 0.3);
    // I - R has the noise of both: sqrt((0.2^2 + 0.3^2) / 2).
    assert_near(value(&both, BD_METRIC_NOISE_FLOOR), sqrt(0.065) / truth_mean(1), 0.002);
    assert_int_equal(naive.states[BD_METRIC_NOISE_FLOOR], BD_METRIC_ABSENT);
    bd_image_destroy(&i1);
    bd_image_destroy(&i2);
    bd_image_destroy(&a);
    bd_image_destroy(&b);
}

// The floors of mape and smape tell what the noise alone would make of them: a perfect picture.
static void floors_are_what_a_perfect_picture_gets(void **state)
{
    (void)state;
    rng_state = 5;
    struct bd_metrics metrics = measure(0, 0, 0.05);
    assert_near(value(&metrics, BD_METRIC_MAPE) / value(&metrics, BD_METRIC_MAPE_FLOOR), 1, 0.01);
    assert_near(value(&metrics, BD_METRIC_SMAPE) / value(&metrics, BD_METRIC_SMAPE_FLOOR), 1, 0.01);
    // E|N(0, s)| = 0.798 s, s = 0.05 / sqrt(2), over R, whose inverse has
    // a mean above 1.
    assert_true(value(&metrics, BD_METRIC_MAPE_FLOOR) > 0.798 * 0.05 / sqrt(2));
}

static struct bd_image *row(uint32_t width_px, uint32_t channel_count, const float *samples)
{
    struct bd_image *image = bd_image_create(width_px, 1, channel_count);
    assert_non_null(image);
    for (uint32_t i = 0; i < width_px * channel_count; i++) image->pixels[i] = samples[i];
    return image;
}

static void exact_figures_of_a_tiny_case(void **state)
{
    (void)state;
    struct bd_image *image = row(2, 1, (float[]){3, 1}), *a = row(2, 1, (float[]){2, 1}),
                    *b = row(2, 1, (float[]){1, 0});
    struct bd_metrics metrics = of(a, b, image, image);
    // d = 1*2, 0*1; R = 1.5, 0.5, mean 1; n = 1/2 both; I - R = 1.5, 0.5.
    assert_near(value(&metrics, BD_METRIC_MEAN_SQUARE), 1, 0);
    assert_near(value(&metrics, BD_METRIC_REL_RMSE), 1, 0);
    assert_near(value(&metrics, BD_METRIC_RMSE_MAX), 1 / 1.5, 1e-15);
    assert_near(value(&metrics, BD_METRIC_REL_MSE), (2 / (2.25 + 1e-4) + 0) / 2, 1e-15);
    assert_near(value(&metrics, BD_METRIC_MAPE), (1.5 / 1.51 + 0.5 / 0.51) / 2, 1e-15);
    assert_near(value(&metrics, BD_METRIC_MAPE_FLOOR), (0.5 / 1.51 + 0.5 / 0.51) / 2, 1e-15);
    assert_near(value(&metrics, BD_METRIC_SMAPE), (3 / 4.51 + 1 / 1.51) / 2, 1e-15);
    assert_near(value(&metrics, BD_METRIC_SMAPE_FLOOR), (1 / 4.51 + 1 / 1.51) / 2, 1e-15);
    assert_near(value(&metrics, BD_METRIC_SIGNED_ERROR), 1, 0);
    assert_near(value(&metrics, BD_METRIC_NOISE_FLOOR), 0.5, 0);
    assert_near(value(&metrics, BD_METRIC_OVER_HALF), 1, 0);
    assert_near(value(&metrics, BD_METRIC_P99), 1.5 / 1.51, 1e-6);
    assert_near(value(&metrics, BD_METRIC_MAX_REL), 1.5 / 1.51, 1e-15);
    assert_near(value(&metrics, BD_METRIC_MAX_ABS), 1.5, 0);
    assert_int_equal(metrics.states[BD_METRIC_MAX_ABS], BD_METRIC_VALUE_ONLY);
    assert_int_equal(metrics.states[BD_METRIC_PSNR], BD_METRIC_ABSENT);
    bd_image_destroy(&image);
    bd_image_destroy(&a);
    bd_image_destroy(&b);
}

// A dark sample is divided by the floor, not by itself: clip R at 1 % of the mean.
static void relative_errors_have_a_floor(void **state)
{
    (void)state;
    struct bd_image *image = row(2, 1, (float[]){2, 1}), *r = row(2, 1, (float[]){2, 0});
    struct bd_metrics metrics = of(r, r, image, image);
    assert_near(value(&metrics, BD_METRIC_REL_MSE), 0.5 * 1 / (1e-4 + 1e-4), 1e-9);
    assert_near(value(&metrics, BD_METRIC_MAPE), 0.5 * 1 / 0.01, 1e-12);
    bd_image_destroy(&image);
    bd_image_destroy(&r);
}

static void a_pixel_is_half_off_by_the_mean_of_its_channels(void **state)
{
    (void)state;
    // Relative errors of 0.49, 0.5 and 0.99 over R + 1 %: one above a half.
    struct bd_image *r = row(3, 3, (float[]){1, 1, 1, 1, 1, 1, 1, 1, 1});
    struct bd_image *image = row(3, 3, (float[]){1.49f, 1.49f, 1.49f, 2.5f, 1, 1, 0, 0, 0});
    struct bd_metrics metrics = of(r, r, image, image);
    assert_near(value(&metrics, BD_METRIC_OVER_HALF), 1.0 / 3, 1e-15);
    assert_near(value(&metrics, BD_METRIC_MAX_REL), 1 / 1.01, 1e-7);
    bd_image_destroy(&image);
    bd_image_destroy(&r);
}

static void nonfinite_pixels_are_counted_and_left_out(void **state)
{
    (void)state;
    struct bd_image *image = row(2, 3, (float[]){3, 3, 3, 1, NAN, 1});
    struct bd_image *r = row(2, 3, (float[]){2, 2, 2, 100, 100, 100});
    struct bd_metrics metrics = of(r, r, image, image);
    assert_near(value(&metrics, BD_METRIC_NONFINITE), 1, 0);
    assert_int_equal(metrics.pixel_count, 1);
    assert_near(value(&metrics, BD_METRIC_REL_RMSE), 0.5, 0);
    assert_near(value(&metrics, BD_METRIC_MEAN_REFERENCE), 2, 0);
    assert_near(value(&metrics, BD_METRIC_MAPE), 1 / 2.02, 1e-15); // its floor too is of that pixel
    // One of the image's halves is enough, whichever it is.
    struct bd_image *other = row(2, 3, (float[]){3, 3, INFINITY, 1, 1, 1});
    metrics = of(r, r, image, other);
    assert_near(value(&metrics, BD_METRIC_NONFINITE), 2, 0);
    metrics = of(r, r, other, image);
    assert_near(value(&metrics, BD_METRIC_NONFINITE), 2, 0);
    bd_image_destroy(&other);
    image->pixels[0] = INFINITY;
    metrics = of(r, r, image, image);
    assert_near(value(&metrics, BD_METRIC_NONFINITE), 2, 0);
    assert_int_equal(metrics.pixel_count, 0);
    assert_int_equal(metrics.states[BD_METRIC_REL_RMSE], BD_METRIC_ABSENT);
    bd_image_destroy(&image);
    bd_image_destroy(&r);
}

// The filters of SSIM and FLIP reach neighbours: a hole must not be an error around it.
static void holes_do_not_leak_into_their_neighbours(void **state)
{
    (void)state;
    struct bd_image *image = bd_image_create(32, 32, 3), *r = bd_image_create(32, 32, 3);
    for (int i = 0; i < 32 * 32 * 3; i++) image->pixels[i] = r->pixels[i] = (float)(i % 7);
    image->pixels[3 * (16 * 32 + 16)] = NAN;
    struct bd_metric_input input = {
        .reference = {r, r}, .image = {image, image}, .display = true, .ppd = BD_FLIP_PPD_DEFAULT};
    struct bd_metrics metrics;
    assert_int_equal(bd_metrics_measure(&input, &metrics, NULL), BD_ERR_OK);
    assert_near(value(&metrics, BD_METRIC_FLIP), 0, 0);
    assert_near(value(&metrics, BD_METRIC_HDR_FLIP), 0, 0);
    assert_near(value(&metrics, BD_METRIC_SSIM), 1, 0);
    assert_true(isinf(value(&metrics, BD_METRIC_PSNR)));
    assert_int_equal(metrics.states[BD_METRIC_PSNR], BD_METRIC_WITH_INTERVAL);
    bd_image_destroy(&image);
    bd_image_destroy(&r);
}

static void a_reference_that_is_not_finite_is_refused(void **state)
{
    (void)state;
    struct bd_image *image = bd_image_create(3, 2, 1), *r = bd_image_create(3, 2, 1);
    r->pixels[5] = NAN;
    struct bd_metric_input input = {.reference = {image, r}, .image = {image, image}};
    struct bd_metrics metrics;
    struct bd_err_detail detail;
    assert_int_equal(bd_metrics_measure(&input, &metrics, &detail), BD_ERR_BAD_INPUT);
    assert_non_null(strstr(detail.message, "2,1"));
    bd_image_destroy(&image);
    bd_image_destroy(&r);
}

static void shapes_must_match(void **state)
{
    (void)state;
    struct bd_image *a = bd_image_create(2, 2, 3), *b = bd_image_create(2, 3, 3);
    struct bd_metric_input inputs[] = {
        {.reference = {b, b}, .image = {a, a}},
        {.reference = {a, b}, .image = {a, a}},
        {.reference = {a, a}, .image = {a, b}},
    };
    static const char *const fields[] = {"image", "reference", "image"};
    for (int i = 0; i < 3; i++) {
        struct bd_metrics metrics;
        struct bd_err_detail detail;
        assert_int_equal(bd_metrics_measure(&inputs[i], &metrics, &detail), BD_ERR_USAGE);
        assert_string_equal(detail.field, fields[i]);
    }
    bd_image_destroy(&a);
    bd_image_destroy(&b);
}

static void black_against_black_is_no_error(void **state)
{
    (void)state;
    struct bd_image *black = bd_image_create(2, 2, 3), *lit = bd_image_create(2, 2, 3);
    lit->pixels[0] = 1;
    struct bd_metrics metrics = of(black, black, black, black);
    for (int i = 0; i < BD_METRIC_COUNT; i++)
        if (metrics.states[i] != BD_METRIC_ABSENT)
            assert_near(value(&metrics, (enum bd_metric)i), 0, 0);
    metrics = of(black, black, lit, lit);
    assert_true(isinf(value(&metrics, BD_METRIC_REL_RMSE)));
    assert_true(isinf(value(&metrics, BD_METRIC_SIGNED_ERROR)));
    assert_true(isinf(value(&metrics, BD_METRIC_MAPE)));
    bd_image_destroy(&black);
    bd_image_destroy(&lit);
}

// One grey against another: the display's values are known, and SSIM's window sees no structure,
// so that only its term of means is left.
static void figures_of_the_display_by_hand(void **state)
{
    (void)state;
    struct bd_image *r = bd_image_create(32, 32, 3), *image = bd_image_create(32, 32, 3);
    for (int i = 0; i < 32 * 32 * 3; i++) {
        r->pixels[i] = 8; // exposed to 1
        image->pixels[i] = 4;
    }
    struct bd_metric_input input = {
        .reference = {r, r}, .image = {image, image}, .display = true, .ppd = BD_FLIP_PPD_DEFAULT};
    struct bd_metrics metrics;
    assert_int_equal(bd_metrics_measure(&input, &metrics, NULL), BD_ERR_OK);
    assert_near(metrics.display_stops, -3, 1e-6);
    // (0.9036 x + 0.018) x / ((0.8748 x + 0.354) x + 0.14) at 1 and 0.5, then sRGB.
    double one = 1.055 * pow(0.9216 / 1.3688, 1 / 2.4) - 0.055;
    double half = 1.055 * pow(0.2349 / 0.5357, 1 / 2.4) - 0.055;
    assert_near(value(&metrics, BD_METRIC_PSNR), -20 * log10(one - half), 1e-4);
    double ssim = (2 * one * half + 1e-4) / (one * one + half * half + 1e-4);
    assert_near(value(&metrics, BD_METRIC_SSIM), ssim, 1e-4);
    bd_image_destroy(&r);
    bd_image_destroy(&image);
}

static void names_go_both_ways(void **state)
{
    (void)state;
    for (int i = 0; i < BD_METRIC_COUNT; i++) {
        enum bd_metric back = BD_METRIC_COUNT;
        assert_true(bd_metric_from_name(bd_metric_name((enum bd_metric)i), &back));
        assert_int_equal(back, i);
    }
    enum bd_metric none;
    assert_false(bd_metric_from_name("rmse", &none));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(reference_noise_drops_out),
        cmocka_unit_test(debiased_square_is_unbiased),
        cmocka_unit_test(noise_of_the_image_is_error),
        cmocka_unit_test(halves_of_the_image_take_its_noise_out),
        cmocka_unit_test(floors_are_what_a_perfect_picture_gets),
        cmocka_unit_test(exact_figures_of_a_tiny_case),
        cmocka_unit_test(relative_errors_have_a_floor),
        cmocka_unit_test(a_pixel_is_half_off_by_the_mean_of_its_channels),
        cmocka_unit_test(nonfinite_pixels_are_counted_and_left_out),
        cmocka_unit_test(holes_do_not_leak_into_their_neighbours),
        cmocka_unit_test(a_reference_that_is_not_finite_is_refused),
        cmocka_unit_test(shapes_must_match),
        cmocka_unit_test(black_against_black_is_no_error),
        cmocka_unit_test(figures_of_the_display_by_hand),
        cmocka_unit_test(names_go_both_ways),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
