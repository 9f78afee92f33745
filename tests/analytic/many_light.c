// `many_light` against what is known on paper: every reflection counted once, whatever its virtual
// lights leave out; mirrors; and pictures that do not depend on what was rendered before.

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "kernel/brdf.h"
#include "lights/sent.h"
#include "tests/analytic/world.h"
#include "tests/unit/cmocka_all.h"

#define SIDE_PX 24
#define RADIUS  2.0

static const double origin[3] = {0, 0, 0}, down[3] = {0, -1, 0};

static void make_sphere(struct world *w, float albedo, float roughness)
{
    const double target[3] = {1, 0.7, 0.4};
    world_clear(w);
    const int32_t grey = world_add_material(w, albedo);
    w->scene->materials[grey].roughness = roughness;
    world_add_sphere_room(w, grey, RADIUS, 4);
    world_add_light(w, BD_LIGHT_POINT, origin, down, 1);
    world_add_camera(w, origin, target, M_PI / 2);
    world_finish(w);
}

static double mean_of(const struct bd_image *image)
{
    double sum = 0;
    for (uint32_t y = 0; y < SIDE_PX; y++)
        for (uint32_t x = 0; x < SIDE_PX; x++) sum += bd_image_at(image, x, y)[0];
    return sum / (SIDE_PX * SIDE_PX);
}

// Each reflection brings half of what the one before did, to every place alike (algorithms.md D2).
static void every_reflection_counts_once(void **state)
{
    static const char *const bounces[][4] = {
        {"indirect_bounces=1", "far_rays=16", "brdf=lambert", NULL},
        {"indirect_bounces=2", "far_rays=16", "brdf=lambert", NULL},
        {"indirect_bounces=3", "far_rays=16", "brdf=lambert", NULL},
        {"far_rays=16", "brdf=lambert", NULL, NULL}};
    const double expected[] = {.5, .75, .875, 1};
    const double once = 0.5 / M_PI * 1 / (RADIUS * RADIUS);
    struct world *w = *state;
    make_sphere(w, .5f, 1);
    for (int i = 0; i < 4; i++) {
        struct bd_image *layers[BD_LAYER_COUNT];
        world_render(w, "many_light", 0, SIDE_PX, SIDE_PX, 1u << BD_LAYER_INDIRECT, bounces[i],
                     layers);
        ASSERT_REL(mean_of(layers[BD_LAYER_INDIRECT]) / once, expected[i], .015);
        for (uint32_t y = 0; y < SIDE_PX; y++)
            for (uint32_t x = 0; x < SIDE_PX; x++)
                assert_relative(__FILE__, __LINE__, "a pixel",
                                bd_image_at(layers[BD_LAYER_INDIRECT], x, y)[0] / once, expected[i],
                                .15);
        world_free_layers(layers);
    }
}

// The same under the whole BRDF of a rough dielectric: light falls straight on it first and from
// everywhere then, and it is looked at straight (lights/sent.h).
static void a_rough_room_returns_what_its_brdf_does(void **state)
{
    static const char *const full[] = {"far_rays=16", NULL};
    struct world *w = *state;
    make_sphere(w, .1f, .8f);
    const f3 base = f3_of(.1f, .1f, .1f);
    const double straight = (double)bd_sent_by_all(base, 0, .8f, .04f, 1).x;
    const double then = (double)bd_sent_by_all(base, 0, .8f, .04f, BD_FROM_EVERYWHERE).x;
    struct bd_image *layers[BD_LAYER_COUNT];
    world_render(w, "many_light", 0, SIDE_PX, SIDE_PX, 1u << BD_LAYER_INDIRECT, full, layers);
    ASSERT_REL(mean_of(layers[BD_LAYER_INDIRECT]),
               straight / (1 - then) * straight / (M_PI * RADIUS * RADIUS), .01);
    world_free_layers(layers);
}

