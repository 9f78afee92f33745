// Spot checks of pictures whose error is known: what is estimated, and how often the interval holds
// it. Pictures and truth are made up here; a "path" is the truth times noise with a long tail.

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "reference/check.h"
#include "reference/check_cache.h"
#include "reference/check_estimate.h"
#include "reference/check_plan.h"
#include "tests/unit/cmocka_all.h"

#define SIDE  64u
#define COUNT (SIDE * SIDE)
#define RARE  (1.0 / 256)

struct picture {
    struct bd_image *beauty, *indirect, *depth, *truth;
    double noise; // relative, of one sample
    uint64_t seed;
    uint64_t samples_traced;
    uint32_t loops_until_stop; // 0 = never
    bool rare;                 // what the frame lacks is met by one sample in 1 / RARE
};

// --- numbers --------------------------------------------------------------------------------

static double uniform(uint64_t seed, uint64_t i)
{
    uint64_t z = (seed * 1000003 + i + 1) * UINT64_C(0x9e3779b97f4a7c15);
    z = (z ^ z >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ z >> 27) * UINT64_C(0x94d049bb133111eb);
    return ((double)((z ^ z >> 31) >> 11) + 0.5) / 9007199254740992.0;
}

static double normal(uint64_t seed, uint64_t i)
{
    return sqrt(-2 * log(uniform(seed, 2 * i))) * cos(6.283185307 * uniform(seed, 2 * i + 1));
}

// --- pictures -------------------------------------------------------------------------------

enum kind {
    KIND_SMOOTH, // off by a slowly varying share
    KIND_GRAIN,  // by a share of each pixel's own, with a long tail
    KIND_EDGES,  // only where the depth jumps, which the frame shows
    KIND_HIDDEN, // at a few pixels that look like all others
    KIND_SPIKES, // fireflies in the frame's indirect light
    KIND_COUNT,
};

static double error_at(enum kind kind, uint64_t seed, uint32_t x, uint32_t y)
{
    uint32_t i = y * SIDE + x;
    switch (kind) {
    case KIND_SMOOTH:
        return 0.1 + 0.1 * sin(x * 0.1) * cos(y * 0.07);
    case KIND_GRAIN:
        return 0.02 * normal(seed, i) * exp(0.8 * normal(seed + 1, i));
    case KIND_EDGES:
        return x % 16 == 0 ? 0.4 * normal(seed, i) : 0.005 * normal(seed, i);
    case KIND_HIDDEN:
        return uniform(seed, i) < 0.01 ? 3 : 0.001 * normal(seed + 1, i);
    case KIND_SPIKES:
        return uniform(seed, i) < 0.005 ? 2 * exp(normal(seed + 1, i)) : 0.01 * normal(seed + 1, i);
    case KIND_COUNT:
        break;
    }
    return 0;
}

// The indirect light of the picture carries the error, as it does in frames.
static struct picture make_picture(enum kind kind, uint64_t seed)
{
    struct picture p = {bd_image_create(SIDE, SIDE, 4),
                        bd_image_create(SIDE, SIDE, 3),
                        bd_image_create(SIDE, SIDE, 1),
                        bd_image_create(SIDE, SIDE, 3),
                        0.5,
                        seed,
                        0,
                        0,
                        false};
    for (uint32_t y = 0; y < SIDE; y++) {
        for (uint32_t x = 0; x < SIDE; x++) {
            double light = kind == KIND_HIDDEN ? 1 : 1 + 0.8 * sin(x * 0.2) * sin(y * 0.15);
            double error = error_at(kind, seed, x, y);
            *bd_image_at(p.depth, x, y) = 1 + (float)(x / 16);
            for (int c = 0; c < 3; c++) {
                double truth = light * (1 - 0.2 * c);
                bd_image_at(p.truth, x, y)[c] = (float)truth;
                // Hidden: the frame is even, the truth is not.
                if (kind == KIND_HIDDEN)
                    bd_image_at(p.truth, x, y)[c] = (float)(truth * (1 + error));
                double image = kind == KIND_HIDDEN ? truth : truth * (1 + error);
                bd_image_at(p.beauty, x, y)[c] = (float)image;
                bd_image_at(p.indirect, x, y)[c] = (float)(image * 0.5);
            }
        }
    }
    return p;
}

