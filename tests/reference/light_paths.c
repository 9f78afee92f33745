// Light paths (reference/light_path.c, film.c): caustics of punctual lights that are points,
// against closed forms and against lamps with a radius.

#include <math.h>
#include <stddef.h>
#include <stdlib.h>

#include "reference/film.h"
#include "stage.h"
#include "tests/unit/cmocka_all.h"

#define SIDE_PX 8u

static int32_t smooth(struct stage *s, float metallic, float transmission)
{
    const int32_t material = stage_material(s, 1);
    struct bd_material *m = stage_material_at(s, material);
    m->metallic = metallic;
    m->roughness = 0;
    m->transmission = transmission;
    m->thickness_m = transmission;
    m->attenuation_distance_m = INFINITY;
    m->double_sided = transmission == 0;
    return material;
}

static void add_slab(struct stage *s, int32_t material, double half, double low, double high)
{
    stage_floor(s, material, half, high, 1);
    stage_floor(s, material, half, low, -1);
}

static struct bd_film *film_of(struct stage *s, const struct bd_integrand *integrand,
                               const struct bd_reference_view *view, const uint32_t region[4])
{
    struct bd_film *film;
    struct bd_err_detail detail;
    if (!s->reference) stage_finish(s, 1);
    assert_int_equal(bd_film_create(s->reference, integrand, view, region, &film, &detail),
                     BD_ERR_OK);
    return film;
}

// Mean luminance of a picture, what landed alone; the error by its two halves.
static struct estimate landed(struct stage *s, const struct bd_integrand *integrand,
                              uint32_t camera, uint32_t samples)
{
    const struct bd_reference_view view = {SIDE_PX, SIDE_PX, camera, {0}};
    const uint32_t whole[4] = {0, 0, SIDE_PX, SIDE_PX};
    struct bd_film *film = film_of(s, integrand, &view, whole);
    double half[2] = {0};
    for (uint32_t i = 0; i < 2 * samples; i++)
        bd_film_trace(film, 1, 0, (uint64_t)i * SIDE_PX * SIDE_PX, SIDE_PX * SIDE_PX);
    for (uint32_t i = 0; i < SIDE_PX * SIDE_PX; i++) {
        struct bd_reference_pixel pixel = {0};
        bd_film_take(film, i % SIDE_PX, i / SIDE_PX, &pixel);
        for (int h = 0; h < 2; h++) half[h] += pixel.landed[h][0];
    }
    bd_film_destroy(&film);
    const double all = (double)samples * SIDE_PX * SIDE_PX;
    return (struct estimate){(half[0] + half[1]) / (2 * all), fabs(half[0] - half[1]) / (2 * all)};
}

// What the floor alone shows of a lamp somewhere.
static double straight(const double eye[3], double x, double y)
{
    const double target[3] = {0, 0, 0};
    struct stage *s = stage_create();
    stage_floor(s, stage_material(s, .5f), 20, 0, 1);
    stage_light(s, BD_LIGHT_POINT, x, y, 0, NULL, 1);
    const uint32_t camera = stage_camera(s, eye, target, .4);
    struct bd_integrand integrand = bd_integrand_full;
    integrand.filter = BD_FILTER_BOX;
    const struct estimate e = stage_radiance(s, &integrand, camera, BD_PART_DIRECT, SIDE_PX, 256);
    stage_destroy(&s);
    return e.mean;
}

// D10: a mirror shows a second lamp to the floor. Seen from a little above it.
static void a_mirror_shows_another(void **state)
{
    (void)state;
    const double wall[4][3] = {{-1, -9, 9}, {-1, -9, -9}, {-1, 9, -9}, {-1, 9, 9}};
    const double eye[3] = {.1, .6, .1}, target[3] = {0, 0, 0};
    struct stage *s = stage_create();
    stage_floor(s, stage_material(s, .5f), 20, 0, 1);
    stage_quad(s, smooth(s, 1, 0), wall);
    stage_light(s, BD_LIGHT_POINT, 0, 1, 0, NULL, 1);
    const uint32_t camera = stage_camera(s, eye, target, .4);
    stage_finish(s, 1);
    assert_true(bd_reference_has_light_paths(s->reference, &bd_integrand_full));
    CHECK(landed(s, &bd_integrand_full, camera, 40000), straight(eye, -2, 1), .01);
    stage_destroy(&s);
}

