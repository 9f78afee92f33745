// Points in maps of what is seen (pass/native/project.c, pass/project_points.h): the same bits from
// every width; counts that are exact; and a room of points, as it looks from within.

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "kernel/projected_point.h"
#include "lights/microbuffer.h"
#include "lights/sequence.h"
#include "pass/point_counts.h"
#include "pass/project_points.h"
#include "tests/unit/cmocka_all.h"

#define POINTS 16384u
#define SIDE   32u

static enum bd_err go_on(void *user)
{
    (void)user;
    return BD_ERR_OK;
}

static void cluster(struct bd_point_clusters *clusters, const struct bd_surface_points *points)
{
    struct bd_err_detail detail;
    assert_int_equal(bd_point_clusters_init(clusters, points, go_on, NULL, &detail), BD_ERR_OK);
}

// Evenly over a sphere about the origin, facing inwards (Fibonacci).
static void make_sphere(struct bd_point_clusters *clusters, float radius)
{
    struct bd_surface_points points = {.count = POINTS,
                                       .area = 4 * F_PI * radius * radius / POINTS,
                                       .points = calloc(POINTS, sizeof *points.points)};
    assert_non_null(points.points);
    for (uint32_t i = 0; i < POINTS; i++) {
        const float turn = 2.399963f * (float)i, z = 1 - (2 * (float)i + 1) / POINTS;
        const float across = sqrtf(1 - z * z);
        const f3 way = f3_of(across * cosf(turn), across * sinf(turn), z);
        points.points[i].position = f3_scale(way, radius);
        points.points[i].normal = f3_scale(way, -1);
        points.points[i].number = bd_stirred(i);
    }
    cluster(clusters, &points);
    free(points.points);
}

static struct bd_projected *look(const struct bd_native_loops *loops,
                                 const struct bd_point_clusters *clusters,
                                 enum bd_projection projection, bool as_printed, f3 from,
                                 uint32_t chance)
{
    const struct bd_projector projector = {.loops = loops,
                                           .points = clusters,
                                           .explore = 2,
                                           .exploit = 2048,
                                           .side = SIDE,
                                           .projection = projection,
                                           .as_printed = as_printed};
    const struct bd_native_place place = bd_projected_place(from, f3_of(0, .6f, .8f), chance);
    struct bd_projected *seen = malloc(sizeof *seen);
    struct bd_point_cut cut;
    assert_non_null(seen);
    bd_point_clusters_cut(clusters, 512, NULL, &cut);
    bd_project_points(&projector, &cut, &place, chance, seen);
    return seen;
}

static void every_width_has_the_same_bits(void **state)
{
    (void)state;
    struct bd_point_clusters clusters;
    const char *width;
    uint32_t compared = 0;
    make_sphere(&clusters, .5f);
    for (uint32_t chance = 0; chance < 20; chance++) {
        const f3 from = f3_of(.02f * (float)chance, -.1f, .2f);
        struct bd_projected *first = look(bd_native_loops_at(0, &width), &clusters,
                                          BD_PROJECTION_IMPORTANCE, chance % 2, from, chance);
        for (uint32_t i = 0; bd_native_loops_at(i, &width) || width; i++) {
            const struct bd_native_loops *loops = bd_native_loops_at(i, &width);
            if (!loops) continue;
            struct bd_projected *other =
                look(loops, &clusters, BD_PROJECTION_IMPORTANCE, chance % 2, from, chance);
            assert_memory_equal(first->point, other->point, SIDE * SIDE * sizeof *first->point);
            compared++;
            free(other);
        }
        free(first);
    }
    assert_true(compared >= 20);
    bd_point_clusters_finish(&clusters);
}

// Of the weights of texels that see something from its front.
static double seen_part(const struct bd_projected *seen)
{
    struct bd_microbuffer map;
    struct bd_err_detail detail;
    double sum = 0;
    assert_int_equal(bd_microbuffer_init(&map, SIDE, &detail), BD_ERR_OK);
    for (uint32_t t = 0; t < SIDE * SIDE; t++)
        if (seen->point[t] != BD_SEES_NOTHING && seen->point[t] % 2 == 0)
            sum += (double)map.weight[t].z;
    bd_microbuffer_finish(&map);
    return sum / M_PI;
}