static void free_picture(struct picture *p)
{
    bd_image_destroy(&p->beauty);
    bd_image_destroy(&p->indirect);
    bd_image_destroy(&p->depth);
    bd_image_destroy(&p->truth);
}

// The figure of the whole picture, without noise.
static double full_error(const struct picture *p)
{
    double square = 0, sum = 0;
    for (uint32_t i = 0; i < COUNT; i++) {
        for (int c = 0; c < 3; c++) {
            double truth = (double)p->truth->pixels[3 * i + (uint32_t)c];
            double off = (double)p->beauty->pixels[4 * i + (uint32_t)c] - truth;
            square += off * off;
            sum += truth;
        }
    }
    return sqrt(square / (3.0 * COUNT)) / (sum / (3.0 * COUNT));
}

// --- tracing --------------------------------------------------------------------------------

// A sample is truth x (1 + noise (e - 1)) with e exponential: right in the mean, skewed.
static void trace(void *user, uint32_t x_px, uint32_t y_px, uint32_t first, uint32_t count,
                  struct bd_reference_pixel *pixel)
{
    struct picture *p = user;
    const float *truth = bd_image_at(p->truth, x_px, y_px);
    for (uint32_t half = 0; half < 2; half++) {
        for (uint32_t i = first; i < first + count; i++) {
            uint64_t name = (((uint64_t)(y_px * SIDE + x_px) << 16 | i) << 1) | half;
            double factor = 1 + p->noise * (-log(uniform(p->seed + 77, name)) - 1);
            bool lucky = uniform(p->seed + 99, name) < RARE;
            for (int c = 0; c < 3; c++) {
                double value = (double)truth[c] * factor;
                if (p->rare) {
                    double shown = (double)bd_image_at(p->beauty, x_px, y_px)[c];
                    value = shown + (lucky ? ((double)truth[c] - shown) / RARE : 0);
                }
                pixel->sum[half][BD_PART_DIRECT][c] += 0.5 * value;
                pixel->sum[half][BD_PART_INDIRECT][c] += 0.5 * value;
                pixel->beauty_square_sum[c] += value * value;
            }
        }
        pixel->sample_count[half] += count;
    }
}

static enum bd_err loop(void *user, uint32_t count, void (*work)(void *work_user, uint32_t i),
                        void *work_user)
{
    struct picture *p = user;
    if (p->loops_until_stop && --p->loops_until_stop == 0) return BD_ERR_CANCELLED;
    for (uint32_t i = count; i-- > 0;) work(work_user, i); // in whatever order
    return BD_ERR_OK;
}

static struct bd_check_result check(struct picture *p, uint32_t pixel_count, uint64_t seed,
                                    struct bd_check_cache *cache)
{
    const struct bd_check_frame frame = {
        .beauty = p->beauty, .indirect = p->indirect, .depth = p->depth};
    struct bd_check_options options = bd_check_options_default;
    options.pixel_count = pixel_count;
    options.seed = seed;
    const struct bd_check_tracer tracer = {trace, loop, p, NULL};
    struct bd_check_result result;
    struct bd_err_detail detail = {0};
    if (bd_check_run(&frame, &options, &tracer, cache, &result, &detail))
        fail_msg("%s", detail.message);
    return result;
}

// --- tests ----------------------------------------------------------------------------------

// Over many choices of pixels the debiased squared error comes out right in the mean, noise and
// all: within four standard deviations of the mean, as the spread of the runs has it.
static void test_unbiased(void **state)
{
    (void)state;
    const int runs = 60;
    for (int kind = 0; kind < KIND_COUNT; kind++) {
        struct picture p = make_picture((enum kind)kind, 5);
        double sum = 0, square_sum = 0, full = full_error(&p);
        for (int run = 0; run < runs; run++) {
            p.seed = 100 + (uint64_t)run;
            struct bd_check_result result = check(&p, 128, 900 + (uint64_t)run, NULL);
            double squared = result.mean_square / (result.mean_reference * result.mean_reference);
            sum += squared;
            square_sum += squared * squared;
        }
        double mean = sum / runs;
        double deviation = sqrt(fmax(square_sum / runs - mean * mean, 0) / (runs - 1));
        printf("kind %d: mean %.6f full %.6f +- %.6f\n", kind, mean, full * full, deviation);
        assert_true(fabs(mean - full * full) < 4 * deviation + 1e-9);
        free_picture(&p);
    }
}