static int32_t add_mirror(struct world *w)
{
    const int32_t mirror = world_add_material(w, 1);
    w->scene->materials[mirror].metallic = 1;
    w->scene->materials[mirror].roughness = 0;
    return mirror;
}

// Per candela, of a lamp so far before a matt wall of base colour one half and so far aside, seen
// from straight before it.
static double of_wall(double x, double y, double z)
{
    const double distance2 = x * x + y * y + z * z, distance = sqrt(distance2);
    const f3 ahead = f3_of(0, 0, 1), base = f3_of(.5f, .5f, .5f);
    const f3 way = f3_of((float)(y / distance), (float)(z / distance), (float)(x / distance));
    const double brdf = (double)gltf_brdf(base, 0, 1, .04f, ahead, way, ahead).x;
    return brdf * x / (distance2 * distance);
}

// A mirror at x = -1, a wall at x = 1, a lamp between, which lights the wall by the mirror, too
// (algorithms.md D10).
static void a_mirror_shows_the_light_of_the_wall(void **state)
{
    static const char *const once[] = {"indirect_bounces=1", "far_rays=16", NULL};
    const double wall[4][3] = {{1, -1, -1}, {1, -1, 1}, {1, 1, 1}, {1, 1, -1}};
    const double mirror[4][3] = {{-1, -1, 1}, {-1, -1, -1}, {-1, 1, -1}, {-1, 1, 1}};
    const double lamp[3] = {.25, .5, .1}, at[3] = {-1, .125, -.25}, to_wall[3] = {1, 0, 0};
    struct world *w = *state;
    world_clear(w);
    world_add_quad(w, world_add_material(w, 0.5f), wall, 4);
    world_add_quad(w, add_mirror(w), mirror, 4);
    world_add_light(w, BD_LIGHT_POINT, lamp, down, 1);
    const int32_t probe = world_add_probe(w, at, to_wall, 1e-3);
    world_finish(w);
    const double y = at[1] - lamp[1], z = at[2] - lamp[2];
    const double expected = of_wall(1 - lamp[0], y, z) + of_wall(3 + lamp[0], y, z);
    ASSERT_REL(world_probe(w, "many_light", (uint32_t)probe, BD_LAYER_INDIRECT, once), expected,
               .01);
}

static bool same_bytes(const struct bd_image *a, const struct bd_image *b)
{
    return memcmp(a->pixels, b->pixels,
                  sizeof *a->pixels * a->width_px * a->height_px * a->channel_count) == 0;
}

static void make_room(struct world *w, float lamp_cd)
{
    const double block[4][3] = {{-.3, -1, .2}, {.2, -1, .4}, {.2, 0, .4}, {-.3, 0, .2}};
    const double lamp[3] = {.3, .5, .2}, eyes[3][3] = {{.7, .4, .9}, {-.6, .1, .8}, {.1, -.5, -.7}};
    const double target[3] = {-.2, -.1, 0};
    world_clear(w);
    world_add_box_room(w, world_add_material(w, 0.6f), origin, 1);
    world_add_quad(w, add_mirror(w), block, 1);
    world_add_light(w, BD_LIGHT_POINT, lamp, down, lamp_cd);
    for (int i = 0; i < 3; i++) world_add_camera(w, eyes[i], target, 1.2);
    world_finish(w);
}

static void look(struct world *w, uint32_t camera, enum bd_fresh fresh,
                 struct bd_image *layers[BD_LAYER_COUNT])
{
    w->fresh = fresh;
    world_render(w, "many_light", camera, SIDE_PX, SIDE_PX, 1u << BD_LAYER_INDIRECT, NULL, layers);
}

