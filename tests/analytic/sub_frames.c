// Sub-frames of an antialiased frame: where they look, what they share, what that costs in error,
// and that a frame of so many is the same whether earlier frames added some of them up or it is
// asked for alone.

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include <math.h>

#include "frame/plan.h"
#include "frame/sub_frames.h"
#include "technique/technique.h"
#include "world.h"

#define WIDTH  61
#define HEIGHT 47

static const double origin[3] = {0, 0, 0}, down[3] = {0, -1, 0};

enum room { ROOM_ROUGH, ROOM_GLOSSY };

// A box with a wall that stands free and rods as thin as a pixel, before one light of a face and
// one of six.
static void make_room(struct world *w, enum room room)
{
    world_clear(w);
    int32_t grey = world_add_material(w, 0.5f), metal = world_add_material(w, 0.7f);
    w->scene->materials[metal].roughness = room == ROOM_GLOSSY ? 0.3f : 1;
    w->scene->materials[metal].metallic = room == ROOM_GLOSSY;
    world_add_box_room(w, grey, origin, 1);
    const double wall[4][3] = {{-.6, -1, -.2}, {.3, -1, -.2}, {.3, .4, -.2}, {-.6, .4, -.2}};
    world_add_quad(w, metal, wall, 3);
    for (int i = 0; i < 6; i++) {
        const double x = -.5 + .17 * i, thick = .008;
        const double rod[4][3] = {
            {x, -1, .3}, {x + thick, -1, .3}, {x + thick, .8, .3}, {x, .8, .3}};
        world_add_quad(w, grey, rod, 1);
    }
    const double lamp[3] = {.3, .5, .2}, eye[3] = {.7, .4, .9}, target[3] = {-.2, -.1, 0};
    world_add_light(w, BD_LIGHT_POINT, lamp, down, 1);
    world_add_light(w, BD_LIGHT_SPOT, origin, down, 1);
    world_add_camera(w, eye, target, 1.0);
    world_finish(w);
}

static struct bd_frame_request request_of(const struct bd_technique *technique, uint32_t aa)
{
    const char *const settings[] = {"shadow_size=64", "rsm_size=32", "vpls=192", "points=1024",
                                    "photons=4096"};
    struct bd_frame_request request = bd_frame_request_default;
    snprintf(request.technique, sizeof request.technique, "%s", technique->name);
    request.width_px = WIDTH;
    request.height_px = HEIGHT;
    request.layers = (1u << BD_LAYER_RENDERED_COUNT) - 1;
    request.aa = aa;
    const enum bd_param params[] = {BD_PARAM_SHADOW_SIZE, BD_PARAM_RSM_SIZE, BD_PARAM_VPLS,
                                    BD_PARAM_POINTS, BD_PARAM_PHOTONS};
    for (size_t i = 0; i < sizeof params / sizeof *params; i++)
        if (technique->params_read & BD_READS(params[i]))
            assert_int_equal(bd_param_list_add(&request.params, settings[i], NULL), BD_ERR_OK);
    return request;
}

struct picture {
    struct bd_image *layers[BD_LAYER_COUNT];
    struct bd_report report;
};

static struct picture render(struct world *w, const struct bd_frame_request *request)
{
    struct picture picture = {0};
    struct bd_err_detail detail = {0};
    enum bd_err err = bd_frame_render(&w->renderer, w->scene, request, NULL, NULL, picture.layers,
                                      &picture.report, &detail);
    if (err) fail_msg("%s: %s", request->technique, detail.message);
    return picture;
}

static void finish(struct picture *picture)
{
    world_free_layers(picture->layers);
}

static bool same_layer(const struct bd_image *a, const struct bd_image *b)
{
    size_t size = sizeof(float) * a->width_px * a->height_px * a->channel_count;
    return memcmp(a->pixels, b->pixels, size) == 0;
}

static void assert_same(const struct picture *a, const struct picture *b, const char *what)
{
    for (uint32_t l = 0; l < BD_LAYER_RENDERED_COUNT; l++)
        if (!same_layer(a->layers[l], b->layers[l]))
            fail_msg("%s: layer %s differs", what, bd_layer_name((enum bd_layer)l));
    // Times aside.
    assert_memory_equal(
        &a->report.counts, &b->report.counts,
        (size_t)((const char *)&a->report.counts.mrays_per_s - (const char *)&a->report.counts));
}

