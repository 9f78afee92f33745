// Input that breaks renderers, each with a known answer: hazards 2, 6, 9, 22, 23, 24, 25, 27, 29,
// 37, 59 and 61 of algorithms.md.

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "pass/vpl_grid.h"
#include "shared/types.h"
#include "shared/vpl.h"
#include "view.h"

#define SIDE 65 // odd: one pixel is the centre

static const double down[3] = {0, -1, 0}, up[3] = {0, 1, 0}, origin[3] = {0, 0, 0};
static const char *const lambert[] = {"brdf=lambert", NULL};

static void add_floor(struct world *w, int32_t material, double half, double height)
{
    const double corners[4][3] = {
        {-half, height, half}, {half, height, half}, {half, height, -half}, {-half, height, -half}};
    world_add_quad(w, material, corners, 1);
}

// One layer of a square picture of `side` pixels; the caller destroys it.
static struct bd_image *picture(struct world *w, const char *technique, uint32_t camera,
                                uint32_t side, enum bd_layer layer, const char *const *settings)
{
    struct bd_image *layers[BD_LAYER_COUNT];
    world_render(w, technique, camera, side, side, 1u << layer, settings, layers);
    struct bd_image *image = layers[layer];
    layers[layer] = NULL;
    world_free_layers(layers);
    return image;
}

static double red(const struct bd_image *image, uint32_t i)
{
    return image->pixels[(size_t)i * image->channel_count];
}

// --- 2: a receiver on a VPL -------------------------------------------------------------------

// A floor and a ramp through each other: the middle column of VPLs stands on their common line, the
// middle column of pixels sees it. With the exact kernel E there is rho E_d times the form factor
// of the other plane, (1 - cos of the angle between them) / 2, and less everywhere else; the disk
// keeps E below the radiosity of what sends it.
static void receivers_on_vpls_stay_finite(void **state)
{
    struct world *w = *state;
    world_clear(w);
    int32_t grey = world_add_material(w, 0.5f);
    add_floor(w, grey, 1, 0);
    const double ramp[4][3] = {{-1, -.4, 1}, {1, .4, 1}, {1, .4, -1}, {-1, -.4, -1}};
    world_add_quad(w, grey, ramp, 1);
    const double lamp[3] = {0, 1, 0}, eye[3] = {0, 2, 0};
    world_add_light(w, BD_LIGHT_POINT, lamp, down, 1);
    world_add_camera(w, eye, origin, 0.9);
    const char *const kernels[] = {"vpl_kernel=point", "vpl_kernel=disk", "vpl_kernel=patch"};
    for (int k = 0; k < 3; k++) {
        const char *settings[] = {"brdf=lambert", "vpls=1350", "rsm_size=255", kernels[k], NULL};
        struct bd_image *image = picture(w, "rsm", 0, SIDE, BD_LAYER_INDIRECT, settings);
        double most = 0;
        for (uint32_t i = 0; i < SIDE * SIDE; i++) {
            assert_true(isfinite(red(image, i)));
            most = fmax(most, red(image, i) * M_PI / 0.5);
        }
        bd_image_destroy(&image);
        const double exact = 0.5 * (1 - 1 / sqrt(1 + .4 * .4)) / 2;
        const double limits[3] = {INFINITY, 0.5, 1.2 * exact};
        print_message("    %s: most E %.4f, exact %.4f\n", kernels[k], most, exact);
        assert_true(most > 0.5 * exact && most <= limits[k]);
    }
}

// --- 6: a light along a surface ----------------------------------------------------------------

// Sum of the areas that the VPLs of the scene's first light stand for, m^2.
static double vpl_area_sum(struct world *w, uint32_t side_px, uint32_t grid_side)
{
    struct bd_err_detail detail = {0};
    struct bd_rsm *rsm;
    struct bd_vpl_list *list;
    struct view view = view_open(w);
    const struct bd_light_setup light = bd_light_setup_of(w->scene, 0);
    const struct bd_rsm_inputs to_rsm = {.scene = view.scene, .light = &light, .side_px = side_px};
    assert_int_equal(bd_rsm_render(&view.context, &to_rsm, &rsm, &detail), BD_ERR_OK);
    const struct bd_vpl_grid_inputs to_vpls = {
        .rsm = rsm, .light = &light, .space = &view.scene->space, .grid_side = grid_side};
    assert_int_equal(bd_vpl_grid_run(&view.context, &to_vpls, &list, &detail), BD_ERR_OK);
    size_t bytes = list->count * BD_VPL_QUAD_VEC4S * sizeof(struct bd_vec4);
    struct bd_vec4 *quads = malloc(bytes);
    assert_int_equal(bd_buf_read(w->gpu, list->quads, 0, quads, bytes), BD_ERR_OK);
    double sum = 0, render_per_m = view.scene->space.render_per_m;
    for (uint32_t i = 0; i < list->count; i++) {
        float per_area = quads[BD_VPL_QUAD_VEC4S * i].w;
        if (per_area > 0) sum += 1 / (per_area * render_per_m * render_per_m);
    }
    free(quads);
    bd_vpl_list_destroy(w->gpu, &list);
    bd_rsm_destroy(w->gpu, &rsm);
    view_close(&view);
    return sum;
}