// Not on other cameras' frames, and not on those of another revision.
static void a_picture_has_no_history(void **state)
{
    struct world *w = *state;
    struct bd_image *alone[BD_LAYER_COUNT], *other[BD_LAYER_COUNT], *again[BD_LAYER_COUNT];
    make_room(w, 1);
    look(w, 0, BD_FRESH_ALL, alone);
    for (uint32_t camera = 1; camera < 3; camera++) {
        look(w, camera, BD_FRESH_NONE, other);
        assert_false(same_bytes(alone[BD_LAYER_INDIRECT], other[BD_LAYER_INDIRECT]));
        world_free_layers(other);
    }
    make_room(w, 3);
    look(w, 0, BD_FRESH_NONE, other);
    assert_false(same_bytes(alone[BD_LAYER_INDIRECT], other[BD_LAYER_INDIRECT]));
    make_room(w, 1);
    look(w, 0, BD_FRESH_NONE, again);
    assert_true(same_bytes(alone[BD_LAYER_INDIRECT], again[BD_LAYER_INDIRECT]));
    world_free_layers(again);
    world_reopen_device(w);
    make_room(w, 1);
    look(w, 0, BD_FRESH_NONE, again);
    assert_true(same_bytes(alone[BD_LAYER_INDIRECT], again[BD_LAYER_INDIRECT]));
    world_free_layers(alone);
    world_free_layers(other);
    world_free_layers(again);
}

// --- a corridor --------------------------------------------------------------------------------

#define LONG_PX 32
#define PARTS   4

// 8 m long and 2 m wide and high, a lamp at one end; seen from above, without its ceiling's front.
static void make_corridor(struct world *w)
{
    const double faces[6][4][3] = {
        {{-4, -1, 1}, {4, -1, 1}, {4, -1, -1}, {-4, -1, -1}},
        {{-4, 1, -1}, {4, 1, -1}, {4, 1, 1}, {-4, 1, 1}},
        {{-4, -1, -1}, {4, -1, -1}, {4, 1, -1}, {-4, 1, -1}},
        {{4, -1, 1}, {-4, -1, 1}, {-4, 1, 1}, {4, 1, 1}},
        {{-4, -1, 1}, {-4, -1, -1}, {-4, 1, -1}, {-4, 1, 1}},
        {{4, -1, -1}, {4, -1, 1}, {4, 1, 1}, {4, 1, -1}},
    };
    const double lamp[3] = {-3.2, .3, .2}, eye[3] = {0, 0, .9}, target[3] = {0, 0, -1};
    world_clear(w);
    const int32_t grey = world_add_material(w, 0.6f);
    for (int i = 0; i < 6; i++) world_add_quad(w, grey, faces[i], 8);
    world_add_light(w, BD_LIGHT_POINT, lamp, down, 1);
    world_add_camera(w, eye, target, 1.9);
    world_finish(w);
}

static const char *const all_by_vpls[] = {"indirect_visibility=rays", "rays=64",      "vpls=8192",
                                          "indirect_bounces=64",      "brdf=lambert", NULL};

static void corridor_by(struct world *w, const char *technique, const char *const *settings,
                        double parts[PARTS])
{
    struct bd_image *layers[BD_LAYER_COUNT];
    world_render(w, technique, 0, LONG_PX, LONG_PX / 2, 1u << BD_LAYER_INDIRECT, settings, layers);
    for (uint32_t part = 0; part < PARTS; part++) {
        parts[part] = 0;
        for (uint32_t y = 0; y < LONG_PX / 2; y++)
            for (uint32_t x = 0; x < LONG_PX / PARTS; x++)
                parts[part] +=
                    bd_image_at(layers[BD_LAYER_INDIRECT], part * LONG_PX / PARTS + x, y)[0];
    }
    world_free_layers(layers);
}

// Virtual lights of all reflections, without a cache, have as much everywhere along it.
static void a_corridor_is_as_light_as_by_virtual_lights_alone(void **state)
{
    static const char *const gathered[] = {"rays=16", "far_rays=32", "vpls=4096", "brdf=lambert",
                                           NULL};
    struct world *w = *state;
    double expected[PARTS], seen[PARTS];
    make_corridor(w);
    corridor_by(w, "rsm", all_by_vpls, expected);
    corridor_by(w, "many_light", gathered, seen);
    assert_true(expected[0] > 3 * expected[PARTS - 1]);
    for (uint32_t part = 0; part < PARTS; part++) ASSERT_REL(seen[part], expected[part], .05);
}