// Straight down through glass, and what goes back and forth in it.
static void a_slab_lets_through_what_fresnel_says(void **state)
{
    (void)state;
    const double eye[3] = {.15, .6, 0}, target[3] = {0, 0, 0}, thick = .4, height = 2;
    struct stage *s = stage_create();
    struct bd_integrand integrand = bd_integrand_full;
    stage_floor(s, stage_material(s, .5f), 20, 0, 1);
    add_slab(s, smooth(s, 0, 1), 9, .8, .8 + thick);
    stage_light(s, BD_LIGHT_POINT, 0, height, 0, NULL, 1);
    const uint32_t camera = stage_camera(s, eye, target, .4);
    double expected = 0;
    for (int order = 0; order < 3; order++)
        expected += .96 * .96 * pow(.04, 2 * order) *
                    straight(eye, 0, height - thick + (1 + 2 * order) * thick / 1.5);
    CHECK(landed(s, &integrand, camera, 40000), expected, .01);
    stage_destroy(&s);
}

static int32_t pane(struct stage *s, float share)
{
    const int32_t material = smooth(s, 0, share);
    struct bd_material *m = stage_material_at(s, material);
    m->thickness_m = 0;
    m->double_sided = true;
    m->base_color[0] = m->base_color[1] = m->base_color[2] = .8f;
    return material;
}

// Two of them, straight down: punctual lights are sought through those.
static void panes_let_through_what_fresnel_says(void **state)
{
    (void)state;
    const double eye[3] = {.15, .6, 0}, target[3] = {0, 0, 0};
    struct stage *s = stage_create();
    stage_floor(s, stage_material(s, .5f), 20, 0, 1);
    stage_floor(s, pane(s, 1), 9, .8, 1);
    stage_floor(s, pane(s, .5f), 9, 1.2, -1);
    stage_light(s, BD_LIGHT_POINT, 0, 2, 0, NULL, 1);
    const uint32_t camera = stage_camera(s, eye, target, .4);
    const struct estimate e =
        stage_radiance(s, &bd_integrand_full, camera, BD_PART_DIRECT, SIDE_PX, 256);
    CHECK(e, .96 * .8 * .96 * .4 * straight(eye, 0, 2), .003);
    stage_destroy(&s);
}

// What the floor sends up to a place above it, of a point and of a small sphere. Ends the stage.
static void check_below(struct stage *s, uint32_t bounces)
{
    struct bd_integrand point = bd_integrand_full, sphere = bd_integrand_full;
    point.bounces_max = sphere.bounces_max = bounces;
    sphere.lamp_radius_m = .1;
    const struct estimate of_point =
        stage_irradiance(s, &point, BD_PART_INDIRECT, .1, .3, 0, 0, -1, 0, 1 << 17);
    const struct estimate of_sphere =
        stage_irradiance(s, &sphere, BD_PART_INDIRECT, .1, .3, 0, 0, -1, 0, 1 << 20);
    CHECK_SAME(of_point, of_sphere, .02);
    stage_destroy(&s);
}

// A floor that shines through panes on what is above it: by every way that finds it, and of half a
// pane, which no path from the light goes on from.
static void what_panes_let_through_is_told_once(void **state)
{
    (void)state;
    for (int half = 0; half < 2; half++)
        for (uint32_t bounces = 1; bounces < 4; bounces += 2) {
            struct stage *s = stage_create();
            stage_floor(s, stage_material(s, .8f), 2, 0, 1);
            stage_floor(s, pane(s, half ? .5f : 1), 9, .8, 1);
            stage_floor(s, pane(s, 1), 9, .9, 1);
            stage_light(s, BD_LIGHT_SPOT, 0, 1, 0, (const double[3]){0, -1, 0}, 1);
            struct bd_integrand with = bd_integrand_full, without = with;
            with.bounces_max = without.bounces_max = bounces;
            without.light_vertices = false;
            const struct estimate a =
                stage_irradiance(s, &with, BD_PART_INDIRECT, .1, .3, 0, 0, -1, 0, 1 << 17);
            const struct estimate b =
                stage_irradiance(s, &without, BD_PART_INDIRECT, .1, .3, 0, 0, -1, 0, 1 << 18);
            CHECK_SAME(a, b, .02);
            stage_destroy(&s);
        }
    struct stage *s = stage_create();
    stage_floor(s, stage_material(s, .8f), 2, 0, 1);
    stage_floor(s, pane(s, 1), 9, .8, 1);
    stage_light(s, BD_LIGHT_POINT, 0, 1, 0, NULL, 1);
    check_below(s, BD_BOUNCES_UNLIMITED);
}

// What a caustic on the floor sends up, to who does not see it in the mirror, too: eye paths are
// joined with where light falls behind what is smooth.
static void a_caustic_sends_light_on(void **state)
{
    (void)state;
    const double wall[4][3] = {{-1, .5, 9}, {-1, .5, -9}, {-1, 9, -9}, {-1, 9, 9}};
    struct stage *s = stage_create();
    stage_floor(s, stage_material(s, .8f), 2, 0, 1);
    stage_quad(s, smooth(s, 1, 0), wall);
    stage_light(s, BD_LIGHT_POINT, 0, 1, 0, NULL, 1);
    check_below(s, BD_BOUNCES_UNLIMITED);
}

