// Blocks that are split because light changes too much over them: which, and what it is good for.

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "blocks.h"
#include "kernel.h"

#define WIDTH  90
#define HEIGHT 75

static bool on_a_line(uint32_t x, uint32_t y)
{
    return (int)x - (int)y / 2 == 20;
}

static bool but_a_corner(uint32_t x, uint32_t y)
{
    return x > 9 || y > 6;
}

// Nearly up to the VPLs, which are in a plane at .4.
static double hill(uint32_t x, uint32_t y)
{
    double u = (x - 60.0) / 12, v = (y - 30.0) / 12;
    return 0.38 * exp(-u * u - v * v);
}

static const struct blocks_scene scene = {
    .width_px = WIDTH,
    .height_px = HEIGHT,
    .coarsest_side = 6,
    .discontinuous = on_a_line,
    .lit = but_a_corner,
    .height = hill,
    .vpl_count = 1500, // more than one dispatch sums
};

// --- the passes ---------------------------------------------------------------------------------

static struct bd_multires_light *gather(struct blocks *b, const struct bd_fragments *fragments,
                                        enum bd_fragment_visit visit,
                                        struct bd_multires_light *into)
{
    const struct bd_gather_fragments_inputs inputs = {
        .scene = &b->scene,
        .viewpoint = &b->viewpoint,
        .gbuffer = &b->gbuffer,
        .discontinuity = &b->discontinuity,
        .fragments = fragments,
        .lists = b->lists,
        .list_count = 1,
        .vector = true,
        .visit = visit,
        .spread = true,
        .into = into,
    };
    struct bd_multires_light *light;
    struct bd_err_detail detail = {0};
    if (bd_gather_fragments_run(&b->context, &inputs, &light, &detail))
        fail_msg("%s", detail.message);
    return light;
}

static struct bd_fragments *split(struct blocks *b, const struct bd_fragments *parents,
                                  const struct bd_multires_light *light, double threshold)
{
    const struct bd_discontinuity_inputs inputs = {
        .gbuffer = &b->gbuffer, .viewpoint = &b->viewpoint, .space = &b->scene.space};
    const struct bd_light_of_blocks blocks = {light->coarse, light->coarse_vector};
    struct bd_fragments *parts;
    struct bd_err_detail detail = {0};
    if (bd_fragments_refine(&b->context, &inputs, &b->discontinuity, &b->fragments, parents,
                            &blocks, threshold, &parts, &detail))
        fail_msg("%s", detail.message);
    return parts;
}

static uint32_t *list_of(struct blocks *b, const struct bd_fragments *fragments)
{
    uint32_t *list = calloc(fragments->count + 1, sizeof *list);
    assert_non_null(list);
    if (fragments->count > 0)
        assert_int_equal(
            bd_buf_read(b->gpu, fragments->list, 0, list, fragments->count * sizeof *list),
            BD_ERR_OK);
    return list;
}

// --- which --------------------------------------------------------------------------------------

static bool is_lit(const struct blocks *b, uint32_t level, uint32_t x, uint32_t y)
{
    const struct bd_multires_level *size = &b->fragments.layout.levels[level];
    if (x >= size->columns || y >= size->rows) return false;
    for (uint32_t j = y << level; j < (y + 1) << level && j < HEIGHT; j++)
        for (uint32_t i = x << level; i < (x + 1) << level && i < WIDTH; i++)
            if (but_a_corner(i, j)) return true;
    return false;
}

static double all_channels(const float *rgb)
{
    return (double)rgb[0] + (double)rgb[1] + (double)rgb[2];
}

static bool is_listed(const uint32_t *list, uint32_t count, uint32_t fragment)
{
    for (uint32_t i = 0; i < count; i++)
        if (list[i] == fragment) return true;
    return false;
}

// Every child with something lit of what light changes too much over is listed, and no more are.
static void assert_parts(struct blocks *b, const struct bd_fragments *parents,
                         const struct bd_multires_light *light, double threshold,
                         const struct bd_fragments *parts)
{
    float *e = blocks_texels(b->gpu, light->coarse),
          *v = blocks_texels(b->gpu, light->coarse_vector);
    uint32_t *from = list_of(b, parents), *found = list_of(b, parts), expected = 0;
    for (uint32_t i = 0; i < parents->count; i++) {
        uint32_t k = BD_FRAGMENT_LEVEL(from[i]), x = BD_FRAGMENT_X(from[i]),
                 y = BD_FRAGMENT_Y(from[i]);
        if (k == 0) continue;
        size_t at = 4 * blocks_texel(b, k, x, y);
        bool split_up = (double)v[at + 3] > threshold * all_channels(e + at);
        for (uint32_t c = 0; c < 4; c++) {
            uint32_t cx = 2 * x + c % 2, cy = 2 * y + c / 2;
            bool wanted = split_up && is_lit(b, k - 1, cx, cy);
            if (wanted != is_listed(found, parts->count, BD_FRAGMENT_PACK(k - 1, cx, cy)))
                fail_msg("level %u, block %u %u: %s", k - 1, cx, cy,
                         wanted ? "not there" : "nobody wants it");
            expected += wanted;
        }
    }
    assert_int_equal(expected, parts->count);
    free(e), free(v), free(from), free(found);
}

