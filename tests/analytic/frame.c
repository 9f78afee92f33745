// What every frame owes, whatever the technique: the same bytes twice, layers that add up, no
// more passes than needed, and no change of digits under scale, offset and light power (hazards
// 3, 7, 8, 9, 13, 26, 27 of algorithms.md).

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

#define WIDTH  61 // odd on purpose
#define HEIGHT 47

static const uint32_t all_layers = (1u << BD_LAYER_RENDERED_COUNT) - 1;
static const double origin[3] = {0, 0, 0};
static const char *const few_vpls[] = {"vpls=96", "rsm_size=64", "shadow_size=128", NULL};
static const char *const walking[] = {"vpls=96", "rsm_size=64", "shadow_size=128",
                                      "indirect_bounces=3", NULL};
static const char *const few_blocks[] = {"vpls=96",     "rsm_size=64",         "shadow_size=128",
                                         "coarsest=16", "light_threshold=inf", NULL};

// A room with a block in it, a spot, a point and a directional light, seen from a corner; scaled
// and moved as a whole, with light that keeps the picture's radiance.
static void make_room(struct world *w, double scale, const double at[3], double power)
{
    world_clear(w);
    int32_t grey = world_add_material(w, 0.5f), dark = world_add_material(w, 0.2f);
    world_add_box_room(w, grey, origin, scale);
    const double block[4][3] = {{-.3 * scale, -.4 * scale, .2 * scale},
                                {.3 * scale, -.4 * scale, .2 * scale},
                                {.3 * scale, -.4 * scale, -.4 * scale},
                                {-.3 * scale, -.4 * scale, -.4 * scale}};
    world_add_quad(w, dark, block, 3);
    const double lamp[3] = {.5 * scale, .7 * scale, -.3 * scale}, aim[3] = {-.6, -1, .2};
    const double bulb[3] = {-.6 * scale, .1 * scale, .5 * scale}, sun[3] = {.3, -1, .1};
    float area = (float)(scale * scale * power);
    world_add_light(w, BD_LIGHT_SPOT, lamp, aim, 3 * area);
    world_add_light(w, BD_LIGHT_POINT, bulb, aim, 0.5f * area);
    world_add_light(w, BD_LIGHT_DIRECTIONAL, origin, sun, (float)(0.25 * power));
    const double eye[3] = {.8 * scale, .6 * scale, .9 * scale};
    const double other[3] = {-.8 * scale, .5 * scale, .7 * scale};
    world_add_camera(w, eye, origin, 1.2);
    world_add_camera(w, other, origin, 1.2);
    for (uint32_t i = 0; i < w->scene->node_count; i++)
        for (int a = 0; a < 3; a++) w->scene->nodes[i].parent_from_node.m[12 + a] += at[a];
    for (uint32_t i = 0; i < w->scene->camera_count; i++)
        w->scene->cameras[i].near_m = (float)(1e-3 * scale);
}

static bool same_pixels(const struct bd_image *a, const struct bd_image *b)
{
    size_t count = (size_t)a->width_px * a->height_px * a->channel_count;
    return memcmp(a->pixels, b->pixels, count * sizeof(float)) == 0;
}

// A second device and renderer: nothing can come from the first one's memo.
static void same_bytes_on_a_fresh_device(void **state)
{
    struct bd_image *first[BD_LAYER_COUNT], *second[BD_LAYER_COUNT];
    make_room(*state, 1, origin, 1);
    world_render(*state, "rsm", 0, WIDTH, HEIGHT, all_layers, few_vpls, first);
    world_reopen_device(*state);
    make_room(*state, 1, origin, 1);
    world_render(*state, "rsm", 0, WIDTH, HEIGHT, all_layers, few_vpls, second);
    for (int l = 0; l < BD_LAYER_RENDERED_COUNT; l++) assert_true(same_pixels(first[l], second[l]));
    world_free_layers(first);
    world_free_layers(second);
}

static void layers_add_up_to_beauty(void **state)
{
    struct bd_image *l[BD_LAYER_COUNT];
    make_room(*state, 1, origin, 1);
    ((struct world *)*state)->scene->materials[1].emissive[0] = 0.7f;
    world_render(*state, "rsm", 0, WIDTH, HEIGHT, all_layers, few_vpls, l);
    double most_indirect = 0, most_emission = 0;
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        for (int c = 0; c < 3; c++) {
            double indirect = l[BD_LAYER_INDIRECT]->pixels[3 * i + c];
            double emission = l[BD_LAYER_EMISSION]->pixels[3 * i + c];
            double sum = l[BD_LAYER_DIRECT]->pixels[3 * i + c] + indirect + emission;
            double beauty = l[BD_LAYER_BEAUTY]->pixels[4 * i + c];
            assert_true(fabs(sum - beauty) <= 1e-5 * beauty);
            most_indirect = fmax(most_indirect, indirect);
            most_emission = fmax(most_emission, emission);
        }
        assert_true(l[BD_LAYER_BEAUTY]->pixels[4 * i + 3] == 1);
    }
    assert_true(most_indirect > 0.01 && fabs(most_emission - 0.7) < 1e-3);
    world_free_layers(l);
}

