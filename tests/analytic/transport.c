// Light transport against closed forms: oracles D3, D4, D6 and D8 of algorithms.md.

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "world.h"

static const double down[3] = {0, -1, 0}, up[3] = {0, 1, 0}, origin[3] = {0, 0, 0};
static const double floor_up[3] = {0, 0, 1};

// --- D4: direct light of a point light over a floor ------------------------------------------

static void point_light_over_a_floor(void **state)
{
    struct world *w = *state;
    world_clear(w);
    int32_t white = world_add_material(w, 0.5f);
    const double floor[4][3] = {{-4, 0, 4}, {4, 0, 4}, {4, 0, -4}, {-4, 0, -4}};
    world_add_quad(w, white, floor, 1);
    const double above[3] = {0, 1, 0};
    world_add_light(w, BD_LIGHT_POINT, above, down, 1); // Phi = 4 pi
    const double distances[] = {0, 1, 2}, expected[] = {1, 0.353553, 0.089443};
    for (int i = 0; i < 3; i++) {
        const double at[3] = {distances[i], 0, 0};
        world_add_probe(w, at, up, 1e-3);
    }
    const char *lambert[] = {"brdf=lambert", NULL};
    for (uint32_t i = 0; i < 3; i++) {
        double e = world_probe(w, "direct", i, BD_LAYER_DIRECT, lambert) * M_PI / 0.5;
        ASSERT_REL(e, expected[i], 1e-3);
    }
}

// --- D4: the floor's bounce on a ceiling ------------------------------------------------------

static double psi(double w, double b)
{
    return -1 / (pow(b, 4) * w) - atan(w / b) / pow(b, 5) -
           (atan(w / b) / (2 * pow(b, 3)) + w / (2 * b * b * (w * w + b * b))) / (b * b);
}

static void floor_bounce_on_a_ceiling(void **state)
{
    struct world *w = *state;
    world_clear(w);
    int32_t white = world_add_material(w, 0.5f), black = world_add_material(w, 0.5f);
    // A floor disc of radius D, a fan of triangles; the ceiling looks down at H.
    enum { SECTORS = 256 };
    const double D = 3, H = 1, h = 0.5;
    float positions[3 * (SECTORS + 1)] = {0}, normals[3 * (SECTORS + 1)];
    uint32_t indices[3 * SECTORS];
    for (int i = 0; i <= SECTORS; i++) {
        normals[3 * i] = normals[3 * i + 2] = 0;
        normals[3 * i + 1] = 1;
        if (i == SECTORS) break;
        positions[3 * i + 3] = (float)(D * cos(2 * M_PI * i / SECTORS));
        positions[3 * i + 5] = (float)(-D * sin(2 * M_PI * i / SECTORS));
        indices[3 * i] = 0;
        indices[3 * i + 1] = 1 + (uint32_t)i;
        indices[3 * i + 2] = 1 + (uint32_t)(i + 1) % SECTORS;
    }
    world_add_mesh(w, white, positions, normals, SECTORS + 1, indices, 3 * SECTORS);
    const double ceiling[4][3] = {{-.1, H, -.1}, {.1, H, -.1}, {.1, H, .1}, {-.1, H, .1}};
    world_add_quad(w, black, ceiling, 1);
    const double lamp[3] = {0, h, 0}, at[3] = {0, H, 0};
    world_add_light(w, BD_LIGHT_POINT, lamp, down, 1);
    world_add_probe(w, at, down, 1e-3);
    const char *settings[] = {"brdf=lambert", "vpls=24576", NULL};
    double e = world_probe(w, "rsm", 0, BD_LAYER_INDIRECT, settings) * M_PI / 0.5;
    double a = h / H, b = sqrt(1 - a * a);
    double m = 2 * a * (psi(sqrt(a * a + D * D / (H * H)), b) - psi(a, b));
    // rho Phi / (4 pi H^2) M, for Phi = 4 pi.
    ASSERT_REL(e, 0.5 * m, 5e-3);
}

// --- D6: directional light on a wall ----------------------------------------------------------

