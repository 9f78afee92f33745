// What a frame says of its own error: layer `noise` against how pictures of other seeds differ, the
// estimate in the report against both, and nothing where nothing is decided by chance.

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "tests/analytic/world.h"
#include "tests/unit/cmocka_all.h"

#define SIDE_PX 32u
#define SEEDS   12u
#define FLOATS  (3 * SIDE_PX * SIDE_PX)

static const double origin[3] = {0, 0, 0}, down[3] = {0, -1, 0};

// A lamp as wide as half the ceiling, a spot of light, a block.
static void make_room(struct world *w, bool has_emitter)
{
    const double block[4][3] = {{-.3, -1, .2}, {.2, -1, .4}, {.2, 0, .4}, {-.3, 0, .2}};
    const double lamp[4][3] = {{-.5, .99, -.5}, {.5, .99, -.5}, {.5, .99, .5}, {-.5, .99, .5}};
    const double spot[3] = {.3, .5, .2}, eye[3] = {.7, .4, .9}, target[3] = {-.2, -.3, 0};
    world_clear(w);
    world_add_box_room(w, world_add_material(w, 0.6f), origin, 1);
    world_add_quad(w, world_add_material(w, 0.5f), block, 1);
    if (has_emitter) {
        const int32_t glowing = world_add_material(w, 0);
        for (int c = 0; c < 3; c++) w->scene->materials[glowing].emissive[c] = 2;
        world_add_quad(w, glowing, lamp, 1);
    } else {
        world_add_light(w, BD_LIGHT_POINT, spot, down, 1);
    }
    world_add_camera(w, eye, target, 1.2);
    world_finish(w);
}

static void render(struct world *w, const char *technique, uint64_t seed, uint32_t aa,
                   const char *settings, struct bd_image *layers[BD_LAYER_COUNT])
{
    struct bd_frame_request request = bd_frame_request_default;
    struct bd_err_detail detail = {0};
    snprintf(request.technique, sizeof request.technique, "%s", technique);
    request.width_px = request.height_px = SIDE_PX;
    request.layers |= BD_LAYERS_DOUBT;
    request.seed = seed;
    request.aa = aa;
    if (settings) assert_int_equal(bd_param_list_add(&request.params, settings, NULL), BD_ERR_OK);
    memset(layers, 0, BD_LAYER_COUNT * sizeof *layers);
    if (bd_frame_render(&w->renderer, w->scene, &request, NULL, NULL, layers, &w->report, &detail))
        fail_msg("%s", detail.message);
}

static double beauty_at(const struct bd_image *beauty, uint32_t i)
{
    return beauty->pixels[4 * (i / 3) + i % 3];
}

// The mean over all places of the variance that seeds have, and of the squares that each seed's
// layer `noise` has; the mean of the light, and of what the reports said.
struct doubt {
    double variance, noise2, light, own_estimate, blur;
};

static struct doubt doubt_of(struct world *w, const char *technique, uint32_t aa,
                             const char *settings)
{
    static double sum[FLOATS], squares[FLOATS];
    struct doubt doubt = {0};
    memset(sum, 0, sizeof sum);
    memset(squares, 0, sizeof squares);
    for (uint32_t seed = 0; seed < SEEDS; seed++) {
        struct bd_image *layers[BD_LAYER_COUNT];
        render(w, technique, seed, aa, settings, layers);
        assert_true(w->report.has_own_estimate);
        doubt.own_estimate += w->report.own_estimate / SEEDS;
        for (uint32_t i = 0; i < FLOATS; i++) {
            const double light = beauty_at(layers[BD_LAYER_BEAUTY], i);
            const double noise = layers[BD_LAYER_NOISE]->pixels[i];
            sum[i] += light;
            squares[i] += light * light;
            doubt.noise2 += noise * noise / (SEEDS * FLOATS);
            doubt.blur += layers[BD_LAYER_BLUR]->pixels[i / 3] / (SEEDS * FLOATS);
        }
        world_free_layers(layers);
    }
    for (uint32_t i = 0; i < FLOATS; i++) {
        doubt.light += sum[i] / (SEEDS * FLOATS);
        doubt.variance += (squares[i] - sum[i] * sum[i] / SEEDS) / ((SEEDS - 1) * FLOATS);
    }
    return doubt;
}