static void test_interval_holds_the_error(void **state)
{
    (void)state;
    static const uint32_t counts[] = {128, 256, 512};
    int held = 0, cases = 0, flagged = 0, all = 0;
    for (int kind = 0; kind < KIND_COUNT; kind++) {
        for (uint64_t seed = 0; seed < 14; seed++) {
            for (int n = 0; n < 3; n++) {
                struct picture p = make_picture((enum kind)kind, 31 + 7 * seed);
                struct bd_check_result result = check(&p, counts[n], seed, NULL);
                double full = full_error(&p);
                all++;
                flagged += result.tail;
                if (result.tail) assert_true(isinf(result.high));
                free_picture(&p);
                if (result.tail) continue;
                cases++;
                held += result.low <= full && full <= result.high;
            }
        }
    }
    printf("%d of %d unflagged held, %d of %d flagged\n", held, cases, flagged, all);
    assert_true(held >= 0.9 * cases);
    assert_true(flagged <= 0.25 * all);
}

// A handful of pixels that nothing in the frame gives away carry the error: a first look finds
// them.
static void test_hidden_errors_are_found(void **state)
{
    (void)state;
    int held = 0, flagged = 0;
    for (uint64_t seed = 0; seed < 10; seed++) {
        struct picture p = make_picture(KIND_HIDDEN, 5);
        double full = full_error(&p);
        struct bd_check_result result = check(&p, 128, seed, NULL);
        flagged += result.tail;
        held += !result.tail && result.low <= full && full <= result.high;
        free_picture(&p);
    }
    printf("%d of 10 held, %d flagged\n", held, flagged);
    assert_true(flagged <= 3);
    assert_true(held >= 9 - flagged);
}

// The same by light that a single sample hardly ever meets.
static void test_tail_is_flagged(void **state)
{
    (void)state;
    int flagged = 0;
    for (uint64_t seed = 0; seed < 10; seed++) {
        struct picture p = make_picture(KIND_HIDDEN, 5);
        p.rare = true;
        struct bd_check_result result = check(&p, 128, seed, NULL);
        // One per cent of the pixels: a choice that met few of them must say so.
        if (result.tail) {
            flagged++;
            assert_true(isinf(result.high));
            assert_true(isfinite(result.low));
        }
        free_picture(&p);
    }
    assert_true(flagged >= 3);
}

// The picture is the truth: what is left is noise, and the interval says how little it can be.
static void test_no_error(void **state)
{
    (void)state;
    struct picture p = make_picture(KIND_SMOOTH, 5);
    for (uint32_t i = 0; i < 3 * COUNT; i++)
        p.beauty->pixels[i / 3 * 4 + i % 3] = p.truth->pixels[i];
    for (uint64_t seed = 0; seed < 10; seed++) {
        struct bd_check_result result = check(&p, 256, seed, NULL);
        assert_true(result.low == 0);
        assert_true(result.value < 0.02);
        assert_true(result.high > 0);
        assert_true(result.high < 0.05);
        assert_true(result.value <= result.high);
    }
    free_picture(&p);
}

static void test_black(void **state)
{
    (void)state;
    struct picture p = make_picture(KIND_SMOOTH, 5);
    memset(p.beauty->pixels, 0, 4 * COUNT * sizeof(float));
    memset(p.indirect->pixels, 0, 3 * COUNT * sizeof(float));
    struct bd_check_result result = check(&p, 256, 1, NULL);
    double full = full_error(&p); // all of the light is missing
    assert_true(result.low <= full && full <= result.high && !result.black);
    memset(p.truth->pixels, 0, 3 * COUNT * sizeof(float));
    result = check(&p, 256, 1, NULL);
    assert_true(result.black && result.value == 0 && result.low == 0 && result.high == 0);
    p.beauty->pixels[0] = 1; // the brightest pixel of all: certain to be traced
    result = check(&p, 256, 1, NULL);
    // No part of nothing, but an error of so many cd/m^2.
    assert_true(result.black);
    assert_true(fabs(result.value - sqrt(1.0 / 3 / COUNT)) < 1e-9);
    assert_true(result.low <= result.value && result.value <= result.high && isfinite(result.high));
    free_picture(&p);
}

