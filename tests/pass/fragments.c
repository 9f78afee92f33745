// Lists of fragments against the definition, in pictures made by hand: every pixel that can be lit
// is in exactly one, in the order that is promised, whichever way they were found.

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "blocks.h"
#include "pass/fragments.h"

struct run {
    struct bd_discontinuity *discontinuity;
    struct bd_fragments *fragments;
    uint32_t *list;
};

static void find_fragments(const struct bd_discontinuity_inputs *inputs, struct run *run,
                           enum bd_fragment_refinement refinement)
{
    struct bd_err_detail detail = {0};
    if (bd_fragments_run(&context, inputs, run->discontinuity, refinement, &run->fragments,
                         &detail))
        fail_msg("%s", detail.message);
    size_t bytes = run->fragments->count * sizeof *run->list;
    run->list = calloc(bytes + 1, 1);
    assert_non_null(run->list);
    if (bytes > 0)
        assert_int_equal(bd_buf_read(context.gpu, run->fragments->list, 0, run->list, bytes),
                         BD_ERR_OK);
}

static struct run run_passes(const struct picture *p, const struct bd_discontinuity_settings *s,
                             enum bd_fragment_refinement refinement)
{
    const struct bd_discontinuity_inputs inputs = picture_inputs(p, s);
    struct run run = {.discontinuity = discontinuity_of(p, s)};
    find_fragments(&inputs, &run, refinement);
    return run;
}

static void destroy_fragments(struct run *run)
{
    free(run->list);
    bd_fragments_destroy(context.gpu, &run->fragments);
}

static void destroy_run(struct run *run)
{
    destroy_fragments(run);
    bd_discontinuity_destroy(context.gpu, &run->discontinuity);
}

// --- the definition -----------------------------------------------------------------------

static bool is_fragment(const struct blocks *b, uint32_t level, uint32_t x, uint32_t y)
{
    if (x >= b->layout.levels[level].columns || y >= b->layout.levels[level].rows) return false;
    bool coarsest = level + 1 == b->layout.level_count;
    return b->flags[block_index(b, level, x, y)] == BD_BLOCK_SMOOTH &&
           (coarsest ||
            b->flags[block_index(b, level + 1, x / 2, y / 2)] == BD_BLOCK_DISCONTINUOUS);
}

static void list_tile(const struct blocks *b, uint32_t level, uint32_t column, uint32_t row,
                      uint32_t *list, uint32_t *count)
{
    for (uint32_t y = 8 * row; y < 8 * row + 8; y++)
        for (uint32_t x = 8 * column; x < 8 * column + 8; x++)
            if (is_fragment(b, level, x, y)) list[(*count)++] = BD_FRAGMENT_PACK(level, x, y);
}

// `level_first` has a place for one level more, which none follows.
static uint32_t list_by_definition(const struct blocks *b, uint32_t *list, uint32_t *level_first)
{
    uint32_t count = 0;
    for (uint32_t k = b->layout.level_count; k-- > 0;) {
        level_first[k] = count;
        for (uint32_t row = 0; row * 8 < b->layout.levels[k].rows; row++)
            for (uint32_t column = 0; column * 8 < b->layout.levels[k].columns; column++)
                list_tile(b, k, column, row, list, &count);
    }
    return count;
}

// --- what must hold -----------------------------------------------------------------------

static void cover_block(const struct picture *p, uint32_t fragment, uint8_t *covered)
{
    uint32_t level = BD_FRAGMENT_LEVEL(fragment), side = 1u << level;
    uint32_t left = BD_FRAGMENT_X(fragment) * side, top = BD_FRAGMENT_Y(fragment) * side;
    for (uint32_t y = top; y < top + side && y < p->size.height; y++)
        for (uint32_t x = left; x < left + side && x < p->size.width; x++)
            covered[(size_t)y * p->size.width + x]++;
}

// With a test of depth silhouettes are discontinuities: then no other pixel is in a fragment at
// all.
static void assert_covered_once(const struct picture *p, const struct run *run, bool silhouettes,
                                const char *what)
{
    size_t pixels = (size_t)p->size.width * p->size.height;
    uint8_t *covered = calloc(pixels, 1);
    assert_non_null(covered);
    for (uint32_t i = 0; i < run->fragments->count; i++) cover_block(p, run->list[i], covered);
    for (size_t i = 0; i < pixels; i++) {
        bool lit = p->pixels[i].cover == COVER_LIT;
        bool right = lit ? covered[i] == 1 : covered[i] == 0 || (!silhouettes && covered[i] == 1);
        if (!right)
            fail_msg("%s: pixel %zu %zu is in %u fragments", what, i % p->size.width,
                     i / p->size.width, covered[i]);
    }
    free(covered);
}

