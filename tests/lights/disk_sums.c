// Sums over a disk (lights/disk_sums.h) are those of its points one by one: on a plane and a bumpy
// ball, at any tilt and size, with and without a cut.

#include <math.h>
#include <stdlib.h>

#include "lights/disk_sums.h"
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

static f3 any_way(uint32_t number)
{
    return f3_unit(
        f3_of(chance(number) - 0.5f, chance(number + 1) - 0.5f, chance(number + 2) - 0.5f + 1e-3f));
}

struct world {
    struct bd_surface_points points;
    f3 *colours;
    struct bd_facing_trees trees;
    struct bd_disk_sums sums;
};

// Half of the points on a ball's bumps far from the origin, half on the plane below it.
static void world_init(struct world *world)
{
    struct bd_err_detail detail;
    world->points = (struct bd_surface_points){
        .count = COUNT, .area = 1, .points = calloc(COUNT, sizeof *world->points.points)};
    world->colours = calloc(COUNT, sizeof *world->colours);
    assert_non_null(world->points.points);
    assert_non_null(world->colours);
    const f3 middle = f3_of(100, 50, 20);
    for (uint32_t i = 0; i < COUNT; i++) {
        struct bd_surface_point *point = &world->points.points[i];
        const f3 way = any_way(8 * i);
        point->normal = i % 2 ? way : f3_of(0, 0, 1);
        point->position =
            i % 2 ? f3_add(middle, f3_scale(way, 1 + 0.01f * chance(8 * i + 3)))
                  : f3_add(middle, f3_of(4 * chance(8 * i) - 2, 4 * chance(8 * i + 1) - 2, -1));
        world->colours[i] = f3_of(chance(8 * i + 4), 100 * chance(8 * i + 5), i % 3 == 0);
    }
    assert_int_equal(bd_facing_trees_init(&world->trees, &world->points, go_on, NULL, &detail), 0);
    assert_int_equal(bd_disk_sums_init(&world->sums, &world->trees, world->colours, &detail), 0);
}

static void world_finish(struct world *world)
{
    bd_disk_sums_finish(&world->sums);
    bd_facing_trees_finish(&world->trees);
    free(world->points.points);
    free(world->colours);
}

// One by one; `cut` is met in all directions, or NULL.
static uint32_t sum_up(const struct world *world, const struct bd_disk *disk,
                       const struct bd_disk_cut *cut, double sum[3])
{
    uint32_t on_it = 0;
    for (uint32_t i = 0; i < COUNT; i++) {
        const struct bd_surface_point *point = &world->points.points[i];
        const struct bd_point_node node = {point->position, point->normal, i & 0x3fffffffu, 0};
        float distance2;
        if (!bd_disk_holds(disk, &node, &distance2)) continue;
        if (cut && f3_dot(cut->normal, f3_sub(point->position, cut->point)) < 0) continue;
        const double weight = 1 - distance2 / disk->within2;
        sum[0] += weight * world->colours[i].x;
        sum[1] += weight * world->colours[i].y;
        sum[2] += weight * world->colours[i].z;
        on_it++;
    }
    return on_it;
}

static void compare(const struct world *world, const struct bd_disk *disk,
                    const struct bd_disk_cut *cut, uint32_t *on_most)
{
    struct bd_disk_cut cuts[BD_DISK_CUTS];
    for (uint32_t k = 0; cut && k < BD_DISK_CUTS; k++) cuts[k] = *cut;
    double wanted[3] = {0};
    const uint32_t on_it = sum_up(world, disk, cut, wanted);
    const f3 got = bd_disk_sums_of(&world->sums, disk, cut ? cuts : NULL);
    // A point on the edge may be on either side, with a weight of next to nothing.
    const float near = 1e-5f * (float)on_it + 1e-4f;
    assert_float_equal(got.x, wanted[0], near);
    assert_float_equal(got.y, wanted[1], 100 * near);
    assert_float_equal(got.z, wanted[2], near);
    if (on_it > *on_most) *on_most = on_it;
}

static void a_sum_is_that_of_its_points(void **state)
{
    (void)state;
    struct world world;
    uint32_t on_most = 0;
    world_init(&world);
    for (uint32_t i = 0; i < 400; i++) {
        const struct bd_surface_point *at = &world.points.points[bd_stirred(i) % COUNT];
        const float radius = powf(10, 2.5f * chance(3 * i + 7) - 2);
        const f3 tilted =
            f3_unit(f3_add(at->normal, f3_scale(any_way(i + 900), 0.5f * (float)(i % 3))));
        const struct bd_disk disk = {at->position, tilted, radius * radius};
        const struct bd_disk_cut cut = {f3_add(at->position, f3_scale(any_way(i), 0.3f * radius)),
                                        any_way(i + 5000)};
        compare(&world, &disk, NULL, &on_most);
        compare(&world, &disk, &cut, &on_most);
    }
    assert_true(on_most > COUNT / 4);
    world_finish(&world);
}

static void nothing_has_no_sum(void **state)
{
    (void)state;
    const struct bd_surface_points none = {.area = 1};
    const struct bd_disk disk = {{0, 0, 0}, {0, 0, 1}, 1};
    struct bd_facing_trees trees;
    struct bd_disk_sums sums;
    struct bd_err_detail detail;
    assert_int_equal(bd_facing_trees_init(&trees, &none, go_on, NULL, &detail), 0);
    assert_int_equal(bd_disk_sums_init(&sums, &trees, NULL, &detail), 0);
    assert_float_equal(bd_disk_sums_of(&sums, &disk, NULL).x, 0, 0);
    bd_disk_sums_finish(&sums);
    bd_facing_trees_finish(&trees);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_sum_is_that_of_its_points),
        cmocka_unit_test(nothing_has_no_sum),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
