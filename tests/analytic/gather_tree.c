// Gather over cuts of trees (pass/gather_tree.h) against the flat sum of the same leaves, in a room
// with two lights.

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/clock.h"
#include "pass/gather_tree.h"
#include "view.h"

#define SIDE   24 // pixels
#define LIGHTS 2

static double near_field = 5; // of the VPLs of the next stage

static const char *const criteria[] = {"lightcuts", "bound", "level", "printed"};

// A scene as passes see it, with VPLs and trees of each light.
struct stage {
    struct view view;
    struct bd_vpl_list *lists[LIGHTS];
    struct bd_vpl_tree *trees[LIGHTS];
    bool patches;
};

static void build_room(struct world *w, double scale, double power)
{
    const double centre[3] = {0, 0, 0}, half = .3 * scale, lamp[3] = {.3 * scale, .4 * scale, 0};
    const double eye[3] = {-.8 * scale, .6 * scale, .7 * scale}, aside[3] = {1, -.6, -.5};
    const double sun[3] = {.2, -1, .1};
    world_clear(w);
    int32_t grey = world_add_material(w, .5f), black = world_add_material(w, 0);
    world_add_box_room(w, grey, centre, scale);
    const double screen[4][3] = {
        {-half, -half, 0}, {half, -half, 0}, {half, half, 0}, {-half, half, 0}};
    world_add_quad(w, black, screen, 1);
    world_add_light(w, BD_LIGHT_POINT, lamp, sun, (float)(power * scale * scale));
    world_add_light(w, BD_LIGHT_SPOT, eye, aside, (float)(.25 * power * scale * scale));
    world_add_camera(w, eye, lamp, 1.5);
}

static void light_up(struct stage *s, uint32_t light, uint32_t leaf_side, uint32_t root_side,
                     enum bd_vpl_kernel kernel)
{
    const struct bd_light_setup setup = bd_light_setup_of(s->view.world->scene, light);
    struct bd_err_detail detail = {0};
    struct bd_rsm *rsm;
    const struct bd_rsm_inputs to_rsm = {
        .scene = s->view.scene, .light = &setup, .side_px = 4 * leaf_side, .lambert = true};
    assert_int_equal(bd_rsm_render(&s->view.context, &to_rsm, &rsm, &detail), BD_ERR_OK);
    const struct bd_vpl_grid_inputs to_vpls = {.rsm = rsm,
                                               .light = &setup,
                                               .space = &s->view.scene->space,
                                               .grid_side = leaf_side,
                                               .kernel = kernel,
                                               .near_field = near_field};
    assert_int_equal(bd_vpl_grid_run(&s->view.context, &to_vpls, &s->lists[light], &detail),
                     BD_ERR_OK);
    bd_rsm_destroy(s->view.world->gpu, &rsm);
    const struct bd_vpl_tree_inputs to_tree = {.leaves = s->lists[light],
                                               .leaf_side = leaf_side,
                                               .face_count = setup.face_count,
                                               .root_side = root_side,
                                               .light = &setup,
                                               .space = &s->view.scene->space};
    assert_int_equal(bd_vpl_tree_run(&s->view.context, &to_tree, &s->trees[light], &detail),
                     BD_ERR_OK);
}

static struct stage open_stage(struct world *w, uint32_t leaf_side, uint32_t root_side,
                               enum bd_vpl_kernel kernel)
{
    struct stage s = {.view = view_open(w), .patches = kernel == BD_KERNEL_PATCH};
    view_look(&s.view, 0, SIDE, SIDE, true);
    for (uint32_t l = 0; l < LIGHTS; l++) light_up(&s, l, leaf_side, root_side, kernel);
    return s;
}

static void close_stage(struct stage *s)
{
    struct bd_gpu *gpu = s->view.world->gpu;
    for (uint32_t l = 0; l < LIGHTS; l++) {
        bd_vpl_tree_destroy(gpu, &s->trees[l]);
        bd_vpl_list_destroy(gpu, &s->lists[l]);
    }
    view_close(&s->view);
}

