// Glossy receivers lit by lists of blocks, one for each VPL: every pixel gets every VPL's light
// once, by blocks as large as the threshold allows.

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "pass/glossy_blocks.h"
#include "pass/subsplats.h"
#include "shared/vpl.h"
#include "view.h"

#define WIDTH        61 // odd on purpose
#define HEIGHT       47
#define PIXELS       (WIDTH * HEIGHT)
#define VPLS         300 // more than a batch
#define COUNT(array) ((uint32_t)(sizeof(array) / sizeof *(array)))

// --- a room with a glossy floor and a wall of metal ---------------------------------------------

// A quad of the floor, from x0 to x1, and its material.
static void add_floor(struct world *w, double x0_m, double x1_m, float roughness)
{
    const double corners_m[4][3] = {
        {x0_m, -.5, 1}, {x1_m, -.5, 1}, {x1_m, -.5, -1}, {x0_m, -.5, -1}};
    int32_t material = world_add_material(w, .3f);
    w->scene->materials[material].roughness = roughness;
    world_add_quad(w, material, corners_m, 3);
}

// The floor is glossy, only just, and only just not, from left to right; the wall ahead is of
// metal.
static void make_room(struct world *w, bool glossy)
{
    const double wall_m[4][3] = {{-1, -1, -.9}, {1, -1, -.9}, {1, 1, -.9}, {-1, 1, -.9}};
    const double eye_m[3] = {.1, .4, .9}, at_m[3] = {0, -.2, -.4}, lamp_m[3] = {-.3, .7, .2};
    world_clear(w);
    int32_t rough = world_add_material(w, .5f), metal = world_add_material(w, .8f);
    w->scene->materials[rough].roughness = w->scene->materials[metal].roughness = 1;
    if (glossy) w->scene->materials[metal].roughness = .4f;
    if (glossy) w->scene->materials[metal].metallic = 1;
    world_add_box_room(w, rough, (const double[3]){0, 0, 0}, 1);
    world_add_quad(w, metal, wall_m, 1);
    add_floor(w, -1, .2, glossy ? .3f : 1);
    add_floor(w, .2, .4, glossy ? .58f : 1);
    add_floor(w, .4, 1, glossy ? .62f : 1);
    world_add_light(w, BD_LIGHT_POINT, lamp_m, at_m, 1);
    world_add_camera(w, eye_m, at_m, 1.2);
}

// What a frame would give to a technique.
struct stage {
    struct view view;
    struct bd_fragments *start;
    struct bd_vpl_list vpls;
    struct bd_indirect *gathered;
    float (*expected)[4]; // of each pixel, what the gather says
};

static void find_start(struct stage *s)
{
    const struct bd_discontinuity_inputs seen = {
        .gbuffer = s->view.gbuffer,
        .viewpoint = &s->view.viewpoint,
        .space = &s->view.scene->space,
        .settings = {.depth_threshold = .2,
                     .normal_threshold = .3,
                     .geometric_normals = true,
                     .coarsest_side = 4},
    };
    struct bd_discontinuity *jumps, *blocks;
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_discontinuity_run(&s->view.context, &seen, &jumps, &detail), 0);
    const struct bd_glossy_blocks_inputs glossy = {
        .gbuffer = s->view.gbuffer,
        .viewpoint = &s->view.viewpoint,
        .space = &s->view.scene->space,
        .discontinuity = jumps,
        .normal_threshold = .3,
        .material_threshold = .1,
    };
    assert_int_equal(bd_glossy_blocks_run(&s->view.context, &glossy, &blocks, &detail), 0);
    assert_int_equal(bd_fragments_run(&s->view.context, &seen, blocks, BD_REFINEMENT_ONE_PASS,
                                      &s->start, &detail),
                     0);
    bd_discontinuity_destroy(s->view.world->gpu, &jumps);
    bd_discontinuity_destroy(s->view.world->gpu, &blocks);
}

