// A few VPLs of a list by the processor's loops (pass/native/choose.c): every width chooses alike,
// a few stand for all, groups miss nothing.

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "pass/native_lists.h"
#include "pass/vpl_groups.h"
#include "tests/native/stage.h"
#include "tests/unit/cmocka_all.h"

#define RAYS       6u
#define GROUP_VPLS 32u // of two blocks
#define GROUPS     ((VPLS + GROUP_VPLS - 1) / GROUP_VPLS)

// VPLs of a group are neighbours, and most receivers are far from it.
static void set_neighbours(struct stage *s)
{
    for (uint32_t v = 0; v < VPLS; v++) {
        static struct bd_vec4 middle, normal;
        if (v % GROUP_VPLS == 0) middle = (struct bd_vec4){chance(), chance(), chance(), 0};
        if (v % GROUP_VPLS == 0) normal = unit();
        const struct bd_vec4 at = {middle.x + 0.03f * chance(), middle.y + 0.03f * chance(),
                                   middle.z + 0.03f * chance(), 0};
        struct bd_vec4 n = {normal.x + 0.2f * chance(), normal.y + 0.2f * chance(),
                            normal.z + 0.2f * chance(), 0};
        const float length = sqrtf(n.x * n.x + n.y * n.y + n.z * n.z);
        n = (struct bd_vec4){n.x / length, n.y / length, n.z / length, 0};
        set_vpl(s, v, at, n);
    }
}

struct chosen {
    float sums[GROUPS * BD_LANES];
    struct bd_native_pick picks[RAYS];
    struct bd_receiver_light light;
};

// as_one: groups are, where they are far.
static struct chosen *choose(const struct bd_native_loops *loops, const struct stage *s,
                             struct bd_native_wishes wish, bool as_one)
{
    struct chosen *chosen = calloc(1, sizeof *chosen);
    struct bd_vec4 *groups_of_vpls = calloc(GROUPS * BD_VPL_GROUP_VEC4S, sizeof *groups_of_vpls);
    struct bd_ray_starts starts = {.position = s->receivers.position,
                                   .normal_geometric = s->receivers.normal_geometric};
    const struct bd_native_vpls vpls = {s->vpls, s->quads, 0, VPLS};
    struct bd_native_block *blocks =
        bd_native_blocks_make(&vpls, (size_t)GROUPS * (GROUP_VPLS / BD_NATIVE_BLOCK));
    assert_true(chosen && groups_of_vpls && blocks);
    bd_vpl_groups_make(s->vpls, VPLS, GROUP_VPLS, groups_of_vpls);
    const struct bd_native_choice choice = {
        vpls, blocks, as_one ? groups_of_vpls : NULL, GROUP_VPLS, GROUPS, RAYS, 2};
    for (uint32_t i = 0; i < BD_LANES; i++) starts.place[i] = (float)i / BD_LANES;
    // In parts, as a pass takes them.
    const struct bd_native_part groups[] = {{0, 50}, {50, GROUPS}}, rays[] = {{0, 2}, {2, RAYS}};
    for (int k = 0; k < 2; k++)
        loops->weigh(&s->receivers, &choice, &wish, &groups[k], chosen->sums, &chosen->light);
    for (int k = 0; k < 2; k++)
        loops->choose(&s->receivers, &starts, &choice, &wish, &rays[k], chosen->sums,
                      chosen->picks);
    free(groups_of_vpls);
    free(blocks);
    return chosen;
}

static void every_width_chooses_alike(void **unused)
{
    (void)unused;
    struct stage *s = set_stage();
    set_neighbours(s);
    const char *width;
    for (uint32_t w = 1; bd_native_loops_at(w, &width) || width; w++) {
        const struct bd_native_loops *loops = bd_native_loops_at(w, &width);
        for (size_t k = 0; loops && k < 2 * WISHES; k++) {
            struct chosen *a = choose(bd_native_loops_at(0, &width), s, wishes[k / 2], k % 2);
            struct chosen *b = choose(loops, s, wishes[k / 2], k % 2);
            assert_memory_equal(a->sums, b->sums, sizeof a->sums);
            assert_memory_equal(a->picks, b->picks, sizeof a->picks);
            assert_memory_equal(&a->light, &b->light, sizeof a->light);
            const uint32_t none[BD_LANES * RAYS / 32 + 1] = {0};
            loops->sum_picks(&s->receivers, a->picks, RAYS, none, &a->light);
            bd_native_loops_at(0, &width)->sum_picks(&s->receivers, b->picks, RAYS, none,
                                                     &b->light);
            assert_memory_equal(&a->light, &b->light, sizeof a->light);
            free(a);
            free(b);
        }
    }
    free(s);
}

