// Lamps that have no maps: what arrives by rays, against closed forms, maps, and relations.

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/pool.h"
#include "world.h"

#define ALBEDO 0.5
#define SIDE   48u

static const double centre[3] = {0, 0, 0}, down[3] = {0, -1, 0};
static const double eye[3] = {-.9, .5, .9}, target[3] = {.3, -.7, -.4};
static const char *const by_rays[] = {"lamps=rays", "brdf=lambert", NULL};
static const char *const by_maps[] = {"lamps=maps", "brdf=lambert", "shadow_size=4096", NULL};

// --- rooms --------------------------------------------------------------------------------------

static void add_table(struct world *w)
{
    static const double table[4][3] = {
        {-.4, -.5, .4}, {.4, -.5, .4}, {.4, -.5, -.4}, {-.4, -.5, -.4}};
    const int32_t grey = world_add_material(w, (float)ALBEDO);
    world_add_quad(w, grey, table, 1);
    w->scene->materials[grey].double_sided = true;
}

static void begin_room(struct world *w)
{
    world_clear(w);
    world_add_box_room(w, world_add_material(w, (float)ALBEDO), centre, 1);
    add_table(w);
    world_add_camera(w, eye, target, 1.1);
}

static double spread(uint32_t i, double step)
{
    const double at = i * step;
    return at - floor(at);
}

// Lamp `i` of a series without an end: points, narrow and wide spots, some with a range.
static void add_lamp(struct world *w, uint32_t i, float intensity)
{
    const double at[3] = {1.8 * spread(i, .754877666) - .9, .2 + .7 * spread(i, .5698402910),
                          1.8 * spread(i, .3819660113) - .9};
    const double look[3] = {spread(i, .23) - .5, -1, spread(i, .41) - .5};
    const int32_t lamp =
        world_add_light(w, i % 3 ? BD_LIGHT_SPOT : BD_LIGHT_POINT, at, look, intensity);
    w->scene->lights[lamp].cone_inner = i % 2 ? .2f : .6f;
    w->scene->lights[lamp].cone_outer = i % 2 ? .5f : 1.3f;
    if (i % 5 == 0) w->scene->lights[lamp].range_m = 1.5f;
    for (int c = 0; c < 3; c++) w->scene->lights[lamp].color[c] = 1 - .3f * (float)(i % (2 + c));
}

static void build_room(struct world *w, uint32_t first, uint32_t end, float intensity)
{
    begin_room(w);
    for (uint32_t i = first; i < end; i++) add_lamp(w, i, intensity);
}

// --- pictures -----------------------------------------------------------------------------------

static struct bd_image *direct_of(struct world *w, const char *const *settings)
{
    struct bd_image *layers[BD_LAYER_COUNT];
    world_render(w, "direct", 0, SIDE, SIDE, 1u << BD_LAYER_DIRECT, settings, layers);
    struct bd_image *direct = layers[BD_LAYER_DIRECT];
    layers[BD_LAYER_DIRECT] = NULL;
    world_free_layers(layers);
    return direct;
}

static double mean_of(const struct bd_image *image)
{
    double sum = 0;
    for (size_t i = 0; i < 3 * SIDE * SIDE; i++) sum += image->pixels[i];
    return sum / (3 * SIDE * SIDE);
}

// Over the mean of the first.
static double rmse_of(const struct bd_image *a, const struct bd_image *b, double scale)
{
    double sum = 0;
    for (size_t i = 0; i < 3 * SIDE * SIDE; i++) sum += pow(a->pixels[i] - scale * b->pixels[i], 2);
    return sqrt(sum / (3 * SIDE * SIDE)) / mean_of(a);
}

static bool has_pass(const struct bd_report *report, const char *name)
{
    for (uint32_t i = 0; i < report->pass_count; i++)
        if (strcmp(report->passes[i].name, name) == 0) return true;
    return false;
}

// --- closed forms -------------------------------------------------------------------------------