// Before the walls of the room, at the golden angle, looking down and ahead.
static void make_vpls(struct stage *s)
{
    struct bd_vec4 *vpls = calloc(VPLS, BD_VPL_VEC4S * sizeof *vpls);
    for (uint32_t i = 0; i < VPLS; i++) {
        const double x_m = .9 * cos(2.4 * i), z_m = .9 * sin(2.4 * i), y_m = -.45 + 1.4 * i / VPLS;
        bd_dvec3 at = bd_render_from_world(&s->view.scene->space, (bd_dvec3){x_m, y_m, z_m});
        vpls[BD_VPL_VEC4S * i] = (struct bd_vec4){(float)at.x, (float)at.y, (float)at.z, 1e-3f};
        vpls[BD_VPL_VEC4S * i + 1] = (struct bd_vec4){(float)(-x_m / .9), 0, (float)(-z_m / .9), 0};
        vpls[BD_VPL_VEC4S * i + 2] = (struct bd_vec4){.01f, .02f, .01f * (float)(i % 7), 0};
    }
    view_set_vpls(&s->view, vpls, VPLS, &s->vpls);
    free(vpls);
}

static float (*read_pixels(const struct stage *s, const struct bd_tex *tex))[4]
{
    float(*pixels)[4] = malloc(PIXELS * sizeof *pixels);
    view_read(&s->view, tex, pixels, PIXELS * sizeof *pixels);
    return pixels;
}

static void gather(struct stage *s)
{
    const struct bd_vpl_list *lists[] = {&s->vpls};
    const struct bd_gather_inputs inputs = {
        .scene = s->view.scene,
        .viewpoint = &s->view.viewpoint,
        .gbuffer = s->view.gbuffer,
        .lists = lists,
        .list_count = 1,
        .glossy = true,
    };
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_gather_run(&s->view.context, &inputs, &s->gathered, &detail), 0);
    s->expected = read_pixels(s, s->gathered->glossy);
}

static void open_stage(struct world *w, struct stage *s)
{
    make_room(w, true);
    *s = (struct stage){.view = view_open(w)};
    view_look(&s->view, 0, WIDTH, HEIGHT, false);
    find_start(s);
    make_vpls(s);
    gather(s);
}

static void close_stage(struct stage *s)
{
    struct bd_gpu *gpu = s->view.world->gpu;
    view_forget_vpls(&s->view, &s->vpls);
    bd_indirect_destroy(gpu, &s->gathered);
    bd_fragments_destroy(gpu, &s->start);
    view_close(&s->view);
    free(s->expected);
}

// --- lists --------------------------------------------------------------------------------------

struct asked {
    enum bd_radiance_test test;
    double threshold;
    uint32_t block_limit; // 0: enough
    uint32_t vpl_count;   // the first ones; 0: all
    uint32_t list_count;  // the same list so many times; 0: once
};

struct seen {
    struct bd_subsplat_counts counts;
    float (*pixels)[4];
    double rms_error, largest_error; // against the gather, relative to its RMS and largest value
};

static void measure(const struct stage *s, struct seen *seen)
{
    double off = 0, sum = 0, most_off = 0, most = 0;
    for (int i = 0; i < PIXELS; i++) {
        for (int c = 0; c < 3; c++) {
            double value = s->expected[i][c], difference = seen->pixels[i][c] - value;
            assert_true(isfinite(difference));
            off += difference * difference, sum += value * value;
            most_off = fmax(most_off, fabs(difference)), most = fmax(most, fabs(value));
        }
    }
    assert_true(sum > 0);
    seen->rms_error = sqrt(off / sum);
    seen->largest_error = most_off / most;
}