static void assert_dispatch(const struct bd_fragments *fragments)
{
    uint32_t groups[4], wanted = (fragments->count + 63) / 64;
    assert_int_equal(bd_buf_read(context.gpu, fragments->dispatch, 0, groups, sizeof groups),
                     BD_ERR_OK);
    assert_in_range(groups[0], 0, 65535);
    assert_in_range(groups[1], 0, 65535);
    assert_true((uint64_t)groups[0] * groups[1] >= wanted);
    assert_true(groups[0] == wanted ? groups[1] <= 1 : groups[0] == 65535);
    assert_true(wanted == 0 || groups[1] == (wanted + 65534) / 65535);
    assert_int_equal(groups[2], 1);
    assert_int_equal(groups[3], 0);
}

static void assert_levels(const struct bd_fragments *fragments, const uint32_t *level_first)
{
    uint32_t end = fragments->count;
    for (uint32_t k = 0; k < fragments->layout.level_count; k++) {
        assert_int_equal(fragments->level_first[k], level_first[k]);
        assert_int_equal(fragments->level_count[k], end - level_first[k]);
        end = level_first[k];
    }
    assert_int_equal(end, 0);
}

static void assert_list(const struct run *run, const uint32_t *expected, uint32_t count,
                        const char *what)
{
    if (run->fragments->count != count)
        fail_msg("%s: %u fragments, expected %u", what, run->fragments->count, count);
    for (uint32_t i = 0; i < count; i++)
        if (run->list[i] != expected[i])
            fail_msg("%s: fragment %u is %x, expected %x", what, i, run->list[i], expected[i]);
}

static void check(const struct picture *p, const struct bd_discontinuity_settings *s,
                  const char *what)
{
    const struct picture_name name = picture_name(p, s, what);
    struct blocks b = blocks_by_definition(p, s);
    uint32_t *expected = malloc(bd_multires_block_count(&b.layout) * sizeof *expected);
    assert_non_null(expected);
    uint32_t level_first[BD_MULTIRES_LEVEL_MAX];
    uint32_t count = list_by_definition(&b, expected, level_first);
    for (int refinement = 0; refinement < 2; refinement++) {
        struct run run = run_passes(p, s, (enum bd_fragment_refinement)refinement);
        assert_list(&run, expected, count, name.text);
        assert_covered_once(p, &run, s->depth_test != BD_DEPTH_TEST_OFF, name.text);
        assert_levels(run.fragments, level_first);
        assert_dispatch(run.fragments);
        destroy_run(&run);
    }
    free(expected);
    blocks_destroy(&b);
}

// --- tests --------------------------------------------------------------------------------

// Every test of depth with every test of normals and every neighbourhood, over the pictures.
static struct bd_discontinuity_settings settings_of(uint32_t turn)
{
    static const uint32_t sides[] = {1, 4, 16, 100};
    return (struct bd_discontinuity_settings){
        .depth_test = (enum bd_depth_test)(turn % 4),
        .normal_test = (enum bd_normal_test)(turn / 4 % 3),
        .neighbourhood = (enum bd_neighbourhood)(turn / 9 % 3),
        .depth_threshold = turn % 2 ? .05 : 0,
        .normal_threshold = turn % 5 ? .27 : 1.1,
        .coarsest_side = sides[turn / 5 % 4],
    };
}

static void what_a_camera_sees(void **state)
{
    (void)state;
    static const struct picture_size sizes[] = {{1, 1},   {1, 30},  {65, 1},
                                                {17, 33}, {64, 64}, {255, 127}};
    const struct picture_sweep sweep = {settings_of, check, 5, 1};
    sweep_cameras(&sweep, sizes, COUNT(sizes));
}

static void what_a_light_sees(void **state)
{
    (void)state;
    const struct picture_sweep sweep = {settings_of, check, 3, 5};
    sweep_lights(&sweep, false);
}