// White walls all round: all of the hemisphere is white (algorithms.md D16); of some points nearly.
static void a_furnace_is_white(void **state)
{
    (void)state;
    const f3 from[] = {{0, 0, 0}, {.2f, .1f, .1f}, {0, -.29f, -.39f}, {.4f, 0, 0}};
    struct bd_point_clusters clusters;
    double mean = 0;
    make_sphere(&clusters, .5f);
    for (size_t i = 0; i < sizeof from / sizeof *from; i++) {
        struct bd_projected *all =
            look(bd_native_loops(), &clusters, BD_PROJECTION_ALL, false, from[i], (uint32_t)i);
        struct bd_projected *some = look(bd_native_loops(), &clusters, BD_PROJECTION_IMPORTANCE,
                                         false, from[i], (uint32_t)i);
        struct bd_projected *printed = look(bd_native_loops(), &clusters, BD_PROJECTION_IMPORTANCE,
                                            true, from[i], (uint32_t)i);
        assert_float_equal(seen_part(all), 1, .005);
        // Where there are holes they stay.
        assert_true(seen_part(printed) > .8 && seen_part(printed) < seen_part(some));
        free(printed);
        assert_float_equal(seen_part(some), 1, .03);
        mean += seen_part(some) / 4;
        free(all);
        free(some);
    }
    assert_float_equal(mean, 1, .015);
    bd_point_clusters_finish(&clusters);
}

// A square seen from its edge, a hundredth above it: by what it has of the form factor. Each of its
// points is far less than a texel, and if each covered one they would be several times too much.
static void a_surface_seen_from_its_edge_is_thin(void **state)
{
    (void)state;
    struct bd_point_clusters clusters;
    const f3 from = f3_of(-.6f, 0, .01f);
    double exact = 0, seen_sum = 0;
    struct bd_surface_points points = {
        .count = POINTS, .area = 1.0f / POINTS, .points = calloc(POINTS, sizeof *points.points)};
    assert_non_null(points.points);
    for (uint32_t i = 0; i < POINTS; i++) {
        const f3 at =
            f3_of(((float)(i % 128) + .5f) / 128 - .5f, ((float)(i / 128) + .5f) / 128 - .5f, 0);
        const f3 way = f3_sub(at, from);
        const double r2 = (double)f3_dot(way, way);
        points.points[i].position = at;
        points.points[i].number = bd_stirred(i);
        points.points[i].normal = f3_of(0, 0, 1);
        exact += (double)points.area * (double)way.x * -(double)way.z / (r2 * r2);
    }
    cluster(&clusters, &points);
    for (uint32_t i = 0; i < 16; i++) {
        const struct bd_projector projector = {.loops = bd_native_loops(),
                                               .points = &clusters,
                                               .explore = 2,
                                               .exploit = 2048,
                                               .side = SIDE};
        const struct bd_native_place place = bd_projected_place(from, f3_of(1, 0, 0), i);
        struct bd_projected *seen = malloc(sizeof *seen);
        struct bd_point_cut cut;
        assert_non_null(seen);
        bd_point_clusters_cut(&clusters, 512, NULL, &cut);
        bd_project_points(&projector, &cut, &place, i, seen);
        seen_sum += seen_part(seen) / 16;
        free(seen);
    }
    print_message("    %.5f of the light, exactly %.5f\n", seen_sum, exact / M_PI);
    assert_true(seen_sum < 1.8 * exact / M_PI && seen_sum > .6 * exact / M_PI);
    free(points.points);
    bd_point_clusters_finish(&clusters);
}