static enum bd_pass_state state_of(const struct bd_report *report, const char *pass)
{
    for (uint32_t p = 0; p < report->pass_count; p++)
        if (strcmp(report->passes[p].name, pass) == 0) return report->passes[p].state;
    fail_msg("pass %s is not in the report", pass);
    return BD_PASS_PLANNED;
}

static void another_camera_reuses_the_light_side(void **state)
{
    struct world *w = *state;
    struct bd_image *l[BD_LAYER_COUNT];
    make_room(w, 1, origin, 1);
    world_render(w, "rsm", 0, WIDTH, HEIGHT, 1, few_vpls, l);
    world_free_layers(l);
    assert_int_equal(state_of(&w->report, "vpl_grid"), BD_PASS_RAN);
    world_render(w, "rsm", 1, WIDTH, HEIGHT, 1, few_vpls, l);
    world_free_layers(l);
    const char *const light_side[] = {"shadow_map", "rsm", "vpl_grid"};
    for (int i = 0; i < 3; i++)
        assert_int_equal(state_of(&w->report, light_side[i]), BD_PASS_REUSED);
    assert_int_equal(state_of(&w->report, "gbuffer"), BD_PASS_RAN);
    assert_int_equal(state_of(&w->report, "gather"), BD_PASS_RAN);
    assert_true(w->report.time_ms.compile == 0 && w->report.time_ms.load == 0);
}

static struct bd_gpu_scene *uploaded(struct world *w)
{
    struct bd_gpu_scene *scene;
    struct bd_err_detail detail = {0};
    bd_slicer_init(&w->renderer.slicer, w->gpu, NULL, NULL);
    if (bd_gpu_scene_create(&w->renderer.uploader, w->scene, &scene, &detail))
        fail_msg("%s", detail.message);
    return scene;
}

// As an edit leaves a scene: the list of triangles is the other one's, and outlives it.
static void another_colour_uploads_no_triangles(void **state)
{
    struct world *w = *state;
    struct bd_uploader *uploader = &w->renderer.uploader;
    make_room(w, 1, origin, 1);
    world_finish(w);
    struct bd_scene *was = bd_scene_retain(w->scene);
    const struct bd_gpu_triangles *before = uploader->triangles;
    struct bd_gpu_scene *first = uploaded(w);
    const uint64_t alone_bytes = bd_gpu_scene_own_bytes(first);
    make_room(w, 1, origin, 1);
    world_finish(w);
    w->scene->aspects = was->aspects;
    w->scene->aspects.counter[BD_ASPECT_COLOUR]++;
    struct bd_gpu_scene *coloured = uploaded(w);
    assert_ptr_equal(coloured->triangles, first->triangles);
    assert_int_equal(bd_gpu_scene_own_bytes(coloured) + bd_buf_size_bytes(first->triangles),
                     alone_bytes);
    w->scene->aspects.counter[BD_ASPECT_TRANSFORMS]++;
    struct bd_gpu_scene *moved = uploaded(w);
    assert_ptr_not_equal(moved->triangles, first->triangles);
    bd_gpu_scene_destroy(uploader, &first);
    assert_true(bd_buf_size_bytes(coloured->triangles) >= 48 * coloured->order.triangle_count);
    bd_gpu_scene_destroy(uploader, &moved);
    bd_gpu_scene_destroy(uploader, &coloured);
    assert_ptr_equal(uploader->triangles, before);
    bd_scene_release(&was);
}

// What is asked to be made anew is, with the same pixels; the rest is still taken over.
static void fresh_frames_take_nothing_over(void **state)
{
    static const char *const light_side[] = {"shadow_map", "rsm", "vpl_grid"};
    static const char *const camera_side[] = {"gbuffer", "direct", "gather"};
    struct world *w = *state;
    make_room(w, 1, origin, 1);
    struct bd_image *first[BD_LAYER_COUNT], *again[BD_LAYER_COUNT];
    world_render(w, "rsm", 0, WIDTH, HEIGHT, all_layers, few_vpls, first);
    for (int fresh = BD_FRESH_NONE; fresh <= BD_FRESH_ALL; fresh++) {
        w->fresh = (enum bd_fresh)fresh;
        world_render(w, "rsm", 0, WIDTH, HEIGHT, all_layers, few_vpls, again);
        for (size_t i = 0; i < 3; i++) {
            assert_int_equal(state_of(&w->report, light_side[i]),
                             fresh == BD_FRESH_ALL ? BD_PASS_RAN : BD_PASS_REUSED);
            assert_int_equal(state_of(&w->report, camera_side[i]),
                             fresh == BD_FRESH_NONE ? BD_PASS_REUSED : BD_PASS_RAN);
        }
        for (int l = 0; l < BD_LAYER_RENDERED_COUNT; l++)
            assert_true(same_pixels(first[l], again[l]));
        world_free_layers(again);
    }
    w->fresh = BD_FRESH_NONE;
    world_free_layers(first);
}

