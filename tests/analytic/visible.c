// Indirect light that the scene hides: rays to all VPLs, and to a few of them; imperfect shadow
// maps of all of them.

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "world.h"

#define WIDTH  37
#define HEIGHT 29

static const double down[3] = {0, -1, 0};

// --- asking -----------------------------------------------------------------------------------

struct picture {
    struct bd_image *layers[BD_LAYER_COUNT];
    struct bd_report report;
};

static const struct bd_image *indirect_of(const struct picture *p)
{
    return p->layers[BD_LAYER_INDIRECT];
}

// Those who ask. Blocks are lit by one of their pixels' rays where they are more than that.
struct way {
    const char *technique, *settings;
    bool is_of_blocks, is_of_cuts;
};
static const struct way ways[] = {
    {"rsm", "", false, false},
    {"multires_gather", "coarsest=4", true, false},
    {"multires_gather", "coarsest=4 light_threshold=0.01 finest=2", true, false},
    {"isr", "coarsest=4 cluster_levels=1", true, false},
    {"hisr", "coarsest=4 tau=0.001", true, true},
};
#define WAY_COUNT (sizeof ways / sizeof *ways)

// `settings`: "KEY=VALUE KEY=VALUE", after those of the way.
static struct picture render_by(struct world *w, const struct way *way, const char *settings,
                                uint64_t seed, uint32_t aa)
{
    struct bd_frame_request request = bd_frame_request_default;
    snprintf(request.technique, sizeof request.technique, "%s", way->technique);
    request.aa = aa;
    request.width_px = WIDTH;
    request.height_px = HEIGHT;
    request.layers = 1u << BD_LAYER_INDIRECT;
    request.seed = seed;
    request.fresh = w->fresh;
    char text[200];
    snprintf(text, sizeof text, "shadow_size=64 rsm_size=64 vpls=150 %s %s", way->settings,
             settings);
    for (char *rest = NULL, *word = strtok_r(text, " ", &rest); word;
         word = strtok_r(NULL, " ", &rest))
        assert_int_equal(bd_param_list_add(&request.params, word, NULL), BD_ERR_OK);
    struct picture picture = {0};
    struct bd_err_detail detail = {0};
    if (bd_frame_render(&w->renderer, w->scene, &request, NULL, NULL, picture.layers,
                        &picture.report, &detail))
        fail_msg("%s %s: %s", way->technique, text, detail.message);
    return picture;
}

static struct picture render(struct world *w, const char *settings, uint64_t seed)
{
    return render_by(w, &ways[0], settings, seed, 1);
}

static void finish(struct picture *picture)
{
    world_free_layers(picture->layers);
}

static size_t sample_count(const struct bd_image *image)
{
    return (size_t)image->width_px * image->height_px * image->channel_count;
}

static bool is_same(const struct picture *a, const struct picture *b)
{
    const struct bd_image *x = indirect_of(a), *y = indirect_of(b);
    return memcmp(x->pixels, y->pixels, sample_count(x) * sizeof *x->pixels) == 0;
}

static double relative_rmse(const struct bd_image *image, const struct bd_image *truth)
{
    double error = 0, sum = 0;
    for (size_t i = 0; i < sample_count(truth); i++) {
        const double off = (double)image->pixels[i] - truth->pixels[i];
        error += off * off;
        sum += truth->pixels[i];
    }
    const double n = (double)sample_count(truth);
    return sqrt(error / n) / (sum / n);
}

static double mean_of(const struct bd_image *image)
{
    double sum = 0;
    for (size_t i = 0; i < sample_count(image); i++) sum += image->pixels[i];
    return sum / (double)sample_count(image);
}

static double mean(const struct picture *p)
{
    return mean_of(indirect_of(p));
}

static bool has_run(const struct picture *p, const char *pass)
{
    for (uint32_t i = 0; i < p->report.pass_count; i++)
        if (strcmp(p->report.passes[i].name, pass) == 0)
            return p->report.passes[i].state == BD_PASS_RAN;
    return false;
}

