// The processor's loops (pass/native): the same bits from every width of vectors that this machine
// has, the sums that the formulas say, in double precision, and nothing for who is not lit.

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/pool.h"
#include "pass/direct_look.h"
#include "pass/native/native.h"
#include "pass/native_lists.h"
#include "pass/vpl_groups.h"
#include "shared/vpl.h"
#include "shared/vpl_tree.h"

#define VPLS     2100u // two ranges of sums and a part, that ends within a block
#define IN_PLANE 7u    // every so many VPLs lie in a wall that receivers lie in, too

struct stage {
    struct bd_receivers receivers;
    struct bd_vec4 vpls[VPLS * BD_VPL_VEC4S], quads[VPLS * BD_VPL_QUAD_VEC4S];
};

static uint64_t state;

static float chance(void) // [-1, 1]
{
    state = state * UINT64_C(6364136223846793005) + 1442695040888963407u;
    return (float)((double)(state >> 40) / (1 << 23) - 1);
}

static struct bd_vec4 unit(void)
{
    struct bd_vec4 v = {chance(), chance(), chance(), 0};
    const float length = sqrtf(v.x * v.x + v.y * v.y + v.z * v.z);
    return (struct bd_vec4){v.x / length, v.y / length, v.z / length, 0};
}

static void put(struct bd_lanes3 *lanes, uint32_t i, struct bd_vec4 v)
{
    lanes->x[i] = v.x;
    lanes->y[i] = v.y;
    lanes->z[i] = v.z;
}

static void set_receivers(struct bd_receivers *r)
{
    for (uint32_t i = 0; i < BD_LANES; i++) {
        const struct bd_vec4 up = {0, 0, 1, 0}, n = i % 3 ? unit() : up;
        put(&r->position, i, (struct bd_vec4){chance(), chance(), i % 3 ? chance() : 0, 0});
        put(&r->normal, i, n);
        put(&r->normal_geometric, i, n);
        r->lit[i] = i % 5 != 0;
        r->radius[i] = 0.01f * (float)(i % 4);
        r->off_plane[i] = (float)(i % 2);
    }
    r->position.x[0] = NAN; // of nothing that was seen
}

// A square of .05, with a limit of about three times that.
static void set_vpl(struct stage *s, uint32_t v, struct bd_vec4 at, struct bd_vec4 n)
{
    struct bd_vec4 *vpl = &s->vpls[v * BD_VPL_VEC4S], *quad = &s->quads[v * BD_VPL_QUAD_VEC4S];
    const struct bd_vec4 side =
        fabsf(n.x) < 0.5f ? (struct bd_vec4){0, n.z, -n.y, 0} : (struct bd_vec4){-n.z, 0, n.x, 0};
    const float scale = 0.05f / sqrtf(side.x * side.x + side.y * side.y + side.z * side.z);
    const struct bd_vec4 u = {side.x * scale, side.y * scale, side.z * scale, 100};
    vpl[0] = (struct bd_vec4){at.x, at.y, at.z, 0.01f};
    vpl[1] = (struct bd_vec4){n.x, n.y, n.z, 0.02f};
    vpl[2] = (struct bd_vec4){0.5f + fabsf(chance()), fabsf(chance()), 0.1f, 0};
    quad[0] = u;
    quad[1] =
        (struct bd_vec4){n.y * u.z - n.z * u.y, n.z * u.x - n.x * u.z, n.x * u.y - n.y * u.x, 0};
}

static void set_vpls(struct stage *s)
{
    for (uint32_t v = 0; v < VPLS; v++) {
        const struct bd_vec4 up = {0, 0, 1, 0}, n = v % IN_PLANE ? unit() : up;
        const struct bd_vec4 at = {chance(), chance(), v % IN_PLANE ? chance() : 0, 0};
        set_vpl(s, v, at, n);
    }
}

static struct stage *set_stage(void)
{
    struct stage *s = calloc(1, sizeof *s);
    assert_non_null(s);
    state = 1;
    set_receivers(&s->receivers);
    set_vpls(s);
    return s;
}

static struct bd_receiver_light gather(const struct bd_native_loops *loops, const struct stage *s,
                                       struct bd_native_wishes wishes)
{
    const struct bd_native_vpls vpls = {s->vpls, s->quads, 0, VPLS};
    const struct bd_native_hidden none = {0};
    struct bd_receiver_light light;
    memset(&light, 0, sizeof light);
    loops->gather(&s->receivers, &vpls, &none, &wishes, &light);
    return light;
}

static const struct bd_native_wishes wishes[] = {
    {false, false, false}, {true, false, false}, {false, true, false},
    {true, true, false},   {false, true, true},  {true, true, true},
};
#define WISHES (sizeof wishes / sizeof *wishes)

static void every_width_has_the_same_bits(void **unused)
{
    (void)unused;
    struct stage *s = set_stage();
    const char *width;
    const struct bd_native_loops *narrowest = bd_native_loops_at(0, &width);
    for (uint32_t w = 1; bd_native_loops_at(w, &width) || width; w++) {
        const struct bd_native_loops *loops = bd_native_loops_at(w, &width);
        print_message("%s: %s\n", width, loops ? "compared" : "this machine has not");
        for (size_t i = 0; loops && i < WISHES; i++) {
            const struct bd_receiver_light a = gather(narrowest, s, wishes[i]);
            const struct bd_receiver_light b = gather(loops, s, wishes[i]);
            assert_memory_equal(&a, &b, sizeof a);
        }
    }
    free(s);
}