// A snapshot after an edit of one light's power: new lights, the same everything else.
static void a_brighter_light_keeps_its_maps(void **state)
{
    struct world *w = *state;
    struct bd_image *l[BD_LAYER_COUNT];
    make_room(w, 1, origin, 1);
    world_render(w, "rsm", 0, WIDTH, HEIGHT, 1, few_vpls, l);
    float before = bd_image_at(l[0], WIDTH / 4, HEIGHT / 3)[0];
    world_free_layers(l);
    // A factor that leaves the frame's light unit, a power of two, as it is: the power alone
    // counts.
    for (uint32_t i = 0; i < w->scene->light_count; i++) w->scene->lights[i].intensity *= 1.25f;
    world_render(w, "rsm", 0, WIDTH, HEIGHT, 1, few_vpls, l);
    float after = bd_image_at(l[0], WIDTH / 4, HEIGHT / 3)[0];
    world_free_layers(l);
    assert_int_equal(state_of(&w->report, "shadow_map"), BD_PASS_REUSED);
    assert_int_equal(state_of(&w->report, "rsm"), BD_PASS_REUSED);
    assert_int_equal(state_of(&w->report, "vpl_grid"), BD_PASS_RAN);
    assert_int_equal(state_of(&w->report, "direct"), BD_PASS_RAN);
    ASSERT_REL(after, 1.25 * before, 1e-5);
}

static void harden_spots(struct world *w)
{
    for (uint32_t i = 0; i < w->scene->light_count; i++) {
        struct bd_light *light = &w->scene->lights[i];
        if (light->kind == BD_LIGHT_SPOT) light->cone_inner = 0.9f * light->cone_outer;
    }
}

// The weights of a map's texels are kept for all maps of a light: until its shape changes, of which
// here nothing but the inner cone does.
static void texel_weights_follow_the_cone(void **state)
{
    struct bd_image *kept[BD_LAYER_COUNT], *anew[BD_LAYER_COUNT], *soft[BD_LAYER_COUNT];
    make_room(*state, 1, origin, 1);
    world_render(*state, "rsm", 0, WIDTH, HEIGHT, all_layers, few_vpls, soft);
    harden_spots(*state);
    world_render(*state, "rsm", 0, WIDTH, HEIGHT, all_layers, few_vpls, kept);
    world_reopen_device(*state);
    make_room(*state, 1, origin, 1);
    harden_spots(*state);
    world_render(*state, "rsm", 0, WIDTH, HEIGHT, all_layers, few_vpls, anew);
    for (int l = 0; l < BD_LAYER_RENDERED_COUNT; l++) assert_true(same_pixels(kept[l], anew[l]));
    assert_false(same_pixels(soft[BD_LAYER_INDIRECT], kept[BD_LAYER_INDIRECT]));
    world_free_layers(soft);
    world_free_layers(kept);
    world_free_layers(anew);
}

// Light that is sent on more than once is of the lamps' shape and power; once, it is of their maps.
static void light_that_walks_follows_its_lamps(void **state)
{
    struct world *w = *state;
    struct bd_image *kept[BD_LAYER_COUNT], *anew[BD_LAYER_COUNT], *once[BD_LAYER_COUNT];
    for (int edit = 0; edit < 3; edit++) {
        make_room(w, 1, origin, 1);
        world_render(w, "rsm", 0, WIDTH, HEIGHT, all_layers, few_vpls, once);
        for (uint32_t p = 0; p < w->report.pass_count; p++)
            assert_string_not_equal(w->report.passes[p].name, "light_paths");
        world_free_layers(once);
        world_render(w, "rsm", 0, WIDTH, HEIGHT, all_layers, walking, once);
        if (edit == 1) harden_spots(w);
        for (uint32_t i = 0; edit == 2 && i < w->scene->light_count; i++)
            w->scene->lights[i].intensity *= 1.25f;
        world_render(w, "rsm", 0, WIDTH, HEIGHT, all_layers, walking, kept);
        assert_int_equal(state_of(&w->report, "light_paths"), edit ? BD_PASS_RAN : BD_PASS_REUSED);
        w->fresh = BD_FRESH_ALL;
        world_render(w, "rsm", 0, WIDTH, HEIGHT, all_layers, walking, anew);
        w->fresh = BD_FRESH_NONE;
        for (int l = 0; l < BD_LAYER_RENDERED_COUNT; l++)
            assert_true(same_pixels(kept[l], anew[l]));
        assert_true(same_pixels(once[BD_LAYER_INDIRECT], kept[BD_LAYER_INDIRECT]) == (edit == 0));
        world_free_layers(once);
        world_free_layers(kept);
        world_free_layers(anew);
    }
}