// A wall of height 1 at x = 0 looking along +x, wide enough to be infinite; a strip of floor.
static void make_wall(struct world *w, const double *distances, uint32_t count)
{
    world_clear(w);
    int32_t white = world_add_material(w, 0.5f), black = world_add_material(w, 0.5f);
    const double wall[4][3] = {{0, 0, 10}, {0, 0, -10}, {0, 1, -10}, {0, 1, 10}};
    const double floor[4][3] = {{0.001, 0, .5}, {2, 0, .5}, {2, 0, -.5}, {0.001, 0, -.5}};
    world_add_quad(w, white, wall, 1);
    world_add_quad(w, black, floor, 1);
    const double along[3] = {-1, 0, 0};
    world_add_light(w, BD_LIGHT_DIRECTIONAL, origin, along, 1);
    for (uint32_t i = 0; i < count; i++) {
        const double at[3] = {distances[i], 0, 0};
        world_add_probe(w, at, up, 1e-3);
    }
}

static void directional_light_on_a_wall(void **state)
{
    struct world *w = *state;
    const double distances[] = {0.25, 0.5, 1};
    const char *settings[] = {"brdf=lambert", "vpls=1048576", "rsm_size=1024", NULL};
    make_wall(w, distances, 3);
    for (uint32_t i = 0; i < 3; i++) {
        double d = distances[i];
        double e = world_probe(w, "rsm", i, BD_LAYER_INDIRECT, settings) * M_PI / 0.5;
        ASSERT_REL(e, 0.5 * 0.5 * (1 - d / sqrt(1 + d * d)), 0.01);
    }
}

// The same at default parameters: the light's frame is twenty times as wide as the wall is high,
// and so are the patches of its 32 x 32 VPLs. As disks of their area they would lose a fifth.
static void long_patches_near_a_wall(void **state)
{
    struct world *w = *state;
    const char *settings[] = {"brdf=lambert", NULL};
    const double distances[] = {0.1, 0.2, 0.3, 0.5};
    make_wall(w, distances, 4);
    for (uint32_t i = 0; i < 4; i++) {
        double d = distances[i];
        double e = world_probe(w, "rsm", i, BD_LAYER_INDIRECT, settings) * M_PI / 0.5;
        ASSERT_REL(e, 0.5 * 0.5 * (1 - d / sqrt(1 + d * d)), 0.01);
    }
}

// --- D8: the cube room ------------------------------------------------------------------------

static void make_cube_room(struct world *w, const double points[][2], uint32_t count)
{
    world_clear(w);
    int32_t grey = world_add_material(w, 0.5f);
    world_add_box_room(w, grey, origin, 1);
    world_add_light(w, BD_LIGHT_POINT, origin, down, 1);
    for (uint32_t i = 0; i < count; i++) {
        const double at[3] = {points[i][0], points[i][1], -1};
        world_add_probe(w, at, floor_up, 1e-4);
    }
}

static double first_bounce(struct world *w, uint32_t camera, const char *const *settings)
{
    // E_1 / rho from radiance: L = rho / pi E, and E carries rho once more.
    return world_probe(w, "rsm", camera, BD_LAYER_INDIRECT, settings) * M_PI / (0.5 * 0.5);
}

static void cube_room_first_bounce(void **state)
{
    const double points[][2] = {{0, 0}, {.5, 0}, {.5, .5}};
    const double expected[] = {.590616, .579682, .552789};
    make_cube_room(*state, points, 3);
    const char *fine[] = {"brdf=lambert", "vpls=24576", NULL};  // 64 x 64 a face
    const char *coarse[] = {"brdf=lambert", "vpls=1536", NULL}; // 16 x 16
    for (uint32_t i = 0; i < 3; i++) {
        ASSERT_REL(first_bounce(*state, i, fine), expected[i], 5e-4);
        ASSERT_REL(first_bounce(*state, i, coarse), expected[i], 5e-3);
    }
}

static void cube_room_near_the_walls(void **state)
{
    const double points[][2] = {{.9, 0}, {.9, .9}, {.99, 0}, {.99, .99}};
    const double expected[] = {.51747, .36914, .46351, .29160}, tolerance[] = {.01, .01, .05, .05};
    make_cube_room(*state, points, 4);
    const char *fine[] = {"brdf=lambert", "vpls=24576", NULL};
    for (uint32_t i = 0; i < 4; i++)
        ASSERT_REL(first_bounce(*state, i, fine), expected[i], tolerance[i]);
}

