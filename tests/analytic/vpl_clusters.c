// VPLs from blocks of several sizes (pass/vpl_clusters.h) against grids over the same maps: a room
// with a screen in it, seen by a point light and by a spot, both askew.

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "pass/vpl_clusters.h"
#include "shared/vpl.h"
#include "view.h"

#define RSM_SIDE 64

// The sun shines on a floor under the sky, which its map sees beside it; the others in a room.
static const enum bd_light_kind kinds[] = {BD_LIGHT_POINT, BD_LIGHT_SPOT, BD_LIGHT_DIRECTIONAL};
#define LIGHTS         3
#define LIGHTS_IN_ROOM 2

struct vpl {
    struct bd_vec4 at[BD_VPL_VEC4S], quad[BD_VPL_QUAD_VEC4S];
};

// A list on the host.
struct vpls {
    uint32_t count;
    struct vpl *vpl;
};

// A scene as passes see it, with the map of one light.
struct stage {
    struct view view;
    struct bd_light_setup light;
    struct bd_rsm *rsm;
};

static struct stage open_stage(struct world *w, uint32_t light)
{
    const double centre[3] = {0, 0, 0}, lamp[3] = {.3, .4, .1}, aside[3] = {.7, -.6, -.5};
    const double screen[4][3] = {{-.3, -.3, 0}, {.3, -.3, .1}, {.3, .3, .1}, {-.3, .3, 0}};
    struct bd_err_detail detail = {0};
    world_clear(w);
    int32_t grey = world_add_material(w, .5f);
    const double floor[4][3] = {{-1, -1, 1}, {1, -1, 1}, {1, -1, -1}, {-1, -1, -1}};
    if (light < LIGHTS_IN_ROOM)
        world_add_box_room(w, grey, centre, 1);
    else
        world_add_quad(w, grey, floor, 1);
    world_add_quad(w, world_add_material(w, .8f), screen, 1);
    world_add_light(w, kinds[light], lamp, aside, 1);
    struct stage s = {.view = view_open(w), .light = bd_light_setup_of(w->scene, 0)};
    const struct bd_rsm_inputs inputs = {
        .scene = s.view.scene, .light = &s.light, .side_px = RSM_SIDE, .lambert = true};
    assert_int_equal(bd_rsm_render(&s.view.context, &inputs, &s.rsm, &detail), BD_ERR_OK);
    return s;
}

static void close_stage(struct stage *s)
{
    bd_rsm_destroy(s->view.world->gpu, &s->rsm);
    view_close(&s->view);
}

static struct vpls read_list(struct stage *s, struct bd_vpl_list *list)
{
    const size_t at_bytes = sizeof(struct bd_vec4) * BD_VPL_VEC4S * list->count;
    const size_t quad_bytes = sizeof(struct bd_vec4) * BD_VPL_QUAD_VEC4S * list->count;
    char *at = malloc(at_bytes), *quads = malloc(quad_bytes);
    struct vpls out = {list->count, malloc(list->count * sizeof *out.vpl)};
    assert_int_equal(bd_buf_read(s->view.world->gpu, list->vpls, 0, at, at_bytes), BD_ERR_OK);
    assert_int_equal(bd_buf_read(s->view.world->gpu, list->quads, 0, quads, quad_bytes), BD_ERR_OK);
    for (uint32_t i = 0; i < list->count; i++) {
        memcpy(out.vpl[i].at, at + i * sizeof out.vpl->at, sizeof out.vpl->at);
        memcpy(out.vpl[i].quad, quads + i * sizeof out.vpl->quad, sizeof out.vpl->quad);
    }
    free(at), free(quads);
    bd_vpl_list_destroy(s->view.world->gpu, &list);
    return out;
}

static struct vpls grid_of(struct stage *s, uint32_t side)
{
    const struct bd_vpl_grid_inputs inputs = {.rsm = s->rsm,
                                              .light = &s->light,
                                              .space = &s->view.scene->space,
                                              .grid_side = side,
                                              .near_field = 5};
    struct bd_vpl_list *list;
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_vpl_grid_run(&s->view.context, &inputs, &list, &detail), BD_ERR_OK);
    return read_list(s, list);
}

