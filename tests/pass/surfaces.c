// Blocks of one surface against the definition (pass/surfaces.h), in pictures made by hand: which
// are inner, which are listed, and what is told of the children of those.

#include <math.h>
#include <stdlib.h>

#include "blocks.h"
#include "pass/surfaces.h"
#include "points.h"
#include "shared/surfaces.h"

struct tally {
    uint32_t inner, under_deep, outer, shared, apart, cells, unsure;
};

struct run {
    const struct picture *picture;
    struct blocks blocks;
    uint32_t finest;
    uint32_t *words;    // as the device left them, by block_index
    uint32_t *children; // place of a block among the outer ones + 1; 0 = it is none
    uint32_t *bits;     // two for each place
    struct tally *tally;
};

struct place {
    uint32_t level;
    int64_t x, y;
};

// --- the definition -----------------------------------------------------------------------

static bool exists(const struct run *run, struct place at)
{
    const struct bd_multires_layout *layout = &run->blocks.layout;
    return at.level < layout->level_count && at.x >= 0 && at.y >= 0 &&
           at.x < layout->levels[at.level].columns && at.y < layout->levels[at.level].rows;
}

static uint32_t index_of(const struct run *run, struct place at)
{
    return block_index(&run->blocks, at.level, (uint32_t)at.x, (uint32_t)at.y);
}

static uint32_t kind_of(const struct run *run, struct place at)
{
    return exists(run, at) ? run->blocks.flags[index_of(run, at)] : BD_BLOCK_EMPTY;
}

static bool holds_light(const struct run *run, struct place at)
{
    uint32_t kind = kind_of(run, at);
    return kind == BD_BLOCK_SMOOTH || (kind == BD_BLOCK_DISCONTINUOUS && at.level <= run->finest);
}

// Above 0 if both are of one surface and the other holds light.
static double agreement(const struct run *run, struct place here, struct place there)
{
    if (!holds_light(run, there)) return -INFINITY;
    struct point a = point_of(run->picture, run->blocks.representatives[index_of(run, here)]);
    struct point b = point_of(run->picture, run->blocks.representatives[index_of(run, there)]);
    return one_surface(&a, &b);
}

static struct place beside(struct place at, int64_t x, int64_t y)
{
    return (struct place){at.level, at.x + x, at.y + y};
}

// As the device has it, since what is too near to tell may be either.
static bool is_under_deep(const struct run *run, struct place at)
{
    struct place parent = {at.level + 1, at.x / 2, at.y / 2};
    return exists(run, parent) && (run->words[index_of(run, parent)] & BD_SURFACES_DEEP);
}

// A pair is looked at from the block above or to the left, unless that lies under a deep one.
static double pair_agreement(const struct run *run, struct place at, int64_t x, int64_t y)
{
    struct place other = beside(at, x, y);
    bool from_here = y > 0 || (y == 0 && x > 0);
    if (is_under_deep(run, from_here ? at : other) && exists(run, other)) return 1;
    return holds_light(run, other) ? agreement(run, other, at) : -INFINITY;
}

static bool is_whole(const struct run *run, struct place at)
{
    bool whole = kind_of(run, at) == BD_BLOCK_SMOOTH;
    for (int i = 0; i < 4; i++) {
        struct place child = {at.level - 1, 2 * at.x + i % 2, 2 * at.y + i / 2};
        whole = whole && kind_of(run, child) != BD_BLOCK_EMPTY;
    }
    const struct bd_multires_layout *layout = &run->blocks.layout;
    return whole && (at.x + 2) << at.level <= layout->width_px &&
           (at.y + 2) << at.level <= layout->height_px;
}

// Above 0: the eight around a block are of its surface.
static double inner_agreement(const struct run *run, struct place at)
{
    double least = is_whole(run, at) ? 1 : -INFINITY;
    for (int64_t y = -1; y <= 1; y++)
        for (int64_t x = -1; x <= 1; x++)
            if ((x || y) && exists(run, beside(at, x, y)))
                least = fmin(least, pair_agreement(run, at, x, y));
            else if (x || y)
                least = -INFINITY;
    return least;
}

// --- what must hold -----------------------------------------------------------------------

static void assert_told(const struct run *run, struct place at, const char *what, double margin,
                        bool told, uint32_t *yes, uint32_t *no)
{
    if (fabs(margin) <= UNSURE) {
        run->tally->unsure++;
        return;
    }
    if (told != (margin > 0))
        fail_msg("level %u, block %d %d, %s: %s, agreement %g", at.level, (int)at.x, (int)at.y,
                 what, told ? "yes" : "no", margin);
    ++*(told ? yes : no);
}