// One patch a wall: its mean radiosity from all of it, and the walls around close the hemisphere,
// so that every point gets the mean of E_d, pi / 6. Whatever the map's size, all of it is read.
static void cube_room_with_a_vpl_a_wall(void **state)
{
    const double points[][2] = {{0, 0}, {.3, -.7}};
    const char *const sizes[] = {"rsm_size=64", "rsm_size=256", "rsm_size=1024", "rsm_size=2048"};
    make_cube_room(*state, points, 2);
    for (int s = 0; s < 4; s++) {
        const char *settings[] = {"brdf=lambert", "vpls=6", sizes[s], NULL};
        for (uint32_t i = 0; i < 2; i++)
            ASSERT_REL(first_bounce(*state, i, settings), M_PI / 6, 1e-3);
        const struct bd_report *report = &((struct world *)*state)->report;
        assert_int_equal(report->counts.vpls, 6);
        uint32_t reduced = 0;
        for (uint32_t f = 0; f < report->flag_count; f++)
            reduced += strncmp(report->flags[f], "rsm_size_reduced", 16) == 0;
        assert_int_equal(reduced, s < 3 ? 0 : 1);
    }
}

// The lamp in many parts, one of them with half of its power: all together have the budget's
// virtual lights, and light the room as one lamp does. Of two parts each has its own.
static void many_lamps_share_a_budget(void **state)
{
    const double centre[][2] = {{0, 0}};
    const uint32_t lamps[] = {2, 36};
    const double vpls[] = {2 * 1536, 4 * 1536};
    for (int k = 0; k < 2; k++) {
        struct world *w = *state;
        make_cube_room(w, centre, 1);
        w->scene->lights[0].intensity = .5f;
        for (uint32_t i = 1; i < lamps[k]; i++)
            world_add_light(w, BD_LIGHT_POINT, origin, down, .5f / (float)(lamps[k] - 1));
        const char *shared[] = {"brdf=lambert", "vpls=1536", "lamps=maps", NULL};
        ASSERT_REL(first_bounce(w, 0, shared), .590616, 2e-2);
        ASSERT_REL((double)w->report.counts.vpls, vpls[k], .2);
    }
    const char *of_each[] = {"brdf=lambert", "vpls=96", "vpl_budget=4000", "lamps=maps", NULL};
    ASSERT_REL(first_bounce(*state, 0, of_each), .590616, 3e-2);
    assert_int_equal(((struct world *)*state)->report.counts.vpls, 36 * 96);
}

static void cube_room_direct(void **state)
{
    const double points[][2] = {{0, 0}, {.5, 0}, {.5, .5}};
    make_cube_room(*state, points, 3);
    for (uint32_t i = 0; i < 3; i++) {
        double u = points[i][0], v = points[i][1];
        const char *lambert[] = {"brdf=lambert", NULL};
        double e = world_probe(*state, "direct", i, BD_LAYER_DIRECT, lambert) * M_PI / 0.5;
        ASSERT_REL(e, pow(1 + u * u + v * v, -1.5), 1e-3);
    }
}

// What a technique leaves out by design at its defaults is asked for.
static const char *const *settings_of(const char *technique)
{
    // It has fewer virtual lights than the others, for the sake of time.
    static const char *const as_many[] = {"vpls=1024", NULL};
    // They have all reflections, of all that surfaces send on, and by default the noise of few
    // rays.
    static const char *const first[] = {"indirect_bounces=1", "vpls=8192",    "rays=128",
                                        "far_rays=64",        "brdf=lambert", NULL};
    static const char *const dense[] = {"indirect_bounces=1", "photons=262144",
                                        "photon_radius=0.25", "brdf=lambert", NULL};
    static const char *const sharp[] = {"indirect_bounces=1", "exploit=16384", "microbuffer=64",
                                        "brdf=lambert", NULL};
    if (strcmp(technique, "photon") == 0) return dense;
    if (strcmp(technique, "point_projection") == 0) return sharp;
    if (strcmp(technique, "many_light") == 0 || strcmp(technique, "ssbc") == 0) return first;
    return strcmp(technique, "rsm_splat") == 0 ? as_many : NULL;
}

#define SIDE_PX   160 // more than the coarsest blocks by default: fragments of several sizes
#define CENTRE_PX 80  // off the middle by half a pixel
#define OFF_PX    131 // pixels of 1/103 m: .5 m from the middle