// Pixels that are fragments are lit as the full gather lights them.
static void assert_own(struct blocks *b, const float *seen, const float *full)
{
    for (uint32_t p = 0; p < b->part_count; p++) {
        uint32_t *list = list_of(b, b->parts[p]);
        for (uint32_t i = 0; i < b->parts[p]->count; i++) {
            if (BD_FRAGMENT_LEVEL(list[i]) > 0) continue;
            size_t at = 4 * ((size_t)BD_FRAGMENT_Y(list[i]) * WIDTH + BD_FRAGMENT_X(list[i]));
            for (int c = 0; c < 3; c++)
                assert_true(fabsf(seen[at + c] - full[at + c]) <= 1e-5f * full[at + c]);
        }
        free(list);
    }
}

static double rms_error(struct blocks *b, struct bd_multires_light **light, const float *full)
{
    float *seen = blocks_upsampled(b, light, BD_SURFACE_DETAIL_DIRECTION);
    double error = 0, sum = 0;
    for (size_t i = 0; i < (size_t)WIDTH * HEIGHT; i++) {
        error += pow((double)seen[4 * i] - (double)full[4 * i], 2);
        sum += (double)full[4 * i];
    }
    assert_own(b, seen, full);
    free(seen);
    return sqrt(error * WIDTH * HEIGHT) / sum;
}

struct outcome {
    uint32_t fragments;
    double error;
};

static struct outcome refined(struct blocks *b, enum bd_fragment_visit visit, double threshold,
                              const float *full)
{
    struct outcome outcome = {.fragments = b->fragments.count};
    struct bd_multires_light *light = gather(b, &b->fragments, visit, NULL);
    const struct bd_fragments *last = &b->fragments;
    while (last->count > last->level_count[0]) {
        assert_in_range(b->part_count, 0, b->fragments.layout.level_count - 1);
        struct bd_fragments *parts = split(b, last, light, threshold);
        assert_parts(b, last, light, threshold, parts);
        b->parts[b->part_count++] = parts;
        outcome.fragments += parts->count;
        if (parts->count > 0) assert_ptr_equal(gather(b, parts, visit, light), light);
        last = parts;
    }
    outcome.error = rms_error(b, &light, full);
    while (b->part_count > 0) bd_fragments_destroy(b->gpu, &b->parts[--b->part_count]);
    return outcome;
}

// --- tests --------------------------------------------------------------------------------------

static void blocks_are_split_where_light_changes(void **state)
{
    struct blocks b;
    blocks_create(*state, &scene, &b);
    float *full = blocks_gathered(&b);
    struct outcome whole = refined(&b, BD_FRAGMENT_VISIT_LIST, 1e30, full);
    struct outcome parts = refined(&b, BD_FRAGMENT_VISIT_LIST, .1, full);
    struct outcome masked = refined(&b, BD_FRAGMENT_VISIT_MASK, .1, full);
    print_message("    fragments %u, error %.2f %%; %u, %.2f %%\n", whole.fragments,
                  100 * whole.error, parts.fragments, 100 * parts.error);
    assert_int_equal(whole.fragments, b.fragments.count);
    assert_true(parts.fragments < WIDTH * HEIGHT / 2);
    assert_true(parts.error < whole.error / 3);
    assert_int_equal(masked.fragments, parts.fragments);
    assert_true(fabs(masked.error - parts.error) < 1e-4 * parts.error);
    free(full);
    blocks_destroy(&b);
}

// On a plane blocks lie in the middle of one surface, and their children are not looked at one by
// one.
static void parts_keep_what_they_gathered(void **state)
{
    struct blocks_scene plane = scene;
    plane.height = NULL;
    struct blocks b;
    blocks_create(*state, &plane, &b);
    float *full = blocks_gathered(&b);
    struct outcome parts = refined(&b, BD_FRAGMENT_VISIT_LIST, 0, full);
    print_message("    fragments %u, error %.3f %%\n", parts.fragments, 100 * parts.error);
    assert_true(parts.fragments < WIDTH * HEIGHT / 2);
    assert_true(parts.error < 0.001);
    free(full);
    blocks_destroy(&b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(blocks_are_split_where_light_changes),
        cmocka_unit_test(parts_keep_what_they_gathered),
    };
    return cmocka_run_group_tests(tests, kernel_open_device, kernel_close_device);
}