// Few pixels send as many rays in all that look for the cache's places.
static void a_picture_of_four_pixels_has_all_of_its_light(void **state)
{
    static const char *const gathered[] = {"rays=256", "far_rays=256", "vpls=4096", "brdf=lambert",
                                           NULL};
    struct world *w = *state;
    struct bd_image *layers[2][BD_LAYER_COUNT];
    make_corridor(w);
    world_render(w, "rsm", 0, 2, 2, 1u << BD_LAYER_INDIRECT, all_by_vpls, layers[0]);
    world_render(w, "many_light", 0, 2, 2, 1u << BD_LAYER_INDIRECT, gathered, layers[1]);
    for (uint32_t i = 0; i < 4; i++)
        ASSERT_REL(bd_image_at(layers[1][BD_LAYER_INDIRECT], i % 2, i / 2)[0],
                   bd_image_at(layers[0][BD_LAYER_INDIRECT], i % 2, i / 2)[0], .06);
    world_free_layers(layers[0]);
    world_free_layers(layers[1]);
}

// The diagonals of a picture that looks along a room's middle are where walls meet: their pixels
// have as much light as those beside them, on either wall.
static void where_walls_meet_it_is_as_light_as_beside(void **state)
{
    static const char *const many[] = {"rays=64", "far_rays=64", "noise_filter=off", NULL};
    const double at[3] = {3.1, -1.7, 2.3}, eye[3] = {3.1, -1.7, 3.2};
    struct world *w = *state;
    world_clear(w);
    world_add_box_room(w, world_add_material(w, 0.5f), at, 1);
    world_add_light(w, BD_LIGHT_POINT, at, down, 1);
    world_add_camera(w, eye, at, 2.2);
    world_finish(w);
    struct bd_image *layers[BD_LAYER_COUNT];
    world_render(w, "many_light", 0, SIDE_PX, SIDE_PX, 1u << BD_LAYER_INDIRECT, many, layers);
    const struct bd_image *image = layers[BD_LAYER_INDIRECT];
    double least = INFINITY, most = 0;
    for (uint32_t i = 0; i < SIDE_PX / 4; i++)
        for (int corner = 0; corner < 4; corner++) {
            const uint32_t x = corner & 1 ? SIDE_PX - 1 - i : i;
            const uint32_t y = corner & 2 ? SIDE_PX - 1 - i : i;
            const uint32_t in_x = corner & 1 ? x - 1 : x + 1, in_y = corner & 2 ? y - 1 : y + 1;
            const double beside =
                (double)(bd_image_at(image, in_x, y)[0] + bd_image_at(image, x, in_y)[0]) / 2;
            const double ratio = (double)bd_image_at(image, x, y)[0] / beside;
            least = fmin(least, ratio), most = fmax(most, ratio);
        }
    printf("    %.2f to %.2f of the light beside\n", least, most);
    assert_true(least > 0.8 && most < 1.2);
    world_free_layers(layers);
}

// One weak lamp in the room, and in another many that are a thousand times as bright: the room's
// light is that of the weak one alone.
static double light_of_a_room(struct world *w, uint32_t lamps_elsewhere)
{
    static const char *const asked[] = {"brdf=lambert", NULL};
    const double elsewhere[3] = {5, 0, 0}, eye[3] = {.7, .4, .9}, target[3] = {-.2, -.1, 0};
    world_clear(w);
    const int32_t grey = world_add_material(w, 0.5f);
    world_add_box_room(w, grey, origin, 1);
    world_add_box_room(w, grey, elsewhere, 1);
    world_add_light(w, BD_LIGHT_POINT, origin, down, 1);
    for (uint32_t i = 0; i < lamps_elsewhere; i++) {
        const double at[3] = {5 + .1 * (i % 4), .2 * (i / 4), 0};
        world_add_light(w, BD_LIGHT_POINT, at, down, 1000);
    }
    world_add_camera(w, eye, target, 1);
    world_finish(w);
    struct bd_image *layers[BD_LAYER_COUNT];
    world_render(w, "many_light", 0, SIDE_PX, SIDE_PX, 1u << BD_LAYER_INDIRECT, asked, layers);
    const double mean = mean_of(layers[BD_LAYER_INDIRECT]);
    world_free_layers(layers);
    return mean;
}

