// The filter of sampled light: less noise, the same mean, nothing across an edge, nothing where
// there is no noise, and the same at any scale.

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/hash.h"
#include "image/light_filter.h"
#include "tests/unit/cmocka_all.h"

#define WIDTH  48
#define HEIGHT 40

struct picture {
    struct bd_image *half[2], *albedo, *normal, *depth, *out, *truth;
};

static struct bd_image *image(uint32_t channels)
{
    struct bd_image *made = bd_image_create(WIDTH, HEIGHT, channels);
    assert_non_null(made);
    return made;
}

// Two numbers that are normally distributed, by place.
static double normal_number(uint64_t index)
{
    const double pi = 3.14159265358979323846;
    const uint64_t a = bd_hash64(&index, sizeof index, 1), b = bd_hash64(&index, sizeof index, 2);
    const double u = ((double)(a >> 11) + 1) * 0x1p-53, v = (double)(b >> 11) * 0x1p-53;
    return sqrt(-2 * log(u)) * cos(2 * pi * v);
}

// Slanted planes of two normals side by side, each with light that changes slowly, and a checkered
// albedo over both.
static struct picture make(double noise, double scale)
{
    struct picture p = {{image(3), image(3)}, image(3), image(3), image(1), image(3), image(3)};
    for (uint32_t y = 0; y < HEIGHT; y++)
        for (uint32_t x = 0; x < WIDTH; x++) {
            const bool is_right = x >= WIDTH / 2;
            const double fallen = (is_right ? 1.4 : 1) + 0.002 * x + 0.001 * y;
            bd_image_at(p.normal, x, y)[is_right ? 0 : 2] = 1;
            *bd_image_at(p.depth, x, y) = (float)(1 / (0.2 + 0.004 * x + 0.002 * y));
            for (uint32_t c = 0; c < 3; c++) {
                const double albedo = (x / 4 + y / 4) % 2 ? 0.8 : 0.2;
                const double light = fallen * albedo * scale;
                bd_image_at(p.albedo, x, y)[c] = (float)albedo;
                bd_image_at(p.truth, x, y)[c] = (float)light;
                for (uint32_t h = 0; h < 2; h++) {
                    const uint64_t index = ((uint64_t)(y * WIDTH + x) * 3 + c) * 2 + h;
                    const double sample = light * (1 + noise * normal_number(index));
                    bd_image_at(p.half[h], x, y)[c] = (float)sample;
                }
            }
        }
    for (size_t i = 0; i < (size_t)3 * WIDTH * HEIGHT; i++)
        p.out->pixels[i] = 0.5f * (p.half[0]->pixels[i] + p.half[1]->pixels[i]);
    return p;
}

static void drop(struct picture *p)
{
    bd_image_destroy(&p->half[0]), bd_image_destroy(&p->half[1]);
    bd_image_destroy(&p->albedo), bd_image_destroy(&p->normal), bd_image_destroy(&p->depth);
    bd_image_destroy(&p->out), bd_image_destroy(&p->truth);
}

static struct bd_light_filter_inputs inputs_of(const struct picture *p)
{
    return (struct bd_light_filter_inputs){.half = {p->half[0], p->half[1]},
                                           .albedo = p->albedo,
                                           .normal = p->normal,
                                           .depth = p->depth};
}

static void run(struct picture *p)
{
    const struct bd_light_filter_inputs inputs = inputs_of(p);
    struct bd_err_detail detail = {0};
    if (bd_light_filter_run(&inputs, p->out, &detail)) fail_msg("%s", detail.message);
}

static double mean_of(const struct bd_image *a)
{
    double sum = 0;
    for (size_t i = 0; i < (size_t)3 * WIDTH * HEIGHT; i++) sum += (double)a->pixels[i];
    return sum / (3 * WIDTH * HEIGHT);
}

// Of the mean.
static double difference(const struct bd_image *a, const struct bd_image *b)
{
    double sum = 0;
    for (size_t i = 0; i < (size_t)3 * WIDTH * HEIGHT; i++) {
        const double d = (double)a->pixels[i] - (double)b->pixels[i];
        sum += d * d;
    }
    return sqrt(sum / (3 * WIDTH * HEIGHT)) / mean_of(b);
}

static void noise_goes_and_the_mean_stays(void **state)
{
    (void)state;
    struct picture p = make(0.5, 1);
    const double before = difference(p.out, p.truth), mean = mean_of(p.out);
    run(&p);
    assert_true(before > 0.3);
    assert_true(difference(p.out, p.truth) < 0.2 * before);
    assert_true(fabs(mean_of(p.out) / mean - 1) < 0.01);
    drop(&p);
}

