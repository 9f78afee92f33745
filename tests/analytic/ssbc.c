// Technique `ssbc`: what a clamp takes off, and who gives it back, against closed forms and each
// other (algorithms.md D3, A3).

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

#include "world.h"

#define SIDE_PX 48u

static double mean_of(const struct bd_image *image)
{
    const size_t pixels = (size_t)image->width_px * image->height_px;
    double sum = 0;
    for (size_t i = 0; i < pixels; i++) sum += image->pixels[i * image->channel_count];
    return sum / (double)pixels;
}

// Of indirect light, with few settings beside many lights and rays.
static double render_camera(struct world *w, uint32_t camera, const char *residual,
                            const char *clamp, const char *iterations, bool *ran)
{
    const char *const settings[] = {
        "brdf=lambert", "vpls=8192", "walk_vpls=8192", "rays=64", "far_rays=64", "cache_cells=8192",
        residual,       clamp,       iterations,       NULL};
    struct bd_image *layers[BD_LAYER_COUNT];
    world_render(w, "ssbc", camera, SIDE_PX, SIDE_PX, 1u << BD_LAYER_INDIRECT, settings, layers);
    const double mean = mean_of(layers[BD_LAYER_INDIRECT]);
    if (ran) *ran = world_times_run(&w->report, "residual") == 1;
    world_free_layers(layers);
    return mean;
}

static double render_mean(struct world *w, const char *residual, const char *clamp,
                          const char *iterations, bool *ran)
{
    return render_camera(w, 0, residual, clamp, iterations, ran);
}

// --- the integrating sphere
// -----------------------------------------------------------------------

#define RADIUS_M 2.0
#define ALBEDO   0.8
// Of a sphere's light, of which each place sends as much to each, so much is below the clamp.
#define BELOW 0.25

static void make_sphere(struct world *w)
{
    world_clear(w);
    world_add_sphere_room(w, world_add_material(w, (float)ALBEDO), RADIUS_M, 5);
    world_add_light(w, BD_LIGHT_POINT, (const double[]){0, 0, 0}, (const double[]){0, -1, 0}, 10);
    world_add_camera(w, (const double[]){.2, .1, 1}, (const double[]){0, 0, -1}, .9);
}

static void a_clamp_leaves_its_part_and_rays_bring_the_rest(void **state)
{
    struct world *w = *state;
    char clamp[32];
    const double direct = ALBEDO / M_PI * 10 / (RADIUS_M * RADIUS_M);
    const double all = direct * ALBEDO / (1 - ALBEDO);
    snprintf(clamp, sizeof clamp, "clamp=%.9g", BELOW / (4 * RADIUS_M * RADIUS_M));
    make_sphere(w);
    const double clamped = render_mean(w, "residual=screen", clamp, "iterations=0", NULL);
    print_message("    clamped %.5f of %.5f, to be %.5f\n", clamped, all, BELOW * all);
    ASSERT_REL(clamped, BELOW * all, .01);
    ASSERT_REL(render_mean(w, "residual=rays", clamp, "iterations=0", NULL), all, .01);
    // A clamp above what any two places send takes nothing off.
    snprintf(clamp, sizeof clamp, "clamp=%.9g", 1.01 / (4 * RADIUS_M * RADIUS_M));
    ASSERT_REL(render_mean(w, "residual=screen", clamp, "iterations=0", NULL), all, .01);
    ASSERT_REL(render_mean(w, "residual=both", clamp, "iterations=2", NULL), all, .01);
}

// --- a room with a box that hides some of it
// --------------------------------------------------------

static void add_box(struct world *w, int32_t material)
{
    const double x0 = -.5, x1 = .1, y0 = -1, y1 = -.3, z0 = -.7, z1 = -.1;
    const double faces[5][4][3] = {
        {{x0, y1, z1}, {x1, y1, z1}, {x1, y1, z0}, {x0, y1, z0}},
        {{x0, y0, z1}, {x1, y0, z1}, {x1, y1, z1}, {x0, y1, z1}},
        {{x1, y0, z0}, {x0, y0, z0}, {x0, y1, z0}, {x1, y1, z0}},
        {{x1, y0, z1}, {x1, y0, z0}, {x1, y1, z0}, {x1, y1, z1}},
        {{x0, y0, z0}, {x0, y0, z1}, {x0, y1, z1}, {x0, y1, z0}},
    };
    for (int f = 0; f < 5; f++) world_add_quad(w, material, faces[f], 1);
}

static void make_room(struct world *w)
{
    world_clear(w);
    const int32_t material = world_add_material(w, .7f);
    world_add_box_room(w, material, (const double[]){0, 0, 0}, 1);
    add_box(w, material);
    world_add_light(w, BD_LIGHT_POINT, (const double[]){.4, .6, .3}, (const double[]){0, -1, 0}, 5);
    world_add_camera(w, (const double[]){.5, .2, .95}, (const double[]){-.3, -.4, -1}, 1.3);
    // An edge of the room alone, whole but for where it leaves the picture.
    world_add_camera(w, (const double[]){0, 0, .6}, (const double[]){1, 1, .3}, .8);
}

// The shares of the picture and of rays sum to 1, whatever the clamp.
static void who_gives_back_does_not_matter(void **state)
{
    struct world *w = *state;
    bool ran;
    make_room(w);
    const double all = render_mean(w, "residual=rays", "clamp=1000", "iterations=0", NULL);
    for (int c = 0; c < 3; c++) {
        const char *const clamp = (const char *const[]){"clamp=40", "clamp=10", "clamp=4"}[c];
        const double none = render_mean(w, "residual=screen", clamp, "iterations=0", &ran);
        assert_false(ran);
        const double rays = render_mean(w, "residual=rays", clamp, "iterations=4", &ran);
        assert_false(ran);
        const double screen = render_mean(w, "residual=screen", clamp, "iterations=4", &ran);
        assert_true(ran);
        const double both = render_mean(w, "residual=both", clamp, "iterations=4", &ran);
        assert_true(ran);
        print_message("    %s: of %.4f clamped %.4f, by the screen %.4f, rays %.4f, both %.4f\n",
                      clamp, all, none / all, screen / all, rays / all, both / all);
        assert_true(none < screen && screen < rays * 1.002);
        ASSERT_REL(rays, all, .01);
        ASSERT_REL(both, rays, .006);
    }
}

// Where the picture has all that is near, it alone gives back; where it has not, rays alone do.
static void an_edge_gets_back_once(void **state)
{
    struct world *w = *state;
    const char *const clamp = "clamp=20";
    bool ran;
    make_room(w);
    const double none = render_camera(w, 1, "residual=screen", clamp, "iterations=0", NULL);
    const double rays = render_camera(w, 1, "residual=rays", clamp, "iterations=4", NULL);
    const double both = render_camera(w, 1, "residual=both", clamp, "iterations=4", &ran);
    print_message("    clamped %.4f, by rays %.4f, both %.4f\n", none, rays, both);
    assert_true(ran && rays > 1.01 * none);
    ASSERT_REL(both - none, rays - none, .05);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_clamp_leaves_its_part_and_rays_bring_the_rest),
        cmocka_unit_test(who_gives_back_does_not_matter),
        cmocka_unit_test(an_edge_gets_back_once),
    };
    return cmocka_run_group_tests(tests, world_open, world_close);
}