// Whoever is in the registry, at what a user gets who sets nothing.
static void cube_room_by_every_technique(void **state)
{
    const double points[][2] = {{0, 0}}, expected[] = {.590616, .579682, .552789};
    const uint32_t pixels[][2] = {{CENTRE_PX, CENTRE_PX}, {OFF_PX, CENTRE_PX}, {OFF_PX, OFF_PX}};
    struct world *world = *state;
    struct bd_image *layers[BD_LAYER_COUNT];
    uint32_t tried = 0;
    make_cube_room(world, points, 0);
    world_add_probe(world, (const double[3]){0, 0, -1}, floor_up, SIDE_PX / 103.0);
    const struct bd_technique *technique;
    for (uint32_t t = 0; (technique = bd_technique_at(t)); t++) {
        if (!technique->indirect) continue;
        world_render(world, technique->name, 0, SIDE_PX, SIDE_PX, 1u << BD_LAYER_INDIRECT,
                     settings_of(technique->name), layers);
        printf("%s\n", technique->name);
        if (technique->inputs & BD_INPUT_FRAGMENTS)
            assert_true(world->report.counts.fragments < SIDE_PX * SIDE_PX / 4);
        for (uint32_t i = 0; i < 3; i++) {
            float l = bd_image_at(layers[BD_LAYER_INDIRECT], pixels[i][0], pixels[i][1])[0];
            ASSERT_REL(l * M_PI / (0.5 * 0.5), expected[i],
                       technique->inputs & BD_INPUT_PHOTONS ? .02 : .01); // D9: 1,100 photons
        }
        world_free_layers(layers);
        tried++;
    }
    assert_true(tried >= 6);
}

// --- D3: the integrating sphere ---------------------------------------------------------------

#define SPHERE_RADIUS 2.0
#define SPHERE_SIDE   64 // pixels

static const double sphere_target[3] = {1, 0.7, 0.4};

static void make_sphere(struct world *w, uint32_t subdivisions)
{
    world_clear(w);
    int32_t grey = world_add_material(w, 0.5f);
    world_add_sphere_room(w, grey, SPHERE_RADIUS, subdivisions);
    world_add_light(w, BD_LIGHT_POINT, origin, down, 1);
    world_add_camera(w, origin, sphere_target, M_PI / 2);
}

// Relative errors of the picture's irradiance against one bounce of the sphere, a pixel each.
static void sphere_errors(struct world *w, const char *const *settings, double *errors)
{
    // E_d = Phi / (4 pi R^2) with Phi = 4 pi cd; the first bounce is rho times that everywhere.
    double expected = 0.5 / (SPHERE_RADIUS * SPHERE_RADIUS) * 0.5 / M_PI;
    struct bd_image *layers[BD_LAYER_COUNT];
    world_render(w, "rsm", 0, SPHERE_SIDE, SPHERE_SIDE, 1u << BD_LAYER_INDIRECT, settings, layers);
    for (int i = 0; i < SPHERE_SIDE * SPHERE_SIDE; i++)
        errors[i] = layers[BD_LAYER_INDIRECT]->pixels[3 * i] / expected - 1;
    world_free_layers(layers);
}

// Direction from the centre through a pixel of the camera.
static bd_dvec3 pixel_direction(int x, int y)
{
    bd_dvec3 z = bd_dvec3_normalize(
        (bd_dvec3){-sphere_target[0], -sphere_target[1], -sphere_target[2]}, (bd_dvec3){0, 0, 1});
    bd_dvec3 right = bd_dvec3_normalize(bd_dvec3_cross((bd_dvec3){0, 1, 0}, z), z);
    bd_dvec3 top = bd_dvec3_cross(z, right);
    double u = 2 * (x + 0.5) / SPHERE_SIDE - 1, v = 1 - 2 * (y + 0.5) / SPHERE_SIDE;
    bd_dvec3 d = bd_dvec3_add(bd_dvec3_scale(right, u), bd_dvec3_scale(top, v));
    return bd_dvec3_normalize(bd_dvec3_sub(d, z), z);
}

// Distance on the unit sphere to the nearest VPL of a grid of side k over the faces of a cube
// about the centre: the light's frame is a rotation by right angles here.
static double nearest_vpl(bd_dvec3 d, int k)
{
    double a[3] = {fabs(d.x), fabs(d.y), fabs(d.z)}, c[3] = {d.x, d.y, d.z}, nearest = 2;
    for (int axis = 0; axis < 3; axis++) {
        if (a[axis] < 0.5) continue; // the VPLs of that face are farther than those of another
        double u = c[(axis + 1) % 3] / a[axis], v = c[(axis + 2) % 3] / a[axis];
        double cu = (fmin(fmax(floor((u + 1) * k / 2), 0), k - 1) + 0.5) * 2 / k - 1;
        double cv = (fmin(fmax(floor((v + 1) * k / 2), 0), k - 1) + 0.5) * 2 / k - 1;
        double scale = 1 / sqrt(1 + cu * cu + cv * cv), p[3];
        p[axis] = c[axis] < 0 ? -scale : scale;
        p[(axis + 1) % 3] = cu * scale;
        p[(axis + 2) % 3] = cv * scale;
        nearest =
            fmin(nearest, sqrt(pow(p[0] - c[0], 2) + pow(p[1] - c[1], 2) + pow(p[2] - c[2], 2)));
    }
    return nearest;
}

