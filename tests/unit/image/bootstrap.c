// Intervals: what they hold, and how often they hold the truth.

#include <math.h>
#include <stdlib.h>

#include "image/bootstrap.h"
#include "image/metric.h"
#include "tests/unit/cmocka_all.h"

static uint64_t rng_state;

static double uniform(void)
{
    rng_state = rng_state * 6364136223846793005u + 1442695040888963407u;
    return (double)(rng_state >> 11) * 0x1p-53;
}

static double noise(void)
{
    double sum = -6;
    for (int i = 0; i < 12; i++) sum += uniform();
    return sum;
}

static void small_pictures_get_small_tiles(void **state)
{
    (void)state;
    static const struct {
        uint32_t width_px, height_px, tile_px;
        size_t count;
    } cases[] = {{1024, 768, 16, 3072}, {128, 128, 16, 64}, {127, 100, 8, 208},
                 {64, 64, 8, 64},       {16, 16, 2, 64},    {3, 2, 1, 6}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct bd_tiles tiles = bd_tiles_of(cases[i].width_px, cases[i].height_px);
        assert_int_equal(tiles.tile_px, cases[i].tile_px);
        assert_int_equal(bd_tiles_count(&tiles), cases[i].count);
        assert_int_equal(bd_tiles_at(&tiles, cases[i].width_px - 1, cases[i].height_px - 1),
                         cases[i].count - 1);
    }
}

static void mean(const double *sums, const void *user, double *figures)
{
    (void)user;
    figures[0] = sums[0] > 0 ? sums[1] / sums[0] : 0;
}

static const struct bd_statistics mean_statistics = {2, 1, mean, NULL};

// The textbook's interval of a mean of n values of variance 1: +-1.96 / sqrt(n).
static void interval_of_a_mean(void **state)
{
    (void)state;
    enum { COUNT = 400 };
    static double sums[COUNT][2];
    rng_state = 7;
    double total = 0;
    for (int i = 0; i < COUNT; i++) {
        sums[i][0] = 1;
        total += sums[i][1] = 5 + noise();
    }
    struct bd_figure figure, again;
    assert_int_equal(bd_bootstrap(&mean_statistics, &sums[0][0], COUNT, &figure, NULL), 0);
    assert_int_equal(bd_bootstrap(&mean_statistics, &sums[0][0], COUNT, &again, NULL), 0);
    assert_memory_equal(&figure, &again, sizeof figure);
    assert_true(fabs(figure.value - total / COUNT) < 1e-12);
    assert_true(fabs(figure.high - figure.value - 1.96 / 20) < 0.012);
    assert_true(fabs(figure.value - figure.low - 1.96 / 20) < 0.012);
}

static void what_never_varies_has_no_width(void **state)
{
    (void)state;
    double sums[8][2];
    for (int i = 0; i < 8; i++) sums[i][0] = 1, sums[i][1] = 3;
    struct bd_figure figure;
    assert_int_equal(bd_bootstrap(&mean_statistics, &sums[0][0], 8, &figure, NULL), 0);
    assert_true(figure.value == 3 && figure.low == 3 && figure.high == 3);
    assert_int_equal(bd_bootstrap(&mean_statistics, &sums[0][0], 1, &figure, NULL), 0);
    assert_true(figure.value == 3 && figure.low == 3 && figure.high == 3);
}

static void quantiles_are_the_nearest_ranks(void **state)
{
    (void)state;
    enum { COUNT = 1000 };
    static struct bd_tiled_value values[COUNT];
    static const double levels[] = {0.5, 0.99, 0.999};
    for (uint32_t i = 0; i < COUNT; i++)
        values[i] =
            (struct bd_tiled_value){(float)(i * 7 % COUNT + 1), (i * 2654435761u >> 16) % 50};
    struct bd_figure figures[3];
    assert_int_equal(bd_bootstrap_quantiles(values, COUNT, 50, levels, 3, figures, NULL), 0);
    assert_true(figures[0].value == 500 && figures[1].value == 990 && figures[2].value == 999);
    // Of 1000 values, the median's rank has a standard deviation of 16.
    assert_true(figures[0].low > 500 - 70 && figures[0].low < 500 - 5);
    assert_true(figures[0].high < 500 + 70 && figures[0].high > 500 + 5);
}

enum { SIDE = 64, PIXELS = SIDE * SIDE, CASES = 200 };

struct pictures {
    struct bd_image *a, *b, *image;
};

// Truth 1, an error of 0.04 (1 + spread g) that stays the same over 8 x 8 pixels, and noise in the
// reference that is larger than it.
static void draw_case(const struct pictures *pictures, double spread)
{
    double errors[SIDE / 8][SIDE / 8];
    for (int y = 0; y < SIDE / 8; y++)
        for (int x = 0; x < SIDE / 8; x++) errors[y][x] = 0.04 * (1 + spread * noise());
    for (int p = 0; p < PIXELS; p++) {
        pictures->image->pixels[p] = (float)(1 + errors[p / SIDE / 8][p % SIDE / 8]);
        pictures->a->pixels[p] = (float)(1 + 0.1 * noise());
        pictures->b->pixels[p] = (float)(1 + 0.1 * noise());
    }
}

static int covered_of(double spread)
{
    struct pictures pictures = {bd_image_create(SIDE, SIDE, 1), bd_image_create(SIDE, SIDE, 1),
                                bd_image_create(SIDE, SIDE, 1)};
    struct bd_metric_input input = {.reference = {pictures.a, pictures.b},
                                    .image = {pictures.image, pictures.image}};
    double truth = 0.04 * sqrt(1 + spread * spread);
    int covered = 0;
    for (int i = 0; i < CASES; i++) {
        struct bd_metrics metrics;
        draw_case(&pictures, spread);
        assert_int_equal(bd_metrics_measure(&input, &metrics, NULL), BD_ERR_OK);
        struct bd_figure figure = metrics.figures[BD_METRIC_REL_RMSE];
        assert_true(figure.low <= figure.value && figure.value <= figure.high);
        covered += figure.low <= truth && truth <= figure.high;
    }
    bd_image_destroy(&pictures.a);
    bd_image_destroy(&pictures.b);
    bd_image_destroy(&pictures.image);
    print_message("spread %g: %d of %d\n", spread, covered, CASES);
    return covered;
}

// 95 % of 200 are 190, with a standard deviation of 3; too wide is as wrong as too narrow. With 64
// tiles the bootstrap is a little short: of 3000 cases, 93.7 % and 93.8 %.
static void intervals_hold_the_truth_as_often_as_they_say(void **state)
{
    (void)state;
    rng_state = 11;
    static const double spreads[] = {0, 1};
    for (int i = 0; i < 2; i++) {
        int covered = covered_of(spreads[i]);
        assert_in_range(covered, CASES * 90 / 100, CASES * 98 / 100);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(small_pictures_get_small_tiles),
        cmocka_unit_test(interval_of_a_mean),
        cmocka_unit_test(what_never_varies_has_no_width),
        cmocka_unit_test(quantiles_are_the_nearest_ranks),
        cmocka_unit_test(intervals_hold_the_truth_as_often_as_they_say),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
