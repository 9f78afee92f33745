// The tree of points that stand for places on surfaces finds those that a look at every one finds:
// the nearest that face alike, however many are asked for, nearest first.

#include "lights/point_tree.h"

#include <math.h>
#include <stdlib.h>

#include "tests/unit/cmocka_all.h"

#define POINTS 3000u
#define PLACES 400u

static uint64_t state = 1;

static float chance(void) // [-1, 1]
{
    state = state * UINT64_C(6364136223846793005) + 1442695040888963407u;
    return (float)((double)(state >> 40) / (1 << 23) - 1);
}

static f3 anywhere(void)
{
    return f3_of(chance(), chance(), chance());
}

static enum bd_err go_on(void *user)
{
    (void)user;
    return BD_ERR_OK;
}

static enum bd_err give_up(void *user)
{
    (void)user;
    return BD_ERR_CANCELLED;
}

// On the walls of a box and in a cloud within it; several in one place.
static struct bd_surface_points points_of(struct bd_surface_point *points)
{
    for (uint32_t i = 0; i < POINTS; i++) {
        f3 at = anywhere();
        if (i % 2) at.z = i % 4 == 1 ? -1 : 1;
        if (i % 50 == 49) at = points[i - 1].position;
        const f3 up = f3_of(0, 0, at.z < 0 ? 1 : -1);
        points[i] =
            (struct bd_surface_point){.position = at, .normal = i % 2 ? up : f3_unit(anywhere())};
    }
    return (struct bd_surface_points){.count = POINTS, .area = 0.003f, .points = points};
}

// As the tree's header has it: what lies off the place's plane counts as four times as far.
static float distance2(const struct bd_surface_point *point, f3 position, f3 normal)
{
    const f3 away = f3_sub(point->position, position);
    const float off = f3_dot(away, normal);
    return f3_dot(point->normal, normal) < 0.5f ? INFINITY : f3_dot(away, away) + 15 * off * off;
}

static int nearer(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

static void assert_finds(const struct bd_point_tree *tree, const struct bd_surface_points *points,
                         f3 position, f3 normal, uint32_t most)
{
    const float reach2 = 16 * 16 * points->area;
    float all[POINTS], sum = 0;
    struct bd_point_neighbours found;
    uint32_t within = 0;
    for (uint32_t i = 0; i < points->count; i++) {
        all[i] = distance2(&points->points[i], position, normal);
        within += all[i] < reach2;
    }
    qsort(all, points->count, sizeof *all, nearer);
    bd_point_tree_find(tree, position, normal, most, &found);
    assert_int_equal(found.count, within < most ? within : most);
    for (uint32_t k = 0; k < found.count; k++) {
        assert_float_equal(distance2(&points->points[found.point[k]], position, normal), all[k],
                           1e-5f * all[k]);
        assert_true(found.share[k] > 0 && (k == 0 || found.share[k] <= found.share[k - 1]));
        sum += found.share[k];
    }
    if (found.count > 0) assert_float_equal(sum, 1, 1e-5);
}

static void it_finds_what_a_look_at_all_finds(void **unused)
{
    (void)unused;
    static struct bd_surface_point array[POINTS];
    const struct bd_surface_points points = points_of(array);
    struct bd_point_tree tree;
    struct bd_err_detail detail;
    assert_int_equal(bd_point_tree_init(&tree, &points, go_on, NULL, &detail), BD_ERR_OK);
    for (uint32_t i = 0; i < PLACES; i++) {
        const f3 position = i % 3 ? anywhere() : points.points[i].position;
        const f3 normal = i % 3 ? f3_unit(anywhere()) : points.points[i].normal;
        assert_finds(&tree, &points, position, normal, 1 + i % BD_POINT_NEIGHBOURS);
    }
    bd_point_tree_finish(&tree);
}

static void no_points_stand_for_nothing(void **unused)
{
    (void)unused;
    const struct bd_surface_points none = {.area = 1};
    struct bd_point_neighbours found;
    struct bd_point_tree tree;
    struct bd_err_detail detail;
    assert_int_equal(bd_point_tree_init(&tree, &none, go_on, NULL, &detail), BD_ERR_OK);
    bd_point_tree_find(&tree, f3_of(0, 0, 0), f3_of(0, 0, 1), BD_POINT_NEIGHBOURS, &found);
    assert_int_equal(found.count, 0);
    bd_point_tree_finish(&tree);
}

static void what_pauses_may_end_it(void **unused)
{
    (void)unused;
    const uint32_t many = 20000;
    struct bd_surface_point *array = malloc(many * sizeof *array);
    struct bd_surface_points points = {.count = many, .area = 1, .points = array};
    struct bd_point_tree tree;
    struct bd_err_detail detail;
    assert_non_null(array);
    for (uint32_t i = 0; i < many; i++)
        array[i] = (struct bd_surface_point){.position = anywhere(), .normal = f3_of(0, 0, 1)};
    assert_int_equal(bd_point_tree_init(&tree, &points, give_up, NULL, &detail), BD_ERR_CANCELLED);
    assert_null(tree.nodes);
    free(array);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(it_finds_what_a_look_at_all_finds),
        cmocka_unit_test(no_points_stand_for_nothing),
        cmocka_unit_test(what_pauses_may_end_it),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