static double relative_rmse(const struct bd_image *image, const struct bd_image *truth)
{
    double error = 0, power = 0;
    size_t count = (size_t)truth->width_px * truth->height_px * truth->channel_count;
    for (size_t i = 0; i < count; i++) {
        double off = (double)image->pixels[i] - truth->pixels[i];
        error += off * off;
        power += (double)truth->pixels[i] * truth->pixels[i];
    }
    return sqrt(error / power);
}

static uint32_t sub_frames_of(const struct bd_report *report, const char *pass)
{
    for (uint32_t i = 0; i < report->pass_count; i++)
        if (strcmp(report->passes[i].name, pass) == 0) return report->passes[i].sub_frames;
    return UINT32_MAX;
}

static const struct bd_technique *rendered_at(uint32_t *index)
{
    const struct bd_technique *technique = bd_technique_at((*index)++);
    while (technique && technique->is_reference) technique = bd_technique_at((*index)++);
    return technique;
}

// Whatever was made before, and however it was got: bytes and counts.
static void as_many_sub_frames_are_the_same_picture(void **state)
{
    struct world *w = *state;
    const struct bd_technique *technique;
    for (int room = 0; room < 2; room++)
        for (uint32_t i = 0; (technique = rendered_at(&i)) != NULL;) {
            if (room == ROOM_GLOSSY && !technique->light_glossy) continue;
            make_room(w, (enum room)room);
            struct bd_frame_request request = request_of(technique, 3);
            request.fresh = BD_FRESH_ALL;
            struct picture alone = render(w, &request);
            make_room(w, (enum room)room); // of which the memo has nothing
            request.fresh = BD_FRESH_NONE;
            for (request.aa = 1; request.aa < 3; request.aa++) {
                struct picture fewer = render(w, &request);
                finish(&fewer);
            }
            struct picture added = render(w, &request), again = render(w, &request);
            assert_same(&alone, &added, technique->name);
            assert_same(&alone, &again, technique->name);
            assert_int_equal(sub_frames_of(&added.report, "gbuffer"), 1);
            assert_int_equal(sub_frames_of(&again.report, "gbuffer"), 0);
            assert_int_equal(sub_frames_of(&alone.report, "gbuffer"), 3);
            request.aa = 2; // fewer than there are
            struct picture two = render(w, &request);
            request.fresh = BD_FRESH_ALL;
            struct picture two_alone = render(w, &request);
            assert_same(&two, &two_alone, technique->name);
            finish(&alone), finish(&added), finish(&again), finish(&two), finish(&two_alone);
        }
}

static bool shares(const struct bd_technique *technique, enum room room)
{
    return technique->light_pixels &&
           (room == ROOM_ROUGH || technique->light_glossy || !technique->model.glossy_receivers);
}

static void what_is_shared_is_near_what_is_not(void **state)
{
    struct world *w = *state;
    const struct bd_technique *technique;
    uint32_t shared_count = 0;
    for (int room = 0; room < 2; room++)
        for (uint32_t i = 0; (technique = rendered_at(&i)) != NULL;) {
            if (!technique->light_pixels) continue;
            make_room(w, (enum room)room);
            struct bd_frame_request request = request_of(technique, 4);
            request.fresh = BD_FRESH_CAMERA;
            struct picture shared = render(w, &request);
            assert_int_equal(bd_param_list_add(&request.params, "sub_frames=own", NULL), BD_ERR_OK);
            struct picture own = render(w, &request);
            double error =
                relative_rmse(shared.layers[BD_LAYER_INDIRECT], own.layers[BD_LAYER_INDIRECT]);
            uint32_t lit = sub_frames_of(&shared.report, bd_technique_light_pass(technique));
            printf("    %s, %s: %.3g %%, %llu places instead of %llu\n", technique->name,
                   room == ROOM_GLOSSY ? "glossy" : "rough", 100 * error,
                   (unsigned long long)shared.report.counts.fragments,
                   (unsigned long long)own.report.counts.fragments);
            for (uint32_t l = 0; l < BD_LAYER_RENDERED_COUNT; l++)
                if (!((1u << BD_LAYER_INDIRECT | 1u << BD_LAYER_BEAUTY | BD_LAYERS_DOUBT) >> l & 1))
                    assert_true(same_layer(shared.layers[l], own.layers[l]));
            if (shares(technique, (enum room)room)) {
                shared_count++;
                // What is decided by chance is decided four times by one and once by the other.
                assert_true(error > 0 && error < (technique->is_sampled ? 0.04 : 0.006));
                // Rods: pixels that the first sub-frame saw nothing of.
                assert_in_range(lit, 2, 4);
                assert_int_equal(sub_frames_of(&shared.report, "share"), 3);
                assert_true(shared.report.counts.fragments < own.report.counts.fragments / 2);
            } else {
                assert_true(error == 0);
                assert_int_equal(sub_frames_of(&shared.report, "share"), UINT32_MAX);
            }
            assert_int_equal(sub_frames_of(&own.report, "direct"), 4);
            finish(&shared), finish(&own);
        }
    assert_int_equal(shared_count, 15);
}

