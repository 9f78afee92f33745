// Parts of draws: whatever the limits, every triangle of every instance once, in order.

#include "pass/scene_parts.h"
#include "tests/unit/cmocka_all.h"

#define TRIANGLES_MAX 12u
#define INSTANCES_MAX 9u

// A few bits of a number that is another at each call; the same ones in each run.
static uint32_t next_random(uint64_t *state)
{
    *state = *state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (uint32_t)(*state >> 33);
}

static void every_triangle_once(uint32_t triangles, uint32_t instances, uint64_t *random)
{
    struct bd_scene_part part = {0};
    uint32_t next = 0; // instance * triangles + triangle
    double limit = 1 + next_random(random) % (2 * TRIANGLES_MAX);
    while (bd_scene_part_next(triangles, instances, limit, &part)) {
        assert_true(part.triangle_count > 0 && part.instance_count > 0);
        assert_true((double)part.triangle_count * part.instance_count <= limit);
        assert_true(part.first_triangle + part.triangle_count <= triangles);
        assert_true(part.instance_count == 1 || part.triangle_count == triangles);
        assert_int_equal(part.first_instance * triangles + part.first_triangle, next);
        next += part.triangle_count * part.instance_count;
        limit = 1 + next_random(random) % (2 * TRIANGLES_MAX);
    }
    assert_int_equal(next, triangles * instances);
}

static void whatever_the_limits(void **state)
{
    (void)state;
    uint64_t random = 7;
    for (uint32_t triangles = 1; triangles <= TRIANGLES_MAX; triangles++)
        for (uint32_t instances = 1; instances <= INSTANCES_MAX; instances++)
            for (int i = 0; i < 50; i++) every_triangle_once(triangles, instances, &random);
}

// A limit that is none of a triangle's is taken for one.
static void a_limit_below_one(void **state)
{
    (void)state;
    struct bd_scene_part part = {0};
    assert_true(bd_scene_part_next(3, 2, 0, &part));
    assert_int_equal(part.triangle_count, 1);
    assert_int_equal(part.instance_count, 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(whatever_the_limits),
        cmocka_unit_test(a_limit_below_one),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
