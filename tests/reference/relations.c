// What must not change the answer: threads, order, batches, estimators, power, scale; and what the
// random numbers promise (algorithms.md D13, hazards 7, 9, 46).

#include <math.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "base/pool.h"
#include "stage.h"
#include "tests/unit/cmocka_all.h"

static const double pi = 3.14159265358979323846;

static const double identity[3] = {0, 0, 0};

// A room with a block, a gloss, a lamp of each kind, something that glows, and a sky at the window
// that its missing wall is. `scale` and `power` are the powers of two that must not matter.
static struct stage *make_room(double scale, double power, const double offset[3])
{
    struct stage *s = stage_create();
    const double half = scale;
    int32_t white = stage_material(s, 0.7f), dark = stage_material(s, 0.2f);
    int32_t gloss = stage_material(s, 0.5f), glow = stage_material(s, 0.1f);
    stage_material_at(s, gloss)->roughness = 0.3f;
    stage_material_at(s, gloss)->metallic = 0.6f;
    stage_emission(s, glow, (float)(3 * power));
    const double low[3] = {-half, -half, -half}, high[3] = {half, half, half};
    const double block_low[3] = {0.1 * half, -half, -0.6 * half};
    const double block_high[3] = {0.7 * half, -0.1 * half, 0.1 * half};
    stage_box(s, white, low, high);
    s->scene->nodes[5].is_hidden = true; // the wall at +z
    stage_box(s, gloss, block_low, block_high);
    stage_sphere(s, dark, (const double[3]){-0.4 * half, -0.6 * half, 0}, 0.3 * half, 3, false);
    const double lamp[4][3] = {{-0.9 * half, 0.2 * half, -0.95 * half},
                               {-0.6 * half, 0.2 * half, -0.95 * half},
                               {-0.6 * half, 0.5 * half, -0.95 * half},
                               {-0.9 * half, 0.5 * half, -0.95 * half}};
    stage_quad(s, glow, lamp);
    double candela = power * scale * scale;
    stage_light(s, BD_LIGHT_POINT, -0.3 * half, 0.4 * half, 0.2 * half, NULL, (float)candela)
        ->range_m = (float)(2 * scale);
    stage_light(s, BD_LIGHT_SPOT, 0.5 * half, 0.9 * half, 0.5 * half, (const double[3]){-1, -0.5, -0.5},
                (float)(20 * candela));
    stage_light(s, BD_LIGHT_DIRECTIONAL, 0, 0, 0, (const double[3]){0.3, -0.4, -1}, (float)power);
    for (int k = 0; k < 3; k++) s->scene->environment.radiance[k] = (float)(0.3 * power);
    const double eye[3] = {0.2 * half, 0.1 * half, 3 * half};
    stage_camera(s, eye, (const double[3]){0, -0.1 * half, 0}, 0.7);
    s->scene->cameras[0].near_m = (float)(scale / 64);
    for (uint32_t n = 0; n < s->scene->node_count; n++)
        for (int k = 0; k < 3; k++) s->scene->nodes[n].parent_from_node.m[12 + k] += offset[k];
    return s;
}

// --- threads, order, batches --------------------------------------------------------------------

#define SIZE 24

struct picture {
    const struct stage *stage;
    uint32_t batch;
    bool backwards;
    struct bd_reference_pixel pixels[SIZE * SIZE];
};

static void trace_pixel(void *user, uint32_t i)
{
    struct picture *p = user;
    const struct bd_reference_view view = {.width_px = SIZE, .height_px = SIZE};
    struct bd_integrand integrand = bd_integrand_full;
    integrand.filter = BD_FILTER_BOX;
    uint32_t pixel = p->backwards ? SIZE * SIZE - 1 - i : i;
    for (uint32_t first = 0; first < 12; first += p->batch)
        bd_reference_trace(p->stage->reference, &integrand, &view, 42, pixel % SIZE, pixel / SIZE,
                           first, p->batch, &p->pixels[pixel]);
}