static struct vpls clusters_of(struct stage *s, double depth_threshold, double normal_threshold,
                               uint32_t coarsest_side, uint32_t finest_block_texels)
{
    const struct bd_vpl_clusters_inputs inputs = {
        .rsm = s->rsm,
        .light = &s->light,
        .space = &s->view.scene->space,
        .settings = {.depth_threshold = depth_threshold,
                     .normal_threshold = normal_threshold,
                     .coarsest_side = coarsest_side},
        .finest_block_texels = finest_block_texels,
        .near_field = 5,
    };
    struct bd_vpl_list *list;
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_vpl_clusters_run(&s->view.context, &inputs, &list, &detail), BD_ERR_OK);
    return read_list(s, list);
}

static double flux_of(const struct vpls *vpls)
{
    double sum = 0;
    for (uint32_t i = 0; i < vpls->count; i++) sum += vpls->vpl[i].at[2].x;
    return sum;
}

static int by_bytes(const void *a, const void *b)
{
    return memcmp(a, b, sizeof(struct vpl));
}

// The same VPLs bit for bit, in any order.
static void assert_same(struct vpls *a, struct vpls *b)
{
    assert_int_equal(a->count, b->count);
    qsort(a->vpl, a->count, sizeof *a->vpl, by_bytes);
    qsort(b->vpl, b->count, sizeof *b->vpl, by_bytes);
    assert_memory_equal(a->vpl, b->vpl, a->count * sizeof *a->vpl);
}

static void infinite_thresholds_give_the_coarsest_grid(void **state)
{
    for (uint32_t light = 0; light < LIGHTS_IN_ROOM; light++) {
        struct stage s = open_stage(*state, light);
        for (uint32_t side = 1; side <= RSM_SIDE; side *= 4) {
            struct vpls grid = grid_of(&s, side),
                        clusters = clusters_of(&s, INFINITY, INFINITY, side, 1);
            assert_same(&grid, &clusters);
            free(grid.vpl), free(clusters.vpl);
        }
        close_stage(&s);
    }
}

static void zero_thresholds_give_the_finest_grid(void **state)
{
    for (uint32_t light = 0; light < LIGHTS_IN_ROOM; light++) {
        struct stage s = open_stage(*state, light);
        for (uint32_t block = 1; block <= 8; block *= 2) {
            struct vpls grid = grid_of(&s, RSM_SIDE / block),
                        clusters = clusters_of(&s, 0, 0, 2, block);
            assert_same(&grid, &clusters);
            free(grid.vpl), free(clusters.vpl);
        }
        close_stage(&s);
    }
}

static void flux_is_the_maps_whatever_the_clusters(void **state)
{
    const double thresholds[] = {0, .1, .3, INFINITY};
    for (uint32_t light = 0; light < LIGHTS; light++) {
        struct stage s = open_stage(*state, light);
        struct vpls map = grid_of(&s, RSM_SIDE);
        uint32_t before = map.count, finest = 0;
        for (int t = 0; t < 4; t++) {
            struct vpls clusters = clusters_of(&s, thresholds[t], .25, 4, 2);
            print_message("    depth threshold %g: %u VPLs\n", thresholds[t], clusters.count);
            ASSERT_REL(flux_of(&clusters), flux_of(&map), 1e-5);
            assert_true(clusters.count <= before);
            before = clusters.count;
            if (t == 0) finest = clusters.count;
            free(clusters.vpl);
        }
        assert_true(before < finest);
        free(map.vpl);
        close_stage(&s);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(infinite_thresholds_give_the_coarsest_grid),
        cmocka_unit_test(zero_thresholds_give_the_finest_grid),
        cmocka_unit_test(flux_is_the_maps_whatever_the_clusters),
    };
    return cmocka_run_group_tests(tests, world_open, world_close);
}
