// Points in clusters (lights/point_clusters.h): cuts hold all of them, even ones as many each,
// those of a view many where it is near and none below its plane; and the nearest point is that of
// a search through all.

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "kernel/projected_point.h"
#include "lights/point_clusters.h"
#include "lights/sequence.h"
#include "tests/unit/cmocka_all.h"

#define COUNT 20000u

static enum bd_err go_on(void *user)
{
    (void)user;
    return BD_ERR_OK;
}

static float chance(uint32_t number)
{
    return (float)(bd_stirred(number) >> 8) * 0x1p-24f;
}

// In a box of side 2; facing along one of its axes.
static void make(struct bd_point_clusters *clusters, uint32_t count)
{
    struct bd_err_detail detail;
    struct bd_surface_points points = {
        .count = count, .area = 1e-3f, .points = calloc(count + 1, sizeof *points.points)};
    assert_non_null(points.points);
    for (uint32_t i = 0; i < count; i++) {
        const f3 normals[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, -1}};
        points.points[i].position =
            f3_of(2 * chance(3 * i) - 1, 2 * chance(3 * i + 1) - 1, 2 * chance(3 * i + 2) - 1);
        points.points[i].normal = normals[i % 3];
    }
    assert_int_equal(bd_point_clusters_init(clusters, &points, go_on, NULL, &detail), BD_ERR_OK);
    free(points.points);
}

static void check_whole(const struct bd_point_clusters *clusters, const struct bd_point_cut *cut)
{
    uint32_t next = 0;
    for (uint32_t i = 0; i < cut->count; i++) {
        assert_int_equal(cut->clusters[i].first, next);
        assert_true(cut->clusters[i].count > 0);
        next += cut->clusters[i].count;
    }
    assert_int_equal(next, clusters->count);
}

static void every_point_is_there_once(void **state)
{
    (void)state;
    struct bd_point_clusters clusters;
    make(&clusters, COUNT);
    bool *was = calloc(COUNT, sizeof *was);
    assert_non_null(was);
    for (uint32_t i = 0; i < COUNT; i++) {
        assert_false(was[clusters.order[i]]);
        was[clusters.order[i]] = true;
    }
    free(was);
    bd_point_clusters_finish(&clusters);
}

static void even_cuts_have_as_many_each(void **state)
{
    (void)state;
    const uint32_t counts[] = {0, 1, 2, 5, 63, 1000, COUNT};
    for (size_t k = 0; k < sizeof counts / sizeof *counts; k++)
        for (uint32_t most = 1; most <= 512; most *= 8) {
            struct bd_point_clusters clusters;
            struct bd_point_cut cut;
            make(&clusters, counts[k]);
            bd_point_clusters_cut(&clusters, most, NULL, &cut);
            check_whole(&clusters, &cut);
            assert_true(cut.count <= most);
            uint32_t least = UINT32_MAX, largest = 0;
            for (uint32_t i = 0; i < cut.count; i++) {
                least = cut.clusters[i].count < least ? cut.clusters[i].count : least;
                largest = cut.clusters[i].count > largest ? cut.clusters[i].count : largest;
            }
            if (counts[k] == COUNT) assert_int_equal(cut.count, most);
            if (counts[k] > 0) assert_true(largest <= least + 1);
            bd_point_clusters_finish(&clusters);
        }
}

static float distance_to(const struct bd_point_clusters *clusters, uint32_t point, f3 from)
{
    const struct bd_projected_point *p = &clusters->points[point];
    return f3_length(f3_sub(f3_of(p->x, p->y, p->z), from));
}

// From a corner, over its floor: near clusters are of few points; what lies below is of many.
static void views_have_much_of_what_is_near(void **state)
{
    (void)state;
    struct bd_point_clusters clusters;
    struct bd_point_cut cut;
    const f3 at = f3_of(.5f, .5f, .2f);
    const struct bd_point_view view = {{at, at}, {0, 0, 1}};
    make(&clusters, COUNT);
    bd_point_clusters_cut(&clusters, 512, &view, &cut);
    check_whole(&clusters, &cut);
    assert_int_equal(cut.count, 512);
    double near = 0, far = 0, below = 0;
    uint32_t nears = 0, fars = 0, belows = 0;
    for (uint32_t i = 0; i < cut.count; i++) {
        const uint32_t middle = cut.clusters[i].first + cut.clusters[i].count / 2;
        const float distance = distance_to(&clusters, middle, at);
        const double count = cut.clusters[i].count;
        if (clusters.points[middle].z < 0)
            below += count, belows++;
        else if (clusters.points[middle].z > .3f && distance < .5f)
            near += count, nears++;
        else if (clusters.points[middle].z > .3f && distance > 1.2f)
            far += count, fars++;
    }
    assert_true(nears > 50);
    assert_true(near / nears * 8 < far / fars);
    assert_true(below / belows > 20 * near / nears);
    bd_point_clusters_finish(&clusters);
}