// What a texel of a map sees at a grazing angle is large, but not larger than what is there.
static void vpls_stand_for_no_more_than_the_plane(void **state)
{
    struct world *w = *state;
    const double heights[] = {1, 0.1, 1e-3};
    for (int k = 0; k < 3; k++) {
        world_clear(w);
        add_floor(w, world_add_material(w, 0.5f), 1, 0);
        const double lamp[3] = {-1, heights[k], 0}, along[3] = {2, -heights[k], 0};
        world_add_light(w, BD_LIGHT_POINT, lamp, along, 1);
        double sum = vpl_area_sum(w, 256, 32);
        print_message("    height %g: %.4f of 4 m^2\n", heights[k], sum);
        assert_true(sum <= 4 * 1.01);
        if (k == 0) ASSERT_REL(sum, 4, 0.01); // all of it seen, nowhere at less than 24 degrees
    }
}

// --- 9: two lights far apart in power ---------------------------------------------------------

// A wall parts the floor: one half is lit by 1e9 cd, the other by 1e-6 cd.
static void a_strong_light_drowns_no_weak_one(void **state)
{
    struct world *w = *state;
    double weak_alone = 0;
    for (int with_strong = 0; with_strong < 2; with_strong++) {
        world_clear(w);
        int32_t grey = world_add_material(w, 0.5f);
        add_floor(w, grey, 4, 0);
        const double wall[4][3] = {{0, -1, 5}, {0, -1, -5}, {0, 9, -5}, {0, 9, 5}};
        world_add_quad(w, grey, wall, 1);
        const double left[3] = {-1, 1, 0}, right[3] = {1, 1, 0};
        const double left_floor[3] = {-1.5, 0, 0}, right_floor[3] = {1.5, 0, 0};
        world_add_light(w, BD_LIGHT_POINT, left, down, 1e-6f);
        if (with_strong) world_add_light(w, BD_LIGHT_POINT, right, down, 1e9f);
        world_add_probe(w, left_floor, up, 1e-3);
        world_add_probe(w, right_floor, up, 1e-3);
        double weak = world_probe(w, "direct", 0, BD_LAYER_DIRECT, lambert);
        double strong = world_probe(w, "direct", 1, BD_LAYER_DIRECT, lambert);
        double cosine = 1 / sqrt(1.25), expected = 0.5 / M_PI * cosine / 1.25;
        ASSERT_REL(weak, 1e-6 * expected, 1e-4); // what a normal loses in the G-buffer
        if (with_strong) {
            ASSERT_REL(weak, weak_alone, 1e-6);
            ASSERT_REL(strong, 1e9 * expected, 1e-4);
        }
        weak_alone = weak;
    }
}

// --- 22: light from behind --------------------------------------------------------------------

static void a_quad_lit_from_behind_is_black(void **state)
{
    struct world *w = *state;
    for (int double_sided = 0; double_sided < 2; double_sided++) {
        world_clear(w);
        int32_t grey = world_add_material(w, 0.5f);
        w->scene->materials[grey].double_sided = double_sided;
        add_floor(w, grey, 1, 0);
        const double below[3] = {.2, -.5, .1}, eye[3] = {.3, 1.5, .8};
        world_add_light(w, BD_LIGHT_POINT, below, up, 1);
        world_add_light(w, BD_LIGHT_DIRECTIONAL, origin, up, 1);
        world_add_camera(w, eye, origin, 1.2);
        const char *settings[] = {"vpls=384", NULL};
        struct bd_image *image = picture(w, "rsm", 0, SIDE, BD_LAYER_BEAUTY, settings);
        for (uint32_t i = 0; i < SIDE * SIDE; i++) assert_true(red(image, i) == 0);
        bd_image_destroy(&image);
    }
}