typedef struct bd_vec4 picture[SIDE * SIDE];

static void read_irradiance(struct stage *s, struct bd_indirect *indirect, picture out)
{
    view_read(&s->view, indirect->irradiance, out, sizeof(picture));
    bd_indirect_destroy(s->view.world->gpu, &indirect);
}

static void gather_flat(struct stage *s, picture out)
{
    const struct bd_gather_inputs inputs = {.scene = s->view.scene,
                                            .viewpoint = &s->view.viewpoint,
                                            .gbuffer = s->view.gbuffer,
                                            .lists = (const struct bd_vpl_list *const *)s->lists,
                                            .list_count = LIGHTS,
                                            .near_patches = s->patches};
    struct bd_indirect *indirect;
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_gather_run(&s->view.context, &inputs, &indirect, &detail), BD_ERR_OK);
    read_irradiance(s, indirect, out);
}

static struct bd_gather_tree_inputs cut_inputs(struct stage *s, enum bd_tree_criterion criterion,
                                               double tau)
{
    return (struct bd_gather_tree_inputs){
        .scene = s->view.scene,
        .viewpoint = &s->view.viewpoint,
        .gbuffer = s->view.gbuffer,
        .trees = (const struct bd_vpl_tree *const *)s->trees,
        .leaves = (const struct bd_vpl_list *const *)s->lists,
        .tree_count = LIGHTS,
        .criterion = criterion,
        .tau = tau,
        .near_patches = s->patches,
    };
}

static void gather_cut(struct stage *s, enum bd_tree_criterion criterion, double tau, picture out)
{
    const struct bd_gather_tree_inputs inputs = cut_inputs(s, criterion, tau);
    struct bd_indirect *indirect;
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_gather_tree_run(&s->view.context, &inputs, &indirect, &detail), BD_ERR_OK);
    read_irradiance(s, indirect, out);
}

// Relative RMSE over the mean, and the largest error over the mean.
static double error_of(picture a, picture reference, double *largest)
{
    double squares = 0, mean = 0;
    *largest = 0;
    for (int i = 0; i < SIDE * SIDE; i++) mean += reference[i].x / (SIDE * SIDE);
    for (int i = 0; i < SIDE * SIDE; i++) {
        double e = (double)a[i].x - reference[i].x;
        squares += e * e / (SIDE * SIDE);
        *largest = fmax(*largest, fabs(e) / mean);
    }
    assert_true(mean > 0);
    return sqrt(squares) / mean;
}

static void without_error_every_leaf_counts(void **state)
{
    const enum bd_vpl_kernel kernels[] = {BD_KERNEL_PATCH, BD_KERNEL_DISK, BD_KERNEL_POINT};
    const uint32_t root_sides[] = {4, 1, 16};
    for (int k = 0; k < 3; k++) {
        build_room(*state, 1, 1);
        struct stage s = open_stage(*state, 16, root_sides[k], kernels[k]);
        picture flat, cut;
        gather_flat(&s, flat);
        for (int c = BD_TREE_LIGHTCUTS; c <= BD_TREE_LEVEL; c++) {
            double largest;
            gather_cut(&s, (enum bd_tree_criterion)c, 0, cut);
            error_of(cut, flat, &largest);
            print_message("    %s: largest difference %.1e of the mean\n", criteria[c], largest);
            assert_true(largest <= 2e-5);
        }
        close_stage(&s);
    }
}

// As many leaves under one root as there may be, all of them near: the software device ends loops
// that are too long without a word.
static void no_leaf_is_lost_of_many(void **state)
{
    build_room(*state, 1, 1);
    near_field = 1000;
    struct stage s = open_stage(*state, BD_TREE_ROOT_LEAVES_MAX, 1, BD_KERNEL_PATCH);
    near_field = 5;
    picture flat, cut;
    double largest;
    gather_flat(&s, flat);
    gather_cut(&s, BD_TREE_LIGHTCUTS, 0, cut);
    error_of(cut, flat, &largest);
    assert_true(largest <= 1e-4);
    close_stage(&s);
}