static void a_weak_lamp_has_photons_too(void **state)
{
    const double alone = light_of_a_room(*state, 0), among = light_of_a_room(*state, 15);
    printf("    %.3f of what it is alone\n", among / alone);
    assert_true(alone > 0);
    ASSERT_REL(among, alone, .2);
}

static void more_first_light_than_there_may_be_is_refused(void **state)
{
    struct world *w = *state;
    struct bd_frame_request request = bd_frame_request_default;
    struct bd_image *layers[BD_LAYER_COUNT] = {0};
    struct bd_report report;
    struct bd_err_detail detail = {0};
    make_corridor(w);
    snprintf(request.technique, sizeof request.technique, "many_light");
    request.width_px = request.height_px = 4;
    assert_int_equal(bd_param_list_add(&request.params, "vpls=16777216", NULL), BD_ERR_OK);
    assert_int_equal(
        bd_frame_render(&w->renderer, w->scene, &request, NULL, NULL, layers, &report, &detail),
        BD_ERR_LIMIT);
    assert_string_equal(detail.field, "vpls");
    assert_non_null(strstr(detail.message, "1048576"));
}

// --- two rooms ----------------------------------------------------------------------------------

// Floor, ceiling and walls go on behind a wall of one sheet, of which both sides are lit; the lamp
// is on its left, the eye on its right.
static void a_sheet_hides_every_reflection(void **state)
{
    const double sheet[4][3] = {{0, -1, 0}, {0, -1, 1}, {0, 1, 1}, {0, 1, 0}};
    const double other[4][3] = {{0, -1, -1}, {0, -1, 0}, {0, 1, 0}, {0, 1, -1}};
    const double lamp[3] = {-.4, .1, .2}, eye[3] = {.9, 0, .6}, target[3] = {.1, -.1, -.8};
    struct bd_image *layers[BD_LAYER_COUNT];
    struct world *w = *state;
    world_clear(w);
    const int32_t grey = world_add_material(w, 0.8f);
    w->scene->materials[grey].double_sided = true;
    world_add_box_room(w, grey, origin, 1);
    world_add_quad(w, grey, sheet, 1);
    world_add_quad(w, grey, other, 1);
    world_add_light(w, BD_LIGHT_POINT, lamp, down, 100);
    world_add_camera(w, eye, target, 1.6);
    world_finish(w);
    world_render(w, "many_light", 0, SIDE_PX, SIDE_PX, 1u << BD_LAYER_INDIRECT, NULL, layers);
    for (uint32_t y = 0; y < SIDE_PX; y++)
        for (uint32_t x = 0; x < SIDE_PX; x++)
            assert_true(bd_image_at(layers[BD_LAYER_INDIRECT], x, y)[0] == 0);
    world_free_layers(layers);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_reflection_counts_once),
        cmocka_unit_test(a_rough_room_returns_what_its_brdf_does),
        cmocka_unit_test(a_mirror_shows_the_light_of_the_wall),
        cmocka_unit_test(a_picture_has_no_history),
        cmocka_unit_test(a_picture_of_four_pixels_has_all_of_its_light),
        cmocka_unit_test(where_walls_meet_it_is_as_light_as_beside),
        cmocka_unit_test(a_weak_lamp_has_photons_too),
        cmocka_unit_test(more_first_light_than_there_may_be_is_refused),
        cmocka_unit_test(a_sheet_hides_every_reflection),
        cmocka_unit_test(a_corridor_is_as_light_as_by_virtual_lights_alone),
    };
    return cmocka_run_group_tests(tests, world_open, world_close);
}