// As many pixels as the picture has: nothing is left to chance but the reference's noise.
static void test_whole_picture(void **state)
{
    (void)state;
    struct picture p = make_picture(KIND_HIDDEN, 5);
    p.noise = 0.01;
    struct bd_check_result result = check(&p, 2 * COUNT, 3, NULL);
    assert_int_equal(result.pixel_count, COUNT);
    assert_false(result.tail);
    assert_true(fabs(result.value / full_error(&p) - 1) < 1e-3);
    assert_true(result.low <= full_error(&p) && full_error(&p) <= result.high);
    assert_true(result.high < 1.01 * result.low);
    free_picture(&p);
}

static void test_pixels_that_are_not_finite(void **state)
{
    (void)state;
    struct picture p = make_picture(KIND_SMOOTH, 5);
    double full = full_error(&p);
    for (uint32_t i = 0; i < COUNT; i += 97) p.beauty->pixels[4 * i + 1] = NAN;
    for (uint32_t i = 50; i < COUNT; i += 97) p.indirect->pixels[3 * i + 1] = INFINITY;
    struct bd_check_result result = check(&p, 512, 3, NULL);
    assert_true(fabs(result.value / full - 1) < 0.1);
    assert_true(isfinite(result.high));
    for (uint32_t i = 0; i < COUNT; i++) p.beauty->pixels[4 * i] = NAN;
    result = check(&p, 512, 3, NULL);
    assert_int_equal(result.pixel_count, 0);
    assert_true(isinf(result.high));
    free_picture(&p);
}

// What the cache holds saves samples and changes no figure, also after a check of another frame.
static void test_cache(void **state)
{
    (void)state;
    struct picture p = make_picture(KIND_GRAIN, 5), other = make_picture(KIND_GRAIN, 5);
    for (uint32_t i = 0; i < 4 * COUNT; i++) other.beauty->pixels[i] *= 1.02f;
    struct bd_check_cache *cache = bd_check_cache_create(4096);
    struct bd_check_result alone = check(&p, 256, 3, NULL);
    struct bd_check_result first = check(&other, 256, 3, cache);
    struct bd_check_result second = check(&p, 256, 3, cache);
    struct bd_check_result third = check(&p, 256, 3, cache);
    assert_true(second.value == alone.value);
    assert_true(second.low == alone.low && second.high == alone.high);
    assert_true(second.sample_count < first.sample_count / 2);
    assert_int_equal(third.sample_count, 0);
    assert_true(bd_check_cache_count(cache) >= 256);
    bd_check_cache_destroy(&cache);
    free_picture(&p);
    free_picture(&other);
}

static void test_cache_is_bounded(void **state)
{
    (void)state;
    struct bd_check_cache *cache = bd_check_cache_create(100);
    for (uint32_t i = 0; i < 1000; i++) {
        const struct bd_check_pixel pixel = {.index = i * 37, .pilot_variance = i};
        bd_check_cache_put(cache, &pixel);
        assert_true(bd_check_cache_count(cache) <= 100);
        assert_true(bd_check_cache_get(cache, i * 37)->pilot_variance == i);
    }
    assert_null(bd_check_cache_get(cache, 1));
    bd_check_cache_destroy(&cache);
}

static void test_stops(void **state)
{
    (void)state;
    struct picture p = make_picture(KIND_GRAIN, 5);
    p.loops_until_stop = 2;
    const struct bd_check_frame frame = {.beauty = p.beauty};
    const struct bd_check_tracer tracer = {trace, loop, &p, NULL};
    struct bd_check_result result;
    struct bd_err_detail detail = {0};
    assert_int_equal(
        bd_check_run(&frame, &bd_check_options_default, &tracer, NULL, &result, &detail),
        BD_ERR_CANCELLED);
    free_picture(&p);
}