static void assert_block(const struct run *run, struct place at)
{
    uint32_t i = index_of(run, at), word = run->words[i];
    bool inner = word & BD_SURFACES_INNER, listed = run->children[i] > 0;
    uint32_t not_inner = 0;
    if (is_under_deep(run, at)) {
        assert_int_equal(word, BD_SURFACES_INNER | BD_SURFACES_DEEP);
        run->tally->under_deep++;
    } else {
        bool holds = holds_light(run, at);
        double margin = holds ? inner_agreement(run, at) : -1;
        assert_told(run, at, "inner", margin, inner, &run->tally->inner, &not_inner);
        assert_int_equal(!!(word & BD_SURFACES_DEEP), inner && at.level > run->finest);
        assert_int_equal(listed, holds && !inner);
    }
    run->tally->outer += listed;
}

static void assert_bit(const struct run *run, struct place child, struct place other, uint32_t bit)
{
    assert_told(run, child, "one surface", agreement(run, child, other), bit, &run->tally->shared,
                &run->tally->apart);
}

// Fragments of the child's own level count where the block that they lie in is split.
static void assert_cells(const struct run *run, struct place child, uint32_t cells)
{
    static const int steps[5][2] = {{1, 0}, {0, 1}, {1, 1}, {1, -1}, {-1, 1}};
    // In which neighbour of the parent: along x, along y, along both.
    static const int from[5][2] = {{1, 0}, {0, 1}, {1, 1}, {1, 0}, {0, 1}};
    int64_t side_x = child.x % 2 ? 1 : -1, side_y = child.y % 2 ? 1 : -1;
    for (int i = 0; i < 5; i++) {
        struct place around = {child.level + 1, child.x / 2 + from[i][0] * side_x,
                               child.y / 2 + from[i][1] * side_y};
        struct place cell = beside(child, steps[i][0] * side_x, steps[i][1] * side_y);
        bool split = kind_of(run, around) == BD_BLOCK_DISCONTINUOUS && !holds_light(run, around);
        double margin = split ? agreement(run, child, cell) : -1;
        uint32_t none = 0;
        assert_told(run, child, "cell", margin, cells >> i & 1, &run->tally->cells, &none);
    }
}

static void assert_children(const struct run *run, struct place at)
{
    const uint32_t *bits = run->bits + 2 * (run->children[index_of(run, at)] - 1);
    for (int i = 0; i < 4; i++) {
        struct place child = {at.level - 1, 2 * at.x + i % 2, 2 * at.y + i / 2};
        bool lit = kind_of(run, child) != BD_BLOCK_EMPTY;
        assert_int_equal(BD_SURFACES_LIT(bits[0], i), lit);
        if (!lit) continue;
        int64_t x = i % 2 ? 1 : -1, y = i / 2 ? 1 : -1;
        uint32_t told = BD_SURFACES_CHILD(bits[0], i);
        assert_bit(run, child, at, told & BD_SURFACES_HOME);
        assert_bit(run, child, beside(at, x, 0), told & BD_SURFACES_BESIDE(0));
        assert_bit(run, child, beside(at, 0, y), told & BD_SURFACES_BESIDE(1));
        assert_bit(run, child, beside(at, x, y), told & BD_SURFACES_BESIDE(2));
        assert_bit(run, child, beside(at, -x, 0), told & BD_SURFACES_OPPOSITE(0));
        assert_bit(run, child, beside(at, 0, -y), told & BD_SURFACES_OPPOSITE(1));
        assert_cells(run, child, BD_SURFACES_CELLS(bits[1], i));
    }
}

static void assert_all(const struct run *run)
{
    const struct bd_multires_layout *layout = &run->blocks.layout;
    for (uint32_t k = 1; k < layout->level_count; k++)
        for (uint32_t y = 0; y < layout->levels[k].rows; y++)
            for (uint32_t x = 0; x < layout->levels[k].columns; x++) {
                struct place at = {k, x, y};
                assert_block(run, at);
                if (run->children[index_of(run, at)]) assert_children(run, at);
            }
}

// --- the pass -----------------------------------------------------------------------------

static void *read_buf(const struct bd_buf *buf)
{
    void *bytes = malloc(bd_buf_size_bytes(buf));
    assert_non_null(bytes);
    assert_int_equal(bd_buf_read(context.gpu, buf, 0, bytes, bd_buf_size_bytes(buf)), BD_ERR_OK);
    return bytes;
}