// --- scenes -----------------------------------------------------------------------------------

static void add_camera(struct world *w, const double eye[3], const double target[3], double size)
{
    const int32_t camera = world_add_camera(w, eye, target, 1.2);
    w->scene->cameras[camera].near_m = (float)(1e-3 * size);
}

enum things { THINGS_NONE, THINGS_WALL };

// Moves everything: vertices keep the digits that 32 bits have.
static void move(struct world *w, double at)
{
    for (uint32_t n = 0; n < w->scene->node_count; n++) {
        double *m = w->scene->nodes[n].parent_from_node.m;
        m[12] += at, m[13] -= at, m[14] += at;
    }
}

// A box of half a side `size` with two lights; things that hide are a wall across a part of it.
static void make_box(struct world *w, double size, double at, enum things things, bool glossy)
{
    world_clear(w);
    const int32_t grey = world_add_material(w, 0.5f);
    w->scene->materials[grey].roughness = glossy ? 0.35f : 1;
    w->scene->materials[grey].metallic = glossy ? 0.5f : 0;
    const double centre[3] = {0, 0, 0};
    world_add_box_room(w, grey, centre, size);
    const double wall[4][3] = {{-.7 * size, -size, -.1 * size},
                               {.4 * size, -size, -.1 * size},
                               {.4 * size, .6 * size, -.1 * size},
                               {-.7 * size, .6 * size, -.1 * size}};
    if (things == THINGS_WALL) world_add_quad(w, grey, wall, 3);
    const double lamp[3] = {.3 * size, .5 * size, .2 * size};
    const double spot[3] = {-.1 * size, .2 * size, -.5 * size};
    const double eye[3] = {.8 * size, .4 * size, .9 * size};
    const double target[3] = {-.2 * size, -.1 * size, 0};
    world_add_light(w, BD_LIGHT_POINT, lamp, down, (float)(size * size));
    world_add_light(w, BD_LIGHT_SPOT, spot, down, (float)(size * size));
    add_camera(w, eye, target, size);
    move(w, at);
    world_finish(w);
}

struct place {
    double size, at;
};
static const struct place places[] = {{1, 0}, {1e-4, 0}, {1e6, 0}, {1, 1e7}};

// --- tests ------------------------------------------------------------------------------------

// Lobes beside blocks are summed by another kernel; all leaves of a tree are not its cut.
static bool is_as_good_as_same(const struct way *way, bool glossy, const struct picture *a,
                               const struct picture *b)
{
    if (way->is_of_cuts) return relative_rmse(indirect_of(a), indirect_of(b)) < 5e-3;
    if (!way->is_of_blocks || !glossy) return is_same(a, b);
    return relative_rmse(indirect_of(a), indirect_of(b)) < 1e-6;
}

// Maps take the planes of walls for what they are, however coarse.
static void check_maps_of_box(struct world *w, const struct way *way, size_t place, bool glossy,
                              const struct picture *none)
{
    struct picture maps =
        render_by(w, way, "indirect_visibility=ism rays=1000000 ism_points=500", 0, 1);
    if (!is_as_good_as_same(way, glossy, &maps, none))
        fail_msg("%s, place %zu: maps hide something of a box", way->technique, place);
    assert_true(maps.report.counts.rays == 0 && !maps.report.unoccluded);
    assert_false(has_run(&maps, "bvh"));
    assert_true(has_run(&maps, "shadow_points") && has_run(&maps, "imperfect_shadows"));
    finish(&maps);
}