static void odd_and_large(void **state)
{
    (void)state;
    struct picture p = picture_of_camera(&picture_kinds[1], (struct picture_size){1023, 769});
    const struct bd_discontinuity_settings settings = {
        .depth_test = BD_DEPTH_TEST_MINMAX,
        .normal_test = BD_NORMAL_TEST_CHORD,
        .neighbourhood = BD_NEIGHBOURHOOD_DIAGONAL,
        .depth_threshold = .02,
        .normal_threshold = .1,
        .coarsest_side = 16,
    };
    check(&p, &settings, "box");
    picture_destroy(&p);
}

static void slices_change_nothing(void **state)
{
    (void)state;
    const struct bd_discontinuity_settings settings = settings_of(19);
    assert_true(check_in_slices(check, &settings) > 100);
}

// More pixels than one row of work groups can have, and a single level.
static void a_long_list(void **state)
{
    (void)state;
    const struct picture_size size = {2304, 1900};
    const size_t pixels = (size_t)size.width * size.height;
    const struct bd_tex_desc desc = {.name = "test",
                                     .format = BD_FORMAT_RGBA16,
                                     .width_px = size.width,
                                     .height_px = size.height};
    const float lit[4] = {0, 0, 0, 1};
    struct picture p = {.size = size};
    p.viewpoint.width_px = size.width;
    p.viewpoint.height_px = size.height;
    p.space.render_per_m = 1;
    assert_int_equal(bd_tex_create(context.gpu, &desc, &p.gbuffer.material, NULL), BD_ERR_OK);
    bd_tex_clear(context.gpu, p.gbuffer.material, lit);
    const struct bd_discontinuity_settings settings = {.coarsest_side = 2304};
    struct run run = run_passes(&p, &settings, BD_REFINEMENT_ONE_PASS);
    assert_int_equal(run.fragments->layout.level_count, 1);
    assert_int_equal(run.fragments->count, pixels);
    assert_dispatch(run.fragments);
    for (size_t i = 0; i < pixels; i++) {
        size_t tile = i / 64 % (size.width / 8), row = i / 64 / (size.width / 8) * 8;
        if (row + 8 > size.height) break; // the last tiles are cut
        if (run.list[i] != BD_FRAGMENT_PACK(0u, tile * 8 + i % 8, row + i / 8 % 8))
            fail_msg("fragment %zu is %x", i, run.list[i]);
    }
    destroy_run(&run);
    bd_tex_destroy(context.gpu, &p.gbuffer.material);
}

// --- a plane, seen obliquely --------------------------------------------------------------

#define PLANE_SIDE_PX 64

// On a plane 1 / z is linear across the picture: here it grows downwards.
static double plane_inverse_depth(double y)
{
    return 0.2 + 0.8 * y / (PLANE_SIDE_PX - 1);
}

static struct pixel look_at_plane(uint32_t x, uint32_t y, struct picture_size size)
{
    (void)x;
    (void)size;
    struct pixel p = {.cover = COVER_LIT, .depth = (float)(1 / plane_inverse_depth(y))};
    set_normal(&p, 0, 1, 0.3f);
    return p;
}

// |z' - z| / z towards the neighbour that is farther away, or the only one.
static double plane_slope(uint32_t y)
{
    return 0.8 / (PLANE_SIDE_PX - 1) / plane_inverse_depth(y > 0 ? y - 1 : y + 1);
}

static uint32_t plane_fragments(const struct picture *p, enum bd_depth_test test, double threshold)
{
    const struct bd_discontinuity_settings settings = {
        .depth_test = test,
        .normal_test = BD_NORMAL_TEST_MINMAX,
        .depth_threshold = threshold,
        .normal_threshold = .1,
        .coarsest_side = 4,
    };
    struct run run = run_passes(p, &settings, BD_REFINEMENT_ONE_PASS);
    uint32_t count = run.fragments->count;
    destroy_run(&run);
    return count;
}

// The slope falls downwards, from row 1 on: blocks are split as far as they reach into the first
// `steep` rows.
static uint32_t plane_fragments_by_hand(uint32_t steep)
{
    uint32_t count = 0, end = PLANE_SIDE_PX;
    for (uint32_t side = 16; side > 0; side /= 2) {
        uint32_t split = side > 1 ? (steep + side - 1) / side * side : 0;
        count += (end - split) / side * (PLANE_SIDE_PX / side);
        end = split;
    }
    return count;
}

