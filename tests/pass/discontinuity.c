// Flags and representatives of blocks against the definition, in pictures made by hand.

#include <math.h>

#include "blocks.h"

static const struct picture_size sizes[] = {{1, 1}, {1, 7}, {9, 1}, {1, 64}, {17, 33}, {64, 64}};

static void assert_monotone(const struct blocks *b)
{
    for (uint32_t k = 2; k < b->layout.level_count; k++)
        for (uint32_t y = 0; y < b->layout.levels[k - 1].rows; y++)
            for (uint32_t x = 0; x < b->layout.levels[k - 1].columns; x++)
                if (b->flags[block_index(b, k - 1, x, y)] == BD_BLOCK_DISCONTINUOUS)
                    assert_int_equal(b->flags[block_index(b, k, x / 2, y / 2)],
                                     BD_BLOCK_DISCONTINUOUS);
}

static bool same_block(const struct blocks *a, const struct blocks *b, uint32_t i)
{
    return a->flags[i] == b->flags[i] &&
           (a->flags[i] == BD_BLOCK_EMPTY || a->representatives[i] == b->representatives[i]);
}

static void assert_same(const struct blocks *found, const struct blocks *expected, const char *what)
{
    for (uint32_t k = 1; k < expected->layout.level_count; k++)
        for (uint32_t y = 0; y < expected->layout.levels[k].rows; y++)
            for (uint32_t x = 0; x < expected->layout.levels[k].columns; x++) {
                uint32_t i = block_index(expected, k, x, y);
                if (!same_block(found, expected, i))
                    fail_msg("%s: level %u block %u %u: flag %u, pixel %x; expected %u, %x", what,
                             k, x, y, found->flags[i], found->representatives[i],
                             expected->flags[i], expected->representatives[i]);
            }
}

static void check(const struct picture *p, const struct bd_discontinuity_settings *s,
                  const char *what)
{
    struct bd_discontinuity *d = discontinuity_of(p, s);
    struct blocks found = blocks_of_device(p, d), expected = blocks_by_definition(p, s);
    assert_memory_equal(&d->layout, &expected.layout, sizeof d->layout);
    assert_same(&found, &expected, picture_name(p, s, what).text);
    assert_monotone(&found);
    blocks_destroy(&found);
    blocks_destroy(&expected);
    bd_discontinuity_destroy(context.gpu, &d);
}

// Every pair of tests; the other settings take turns, so that each meets each sooner or later.
static struct bd_discontinuity_settings settings_of(uint32_t turn)
{
    static const double depth_thresholds[] = {.05, .013, .3}, normal_thresholds[] = {.27, .04, 1.1};
    static const uint32_t sides[] = {1, 4, 16, 7};
    return (struct bd_discontinuity_settings){
        .depth_test = (enum bd_depth_test)(turn % 4),
        .normal_test = (enum bd_normal_test)(turn / 4 % 3),
        .neighbourhood = (enum bd_neighbourhood)((turn / 9 + turn) % 3),
        .depth_threshold = depth_thresholds[turn / 2 % 3],
        .normal_threshold = normal_thresholds[turn / 5 % 3],
        .coarsest_side = sides[turn / 7 % 4],
    };
}

static void what_a_camera_sees(void **state)
{
    (void)state;
    const struct picture_sweep sweep = {settings_of, check, 9, 1};
    sweep_cameras(&sweep, sizes, COUNT(sizes));
}

static void what_a_light_sees(void **state)
{
    (void)state;
    const struct picture_sweep sweep = {settings_of, check, 9, 1};
    sweep_lights(&sweep, true);
}

static void odd_and_large(void **state)
{
    (void)state;
    const struct bd_discontinuity_settings all = {
        .depth_test = BD_DEPTH_TEST_DERIVATIVE,
        .normal_test = BD_NORMAL_TEST_MINMAX,
        .neighbourhood = BD_NEIGHBOURHOOD_ADJACENT,
        .depth_threshold = .02,
        .normal_threshold = .2,
        .coarsest_side = 3,
    };
    struct bd_discontinuity_settings sparse = all;
    sparse.depth_test = BD_DEPTH_TEST_MINMAX;
    for (size_t kind = 0; kind < picture_kind_count; kind++) {
        struct picture p = picture_of_camera(&picture_kinds[kind], (struct picture_size){255, 127});
        check(&p, kind % 2 ? &all : &sparse, picture_kinds[kind].name);
        picture_destroy(&p);
    }
    // A box, and dust, whose representatives have to be searched for.
    for (size_t kind = 1; kind < 3; kind++) {
        struct picture p =
            picture_of_camera(&picture_kinds[kind], (struct picture_size){1023, 769});
        check(&p, kind == 1 ? &all : &sparse, picture_kinds[kind].name);
        picture_destroy(&p);
    }
}

