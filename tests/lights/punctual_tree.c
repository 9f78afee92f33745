// The tree over lamps: who may light a box, what is drawn and how often.

#include "lights/punctual_tree.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "kernel/light.h"
#include "tests/unit/cmocka_all.h"

#define LAMPS  700u
#define LOOKS  64u
#define DRAWS  4096u
#define COUNTS 3u

static enum bd_err go_on(void *user)
{
    if (user) ++*(int *)user;
    return BD_ERR_OK;
}

static enum bd_err give_up(void *user)
{
    (void)user;
    return BD_ERR_CANCELLED;
}

static float next(uint32_t *state)
{
    *state = *state * 1664525u + 1013904223u;
    return (float)(*state >> 8) * 0x1p-24f;
}

static f3 anywhere(uint32_t *state, float half)
{
    const float x = next(state), y = next(state), z = next(state);
    return f3_scale(f3_of(2 * x - 1, 2 * y - 1, 2 * z - 1), half);
}

static struct bd_vec4 vec4_of(f3 v, float w)
{
    return (struct bd_vec4){v.x, v.y, v.z, w};
}

// Points, spots of any width and directional lights, about the origin.
static struct bd_light_uniform lamp_of(uint32_t *state)
{
    const uint32_t kind = (uint32_t)(3 * next(state));
    const float outer = .05f + 1.5f * next(state), inner = outer * next(state);
    const bool is_spot = kind == BD_LIGHT_KIND_SPOT;
    const float least = is_spot ? cosf(outer) : -3, rim = is_spot ? cosf(inner) - cosf(outer) : 1;
    const float intensity = .1f + next(state), range = next(state) < .5f ? 2 : 0;
    return (struct bd_light_uniform){
        .position = vec4_of(anywhere(state, 1), 0),
        .direction = vec4_of(f3_unit(anywhere(state, 1)), 0),
        .intensity = {intensity, .5f * intensity, .2f, 0},
        .inverse_range = range,
        .distance = 4,
        .cos_outer = least,
        .per_cosine = 1 / fmaxf(rim, 1e-7f),
        .kind = next(state) < .01f ? BD_LIGHT_KIND_DIRECTIONAL
                : is_spot          ? kind
                                   : BD_LIGHT_KIND_POINT,
        .face_count = 1,
    };
}

static struct bd_punctual_tree *tree_of(uint32_t count, uint32_t seed)
{
    struct bd_light_uniform *lamps = malloc(count * sizeof *lamps);
    struct bd_punctual_tree *tree;
    struct bd_err_detail detail;
    for (uint32_t i = 0; i < count; i++) lamps[i] = lamp_of(&seed);
    assert_int_equal(bd_punctual_tree_create(lamps, count, go_on, NULL, &tree, &detail), BD_ERR_OK);
    return tree;
}

static float given_by(const struct bd_light_uniform *lamp, f3 at, f3 normal)
{
    const f3 ahead = f3_of(lamp->direction.x, lamp->direction.y, lamp->direction.z);
    const f3 place = f3_of(lamp->position.x, lamp->position.y, lamp->position.z);
    if (lamp->kind == BD_LIGHT_KIND_DIRECTIONAL)
        return lamp->intensity.x * f_max(-f3_dot(ahead, normal), 0);
    const f3 span = f3_sub(place, at);
    return lamp->intensity.x * f_max(f3_dot(f3_unit(span), normal), 0) *
           irradiance_at(span, ahead, lamp->cos_outer, lamp->per_cosine, lamp->inverse_range);
}

// Every lamp is once below a cut, or gives no point of the box anything.
static void cuts_leave_out_what_cannot_light(void **state)
{
    static const uint32_t counts[COUNTS] = {1, 200, LAMPS};
    uint32_t seed = 5, left_out = 0;
    (void)state;
    for (uint32_t c = 0; c < COUNTS; c++) {
        struct bd_punctual_tree *tree = tree_of(counts[c], 11 + c);
        for (uint32_t look = 0; look < LOOKS; look++) {
            const f3 middle = anywhere(&seed, 2), half = f3_abs(anywhere(&seed, .1f));
            struct bd_punctual_cut cut;
            uint8_t times[LAMPS] = {0};
            bd_punctual_tree_cut(tree, f3_sub(middle, half), f3_add(middle, half), &cut);
            assert_true(cut.count <= BD_PUNCTUAL_CUT_MAX);
            uint32_t below = 0;
            for (uint32_t i = 0; i < cut.count; i++) {
                const struct bd_punctual_node *n = &cut.nodes[i];
                assert_true((n->end - n->begin == 1) == (i < cut.punctual_count));
                for (uint32_t l = n->begin; l < n->end; l++) times[tree->tree.order[l]]++;
                below += n->end - n->begin;
            }
            assert_int_equal(below, cut.below);
            for (uint32_t l = 0; l < counts[c]; l++) {
                assert_true(times[l] <= 1);
                left_out += times[l] == 0;
                for (uint32_t p = 0; times[l] == 0 && p < 32; p++) {
                    const f3 in = f3_mul(half, anywhere(&seed, 1)), n = f3_unit(anywhere(&seed, 1));
                    assert_true(given_by(&tree->punctuals[l], f3_add(middle, in), n) < 1e-6f);
                }
            }
        }
        bd_punctual_tree_destroy(&tree);
    }
    print_message("    %u left out\n", left_out);
    assert_true(left_out > 1000);
}

// Who lights a receiver is drawn, as often as is told; and what is drawn stands for all.
static void what_is_drawn_stands_for_all(void **state)
{
    struct bd_punctual_tree *tree = tree_of(LAMPS, 3);
    const struct bd_punctual_node all = {.end = LAMPS};
    uint32_t seed = 9;
    (void)state;
    for (uint32_t look = 0; look < 8; look++) {
        const f3 at = anywhere(&seed, 1.5f), normal = f3_unit(anywhere(&seed, 1));
        double sum = 0, seen = 0;
        for (uint32_t l = 0; l < LAMPS; l++) sum += given_by(&tree->punctuals[l], at, normal);
        for (uint32_t d = 0; d < 64 * DRAWS; d++) {
            uint32_t lamp;
            float chance;
            const float number = ((float)d + .5f) / (64 * DRAWS);
            if (!bd_punctual_tree_draw(tree, &all, at, normal, number, &lamp, &chance)) continue;
            seen += given_by(&tree->punctuals[lamp], at, normal) / chance;
        }
        print_message("    %g of %g\n", seen / (64 * DRAWS), sum);
        assert_true(fabs(seen / (64 * DRAWS) - sum) < .02 * sum + 1e-4);
    }
    bd_punctual_tree_destroy(&tree);
}

static void what_pauses_may_end_it(void **state)
{
    struct bd_light_uniform *lamps = calloc(4096, sizeof *lamps);
    struct bd_punctual_tree *tree;
    struct bd_err_detail detail;
    (void)state;
    assert_int_equal(bd_punctual_tree_create(lamps, 4096, give_up, NULL, &tree, &detail),
                     BD_ERR_CANCELLED);
    assert_null(tree);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(cuts_leave_out_what_cannot_light),
        cmocka_unit_test(what_is_drawn_stands_for_all),
        cmocka_unit_test(what_pauses_may_end_it),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