// How far the light of a column is off what falls there, all rows together.
static double column_off(const struct picture *p, uint32_t x)
{
    double sum = 0, expected = 0;
    for (uint32_t y = 0; y < HEIGHT; y++)
        for (uint32_t c = 0; c < 3; c++) {
            const double albedo = (double)bd_image_at(p->albedo, x, y)[c];
            sum += (double)bd_image_at(p->out, x, y)[c] / albedo;
            expected += (double)bd_image_at(p->truth, x, y)[c] / albedo;
        }
    return fabs(sum / expected - 1);
}

// Light of one side is 1.4 times that of the other, less than its noise: what keeps the two apart
// is where they are. Mixed, they would be 15 % off beside the edge.
static void nothing_crosses_an_edge(void **state)
{
    (void)state;
    struct picture p = make(0.5, 1);
    run(&p);
    assert_true(column_off(&p, WIDTH / 2 - 1) < 0.05);
    assert_true(column_off(&p, WIDTH / 2) < 0.05);
    drop(&p);
}

// Both face the same way, and one lies behind the other.
static void nothing_crosses_a_step(void **state)
{
    (void)state;
    struct picture p = make(0.5, 1);
    for (uint32_t y = 0; y < HEIGHT; y++)
        for (uint32_t x = 0; x < WIDTH; x++) {
            bd_image_at(p.normal, x, y)[0] = 0, bd_image_at(p.normal, x, y)[2] = 1;
            if (x >= WIDTH / 2) *bd_image_at(p.depth, x, y) *= 1.1f;
        }
    run(&p);
    assert_true(column_off(&p, WIDTH / 2 - 1) < 0.05);
    assert_true(column_off(&p, WIDTH / 2) < 0.05);
    drop(&p);
}

static void without_noise_nothing_is_done(void **state)
{
    (void)state;
    struct picture p = make(0, 1);
    const struct bd_light_filter_inputs inputs = inputs_of(&p);
    struct bd_light_filter *filter;
    assert_int_equal(bd_light_filter_create(&inputs, &filter, NULL), BD_ERR_OK);
    assert_false(bd_light_filter_is_needed(filter));
    assert_int_equal(bd_light_filter_pass_count(filter), 0);
    bd_light_filter_destroy(&filter);
    run(&p);
    assert_memory_equal(p.out->pixels, p.truth->pixels, 3 * WIDTH * HEIGHT * sizeof(float));
    drop(&p);
}

// What it changes goes to nothing with the noise, and never makes it worse.
static void it_fades_with_the_noise(void **state)
{
    (void)state;
    for (double noise = 0.1; noise > 1e-4; noise /= 4) {
        struct picture p = make(noise, 1), as_it_was = make(noise, 1);
        run(&p);
        assert_true(difference(p.out, as_it_was.out) < 1.2 * noise);
        assert_true(difference(p.out, p.truth) < difference(as_it_was.out, p.truth));
        drop(&p), drop(&as_it_was);
    }
}

// Where a small part of it counts, little is smoothed, and less is taken to be blurred.
static void it_smooths_less_where_a_part_of_the_noise_counts(void **state)
{
    (void)state;
    double changed[4], blur[4];
    for (int i = 0; i < 4; i++) {
        struct picture p = make(0.2, 1), as_it_was = make(0.2, 1);
        struct bd_light_filter_inputs inputs = inputs_of(&p);
        inputs.variance_part = i ? powf(0.01f, (float)(i - 1)) : 0; // none is all
        struct bd_image *doubt = bd_image_create(WIDTH, HEIGHT, 4);
        struct bd_light_filter *filter;
        assert_int_equal(bd_light_filter_create(&inputs, &filter, NULL), BD_ERR_OK);
        for (uint32_t pass = 0; pass < bd_light_filter_pass_count(filter); pass++)
            for (uint32_t y = 0; y < HEIGHT; y++) bd_light_filter_row(filter, pass, y);
        bd_light_filter_store_doubt(filter, doubt);
        bd_light_filter_store(filter, p.out);
        bd_light_filter_destroy(&filter);
        changed[i] = difference(p.out, as_it_was.out), blur[i] = 0;
        for (uint32_t j = 0; j < WIDTH * HEIGHT; j++) blur[i] += (double)doubt->pixels[4 * j + 3];
        bd_image_destroy(&doubt);
        drop(&p), drop(&as_it_was);
    }
    assert_true(changed[1] == changed[0] && blur[1] == blur[0]);
    assert_true(changed[2] < .9 * changed[1] && changed[3] < .4 * changed[1]);
    assert_true(blur[2] < .01 * blur[1] && blur[3] < 1e-4 * blur[1]);
}

// How far columns from `first` on are from what they were, summed up.
static double changed_from(const struct picture *p, const struct picture *before, uint32_t first)
{
    double sum = 0;
    for (uint32_t y = 0; y < HEIGHT; y++)
        for (uint32_t x = first; x < first + WIDTH / 2; x++)
            sum += fabs((double)bd_image_at(p->out, x, y)[0] -
                        (double)bd_image_at(before->out, x, y)[0]);
    return sum;
}

