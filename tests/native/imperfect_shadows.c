// What a virtual light sees of points (pass/native/imperfect_shadows.c): the same bits from every
// width, and no less than all texels asked one by one.

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "kernel/imperfect_shadow.h"
#include "pass/f3_arrays.h"
#include "tests/native/stage.h"
#include "tests/unit/cmocka_all.h"

#define SIDE   24u
#define POINTS 140u // two groups of lanes and a part

struct scenery {
    struct bd_shadow_point points[POINTS];
    struct bd_shadow_centre centre;
    struct bd_native_shadow shadow;
};

// From far ones that cover less than a texel to near ones that cover much of the sky, of every size
// between; some below the horizon, and some that are none.
static void set_point(struct bd_shadow_point *point, uint32_t i)
{
    const struct bd_vec4 to = unit(), n = unit();
    const float distance = i % 7 == 0 ? .2f : i % 7 == 1 ? 40 : 2 + chance();
    const float radius = i % 11 == 10 ? 0 : i % 5 == 0 ? .5f : .12f + .1f * chance();
    point->place =
        (struct bd_vec4){3 + distance * to.x, 1 + distance * to.y, 2 + distance * to.z, 0};
    point->normal_radius2 = (struct bd_vec4){n.x, n.y, n.z, radius * radius};
}

static struct scenery *set_scenery(void)
{
    struct scenery *s = calloc(1, sizeof *s);
    assert_non_null(s);
    begin_chance(11);
    for (uint32_t i = 0; i < POINTS; i++) set_point(&s->points[i], i);
    s->centre = (struct bd_shadow_centre){{3, 1, 2, 0}, {0, .6f, .8f, 1}, {1, 0, 0, 0}};
    s->shadow = (struct bd_native_shadow){&s->centre, s->points, POINTS, SIDE};
    return s;
}

static uint32_t *draw(const struct bd_native_loops *loops, const struct scenery *s)
{
    uint32_t *map = malloc(SIDE * SIDE * sizeof *map);
    assert_non_null(map);
    memset(map, 0xff, SIDE * SIDE * sizeof *map);
    loops->shadow(&s->shadow, map);
    return map;
}

static void every_width_has_the_same_bits(void **state)
{
    (void)state;
    const char *width;
    struct scenery *s = set_scenery();
    uint32_t *first = draw(bd_native_loops_at(0, &width), s);
    for (uint32_t w = 0;; w++) {
        const struct bd_native_loops *loops = bd_native_loops_at(w, &width);
        if (!width) break;
        if (!loops) continue;
        uint32_t *map = draw(loops, s);
        assert_memory_equal(map, first, SIDE * SIDE * sizeof *map);
        free(map);
    }
    free(first);
    free(s);
}

static uint32_t key_at(const struct scenery *s, uint32_t u, uint32_t v)
{
    const f3 normal = f3_from(&s->centre.normal_there), across = f3_from(&s->centre.across);
    const f3 along = f3_cross(normal, across), from = f3_from(&s->centre.place_first);
    const f3 way =
        way_of_place(place_of_texel((float)u + .5f, SIDE), place_of_texel((float)v + .5f, SIDE));
    uint32_t least = NO_DISK;
    for (uint32_t i = 0; i < POINTS; i++) {
        const struct bd_shadow_point *p = &s->points[i];
        const f3 to = in_axes(f3_sub(f3_from(&p->place), from), across, along, normal);
        const f3 own = in_axes(f3_from(&p->normal_radius2), across, along, normal);
        if (!(to.z > 0)) continue;
        const uint32_t key = key_of_disk(distance_to_disk(to, own, p->normal_radius2.w, way), i);
        if (key < least) least = key;
    }
    return least;
}

static void no_texel_of_a_disk_is_missed(void **state)
{
    (void)state;
    struct scenery *s = set_scenery();
    uint32_t *map = draw(bd_native_loops(), s), kept = 0, disks = 0, last = NO_DISK;
    for (uint32_t v = 0; v < SIDE; v++)
        for (uint32_t u = 0; u < SIDE; u++) {
            const uint32_t key = key_at(s, u, v);
            assert_int_equal(map[v * SIDE + u], key);
            kept += key != NO_DISK;
            disks += key != last;
            last = key;
        }
    printf("    %u of %u texels, %u changes of disk\n", kept, SIDE * SIDE, disks);
    assert_true(kept > SIDE * SIDE / 4 && kept < SIDE * SIDE && disks > 60);
    free(map);
    free(s);
}

// Back and forth, over the hemisphere and up to its rim.
static void places_and_ways_are_each_others_inverse(void **state)
{
    (void)state;
    for (float v = -.99f; v < 1; v += .06f)
        for (float u = -.99f; u < 1; u += .06f) {
            const f3 way = way_of_place(u, v), place = place_of_way(f3_scale(way, 7));
            assert_true(way.z > 0);
            assert_true(fabsf(place.x - u) < 1e-6f && fabsf(place.y - v) < 1e-6f);
            assert_true(fabsf(place.z - f3_length(way)) < 1e-6f);
        }
}

// A disk a metre up, over a receiver two metres up that looks down, and beside its plane.
static void planes_decide(void **state)
{
    (void)state;
    const f3 disk = f3_of(0, 0, 1), up = f3_of(0, 0, 1), down = f3_of(0, 0, -1);
    const f3 behind = f3_of(.1f, 0, 2), before = f3_of(.1f, 0, .9f), in_plane = f3_of(.1f, 0, 1);
    assert_true(hides(disk, up, .04f, behind, down, .1f));
    assert_true(hides(disk, down, .04f, behind, down, .1f)); // whichever way it faces
    assert_false(hides(disk, up, .04f, before, down, .1f));
    assert_false(hides(disk, up, .04f, in_plane, down, .1f));
    assert_false(hides(disk, up, .04f, behind, up, .1f)); // whose own back is in the way
    // A little behind is still the same surface, farther is not.
    assert_false(hides(disk, up, .04f, f3_of(.1f, 0, 1.005f), down, .1f));
    assert_true(hides(disk, up, .04f, f3_of(.1f, 0, 1.05f), down, .1f));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_width_has_the_same_bits),
        cmocka_unit_test(no_texel_of_a_disk_is_missed),
        cmocka_unit_test(places_and_ways_are_each_others_inverse),
        cmocka_unit_test(planes_decide),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