// Where the picture jumps is the camera's affair alone.
static void a_moved_light_keeps_the_fragments(void **state)
{
    static const char *const kept[] = {"gbuffer", "discontinuity", "fragments"};
    static const char *const made[] = {"direct", "gather", "upsample"};
    static const char *const other[] = {"vpls=96",     "rsm_size=64",    "shadow_size=128",
                                        "coarsest=16", "depth_test=off", "light_threshold=inf",
                                        NULL};
    const char *const *settings = few_blocks;
    struct world *w = *state;
    struct bd_image *l[BD_LAYER_COUNT];
    make_room(w, 1, origin, 1);
    world_render(w, "multires_gather", 0, WIDTH, HEIGHT, 1, settings, l);
    world_free_layers(l);
    uint64_t fragments = w->report.counts.fragments;
    assert_true(fragments > 100 && fragments < WIDTH * HEIGHT);
    for (uint32_t i = 0; i < w->scene->placed_light_count; i++)
        w->scene->placed_lights[i].position.x += 0.01;
    world_render(w, "multires_gather", 0, WIDTH, HEIGHT, 1, settings, l);
    world_free_layers(l);
    assert_int_equal(w->report.counts.fragments, fragments);
    for (int i = 0; i < 3; i++) {
        assert_int_equal(state_of(&w->report, kept[i]), BD_PASS_REUSED);
        assert_int_equal(state_of(&w->report, made[i]), BD_PASS_RAN);
    }
    world_render(w, "multires_gather", 0, WIDTH, HEIGHT, 1, other, l);
    world_free_layers(l);
    assert_int_equal(state_of(&w->report, "gbuffer"), BD_PASS_REUSED);
    assert_int_equal(state_of(&w->report, "discontinuity"), BD_PASS_RAN);
    assert_true(w->report.counts.fragments < fragments);
}

// Clusters and trees are the light's affair: another camera takes them over, another power does
// not.
static void another_camera_keeps_clusters_and_trees(void **state)
{
    static const char *const techniques[] = {"isr", "hisr"};
    static const char *const made[] = {"vpl_clusters", "vpl_tree"};
    struct world *w = *state;
    struct bd_image *l[BD_LAYER_COUNT];
    for (int t = 0; t < 2; t++) {
        make_room(w, 1, origin, 1);
        world_render(w, techniques[t], 0, WIDTH, HEIGHT, 1, few_vpls, l);
        world_free_layers(l);
        const uint64_t vpls = w->report.counts.vpls;
        assert_int_equal(state_of(&w->report, made[t]), BD_PASS_RAN);
        assert_true(vpls >= 96);
        w->scene->placed_cameras[0].position.x += 0.01;
        world_render(w, techniques[t], 0, WIDTH, HEIGHT, 1, few_vpls, l);
        world_free_layers(l);
        assert_int_equal(state_of(&w->report, made[t]), BD_PASS_REUSED);
        assert_int_equal(state_of(&w->report, "gather"), BD_PASS_RAN);
        assert_int_equal(w->report.counts.vpls, vpls);
        w->scene->lights[0].intensity *= 1.5f;
        world_render(w, techniques[t], 0, WIDTH, HEIGHT, 1, few_vpls, l);
        world_free_layers(l);
        assert_int_equal(state_of(&w->report, made[t]), BD_PASS_RAN);
        assert_int_equal(state_of(&w->report, "gbuffer"), BD_PASS_REUSED);
    }
}

static bool is_omitted(const struct bd_report *report, const char *pass, const char *reason)
{
    for (uint32_t i = 0; i < report->omitted_count; i++)
        if (strcmp(report->omitted[i].pass, pass) == 0 &&
            strcmp(report->omitted[i].reason, reason) == 0)
            return true;
    return false;
}

static void pyramids_that_nobody_asks_are_left_out(void **state)
{
    struct world *w = *state;
    struct bd_image *l[BD_LAYER_COUNT];
    const char *const settings[] = {"vpls=24", "depth_test=off", "normal_threshold=inf", NULL};
    make_room(w, 1, origin, 1);
    world_render(w, "multires_gather", 0, WIDTH, HEIGHT, 1, settings, l);
    world_free_layers(l);
    assert_true(is_omitted(&w->report, "discontinuity", "depth pyramid: depth_test=off"));
    assert_true(is_omitted(&w->report, "discontinuity", "normal pyramid: normal_threshold=inf"));
    world_render(w, "multires_gather", 0, WIDTH, HEIGHT, 1, few_blocks, l);
    world_free_layers(l);
    for (uint32_t i = 0; i < w->report.omitted_count; i++)
        assert_string_not_equal(w->report.omitted[i].pass, "discontinuity");
}