// Of the left side all of the noise, of the right one a little: neither knows of the other.
static void a_part_may_be_each_pixels_own(void **state)
{
    (void)state;
    struct picture p = make(0.2, 1), whole = make(0.2, 1), as_it_was = make(0.2, 1);
    struct bd_light_filter_inputs inputs = inputs_of(&p);
    struct bd_image *parts = image(1);
    for (uint32_t y = 0; y < HEIGHT; y++)
        for (uint32_t x = 0; x < WIDTH; x++) *bd_image_at(parts, x, y) = x < WIDTH / 2 ? 1 : 1e-4f;
    inputs.parts = parts;
    assert_int_equal(bd_light_filter_run(&inputs, p.out, NULL), BD_ERR_OK);
    run(&whole);
    assert_true(changed_from(&p, &whole, 0) == 0);
    assert_true(changed_from(&whole, &as_it_was, WIDTH / 2) > 10);
    assert_true(changed_from(&p, &as_it_was, WIDTH / 2) <
                0.4 * changed_from(&whole, &as_it_was, WIDTH / 2));
    bd_image_destroy(&parts);
    drop(&p), drop(&whole), drop(&as_it_was);
}

// A power of two: to the last bit.
static void how_bright_it_is_changes_no_digit(void **state)
{
    (void)state;
    struct picture one = make(0.5, 1);
    run(&one);
    const double scales[] = {0x1p-90, 0x1p+90};
    for (size_t s = 0; s < 2; s++) {
        struct picture other = make(0.5, scales[s]);
        run(&other);
        for (size_t i = 0; i < (size_t)3 * WIDTH * HEIGHT; i++)
            assert_true((double)other.out->pixels[i] == (double)one.out->pixels[i] * scales[s]);
        drop(&other);
    }
    drop(&one);
}

// Light that is no number, a place without a surface, black all over: they stay, and harm nobody.
static void what_cannot_be_filtered_stays(void **state)
{
    (void)state;
    struct picture p = make(0.5, 1);
    bd_image_at(p.half[0], 10, 10)[1] = NAN;
    bd_image_at(p.half[1], 12, 10)[0] = INFINITY;
    bd_image_at(p.half[0], 14, 10)[2] = 3e38f;
    memset(bd_image_at(p.normal, 16, 10), 0, 3 * sizeof(float));
    *bd_image_at(p.depth, 18, 10) = 0;
    for (uint32_t x = 10; x <= 18; x += 2) bd_image_at(p.out, x, 10)[0] = -7;
    run(&p);
    for (uint32_t x = 10; x <= 18; x += 2) assert_true(bd_image_at(p.out, x, 10)[0] == -7);
    for (uint32_t x = 11; x < 18; x += 2) {
        const double own = (double)bd_image_at(p.truth, x, 10)[0];
        assert_true((double)bd_image_at(p.out, x, 10)[0] > 0.5 * own);
        assert_true((double)bd_image_at(p.out, x, 10)[0] < 2 * own);
    }
    drop(&p);
    struct picture black = make(0, 0);
    run(&black);
    assert_true(mean_of(black.out) == 0);
    drop(&black);
}

// From the last to the first, as threads might.
static void the_order_of_rows_changes_no_byte(void **state)
{
    (void)state;
    struct picture p = make(0.5, 1), again = make(0.5, 1);
    run(&p);
    const struct bd_light_filter_inputs inputs = inputs_of(&again);
    struct bd_light_filter *filter;
    assert_int_equal(bd_light_filter_create(&inputs, &filter, NULL), BD_ERR_OK);
    for (uint32_t pass = 0; pass < bd_light_filter_pass_count(filter); pass++)
        for (uint32_t y = HEIGHT; y-- > 0;) bd_light_filter_row(filter, pass, y);
    bd_light_filter_store(filter, again.out);
    bd_light_filter_destroy(&filter);
    assert_memory_equal(p.out->pixels, again.out->pixels, 3 * WIDTH * HEIGHT * sizeof(float));
    drop(&p), drop(&again);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(noise_goes_and_the_mean_stays),
        cmocka_unit_test(nothing_crosses_an_edge),
        cmocka_unit_test(nothing_crosses_a_step),
        cmocka_unit_test(without_noise_nothing_is_done),
        cmocka_unit_test(it_fades_with_the_noise),
        cmocka_unit_test(it_smooths_less_where_a_part_of_the_noise_counts),
        cmocka_unit_test(a_part_may_be_each_pixels_own),
        cmocka_unit_test(how_bright_it_is_changes_no_digit),
        cmocka_unit_test(what_cannot_be_filtered_stays),
        cmocka_unit_test(the_order_of_rows_changes_no_byte),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