// --- at fragments -------------------------------------------------------------------------------

static void assert_same_light(struct stage *s, const struct bd_tex *a, const struct bd_tex *b)
{
    const struct bd_tex_desc *desc = bd_tex_desc(a);
    const size_t count = (size_t)desc->width_px * desc->height_px * 4;
    float *texels[2];
    double mean = 0;
    for (int k = 0; k < 2; k++) {
        texels[k] = malloc(count * sizeof(float));
        view_read(&s->view, k ? b : a, texels[k], count * sizeof(float));
    }
    for (size_t i = 0; i < count; i++) mean += fabsf(texels[1][i]) / (double)count;
    assert_true(mean > 0);
    for (size_t i = 0; i < count; i++)
        if (fabs((double)texels[0][i] - texels[1][i]) > 1e-4 * mean)
            fail_msg("%zu: %g, expected %g", i, (double)texels[0][i], (double)texels[1][i]);
    free(texels[0]), free(texels[1]);
}

// Of several sizes.
static void find_fragments(struct stage *s, struct bd_discontinuity **discontinuity,
                           struct bd_fragments **fragments)
{
    struct bd_err_detail detail = {0};
    const struct bd_discontinuity_inputs look = {
        .gbuffer = s->view.gbuffer,
        .viewpoint = &s->view.viewpoint,
        .space = &s->view.scene->space,
        .settings = {.depth_threshold = .3, .normal_threshold = .3, .coarsest_side = 4},
    };
    assert_int_equal(bd_discontinuity_run(&s->view.context, &look, discontinuity, &detail),
                     BD_ERR_OK);
    assert_int_equal(bd_fragments_run(&s->view.context, &look, *discontinuity,
                                      BD_REFINEMENT_ONE_PASS, fragments, &detail),
                     BD_ERR_OK);
    assert_true((*fragments)->level_count[0] > 0 && (*fragments)->level_count[1] > 0);
}

static void fragments_are_lit_as_by_every_leaf(void **state)
{
    build_room(*state, 1, 1);
    struct stage s = open_stage(*state, 16, 4, BD_KERNEL_PATCH);
    struct bd_err_detail detail = {0};
    struct bd_discontinuity *discontinuity;
    struct bd_fragments *fragments;
    find_fragments(&s, &discontinuity, &fragments);
    const struct bd_gather_fragments_inputs flat_inputs = {
        .scene = s.view.scene,
        .viewpoint = &s.view.viewpoint,
        .gbuffer = s.view.gbuffer,
        .discontinuity = discontinuity,
        .fragments = fragments,
        .lists = (const struct bd_vpl_list *const *)s.lists,
        .list_count = LIGHTS,
        .near_patches = true,
        .vector = true,
    };
    struct bd_gather_tree_inputs inputs = cut_inputs(&s, BD_TREE_LIGHTCUTS, 0);
    inputs.discontinuity = discontinuity;
    inputs.fragments = fragments;
    inputs.vector = true;
    struct bd_multires_light *flat, *cut;
    assert_int_equal(bd_gather_fragments_run(&s.view.context, &flat_inputs, &flat, &detail),
                     BD_ERR_OK);
    assert_int_equal(bd_gather_tree_fragments_run(&s.view.context, &inputs, &cut, &detail),
                     BD_ERR_OK);
    assert_same_light(&s, cut->fine, flat->fine);
    assert_same_light(&s, cut->coarse, flat->coarse);
    assert_same_light(&s, cut->fine_vector, flat->fine_vector);
    assert_same_light(&s, cut->coarse_vector, flat->coarse_vector);
    bd_multires_light_destroy(s.view.world->gpu, &flat);
    bd_multires_light_destroy(s.view.world->gpu, &cut);
    bd_fragments_destroy(s.view.world->gpu, &fragments);
    bd_discontinuity_destroy(s.view.world->gpu, &discontinuity);
    close_stage(&s);
}

