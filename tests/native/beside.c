// How places on a surface look at each other (pass/beside.h): straight where it is flat or
// folds towards them, and over it, never through it, where it bends away.

#include <math.h>

#include "pass/beside.h"
#include "tests/unit/cmocka_all.h"

static f3 end_of(const float xyz[3])
{
    return f3_of(xyz[0], xyz[1], xyz[2]);
}

static float length_of(const struct bd_segment *segment)
{
    const f3 way = f3_sub(end_of(segment->to), end_of(segment->from));
    return f_sqrt(f3_dot(way, way));
}

// Of the segment's points that to the origin.
static float nearest_to_origin(const struct bd_segment *segment)
{
    const f3 from = end_of(segment->from), way = f3_sub(end_of(segment->to), from);
    const float along = f_min(f_max(-f3_dot(from, way) / f3_dot(way, way), 0), 1);
    const f3 at = f3_add(from, f3_scale(way, along));
    return f_sqrt(f3_dot(at, at));
}

static void over_a_ball_nothing_is_cut(void **state)
{
    (void)state;
    for (float angle = 0.01f; angle < 0.8f; angle *= 2) {
        const f3 a = f3_of(0, 1, 0), b = f3_of(sinf(angle), cosf(angle), 0);
        const struct bd_beside_place places[2] = {{a, a}, {b, b}};
        struct bd_segment way[2];
        bd_way_beside(way, &places[0], &places[1]);
        assert_true(nearest_to_origin(&way[0]) > 1 && nearest_to_origin(&way[1]) > 1);
        assert_true(length_of(&way[0]) + length_of(&way[1]) < 1.1f * angle);
        assert_memory_equal(way[0].to, way[1].from, sizeof way[0].to);
    }
}

// The inside of the ball, and a floor: one segment, lifted off both.
static void what_does_not_bend_away_is_seen_straight(void **state)
{
    (void)state;
    const f3 up = f3_of(0, 1, 0);
    const f3 tilted = f3_of(-sinf(0.5f), cosf(0.5f), 0);
    const struct bd_beside_place pairs[][2] = {
        {{f3_of(-.3f, 0, .2f), up}, {f3_of(.4f, 0, 0), up}},
        {{f3_of(0, 0, 0), up}, {f3_of(sinf(0.5f), 1 - cosf(0.5f), 0), tilted}},
    };
    for (size_t i = 0; i < sizeof pairs / sizeof *pairs; i++) {
        struct bd_segment way[2];
        bd_way_beside(way, &pairs[i][0], &pairs[i][1]);
        assert_true(length_of(&way[1]) == 0);
        for (int end = 0; end < 2; end++) {
            const f3 at = end_of(end ? way[0].to : way[0].from);
            const float over = f3_dot(f3_sub(at, pairs[i][end].position), pairs[i][end].normal);
            assert_true(over > 1e-7f && over < 1e-5f);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(over_a_ball_nothing_is_cut),
        cmocka_unit_test(what_does_not_bend_away_is_seen_straight),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