// One level: every pixel is a fragment.
static void without_blocks_it_is_the_full_gather(void **state)
{
    struct world *w = *state;
    struct bd_image *full[BD_LAYER_COUNT], *seen[BD_LAYER_COUNT];
    const char *const settings[] = {"vpls=96", "rsm_size=64", "shadow_size=128", "coarsest=61",
                                    NULL};
    make_room(w, 1, origin, 1);
    world_render(w, "rsm", 0, WIDTH, HEIGHT, all_layers, few_vpls, full);
    world_render(w, "multires_gather", 0, WIDTH, HEIGHT, all_layers, settings, seen);
    assert_int_equal(w->report.counts.fragments, WIDTH * HEIGHT);
    for (int i = 0; i < BD_LAYER_RENDERED_COUNT; i++) assert_true(same_pixels(full[i], seen[i]));
    world_free_layers(full);
    world_free_layers(seen);
}

static double rms_difference(const struct bd_image *a, const struct bd_image *b)
{
    double sum = 0;
    size_t count = (size_t)a->width_px * a->height_px * a->channel_count;
    for (size_t i = 0; i < count; i++)
        sum += pow((double)a->pixels[i] - (double)b->pixels[i], 2) / (double)count;
    return sqrt(sum);
}

// Blocks of 8 pixels that are split only where light changes too much over them. `more`: three
// settings.
static void assert_split_by_light(struct world *w, const char *technique,
                                  const char *const *more)
{
    struct bd_image *full[BD_LAYER_COUNT], *whole[BD_LAYER_COUNT], *parts[BD_LAYER_COUNT];
    const char *const settings[] = {"vpls=96",     "rsm_size=64", "shadow_size=128",
                                    "coarsest=16", "finest=8",    "light_threshold=inf",
                                    more[0],       more[1],       more[2],
                                    NULL};
    // Every pixel is a fragment.
    const char *const finest[] = {"vpls=96",     "rsm_size=64", "shadow_size=128",
                                  "coarsest=64", more[2],       NULL};
    const char *split[10];
    memcpy(split, settings, sizeof split);
    split[5] = "light_threshold=0.05";
    make_room(w, 1, origin, 1);
    world_render(w, technique, 0, WIDTH, HEIGHT, 1, finest, full);
    assert_true(w->report.counts.fragments > WIDTH * HEIGHT * 9 / 10);
    world_render(w, technique, 0, WIDTH, HEIGHT, 1, settings, whole);
    const uint64_t few = w->report.counts.fragments;
    assert_true(is_omitted(&w->report, "gather", "blocks split by light: light_threshold=inf"));
    world_render(w, technique, 0, WIDTH, HEIGHT, 1, split, parts);
    const uint64_t many = w->report.counts.fragments;
    double of_whole = rms_difference(full[0], whole[0]),
           of_parts = rms_difference(full[0], parts[0]);
    print_message("    %s: fragments %u, RMS %.3g; %u, %.3g\n", technique, (unsigned)few, of_whole,
                  (unsigned)many, of_parts);
    assert_true(many > few && many < WIDTH * HEIGHT);
    assert_true(of_parts < of_whole / 3);
    assert_false(is_omitted(&w->report, "gather", "blocks split by light: light_threshold=inf"));
    world_free_layers(full);
    world_free_layers(whole);
    world_free_layers(parts);
}

static void blocks_split_by_light_are_near_the_full_gather(void **state)
{
    const char *const minmax[] = {"depth_test=minmax", "depth_threshold=0.05", "visit=list"};
    const char *const steps[] = {"depth_test=step", "depth_threshold=0.01", "visit=list"};
    const char *const all_leaves[] = {"depth_test=step", "depth_threshold=0.01", "tau=0"};
    assert_split_by_light(*state, "multires_gather", minmax);
    assert_split_by_light(*state, "multires_gather", steps);
    assert_split_by_light(*state, "hisr", all_leaves);
}

// Largest difference of two pictures over the mean of the first, after a factor.
static double difference(struct world *w, const struct bd_image *expected, double factor,
                         const char *const *settings)
{
    struct bd_image *l[BD_LAYER_COUNT];
    world_render(w, "rsm", 0, WIDTH, HEIGHT, 1, settings, l);
    double worst = 0, mean = 0;
    for (int i = 0; i < 4 * WIDTH * HEIGHT; i++) {
        if (i % 4 == 3) continue;
        worst = fmax(worst, fabs(l[0]->pixels[i] * factor - expected->pixels[i]));
        mean += expected->pixels[i] / (3 * WIDTH * HEIGHT);
    }
    world_free_layers(l);
    return worst / mean;
}

static void scale_and_power_change_no_digit(void **state)
{
    struct bd_image *base[BD_LAYER_COUNT];
    make_room(*state, 1, origin, 1);
    world_render(*state, "rsm", 0, WIDTH, HEIGHT, 1, walking, base);
    const int scales[] = {-13, -5, 7, 20};
    for (int i = 0; i < 4; i++) {
        make_room(*state, ldexp(1, scales[i]), origin, 1);
        assert_true(difference(*state, base[0], 1, walking) == 0);
    }
    const int powers[] = {-30, -8, 12, 30};
    for (int i = 0; i < 4; i++) {
        make_room(*state, 1, origin, ldexp(1, powers[i]));
        assert_true(difference(*state, base[0], ldexp(1, -powers[i]), walking) == 0);
    }
    world_free_layers(base);
}