// --- 23: a light inside a closed box ----------------------------------------------------------

static void a_closed_box_leaks_nothing(void **state)
{
    struct world *w = *state;
    const double lamps[][3] = {{0, 1, 0}, {.39, 1.39, .39}, {-.2, .61, .1}, {.399, 1, 0}};
    for (size_t k = 0; k < sizeof lamps / sizeof lamps[0]; k++) {
        world_clear(w);
        int32_t grey = world_add_material(w, 0.5f), black = world_add_material(w, 0);
        const double centre[3] = {0, 1, 0}, eye[3] = {3, 3, 4};
        world_add_box_room(w, black, centre, 0.4);
        add_floor(w, grey, 6, 0);
        world_add_light(w, BD_LIGHT_POINT, lamps[k], down, 1);
        world_add_camera(w, eye, origin, 1.3);
        struct bd_image *image = picture(w, "direct", 0, 2 * SIDE, BD_LAYER_BEAUTY, lambert);
        // The camera looks into the box through its single-sided walls, but it is black inside.
        for (uint32_t i = 0; i < 4 * SIDE * SIDE; i++) assert_true(red(image, i) == 0);
        bd_image_destroy(&image);
    }
}

// --- 24: a light on a surface -----------------------------------------------------------------

// All that goes down lands under the lamp: the floor there is a point source of rho Phi / 2.
static void a_light_on_the_floor_lights_the_ceiling(void **state)
{
    struct world *w = *state;
    const double heights[] = {1e-2, 1e-3, 1e-4};
    for (int k = 0; k < 3; k++) {
        world_clear(w);
        int32_t grey = world_add_material(w, 0.5f);
        add_floor(w, grey, 3, 0);
        const double ceiling[4][3] = {{-.1, 1, -.1}, {.1, 1, -.1}, {.1, 1, .1}, {-.1, 1, .1}};
        world_add_quad(w, grey, ceiling, 1);
        const double lamp[3] = {0, heights[k], 0}, above[3] = {0, 1, 0};
        world_add_light(w, BD_LIGHT_POINT, lamp, down, 1);
        world_add_probe(w, above, down, 1e-3);
        const char *settings[] = {"brdf=lambert", "vpls=24576", NULL};
        double e = world_probe(w, "rsm", 0, BD_LAYER_INDIRECT, settings) * M_PI / 0.5;
        // rho Phi M / (4 pi H^2) with Phi = 4 pi, and M = 2 at the limit.
        double tolerance = 0.01 + 4 * heights[k];
        ASSERT_REL(e, 0.5 * 2, tolerance);
    }
}

// --- 25: a camera in a wall -------------------------------------------------------------------

static void a_camera_in_a_wall_sees_something_finite(void **state)
{
    struct world *w = *state;
    world_clear(w);
    int32_t grey = world_add_material(w, 0.5f);
    world_add_box_room(w, grey, origin, 1);
    const double lamp[3] = {0, .5, 0}, in_wall[3] = {1, 0, 0}, along[3] = {1, 1, 0};
    const double out[3] = {2, 0, 0};
    world_add_light(w, BD_LIGHT_POINT, lamp, down, 1);
    world_add_camera(w, in_wall, along, 1.2); // in the wall's plane, along it
    world_add_camera(w, in_wall, out, 1.2);   // away from the room
    world_add_camera(w, in_wall, origin, 1.2);
    for (uint32_t c = 0; c < 3; c++) {
        const char *settings[] = {"vpls=384", NULL};
        struct bd_image *image = picture(w, "rsm", c, SIDE, BD_LAYER_BEAUTY, settings);
        for (uint32_t i = 0; i < 4 * SIDE * SIDE; i++) assert_true(isfinite(image->pixels[i]));
        assert_true(c != 2 || red(image, SIDE * SIDE / 2) > 0);
        assert_true(c != 1 || red(image, SIDE * SIDE / 2) == 0);
        bd_image_destroy(&image);
    }
}

// --- 27: the smallest picture -----------------------------------------------------------------

