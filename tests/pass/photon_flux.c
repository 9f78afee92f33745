// Where the flux of photons goes (pass/photon_paths.h): in rooms made by hand of which that is
// known, what set out is what left, what was absorbed and what was dropped.

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "pass/photon_paths.h"
#include "picture.h"
#include "tests/reference/stage.h"
#include "upload/light_setup.h"

#define PHOTONS 262144u

// A cube of side 2 about the origin, whose walls may be left out, and a lamp in it.
struct room {
    struct stage *stage;
    int32_t wall;
};

static const double low[3] = {-1, -1, -1}, high[3] = {1, 1, 1};

static struct room room_of(float albedo)
{
    struct room room = {.stage = stage_create()};
    room.wall = stage_material(room.stage, albedo);
    return room;
}

static int32_t glass_of(struct stage *stage, float roughness)
{
    const int32_t glass = stage_material(stage, 1);
    struct bd_material *m = stage_material_at(stage, glass);
    m->transmission = 1;
    m->roughness = roughness;
    m->thickness_m = 1;
    m->double_sided = false;
    m->attenuation_distance_m = INFINITY;
    return glass;
}

static void check(enum bd_err err, const struct bd_err_detail *detail)
{
    if (err) fail_msg("%s", detail->message);
}

// Of a lamp at the origin, in parts of what it sent. Ends the room.
static struct bd_photon_account send(struct room *room, uint32_t reflections, double range_m)
{
    struct bd_err_detail detail = {0};
    struct bd_rays *rays;
    struct bd_photon_map *map;
    struct bd_irradiance_cells *cells;
    struct bd_photon_account account;
    struct bd_scene *scene = room->stage->scene;
    const struct bd_rays_build build = {.repeated_max = BD_RAYS_REPEATED_MAX};
    struct bd_light *lamp = stage_light(room->stage, BD_LIGHT_POINT, 0, 0, 0, NULL, 1);
    if (range_m > 0) lamp->range_m = (float)range_m;
    check(bd_scene_finish(scene, &detail), &detail);
    check(bd_rays_create(scene, &build, &rays, &detail), &detail);
    struct bd_occluders *occluders = bd_occluders_of_rays(&rays);
    struct bd_pool *pool = bd_pool_create(0);
    const struct bd_processor processor = {pool, NULL};
    struct bd_pass_context own = context;
    own.processor = &processor;
    const struct bd_render_space space = bd_render_space_of(scene);
    const struct bd_light_setup setup = bd_light_setup_of(scene, 0);
    const struct bd_light_uniform punctual = bd_light_setup_uniform(&setup, &space, 0);
    const struct bd_visibility_inputs visibility = {.occluders = occluders, .pool = pool};
    const struct bd_photon_paths_inputs inputs = {.snapshot = scene,
                                                  .visibility = &visibility,
                                                  .punctuals = &punctual,
                                                  .punctual_count = 1,
                                                  .from_cd_m2 = 1,
                                                  .count = PHOTONS,
                                                  .reflections = reflections,
                                                  .lambert = true,
                                                  .glass = true,
                                                  .radius = 0.1f};
    check(bd_photon_paths_run(&own, &inputs, &map, &cells, &account, &detail), &detail);
    bd_photon_map_destroy(&map);
    bd_irradiance_cells_destroy(&cells);
    bd_occluders_destroy(context.gpu, &occluders);
    bd_pool_destroy(&pool);
    stage_destroy(&room->stage);
    assert_true(account.sent > 0);
    const double all = account.left + account.absorbed + account.lost + account.dropped;
    print_message("    left %.5f, absorbed %.5f, lost %.5f, dropped %.5f; together %.7f\n",
                  account.left / account.sent, account.absorbed / account.sent,
                  account.lost / account.sent, account.dropped / account.sent, all / account.sent);
    assert_true(fabs(all / account.sent - 1) < 1e-5);
    return (struct bd_photon_account){1, account.left / account.sent,
                                      account.absorbed / account.sent, account.lost / account.sent,
                                      account.dropped / account.sent};
}

static void assert_near(double value, double expected)
{
    if (!(fabs(value - expected) < 1e-3)) fail_msg("%.5f, expected %.5f", value, expected);
}

// All that a grey room does not reflect it absorbs; what the last reflection would send is dropped.
static void a_closed_room_absorbs(void **unused)
{
    (void)unused;
    struct room room = room_of(.5f);
    stage_box(room.stage, room.wall, low, high);
    const struct bd_photon_account a = send(&room, 3, 0);
    assert_near(a.left, 0);
    assert_near(a.absorbed, 1 - .125);
    assert_near(a.dropped, .125);
}

// White walls and clear glass take nothing, whatever way light goes between them.
static void white_walls_and_clear_glass_keep_all(void **unused)
{
    (void)unused;
    static const double ball[3] = {.4, .3, .2};
    struct room room = room_of(1);
    stage_box(room.stage, room.wall, low, high);
    stage_sphere(room.stage, glass_of(room.stage, 0), ball, .3, 4, false);
    const struct bd_photon_account a = send(&room, 6, 0);
    assert_near(a.left, 0);
    assert_near(a.absorbed, 0);
    assert_near(a.dropped + a.lost, 1);
    assert_true(a.lost < 5e-3); // where normals and flat triangles disagree, and between many walls
}

// A black floor is a sixth of what the lamp sees.
static void what_meets_nothing_leaves(void **unused)
{
    (void)unused;
    struct room room = room_of(0);
    stage_floor(room.stage, room.wall, 1, -1, 1);
    const struct bd_photon_account a = send(&room, 3, 0);
    assert_near(a.left, 5.0 / 6);
    assert_near(a.absorbed, 1.0 / 6);
}

// A solid about the lamp takes what Beer says, of what goes straight through both of its walls and
// of what goes to and fro in it.
static void a_shell_of_ink_absorbs(void **unused)
{
    (void)unused;
    static const double centre[3] = {0};
    struct room room = room_of(0);
    const int32_t ink = glass_of(room.stage, 0);
    struct bd_material *m = stage_material_at(room.stage, ink);
    m->attenuation_distance_m = .25f;
    m->attenuation_color[0] = m->attenuation_color[1] = m->attenuation_color[2] = .5f;
    stage_sphere(room.stage, ink, centre, .5, 5, true);
    stage_sphere(room.stage, ink, centre, .75, 5, false);
    const struct bd_photon_account a = send(&room, 3, 0);
    // Of the shell's two walls, straight on: what passes one comes to the other by half. Light that
    // the inner wall sends back meets it again on the other side.
    const double r = .04, t = .5, round = r * r * t * t;
    const double passes = (1 - r) * (1 - r) * t / (1 - round);
    const double back = r + (1 - r) * (1 - r) * r * t * t / (1 - round);
    if (!(fabs(a.left - passes / (1 - back)) < 2e-3)) // rays meet flat triangles
        fail_msg("%.5f, expected %.5f", a.left, passes / (1 - back));
    assert_near(a.dropped, 0);
}

// The window of a range takes its part of all that comes.
static void a_range_takes_its_part(void **unused)
{
    (void)unused;
    static const double centre[3] = {0};
    struct room room = room_of(1);
    stage_sphere(room.stage, room.wall, centre, 1, 5, true);
    const struct bd_photon_account a = send(&room, 1, 2);
    assert_near(a.absorbed, .0625);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_closed_room_absorbs),
        cmocka_unit_test(white_walls_and_clear_glass_keep_all),
        cmocka_unit_test(what_meets_nothing_leaves),
        cmocka_unit_test(a_shell_of_ink_absorbs),
        cmocka_unit_test(a_range_takes_its_part),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}
