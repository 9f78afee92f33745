// Light of lists of VPLs by the processor's loops (pass/native/gather.c): the same bits from every
// width of vectors that this machine has and any number of threads, the sums that the formulas say,
// in double precision, and nothing for who is not lit.

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/pool.h"
#include "tests/native/stage.h"
#include "tests/unit/cmocka_all.h"

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
        if (!is_above_plane(here, r2) || !is_above_plane(there, r2)) continue;
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
        cmocka_unit_test(sums_are_what_the_formula_says),
        cmocka_unit_test(near_patches_are_patches),
        cmocka_unit_test(hidden_vpls_give_nothing),
        cmocka_unit_test(pixels_have_no_spread),
        cmocka_unit_test(any_number_of_threads_gives_the_same_bits),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