static void offset_changes_next_to_nothing(void **state)
{
    struct bd_image *base[BD_LAYER_COUNT];
    make_room(*state, 1, origin, 1);
    world_render(*state, "rsm", 0, WIDTH, HEIGHT, 1, few_vpls, base);
    const double far[3] = {2e7, -1e7, 3e7};
    make_room(*state, 1, far, 1);
    double worst = difference(*state, base[0], 1, few_vpls);
    print_message("    moved by 1e7 sizes: %.2e of the mean\n", worst);
    assert_true(worst <= 1e-4);
    world_free_layers(base);
}

// Tilted, so that normals and positions are rounded; finely enough seen and lit for receivers to
// come within a thousandth of their distance of each other to a VPL.
static void a_flat_floor_lights_itself_by_nothing(void **state)
{
    struct world *w = *state;
    world_clear(w);
    int32_t grey = world_add_material(w, 0.8f);
    const double floor[4][3] = {{-1.3, .1, 1}, {1, .7, 1.1}, {1.2, .5, -1}, {-1.1, -.1, -1.1}};
    const double lamp[3] = {.3, 1.2, .1}, aim[3] = {-.1, -1, 0}, eye[3] = {.4, 1.6, 1};
    double flat[4][3];
    memcpy(flat, floor, sizeof flat);
    for (int a = 0; a < 3; a++) flat[3][a] = flat[0][a] + flat[2][a] - flat[1][a]; // one plane
    world_add_quad(w, grey, (const double(*)[3])flat, 1);
    world_add_light(w, BD_LIGHT_SPOT, lamp, aim, 2);
    world_add_camera(w, eye, origin, 1.0);
    const char *settings[] = {"vpls=4096", NULL};
    struct bd_image *l[BD_LAYER_COUNT];
    world_render(w, "rsm", 0, 256, 256, 1u << BD_LAYER_INDIRECT, settings, l);
    for (int i = 0; i < 3 * 256 * 256; i++) assert_true(l[BD_LAYER_INDIRECT]->pixels[i] == 0);
    world_free_layers(l);
}

static bool has_flag(const struct bd_report *report, const char *flag)
{
    for (uint32_t f = 0; f < report->flag_count; f++)
        if (strcmp(report->flags[f], flag) == 0) return true;
    return false;
}

static void nothing_at_all_is_a_blank_frame(void **state)
{
    struct world *w = *state;
    struct bd_image *l[BD_LAYER_COUNT];
    world_clear(w);
    world_add_material(w, 0.5f);
    world_render(w, "rsm", 0, 1, 1, all_layers, few_vpls, l);
    assert_true(has_flag(&w->report, "blank_frame"));
    assert_true(l[BD_LAYER_BEAUTY]->pixels[3] == 0);
    assert_true(l[BD_LAYER_DEPTH]->pixels[0] == 1e10f);
    assert_int_equal(w->report.nonfinite_pixels, 0);
    world_free_layers(l);
}

static void black_surfaces_stay_black(void **state)
{
    struct world *w = *state;
    struct bd_image *l[BD_LAYER_COUNT];
    make_room(w, 1, origin, 1);
    for (uint32_t m = 0; m < w->scene->material_count; m++)
        memset(w->scene->materials[m].base_color, 0, 3 * sizeof(float));
    const char *settings[] = {"vpls=96", "brdf=lambert", NULL};
    world_render(w, "rsm", 0, WIDTH, HEIGHT, 1, settings, l);
    for (int i = 0; i < WIDTH * HEIGHT; i++)
        for (int c = 0; c < 3; c++) assert_true(l[0]->pixels[4 * i + c] == 0);
    world_free_layers(l);
}

static double units_per_ms(const struct world *w, const char *kind)
{
    const struct bd_slicer *slicer = &w->renderer.slicer;
    for (uint32_t i = 0; i < slicer->kind_count; i++)
        if (strcmp(slicer->kinds[i].name, kind) == 0) return slicer->kinds[i].units_per_ms;
    return 0;
}

// One pixel keeps one lane busy: what it takes says nothing about who does it.
static void tiny_pictures_do_not_teach_the_slicer(void **state)
{
    static const char *const kinds[] = {"gather", "native gather"};
    static const char *const executors[] = {"executor=device", "executor=native"};
    struct world *w = *state;
    struct bd_image *l[BD_LAYER_COUNT];
    make_room(w, 1, origin, 1);
    for (int e = 0; e < 2; e++) {
        const char *few[] = {"vpls=96", "brdf=lambert", executors[e], NULL};
        const char *many[] = {"vpls=24576", "brdf=lambert", executors[e], NULL};
        world_render(w, "rsm", 0, 256, 256, 1, few, l);
        world_free_layers(l);
        double known = units_per_ms(w, kinds[e]);
        assert_true(known > 0);
        for (uint32_t i = 0; i < 6; i++) {
            world_render(w, "rsm", i % 2, 1, 1 + i, 1, many, l);
            world_free_layers(l);
        }
        assert_true(units_per_ms(w, kinds[e]) >= 0.5 * known);
    }
}