static void error_falls_with_tau(void **state)
{
    const double taus[3][3] = {{.1, .02, .004}, {.1, .02, .004}, {.1, .02, .004}};
    const double limits[3] = {.03, .01, .004};
    build_room(*state, 1, 1);
    struct stage s = open_stage(*state, 32, 2, BD_KERNEL_PATCH);
    picture flat, cut;
    gather_flat(&s, flat);
    for (int c = BD_TREE_LIGHTCUTS; c <= BD_TREE_LEVEL; c++) {
        double before = INFINITY, largest;
        for (int t = 0; t < 3; t++) {
            uint64_t start_ns = bd_clock_ns();
            gather_cut(&s, (enum bd_tree_criterion)c, taus[c][t], cut);
            double ms = bd_ms_since(start_ns), error = error_of(cut, flat, &largest);
            print_message("    %s, tau %g: %.4f, largest %.4f, %.1f ms\n", criteria[c], taus[c][t],
                          error, largest, ms);
            assert_true(error < before && error < limits[t]);
            before = error;
        }
    }
    close_stage(&s);
}

// In a room of that scale and power.
static void gather_in_room(struct world *w, double scale, double power,
                           enum bd_tree_criterion criterion, picture out)
{
    build_room(w, scale, power);
    struct stage s = open_stage(w, 16, 2, BD_KERNEL_PATCH);
    gather_cut(&s, criterion, .02, out);
    close_stage(&s);
}

// Light in units of a power of two, lengths too: the same numbers reach every shader.
static void scale_and_power_change_nothing(void **state)
{
    const double scales[][2] = {{1, 0x1p20}, {0x1p12, 1}, {0x1p-9, 0x1p-20}};
    picture first, other;
    for (int c = BD_TREE_LIGHTCUTS; c <= BD_TREE_LEVEL; c++) {
        gather_in_room(*state, 1, 1, (enum bd_tree_criterion)c, first);
        for (int k = 0; k < 3; k++) {
            gather_in_room(*state, scales[k][0], scales[k][1], (enum bd_tree_criterion)c, other);
            assert_memory_equal(first, other, sizeof first);
        }
    }
}

// A power that is none of two moves the frame's light unit, but not the cuts.
static void any_power_gives_the_same_cuts(void **state)
{
    picture first, other;
    for (int c = BD_TREE_LIGHTCUTS; c <= BD_TREE_LEVEL; c++) {
        gather_in_room(*state, 1, 1, (enum bd_tree_criterion)c, first);
        gather_in_room(*state, 1, 1.7, (enum bd_tree_criterion)c, other);
        double largest;
        for (int i = 0; i < SIDE * SIDE; i++) other[i].x /= 1.7f;
        error_of(other, first, &largest);
        assert_true(largest <= 1e-3);
    }
}

// As printed, splitting a block into four equal ones divides what it sends by four (errata N2):
// with twice the leaves along a side a quarter of the light is left.
static void printed_formulas_lose_light_with_refinement(void **state)
{
    double means[2] = {0};
    for (int k = 0; k < 2; k++) {
        build_room(*state, 1, 1);
        struct stage s = open_stage(*state, 16u << k, 16u << k, BD_KERNEL_DISK);
        picture out;
        gather_cut(&s, BD_TREE_PRINTED, .02, out);
        for (int i = 0; i < SIDE * SIDE; i++) means[k] += out[i].x;
        close_stage(&s);
    }
    ASSERT_REL(means[0] / means[1], 4, .2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(without_error_every_leaf_counts),
        cmocka_unit_test(no_leaf_is_lost_of_many),
        cmocka_unit_test(fragments_are_lit_as_by_every_leaf),
        cmocka_unit_test(error_falls_with_tau),
        cmocka_unit_test(scale_and_power_change_nothing),
        cmocka_unit_test(any_power_gives_the_same_cuts),
        cmocka_unit_test(printed_formulas_lose_light_with_refinement),
    };
    return cmocka_run_group_tests(tests, world_open, world_close);
}