// --- specular lobes -----------------------------------------------------------------------------

#define WORDS ((VPLS + 31) / 32)

// Viewers are above their receivers.
static struct bd_glossy_receivers set_surfaces(const struct bd_receivers *r)
{
    struct bd_glossy_receivers g;
    state = 2;
    for (uint32_t i = 0; i < BD_LANES; i++) {
        const struct bd_vec4 v = unit();
        const bool below = v.x * r->normal.x[i] + v.y * r->normal.y[i] + v.z * r->normal.z[i] < 0;
        put(&g.viewer, i, below ? (struct bd_vec4){-v.x, -v.y, -v.z, 0} : v);
        put(&g.base_color, i,
            (struct bd_vec4){fabsf(chance()), fabsf(chance()), fabsf(chance()), 0});
        g.metallic[i] = i % 4 ? fabsf(chance()) : 0;
        g.roughness[i] = i % 6 ? fabsf(chance()) : 0;
        g.f0_dielectric[i] = 0.04f;
        g.has_lobe[i] = i % 7 != 0;
    }
    return g;
}

static struct bd_lanes3 gather_glossy(const struct bd_native_loops *loops, const struct stage *s,
                                      const uint32_t *hidden, bool near_patches)
{
    const struct bd_glossy_receivers surfaces = set_surfaces(&s->receivers);
    const struct bd_native_vpls vpls = {s->vpls, s->quads, 0, VPLS};
    const struct bd_native_hidden some = {hidden, hidden ? WORDS : 0};
    const struct bd_native_wishes wish = {near_patches, false, false};
    struct bd_lanes3 light;
    memset(&light, 0, sizeof light);
    loops->gather_glossy(&s->receivers, &surfaces, &vpls, &some, &wish, &light);
    return light;
}

// From odd lanes.
static uint32_t *some_hidden(void)
{
    uint32_t *bits = calloc((size_t)WORDS * BD_LANES, sizeof *bits);
    assert_non_null(bits);
    for (uint32_t lane = 1; lane < BD_LANES; lane += 2)
        for (uint32_t w = 0; w < WORDS; w++) bits[lane * WORDS + w] = 0x9249u << w % 16;
    return bits;
}

static void every_width_has_the_same_lobes(void **unused)
{
    (void)unused;
    struct stage *s = set_stage();
    uint32_t *hidden = some_hidden();
    const char *width;
    for (uint32_t w = 1; bd_native_loops_at(w, &width) || width; w++) {
        const struct bd_native_loops *loops = bd_native_loops_at(w, &width);
        for (int k = 0; loops && k < 4; k++) {
            const uint32_t *bits = k & 1 ? hidden : NULL;
            const struct bd_lanes3 a =
                gather_glossy(bd_native_loops_at(0, &width), s, bits, (k & 2) != 0);
            const struct bd_lanes3 b = gather_glossy(loops, s, bits, (k & 2) != 0);
            assert_memory_equal(&a, &b, sizeof a);
        }
    }
    free(hidden);
    free(s);
}

// What is hidden from a lane is as if it was not in the list, near or far.
static void hidden_vpls_have_no_lobes(void **unused)
{
    (void)unused;
    struct stage *s = set_stage(), *other = set_stage();
    uint32_t *hidden = some_hidden();
    for (uint32_t v = 0; v < VPLS; v++)
        if (hidden[WORDS + v / 32] >> v % 32 & 1)
            other->vpls[v * BD_VPL_VEC4S + 2] = (struct bd_vec4){0};
    for (int near = 0; near < 2; near++) {
        const struct bd_lanes3 all = gather_glossy(bd_native_loops(), s, NULL, near);
        const struct bd_lanes3 seen = gather_glossy(bd_native_loops(), s, hidden, near);
        const struct bd_lanes3 without = gather_glossy(bd_native_loops(), other, NULL, near);
        uint32_t differ = 0;
        for (uint32_t i = 0; i < BD_LANES; i++) {
            assert_true(seen.x[i] == (i % 2 ? without.x[i] : all.x[i]));
            assert_true(seen.z[i] == (i % 2 ? without.z[i] : all.z[i]));
            differ += all.x[i] != without.x[i];
        }
        assert_true(differ > BD_LANES / 2);
    }
    free(hidden);
    free(other);
    free(s);
}

// --- a few of a list ----------------------------------------------------------------------------

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

// --- a tree -------------------------------------------------------------------------------------

#define LEAF_SIDE   32u
#define LEAVES      (LEAF_SIDE * LEAF_SIDE)
#define NODES       ((4 * LEAVES - 1) / 3)
#define NODE_BYTES  (BD_TREE_NODE_VEC4S * sizeof(struct bd_vec4))
#define NODE_AT(i)  ((size_t)(i)*BD_TREE_NODE_VEC4S)
#define DARK_PERIOD 7u // every so many leaves send nothing