static void check_box(struct world *w, const struct way *way, size_t place, bool glossy)
{
    make_box(w, places[place].size, places[place].at, THINGS_NONE, glossy);
    struct picture none = render_by(w, way, "indirect_visibility=none", 0, 1);
    struct picture rays = render_by(w, way, "indirect_visibility=rays rays=1000000", 0, 1);
    if (!is_as_good_as_same(way, glossy, &rays, &none))
        fail_msg("%s, place %zu: a box hides something of itself", way->technique, place);
    if (rays.report.counts.rays == 0 || none.report.counts.rays > 0)
        fail_msg("%s, place %zu: %g rays", way->technique, place, (double)rays.report.counts.rays);
    assert_true(none.report.unoccluded && !rays.report.unoccluded);
    assert_true(!has_run(&none, "bvh") && has_run(&rays, "bvh"));
    assert_true(has_run(&rays, "choose") && has_run(&rays, "visibility"));
    assert_false(has_run(&rays, "weigh") || has_run(&rays, "vpl_order"));
    if (!glossy) check_maps_of_box(w, way, place, glossy, &none);
    finish(&none), finish(&rays);
}

// In an empty box everything sees everything: no byte changes, whatever surfaces are made of. Where
// the box lies is nothing to lobes, and how large it is to blocks what it is to pixels.
static void nothing_hides_nothing(void **state)
{
    for (size_t way = 0; way < WAY_COUNT; way++)
        for (size_t place = 0; place < sizeof places / sizeof *places; place++) {
            const bool is_scaled = places[place].size != 1;
            if (is_scaled && ways[way].is_of_blocks && !ways[way].is_of_cuts) continue;
            for (int glossy = 0; glossy < 2 - (place > 0); glossy++)
                check_box(*state, &ways[way], place, glossy);
        }
}

// Nor does a ball, whose VPLs stand off its facets: the mean of a block of texels lies behind them.
static void a_curved_wall_hides_nothing_of_itself(void **state)
{
    struct world *w = *state;
    static const double lamp[3] = {.2, .3, .1}, eye[3] = {.5, .3, .6}, target[3] = {-.2, -.1, 0};
    world_clear(w);
    world_add_sphere_room(w, world_add_material(w, 0.5f), 1, 3);
    world_add_light(w, BD_LIGHT_POINT, lamp, down, 1);
    add_camera(w, eye, target, 1);
    world_finish(w);
    for (size_t i = 0; i < WAY_COUNT; i++) {
        struct picture none = render_by(w, &ways[i], "indirect_visibility=none", 0, 1);
        struct picture rays = render_by(w, &ways[i], "indirect_visibility=rays rays=1000000", 0, 1);
        if (!is_as_good_as_same(&ways[i], false, &rays, &none)) fail_msg("%s", ways[i].technique);
        struct picture maps = render_by(w, &ways[i], "indirect_visibility=ism rays=1000000", 0, 1);
        printf("    %s: maps hide %.3g %%\n", ways[i].technique,
               100 * relative_rmse(indirect_of(&maps), indirect_of(&none)));
        assert_true(relative_rmse(indirect_of(&maps), indirect_of(&none)) < 1e-2);
        finish(&none), finish(&rays), finish(&maps);
    }
}

// Hazard 36: a closed room beside one that is lit.
static void a_closed_room_is_black(void **state)
{
    struct world *w = *state;
    static const char *const settings[] = {"indirect_visibility=rays rays=1000000",
                                           "indirect_visibility=rays rays=8"};
    for (size_t i = 0; i < sizeof places / sizeof *places; i++) {
        const double size = places[i].size, at = places[i].at;
        const double lit[3] = {0, 0, 0}, closed[3] = {2.1 * size, 0, 0};
        const double eye[3] = {1.5 * size, .6 * size, .7 * size};
        world_clear(w);
        const int32_t grey = world_add_material(w, 0.7f);
        world_add_box_room(w, grey, lit, size);
        world_add_box_room(w, grey, closed, size);
        world_add_light(w, BD_LIGHT_POINT, lit, down, (float)(size * size));
        add_camera(w, eye, closed, size);
        move(w, at);
        world_finish(w);
        struct picture none = render(w, "indirect_visibility=none", 0);
        if (!(mean(&none) > 0)) fail_msg("place %zu: nothing leaks", i);
        finish(&none);
        for (size_t s = 0; s < 2 * WAY_COUNT; s++) {
            const struct way *way = &ways[s / 2];
            struct picture rays = render_by(w, way, settings[s % 2], 0, 1);
            if (mean(&rays) != 0)
                fail_msg("%s, place %zu, %s: %g", way->technique, i, settings[s % 2], mean(&rays));
            finish(&rays);
        }
    }
}