static void a_plan_renders_nothing(void **state)
{
    struct world *w = *state;
    make_room(w, 1, origin, 1);
    world_finish(w);
    struct bd_frame_request request = bd_frame_request_default;
    request.plan_only = true;
    struct bd_image *layers[BD_LAYER_COUNT] = {0};
    struct bd_err_detail detail = {0};
    assert_int_equal(
        bd_frame_render(&w->renderer, w->scene, &request, NULL, NULL, layers, &w->report, &detail),
        BD_ERR_OK);
    assert_null(layers[0]);
    assert_int_equal(state_of(&w->report, "gather"), BD_PASS_PLANNED);
    bool no_textures = false;
    for (uint32_t o = 0; o < w->report.omitted_count; o++)
        if (strstr(w->report.omitted[o].reason, "texture code")) no_textures = true;
    assert_true(no_textures);
}

static void one_name_for_two_cameras_is_flagged(void **state)
{
    struct world *w = *state;
    make_room(w, 1, origin, 1);
    struct bd_camera *cameras = w->scene->cameras;
    snprintf(cameras[0].name, sizeof cameras[0].name, "eye");
    snprintf(cameras[1].name, sizeof cameras[1].name, "eye");
    world_finish(w);
    static const struct {
        const char *camera;
        int32_t found;
        bool flagged;
    } cases[] = {{"eye", 0, true}, {"", 0, false}, {"1", 1, false}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct bd_frame_request request = bd_frame_request_default;
        struct bd_plan plan;
        struct bd_err_detail detail = {0};
        snprintf(request.camera, sizeof request.camera, "%s", cases[i].camera);
        assert_int_equal(bd_plan_make(w->scene, &request, &plan, &w->report, &detail), BD_ERR_OK);
        assert_int_equal(plan.camera, cases[i].found);
        assert_true(cases[i].flagged == has_flag(&w->report, "camera_ambiguous: the first of 2 of "
                                                             "that name; name it by index"));
    }
}

static void bad_requests_name_the_field(void **state)
{
    struct world *w = *state;
    make_room(w, 1, origin, 1);
    world_finish(w);
    struct bd_image *layers[BD_LAYER_COUNT];
    const struct {
        const char *technique, *setting, *camera, *field;
    } cases[] = {{"radiosity", NULL, "", "technique"},
                 {"rsm", "vpls=0", "", "vpls"},
                 {"rsm", "vpls=1.5", "", "vpls"},
                 {"rsm", "vpls=nan", "", "vpls"},
                 {"rsm", "brdf=phong", "", "brdf"},
                 {"rsm", "colour=red", "", "colour"},
                 {"direct", "vpls=256", "", "vpls"},
                 {"rsm", NULL, "nowhere", "camera"},
                 {"rsm", "near_field=-1", "", "near_field"},
                 {"rsm", NULL, "2", "camera"}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct bd_frame_request request = bd_frame_request_default;
        struct bd_err_detail detail = {0};
        snprintf(request.technique, sizeof request.technique, "%s", cases[i].technique);
        snprintf(request.camera, sizeof request.camera, "%s", cases[i].camera);
        if (cases[i].setting)
            assert_int_equal(bd_param_list_add(&request.params, cases[i].setting, &detail), 0);
        assert_int_equal(bd_frame_render(&w->renderer, w->scene, &request, NULL, NULL, layers,
                                         &w->report, &detail),
                         BD_ERR_USAGE);
        assert_string_equal(detail.field, cases[i].field);
    }
}

// --- many triangles ----------------------------------------------------------------------------

#define WAVE_CELLS                                                                                 \
    200u // a side, two triangles each: more than make a software device's sieve worth it

static void wave_at(uint32_t column, uint32_t row, float position[3], float normal[3])
{
    const double x = -1 + 2.0 * column / WAVE_CELLS, z = -1 + 2.0 * row / WAVE_CELLS;
    const double slope[2] = {.4 * cos(8 * x) * cos(5 * z), -.25 * sin(8 * x) * sin(5 * z)};
    const double length = sqrt(1 + slope[0] * slope[0] + slope[1] * slope[1]);
    const double p[3] = {x, .05 * sin(8 * x) * cos(5 * z), z};
    const double n[3] = {-slope[0] / length, 1 / length, -slope[1] / length};
    for (int a = 0; a < 3; a++) position[a] = (float)p[a], normal[a] = (float)n[a];
}