static struct seen splat(const struct stage *s, const struct asked *asked)
{
    struct bd_vpl_list some = s->vpls;
    if (asked->vpl_count) some.count = asked->vpl_count;
    const struct bd_vpl_list *lists[] = {&some, &some};
    const struct bd_subsplats_inputs inputs = {
        .scene = s->view.scene,
        .viewpoint = &s->view.viewpoint,
        .gbuffer = s->view.gbuffer,
        .start = s->start,
        .irradiance = s->gathered->irradiance,
        .lists = lists,
        .list_count = asked->list_count ? asked->list_count : 1,
        .test = asked->test,
        .threshold = asked->threshold,
        .block_limit = asked->block_limit ? asked->block_limit : 1u << 18,
    };
    struct bd_tex *glossy;
    struct seen seen;
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_subsplats_run(&s->view.context, &inputs, &glossy, &seen.counts, &detail),
                     0);
    seen.pixels = read_pixels(s, glossy);
    bd_tex_destroy(s->view.world->gpu, &glossy);
    measure(s, &seen);
    return seen;
}

// Glossy are the pixels at which the gather finds a lobe: the floor's and the metal wall's.
static uint32_t expect_covered(const struct stage *s, const struct seen *seen, float vpls)
{
    uint32_t pixels = 0;
    for (int i = 0; i < PIXELS; i++) {
        bool glossy = s->expected[i][0] != 0;
        assert_true(seen->pixels[i][3] == (glossy ? vpls : 0));
        assert_true(glossy || seen->pixels[i][0] == 0);
        pixels += glossy;
    }
    return pixels;
}

static void threshold_0_is_the_gather(void **state)
{
    struct stage s;
    open_stage(*state, &s);
    const struct seen seen = splat(&s, &(struct asked){.threshold = 0});
    const uint32_t pixels = expect_covered(&s, &seen, VPLS);
    assert_true(pixels > PIXELS / 4 && pixels < PIXELS);
    assert_int_equal(seen.counts.drawn, (uint64_t)pixels * VPLS);
    assert_true(seen.largest_error < 1e-5);
    assert_false(seen.counts.is_limited);
    free(seen.pixels);
    close_stage(&s);
}

static void thresholds_trade_subsplats_for_error(void **state)
{
    static const double thresholds[] = {.01, .05, .2, .5, 1e6};
    static const double error_max[] = {1.5e-3, 2e-3, .01, .06, .2}; // twice what is seen
    struct stage s;
    open_stage(*state, &s);
    struct seen before = splat(&s, &(struct asked){.threshold = 0});
    free(before.pixels);
    for (uint32_t i = 0; i < COUNT(thresholds); i++) {
        const struct seen seen = splat(&s, &(struct asked){.threshold = thresholds[i]});
        expect_covered(&s, &seen, VPLS);
        assert_int_equal(seen.counts.tested, seen.counts.drawn + seen.counts.split);
        assert_true(seen.counts.drawn < before.counts.drawn);
        assert_true(seen.counts.tested < before.counts.tested);
        assert_true(seen.rms_error > before.rms_error && seen.rms_error < error_max[i]);
        free(seen.pixels);
        before = seen;
    }
    // Nothing is split: the first list, as often as there are VPLs.
    assert_int_equal(before.counts.drawn, (uint64_t)s.start->count * VPLS);
    assert_int_equal(before.counts.split, 0);
    close_stage(&s);
}

// Each VPL by itself, so that none can stand in for another.
static void every_vpl_covers_every_pixel_once(void **state)
{
    struct stage s;
    open_stage(*state, &s);
    for (uint32_t count = 1; count <= VPLS; count = 2 * count + 1) {
        const struct seen seen = splat(&s, &(struct asked){.threshold = .001, .vpl_count = count});
        expect_covered(&s, &seen, (float)count);
        assert_true(seen.counts.split > 0);
        free(seen.pixels);
    }
    const struct seen twice = splat(&s, &(struct asked){.threshold = .1, .list_count = 2});
    expect_covered(&s, &twice, 2 * VPLS);
    free(twice.pixels);
    close_stage(&s);
}