// The mean over places of what a few stand for is what all of them give: with every lane at the
// same spot, their places a lattice.
static void assert_a_few_stand_for_all(struct stage *s, bool as_one)
{
    struct bd_receivers *r = &s->receivers;
    for (uint32_t i = 0; i < BD_LANES; i++) {
        put(&r->position, i, (struct bd_vec4){0.3f, 0.2f, -0.1f, 0});
        put(&r->normal, i, (struct bd_vec4){0, 0.6f, 0.8f, 0});
        put(&r->normal_geometric, i, (struct bd_vec4){0, 0.6f, 0.8f, 0});
        r->lit[i] = 1;
    }
    const struct bd_native_wishes near = {true, true, false};
    const struct bd_receiver_light all = gather(bd_native_loops(), s, near);
    struct chosen *few = choose(bd_native_loops(), s, near, as_one);
    const uint32_t none[BD_LANES * RAYS / 32 + 1] = {0};
    bd_native_loops()->sum_picks(r, few->picks, RAYS, none, &few->light);
    double mean[3] = {0}, odd = 0;
    for (uint32_t i = 0; i < BD_LANES; i++) {
        mean[0] += few->light.irradiance.x[i] / BD_LANES;
        mean[1] += few->light.irradiance.y[i] / BD_LANES;
        mean[2] += few->light.vector.z[i] / BD_LANES;
        odd += fabsf(few->light.noise.x[i]) / BD_LANES;
    }
    assert_float_equal(mean[0] / all.irradiance.x[0], 1, 0.02);
    assert_float_equal(mean[1] / all.irradiance.y[0], 1, 0.02);
    assert_float_equal(mean[2] / all.vector.z[0], 1, 0.02);
    assert_true(odd > 1e-3 * mean[0]);
    free(few);
}

static void a_few_stand_for_all(void **unused)
{
    (void)unused;
    struct stage *s = set_stage();
    assert_a_few_stand_for_all(s, false);
    set_neighbours(s);
    assert_a_few_stand_for_all(s, false);
    assert_a_few_stand_for_all(s, true);
    free(s);
}

// Whoever is far from a group makes of it about what its VPLs give; more than 0 where one gives
// anything, and no less than a tenth of it, so that nothing stands for too much.
static void groups_miss_nothing(void **unused)
{
    (void)unused;
    struct stage *s = set_stage();
    set_neighbours(s);
    for (uint32_t i = 0; i < BD_LANES; i++) s->receivers.lit[i] = i > 0;
    struct chosen *each = choose(bd_native_loops(), s, wishes[0], false);
    struct chosen *as_one = choose(bd_native_loops(), s, wishes[0], true);
    uint32_t differ = 0, give = 0;
    for (uint32_t at = BD_LANES; at < GROUPS * BD_LANES; at++) {
        const float whole = as_one->sums[at] - as_one->sums[at - BD_LANES];
        const float sum = each->sums[at] - each->sums[at - BD_LANES];
        const float rounding = 1e-6f * each->sums[at];
        if (at % BD_LANES == 0 || !(sum > rounding)) continue;
        assert_true(whole > 0.1f * sum - rounding);
        differ += fabsf(whole / sum - 1) > 1e-3f;
        give++;
    }
    assert_true(differ > give / 2 && differ < give);
    free(each);
    free(as_one);
    free(s);
}

// Half of what is chosen is hidden: what is left is half of it, and in the halves where it was.
static void hidden_picks_give_nothing(void **unused)
{
    (void)unused;
    struct stage *s = set_stage();
    struct chosen *few = choose(bd_native_loops(), s, wishes[3], true);
    const uint32_t none[BD_LANES * RAYS / 32 + 1] = {0};
    uint32_t odd[BD_LANES * RAYS / 32 + 1];
    memset(odd, 0xaa, sizeof odd); // rays is even: the bits of odd places
    struct bd_receiver_light all = few->light, even = few->light;
    bd_native_loops()->sum_picks(&s->receivers, few->picks, RAYS, none, &all);
    bd_native_loops()->sum_picks(&s->receivers, few->picks, RAYS, odd, &even);
    for (uint32_t i = 0; i < BD_LANES; i++) {
        assert_true(even.irradiance.x[i] == even.noise.x[i]);
        assert_float_equal(even.irradiance.x[i], 0.5f * (all.irradiance.x[i] + all.noise.x[i]),
                           1e-4);
        assert_true(s->receivers.lit[i] > 0 || (all.irradiance.x[i] == 0 && all.vector.x[i] == 0));
        assert_true((few->picks[0].vpl[i] != BD_NATIVE_NO_VPL) == (s->receivers.lit[i] > 0));
    }
    free(few);
    free(s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_width_chooses_alike),
        cmocka_unit_test(groups_miss_nothing),
        cmocka_unit_test(a_few_stand_for_all),
        cmocka_unit_test(hidden_picks_give_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
