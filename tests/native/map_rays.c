// Which texels of a map rays go through (kernel/map_rays.h, pass/map_rays.h): each as often as it
// counts, no more than there is room for, and the same where something else is seen elsewhere.

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "lights/microbuffer.h"
#include "lights/sequence.h"
#include "pass/map_rays.h"
#include "tests/unit/cmocka_all.h"

#define SIDE    32u
#define TEXELS  (SIDE * SIDE)
#define RAYS    64u
#define CHANCES 20000u

struct fixture {
    struct bd_microbuffer map;
    struct bd_point_gather_inputs inputs;
    struct bd_map_rays rays;
    uint32_t seen[TEXELS];
    struct bd_map_ray chosen[BD_MAP_RAY_SLOTS(BD_MAP_RAYS_MAX)];
};

static int set_up(void **state)
{
    struct fixture *f = calloc(1, sizeof *f);
    struct bd_err_detail detail;
    if (bd_microbuffer_init(&f->map, SIDE, &detail)) return 1;
    f->inputs.rays = RAYS;
    f->rays = (struct bd_map_rays){.inputs = &f->inputs, .map = &f->map};
    for (uint32_t t = 0; t < TEXELS; t++) f->seen[t] = 7 * t;
    *state = f;
    return 0;
}

static int tear_down(void **state)
{
    struct fixture *f = *state;
    bd_microbuffer_finish(&f->map);
    free(f);
    return 0;
}

// A bright square, something dim, and nothing.
static float gives(uint32_t t)
{
    const uint32_t u = t % SIDE, v = t / SIDE;
    if (u >= 10 && u < 13 && v >= 20 && v < 22) return 5;
    return v < 8 ? .01f : 0;
}

static uint32_t choose(struct fixture *f, float brightened, uint32_t chance)
{
    float given[TEXELS];
    uint32_t count = 0;
    for (uint32_t t = 0; t < TEXELS; t++) given[t] = gives(t);
    given[TEXELS - 2] += brightened;
    memset(f->chosen, 0, sizeof f->chosen);
    bd_map_rays_choose(&f->rays, f3_of(.6f, 0, .8f), f->seen, given, chance, f->chosen);
    while (f->chosen[count].counts > 0) count++;
    return count;
}

static void texels_have_rays_as_often_as_they_count(void **state)
{
    struct fixture *f = *state;
    static double sums[TEXELS];
    double all = 0, groups[3] = {0}, sizes[3] = {0};
    for (uint32_t i = 0; i < CHANCES; i++) {
        const uint32_t count = choose(f, 0, bd_stirred(i));
        assert_true(count < BD_MAP_RAY_SLOTS(RAYS));
        for (uint32_t k = 0; k < count; k++)
            sums[f->chosen[k].texel] += (double)f->chosen[k].counts;
        all += count;
    }
    assert_float_equal(all / CHANCES, RAYS, .05);
    for (uint32_t t = 0; t < TEXELS; t++) {
        const int group = gives(t) > 1 ? 0 : gives(t) > 0 ? 1 : 2;
        const double size = fmax((double)f3_dot(f->map.weight[t], f3_of(.6f, 0, .8f)), 0);
        groups[group] += size * sums[t] / CHANCES;
        sizes[group] += size;
    }
    for (int group = 0; group < 3; group++) {
        print_message("    %.4f of what there is\n", groups[group] / sizes[group]);
        assert_float_equal(groups[group] / sizes[group], 1, .01);
    }
}

// Of the half that goes by light all but a hundredth or three: 6 texels of 20 shine, 14 are next to
// those.
static void what_is_next_to_what_is_bright_is_looked_at(void **state)
{
    struct fixture *f = *state;
    double shines = 0, next = 0, all = 0;
    for (uint32_t i = 0; i < 1000; i++) {
        const uint32_t count = choose(f, 0, bd_stirred(i));
        for (uint32_t k = 0; k < count; k++) {
            const uint32_t u = f->chosen[k].texel % SIDE, v = f->chosen[k].texel / SIDE;
            const bool near = u >= 9 && u < 14 && v >= 19 && v < 23;
            shines += gives(f->chosen[k].texel) > 1;
            next += near && gives(f->chosen[k].texel) < 1;
        }
        all += count;
    }
    assert_float_equal(shines / all, .15, .01);
    assert_float_equal(next / all, .35, .02);
}

static void rays_tell_what_they_stand_for(void **state)
{
    struct fixture *f = *state;
    for (uint32_t i = 0; i < 100; i++) {
        const uint32_t count = choose(f, 0, i);
        for (uint32_t k = 0; k < count; k++) {
            const struct bd_map_ray *ray = &f->chosen[k];
            const bool goes_on = k > 0 && ray->texel == ray[-1].texel;
            assert_int_equal(ray->seen, 7 * ray->texel);
            assert_int_equal(ray->of_texel, goes_on ? ray[-1].of_texel + 1 : 0);
            assert_true(k == 0 || ray->texel >= ray[-1].texel);
        }
    }
}

// One more texel shines, a hundredth of all: others' rays are nearly the same.
static void others_keep_their_rays(void **state)
{
    struct fixture *f = *state;
    uint32_t changed = 0, all = 0;
    for (uint32_t i = 0; i < 1000; i++) {
        uint8_t before[TEXELS] = {0}, after[TEXELS] = {0};
        uint32_t count = choose(f, 0, bd_stirred(i));
        for (uint32_t k = 0; k < count; k++) before[f->chosen[k].texel]++;
        all += count;
        count = choose(f, .3f, bd_stirred(i));
        for (uint32_t k = 0; k < count; k++) after[f->chosen[k].texel]++;
        for (uint32_t t = 0; t < TEXELS; t++) changed += (uint32_t)abs(before[t] - after[t]);
    }
    print_message("    %.3f of them change\n", (double)changed / all);
    assert_true(changed < .08 * all);
}

// The most that may be asked for.
static void many_rays_have_room(void **state)
{
    struct fixture *f = *state;
    f->inputs.rays = BD_MAP_RAYS_MAX;
    double all = 0;
    for (uint32_t i = 0; i < 200; i++) {
        const uint32_t count = choose(f, 0, bd_stirred(i));
        assert_true(count < BD_MAP_RAY_SLOTS(BD_MAP_RAYS_MAX));
        all += count;
    }
    assert_float_equal(all / 200, BD_MAP_RAYS_MAX, 2);
    f->inputs.rays = RAYS;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(texels_have_rays_as_often_as_they_count),
        cmocka_unit_test(what_is_next_to_what_is_bright_is_looked_at),
        cmocka_unit_test(rays_tell_what_they_stand_for),
        cmocka_unit_test(others_keep_their_rays),
        cmocka_unit_test(many_rays_have_room),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