// A floor under a lamp of each kind: intensity, cone, range and cosine as glTF has them.
static void each_kind_gives_what_gltf_says(void **state)
{
    static const double floor[4][3] = {{-9, 0, 9}, {9, 0, 9}, {9, 0, -9}, {-9, 0, -9}};
    static const double lamp[3] = {0, 2, 0}, spot[3] = {.9, 0, 0}, up[3] = {0, 1, 0};
    static const double slanted[3] = {.6, -.8, 0};
    static const enum bd_light_kind kinds[] = {BD_LIGHT_POINT, BD_LIGHT_SPOT, BD_LIGHT_DIRECTIONAL};
    const double d2 = .81 + 4, cosine = 2 / sqrt(d2);
    const double cone = (cosine - cos(.8)) / (cos(.1) - cos(.8));
    const double window = 1 - pow(d2 / 9, 2);
    const double expected[] = {7 * window * cosine / d2, 7 * cone * cone * window * cosine / d2,
                               7 * .8};
    struct world *w = *state;
    for (int k = 0; k < 3; k++) {
        world_clear(w);
        world_add_quad(w, world_add_material(w, (float)ALBEDO), floor, 1);
        world_add_light(w, kinds[k], lamp, k == 2 ? slanted : down, 7);
        w->scene->lights[0].cone_inner = .1f;
        w->scene->lights[0].cone_outer = .8f;
        if (k < 2) w->scene->lights[0].range_m = 3;
        world_add_probe(w, spot, up, 1e-3);
        ASSERT_REL(world_probe(w, "direct", 0, BD_LAYER_DIRECT, by_rays),
                   ALBEDO / M_PI * expected[k], 1e-4);
        assert_true(has_pass(&w->report, "lamps") && !has_pass(&w->report, "shadow_map"));
    }
}

// Where no more lamps than rays are, nothing is left to chance: rays and maps say the same but for
// pixels at a shadow's edge, and the filter finds no noise.
static void few_lamps_are_exact(void **state)
{
    struct world *w = *state;
    build_room(w, 0, 5, 1);
    struct bd_image *rays = direct_of(w, by_rays), *maps = direct_of(w, by_maps);
    uint32_t off = 0;
    for (size_t i = 0; i < 3 * SIDE * SIDE; i++)
        off += fabsf(rays->pixels[i] - maps->pixels[i]) > 1e-4f * maps->pixels[i];
    print_message("    %u of %u values differ\n", off, 3 * SIDE * SIDE);
    assert_true(off < 3 * SIDE * SIDE / 200);
    bd_image_destroy(&rays);
    bd_image_destroy(&maps);
}

// --- many ---------------------------------------------------------------------------------------

// More than a cut has nodes: 700 lamps against their maps.
static void many_lamps_are_right_in_the_mean(void **state)
{
    static const char *const unfiltered[] = {"lamps=rays", "brdf=lambert", "noise_filter=off",
                                             NULL};
    static const char *const maps[] = {"lamps=maps", "brdf=lambert", "shadow_size=256", NULL};
    struct world *w = *state;
    build_room(w, 0, 700, 1);
    struct bd_image *expected = direct_of(w, maps), *seen = direct_of(w, unfiltered);
    const double rmse = rmse_of(expected, seen, 1);
    print_message("    %.3g %% of noise\n", 100 * rmse);
    ASSERT_REL(mean_of(seen), mean_of(expected), 5e-3);
    assert_true(rmse < .25);
    bd_image_destroy(&seen);
    seen = direct_of(w, by_rays);
    ASSERT_REL(mean_of(seen), mean_of(expected), 1e-2);
    assert_true(rmse_of(expected, seen, 1) < .6 * rmse);
    bd_image_destroy(&seen);
    bd_image_destroy(&expected);
}

// What two halves of the lamps give together, all give; whatever their order.
static void lamps_add_up(void **state)
{
    static const char *const settings[] = {"lamps=rays", "light_rays=64", NULL};
    struct world *w = *state;
    double parts[2];
    for (uint32_t h = 0; h < 2; h++) {
        build_room(w, 150 * h, 150 + 150 * h, 1);
        struct bd_image *half = direct_of(w, settings);
        parts[h] = mean_of(half);
        bd_image_destroy(&half);
    }
    build_room(w, 0, 300, 1);
    struct bd_image *all = direct_of(w, settings);
    ASSERT_REL(mean_of(all), parts[0] + parts[1], 3e-3);
    begin_room(w);
    for (uint32_t i = 300; i-- > 0;) add_lamp(w, i, 1);
    struct bd_image *turned = direct_of(w, settings);
    ASSERT_REL(mean_of(turned), mean_of(all), 3e-3);
    bd_image_destroy(&all);
    bd_image_destroy(&turned);
}