static void add_wave_rows(struct world *w, int32_t material, uint32_t first_row, uint32_t row_count)
{
    const uint32_t side = WAVE_CELLS + 1, vertex_count = side * (row_count + 1);
    const uint32_t cell_count = WAVE_CELLS * row_count;
    float *positions = malloc(vertex_count * 3 * sizeof *positions);
    float *normals = malloc(vertex_count * 3 * sizeof *normals);
    uint32_t *indices = malloc(cell_count * 6 * sizeof *indices);
    assert_true(positions && normals && indices);
    for (uint32_t i = 0; i < vertex_count; i++)
        wave_at(i % side, first_row + i / side, positions + (size_t)3 * i, normals + (size_t)3 * i);
    for (uint32_t c = 0; c < cell_count; c++) {
        uint32_t a = c / WAVE_CELLS * side + c % WAVE_CELLS, b = a + side;
        const uint32_t cell[6] = {a, b, a + 1, a + 1, b, b + 1};
        memcpy(indices + (size_t)6 * c, cell, sizeof cell);
    }
    world_add_mesh(w, material, positions, normals, vertex_count, indices, 6 * cell_count);
    free(positions), free(normals), free(indices);
}

// Seen as a whole, in part, and from so near that triangles lie on both sides of the camera.
static void make_waves(struct world *w, uint32_t rows_a_mesh)
{
    world_clear(w);
    int32_t grey = world_add_material(w, 0.6f);
    for (uint32_t row = 0; row < WAVE_CELLS; row += rows_a_mesh)
        add_wave_rows(w, grey, row, rows_a_mesh);
    const double bulb[3] = {.1, .12, .05}, lamp[3] = {-.6, .6, .3}, aim[3] = {.4, -1, .2};
    world_add_light(w, BD_LIGHT_POINT, bulb, aim, 0.3f);
    world_add_light(w, BD_LIGHT_SPOT, lamp, aim, 2);
    world_add_light(w, BD_LIGHT_DIRECTIONAL, origin, aim, 0.5f);
    const double eyes[3][3] = {{0, 1.6, 2.2}, {.5, .3, .8}, {.2, .06, -.3}};
    const double targets[3][3] = {{0, 0, 0}, {1, 0, .2}, {-1, 0, .6}};
    for (int c = 0; c < 3; c++) world_add_camera(w, eyes[c], targets[c], 0.9);
    for (uint32_t c = 0; c < w->scene->camera_count; c++) w->scene->cameras[c].near_m = 1e-3f;
}

// One mesh, of which each view draws the chunks that it sees, and those of their triangles that may
// cover a sample, or rows of it by themselves, which are drawn whole: the same bytes.
static void a_large_mesh_and_its_rows_look_alike(void **state)
{
    struct world *w = *state;
    static const char *const settings[] = {"vpls=96", "rsm_size=64", "shadow_size=128", NULL};
    struct bd_image *whole[3][BD_LAYER_COUNT], *rows[BD_LAYER_COUNT];
    make_waves(w, WAVE_CELLS);
    for (uint32_t c = 0; c < 3; c++)
        world_render(w, "rsm", c, WIDTH, HEIGHT, all_layers, settings, whole[c]);
    make_waves(w, 1);
    for (uint32_t c = 0; c < 3; c++) {
        world_render(w, "rsm", c, WIDTH, HEIGHT, all_layers, settings, rows);
        for (int l = 0; l < BD_LAYER_RENDERED_COUNT; l++)
            assert_true(same_pixels(whole[c][l], rows[l]));
        world_free_layers(rows);
        world_free_layers(whole[c]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(same_bytes_on_a_fresh_device),
        cmocka_unit_test(layers_add_up_to_beauty),
        cmocka_unit_test(another_camera_reuses_the_light_side),
        cmocka_unit_test(another_colour_uploads_no_triangles),
        cmocka_unit_test(fresh_frames_take_nothing_over),
        cmocka_unit_test(a_brighter_light_keeps_its_maps),
        cmocka_unit_test(texel_weights_follow_the_cone),
        cmocka_unit_test(light_that_walks_follows_its_lamps),
        cmocka_unit_test(a_moved_light_keeps_the_fragments),
        cmocka_unit_test(another_camera_keeps_clusters_and_trees),
        cmocka_unit_test(pyramids_that_nobody_asks_are_left_out),
        cmocka_unit_test(without_blocks_it_is_the_full_gather),
        cmocka_unit_test(blocks_split_by_light_are_near_the_full_gather),
        cmocka_unit_test(scale_and_power_change_no_digit),
        cmocka_unit_test(offset_changes_next_to_nothing),
        cmocka_unit_test(a_flat_floor_lights_itself_by_nothing),
        cmocka_unit_test(nothing_at_all_is_a_blank_frame),
        cmocka_unit_test(black_surfaces_stay_black),
        cmocka_unit_test(tiny_pictures_do_not_teach_the_slicer),
        cmocka_unit_test(a_plan_renders_nothing),
        cmocka_unit_test(one_name_for_two_cameras_is_flagged),
        cmocka_unit_test(bad_requests_name_the_field),
        cmocka_unit_test(a_large_mesh_and_its_rows_look_alike),
    };
    return cmocka_run_group_tests(tests, world_open, world_close);
}