static void the_same_lists_every_time(void **state)
{
    struct stage s;
    open_stage(*state, &s);
    const struct seen once = splat(&s, &(struct asked){.threshold = .1});
    const struct seen again = splat(&s, &(struct asked){.threshold = .1});
    // In other parts of the first list, but with the same blocks.
    const struct seen in_parts = splat(&s, &(struct asked){.threshold = .1, .block_limit = 2000});
    assert_memory_equal(once.pixels, again.pixels, PIXELS * sizeof *once.pixels);
    assert_memory_equal(once.pixels, in_parts.pixels, PIXELS * sizeof *once.pixels);
    assert_int_equal(once.counts.drawn, in_parts.counts.drawn);
    free(once.pixels), free(again.pixels), free(in_parts.pixels);
    close_stage(&s);
}

static void a_full_list_is_drawn_as_it_is(void **state)
{
    struct stage s;
    open_stage(*state, &s);
    const struct seen whole = splat(&s, &(struct asked){.threshold = 0});
    const struct seen coarse = splat(&s, &(struct asked){.threshold = 1e6});
    const struct seen limited = splat(&s, &(struct asked){.threshold = 0, .block_limit = 64});
    assert_true(limited.counts.is_limited && !whole.counts.is_limited);
    expect_covered(&s, &limited, VPLS);
    assert_true(limited.counts.drawn < whole.counts.drawn);
    assert_true(limited.counts.drawn > coarse.counts.drawn);
    assert_true(limited.rms_error > whole.rms_error && limited.rms_error < coarse.rms_error);
    assert_int_equal(limited.counts.tested, limited.counts.drawn + limited.counts.split);
    free(whole.pixels), free(coarse.pixels), free(limited.pixels);
    close_stage(&s);
}

static void an_absolute_threshold_is_a_radiance(void **state)
{
    struct stage s;
    open_stage(*state, &s);
    struct asked asked = {.test = BD_RADIANCE_TEST_ABSOLUTE};
    double most_cd_m2 = 0;
    for (int i = 0; i < PIXELS; i++)
        most_cd_m2 = fmax(most_cd_m2, fabs(s.expected[i][1]) * s.view.scene->space.unit_cd_m2);
    asked.threshold = most_cd_m2 * 2;
    const struct seen none = splat(&s, &asked);
    asked.threshold = most_cd_m2 / VPLS / 10;
    const struct seen some = splat(&s, &asked);
    assert_int_equal(none.counts.split, 0);
    assert_true(some.counts.split > 0);
    // No block is off by more than its range, whose bound is the threshold.
    assert_true(some.largest_error < .1);
    expect_covered(&s, &some, VPLS);
    free(none.pixels), free(some.pixels);
    close_stage(&s);
}

static void pixels_alone_will_do(void **state)
{
    struct stage s;
    open_stage(*state, &s);
    struct bd_discontinuity *pixels;
    const struct bd_discontinuity_inputs seen = {
        .gbuffer = s.view.gbuffer, .viewpoint = &s.view.viewpoint, .space = &s.view.scene->space};
    struct bd_err_detail detail = {0};
    bd_fragments_destroy(s.view.world->gpu, &s.start);
    assert_int_equal(bd_glossy_pixels(s.view.world->gpu, &s.view.viewpoint, &pixels, &detail), 0);
    assert_int_equal(
        bd_fragments_run(&s.view.context, &seen, pixels, BD_REFINEMENT_ONE_PASS, &s.start, &detail),
        0);
    bd_discontinuity_destroy(s.view.world->gpu, &pixels);
    const struct seen drawn = splat(&s, &(struct asked){.threshold = 1e6});
    assert_int_equal(expect_covered(&s, &drawn, VPLS), s.start->count);
    assert_true(drawn.largest_error < 1e-5);
    free(drawn.pixels);
    close_stage(&s);
}

// --- the technique ------------------------------------------------------------------------------

static bool has_pass(const struct bd_report *report, const char *name)
{
    for (uint32_t i = 0; i < report->pass_count; i++)
        if (strcmp(report->passes[i].name, name) == 0) return true;
    return false;
}