static void trace_picture(struct picture *picture, uint32_t threads, uint32_t batch, bool backwards)
{
    struct stage *stage = make_room(1, 1, identity);
    stage_finish(stage, threads);
    struct bd_pool *pool = bd_pool_create(threads);
    memset(picture, 0, sizeof *picture);
    picture->stage = stage;
    picture->batch = batch;
    picture->backwards = backwards;
    assert_int_equal(bd_pool_run(pool, SIZE * SIZE, trace_pixel, NULL, picture), BD_ERR_OK);
    bd_pool_destroy(&pool);
    stage_destroy(&stage);
}

static void threads_and_batches_change_nothing(void **state)
{
    (void)state;
    static struct picture first, other;
    trace_picture(&first, 1, 12, false);
    const uint32_t threads[] = {2, 5, 1, 5}, batches[] = {12, 12, 1, 4};
    for (int i = 0; i < 4; i++) {
        trace_picture(&other, threads[i], batches[i], i % 2);
        for (uint32_t p = 0; p < SIZE * SIZE; p++)
            assert_memory_equal(&first.pixels[p].sum, &other.pixels[p].sum, sizeof first.pixels[p].sum);
    }
    double sum = 0;
    for (uint32_t p = 0; p < SIZE * SIZE; p++) sum += first.pixels[p].sum[0][BD_PART_INDIRECT][0];
    assert_true(sum > 0);
}

// --- halves -------------------------------------------------------------------------------------

// In a sphere the indirect light of a lamp anywhere is the same everywhere: deviations of the two
// halves from it must know nothing of each other, nor of their neighbours. Without light vertices,
// which would leave little but the sphere's triangles to see.
static void halves_are_unrelated(void **state)
{
    (void)state;
    struct stage *s = stage_create();
    stage_sphere(s, stage_material(s, 0.5f), identity, 1, 5, true);
    stage_light(s, BD_LIGHT_POINT, 0.7, 0, 0, NULL, 1);
    stage_camera(s, identity, (const double[3]){0, 0, 1}, 1.5);
    stage_finish(s, 1);
    struct bd_integrand integrand = bd_integrand_full;
    integrand.lambert = true;
    integrand.bounces_max = 3;
    integrand.light_vertices = false;
    const struct bd_reference_view view = {.width_px = 64, .height_px = 64};
    static double a[64 * 64], b[64 * 64];
    double mean = 0, ab = 0, aa = 0, next = 0;
    for (uint32_t p = 0; p < 64 * 64; p++) {
        struct bd_reference_pixel pixel = {0};
        bd_reference_trace(s->reference, &integrand, &view, 3, p % 64, p / 64, 0, 16, &pixel);
        a[p] = pixel.sum[0][BD_PART_INDIRECT][0], b[p] = pixel.sum[1][BD_PART_INDIRECT][0];
        mean += (a[p] + b[p]) / (2 * 64 * 64);
    }
    for (int p = 0; p < 64 * 64; p++) {
        ab += (a[p] - mean) * (b[p] - mean);
        aa += ((a[p] - mean) * (a[p] - mean) + (b[p] - mean) * (b[p] - mean)) / 2;
        if (p) next += (a[p] - mean) * (a[p - 1] - mean);
    }
    assert_true(aa > 0);
    assert_true(fabs(ab / aa) < 4.5 / 64);
    assert_true(fabs(next / aa) < 4.5 / 64);
    stage_destroy(&s);
}

// --- estimators ---------------------------------------------------------------------------------

static void compare_estimators(struct bd_integrand integrand, double relative)
{
    struct stage *s = make_room(1, 1, identity);
    integrand.lights = BD_REFERENCE_PUNCTUAL;
    integrand.light_vertices = true;
    struct estimate with = stage_radiance(s, &integrand, 0, BD_PART_INDIRECT, 12, 1024);
    integrand.light_vertices = false;
    struct estimate without = stage_radiance(s, &integrand, 0, BD_PART_INDIRECT, 12, 1024);
    CHECK_SAME(with, without, relative);
    stage_destroy(&s);
}

