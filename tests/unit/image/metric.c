// The debiased error on synthetic pictures whose truth and noise are known.

#include <math.h>
#include <stdlib.h>

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

static struct bd_metric measure(double bias, double image_sigma, double reference_sigma)
{
    struct bd_image *image = picture(bias, image_sigma);
    struct bd_image *a = picture(0, reference_sigma), *b = picture(0, reference_sigma);
    struct bd_metric metric;
    assert_int_equal(bd_metric_measure(image, a, b, &metric, NULL), BD_ERR_OK);
    bd_image_destroy(&image);
    bd_image_destroy(&a);
    bd_image_destroy(&b);
    return metric;
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
    struct bd_metric metric = measure(0.02, 0, 0.2);
    double want = 0.02 * sqrt(truth_mean(2)) / truth_mean(1);
    // Standard error of mean d: sqrt(2 error^2 sigma^2 + sigma^4) / sqrt(196608) = 1e-4; of d's
    // root at 0.02: 1e-4 / (2 * 0.02) = 0.0025.
    assert_true(fabs(metric.rel_rmse - want) < 3 * 0.0025);
    assert_true(fabs(metric.signed_error - 0.02) < 0.002);
    assert_true(fabs(metric.noise_floor - 0.2 / sqrt(2) / truth_mean(1)) < 0.002);
    assert_int_equal(metric.sample_count, SIDE * SIDE * 3);
}

static void debiased_square_is_unbiased(void **state)
{
    (void)state;
    rng_state = 2;
    double sum = 0;
    for (int round = 0; round < 16; round++) sum += measure(0, 0, 0.3).mean_square;
    // Truth 0; standard error 0.09 / sqrt(16 * 196608) = 5.1e-5. Biased it would be 0.045.
    assert_true(fabs(sum / 16) < 4 * 5.1e-5);
}

static void noise_of_the_image_is_error(void **state)
{
    (void)state;
    rng_state = 3;
    struct bd_metric metric = measure(0, 0.1, 0.01);
    assert_true(fabs(metric.rel_rmse - 0.1 / truth_mean(1)) < 0.002);
}

static void exact_figures_of_a_tiny_case(void **state)
{
    (void)state;
    struct bd_image *image = bd_image_create(2, 1, 1), *a = bd_image_create(2, 1, 1),
                    *b = bd_image_create(2, 1, 1);
    image->pixels[0] = 3, image->pixels[1] = 1;
    a->pixels[0] = 2, a->pixels[1] = 1;
    b->pixels[0] = 1, b->pixels[1] = 0;
    struct bd_metric metric;
    assert_int_equal(bd_metric_measure(image, a, b, &metric, NULL), BD_ERR_OK);
    // d = 1*2, 0*1; R = 1.5, 0.5, mean 1; (A-B)^2/4 = 1/4 both; I - R = 1.5, 0.5.
    assert_true(metric.mean_square == 1 && metric.rel_rmse == 1);
    assert_true(metric.signed_error == 1 && metric.noise_floor == 0.5 && metric.max_abs == 1.5);
    image->pixels[1] = NAN;
    assert_int_equal(bd_metric_measure(image, a, b, &metric, NULL), BD_ERR_OK);
    assert_int_equal(metric.nonfinite_count, 1);
    assert_int_equal(metric.sample_count, 1);
    assert_true(metric.mean_square == 2);
    bd_image_destroy(&image);
    bd_image_destroy(&a);
    bd_image_destroy(&b);
}

static void shapes_must_match(void **state)
{
    (void)state;
    struct bd_image *a = bd_image_create(2, 2, 3), *b = bd_image_create(2, 3, 3);
    struct bd_metric metric;
    struct bd_fault fault;
    assert_int_equal(bd_metric_measure(a, b, b, &metric, &fault), BD_ERR_USAGE);
    assert_string_equal(fault.field, "image");
    assert_int_equal(bd_metric_measure(a, a, b, &metric, &fault), BD_ERR_USAGE);
    assert_string_equal(fault.field, "reference");
    bd_image_destroy(&a);
    bd_image_destroy(&b);
}

static void black_against_black_is_no_error(void **state)
{
    (void)state;
    struct bd_image *black = bd_image_create(2, 2, 3), *lit = bd_image_create(2, 2, 3);
    lit->pixels[0] = 1;
    struct bd_metric metric;
    assert_int_equal(bd_metric_measure(black, black, black, &metric, NULL), BD_ERR_OK);
    assert_true(metric.rel_rmse == 0 && metric.signed_error == 0);
    assert_int_equal(bd_metric_measure(lit, black, black, &metric, NULL), BD_ERR_OK);
    assert_true(isinf(metric.rel_rmse) && isinf(metric.signed_error));
    bd_image_destroy(&black);
    bd_image_destroy(&lit);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(reference_noise_drops_out),
        cmocka_unit_test(debiased_square_is_unbiased),
        cmocka_unit_test(noise_of_the_image_is_error),
        cmocka_unit_test(exact_figures_of_a_tiny_case),
        cmocka_unit_test(shapes_must_match),
        cmocka_unit_test(black_against_black_is_no_error),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