static bool has_flag(const struct bd_report *report, const char *start)
{
    for (uint32_t i = 0; i < report->flag_count; i++)
        if (strncmp(report->flags[i], start, strlen(start)) == 0) return true;
    return false;
}

static void render(struct world *w, const char *technique, const char *const *settings,
                   struct bd_image *out[BD_LAYER_COUNT])
{
    world_render(w, technique, 0, WIDTH, HEIGHT, 1u << BD_LAYER_INDIRECT, settings, out);
}

static void expect_planned_out(struct world *w, const char *const *settings)
{
    struct bd_image *l[BD_LAYER_COUNT];
    render(w, "multires_gather", settings, l);
    assert_false(has_pass(&w->report, "glossy"));
    world_free_layers(l);
    render(w, "multires_splat", settings, l);
    assert_false(has_pass(&w->report, "subsplats"));
    assert_int_equal(w->report.counts.subsplats_tested, 0);
    world_free_layers(l);
}

static void no_lists_without_glossy_receivers(void **state)
{
    static const char *const lambert[] = {"vpls=24", "brdf=lambert", NULL};
    make_room(*state, false);
    expect_planned_out(*state, (const char *const[]){"vpls=24", NULL});
    make_room(*state, true);
    expect_planned_out(*state, lambert);
}

static void expect_same(const struct bd_image *picture, const struct bd_image *expected)
{
    float most = 0;
    for (int i = 0; i < 3 * PIXELS; i++) most = fmaxf(most, expected->pixels[i]);
    for (int i = 0; i < 3 * PIXELS; i++)
        assert_true(fabsf(picture->pixels[i] - expected->pixels[i]) < 1e-5f * most);
}

static void glossy_receivers_are_those_of_the_gather(void **state)
{
    static const char *const all[] = {"vpls=96", NULL};
    static const char *const pixels[] = {"vpls=96", "coarsest=64", NULL};
    static const char *const split[] = {"vpls=96", "coarsest=64", "radiance_threshold=0", NULL};
    static const char *const limited[] = {"vpls=96", "coarsest=4", "radiance_threshold=0",
                                          "subsplat_limit=64", NULL};
    struct world *w = *state;
    struct bd_image *expected[BD_LAYER_COUNT], *l[BD_LAYER_COUNT];
    make_room(w, true);
    render(w, "rsm", all, expected);
    render(w, "multires_gather", pixels, l);
    assert_true(has_pass(&w->report, "glossy") && !has_flag(&w->report, "glossy_as_diffuse"));
    expect_same(l[BD_LAYER_INDIRECT], expected[BD_LAYER_INDIRECT]);
    world_free_layers(l);
    render(w, "multires_splat", split, l);
    assert_true(has_pass(&w->report, "subsplats") && w->report.counts.subsplats > 0);
    assert_false(has_flag(&w->report, "glossy_as_diffuse"));
    assert_false(has_flag(&w->report, "subsplats_limited"));
    expect_same(l[BD_LAYER_INDIRECT], expected[BD_LAYER_INDIRECT]);
    world_free_layers(l);
    render(w, "multires_splat", limited, l);
    assert_true(has_flag(&w->report, "subsplats_limited"));
    world_free_layers(l);
    world_free_layers(expected);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(threshold_0_is_the_gather),
        cmocka_unit_test(thresholds_trade_subsplats_for_error),
        cmocka_unit_test(every_vpl_covers_every_pixel_once),
        cmocka_unit_test(the_same_lists_every_time),
        cmocka_unit_test(a_full_list_is_drawn_as_it_is),
        cmocka_unit_test(an_absolute_threshold_is_a_radiance),
        cmocka_unit_test(pixels_alone_will_do),
        cmocka_unit_test(no_lists_without_glossy_receivers),
        cmocka_unit_test(glossy_receivers_are_those_of_the_gather),
    };
    return cmocka_run_group_tests(tests, world_open, world_close);
}