static void light_vertices_change_no_mean(void **state)
{
    (void)state;
    struct bd_integrand full = bd_integrand_full, i = full;
    compare_estimators(full, 0.02);
    i.bounces_max = 1;
    compare_estimators(i, 0.02);
    i.clamp_per_m2 = 4;
    compare_estimators(i, 0.02);
    i = full;
    i.lambert = true;
    compare_estimators(i, 0.02);
    i = full;
    i.lambert_senders = true;
    i.bounces_max = 2;
    compare_estimators(i, 0.02);
    i = full;
    i.indirect_visibility = false;
    i.bounces_max = 1;
    compare_estimators(i, 0.02);
    i.bounces_max = 2;
    compare_estimators(i, 0.02);
}

// A spot-lit room is what they are for.
static void light_vertices_help(void **state)
{
    (void)state;
    double errors[2];
    for (int vertices = 0; vertices < 2; vertices++) {
        struct stage *s = stage_create();
        const double low[3] = {-1, -1, -1}, high[3] = {1, 1, 1};
        stage_box(s, stage_material(s, 0.5f), low, high);
        stage_light(s, BD_LIGHT_SPOT, 0, 0.5, 0, (const double[3]){1, 0, 0}, 10);
        struct bd_integrand one = bd_integrand_full;
        one.lambert = true;
        one.bounces_max = 1;
        one.light_vertices = vertices;
        struct estimate e =
            stage_irradiance(s, &one, BD_PART_INDIRECT, 0, -1, 0, 0, 1, 0, 8192);
        errors[vertices] = e.error / e.mean;
        stage_destroy(&s);
    }
    print_message("    deviation without %.2g %%, with %.2g %%\n", 100 * errors[0], 100 * errors[1]);
    assert_true(errors[1] < errors[0] / 3);
}

// Each kind of light alone, and all together.
static void lights_add_up(void **state)
{
    (void)state;
    struct stage *s = make_room(1, 1, identity);
    struct bd_integrand i = bd_integrand_full;
    struct estimate all = stage_radiance(s, &i, 0, BD_PART_INDIRECT, 12, 1024), sum = {0, 0};
    for (uint32_t kind = 1; kind <= 4; kind *= 2) {
        i.lights = kind;
        struct estimate e = stage_radiance(s, &i, 0, BD_PART_INDIRECT, 12, 1024);
        assert_true(e.mean > 0);
        sum.mean += e.mean;
        sum.error = sqrt(sum.error * sum.error + e.error * e.error);
    }
    CHECK_SAME(all, sum, 0.01);
    stage_destroy(&s);
}

// More lamps than are weighed at once: 40 of different power are one of their sum where they all
// hang in one place.
static void many_lamps_are_one(void **state)
{
    (void)state;
    struct estimate results[2];
    for (int many = 0; many < 2; many++) {
        struct stage *s = stage_create();
        const double low[3] = {-1, -1, -1}, high[3] = {1, 1, 1};
        stage_box(s, stage_material(s, 0.5f), low, high);
        for (int l = 0; l < (many ? 40 : 1); l++)
            stage_light(s, BD_LIGHT_POINT, 0.4, 0.2, 0, NULL, many ? (float)(l + 1) : 820);
        results[many] = stage_irradiance(s, &bd_integrand_full, BD_PART_INDIRECT, 0, -1, 0, 0, 1, 0,
                                         16384);
        CHECK(stage_irradiance(s, &bd_integrand_full, BD_PART_DIRECT, 0.4, -1, 0, 0, 1, 0, 64),
              820 / 1.44, 1e-5);
        stage_destroy(&s);
    }
    CHECK_SAME(results[0], results[1], 0.02);
}

// --- D13 ----------------------------------------------------------------------------------------