// Level by level from the leaves, `at_once` nodes in a call.
static struct bd_vec4 *build_tree(const struct bd_native_loops *loops, const struct stage *s,
                                  uint32_t at_once, bool directional)
{
    struct bd_vec4 *nodes = malloc(NODES * NODE_BYTES);
    struct bd_native_leaves leaves = {.vpls = s->vpls,
                                      .quads = s->quads,
                                      .side = LEAF_SIDE,
                                      .light = {0.1f, 0.2f, 0.9f, 0},
                                      .directional = directional};
    assert_non_null(nodes);
    uint32_t level_nodes = LEAVES, first = NODES - LEAVES;
    for (uint32_t i = 0; i < LEAVES; i += at_once) {
        leaves.first = i;
        leaves.count = LEAVES - i < at_once ? LEAVES - i : at_once;
        loops->make_leaves(&leaves, &nodes[NODE_AT(first + i)]);
    }
    while (level_nodes > 1) {
        const uint32_t below = first;
        level_nodes /= 4;
        first -= level_nodes;
        for (uint32_t i = 0; i < level_nodes; i += at_once)
            loops->join_nodes(&nodes[NODE_AT(below + 4 * i)],
                              level_nodes - i < at_once ? level_nodes - i : at_once,
                              &nodes[NODE_AT(first + i)]);
    }
    return nodes;
}

static struct stage *set_dark_stage(void)
{
    struct stage *s = set_stage();
    for (uint32_t v = 0; v < VPLS; v += DARK_PERIOD)
        s->vpls[v * BD_VPL_VEC4S + 2] = (struct bd_vec4){0};
    return s;
}

static void every_width_builds_the_same_tree(void **unused)
{
    (void)unused;
    struct stage *s = set_dark_stage();
    const char *width;
    for (int directional = 0; directional < 2; directional++) {
        struct bd_vec4 *a = build_tree(bd_native_loops_at(0, &width), s, BD_LANES, directional);
        for (uint32_t w = 1; bd_native_loops_at(w, &width) || width; w++) {
            const struct bd_native_loops *loops = bd_native_loops_at(w, &width);
            if (!loops) continue;
            struct bd_vec4 *b = build_tree(loops, s, BD_LANES, directional);
            assert_memory_equal(a, b, NODES * NODE_BYTES);
            free(b);
        }
        free(a);
    }
    free(s);
}

// Nor does it matter how many nodes are made at once.
static void a_tree_in_parts_is_the_same_tree(void **unused)
{
    (void)unused;
    struct stage *s = set_dark_stage();
    struct bd_vec4 *a = build_tree(bd_native_loops(), s, BD_LANES, false);
    struct bd_vec4 *b = build_tree(bd_native_loops(), s, 37, false);
    assert_memory_equal(a, b, NODES * NODE_BYTES);
    free(a);
    free(b);
    free(s);
}