// On a true sphere every set of VPLs gives the same irradiance everywhere. On one of flat
// triangles that holds where the triangles' depth under the sphere (1.4e-5 R here) is small
// against the height of the receiver over the VPL's plane, d^2 / 2R: nearer than 0.04 R, a
// single VPL of the N may be off by a few times its own share.
static void sphere_with_the_bare_kernel(void **state)
{
    static double errors[SPHERE_SIDE * SPHERE_SIDE];
    make_sphere(*state, 7); // 327,680 triangles
    const int sides[] = {6, 7, 13, 26, 64};
    for (size_t k = 0; k < sizeof sides / sizeof sides[0]; k++) {
        char vpls[32];
        snprintf(vpls, sizeof vpls, "vpls=%d", 6 * sides[k] * sides[k]);
        const char *settings[] = {"brdf=lambert", vpls, "vpl_kernel=point", NULL};
        sphere_errors(*state, settings, errors);
        double far = 0, near = 0, share = 1.0 / (6 * sides[k] * sides[k]);
        int near_count = 0;
        for (int i = 0; i < SPHERE_SIDE * SPHERE_SIDE; i++) {
            double d = nearest_vpl(pixel_direction(i % SPHERE_SIDE, i / SPHERE_SIDE), sides[k]);
            near_count += d < 0.04;
            if (d < 0.04)
                near = fmax(near, fabs(errors[i]));
            else
                far = fmax(far, fabs(errors[i]));
        }
        print_message("    bare kernel, N = %d: worst %.1e, and %.1e = %.2f / N in the %d pixels "
                      "beside a VPL\n",
                      6 * sides[k] * sides[k], far, near, near / share, near_count);
        assert_true(far <= 1e-4);
        assert_true(near <= 1e-4 + 3 * share);
    }
}

static void sphere_with_the_disk_kernel(void **state)
{
    static double errors[SPHERE_SIDE * SPHERE_SIDE];
    make_sphere(*state, 6); // 81,920 triangles
    const uint32_t counts[] = {256, 1024, 4096};
    for (int k = 0; k < 3; k++) {
        char vpls[32];
        snprintf(vpls, sizeof vpls, "vpls=%u", counts[k]);
        const char *settings[] = {"brdf=lambert", vpls, "vpl_kernel=disk", NULL};
        sphere_errors(*state, settings, errors);
        double mean = 0, worst = 0;
        for (int i = 0; i < SPHERE_SIDE * SPHERE_SIDE; i++) {
            mean += errors[i] / (SPHERE_SIDE * SPHERE_SIDE);
            worst = fmax(worst, fabs(errors[i]));
        }
        double n = (double)((struct world *)*state)->report.counts.vpls;
        double expected = -log(1 + n) / n;
        print_message("    disk kernel, N = %.0f: mean %+.5f, expected %+.5f, worst %.5f\n", n,
                      mean, expected, worst);
        assert_true(fabs(mean / expected - 1) <= 0.2);
        assert_true(worst <= -2 * expected);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(point_light_over_a_floor),
        cmocka_unit_test(floor_bounce_on_a_ceiling),
        cmocka_unit_test(directional_light_on_a_wall),
        cmocka_unit_test(long_patches_near_a_wall),
        cmocka_unit_test(cube_room_direct),
        cmocka_unit_test(cube_room_first_bounce),
        cmocka_unit_test(cube_room_near_the_walls),
        cmocka_unit_test(cube_room_by_every_technique),
        cmocka_unit_test(cube_room_with_a_vpl_a_wall),
        cmocka_unit_test(many_lamps_share_a_budget),
        cmocka_unit_test(sphere_with_the_bare_kernel),
        cmocka_unit_test(sphere_with_the_disk_kernel),
    };
    return cmocka_run_group_tests(tests, world_open, world_close);
}