// A picture that shows nothing: no block of it asks.
static void a_view_past_everything_is_black(void **state)
{
    struct world *w = *state;
    static const char *const settings[] = {"indirect_visibility=rays rays=1000000 executor=native",
                                           "indirect_visibility=rays rays=1000000 executor=device"};
    static const double eye[3] = {0, 0, 9}, past[3] = {0, 0, 20}, lamp[3] = {.2, .3, .1};
    const double middle[3] = {0, 0, 0};
    world_clear(w);
    world_add_box_room(w, world_add_material(w, 0.7f), middle, 1);
    world_add_light(w, BD_LIGHT_POINT, lamp, down, 1);
    add_camera(w, eye, past, 1);
    world_finish(w);
    for (size_t i = 0; i < 2 * WAY_COUNT; i++) {
        struct picture rays = render_by(w, &ways[i / 2], settings[i % 2], 0, 1);
        if (mean(&rays) != 0) fail_msg("%s, %s", ways[i / 2].technique, settings[i % 2]);
        finish(&rays);
    }
}

#define SEEDS 40
#define FEW   "indirect_visibility=rays rays=6 noise_filter=off"

// Mean over pictures of as many seeds.
struct mean {
    struct bd_image *image;
    double one_off; // relative RMSE of a picture, on average
};

static struct mean mean_of_seeds(struct world *w, const struct way *way, const struct picture *all)
{
    struct mean mean = {.image = bd_image_create(WIDTH, HEIGHT, 3)};
    const size_t samples = sample_count(mean.image);
    memset(mean.image->pixels, 0, samples * sizeof *mean.image->pixels);
    for (uint64_t seed = 0; seed < SEEDS; seed++) {
        struct picture few = render_by(w, way, FEW, seed, 1);
        assert_true(has_run(&few, "weigh") && has_run(&few, "choose"));
        assert_int_equal(has_run(&few, "vpl_order"), seed == 0 && !way->is_of_cuts);
        assert_true(few.report.counts.rays <= 12 * WIDTH * HEIGHT);
        mean.one_off += relative_rmse(indirect_of(&few), indirect_of(all)) / SEEDS;
        for (size_t i = 0; i < samples; i++)
            mean.image->pixels[i] += indirect_of(&few)->pixels[i] / SEEDS;
        finish(&few);
    }
    return mean;
}

static void check_mean(struct world *w, const struct way *way, bool glossy)
{
    make_box(w, 1, 0, THINGS_WALL, glossy);
    struct picture all = render_by(w, way, "indirect_visibility=rays rays=1000000", 0, 1);
    struct mean found = mean_of_seeds(w, way, &all);
    const double one = found.one_off, many = relative_rmse(found.image, indirect_of(&all));
    printf("    %s %s, %s: 6 rays %.3g %%, mean of %d %.3g %%\n", way->technique, way->settings,
           glossy ? "glossy" : "rough", 100 * one, SEEDS, 100 * many);
    assert_true(one > 0.01 && one < 0.5 && many < one / 4);
    // Interpolation holds light between its neighbours, which is not linear.
    ASSERT_REL(mean_of(found.image), mean(&all), way->is_of_blocks ? 4e-3 : 2e-3);
    bd_image_destroy(&found.image);
    finish(&all);
}

// The mean over pictures of many seeds, pixel by pixel, is the picture of all rays. Blocks that
// light decides on are others for each seed: those are left out.
static void few_rays_are_right_in_the_mean(void **state)
{
    static const struct way of_blocks = {"multires_gather", "coarsest=4 light_threshold=inf", true,
                                         false};
    static const struct way of_cuts = {"hisr", "coarsest=4 light_threshold=inf tau=0.001", true,
                                       true};
    static const struct way of_clusters = {"isr", "coarsest=4 light_threshold=inf cluster_levels=1",
                                           true, false};
    for (int glossy = 0; glossy < 2; glossy++) {
        check_mean(*state, &ways[0], glossy);
        check_mean(*state, &of_blocks, glossy);
    }
    check_mean(*state, &of_clusters, false);
    check_mean(*state, &of_cuts, false);
}