static void test_refuses(void **state)
{
    (void)state;
    struct picture p = make_picture(KIND_GRAIN, 5);
    struct bd_check_frame frame = {.beauty = p.beauty};
    struct bd_check_options options = bd_check_options_default;
    const struct bd_check_tracer tracer = {trace, loop, &p, NULL};
    struct bd_check_result result;
    struct bd_err_detail detail = {0};
    options.pixel_count = 15;
    assert_int_equal(bd_check_run(&frame, &options, &tracer, NULL, &result, &detail), BD_ERR_USAGE);
    assert_string_equal(detail.field, "check");
    options.pixel_count = 16;
    frame.depth = p.indirect;
    assert_int_equal(bd_check_run(&frame, &options, &tracer, NULL, &result, &detail), BD_ERR_USAGE);
    assert_string_equal(detail.field, "layers");
    free_picture(&p);
}

// A plan: every pixel in one stratum, strata without gaps, samples without repetition.
static void test_plan(void **state)
{
    (void)state;
    for (uint32_t n = 16; n <= 2048; n *= 2) {
        struct picture p = make_picture(KIND_SPIKES, n);
        const struct bd_check_frame frame = {.beauty = p.beauty, .indirect = p.indirect};
        struct bd_check_plan plan;
        struct bd_err_detail detail;
        assert_int_equal(bd_check_plan_make(&frame, n, 3, &plan, &detail), BD_ERR_OK);
        assert_int_equal(plan.sample_count, n);
        uint64_t pixels = 0;
        uint32_t samples = 0;
        for (uint32_t s = 0; s < plan.stratum_count; s++) {
            assert_int_equal(plan.strata[s].first, samples);
            assert_true(plan.strata[s].sample_count <= plan.strata[s].pixel_count);
            assert_true(plan.strata[s].sample_count >= 1);
            pixels += plan.strata[s].pixel_count;
            samples += plan.strata[s].sample_count;
        }
        assert_int_equal(pixels, COUNT);
        assert_int_equal(samples, n);
        uint8_t seen[COUNT] = {0};
        for (uint32_t i = 0; i < n; i++) assert_int_equal(seen[plan.samples[i].index]++, 0);
        bd_check_plan_finish(&plan);
        free_picture(&p);
    }
}

// Radiances whose squares no float holds: a lamp of 1e26 cd is allowed.
static void test_extreme_radiance(void **state)
{
    (void)state;
    for (uint32_t pixel_count = 16; pixel_count <= 512; pixel_count *= 2) {
        struct picture p = make_picture(KIND_SMOOTH, 5);
        p.noise = 0;
        for (uint32_t i = 0; i < COUNT; i++)
            for (int c = 0; c < 3; c++) {
                p.truth->pixels[3 * i + (uint32_t)c] *= 1e22f;
                p.beauty->pixels[4 * i + (uint32_t)c] *= i % 64 == 5 ? 3e22f : 1e22f;
            }
        struct bd_check_result result = check(&p, pixel_count, 3, NULL);
        assert_true(fabs(result.value / full_error(&p) - 1) < 0.2);
        free_picture(&p);
    }
}

static void test_student_t(void **state)
{
    (void)state;
    static const double table[][2] = {{1, 12.706}, {2, 4.303},  {4, 2.776},  {5, 2.571},
                                      {7, 2.365},  {10, 2.228}, {30, 2.042}, {1e9, 1.960}};
    for (size_t i = 0; i < sizeof table / sizeof table[0]; i++)
        assert_true(fabs(bd_check_student_t(table[i][0]) - table[i][1]) < 2e-3);
    assert_true(bd_check_student_t(INFINITY) < 1.9601);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_unbiased),
        cmocka_unit_test(test_interval_holds_the_error),
        cmocka_unit_test(test_hidden_errors_are_found),
        cmocka_unit_test(test_tail_is_flagged),
        cmocka_unit_test(test_no_error),
        cmocka_unit_test(test_black),
        cmocka_unit_test(test_whole_picture),
        cmocka_unit_test(test_pixels_that_are_not_finite),
        cmocka_unit_test(test_cache),
        cmocka_unit_test(test_cache_is_bounded),
        cmocka_unit_test(test_stops),
        cmocka_unit_test(test_refuses),
        cmocka_unit_test(test_plan),
        cmocka_unit_test(test_extreme_radiance),
        cmocka_unit_test(test_student_t),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