// Twice the power is twice the light, of the same lamps at the same pixels.
static void power_scales(void **state)
{
    struct world *w = *state;
    build_room(w, 0, 300, 1);
    struct bd_image *once = direct_of(w, by_rays);
    build_room(w, 0, 300, 8);
    struct bd_image *eight = direct_of(w, by_rays);
    assert_true(rmse_of(once, eight, .125) < 1e-5);
    bd_image_destroy(&once);
    bd_image_destroy(&eight);
}

// 300 lamps above a ceiling light nothing below it.
static void lamps_behind_a_wall_light_nothing(void **state)
{
    struct world *w = *state;
    begin_room(w);
    for (uint32_t i = 0; i < 300; i++) {
        const double at[3] = {2 * spread(i, .75) - 1, 1.2 + spread(i, .57), 2 * spread(i, .38) - 1};
        world_add_light(w, BD_LIGHT_POINT, at, down, 100);
    }
    struct bd_image *dark = direct_of(w, by_rays);
    assert_true(mean_of(dark) == 0);
    bd_image_destroy(&dark);
}

// One narrow spot among 300 lamps, most of the light where it falls: no pixel of its disk misses
// it.
static void one_spot_of_many_is_found(void **state)
{
    static const double at[3] = {0, .9, 0};
    struct world *w = *state;
    begin_room(w);
    for (uint32_t i = 0; i < 299; i++) add_lamp(w, i, 1e-3f);
    world_add_light(w, BD_LIGHT_SPOT, at, down, 1);
    w->scene->lights[299].cone_inner = .09f;
    w->scene->lights[299].cone_outer = .1f;
    struct bd_image *rays = direct_of(w, by_rays);
    build_room(w, 0, 0, 1);
    world_add_light(w, BD_LIGHT_SPOT, at, down, 1);
    w->scene->lights[0].cone_inner = .09f;
    w->scene->lights[0].cone_outer = .1f;
    struct bd_image *alone = direct_of(w, by_maps);
    uint32_t lit = 0, missed = 0;
    for (size_t i = 0; i < 3 * SIDE * SIDE; i++) {
        lit += alone->pixels[i] > .02f;
        missed += alone->pixels[i] > .02f && rays->pixels[i] < .99f * alone->pixels[i];
    }
    print_message("    %u of %u missed\n", missed, lit);
    assert_true(lit > 12 && missed == 0);
    bd_image_destroy(&rays);
    bd_image_destroy(&alone);
}

// --- what changes no byte -----------------------------------------------------------------------

static void threads_change_no_byte(void **state)
{
    struct world *w = *state;
    struct bd_image *first = NULL;
    build_room(w, 0, 300, 1);
    for (uint32_t threads = 1; threads < 5; threads++) {
        bd_pool_destroy(&w->renderer.pool);
        w->renderer.pool = bd_pool_create(threads);
        w->fresh = BD_FRESH_ALL;
        struct bd_image *seen = direct_of(w, by_rays);
        if (first)
            assert_memory_equal(seen->pixels, first->pixels, 3 * SIDE * SIDE * sizeof(float));
        else
            first = bd_image_create(SIDE, SIDE, 3);
        memcpy(first->pixels, seen->pixels, 3 * SIDE * SIDE * sizeof(float));
        bd_image_destroy(&seen);
    }
    w->fresh = BD_FRESH_NONE;
    bd_image_destroy(&first);
}

// --- when ---------------------------------------------------------------------------------------