// A node that stands for many leaves is seen as far as those are that give most: 9.2 %, which is
// what so few nodes are off by themselves; 12.2 with the first leaf of each.
static void a_node_is_seen_by_its_leaves(void **state)
{
    static const struct way coarse = {"hisr", "coarsest=4 vpls=1024 tau=1 tree_roots=1", true,
                                      true};
    struct world *w = *state;
    make_box(w, 1, 0, THINGS_WALL, false);
    struct picture all = render_by(w, &coarse, "indirect_visibility=rays rays=1000000", 0, 1);
    struct mean found = mean_of_seeds(w, &coarse, &all);
    const double off = relative_rmse(found.image, indirect_of(&all));
    printf("    mean of %d: %.3g %% off\n", SEEDS, 100 * off);
    assert_true(off < 0.105);
    bd_image_destroy(&found.image);
    finish(&all);
}

// What few rays leave is smoothed, and the mean stays where it was.
static void noise_is_filtered(void **state)
{
    struct world *w = *state;
    make_box(w, 1, 0, THINGS_WALL, false);
    for (size_t i = 0; i < WAY_COUNT; i++) {
        struct picture all = render_by(w, &ways[i], "indirect_visibility=rays rays=1000000", 0, 1);
        struct picture raw = render_by(w, &ways[i], FEW, 0, 1);
        struct picture smooth = render_by(w, &ways[i], "indirect_visibility=rays rays=6", 0, 1);
        const double before = relative_rmse(indirect_of(&raw), indirect_of(&all));
        const double after = relative_rmse(indirect_of(&smooth), indirect_of(&all));
        printf("    %s %s: %.3g %% raw, %.3g filtered\n", ways[i].technique, ways[i].settings,
               100 * before, 100 * after);
        assert_true(!has_run(&raw, "filter") && has_run(&smooth, "filter"));
        assert_true(after < 0.75 * before);
        ASSERT_REL(mean(&smooth), mean(&raw), 1e-2);
        finish(&all), finish(&raw), finish(&smooth);
    }
}

// Nearly all of them, chosen in several dispatches.
static void many_rays_are_nearly_all(void **state)
{
    struct world *w = *state;
    make_box(w, 1, 0, THINGS_WALL, false);
    struct picture all = render(w, "vpls=3000 indirect_visibility=rays rays=1000000", 0);
    struct picture many =
        render(w, "vpls=3000 indirect_visibility=rays rays=5800 noise_filter=off", 0);
    assert_true(has_run(&many, "weigh"));
    const double off = relative_rmse(indirect_of(&many), indirect_of(&all));
    if (off > 2e-3) fail_msg("%g %%", 100 * off);
    finish(&all), finish(&many);
}

// As many as a device takes at once, more than the cut has nodes: of blocks, in several dispatches.
static void many_rays_of_a_cut_are_nearly_all(void **state)
{
    static const struct way cut = {"hisr", "coarsest=1 finest=8 vpls=16384 tau=0.001", true, true};
    struct world *w = *state;
    make_box(w, 1, 0, THINGS_WALL, false);
    struct picture all = render_by(w, &cut, "indirect_visibility=rays rays=1000000", 0, 1);
    struct picture many =
        render_by(w, &cut, "indirect_visibility=rays rays=16000 noise_filter=off", 0, 1);
    const double off = relative_rmse(indirect_of(&many), indirect_of(&all));
    printf("    %.3g %%\n", 100 * off);
    if (!(off < 1e-2)) fail_msg("%g %%", 100 * off);
    finish(&all), finish(&many);
}