static void one_pixel_is_the_centre_of_many(void **state)
{
    struct world *w = *state;
    world_clear(w);
    int32_t grey = world_add_material(w, 0.5f);
    world_add_box_room(w, grey, origin, 1);
    const double lamp[3] = {.3, .5, .2}, eye[3] = {.7, .4, .9}, at[3] = {-.3, -.5, .1};
    world_add_light(w, BD_LIGHT_POINT, lamp, down, 1);
    world_add_camera(w, eye, at, 1.0);
    const char *settings[] = {"vpls=384", NULL};
    struct bd_image *one = picture(w, "rsm", 0, 1, BD_LAYER_BEAUTY, settings);
    struct bd_image *many = picture(w, "rsm", 0, SIDE, BD_LAYER_BEAUTY, settings);
    ASSERT_REL(red(one, 0), red(many, SIDE * SIDE / 2), 1e-5);
    bd_image_destroy(&one);
    bd_image_destroy(&many);
}

// --- 29: near and far -------------------------------------------------------------------------

static void depth_holds_over_seven_orders(void **state)
{
    struct world *w = *state;
    world_clear(w);
    int32_t grey = world_add_material(w, 0.5f);
    const double distances[2] = {1, 1e7};
    for (int k = 0; k < 2; k++) {
        double z = -distances[k], from = k ? -2e7 : 0, to = k ? 2e7 : 2;
        const double plane[4][3] = {{from, -to, z}, {to, -to, z}, {to, to, z}, {from, to, z}};
        world_add_quad(w, grey, plane, 1);
    }
    const double ahead[3] = {0, 0, -1};
    world_add_camera(w, origin, ahead, 1.0);
    w->scene->cameras[0].near_m = 0.5f;
    struct bd_image *depth = picture(w, "direct", 0, 8, BD_LAYER_DEPTH, lambert);
    for (uint32_t i = 0; i < 64; i++) {
        double expected = distances[i % 8 < 4];
        assert_true(fabs(red(depth, i) / expected - 1) <= 1e-6);
    }
    bd_image_destroy(&depth);
}

// --- 37: no acne ------------------------------------------------------------------------------

static void a_lit_plane_has_no_dark_pixel(void **state)
{
    struct world *w = *state;
    const double scales[] = {1e-4, 1, 1e6};
    for (int k = 0; k < 3; k++) {
        double s = scales[k];
        world_clear(w);
        int32_t grey = world_add_material(w, 0.5f);
        const double plane[4][3] = {
            {-s, .1 * s, s}, {s, -.2 * s, s}, {s, .13 * s, -s}, {-s, .43 * s, -s}};
        world_add_quad(w, grey, plane, 7);
        const double lamp[3] = {.1 * s, .9 * s, .2 * s}, eye[3] = {.3 * s, 2 * s, .4 * s};
        const double sun[3] = {.7, -1, .3};
        world_add_light(w, BD_LIGHT_POINT, lamp, down, (float)(s * s));
        world_add_light(w, BD_LIGHT_DIRECTIONAL, origin, sun, 1);
        world_add_camera(w, eye, origin, 0.6);
        w->scene->cameras[0].near_m = (float)(1e-3 * s);
        for (int only = 0; only < 2; only++) {
            w->scene->lights[only].intensity = 0;
            struct bd_image *image = picture(w, "direct", 0, 2 * SIDE, BD_LAYER_DIRECT, lambert);
            for (uint32_t i = 0; i < 4 * SIDE * SIDE; i++) assert_true(red(image, i) > 0);
            bd_image_destroy(&image);
            w->scene->lights[only].intensity = only ? 1 : (float)(s * s);
        }
    }
}

// Where the cosine is over 0.2; the sun makes L = 1 of cosine 1.
static void a_lit_sphere_has_no_dark_pixel(void **state)
{
    struct world *w = *state;
    const double directions[][3] = {{0, 0, -1}, {.6, -.3, -1}};
    for (int k = 0; k < 2; k++) {
        world_clear(w);
        int32_t grey = world_add_material(w, 0.5f);
        w->scene->materials[grey].double_sided = true; // it is a room seen from outside
        world_add_sphere_room(w, grey, 1, 6);          // 81,920 triangles
        const double eye[3] = {0, 0, 4};
        world_add_light(w, BD_LIGHT_DIRECTIONAL, origin, directions[k], (float)(M_PI / 0.5));
        world_add_camera(w, eye, origin, 0.5);
        struct bd_image *layers[BD_LAYER_COUNT];
        world_render(w, "direct", 0, 257, 257, 1u << BD_LAYER_DIRECT | 1u << BD_LAYER_NORMAL,
                     lambert, layers);
        const double *d = directions[k];
        double length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]), worst = 0;
        for (uint32_t i = 0; i < 257 * 257; i++) {
            const float *n = layers[BD_LAYER_NORMAL]->pixels + 3 * i;
            double cosine = -(n[0] * d[0] + n[1] * d[1] + n[2] * d[2]) / length;
            if (cosine < 0.2) continue;
            worst = fmax(worst, fabs(red(layers[BD_LAYER_DIRECT], i) - cosine));
        }
        print_message("    sun %d: worst |L - cos| %.2e\n", k, worst);
        assert_true(worst <= 1e-4);
        world_free_layers(layers);
    }
}

