// Rounds of sub-frames (frame/sub_frames.h): more of them go on where fewer ended, each round draws
// anew what is decided by chance and nothing else, what it made is gone with it, and error and the
// estimate of it fall.

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "tests/analytic/world.h"
#include "tests/unit/cmocka_all.h"

#define WIDTH  25u
#define HEIGHT 17u
#define FLOATS (3 * WIDTH * HEIGHT)
#define FEW    "rays=4 far_rays=4 vpls=128 walk_vpls=256 cache_cells=256"

static const double origin[3] = {0, 0, 0}, down[3] = {0, -1, 0};

// A lamp with a size, a spot of light, a block; a floor that mirrors a little.
static void make_room_with(struct world *w, float emitted)
{
    const double block[4][3] = {{-.3, -1, .2}, {.2, -1, .4}, {.2, 0, .4}, {-.3, 0, .2}};
    const double lamp[4][3] = {{-.2, .99, -.2}, {.2, .99, -.2}, {.2, .99, .2}, {-.2, .99, .2}};
    const double spot[3] = {.3, .5, .2}, eye[3] = {.7, .4, .9}, target[3] = {-.2, -.3, 0};
    world_clear(w);
    const int32_t grey = world_add_material(w, 0.6f), glowing = world_add_material(w, 0);
    world_add_box_room(w, grey, origin, 1);
    const int32_t smooth = world_add_material(w, 0.5f);
    w->scene->materials[smooth].roughness = 0.3f;
    w->scene->materials[smooth].metallic = 1;
    for (int c = 0; c < 3; c++) w->scene->materials[glowing].emissive[c] = emitted;
    world_add_quad(w, smooth, block, 1);
    world_add_quad(w, glowing, lamp, 1);
    world_add_light(w, BD_LIGHT_POINT, spot, down, 1);
    world_add_camera(w, eye, target, 1.2);
    world_finish(w);
}

static void make_room(struct world *w)
{
    make_room_with(w, 2);
}

static struct world_picture render(struct world *w, const char *technique, const char *settings,
                                   uint64_t seed, uint32_t aa)
{
    struct bd_frame_request request = bd_frame_request_default;
    char words[200], *rest = words;
    snprintf(request.technique, sizeof request.technique, "%s", technique);
    request.width_px = WIDTH;
    request.height_px = HEIGHT;
    request.layers |= 1u << BD_LAYER_INDIRECT | BD_LAYERS_DOUBT;
    request.seed = seed;
    request.aa = aa;
    snprintf(words, sizeof words, "%s", settings);
    for (char *word; (word = strsep(&rest, " ")) != NULL;)
        if (*word) assert_int_equal(bd_param_list_add(&request.params, word, NULL), BD_ERR_OK);
    return world_picture_of(w, &request);
}

// From the end of a round, from its middle, from the round before.
static void more_of_them_go_on_where_fewer_ended(void **state)
{
    struct world *w = *state;
    static const uint32_t before[] = {64, 130, 170}; // at a round's end, in one, and all
    make_room(w);
    struct world_picture alone = render(w, "many_light", FEW, 7, 170);
    for (size_t i = 0; i < sizeof before / sizeof *before; i++) {
        make_room(w); // of which the memo has nothing
        struct world_picture fewer = render(w, "many_light", FEW, 7, before[i]);
        struct world_picture other = render(w, "many_light", FEW, 8, 70);
        struct world_picture more = render(w, "many_light", FEW, 7, 170);
        assert_int_equal(world_times_run(&fewer.report, "direct"), before[i]);
        assert_in_range(world_times_run(&more.report, "direct"), 170 - before[i],
                        170 - before[i] + 1);
        world_assert_same(&alone, &more);
        world_picture_free(&fewer), world_picture_free(&other), world_picture_free(&more);
    }
    world_picture_free(&alone);
}

static void only_what_is_decided_by_chance_is_drawn_anew(void **state)
{
    struct world *w = *state;
    static const struct {
        const char *technique, *settings, *pass;
        uint32_t times;
        float emitted; // whose direct light asks by chance
    } cases[] = {
        {"many_light", FEW, "cache", 3, 2},
        {"many_light", FEW " sub_frames=own", "cache", 130, 0},
        {"many_light", FEW " light_blocks=2", "cache", 3, 0},
        {"multires_gather", "", "discontinuity", 3, 2},
        {"multires_gather", "", "discontinuity", 1, 0},
        {"multires_gather", "indirect_visibility=rays rays=4", "discontinuity", 3, 0},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        make_room_with(w, cases[i].emitted);
        struct world_picture p = render(w, cases[i].technique, cases[i].settings, 0, 130);
        assert_in_range(world_times_run(&p.report, "gbuffer"), 130, 133); // one more of blocks a round
        assert_int_equal(world_times_run(&p.report, cases[i].pass), cases[i].times);
        world_picture_free(&p);
    }
}

static double rms_apart(const struct world_picture *a, const struct world_picture *b)
{
    double squares = 0, light = 0;
    for (uint32_t i = 0; i < FLOATS; i++) {
        const double one = a->layers[BD_LAYER_INDIRECT]->pixels[i];
        const double other = b->layers[BD_LAYER_INDIRECT]->pixels[i];
        squares += (one - other) * (one - other) / FLOATS;
        light += (one + other) / (2 * FLOATS);
    }
    return sqrt(squares) / light;
}

// Two seeds' pictures come nearer to each other, as the root of the rounds or faster than the
// filter's, which smooths less from round to round; and so does what each says of itself, noise and
// blur. Nothing that a round made is kept.
static void error_falls_and_memory_does_not_grow(void **state)
{
    struct world *w = *state;
    double apart[2], says[2], blur2[2] = {0}, mib[2];
    make_room_with(w, 0);
    for (int i = 0; i < 2; i++) {
        struct world_picture a = render(w, "many_light", FEW " brdf=lambert", 1, i ? 64 * 8 : 64);
        struct world_picture b = render(w, "many_light", FEW " brdf=lambert", 2, i ? 64 * 8 : 64);
        apart[i] = rms_apart(&a, &b);
        says[i] = a.report.own_estimate;
        for (uint32_t j = 0; j < WIDTH * HEIGHT; j++)
            blur2[i] += a.layers[BD_LAYER_BLUR]->pixels[j];
        mib[i] = b.report.memory_gpu_mib;
        world_picture_free(&a), world_picture_free(&b);
    }
    printf("    1 and 8 rounds: seeds %.2f and %.2f %% apart, estimates %.2f and %.2f %%, %.3f and "
           "%.3f MiB\n",
           100 * apart[0], 100 * apart[1], 100 * says[0], 100 * says[1], mib[0], mib[1]);
    assert_true(apart[1] < .6 * apart[0]);
    assert_true(says[1] < .5 * says[0] && blur2[1] < .3 * blur2[0]);
    assert_true(mib[1] < mib[0] + .01);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(more_of_them_go_on_where_fewer_ended),
        cmocka_unit_test(only_what_is_decided_by_chance_is_drawn_anew),
        cmocka_unit_test(error_falls_and_memory_does_not_grow),
    };
    return cmocka_run_group_tests(tests, world_open, world_close);
}
