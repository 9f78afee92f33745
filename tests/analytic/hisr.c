// Technique `hisr` against closed forms: right by default, and wrong under `paper_mode` by the
// factors that the errata of its paper foretell (algorithms.md A2, N1, N2 and N4; D6 and D8).

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

#include "world.h"

#define ALBEDO 0.5f

static const double origin[3] = {0, 0, 0}, down[3] = {0, -1, 0};

static double irradiance(struct world *w, uint32_t camera, const char *const *settings)
{
    return world_probe(w, "hisr", camera, BD_LAYER_INDIRECT, settings) * M_PI / (double)ALBEDO;
}

// --- as it is by default ----------------------------------------------------------------------

static const char *const cuts[] = {"tree_cut=lightcuts", "tree_cut=bound", "tree_cut=level"};

static void cube_room(void **state)
{
    const double points[][2] = {{0, 0}, {.5, 0}, {.5, .5}}, floor_up[3] = {0, 0, 1};
    const double expected[] = {.590616, .579682, .552789};
    struct world *w = *state;
    world_clear(w);
    world_add_box_room(w, world_add_material(w, ALBEDO), origin, 1);
    world_add_light(w, BD_LIGHT_POINT, origin, down, 1);
    for (int i = 0; i < 3; i++) {
        const double at[3] = {points[i][0], points[i][1], -1};
        world_add_probe(w, at, floor_up, 1e-4);
    }
    for (int c = 0; c < 3; c++) {
        const char *const settings[] = {"brdf=lambert", cuts[c], NULL};
        const char *const many[] = {"brdf=lambert", cuts[c], "vpls=24576", NULL};
        for (uint32_t i = 0; i < 3; i++) {
            ASSERT_REL(irradiance(w, i, settings), (double)ALBEDO * expected[i], .01);
            ASSERT_REL(irradiance(w, i, many), (double)ALBEDO * expected[i], .01);
        }
    }
}

// --- as printed ---------------------------------------------------------------------------------

// A narrow spot on a wall before it; behind the lamp a probe looks back at the wall. All that is
// lit is as far from the lamp, from the probe, and as square to both.
#define TO_WALL_M  2.0
#define TO_PROBE_M 3.0 // from the wall
#define HALF_ANGLE 0.1

static void make_beam(struct world *w)
{
    world_clear(w);
    int32_t grey = world_add_material(w, ALBEDO);
    const double z = -TO_WALL_M, back = TO_PROBE_M - TO_WALL_M, ahead[3] = {0, 0, -1};
    const double wall[4][3] = {{-1, -1, z}, {1, -1, z}, {1, 1, z}, {-1, 1, z}};
    const double screen[4][3] = {{1, -1, back}, {-1, -1, back}, {-1, 1, back}, {1, 1, back}};
    const double at[3] = {0, 0, back};
    world_add_quad(w, grey, wall, 1);
    world_add_quad(w, grey, screen, 1);
    world_add_light(w, BD_LIGHT_SPOT, origin, ahead, 1);
    w->scene->lights[0].cone_outer = (float)HALF_ANGLE;
    w->scene->lights[0].cone_inner = (float)(.9 * HALF_ANGLE);
    world_add_probe(w, at, ahead, 1e-3);
}

static double printed(struct world *w, const char *vpls, const char *roots, const char *tau)
{
    const char *const settings[] = {"brdf=lambert", "paper_mode=1", vpls, roots, tau, NULL};
    return irradiance(w, 0, settings);
}

// Fractions of the sphere taken for solid angles (N1): the area of a VPL is 4 pi too small and so
// is its intensity. The sum lacks 1 / A_j (N2), of which each has a share of side^2 in what is lit.
static void printed_sums_are_off_as_foretold(void **state)
{
    struct world *w = *state;
    make_beam(w);
    const double t = tan(HALF_ANGLE), face_sr = 4 * asin(t * t / (1 + t * t));
    const double face_m2 = face_sr * TO_WALL_M * TO_WALL_M;
    const char *const right[] = {"brdf=lambert", "vpls=1024", "tau=0", NULL};
    const double e = irradiance(w, 0, right);
    const double coarse = printed(w, "vpls=256", "tree_roots=256", "tau=0");
    const double fine = printed(w, "vpls=1024", "tree_roots=1024", "tau=0");
    assert_true(e > 0);
    ASSERT_REL(coarse / e, face_m2 / (16 * 16) / pow(4 * M_PI, 2), .02);
    ASSERT_REL(fine / e, face_m2 / (32 * 32) / pow(4 * M_PI, 2), .02);
}

// The printed criterion does not know the level (N4): all the way down or not at all, and by N2
// that is a factor of 4 a level. The corrected one ends between, with the same light wherever it
// ends.
static void printed_criterion_is_all_or_nothing(void **state)
{
    struct world *w = *state;
    make_beam(w);
    const double side = 32, v2 = TO_WALL_M * TO_WALL_M, r2 = TO_PROBE_M * TO_PROBE_M;
    const double edge = 2 * v2 / (3 * side * side * r2 + 2 * v2);
    char above[32], below[32];
    snprintf(above, sizeof above, "tau=%.9g", 1.05 * edge);
    snprintf(below, sizeof below, "tau=%.9g", edge / 1.05);
    const double nodes = printed(w, "vpls=1024", "tree_roots=16", "tau=1");
    const double leaves = printed(w, "vpls=1024", "tree_roots=16", "tau=0");
    ASSERT_REL(nodes / leaves, 8 * 8, .02);
    ASSERT_REL(printed(w, "vpls=1024", "tree_roots=16", above), nodes, 1e-5);
    ASSERT_REL(printed(w, "vpls=1024", "tree_roots=16", below), leaves, 1e-5);
    const char *const taus[] = {"tau=0", "tau=0.01", "tau=0.1", "tau=0.3", "tau=1"};
    double e = 0;
    for (int i = 0; i < 5; i++) {
        const char *const settings[] = {"brdf=lambert",   "vpls=1024", "tree_roots=16",
                                        "tree_cut=level", taus[i],     NULL};
        if (i == 0) e = irradiance(w, 0, settings);
        ASSERT_REL(irradiance(w, 0, settings), e, 5e-3);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(cube_room),
        cmocka_unit_test(printed_sums_are_off_as_foretold),
        cmocka_unit_test(printed_criterion_is_all_or_nothing),
    };
    return cmocka_run_group_tests(tests, world_open, world_close);
}