static void noise_is_how_seeds_differ(void **state)
{
    struct world *w = *state;
    static const struct {
        const char *technique;
        uint32_t aa;
        bool has_emitter;
        double most; // that both may be apart
    } cases[] = {
        {"direct", 1, true, .03},
        {"many_light", 1, true, .03},
        {"many_light", 1, false, .06}, // photons are the same for both halves
        {"many_light", 8, false, .25}, // pixels that lie by themselves say the first one's
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        make_room(w, cases[i].has_emitter);
        const struct doubt doubt = doubt_of(w, cases[i].technique, cases[i].aa, "noise_filter=off");
        ASSERT_REL(sqrt(doubt.noise2), sqrt(doubt.variance), cases[i].most);
        ASSERT_REL(doubt.own_estimate, sqrt(doubt.noise2) / doubt.light, .02);
        assert_true(doubt.blur == 0);
    }
}

// Most of the noise goes, a tenth of its variance is taken for blur: what is said lies between.
static void the_filter_leaves_less(void **state)
{
    struct world *w = *state;
    make_room(w, true);
    const struct doubt raw = doubt_of(w, "many_light", 1, "noise_filter=off");
    const struct doubt smooth = doubt_of(w, "many_light", 1, "noise_filter=on");
    assert_true(smooth.noise2 < .25 * raw.noise2);
    ASSERT_REL(smooth.blur, .1 * (raw.noise2 - smooth.noise2), .1);
    ASSERT_REL(smooth.own_estimate, sqrt(smooth.noise2 + smooth.blur) / smooth.light, .02);
    assert_true(smooth.own_estimate < .6 * raw.own_estimate);
}

// What was smoothed and is taken over from the first sub-frame is as noisy as that one's.
static void sub_frames_that_share_doubt_alike(void **state)
{
    struct world *w = *state;
    struct bd_frame_request request = bd_frame_request_default;
    struct bd_image *layers[BD_LAYER_COUNT] = {0};
    struct bd_report report;
    struct bd_err_detail detail = {0};
    double estimate[2];
    make_room(w, false);
    snprintf(request.technique, sizeof request.technique, "many_light");
    request.width_px = request.height_px = SIDE_PX;
    for (int i = 0; i < 2; i++) {
        request.aa = i ? 4 : 1;
        assert_int_equal(
            bd_frame_render(&w->renderer, w->scene, &request, NULL, NULL, layers, &report, &detail),
            BD_ERR_OK);
        assert_null(layers[BD_LAYER_NOISE]); // nobody asked for it
        assert_true(report.has_own_estimate);
        estimate[i] = report.own_estimate;
        world_free_layers(layers);
    }
    ASSERT_REL(estimate[1], estimate[0], .1);
}

static void without_chance_there_is_no_doubt(void **state)
{
    struct world *w = *state;
    static const char *const techniques[] = {"direct", "rsm", "multires_gather"};
    struct bd_image *layers[BD_LAYER_COUNT];
    make_room(w, false);
    for (int i = 0; i < 3; i++) {
        render(w, techniques[i], 0, 1, NULL, layers);
        assert_false(w->report.has_own_estimate);
        for (uint32_t k = 0; k < FLOATS; k++)
            assert_true(layers[BD_LAYER_NOISE]->pixels[k] == 0 &&
                        layers[BD_LAYER_BLUR]->pixels[k / 3] == 0);
        world_free_layers(layers);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(noise_is_how_seeds_differ),
        cmocka_unit_test(the_filter_leaves_less),
        cmocka_unit_test(sub_frames_that_share_doubt_alike),
        cmocka_unit_test(without_chance_there_is_no_doubt),
    };
    return cmocka_run_group_tests(tests, world_open, world_close);
}