// The same of a floor within a solid, where radiance is larger by the index squared and flux is not:
// light through its upper side alone.
static void light_within_a_solid(void **state)
{
    (void)state;
    struct stage *s = stage_create();
    stage_floor(s, stage_material(s, .8f), 2, 0, 1);
    add_slab(s, smooth(s, 0, 1), 9, -.5, .5);
    stage_light(s, BD_LIGHT_POINT, 0, 1, 0, NULL, 1);
    check_below(s, 2);
}

// The lights that an importer hangs into a scene without any stand in for what would shine.
// White mirrors all around take nothing of its light, and let none out.
static void what_is_trapped_ends(void **state)
{
    (void)state;
    const double eye[3] = {.3, .5, 0}, target[3] = {0, 0, 0};
    struct stage *s = stage_create();
    const int32_t mirror = smooth(s, 1, 0);
    for (int side = 0; side < 6; side++) {
        double wall[4][3];
        for (int corner = 0; corner < 4; corner++) {
            const double across = corner == 1 || corner == 2 ? 1 : -1, along = corner < 2 ? -1 : 1;
            wall[corner][side / 2] = side % 2 ? 1 : -1;
            wall[corner][(side / 2 + 1) % 3] = across;
            wall[corner][(side / 2 + 2) % 3] = along;
        }
        stage_quad(s, mirror, (const double(*)[3])wall);
    }
    stage_light(s, BD_LIGHT_POINT, 0, .5, 0, NULL, 1);
    const uint32_t camera = stage_camera(s, eye, target, .4);
    stage_finish(s, 1);
    assert_float_equal(landed(s, &bd_integrand_full, camera, 10).mean, 0, 0);
    stage_destroy(&s);
}

static void a_default_rig_yields(void **state)
{
    (void)state;
    for (int shines = 0; shines < 2; shines++) {
        struct stage *s = stage_create();
        const int32_t floor = stage_material(s, .5f);
        if (shines) stage_emission(s, floor, 1);
        stage_floor(s, floor, 2, 0, 1);
        stage_floor(s, smooth(s, 1, 0), 2, 2, -1);
        stage_finish(s, 1);
        assert_true(s->scene->placed_light_count > 0);
        assert_int_equal(bd_reference_has_light_paths(s->reference, &bd_integrand_full), !shines);
        stage_destroy(&s);
    }
}

// Parts in any order, of a region or of all.
static void order_and_region_do_not_show(void **state)
{
    (void)state;
    const double eye[3] = {.1, .5, .1}, target[3] = {0, 0, 0};
    const uint32_t whole[4] = {0, 0, SIDE_PX, SIDE_PX}, part[4] = {2, 3, 5, 4};
    const uint64_t paths = 2 * 64 * SIDE_PX * SIDE_PX;
    struct stage *s = stage_create();
    stage_floor(s, stage_material(s, .5f), 20, 0, 1);
    add_slab(s, smooth(s, 0, 1), 9, .8, 1);
    stage_light(s, BD_LIGHT_POINT, 0, 2, 0, NULL, 1);
    const struct bd_reference_view view = {SIDE_PX, SIDE_PX, stage_camera(s, eye, target, 1), {0}};
    struct bd_film *one = film_of(s, &bd_integrand_full, &view, whole);
    struct bd_film *other = film_of(s, &bd_integrand_full, &view, part);
    double sum = 0;
    bd_film_trace(one, 3, 0, 0, (uint32_t)paths);
    for (uint64_t first = paths; first > 0; first -= paths / 4)
        bd_film_trace(other, 3, 0, first - paths / 4, (uint32_t)paths / 4);
    for (uint32_t y = part[1]; y < part[1] + part[3]; y++)
        for (uint32_t x = part[0]; x < part[0] + part[2]; x++) {
            struct bd_reference_pixel a = {0}, b = {0};
            bd_film_take(one, x, y, &a);
            bd_film_take(other, x, y, &b);
            assert_memory_equal(&a, &b, sizeof a);
            sum += a.landed[0][0];
        }
    assert_true(sum > 0);
    bd_film_destroy(&one);
    bd_film_destroy(&other);
    stage_destroy(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_mirror_shows_another),
        cmocka_unit_test(a_slab_lets_through_what_fresnel_says),
        cmocka_unit_test(panes_let_through_what_fresnel_says),
        cmocka_unit_test(what_panes_let_through_is_told_once),
        cmocka_unit_test(a_caustic_sends_light_on),
        cmocka_unit_test(light_within_a_solid),
        cmocka_unit_test(what_is_trapped_ends),
        cmocka_unit_test(a_default_rig_yields),
        cmocka_unit_test(order_and_region_do_not_show),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
