// Lone pixels against the definition (pass/fragments.h), in pictures made by hand: who is of one
// surface with nothing that could light it has a fragment of its own, and nobody else.

#include <math.h>
#include <stdlib.h>

#include "blocks.h"
#include "pass/fragments.h"
#include "points.h"

// --- the definition -----------------------------------------------------------------------

// Above 0: light there serves here, by so much: one surface, and a normal near that for which
// blocks are lit.
static double agreement(struct point here, struct point there)
{
    double turn = distance_between(here.normal, there.normal_geometric);
    return fmin(one_surface(&here, &there), .4 - turn);
}

static int descending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x < y) - (x > y);
}

// What lights a block from the level above: its parent, or three of the five around that.
static double best_agreement(const struct picture *p, const struct blocks *b, uint32_t level,
                             uint32_t x, uint32_t y)
{
    static const int steps[6][2] = {{0, 0}, {1, 0}, {0, 1}, {1, 1}, {-1, 0}, {0, -1}};
    int side_x = x % 2 ? 1 : -1, side_y = y % 2 ? 1 : -1;
    struct point here = point_of(p, b->representatives[block_index(b, level, x, y)]);
    double seen[6];
    for (int i = 0; i < 6; i++) {
        seen[i] = -INFINITY;
        int64_t px = (int64_t)(x / 2) + side_x * steps[i][0];
        int64_t py = (int64_t)(y / 2) + side_y * steps[i][1];
        const struct bd_multires_level *size = &b->layout.levels[level + 1];
        if (px < 0 || py < 0 || px >= size->columns || py >= size->rows) continue;
        uint32_t parent = block_index(b, level + 1, (uint32_t)px, (uint32_t)py);
        if (b->flags[parent] == BD_BLOCK_EMPTY) continue;
        seen[i] = agreement(here, point_of(p, b->representatives[parent]));
    }
    qsort(seen + 1, 5, sizeof *seen, descending);
    return fmax(seen[0], seen[3]);
}

// --- what must hold -----------------------------------------------------------------------

struct tally {
    uint32_t lone, not_lone, unsure;
};

static void assert_block(const struct picture *p, const struct blocks *b, uint32_t finest,
                         uint32_t level, uint32_t x, uint32_t y, bool found, struct tally *tally)
{
    uint32_t shift = finest - level;
    bool lit = b->flags[block_index(b, level, x, y)] != BD_BLOCK_EMPTY;
    bool asked =
        lit && b->flags[block_index(b, finest, x >> shift, y >> shift)] == BD_BLOCK_DISCONTINUOUS;
    double best = asked ? best_agreement(p, b, level, x, y) : 1;
    bool sure = fabs(best) > UNSURE;
    if (sure && found != (best < 0))
        fail_msg("level %u, block %u %u: %s, agreement %g", level, x, y,
                 found ? "a fragment" : "no fragment", best);
    if (asked) ++*(!sure ? &tally->unsure : best < 0 ? &tally->lone : &tally->not_lone);
}

static uint8_t *fragment_marks(const struct blocks *b, const struct bd_fragments *fragments)
{
    uint8_t *marks = calloc(bd_multires_block_count(&b->layout), 1);
    uint32_t *list = calloc(fragments->count + 1, sizeof *list);
    assert_non_null(marks);
    assert_non_null(list);
    if (fragments->count > 0)
        assert_int_equal(
            bd_buf_read(context.gpu, fragments->list, 0, list, fragments->count * sizeof *list),
            BD_ERR_OK);
    for (uint32_t i = 0; i < fragments->count; i++)
        marks[block_index(b, BD_FRAGMENT_LEVEL(list[i]), BD_FRAGMENT_X(list[i]),
                          BD_FRAGMENT_Y(list[i]))]++;
    free(list);
    return marks;
}