// By what clusters may give, a tenth for all alike; none at all gives all alike.
static void counts_are_exact_in_the_mean(void **state)
{
    (void)state;
    const float patterns[][4] = {
        {.6f, 0, 0, .4f}, {1, 1, 1, 1}, {0, 0, 0, 0}, {1e-9f, 1, 0, 1e-3f}};
    for (size_t k = 0; k < 4; k++) {
        uint32_t shares[4], counts[4];
        double sums[4] = {0}, all = 0;
        const uint32_t sum = bd_point_shares(patterns[k], 4, shares);
        const uint32_t drawn = 37, tries = 4096;
        for (uint32_t i = 0; i < tries; i++) {
            bd_point_counts(shares, 4, sum, drawn, ((float)i + .5f) / (float)tries, counts);
            assert_int_equal(counts[0] + counts[1] + counts[2] + counts[3], drawn);
            for (int c = 0; c < 4; c++) {
                const double expected = (double)drawn * shares[c] / sum;
                assert_true(fabs(counts[c] - expected) < 1);
                sums[c] += counts[c];
            }
        }
        for (int c = 0; c < 4; c++) all += (double)patterns[k][c];
        for (int c = 0; c < 4; c++) {
            const double part = all > 0 ? .9 * (double)patterns[k][c] / all + .025 : .25;
            assert_float_equal(sums[c] / tries, drawn * part, 2e-3 * drawn);
        }
    }
}

static void sums_are_exact_for_any_pattern(void **state)
{
    (void)state;
    static float importance[BD_CLUSTERS_MAX];
    static uint32_t shares[BD_CLUSTERS_MAX], counts[BD_CLUSTERS_MAX];
    for (uint32_t k = 0; k < 3000; k++) {
        const uint32_t count = 1 + bd_stirred(k) % BD_CLUSTERS_MAX, drawn = bd_stirred(~k) % 5000;
        uint32_t total = 0;
        for (uint32_t i = 0; i < count; i++) {
            const float number = (float)(bd_stirred(k * 1031 + i) >> 8) * 0x1p-24f;
            importance[i] = k % 3 ? number : expf(60 * number - 40);
        }
        const uint32_t sum = bd_point_shares(importance, count, shares);
        bd_point_counts(shares, count, sum, drawn, (float)(bd_stirred(k) >> 8) * 0x1p-24f, counts);
        for (uint32_t i = 0; i < count; i++) {
            assert_true(counts[i] <= drawn);
            assert_true(shares[i] > 0);
            total += counts[i];
        }
        assert_int_equal(total, drawn);
    }
}

// The means that the loop as printed has of each cluster (algorithms.md A4, I1), to .01.
static void check_means(const float *importance, uint32_t count, uint32_t drawn,
                        const double *printed)
{
    const uint32_t tries = 200000;
    uint32_t counts[16];
    double sums[16] = {0};
    for (uint32_t i = 0; i < tries; i++) {
        bd_point_counts_printed(importance, count, drawn, bd_stirred(i), counts);
        for (uint32_t c = 0; c < count; c++) sums[c] += counts[c];
    }
    for (uint32_t c = 0; c < count; c++) assert_float_equal(sums[c] / tries, printed[c], .01);
}

static void the_printed_loop_has_its_own_means(void **state)
{
    (void)state;
    const float unequal[4] = {.6f, 0, 0, .4f};
    const double of_unequal[4] = {.60, .24, .10, .06};
    const float equal[10] = {1, 1, 1, 1, 1, 1, 1, 1, 1, 1};
    const double of_equal[10] = {.30, .42, .25, .23, .40, .32, .18, .36, .38, .16};
    check_means(unequal, 4, 1, of_unequal);
    check_means(equal, 10, 3, of_equal);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_width_has_the_same_bits),
        cmocka_unit_test(a_furnace_is_white),
        cmocka_unit_test(a_surface_seen_from_its_edge_is_thin),
        cmocka_unit_test(counts_are_exact_in_the_mean),
        cmocka_unit_test(sums_are_exact_for_any_pattern),
        cmocka_unit_test(the_printed_loop_has_its_own_means),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
