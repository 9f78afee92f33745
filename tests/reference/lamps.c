// Punctual lights with a radius (reference/lamp.c): what they give straight, in mirrors and through
// glass, against closed forms, and all of it against spheres that shine.

#include <math.h>
#include <stddef.h>

#include "stage.h"
#include "tests/unit/cmocka_all.h"

static const double pi = 3.14159265358979323846;

static struct bd_integrand with_radius(double radius_m)
{
    struct bd_integrand integrand = bd_integrand_full;
    integrand.lamp_radius_m = radius_m;
    return integrand;
}

static int32_t mirror(struct stage *s)
{
    const int32_t material = stage_material(s, 1);
    stage_material_at(s, material)->metallic = 1;
    stage_material_at(s, material)->roughness = 0;
    return material;
}

static int32_t glass(struct stage *s)
{
    const int32_t material = stage_material(s, 1);
    struct bd_material *m = stage_material_at(s, material);
    m->roughness = 0;
    m->transmission = 1;
    m->thickness_m = 1;
    m->attenuation_distance_m = INFINITY;
    m->double_sided = false;
    return material;
}

// A box of six quads whose fronts are outside.
static void add_solid(struct stage *s, int32_t material, const double low[3], const double high[3])
{
    for (int axis = 0; axis < 3; axis++)
        for (int side = 0; side < 2; side++) {
            const int u = (axis + 1) % 3, v = (axis + 2) % 3;
            double corners[4][3];
            for (int i = 0; i < 4; i++) {
                const bool right = i == 1 || i == 2, top = i >= 2;
                corners[i][axis] = side ? high[axis] : low[axis];
                corners[i][u] = (side ? right : top) ? high[u] : low[u];
                corners[i][v] = (side ? top : right) ? high[v] : low[v];
            }
            stage_quad(s, material, (const double(*)[3])corners);
        }
}

// A sphere that is seen whole gives what its middle would, however large it is.
static void it_gives_what_a_point_gives(void **state)
{
    (void)state;
    const double radii[] = {1e-20, 1e-7, .01, .3, .9};
    for (size_t r = 0; r < sizeof radii / sizeof *radii; r++)
        for (int x = 0; x < 2; x++) {
            struct stage *s = stage_create();
            stage_floor(s, stage_material(s, .5f), 1, -5, 1); // Embree wants something
            stage_light(s, BD_LIGHT_POINT, 0, 2, 0, NULL, 3);
            const struct bd_integrand direct = with_radius(radii[r]);
            const double d2 = 4 + x * x;
            CHECK(stage_irradiance(s, &direct, BD_PART_DIRECT, x, 0, 0, 0, 1, 0, 16384),
                  3 * 2 / (d2 * sqrt(d2)), 1e-3);
            stage_destroy(&s);
        }
    struct stage *s = stage_create();
    const double down[3] = {.6, -.8, 0};
    stage_floor(s, stage_material(s, .5f), 1, -5, 1);
    stage_light(s, BD_LIGHT_DIRECTIONAL, 0, 2, 0, down, 3);
    const struct bd_integrand direct = with_radius(.3);
    CHECK(stage_irradiance(s, &direct, BD_PART_DIRECT, 0, 0, 0, 0, 1, 0, 65536), 3 * .8, 1e-3);
    stage_destroy(&s);
}

// A roof hides the sky's lamp and one that is above it, whichever way they are looked for.
static void what_is_behind_is_hidden(void **state)
{
    (void)state;
    for (int kind = 0; kind < 2; kind++) {
        const double down[3] = {0, -1, 0};
        struct stage *s = stage_create();
        stage_floor(s, stage_material(s, 0), 50, 1, -1);
        stage_light(s, kind ? BD_LIGHT_POINT : BD_LIGHT_DIRECTIONAL, 0, 2, 0, down, 3);
        const struct bd_integrand full = with_radius(.8);
        CHECK(stage_irradiance(s, &full, BD_PART_COUNT, 0, 0, 0, 0, 1, 0, 4096), 0, 0);
        stage_destroy(&s);
    }
}

// D10: a mirror shows a second lamp behind it, which no point finds.
static void a_mirror_shows_another(void **state)
{
    (void)state;
    const double wall[4][3] = {{-1, -9, 9}, {-1, -9, -9}, {-1, 9, -9}, {-1, 9, 9}};
    struct stage *s = stage_create();
    stage_quad(s, mirror(s), wall);
    stage_light(s, BD_LIGHT_POINT, 0, 1, 0, NULL, 1);
    const struct bd_integrand full = with_radius(.4), point = with_radius(0);
    CHECK(stage_irradiance(s, &full, BD_PART_INDIRECT, 0, 0, 0, 0, 1, 0, 1 << 20),
          1 / (5 * sqrt(5)), 2e-3);
    CHECK(stage_irradiance(s, &point, BD_PART_INDIRECT, 0, 0, 0, 0, 1, 0, 1024), 0, 0);
    stage_destroy(&s);
}