static void a_list_in_parts_is_the_same_list(void **unused)
{
    (void)unused;
    struct stage *s = set_stage();
    const struct bd_receiver_light whole = gather(bd_native_loops(), s, wishes[WISHES - 1]);
    struct bd_receiver_light parts;
    memset(&parts, 0, sizeof parts);
    for (uint32_t first = 0; first < VPLS; first += 1024) {
        const uint32_t end = first + 1024 < VPLS ? first + 1024 : VPLS;
        const struct bd_native_vpls vpls = {s->vpls, s->quads, first, end};
        const struct bd_native_hidden none = {0};
        bd_native_loops()->gather(&s->receivers, &vpls, &none, &wishes[WISHES - 1], &parts);
    }
    assert_memory_equal(&whole, &parts, sizeof whole);
    free(s);
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static bool is_above(double height, double r2)
{
    return height > 1e-5 && height * height > 4e-8 * r2;
}

// From the patch's centre at `to`, by a sum over points of the patch.
static double patch_integral(const double n[3], const double to[3], const double normal[3],
                             const struct bd_vec4 *quad)
{
    enum { SIDE = 160 };
    double sum = 0;
    for (int y = 0; y < SIDE; y++) {
        for (int x = 0; x < SIDE; x++) {
            const double a = (2 * x + 1.0) / SIDE - 1, b = (2 * y + 1.0) / SIDE - 1;
            const double at[3] = {to[0] + a * quad->x + b * quad[1].x,
                                  to[1] + a * quad->y + b * quad[1].y,
                                  to[2] + a * quad->z + b * quad[1].z};
            const double r2 = dot(at, at);
            sum += fmax(dot(n, at), 0) * fmax(dot(normal, at), 0) / (M_PI * r2 * r2);
        }
    }
    return sum / (SIDE * SIDE);
}

// Of the disks alone, or with patches where they are near: algorithms.md A2.2.
static double expected_red(const struct stage *s, uint32_t i, bool near_patches)
{
    const struct bd_receivers *r = &s->receivers;
    const double n[3] = {r->normal.x[i], r->normal.y[i], r->normal.z[i]};
    double sum = 0;
    for (uint32_t v = 0; v < VPLS; v++) {
        const struct bd_vec4 *vpl = &s->vpls[v * BD_VPL_VEC4S];
        const double to[3] = {(double)vpl->x - r->position.x[i], (double)vpl->y - r->position.y[i],
                              (double)vpl->z - r->position.z[i]};
        const double normal[3] = {-vpl[1].x, -vpl[1].y, -vpl[1].z}, r2 = dot(to, to);
        const double here = dot(n, to), there = dot(normal, to);
        if (!is_above(here, r2) || !is_above(there, r2)) continue;
        sum += near_patches && r2 < vpl[1].w
                   ? vpl[2].x * patch_integral(n, to, normal, &s->quads[v * BD_VPL_QUAD_VEC4S])
                   : vpl[2].x * here * there / (r2 * (M_PI * r2 + vpl->w));
    }
    return sum;
}

static void sums_are_what_the_formula_says(void **unused)
{
    (void)unused;
    struct stage *s = set_stage();
    const struct bd_receiver_light light = gather(bd_native_loops(), s, wishes[2]);
    for (uint32_t i = 0; i < BD_LANES; i++) {
        const struct bd_lanes3 *e = &light.irradiance, *v = &light.vector;
        if (s->receivers.lit[i] == 0) {
            assert_true(e->x[i] == 0 && e->y[i] == 0 && e->z[i] == 0 && v->x[i] == 0);
            continue;
        }
        const double expected = expected_red(s, i, false);
        assert_true(expected > 0.1);
        assert_float_equal(e->x[i] / expected, 1, 3e-6);
        // The vector's dot product with the normal is the irradiance.
        const struct bd_lanes3 *n = &s->receivers.normal;
        const float along = v->x[i] * n->x[i] + v->y[i] * n->y[i] + v->z[i] * n->z[i];
        assert_float_equal(along / (e->x[i] + e->y[i] + e->z[i]), 1, 1e-5);
    }
    free(s);
}

// Appendix B of glTF 2.0 as it is printed, for red. Both directions are above n.
static double printed_brdf(double base, double metallic, double alpha, const double n[3],
                           const double l[3], const double v[3])
{
    double h[3] = {l[0] + v[0], l[1] + v[1], l[2] + v[2]};
    const double length = sqrt(dot(h, h)), a2 = alpha * alpha;
    for (int c = 0; c < 3; c++) h[c] /= length;
    const double n_h = dot(n, h), n_l = dot(n, l), n_v = dot(n, v), g = pow(1 - dot(v, h), 5);
    const double distribution = a2 / (M_PI * pow(n_h * n_h * (a2 - 1) + 1, 2));
    const double visibility =
        0.5 / (n_l * sqrt(n_v * n_v * (1 - a2) + a2) + n_v * sqrt(n_l * n_l * (1 - a2) + a2));
    const double specular = distribution * visibility, fresnel = 0.04 + 0.96 * g;
    const double dielectric = base / M_PI * (1 - fresnel) + specular * fresnel;
    return dielectric * (1 - metallic) + specular * (base + (1 - base) * g) * metallic;
}

// Without the diffuse lobe's limit, which dark colours do not reach.
static double expected_glossy_red(const struct stage *s, const struct bd_glossy_receivers *g,
                                  uint32_t i)
{
    const struct bd_receivers *r = &s->receivers;
    const double n[3] = {r->normal.x[i], r->normal.y[i], r->normal.z[i]};
    const double v[3] = {g->viewer.x[i], g->viewer.y[i], g->viewer.z[i]};
    const double base = g->base_color.x[i], metallic = g->metallic[i];
    const double roughness = fmax((double)g->roughness[i], 0.25);
    double sum = 0;
    for (uint32_t k = 0; k < VPLS; k++) {
        const struct bd_vec4 *vpl = &s->vpls[k * BD_VPL_VEC4S];
        double to[3] = {(double)vpl->x - r->position.x[i], (double)vpl->y - r->position.y[i],
                        (double)vpl->z - r->position.z[i]};
        const double normal[3] = {-vpl[1].x, -vpl[1].y, -vpl[1].z}, r2 = dot(to, to);
        const double here = dot(n, to), there = dot(normal, to);
        if (!is_above(here, r2) || !is_above(there, r2)) continue;
        const double light = vpl[2].x * here * there / (r2 * (M_PI * r2 + vpl->w));
        for (int c = 0; c < 3; c++) to[c] /= sqrt(r2);
        sum += light * (printed_brdf(base, metallic, roughness * roughness, n, to, v) -
                        base * (1 - metallic) / M_PI);
    }
    return sum;
}

static void lobes_are_what_the_formula_says(void **unused)
{
    (void)unused;
    struct stage *s = set_stage();
    const struct bd_glossy_receivers surfaces = set_surfaces(&s->receivers);
    const struct bd_lanes3 light = gather_glossy(bd_native_loops(), s, NULL, false);
    uint32_t compared = 0;
    for (uint32_t i = 0; i < BD_LANES; i++) {
        if (s->receivers.lit[i] == 0 || surfaces.has_lobe[i] == 0) {
            assert_true(light.x[i] == 0 && light.y[i] == 0 && light.z[i] == 0);
            continue;
        }
        if (surfaces.base_color.x[i] * (1 - surfaces.metallic[i]) > 0.1f) continue; // is limited
        assert_float_equal(light.x[i] / expected_glossy_red(s, &surfaces, i), 1, 1e-4);
        compared++;
    }
    assert_true(compared >= 10);
    free(s);
}

static void near_patches_are_patches(void **unused)
{
    (void)unused;
    struct stage *s = set_stage();
    const struct bd_receiver_light disks = gather(bd_native_loops(), s, wishes[0]);
    const struct bd_receiver_light patches = gather(bd_native_loops(), s, wishes[1]);
    double most = 0;
    for (uint32_t i = 0; i < BD_LANES; i++) {
        if (s->receivers.lit[i] == 0) continue;
        const double expected = expected_red(s, i, true);
        assert_float_equal(patches.irradiance.x[i] / expected, 1, 1e-3);
        most = fmax(most, fabs(disks.irradiance.x[i] / expected - 1));
    }
    print_message("without patches %.3f off at worst\n", most);
    assert_true(most > 0.05);
    free(s);
}

// What is hidden from a lane is as if it was not in the list: its flux is 0 in another one.
static void hidden_vpls_give_nothing(void **unused)
{
    (void)unused;
    const uint32_t words = (VPLS + 31) / 32, lane = 1;
    uint32_t *bits = calloc((size_t)words * BD_LANES, sizeof *bits);
    struct stage *s = set_stage();
    const struct bd_native_vpls vpls = {s->vpls, s->quads, 0, VPLS};
    const struct bd_native_hidden some = {bits, words};
    assert_non_null(bits);
    for (uint32_t w = 0; w < words; w++) bits[lane * words + w] = 0x9249u << w % 16;
    for (size_t k = 0; k < WISHES; k++) {
        struct bd_receiver_light seen, expected;
        const struct bd_receiver_light all = gather(bd_native_loops(), s, wishes[k]);
        memset(&seen, 0, sizeof seen);
        bd_native_loops()->gather(&s->receivers, &vpls, &some, &wishes[k], &seen);
        struct stage *other = malloc(sizeof *other);
        assert_non_null(other);
        *other = *s;
        for (uint32_t v = 0; v < VPLS; v++)
            if (bits[lane * words + v / 32] >> v % 32 & 1)
                other->vpls[v * BD_VPL_VEC4S + 2] = (struct bd_vec4){0};
        expected = gather(bd_native_loops(), other, wishes[k]);
        assert_true(seen.irradiance.x[lane] == expected.irradiance.x[lane]);
        assert_true(seen.vector.y[lane] == expected.vector.y[lane]);
        assert_true(seen.spread[lane] == expected.spread[lane]);
        assert_true(seen.irradiance.x[lane] < all.irradiance.x[lane]);
        assert_true(seen.irradiance.x[2] == all.irradiance.x[2]);
        free(other);
    }
    free(bits);
    free(s);
}

// --- direct light -------------------------------------------------------------------------------

#define PIXELS_X   13u // a group is several rows, and ends within one
#define PIXELS     (BD_LANES * 2)
#define MAP_TEXELS 16u

struct scenery {
    float depth[PIXELS], normals[PIXELS * 4];
    uint16_t albedo[PIXELS * 4], material[PIXELS * 4];
    uint32_t triangle[PIXELS];
    struct bd_view view;
    struct bd_light_uniform lights[4]; // a point light, a spot of one face and of six, a sun
};

static uint16_t unorm(void)
{
    return (uint16_t)(65535 * fabsf(chance()));
}

static void set_lights(struct scenery *s)
{
    static const struct {
        uint32_t kind, face_count;
    } kinds[4] = {{BD_LIGHT_KIND_POINT, 6},
                  {BD_LIGHT_KIND_SPOT, 1},
                  {BD_LIGHT_KIND_SPOT, 6},
                  {BD_LIGHT_KIND_DIRECTIONAL, 1}};
    for (int k = 0; k < 4; k++)
        s->lights[k] = (struct bd_light_uniform){
            .position = {.1f, .3f, 1, 0},
            .direction = {0, 0, -1, 0},
            .intensity = {3, 2, 1, 0},
            .axis_x = {1, 0, 0, 0},
            .axis_y = {0, 1, 0, 0},
            .axis_z = {0, 0, 1, 0},
            .inverse_range = .2f,
            .distance = 2,
            .half_width = 1,
            .half_height = 1,
            .cos_outer = kinds[k].kind == BD_LIGHT_KIND_SPOT ? .6f : -3,
            .per_cosine = kinds[k].face_count == 1 ? 5 : 1,
            .kind = kinds[k].kind,
            .face_count = kinds[k].face_count,
            .face_side_px = MAP_TEXELS,
        };
}

// Seen from above, below the lights: surfaces that all look somewhere up.
static struct scenery *set_scenery(void)
{
    struct scenery *s = calloc(1, sizeof *s);
    assert_non_null(s);
    state = 3;
    s->view = (struct bd_view){.position = {0, 0, 3, 0},
                               .axis_x = {1, 0, 0, .4f},
                               .axis_y = {0, 1, 0, .4f},
                               .axis_z = {0, 0, 1, .1f},
                               .sample_px = {.5f, .5f, 0, 0},
                               .size_px = {PIXELS_X, PIXELS / PIXELS_X + 1, 0, 0}};
    for (uint32_t i = 0; i < PIXELS; i++) {
        s->depth[i] = 3 + .5f * chance();
        for (int c = 0; c < 4; c++) s->normals[4 * i + c] = .4f * chance();
        for (int c = 0; c < 4; c++) s->albedo[4 * i + c] = unorm();
        s->material[4 * i] = unorm();
        s->material[4 * i + 1] = 2621;
        s->material[4 * i + 2] = i % 9 == 0 ? 65535 : 0; // it does not ask for light
        s->material[4 * i + 3] = i % 7 == 0 ? 0 : 65535; // nothing is there
        s->triangle[i] = i;
    }
    set_lights(s);
    return s;
}

static struct bd_native_aim aim(const struct bd_native_loops *loops, const struct scenery *s,
                                uint32_t light, bool lambert)
{
    const struct bd_native_pixels pixels = {s->depth,    s->normals, s->albedo, s->material,
                                            s->triangle, &s->view,   0,         PIXELS - 3};
    struct bd_native_aim out;
    memset(&out, 0, sizeof out);
    loops->aim(&pixels, BD_LANES, &s->lights[light], lambert, &out);
    return out;
}

static void every_width_aims_alike(void **unused)
{
    (void)unused;
    struct scenery *s = set_scenery();
    const char *width;
    for (uint32_t w = 1; bd_native_loops_at(w, &width) || width; w++) {
        const struct bd_native_loops *loops = bd_native_loops_at(w, &width);
        for (uint32_t k = 0; loops && k < 8; k++) {
            const struct bd_native_aim a = aim(bd_native_loops_at(0, &width), s, k / 2, k % 2);
            const struct bd_native_aim b = aim(loops, s, k / 2, k % 2);
            assert_memory_equal(&a, &b, sizeof a);
        }
    }
    free(s);
}

// Of a matt pixel: intensity over the distance's square, times base colour / pi.
static void light_is_what_the_formula_says(void **unused)
{
    (void)unused;
    struct scenery *s = set_scenery();
    const struct bd_native_aim a = aim(bd_native_loops(), s, 0, true);
    uint32_t lit = 0;
    for (uint32_t i = 0; i < BD_LANES; i++) {
        const uint32_t pixel = BD_LANES + i, x = pixel % PIXELS_X, y = pixel / PIXELS_X;
        const double depth = s->depth[pixel], height = (double)s->view.size_px.y;
        const double px = (2 * (x + .5) / PIXELS_X - 1) * .4f * depth - .1f;
        const double py = (1 - 2 * (y + .5) / height) * .4f * depth - .3f, pz = 3 - depth - 1;
        const double ex = s->normals[4 * pixel], ey = s->normals[4 * pixel + 1];
        const double ez = 1 - fabs(ex) - fabs(ey), r2 = px * px + py * py + pz * pz;
        const double cosine =
            -(ex * px + ey * py + ez * pz) / sqrt(r2 * (ex * ex + ey * ey + ez * ez));
        const double window = 1 - r2 * r2 * pow(.2f, 4);
        const double expected = 3 * cosine * window / r2 * s->albedo[4 * pixel] / 65535 / M_PI;
        if (pixel >= PIXELS - 3 || pixel % 9 == 0 || pixel % 7 == 0) assert_false(a.is_lit[i]);
        if (!a.is_lit[i]) continue;
        assert_true(fabs(a.radiance.x[i] - expected) <= 1e-5 * expected);
        lit++;
    }
    assert_true(lit > BD_LANES / 2);
    free(s);
}

// A light is above all pixels: the middle of the face that looks down is below it, and y goes down.
static void texels_are_where_they_are_seen(void **unused)
{
    (void)unused;
    struct scenery *s = set_scenery();
    const struct bd_native_aim a = aim(bd_native_loops(), s, 0, true);
    uint32_t below = 0;
    for (uint32_t i = 0; i < BD_LANES; i++) {
        const double side = MAP_TEXELS, down = -(a.origin.z[i] - 1.0);
        const double aside = fmax(fabs(a.origin.x[i] - .1), fabs(a.origin.y[i] - .3));
        if (!a.is_lit[i]) continue;
        assert_true((a.face[i] == 5) == (aside < down));
        if (a.face[i] != 5) continue;
        assert_true(fabs(a.texel.x[i] - side / 2 * (1 + (a.origin.x[i] - .1) / down)) < 1e-4);
        assert_true(fabs(a.texel.y[i] - side / 2 * (1 - (a.origin.y[i] - .3) / down)) < 1e-4);
        below++;
    }
    assert_true(below > BD_LANES / 4);
    free(s);
}

static void set_pairs(struct bd_native_pairs *p)
{
    state = 4;
    for (uint32_t i = 0; i < BD_LANES; i++) {
        const struct bd_vec4 from = {chance(), chance(), -1, 0}, to = {chance(), chance(), 2, 0};
        put(&p->origin, i, from);
        put(&p->span, i, to);
        put(&p->corner, i, (struct bd_vec4){-1, -1, i % 4 ? .1f * chance() : 0, 0});
        const float size = i % 8 == 7 ? .01f : 2; // of a texel, or less
        put(&p->edge1, i, i % 5 ? (struct bd_vec4){size, 0, 0, 0} : (struct bd_vec4){0});
        put(&p->edge2, i, (struct bd_vec4){0, size, size * .05f * chance(), 0});
        p->texel_side[i] = i % 2 ? .01f : .5f;
    }
}

static void every_width_asks_alike(void **unused)
{
    (void)unused;
    struct bd_native_pairs pairs;
    const char *width;
    uint32_t a[BD_LANES], b[BD_LANES], counts[3] = {0};
    set_pairs(&pairs);
    bd_native_loops_at(0, &width)->ask(&pairs, a);
    for (uint32_t w = 1; bd_native_loops_at(w, &width) || width; w++) {
        if (!bd_native_loops_at(w, &width)) continue;
        bd_native_loops_at(w, &width)->ask(&pairs, b);
        assert_memory_equal(a, b, sizeof a);
    }
    for (uint32_t i = 0; i < BD_LANES; i++) {
        // In the triangle's plane, near z = 0, all that have an area: x + y below the diagonal.
        const float x = pairs.origin.x[i] + pairs.span.x[i] / 2;
        const float y = pairs.origin.y[i] + pairs.span.y[i] / 2;
        const bool inside = x > -1 && y > -1 && x + y < 0 && i % 5 && i % 8 != 7;
        const float margin = fminf(fabsf(x + y), fminf(fabsf(x + 1), fabsf(y + 1)));
        if (margin > .2f) assert_int_equal((a[i] & BD_PAIR_HIDES) != 0, inside);
        for (int c = 0; c < 3; c++) counts[c] += a[i] >> c & 1;
    }
    for (int c = 0; c < 3; c++) assert_in_range(counts[c], 1, BD_LANES - 1);
}

// --- what a shadow map names --------------------------------------------------------------------

#define OWN  1u // the pixel's triangle, in its plane
#define HIT  2u // what the segment meets
#define MISS 3u // what it does not, though the pixel lies behind its plane
#define MASK 0x80000000u

static const struct bd_vec4 around[] = {
    {-1, -1, 0, 0}, {4, 0, 0, 0},   {0, 4, 0, 0}, {-1, -1, .5f, 0}, {4, 0, 0, 0},
    {0, 4, 0, 0},   {5, 5, .5f, 0}, {4, 0, 0, 0}, {0, 4, 0, 0},
};

struct look_up {
    uint32_t ids[MAP_TEXELS * MAP_TEXELS];
    float x, y; // the pixel's texel
};

static bool arrives(const struct look_up *from)
{
    struct bd_native_aim aim = {.is_lit = {1}, .face = {5}, .triangle = {OWN}};
    struct bd_vec4 radiance[BD_LANES] = {{1, 1, 1, 0}};
    const struct bd_shadow_copy shadows = {{[5] = from->ids}, MAP_TEXELS, around};
    struct bd_shadow_rows rows[BD_DIRECT_FACES];
    put(&aim.span, 0, (struct bd_vec4){0, 0, 1, 0});
    put(&aim.radiance, 0, (struct bd_vec4){1, 2, 3, 0});
    aim.texel.x[0] = from->x;
    aim.texel.y[0] = from->y;
    aim.texel.side[0] = .1f;
    bd_direct_look(bd_native_loops(), &aim, &shadows, radiance);
    bd_direct_rows_of(&aim, MAP_TEXELS, rows);
    assert_true(rows[5].first == (from->y < 3 ? 0 : (uint32_t)from->y - 3));
    assert_true(rows[5].end == (from->y > 12 ? MAP_TEXELS : (uint32_t)from->y + 4));
    assert_true(rows[0].first >= rows[0].end);
    assert_true(radiance[0].z == 1 || radiance[0].z == 4);
    return radiance[0].z == 4;
}

static struct look_up look_up_of(uint32_t id, float x, float y)
{
    struct look_up l = {.x = x, .y = y};
    for (uint32_t i = 0; i < MAP_TEXELS * MAP_TEXELS; i++) l.ids[i] = id;
    return l;
}

static bool arrives_past(uint32_t around_it, int32_t x, int32_t y, uint32_t named)
{
    struct look_up l = look_up_of(around_it, 8.5f, 8.5f);
    l.ids[(8 + y) * (int32_t)MAP_TEXELS + 8 + x] = named;
    return arrives(&l);
}

static void a_texel_near_by_may_name_what_hides(void **unused)
{
    (void)unused;
    for (int32_t y = -4; y <= 4; y++) {
        for (int32_t x = -4; x <= 4; x++) {
            const bool near = abs(x) <= 3 && abs(y) <= 3, at = x == 0 && y == 0;
            assert_true(arrives_past(OWN, x, y, HIT) == !near);
            assert_true(arrives_past(0, x, y, HIT) == !near);
            assert_true(arrives_past(OWN, x, y, MISS));
            assert_true(arrives_past(OWN, x, y, MASK | HIT) == !at); // it has a hole there
            // Where none of the inner nine is open.
            const bool inner = abs(x) <= 1 && abs(y) <= 1;
            assert_true(arrives_past(MISS, x, y, OWN) == inner);
            assert_true(arrives_past(MASK | MISS, x, y, 0) == inner);
        }
    }
}

// Beyond its border a map goes on as it ends.
static void a_map_ends(void **unused)
{
    (void)unused;
    static const float at[] = {-5, -.5f, 0, 2.9f, 3, 12.9f, 13, 15.9f, 16.1f, 40, NAN};
    for (size_t i = 0; i < sizeof at / sizeof *at; i++) {
        for (int turned = 0; turned < 2; turned++) {
            const float x = turned ? 8 : at[i], y = turned && at[i] >= 0 && at[i] < 16 ? at[i] : 8;
            struct look_up open = look_up_of(OWN, x, y), hidden = look_up_of(HIT, x, y);
            assert_true(arrives(&open));
            assert_false(arrives(&hidden));
            const bool sees_corner = x < 4 && y < 4;
            open.ids[0] = HIT;
            assert_true(arrives(&open) == !sees_corner);
        }
    }
    struct look_up corner = look_up_of(OWN, 2.5f, 1.5f);
    corner.ids[0] = HIT;
    assert_false(arrives(&corner));
    struct look_up right = look_up_of(OWN, 14.5f, 8), left = look_up_of(OWN, -.5f, 8);
    for (uint32_t y = 0; y < MAP_TEXELS; y++) {
        right.ids[y * MAP_TEXELS] = HIT; // on the other side
        left.ids[y * MAP_TEXELS + 3] = HIT;
    }
    assert_true(arrives(&right) && arrives(&left));
}

#define SHARED_GROUPS 48u

struct shared {
    const struct stage *stage;
    struct bd_receiver_light light[SHARED_GROUPS];
};

// Every second group sees one VPL in three less.
static void light_group(void *user, uint32_t group)
{
    struct shared *s = user;
    const struct bd_native_wishes all = {true, true, true};
    const struct bd_native_vpls vpls = {s->stage->vpls, s->stage->quads, 0,
                                        group % 2 ? VPLS : VPLS * 2 / 3};
    const struct bd_native_hidden none = {0};
    bd_native_loops()->gather(&s->stage->receivers, &vpls, &none, &all, &s->light[group]);
}

static void any_number_of_threads_gives_the_same_bits(void **unused)
{
    (void)unused;
    struct stage *stage = set_stage();
    struct shared *alone = calloc(1, sizeof *alone), *together = calloc(1, sizeof *together);
    struct bd_pool *pool = bd_pool_create(4);
    assert_true(alone && together && pool);
    alone->stage = together->stage = stage;
    for (uint32_t i = 0; i < SHARED_GROUPS; i++) light_group(alone, i);
    assert_int_equal(bd_pool_run(pool, SHARED_GROUPS, light_group, NULL, together), BD_ERR_OK);
    assert_memory_equal(alone->light, together->light, sizeof alone->light);
    assert_memory_not_equal(&alone->light[0], &alone->light[1], sizeof *alone->light);
    bd_pool_destroy(&pool);
    free(together);
    free(alone);
    free(stage);
}

static void pixels_have_no_spread(void **unused)
{
    (void)unused;
    struct stage *s = set_stage();
    const struct bd_native_wishes both = {true, true, true}, vector = {true, true, false};
    const struct bd_receiver_light blocks = gather(bd_native_loops(), s, both);
    memset(s->receivers.radius, 0, sizeof s->receivers.radius);
    const struct bd_receiver_light pixels = gather(bd_native_loops(), s, both);
    const struct bd_receiver_light without = gather(bd_native_loops(), s, vector);
    assert_true(blocks.spread[1] != 0);
    assert_memory_equal(&pixels, &without, sizeof pixels);
    assert_memory_equal(&pixels.vector, &blocks.vector, sizeof pixels.vector);
    free(s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_width_has_the_same_bits),
        cmocka_unit_test(a_list_in_parts_is_the_same_list),
        cmocka_unit_test(every_width_builds_the_same_tree),
        cmocka_unit_test(a_tree_in_parts_is_the_same_tree),
        cmocka_unit_test(every_width_chooses_alike),
        cmocka_unit_test(groups_miss_nothing),
        cmocka_unit_test(a_few_stand_for_all),
        cmocka_unit_test(hidden_picks_give_nothing),
        cmocka_unit_test(every_width_has_the_same_lobes),
        cmocka_unit_test(hidden_vpls_have_no_lobes),
        cmocka_unit_test(lobes_are_what_the_formula_says),
        cmocka_unit_test(sums_are_what_the_formula_says),
        cmocka_unit_test(near_patches_are_patches),
        cmocka_unit_test(hidden_vpls_give_nothing),
        cmocka_unit_test(pixels_have_no_spread),
        cmocka_unit_test(every_width_aims_alike),
        cmocka_unit_test(light_is_what_the_formula_says),
        cmocka_unit_test(texels_are_where_they_are_seen),
        cmocka_unit_test(every_width_asks_alike),
        cmocka_unit_test(a_texel_near_by_may_name_what_hides),
        cmocka_unit_test(a_map_ends),
        cmocka_unit_test(any_number_of_threads_gives_the_same_bits),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
