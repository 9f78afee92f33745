// Indirect light of blocks of pixels: where it lies, how near it comes to that of pixels, when it
// is chosen, and that a frame with it is the same whatever was rendered before.

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include <math.h>

#include "frame/plan.h"
#include "world.h"

#define WIDTH  61 // odd, as a window may be
#define HEIGHT 47

static const double origin[3] = {0, 0, 0}, down[3] = {0, -1, 0};

// A box with a wall that stands free.
static void make_room(struct world *w, bool glossy)
{
    const double wall[4][3] = {{-.6, -1, -.2}, {.3, -1, -.2}, {.3, .4, -.2}, {-.6, .4, -.2}};
    const double lamp[3] = {.3, .5, .2}, eye[3] = {.7, .4, .9}, target[3] = {-.2, -.1, 0};
    world_clear(w);
    const int32_t grey = world_add_material(w, 0.5f), metal = world_add_material(w, 0.7f);
    w->scene->materials[metal].roughness = glossy ? 0.3f : 1;
    w->scene->materials[metal].metallic = glossy;
    world_add_box_room(w, grey, origin, 1);
    world_add_quad(w, metal, wall, 3);
    world_add_light(w, BD_LIGHT_POINT, lamp, down, 1);
    world_add_camera(w, eye, target, 1.0);
    world_finish(w);
}

static struct bd_frame_request request_of(uint32_t width_px, uint32_t height_px, uint32_t aa,
                                          const char *settings)
{
    struct bd_frame_request request = bd_frame_request_default;
    char words[200], *rest = words;
    snprintf(request.technique, sizeof request.technique, "many_light");
    request.width_px = width_px;
    request.height_px = height_px;
    request.layers |= 1u << BD_LAYER_INDIRECT | BD_LAYERS_DOUBT;
    request.aa = aa;
    snprintf(words, sizeof words, "%s", settings);
    for (char *word; (word = strsep(&rest, " ")) != NULL;)
        assert_int_equal(bd_param_list_add(&request.params, word, NULL), BD_ERR_OK);
    return request;
}

static double light_at(const struct bd_image *image, uint32_t x, uint32_t y)
{
    const float *p = image->pixels + 3 * ((size_t)y * image->width_px + x);
    return p[0] + p[1] + p[2];
}

struct difference {
    double rmse, sum;         // parts of the mean
    double right_px, down_px; // by how far the one is the other moved, where light is smooth
};

static struct difference difference_of(const struct bd_image *seen, const struct bd_image *truth)
{
    double square = 0, off_sum = 0, mean = 0, x_off = 0, x_x = 0, y_off = 0, y_y = 0;
    const double count = (double)truth->width_px * truth->height_px;
    for (uint32_t y = 0; y < truth->height_px; y++)
        for (uint32_t x = 0; x < truth->width_px; x++) mean += light_at(truth, x, y) / count;
    for (uint32_t y = 1; y + 1 < truth->height_px; y++)
        for (uint32_t x = 1; x + 1 < truth->width_px; x++) {
            const double off = light_at(seen, x, y) - light_at(truth, x, y);
            const double slope_x = (light_at(truth, x + 1, y) - light_at(truth, x - 1, y)) / 2;
            const double slope_y = (light_at(truth, x, y + 1) - light_at(truth, x, y - 1)) / 2;
            square += off * off / count;
            off_sum += off / count;
            if (fabs(slope_x) + fabs(slope_y) > .1 * mean) continue; // edges
            x_off -= off * slope_x;
            x_x += slope_x * slope_x;
            y_off -= off * slope_y;
            y_y += slope_y * slope_y;
        }
    return (struct difference){sqrt(square) / mean, off_sum / mean, x_off / x_x, y_off / y_y};
}

#define MANY "rays=64 far_rays=64 vpls=2048 walk_vpls=2048 cache_cells=2048"