// --- 59: edges on the seams of a light's faces ------------------------------------------------

// From the centre of a cube the edges of the room are the edges between the light's faces.
static void a_cube_room_shows_no_seam(void **state)
{
    struct world *w = *state;
    world_clear(w);
    int32_t grey = world_add_material(w, 0.5f);
    world_add_box_room(w, grey, origin, 1);
    const double ahead[3] = {0, 0, -1};
    world_add_light(w, BD_LIGHT_POINT, origin, ahead, 1);
    const double eyes[3][3] = {{.2, .1, .3}, {-.4, .6, .1}, {.5, -.3, -.6}};
    const double corners[3][3] = {{1, 1, 1}, {-1, -1, 1}, {1, -1, -1}};
    for (int c = 0; c < 3; c++) world_add_camera(w, eyes[c], corners[c], 1.6);
    for (uint32_t c = 0; c < 3; c++) {
        struct bd_image *layers[BD_LAYER_COUNT];
        world_render(w, "direct", c, 257, 257, 1u << BD_LAYER_DIRECT | 1u << BD_LAYER_NORMAL,
                     lambert, layers);
        // On every wall E = 1 / (1 + u^2 + v^2)^1.5: from 1 down to 1 / 3^1.5 in the corners.
        for (uint32_t i = 0; i < 257 * 257; i++) {
            double e = red(layers[BD_LAYER_DIRECT], i) * M_PI / 0.5;
            assert_true(e >= 0.999 * pow(3, -1.5) && e <= 1.001);
        }
        world_free_layers(layers);
    }
}

// --- the flux of a light, whatever the grid ---------------------------------------------------

// A narrow spot on a floor, seen from far away: a point source, in however many VPLs.
static void all_flux_comes_back_whatever_the_grid(void **state)
{
    struct world *w = *state;
    world_clear(w);
    int32_t grey = world_add_material(w, 0.5f);
    add_floor(w, grey, 1, 0);
    const double ceiling[4][3] = {{-.1, 4, -.1}, {.1, 4, -.1}, {.1, 4, .1}, {-.1, 4, .1}};
    world_add_quad(w, grey, ceiling, 1);
    const double lamp[3] = {0, .5, 0}, above[3] = {0, 4, 0};
    world_add_light(w, BD_LIGHT_SPOT, lamp, down, 1);
    w->scene->lights[0].cone_inner = 0.099f;
    w->scene->lights[0].cone_outer = 0.1f;
    world_add_probe(w, above, down, 1e-3);
    // Phi = 2 pi (1 - cos), nearly all of it straight down and straight back up.
    double flux = 2 * M_PI * (1 - (2 * cos(0.099) + cos(0.1)) / 3);
    const char *const maps[] = {"rsm_size=64", "rsm_size=256", "rsm_size=1024", "rsm_size=2048"};
    const char *const counts[] = {"vpls=1", "vpls=9", "vpls=4096"};
    for (int m = 0; m < 4; m++) {
        for (int c = 0; c < (m < 3 ? 3 : 1); c++) {
            const char *settings[] = {"brdf=lambert", "vpl_kernel=point", maps[m], counts[c], NULL};
            double e = world_probe(w, "rsm", 0, BD_LAYER_INDIRECT, settings) * M_PI / 0.5;
            ASSERT_REL(e, 0.5 * flux / (M_PI * 16), 2e-3);
        }
    }
}

// --- 61: shading normals off the surface ------------------------------------------------------

enum { CELLS = 16, POINTS = CELLS + 1 };