static void make_moved(struct bd_point_clusters *clusters, float by, bool are_fewer)
{
    struct bd_err_detail detail;
    struct bd_surface_points points = {.area = 1e-3f,
                                       .points = calloc(COUNT, sizeof *points.points)};
    assert_non_null(points.points);
    for (uint32_t i = 0; i < COUNT; i++) {
        const f3 at =
            f3_of(2 * chance(3 * i) - 1, 2 * chance(3 * i + 1) - 1, 2 * chance(3 * i + 2) - 1);
        const bool is_there = at.x < -.5f, is_moved = is_there && i % 10 == 0;
        if (are_fewer && is_there && i % 10 == 5) continue;
        points.points[points.count++] = (struct bd_surface_point){
            .position = is_moved ? f3_of(at.x + by, at.y, at.z) : at,
            .normal = {0, 0, 1},
            .number = bd_stirred(i),
        };
    }
    assert_int_equal(bd_point_clusters_init(clusters, &points, go_on, NULL, &detail), BD_ERR_OK);
    free(points.points);
}

static bool has_cluster(const struct bd_point_cut *cut, const struct bd_point_cluster *as)
{
    for (uint32_t i = 0; i < cut->count; i++)
        if (cut->clusters[i].name == as->name) return cut->clusters[i].count == as->count;
    return false;
}

// Of a quarter of space a tenth of the points goes a hundredth on, and another tenth away, so that
// halves by count would be others everywhere: clusters elsewhere are the same.
static void what_moves_changes_no_clusters_elsewhere(void **state)
{
    (void)state;
    struct bd_point_clusters clusters, moved;
    struct bd_point_cut cut, other;
    const f3 at = f3_of(.5f, .5f, -1);
    const struct bd_point_view view = {{at, at}, {0, 0, 1}};
    uint32_t elsewhere = 0, changed = 0;
    make_moved(&clusters, 0, false);
    make_moved(&moved, .01f, true);
    bd_point_clusters_cut(&clusters, 512, &view, &cut);
    bd_point_clusters_cut(&moved, 512, &view, &other);
    for (uint32_t i = 0; i < cut.count; i++) {
        const uint32_t middle = cut.clusters[i].first + cut.clusters[i].count / 2;
        if (clusters.points[middle].x < -.25f) continue;
        elsewhere++;
        changed += !has_cluster(&other, &cut.clusters[i]);
    }
    assert_true(elsewhere > 300);
    assert_in_range(changed, 0, 20); // halves by count: 343 of 428
    bd_point_clusters_finish(&clusters);
    bd_point_clusters_finish(&moved);
}

// Wherever they stop: no gap between those that were come to is three times as wide as if they were
// even.
static void steps_spread_and_come_to_all(void **state)
{
    (void)state;
    struct bd_point_clusters clusters;
    make(&clusters, COUNT);
    for (uint32_t p = 0; p < clusters.part_count; p++) {
        const uint32_t count = clusters.parts[p].count, step = clusters.parts[p].step;
        bool *was = calloc(count, sizeof *was);
        assert_non_null(was);
        for (uint32_t i = 0, at = 0; i < count; i++, at = (at + step) % count) {
            assert_false(was[at]);
            was[at] = true;
            if (count < 64 || i != count / 7) continue;
            uint32_t gap = 0;
            for (uint32_t k = 0, last = 0; k < count; k++) {
                if (!was[k]) continue;
                gap = k - last > gap ? k - last : gap;
                last = k;
            }
            assert_true(gap < 3 * 8);
        }
        free(was);
    }
    bd_point_clusters_finish(&clusters);
}

static uint32_t nearest_of_all(const struct bd_point_clusters *clusters, f3 at, f3 normal,
                               float reach)
{
    uint32_t found = BD_NO_POINT_NEAR;
    float nearest2 = INFINITY;
    for (uint32_t i = 0; i < clusters->count; i++) {
        const struct bd_projected_point *point = &clusters->points[i];
        const float alike = f3_dot(normal_of_bits(point->normal), normal);
        const float distance = distance_to(clusters, i, at);
        const float off = f3_dot(f3_sub(f3_of(point->x, point->y, point->z), at), normal);
        const float more2 = distance * distance + 99 * off * off;
        if (f_abs(alike) < 0.7f || distance >= reach || more2 >= nearest2) continue;
        nearest2 = more2;
        found = 2 * i + (alike < 0);
    }
    return found;
}