static void a_plane_is_split_where_it_is_steep_and_nowhere_else(void **state)
{
    (void)state;
    static const double thresholds[] = {.1, .06, .045, .03, .02, .01};
    const struct picture_kind plane = {"plane", look_at_plane};
    const struct picture_size size = {PLANE_SIDE_PX, PLANE_SIDE_PX};
    struct picture p = picture_of_camera(&plane, size);
    for (size_t t = 0; t < COUNT(thresholds); t++) {
        uint32_t steep = 0;
        for (uint32_t y = 0; y < PLANE_SIDE_PX; y++)
            if (plane_slope(y) > thresholds[t]) steep = y + 1;
        uint32_t found = plane_fragments(&p, BD_DEPTH_TEST_DERIVATIVE, thresholds[t]);
        print_message("    threshold %.3f: %u steep rows, %u fragments\n", thresholds[t], steep,
                      found);
        assert_int_equal(found, plane_fragments_by_hand(steep));
    }
    // What the range of depth would make of it.
    assert_int_equal(plane_fragments(&p, BD_DEPTH_TEST_DERIVATIVE, .1), 16);
    assert_true(plane_fragments(&p, BD_DEPTH_TEST_MINMAX, .1) > 400);
    // Steps are none on any plane, but for rounding.
    assert_int_equal(plane_fragments(&p, BD_DEPTH_TEST_STEP, 2e-6), 16);
    picture_destroy(&p);
}

// A ledge: below row 37 the plane is 1 % farther away.
static struct pixel look_at_ledge(uint32_t x, uint32_t y, struct picture_size size)
{
    struct pixel p = look_at_plane(x, y, size);
    if (y >= 37) p.depth *= 1.01f;
    return p;
}

static void a_ledge_is_split_along_its_edge_alone(void **state)
{
    (void)state;
    const struct picture_kind ledge = {"ledge", look_at_ledge};
    const struct picture_size size = {PLANE_SIDE_PX, PLANE_SIDE_PX};
    struct picture p = picture_of_camera(&ledge, size);
    // Rows 36 and 37 measure it: two rows of pixels in a block of two; above and below, blocks of 2
    // (rows 38 and 39), 4 (32 to 35), 8 (40 to 47).
    const uint32_t pixels = 2 * 64, by_2 = 32, by_4 = 16, by_8 = 8, by_16 = 3 * 4;
    assert_int_equal(plane_fragments(&p, BD_DEPTH_TEST_STEP, .005),
                     pixels + by_2 + by_4 + by_8 + by_16);
    assert_int_equal(plane_fragments(&p, BD_DEPTH_TEST_STEP, .012), 16);
    picture_destroy(&p);
}

// Hazard 30.
static void a_ball_on_black_is_split_at_its_silhouette_alone(void **state)
{
    (void)state;
    struct picture p = picture_of_camera(&picture_kinds[7], (struct picture_size){128, 128});
    const struct bd_discontinuity_settings settings = {
        .depth_test = BD_DEPTH_TEST_MINMAX,
        .normal_test = BD_NORMAL_TEST_OFF,
        .depth_threshold = 10, // no jump within the ball is that large
        .coarsest_side = 16,
    };
    check(&p, &settings, "ball");
    struct run run = run_passes(&p, &settings, BD_REFINEMENT_ONE_PASS);
    const struct bd_fragments *fragments = run.fragments;
    print_message("    fragments of levels 0 to 3: %u %u %u %u\n", fragments->level_count[0],
                  fragments->level_count[1], fragments->level_count[2], fragments->level_count[3]);
    // Its rim is 309 px long; its middle is left whole.
    assert_in_range(fragments->level_count[0], 200, 700);
    assert_in_range(fragments->level_count[3], 60, 121);
    destroy_run(&run);
    picture_destroy(&p);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_a_camera_sees),
        cmocka_unit_test(what_a_light_sees),
        cmocka_unit_test(odd_and_large),
        cmocka_unit_test(slices_change_nothing),
        cmocka_unit_test(a_long_list),
        cmocka_unit_test(a_plane_is_split_where_it_is_steep_and_nowhere_else),
        cmocka_unit_test(a_ledge_is_split_along_its_edge_alone),
        cmocka_unit_test(a_ball_on_black_is_split_at_its_silhouette_alone),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}