// Each block is listed once at most.
static void read_lists(struct run *run, const struct bd_surfaces *surfaces)
{
    const struct blocks *b = &run->blocks;
    run->children = calloc(bd_multires_block_count(&b->layout), sizeof *run->children);
    assert_non_null(run->children);
    run->bits = read_buf(surfaces->children);
    uint32_t *outer = read_buf(surfaces->outer);
    for (uint32_t k = 1; k < b->layout.level_count; k++)
        for (uint32_t i = 0; i < surfaces->outer_count[k]; i++) {
            uint32_t packed = outer[surfaces->outer_first[k] + i];
            uint32_t at = block_index(b, k, BD_PIXEL_X(packed), BD_PIXEL_Y(packed));
            assert_int_equal(run->children[at], 0);
            run->children[at] = surfaces->children_first[k] + i + 1;
        }
    free(outer);
}

static void check(const struct picture *p, const struct bd_discontinuity_settings *settings,
                  struct tally *tally)
{
    const struct bd_discontinuity_inputs inputs = picture_inputs(p, settings);
    struct bd_discontinuity *discontinuity = discontinuity_of(p, settings);
    struct bd_surfaces *surfaces;
    struct bd_err_detail detail = {0};
    if (bd_surfaces_run(&context, &inputs, discontinuity, &surfaces, &detail))
        fail_msg("%s", detail.message);
    struct run run = {.picture = p, .finest = settings->finest_level, .tally = tally};
    run.blocks = blocks_of_device(p, discontinuity);
    run.words = stack_of_device(&run.blocks, surfaces->words);
    read_lists(&run, surfaces);
    assert_all(&run);
    free(run.words), free(run.children), free(run.bits);
    blocks_destroy(&run.blocks);
    bd_surfaces_destroy(context.gpu, &surfaces);
    bd_discontinuity_destroy(context.gpu, &discontinuity);
}

// --- tests --------------------------------------------------------------------------------

// Two walls behind one another, with a hole, and a corner of noise.
static struct pixel look_at_walls(uint32_t x, uint32_t y, struct picture_size size)
{
    bool behind = 3 * x > 2 * size.width + y / 4;
    struct pixel p = {.cover = COVER_LIT, .depth = behind ? 3.0f : 2.0f};
    set_normal(&p, 1, 0, 0);
    if (x > 20 && x < 25 && y > 30 && y < 40) p.cover = COVER_UNLIT;
    if (x < 16 && y < 16) p.depth += noise(x, y, 3);
    return p;
}

static void check_picture(const struct picture_kind *kind, struct picture_size size,
                          struct tally *tally)
{
    struct picture p = picture_of_camera(kind, size);
    upload_both_normals(&p);
    for (uint32_t finest = 0; finest < 3; finest++) {
        const struct bd_discontinuity_settings settings = {
            .depth_test = finest == 1 ? BD_DEPTH_TEST_STEP : BD_DEPTH_TEST_MINMAX,
            .normal_test = BD_NORMAL_TEST_MINMAX,
            .depth_threshold = .02,
            .normal_threshold = .3,
            .coarsest_side = 4,
            .finest_level = finest,
        };
        check(&p, &settings, tally);
    }
    picture_destroy(&p);
}

static void what_blocks_are_of_one_surface(void **state)
{
    (void)state;
    static const struct picture_size sizes[] = {{1, 1}, {1, 30}, {65, 33}, {96, 128}};
    const struct picture_kind walls = {"walls", look_at_walls};
    struct tally tally = {0};
    for (size_t kind = 0; kind < picture_kind_count; kind++)
        for (size_t i = 0; i < COUNT(sizes); i++)
            check_picture(&picture_kinds[kind], sizes[i], &tally);
    check_picture(&walls, (struct picture_size){251, 187}, &tally);
    print_message(
        "    inner %u and %u under deep ones, outer %u; of children %u of one surface, %u "
        "not, %u cells; too near to tell %u\n",
        tally.inner, tally.under_deep, tally.outer, tally.shared, tally.apart, tally.cells,
        tally.unsure);
    // The pictures have all of them, and rounding decides next to nothing.
    assert_true(tally.inner > 1000 && tally.under_deep > 1000 && tally.outer > 1000);
    assert_true(tally.shared > 1000 && tally.apart > 1000 && tally.cells > 1000);
    assert_true(tally.unsure < 50);
}

static void slices_change_nothing(void **state)
{
    (void)state;
    const struct picture_kind walls = {"walls", look_at_walls};
    struct tally tally = {0};
    uint32_t slices = context.slicer->slice_count;
    context.slicer->forced_units = 20;
    check_picture(&walls, (struct picture_size){120, 130}, &tally);
    context.slicer->forced_units = 0;
    assert_true(context.slicer->slice_count > slices + 100);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_blocks_are_of_one_surface),
        cmocka_unit_test(slices_change_nothing),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}