// The plane y = 0.3 x + 0.1 z with dents of `dent_m`; shading normals up to 25 degrees off its own.
static void add_bumpy_floor(struct world *w, int32_t material, double dent_m)
{
    static float positions[3 * POINTS * POINTS], normals[3 * POINTS * POINTS];
    static uint32_t indices[6 * CELLS * CELLS];
    for (int i = 0; i < POINTS * POINTS; i++) {
        double x = 2.0 * (i % POINTS) / CELLS - 1, z = 1 - 2.0 * (i / POINTS) / CELLS;
        double n[3] = {-.3 + .45 * sin(2.1 * i), 1, -.1 + .45 * cos(3.7 * i)};
        double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        positions[3 * i] = (float)x;
        positions[3 * i + 1] = (float)(0.3 * x + 0.1 * z + dent_m * sin(5.3 * i));
        positions[3 * i + 2] = (float)z;
        for (int a = 0; a < 3; a++) normals[3 * i + a] = (float)(n[a] / length);
    }
    for (uint32_t c = 0; c < CELLS * CELLS; c++) {
        uint32_t a = c / CELLS * POINTS + c % CELLS;
        const uint32_t quad[6] = {a, a + 1, a + POINTS + 1, a, a + POINTS + 1, a + POINTS};
        memcpy(indices + 6 * c, quad, sizeof quad);
    }
    world_add_mesh(w, material, positions, normals, POINTS * POINTS, indices, 6 * CELLS * CELLS);
}

// Largest indirect radiance of a floor before a camera.
static double most_of_bumpy_floor(struct world *w, double dent_m, const char *const *settings)
{
    world_clear(w);
    add_bumpy_floor(w, world_add_material(w, 0.8f), dent_m);
    const double lamp[3] = {.3, 1.2, .1}, eye[3] = {.4, 1.6, 1};
    world_add_light(w, BD_LIGHT_POINT, lamp, down, 2);
    world_add_camera(w, eye, origin, 0.8);
    struct bd_image *image = picture(w, "rsm", 0, 2 * SIDE, BD_LAYER_INDIRECT, settings);
    double most = 0;
    for (uint32_t i = 0; i < 4 * SIDE * SIDE; i++) most = fmax(most, red(image, i));
    print_message("    dents of %g, %s: most %.3g\n", dent_m, settings[1], most);
    bd_image_destroy(&image);
    return most;
}

// A floor in one plane whose shading normals lean this way and that lights no part of itself.
static void a_bumpy_floor_lights_itself_by_nothing(void **state)
{
    for (int k = 0; k < 2; k++) {
        const char *settings[] = {"vpls=1536", k ? "vpl_kernel=patch" : "vpl_kernel=disk", NULL};
        assert_true(most_of_bumpy_floor(*state, 0, settings) == 0);
    }
}

// One with dents of a hundredth of a cell does, but by little: facets are at most 4 degrees off
// each other, and a plane that rises by so much fills 1.2e-3 of a point's view. A point beneath the
// plane of a patch but before its leaning normal would be covered by it, and get all that it sends.
static void a_dented_floor_is_not_covered_by_its_own_patches(void **state)
{
    const double sent = 0.8 * 2 / (1.1 * 1.1) / M_PI, most_seen = 0.8 * sent;
    const char *const maps[][2] = {
        {"vpls=384", "rsm_size=8"}, {"vpls=1536", "rsm_size=16"}, {"vpls=6144", "rsm_size=32"}};
    for (int k = 0; k < 3; k++) {
        const char *settings[] = {maps[k][0], maps[k][1], NULL};
        assert_true(most_of_bumpy_floor(*state, 1e-3, settings) < 0.1 * most_seen);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(receivers_on_vpls_stay_finite),
        cmocka_unit_test(vpls_stand_for_no_more_than_the_plane),
        cmocka_unit_test(a_strong_light_drowns_no_weak_one),
        cmocka_unit_test(a_quad_lit_from_behind_is_black),
        cmocka_unit_test(a_closed_box_leaks_nothing),
        cmocka_unit_test(a_light_on_the_floor_lights_the_ceiling),
        cmocka_unit_test(a_camera_in_a_wall_sees_something_finite),
        cmocka_unit_test(one_pixel_is_the_centre_of_many),
        cmocka_unit_test(depth_holds_over_seven_orders),
        cmocka_unit_test(a_lit_plane_has_no_dark_pixel),
        cmocka_unit_test(a_lit_sphere_has_no_dark_pixel),
        cmocka_unit_test(a_cube_room_shows_no_seam),
        cmocka_unit_test(all_flux_comes_back_whatever_the_grid),
        cmocka_unit_test(a_bumpy_floor_lights_itself_by_nothing),
        cmocka_unit_test(a_dented_floor_is_not_covered_by_its_own_patches),
    };
    return cmocka_run_group_tests(tests, world_open, world_close);
}