// In an orthographic view the depth itself means nothing: moving the viewer along it changes
// nothing.
static void an_orthographic_view_may_stand_anywhere(void **state)
{
    (void)state;
    struct picture p = picture_of_camera(&picture_kinds[1], (struct picture_size){64, 64});
    p.viewpoint.orthographic = true;
    p.viewpoint.half_width = 3;
    p.viewpoint.half_height = 5;
    static const enum bd_depth_test tests[] = {BD_DEPTH_TEST_MINMAX, BD_DEPTH_TEST_DERIVATIVE,
                                               BD_DEPTH_TEST_STEP};
    static const double thresholds[] = {.013, .35, .1};
    for (size_t i = 0; i < COUNT(tests); i++) {
        const struct bd_discontinuity_settings settings = {
            .depth_test = tests[i],
            .normal_test = BD_NORMAL_TEST_OFF,
            .depth_threshold = thresholds[i],
            .coarsest_side = 2,
        };
        check(&p, &settings, "orthographic");
    }
    picture_destroy(&p);
}

static void slices_change_nothing(void **state)
{
    (void)state;
    const struct bd_discontinuity_settings settings = settings_of(0);
    assert_true(check_in_slices(check, &settings) >= 30); // 240 rows, eight at a time
}

static uint64_t peak_bytes(const struct picture *p, const struct bd_discontinuity_settings *s)
{
    struct bd_gpu_memory before, after;
    bd_gpu_memory_reset_peak(context.gpu);
    bd_gpu_memory(context.gpu, &before);
    struct bd_discontinuity *d = discontinuity_of(p, s);
    bd_gpu_memory(context.gpu, &after);
    assert_true(after.used_bytes - before.used_bytes == bd_discontinuity_bytes(d));
    bd_discontinuity_destroy(context.gpu, &d);
    return after.peak_bytes - before.used_bytes;
}

static void no_pyramid_that_nobody_reads(void **state)
{
    (void)state;
    static const uint64_t depth_bytes[] = {8, 4, 0, 4}, normal_bytes[] = {32, 4, 0};
    const uint64_t blocks = 50 * 30 + 25 * 15, stack = 50 * (30 + 15 + 8 + 4 + 2 + 1 + 1);
    struct picture p = picture_of_camera(&picture_kinds[0], (struct picture_size){100, 60});
    for (int test = 0; test < 12; test++) {
        struct bd_discontinuity_settings s = {
            .depth_test = (enum bd_depth_test)(test % 4),
            .normal_test = (enum bd_normal_test)(test / 4),
            .depth_threshold = .1,
            .normal_threshold = .1,
            .coarsest_side = 1,
        };
        uint64_t depth = depth_bytes[test % 4], normal = normal_bytes[test / 4];
        assert_int_equal(peak_bytes(&p, &s), 2 * 4 * stack + (depth + normal) * blocks);
        s.depth_threshold = INFINITY;
        assert_int_equal(peak_bytes(&p, &s), 2 * 4 * stack + normal * blocks);
        check(&p, &s, "infinite threshold of depth");
        s.depth_threshold = .1;
        s.normal_threshold = INFINITY;
        assert_int_equal(peak_bytes(&p, &s), 2 * 4 * stack + depth * blocks);
        check(&p, &s, "infinite threshold of normals");
    }
    picture_destroy(&p);
}

// The pictures' shading normals are all ways, their geometric normals one.
static void geometric_normals_do_not_jump(void **state)
{
    (void)state;
    struct bd_discontinuity_settings s = {
        .depth_test = BD_DEPTH_TEST_OFF,
        .normal_threshold = .1,
        .geometric_normals = true,
        .coarsest_side = 1,
    };
    for (int test = BD_NORMAL_TEST_MINMAX; test <= BD_NORMAL_TEST_CHORD; test++) {
        struct picture p = picture_of_camera(&picture_kinds[0], (struct picture_size){37, 29});
        s.normal_test = (enum bd_normal_test)test;
        struct bd_discontinuity *d = discontinuity_of(&p, &s);
        struct bd_discontinuity_settings without = s;
        without.normal_test = BD_NORMAL_TEST_OFF;
        struct blocks found = blocks_of_device(&p, d),
                      expected = blocks_by_definition(&p, &without);
        assert_same(&found, &expected, "geometric normals");
        blocks_destroy(&found);
        blocks_destroy(&expected);
        bd_discontinuity_destroy(context.gpu, &d);
        picture_destroy(&p);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_a_camera_sees),
        cmocka_unit_test(what_a_light_sees),
        cmocka_unit_test(odd_and_large),
        cmocka_unit_test(an_orthographic_view_may_stand_anywhere),
        cmocka_unit_test(slices_change_nothing),
        cmocka_unit_test(no_pyramid_that_nobody_reads),
        cmocka_unit_test(geometric_normals_do_not_jump),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}