// Without lone pixels every pixel that can be lit lies in one fragment, and so it does in one of
// the finest level or above.
static void assert_covered_once(const struct blocks *b, const uint8_t *marks, uint32_t finest)
{
    for (uint32_t y = 0; y < b->layout.levels[0].rows; y++)
        for (uint32_t x = 0; x < b->layout.levels[0].columns; x++) {
            if (b->flags[block_index(b, 0, x, y)] == BD_BLOCK_EMPTY) continue;
            uint32_t count = 0;
            for (uint32_t k = finest; k < b->layout.level_count; k++)
                count += marks[block_index(b, k, x >> k, y >> k)];
            if (count != 1) fail_msg("pixel %u %u is in %u fragments", x, y, count);
        }
}

static void assert_marks(const struct picture *p, const struct blocks *b, const uint8_t *marks,
                         uint32_t finest, struct tally *tally)
{
    assert_covered_once(b, marks, finest);
    for (uint32_t k = 0; k < finest; k++)
        for (uint32_t y = 0; y < b->layout.levels[k].rows; y++)
            for (uint32_t x = 0; x < b->layout.levels[k].columns; x++)
                assert_block(p, b, finest, k, x, y, marks[block_index(b, k, x, y)], tally);
}

static void check(const struct picture *p, const struct bd_discontinuity_settings *settings,
                  enum bd_fragment_refinement refinement, struct tally *tally)
{
    const struct bd_discontinuity_inputs inputs = picture_inputs(p, settings);
    struct bd_discontinuity *discontinuity = discontinuity_of(p, settings);
    struct bd_fragments *fragments;
    struct bd_err_detail detail = {0};
    if (bd_fragments_run(&context, &inputs, discontinuity, refinement, &fragments, &detail))
        fail_msg("%s", detail.message);
    struct blocks b = blocks_of_device(p, discontinuity);
    uint8_t *marks = fragment_marks(&b, fragments);
    uint32_t finest = settings->finest_level;
    if (finest >= b.layout.level_count) finest = b.layout.level_count - 1;
    assert_marks(p, &b, marks, finest, tally);
    free(marks);
    blocks_destroy(&b);
    bd_fragments_destroy(context.gpu, &fragments);
    bd_discontinuity_destroy(context.gpu, &discontinuity);
}

// --- tests --------------------------------------------------------------------------------

static void check_picture(const struct picture_kind *kind, struct picture_size size,
                          struct tally *tally)
{
    struct picture p = picture_of_camera(kind, size);
    upload_both_normals(&p);
    for (uint32_t finest = 1; finest < 4; finest++) {
        const struct bd_discontinuity_settings settings = {
            .depth_test = finest == 2 ? BD_DEPTH_TEST_MINMAX : BD_DEPTH_TEST_STEP,
            .normal_test = BD_NORMAL_TEST_MINMAX,
            .depth_threshold = .02,
            .normal_threshold = .3,
            .coarsest_side = 4,
            .finest_level = finest,
            .lone_pixels = true,
        };
        check(&p, &settings, finest % 2 ? BD_REFINEMENT_ONE_PASS : BD_REFINEMENT_ITERATIVE, tally);
    }
    picture_destroy(&p);
}

static void what_nothing_stands_for_is_lit_by_itself(void **state)
{
    (void)state;
    static const struct picture_size sizes[] = {{1, 1}, {1, 30}, {65, 33}, {96, 128}};
    struct tally tally = {0};
    for (size_t kind = 0; kind < picture_kind_count; kind++)
        for (size_t i = 0; i < COUNT(sizes); i++)
            check_picture(&picture_kinds[kind], sizes[i], &tally);
    print_message("    alone %u, not alone %u, too near to tell %u\n", tally.lone, tally.not_lone,
                  tally.unsure);
    // The pictures have both, and rounding decides next to nothing.
    assert_true(tally.lone > 1000 && tally.not_lone > 1000);
    assert_true(tally.unsure < 50);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_nothing_stands_for_is_lit_by_itself),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}