static void a_wall_hides_light(void **state)
{
    struct world *w = *state;
    make_box(w, 1, 0, THINGS_WALL, false);
    struct picture none = render(w, "indirect_visibility=none", 0);
    struct picture all = render(w, "indirect_visibility=rays rays=1000000", 0);
    assert_true(mean(&all) < 0.97 * mean(&none));
    for (size_t i = 0; i < sample_count(indirect_of(&all)); i++)
        assert_true(indirect_of(&all)->pixels[i] <= indirect_of(&none)->pixels[i]);
    finish(&none), finish(&all);
}

static bool is_flagged(const struct picture *p, const char *flag)
{
    for (uint32_t f = 0; f < p->report.flag_count; f++)
        if (strncmp(p->report.flags[f], flag, strlen(flag)) == 0) return true;
    return false;
}

// With a map for each virtual light, and with one for several.
static void maps_hide_nearly_what_rays_do(void **state)
{
    struct world *w = *state;
    static const char *const vpls[] = {"vpls=150", "vpls=16384 vpl_budget=32768"};
    make_box(w, 1, 0, THINGS_WALL, false);
    for (size_t i = 0; i < WAY_COUNT; i++)
        for (int many = 0; many < (ways[i].is_of_blocks && !ways[i].is_of_cuts ? 1 : 2); many++) {
            char rays[200], maps[200], none[200];
            snprintf(rays, sizeof rays, "%s indirect_visibility=rays rays=64 noise_filter=off",
                     vpls[many]);
            snprintf(maps, sizeof maps, "%s indirect_visibility=ism rays=64 noise_filter=off",
                     vpls[many]);
            snprintf(none, sizeof none, "%s indirect_visibility=none", vpls[many]);
            struct picture asked = render_by(w, &ways[i], rays, 0, 1);
            struct picture seen = render_by(w, &ways[i], maps, 0, 1);
            struct picture open = render_by(w, &ways[i], none, 0, 1);
            const double off = relative_rmse(indirect_of(&seen), indirect_of(&asked));
            const double before = relative_rmse(indirect_of(&open), indirect_of(&asked));
            printf("    %s %s: %.3g %% off, %.3g without\n", ways[i].technique, vpls[many],
                   100 * off, 100 * before);
            assert_true(off < 0.05 && off < before / 3);
            assert_int_equal(is_flagged(&seen, "ism_shared"), many);
            finish(&asked), finish(&seen), finish(&open);
        }
}

static void check_bytes(struct world *w, const struct way *way, const char *settings, bool all)
{
    make_box(w, 1, 0, THINGS_WALL, !all);
    struct picture first = render_by(w, way, settings, 7, 1);
    struct picture again = render_by(w, way, settings, 7, 1);
    assert_false(has_run(&again, "gather") || has_run(&again, "bvh"));
    w->fresh = BD_FRESH_ALL;
    w->renderer.slicer.forced_units = 70000;
    struct picture sliced = render_by(w, way, settings, 7, 1);
    w->renderer.slicer.forced_units = 0;
    struct picture other = render_by(w, way, settings, 8, 1);
    w->fresh = BD_FRESH_NONE;
    if (!is_same(&first, &again) || !is_same(&first, &sliced))
        fail_msg("%s %s, %s", way->technique, way->settings, settings);
    assert_int_equal(is_same(&first, &other), all); // a seed means nothing to all of them
    finish(&first), finish(&again), finish(&sliced), finish(&other);
}

// Cold and from the memo, at once and in slices of next to nothing.
static void the_same_bytes_twice(void **state)
{
    for (size_t i = 0; i < WAY_COUNT; i++) {
        check_bytes(*state, &ways[i], "indirect_visibility=rays rays=1000000", true);
        check_bytes(*state, &ways[i], "indirect_visibility=rays rays=5", false);
        check_bytes(*state, &ways[i], "indirect_visibility=ism rays=1000000 ism_size=16", true);
    }
}