// Parts of a pixel on one side of a line of that angle, `offset` from its centre.
static double part_below(double (*places)[2], uint32_t count, double angle, double offset)
{
    uint32_t below = 0;
    for (uint32_t i = 0; i < count; i++)
        below += (places[i][0] - .5) * cos(angle) + (places[i][1] - .5) * sin(angle) < offset;
    return (double)below / count;
}

#define FINE 100u

// The root mean square of what sub-frames err about the parts on either side of an edge.
static double error_at_edges(double (*places)[2], uint32_t count, uint32_t angles)
{
    static double fine[FINE * FINE][2];
    double sum = 0;
    for (uint32_t i = 0; i < FINE * FINE; i++) {
        fine[i][0] = (i % FINE + .5) / FINE;
        fine[i][1] = (i / FINE + .5) / FINE;
    }
    for (uint32_t a = 0; a < angles; a++)
        for (int k = -24; k <= 24; k++) {
            const double angle = 6.283185307179586 * a / angles, offset = k / 49.;
            const double error = part_below(places, count, angle, offset) -
                                 part_below(fine, FINE * FINE, angle, offset);
            sum += error * error;
        }
    return sqrt(sum / (49 * angles));
}

// From the centre on, and each power of two as evenly as may be.
static void pixels_are_looked_through_evenly(void **state)
{
    (void)state;
    static const double most[] = {1, .27, .13, .075, .05, .03, .02};
    double places[64][2];
    for (uint32_t i = 0; i < 64; i++) {
        struct bd_viewpoint viewpoint = {0};
        bd_sub_frame_place(&viewpoint, i);
        places[i][0] = viewpoint.sample_x_px;
        places[i][1] = viewpoint.sample_y_px;
        assert_true(places[i][0] >= 0 && places[i][0] < 1);
        assert_true(places[i][1] >= 0 && places[i][1] < 1);
    }
    assert_true(places[0][0] == .5 && places[0][1] == .5);
    for (uint32_t power = 1; power <= 6; power++) {
        const double upright = error_at_edges(places, 1u << power, 4);
        const double all = error_at_edges(places, 1u << power, 24);
        printf("    %u: %.3f, of upright and level edges %.3f\n", 1u << power, all, upright);
        assert_true(all < most[power] && upright < 1.2 * most[power]);
    }
}

// One sub-frame shares with nobody: the parameter changes no byte.
static void a_single_frame_is_as_it_was(void **state)
{
    struct world *w = *state;
    make_room(w, ROOM_ROUGH);
    struct bd_frame_request request = request_of(&bd_technique_multires_gather, 1);
    struct picture one = render(w, &request);
    assert_int_equal(bd_param_list_add(&request.params, "sub_frames=own", NULL), BD_ERR_OK);
    struct picture own = render(w, &request);
    assert_same(&one, &own, "aa=1");
    finish(&one), finish(&own);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pixels_are_looked_through_evenly),
        cmocka_unit_test(a_single_frame_is_as_it_was),
        cmocka_unit_test(what_is_shared_is_near_what_is_not),
        cmocka_unit_test(as_many_sub_frames_are_the_same_picture),
    };
    return cmocka_run_group_tests(tests, world_open, world_close);
}