static void the_nearest_in_its_plane_faces_alike(void **state)
{
    (void)state;
    struct bd_point_clusters clusters;
    uint32_t backs = 0, nones = 0;
    make(&clusters, COUNT);
    for (uint32_t i = 0; i < 300; i++) {
        const f3 at = f3_of(2.2f * chance(7 * i + 1) - 1.1f, 2.2f * chance(7 * i + 2) - 1.1f,
                            2.2f * chance(7 * i + 3) - 1.1f);
        const f3 normal = f3_of(0, i % 3 == 0, i % 3 == 1 ? 1 : i % 3 == 2 ? -1 : 0);
        const float reach = i % 2 ? 1 : 0.05f;
        const uint32_t got = bd_point_clusters_near(&clusters, at, normal, reach);
        assert_int_equal(got, nearest_of_all(&clusters, at, normal, reach));
        nones += got == BD_NO_POINT_NEAR;
        backs += got != BD_NO_POINT_NEAR && got % 2;
    }
    assert_in_range(backs, 50, 150);
    assert_in_range(nones, 10, 200);
    bd_point_clusters_finish(&clusters);
}

static float more2_of(const struct bd_point_clusters *clusters, uint32_t side, f3 at, f3 normal)
{
    const struct bd_projected_point *point = &clusters->points[side / 2];
    const float distance = distance_to(clusters, side / 2, at);
    const float off = f3_dot(f3_sub(f3_of(point->x, point->y, point->z), at), normal);
    return distance * distance + 99 * off * off;
}

static void the_nearest_come_in_order(void **state)
{
    (void)state;
    static uint32_t all[COUNT];
    struct bd_point_clusters clusters;
    uint32_t full = 0;
    make(&clusters, COUNT);
    for (uint32_t i = 0; i < 200; i++) {
        const f3 at =
            f3_of(2 * chance(5 * i + 1) - 1, 2 * chance(5 * i + 2) - 1, 2 * chance(5 * i + 3) - 1);
        const f3 normal = f3_of(0, i % 2, 1 - i % 2);
        const float reach = i % 3 ? .3f : .05f;
        uint32_t sides[BD_NEAREST_MOST], nearer = 0;
        const uint32_t got =
            bd_point_clusters_nearest(&clusters, at, normal, reach, sides, BD_NEAREST_MOST);
        const uint32_t within = bd_point_clusters_within(&clusters, at, normal, reach, all, COUNT);
        assert_int_equal(got, within < BD_NEAREST_MOST ? within : BD_NEAREST_MOST);
        if (got == 0) continue;
        const float last2 = more2_of(&clusters, sides[got - 1], at, normal);
        for (uint32_t k = 1; k < got; k++)
            assert_true(more2_of(&clusters, sides[k - 1], at, normal) <=
                        more2_of(&clusters, sides[k], at, normal));
        for (uint32_t k = 0; k < within; k++)
            nearer += more2_of(&clusters, all[k], at, normal) < last2;
        assert_int_equal(nearer, got - 1);
        full += got == BD_NEAREST_MOST;
    }
    assert_in_range(full, 100, 199);
    bd_point_clusters_finish(&clusters);
}

static void all_within_reach_are_found(void **state)
{
    (void)state;
    static uint32_t sides[COUNT];
    struct bd_point_clusters clusters;
    uint32_t all = 0;
    make(&clusters, COUNT);
    for (uint32_t i = 0; i < 60; i++) {
        const f3 at =
            f3_of(2 * chance(5 * i + 1) - 1, 2 * chance(5 * i + 2) - 1, 2 * chance(5 * i + 3) - 1);
        const f3 normal = f3_of(0, i % 2, 1 - i % 2);
        const float reach = .3f;
        uint32_t expected = 0;
        for (uint32_t k = 0; k < clusters.count; k++) {
            const float alike = f3_dot(normal_of_bits(clusters.points[k].normal), normal);
            expected += f_abs(alike) >= 0.7f && distance_to(&clusters, k, at) < reach;
        }
        const uint32_t got = bd_point_clusters_within(&clusters, at, normal, reach, sides, COUNT);
        assert_int_equal(got, expected);
        for (uint32_t k = 0; k < got; k++)
            assert_true(distance_to(&clusters, sides[k] / 2, at) < reach);
        const uint32_t few = bd_point_clusters_within(&clusters, at, normal, reach, sides, 3);
        assert_int_equal(few, expected < 3 ? expected : 3);
        all += got;
    }
    assert_true(all > 600);
    bd_point_clusters_finish(&clusters);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_point_is_there_once),
        cmocka_unit_test(even_cuts_have_as_many_each),
        cmocka_unit_test(views_have_much_of_what_is_near),
        cmocka_unit_test(what_moves_changes_no_clusters_elsewhere),
        cmocka_unit_test(steps_spread_and_come_to_all),
        cmocka_unit_test(the_nearest_in_its_plane_faces_alike),
        cmocka_unit_test(the_nearest_come_in_order),
        cmocka_unit_test(all_within_reach_are_found),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