static void blocks_lie_where_their_pixels_do(void **state)
{
    struct world *w = *state;
    for (int glossy = 0; glossy < 2; glossy++) {
        make_room(w, glossy);
        const struct bd_frame_request of_pixels =
            request_of(WIDTH, HEIGHT, 1, MANY " light_blocks=1");
        struct world_picture pixels = world_picture_of(w, &of_pixels);
        assert_int_equal(world_times_run(&pixels.report, "share"), 0);
        for (uint32_t side_px = 2; side_px <= 4; side_px *= 2) {
            char settings[120];
            snprintf(settings, sizeof settings, "%s light_blocks=%u", MANY, side_px);
            const struct bd_frame_request of_blocks = request_of(WIDTH, HEIGHT, 1, settings);
            struct world_picture blocks = world_picture_of(w, &of_blocks);
            const struct difference d =
                difference_of(blocks.layers[BD_LAYER_INDIRECT], pixels.layers[BD_LAYER_INDIRECT]);
            printf("    %s, %u: %.3g %% off, sum %+.3g %%, moved %+.3f, %+.3f, %llu of %u by "
                   "themselves\n",
                   glossy ? "glossy" : "rough", side_px, 100 * d.rmse, 100 * d.sum, d.right_px,
                   d.down_px, (unsigned long long)blocks.report.counts.fragments, WIDTH * HEIGHT);
            assert_true(d.rmse < .04 * side_px && fabs(d.sum) < .01 * side_px);
            assert_true(fabs(d.right_px) < .12 * side_px && fabs(d.down_px) < .12 * side_px);
            assert_int_equal(world_times_run(&blocks.report, "share"), 1);
            assert_in_range(blocks.report.counts.fragments, 1, WIDTH * HEIGHT / 2);
            assert_true(blocks.report.own_estimate < 2 * pixels.report.own_estimate &&
                        blocks.report.own_estimate > .5 * pixels.report.own_estimate);
            world_picture_free(&blocks);
        }
        world_picture_free(&pixels);
    }
}

static uint32_t block_px(struct world *w, uint32_t width_px, uint32_t height_px, uint32_t aa,
                         const char *settings)
{
    const struct bd_frame_request request = request_of(width_px, height_px, aa, settings);
    struct bd_err_detail detail = {0};
    struct bd_report report;
    struct bd_plan plan;
    assert_int_equal(bd_plan_make(w->scene, &request, &plan, &report, &detail), BD_ERR_OK);
    assert_int_equal(plan.shared, aa > 1 || plan.block_px > 1);
    return plan.block_px;
}

static void they_are_chosen_by_counts(void **state)
{
    struct world *w = *state;
    make_room(w, false);
    assert_int_equal(block_px(w, 256, 192, 1, "rays=4"), 1);
    assert_int_equal(block_px(w, 512, 383, 1, "rays=4"), 1);
    assert_int_equal(block_px(w, 512, 384, 1, "rays=4"), 2);
    assert_int_equal(block_px(w, 512, 384, 1, "rays=8"), 2);
    assert_int_equal(block_px(w, 512, 384, 1, "rays=9"), 1);
    assert_int_equal(block_px(w, 512, 384, 2, "rays=4"), 1);
    assert_int_equal(block_px(w, 512, 384, 1, "rays=4 light_blocks=1"), 1);
    assert_int_equal(block_px(w, 64, 48, 2, "rays=64 light_blocks=4"), 4);
}

// Sub-frames of a frame with blocks, added up before or not, and others' pictures in between.
static void a_frame_has_no_history(void **state)
{
    struct world *w = *state;
    make_room(w, true);
    struct bd_frame_request three = request_of(WIDTH, HEIGHT, 3, "light_blocks=2");
    three.fresh = BD_FRESH_ALL;
    struct world_picture alone = world_picture_of(w, &three);
    make_room(w, true); // of which the memo has nothing
    three.fresh = BD_FRESH_NONE;
    for (uint32_t aa = 1; aa < 3; aa++) {
        struct bd_frame_request fewer = request_of(WIDTH, HEIGHT, aa, "light_blocks=2");
        struct bd_frame_request of_pixels = request_of(WIDTH, HEIGHT, aa, "light_blocks=1");
        struct world_picture a = world_picture_of(w, &fewer), b = world_picture_of(w, &of_pixels);
        world_picture_free(&a), world_picture_free(&b);
    }
    three.seed = 1;
    struct world_picture other = world_picture_of(w, &three);
    three.seed = 0;
    struct world_picture added = world_picture_of(w, &three), again = world_picture_of(w, &three);
    world_assert_same(&alone, &added);
    world_assert_same(&alone, &again);
    assert_int_equal(alone.report.counts.fragments, added.report.counts.fragments);
    assert_int_equal(world_times_run(&added.report, "direct"), 1);
    world_picture_free(&alone), world_picture_free(&added), world_picture_free(&again),
        world_picture_free(&other);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(blocks_lie_where_their_pixels_do),
        cmocka_unit_test(they_are_chosen_by_counts),
        cmocka_unit_test(a_frame_has_no_history),
    };
    return cmocka_run_group_tests(tests, world_open, world_close);
}