// Fluence at `at` (the integral of radiance over all directions) of a lamp at `lamp`: four times
// the mean irradiance over all orientations.
static struct estimate fluence(const double lamp[3], const double at[3])
{
    struct stage *s = stage_create();
    const double low[3] = {-1, -1, -1}, high[3] = {1, 0.7, 1.5};
    const double block_low[3] = {-0.2, -1, -0.2}, block_high[3] = {0.3, 0.4, 0.1};
    stage_box(s, stage_material(s, 0.8f), low, high);
    stage_box(s, stage_material(s, 0.3f), block_low, block_high);
    stage_material_at(s, 1)->roughness = 0.4f;
    stage_light(s, BD_LIGHT_POINT, lamp[0], lamp[1], lamp[2], NULL, 1);
    struct bd_integrand integrand = bd_integrand_full;
    integrand.bounces_max = 3;
    struct estimate sum = {0, 0};
    const int count = 300; // a Fibonacci lattice
    for (int i = 0; i < count; i++) {
        double y = 1 - (2 * i + 1.0) / count, r = sqrt(1 - y * y), phi = i * pi * (3 - sqrt(5));
        struct estimate e =
            stage_irradiance(s, &integrand, BD_PART_INDIRECT, at[0], at[1], at[2], r * cos(phi), y,
                             r * sin(phi), 256);
        sum.mean += 4 * e.mean / count;
        sum.error += 16 * e.error * e.error / count / count;
    }
    stage_destroy(&s);
    return (struct estimate){sum.mean, sqrt(sum.error)};
}

static void lamp_and_sensor_swap(void **state)
{
    (void)state;
    const double a[3] = {-0.7, -0.6, 0.5}, b[3] = {0.6, 0.3, -0.7};
    struct estimate forth = fluence(a, b), back = fluence(b, a);
    CHECK_SAME(forth, back, 0.01);
}

// --- scale, power, place ------------------------------------------------------------------------

static void trace_at(double scale, double power, const double offset[3],
                     struct bd_reference_pixel pixels[64])
{
    struct stage *s = make_room(scale, power, offset);
    const struct bd_reference_view view = {.width_px = 8, .height_px = 8};
    stage_finish(s, 1);
    memset(pixels, 0, 64 * sizeof *pixels);
    for (uint32_t p = 0; p < 64; p++)
        bd_reference_trace(s->reference, &bd_integrand_full, &view, 5, p % 8, p / 8, 0, 8,
                           &pixels[p]);
    stage_destroy(&s);
}

static void powers_of_two_change_no_bit(void **state)
{
    (void)state;
    const int scales[] = {0, 0, 0, -13, 20, 7}, powers[] = {1, 30, -30, 0, 0, -20};
    static struct bd_reference_pixel base[64], other[64];
    trace_at(1, 1, identity, base);
    for (int i = 0; i < 6; i++) {
        trace_at(ldexp(1, scales[i]), ldexp(1, powers[i]), identity, other);
        for (int p = 0; p < 64; p++)
            for (int part = 0; part < BD_PART_COUNT; part++)
                for (int k = 0; k < 3; k++) {
                    double value = ldexp(other[p].sum[0][part][k], -powers[i]);
                    if (value != base[p].sum[0][part][k])
                        fail_msg("scale 2^%d, power 2^%d, pixel %d, part %d: %.17g and %.17g",
                                 scales[i], powers[i], p, part, value, base[p].sum[0][part][k]);
                }
    }
}

// Ten million sizes away only the last digits of positions differ: a few samples may take another
// way, the mean does not.
static void places_change_little(void **state)
{
    (void)state;
    static struct bd_reference_pixel base[64], other[64];
    const double offset[3] = {1e7, -2e7, 1.5e7};
    trace_at(1, 1, identity, base);
    trace_at(1, 1, offset, other);
    int alike = 0;
    for (int p = 0; p < 64; p++) {
        double a = base[p].sum[0][BD_PART_DIRECT][0], b = other[p].sum[0][BD_PART_DIRECT][0];
        alike += fabs(a - b) <= 1e-4 * fabs(a);
    }
    print_message("    %d of 64 pixels alike\n", alike);
    assert_true(alike >= 60);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(threads_and_batches_change_nothing),
        cmocka_unit_test(halves_are_unrelated),
        cmocka_unit_test(light_vertices_change_no_mean),
        cmocka_unit_test(light_vertices_help),
        cmocka_unit_test(lights_add_up),
        cmocka_unit_test(many_lamps_are_one),
        cmocka_unit_test(lamp_and_sensor_swap),
        cmocka_unit_test(powers_of_two_change_no_bit),
        cmocka_unit_test(places_change_little),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