// Who looks at a lamp, or at a mirror that shows it, sees none.
static void nobody_sees_it(void **state)
{
    (void)state;
    const double wall[4][3] = {{-1, -9, 9}, {-1, -9, -9}, {-1, 9, -9}, {-1, 9, 9}};
    const double eye[3] = {0, 0, 0}, lamp[3] = {0, 1, .01}, second[3] = {-2, 1, 0};
    struct stage *s = stage_create();
    stage_quad(s, mirror(s), wall);
    stage_light(s, BD_LIGHT_POINT, lamp[0], lamp[1], lamp[2], NULL, 1);
    const uint32_t cameras[2] = {stage_camera(s, eye, lamp, .3), stage_camera(s, eye, second, .3)};
    const struct bd_integrand full = with_radius(.4);
    for (int c = 0; c < 2; c++)
        CHECK(stage_radiance(s, &full, cameras[c], BD_PART_COUNT, 8, 64), 0, 0);
    stage_destroy(&s);
}

// What comes straight down through a slab of glass, with what is reflected in it.
#define SLAB_M   .4
#define LAMP_M   2.0 // above the receiver
#define RADIUS_M .3

static double through_slab(double intensity)
{
    const int steps = 20000;
    const double most = .5;
    double sum = 0;
    for (int i = 0; i < steps; i++) {
        const double angle = (i + .5) / steps * most, inside = asin(sin(angle) / 1.5);
        const double fresnel = .04 + .96 * pow(1 - cos(angle), 5);
        for (int order = 0; order < 3; order++) {
            const double off =
                (LAMP_M - SLAB_M) * tan(angle) + (1 + 2 * order) * SLAB_M * tan(inside);
            const double passes = pow(1 - fresnel, 2) * pow(fresnel, 2 * order);
            if (off * cos(angle) < RADIUS_M)
                sum += passes * 2 * pi * sin(angle) * cos(angle) * most / steps;
        }
    }
    return sum * intensity / (pi * RADIUS_M * RADIUS_M);
}

static void a_slab_lets_through_what_fresnel_says(void **state)
{
    (void)state;
    const double low[3] = {-9, .8, -9}, high[3] = {9, .8 + SLAB_M, 9};
    struct stage *s = stage_create();
    add_solid(s, glass(s), low, high);
    stage_light(s, BD_LIGHT_POINT, 0, LAMP_M, 0, NULL, 1);
    const struct bd_integrand full = with_radius(RADIUS_M);
    CHECK(stage_irradiance(s, &full, BD_PART_COUNT, 0, 0, 0, 0, 1, 0, 1 << 18), through_slab(1),
          2e-3);
    stage_destroy(&s);
}

// A floor, a mirror, and a block of glass, under a lamp or a sphere that shines as much.
static struct stage *mixed(bool lamp, double radius_m)
{
    const double wall[4][3] = {{-1, 0, 1}, {-1, 0, -1}, {-1, 2, -1}, {-1, 2, 1}};
    const double low[3] = {.1, .2, -.3}, high[3] = {.7, .6, .3}, at[3] = {0, 1.5, 0};
    struct stage *s = stage_create();
    stage_floor(s, stage_material(s, .6f), 1, 0, 1);
    stage_quad(s, mirror(s), wall);
    add_solid(s, glass(s), low, high);
    const int32_t black = stage_material(s, 0);
    if (lamp) {
        stage_light(s, BD_LIGHT_POINT, at[0], at[1], at[2], NULL, 1);
    } else {
        stage_emission(s, black, (float)(1 / (pi * radius_m * radius_m)));
        stage_sphere(s, black, at, radius_m, 5, false);
    }
    return s;
}

// Straight and on all ways, where both shine from everywhere, and hide nothing that matters.
static void it_shines_as_a_sphere_does(void **state)
{
    (void)state;
    const double radius_m = .2, places[3][2] = {{.4, 0}, {-.6, .3}, {0, -.5}};
    for (int i = 0; i < 3; i++) {
        struct stage *of_lamp = mixed(true, radius_m), *of_sphere = mixed(false, radius_m);
        struct bd_integrand by_lamp = with_radius(radius_m), by_sphere = with_radius(0);
        const double x = places[i][0], z = places[i][1];
        by_lamp.lights = BD_REFERENCE_PUNCTUAL;
        by_sphere.lights = BD_REFERENCE_EMISSIVE;
        const struct estimate lamp =
            stage_irradiance(of_lamp, &by_lamp, BD_PART_COUNT, x, .001, z, 0, 1, 0, 1 << 18);
        const struct estimate sphere =
            stage_irradiance(of_sphere, &by_sphere, BD_PART_COUNT, x, .001, z, 0, 1, 0, 1 << 18);
        CHECK_SAME(lamp, sphere, .01);
        stage_destroy(&of_lamp);
        stage_destroy(&of_sphere);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(it_gives_what_a_point_gives),
        cmocka_unit_test(what_is_behind_is_hidden),
        cmocka_unit_test(a_mirror_shows_another),
        cmocka_unit_test(nobody_sees_it),
        cmocka_unit_test(a_slab_lets_through_what_fresnel_says),
        cmocka_unit_test(it_shines_as_a_sphere_does),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