// Maps stay for few lamps, in large pictures, for techniques that know no other light, and where
// they are asked for.
static void counts_decide(void **state)
{
    struct world *w = *state;
    static const struct {
        uint32_t lamps;
        const char *technique, *settings[3];
        bool by_rays;
    } cases[] = {
        {8, "direct", {NULL}, false},
        {9, "direct", {NULL}, true},
        {64, "direct", {NULL}, true},
        {64, "direct", {"shadow_size=16", "light_rays=64", NULL}, false},
        {64, "direct", {"light_rays=0", NULL}, false},
        {64, "direct", {"lamps=maps", "shadow_size=256", NULL}, false},
        {3, "direct", {"lamps=rays", NULL}, true},
        {3, "direct", {"lamps=rays", "light_rays=0", NULL}, false},
        {64, "multires_gather", {"vpls=64", NULL}, true},
        {64, "hisr", {"vpls=64", NULL}, true},
        {64, "isr", {"vpls=64", NULL}, true},
        {3, "rsm", {"paper_mode=1", "vpls=64", NULL}, false},
        {20, "rsm_splat", {"vpls=64", "shadow_size=256", NULL}, false},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct bd_image *layers[BD_LAYER_COUNT];
        build_room(w, 0, cases[i].lamps, 1);
        world_render(w, cases[i].technique, 0, 16, 16, 1, cases[i].settings, layers);
        world_free_layers(layers);
        print_message("    %u lamps, %s %s\n", cases[i].lamps, cases[i].technique,
                      cases[i].settings[0] ? cases[i].settings[0] : "");
        assert_true(has_pass(&w->report, "lamps") == cases[i].by_rays);
        assert_true(has_pass(&w->report, "shadow_map") != cases[i].by_rays);
        assert_true(has_pass(&w->report, "direct") != cases[i].by_rays);
    }
}

// --- indirect light -----------------------------------------------------------------------------

// In a grey room light of lamps is sent on once, as by their maps, in every technique.
static void what_they_light_sends_it_on(void **state)
{
    static const char *const techniques[] = {"rsm", "multires_gather", "isr", "hisr"};
    static const char *const how[2][4] = {{"lamps=maps", "vpls=4096", "vpl_budget=262144", NULL},
                                          {"lamps=rays", "vpls=4096", NULL}};
    struct world *w = *state;
    build_room(w, 0, 20, 1);
    for (int t = 0; t < 4; t++) {
        double mean[2];
        for (int h = 0; h < 2; h++) {
            struct bd_image *layers[BD_LAYER_COUNT];
            world_render(w, techniques[t], 0, SIDE, SIDE, 1u << BD_LAYER_INDIRECT, how[h], layers);
            mean[h] = mean_of(layers[BD_LAYER_INDIRECT]);
            world_free_layers(layers);
        }
        ASSERT_REL(mean[1], mean[0], 2e-2);
    }
}

// Blocks of maps are split as often as a budget that is told allows, and keep all the light.
static void clusters_keep_to_a_budget(void **state)
{
    static const char *const budgets[] = {"vpl_budget=0", "vpl_budget=4096", "vpl_budget=1200"};
    struct world *w = *state;
    double mean = 0;
    build_room(w, 0, 3, 1);
    for (int b = 0; b < 3; b++) {
        const char *const settings[] = {budgets[b], "vpls=256", "lamps=maps", NULL};
        struct bd_image *layers[BD_LAYER_COUNT];
        world_render(w, "isr", 0, SIDE, SIDE, 1u << BD_LAYER_INDIRECT, settings, layers);
        const double seen = mean_of(layers[BD_LAYER_INDIRECT]);
        world_free_layers(layers);
        print_message("    %s: %llu VPLs\n", budgets[b], (unsigned long long)w->report.counts.vpls);
        if (b == 0)
            assert_true(w->report.counts.vpls > 4096);
        else
            assert_true(w->report.counts.vpls <= (b == 1 ? 4096 : 1200));
        if (b > 0) ASSERT_REL(seen, mean, 3e-2);
        mean = b == 0 ? seen : mean;
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_kind_gives_what_gltf_says),
        cmocka_unit_test(few_lamps_are_exact),
        cmocka_unit_test(many_lamps_are_right_in_the_mean),
        cmocka_unit_test(lamps_add_up),
        cmocka_unit_test(power_scales),
        cmocka_unit_test(lamps_behind_a_wall_light_nothing),
        cmocka_unit_test(one_spot_of_many_is_found),
        cmocka_unit_test(threads_change_no_byte),
        cmocka_unit_test(counts_decide),
        cmocka_unit_test(what_they_light_sends_it_on),
        cmocka_unit_test(clusters_keep_to_a_budget),
    };
    return cmocka_run_group_tests(tests, world_open, world_close);
}