// Later sub-frames take the first one's light over: what it saw nothing of asks for itself.
static void sub_frames_share_what_was_asked(void **state)
{
    struct world *w = *state;
    static const char all[] = "indirect_visibility=rays rays=1000000 sub_frames=own";
    for (size_t i = 0; i < WAY_COUNT; i++) {
        make_box(w, 1, 0, THINGS_WALL, false);
        struct picture own = render_by(w, &ways[i], all, 0, 4);
        struct picture shared = render_by(w, &ways[i], "indirect_visibility=rays rays=60", 0, 4);
        struct picture first = render_by(w, &ways[i], "indirect_visibility=rays rays=60", 0, 1);
        const double off = relative_rmse(indirect_of(&shared), indirect_of(&own));
        const double rays = (double)shared.report.counts.rays / (double)first.report.counts.rays;
        printf("    %s %s: %.3g %% off, %.3g times the rays of one\n", ways[i].technique,
               ways[i].settings, 100 * off, rays);
        assert_true(has_run(&shared, "share") && !has_run(&own, "share"));
        assert_true(rays > 1 && rays < 2.5 && off < 0.06);
        finish(&own), finish(&shared), finish(&first);
    }
}

// A ray is asked in every direction of a hemisphere: the structure follows what is moved.
static void the_structure_is_kept_by_what_it_is_made_from(void **state)
{
    struct world *w = *state;
    make_box(w, 1, 0, THINGS_WALL, false);
    struct picture first = render(w, "indirect_visibility=rays rays=5", 0);
    struct picture other = render(w, "indirect_visibility=rays rays=5 vpls=60", 0);
    assert_true(has_run(&first, "bvh") && !has_run(&other, "bvh") && has_run(&other, "gather"));
    finish(&first), finish(&other);
}

// They differ at edges alone.
static void the_device_is_asked_in_the_processors_place(void **state)
{
    struct world *w = *state;
    static const char *const settings[] = {"indirect_visibility=rays rays=1000000",
                                           "indirect_visibility=rays rays=5",
                                           "indirect_visibility=rays rays=5 indirect_bounces=4"};
    for (int s = 0; s < 3; s++) {
        make_box(w, 1, 0, THINGS_WALL, s == 1);
        struct picture processor = render(w, settings[s], 7);
        w->fresh = BD_FRESH_ALL;
        w->renderer.rays_on = BD_RAYS_DEVICE;
        struct picture device = render(w, settings[s], 7);
        w->renderer.slicer.forced_units = 70000;
        struct picture sliced = render(w, settings[s], 7);
        w->renderer.slicer.forced_units = 0;
        w->renderer.rays_on = BD_RAYS_AUTO;
        w->fresh = BD_FRESH_NONE;
        assert_true(has_run(&device, "bvh") && has_run(&device, "visibility"));
        assert_true(is_same(&device, &sliced));
        const double off = relative_rmse(indirect_of(&device), indirect_of(&processor));
        if (off > 1e-3) fail_msg("%s: %g %%", settings[s], 100 * off);
        assert_int_equal(device.report.counts.rays, processor.report.counts.rays);
        assert_true(device.report.counts.mrays_per_s > 0);
        finish(&processor), finish(&device), finish(&sliced);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nothing_hides_nothing),
        cmocka_unit_test(a_curved_wall_hides_nothing_of_itself),
        cmocka_unit_test(a_closed_room_is_black),
        cmocka_unit_test(a_view_past_everything_is_black),
        cmocka_unit_test(a_wall_hides_light),
        cmocka_unit_test(maps_hide_nearly_what_rays_do),
        cmocka_unit_test(few_rays_are_right_in_the_mean),
        cmocka_unit_test(a_node_is_seen_by_its_leaves),
        cmocka_unit_test(noise_is_filtered),
        cmocka_unit_test(many_rays_are_nearly_all),
        cmocka_unit_test(many_rays_of_a_cut_are_nearly_all),
        cmocka_unit_test(the_same_bytes_twice),
        cmocka_unit_test(sub_frames_share_what_was_asked),
        cmocka_unit_test(the_device_is_asked_in_the_processors_place),
        cmocka_unit_test(the_structure_is_kept_by_what_it_is_made_from),
    };
    return cmocka_run_group_tests(tests, world_open, world_close);
}
