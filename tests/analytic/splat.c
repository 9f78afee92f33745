// Radius-limited splats: where they lie, how many fragments they make, and what they leave out.

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "pass/splat_vpls.h"
#include "shared/vpl.h"
#include "view.h"

#define WIDTH        37
#define HEIGHT       29
#define PIXELS       (WIDTH * HEIGHT)
#define COUNT(array) ((uint32_t)(sizeof(array) / sizeof *(array)))

// --- a room, and lights of one's own in it --------------------------------------------------

enum { PERSPECTIVE, ORTHOGRAPHIC };
static const double eye[3] = {0.1, -0.2, 0.4}, ahead[3] = {0, 0, -1};

// A room of 2 m, seen from within towards -z.
static void make_room(struct world *w, float roughness)
{
    world_clear(w);
    int32_t grey = world_add_material(w, 0.5f);
    w->scene->materials[grey].roughness = roughness;
    world_add_box_room(w, grey, (const double[3]){0, 0, 0}, 1);
    world_add_light(w, BD_LIGHT_POINT, (const double[3]){-0.3, 0.5, -0.2}, ahead, 1);
    world_add_camera(w, eye, (const double[3]){eye[0], eye[1], -1}, 1.2);
    world_add_probe(w, (const double[3]){0, 0, -0.9}, (const double[3]){0, 0, 1}, 1.8);
}

// What a frame would give to a technique.
struct stage {
    struct view view;
    struct bd_vpl_list list;
};

static struct stage open_stage(struct world *w, uint32_t camera)
{
    make_room(w, 1);
    struct stage s = {.view = view_open(w)};
    view_look(&s.view, camera, WIDTH, HEIGHT, true);
    return s;
}

static void close_stage(struct stage *s)
{
    view_forget_vpls(&s->view, &s->list);
    view_close(&s->view);
}

struct lamp {
    double at_m[3];
    float normal[3], flux; // in render units
};

static void set_lamps(struct stage *s, const struct lamp *lamps, uint32_t count)
{
    struct bd_vec4 *vpls = calloc(count, BD_VPL_VEC4S * sizeof *vpls);
    for (uint32_t i = 0; i < count; i++) {
        const struct lamp *l = &lamps[i];
        bd_dvec3 at = bd_render_from_world(&s->view.scene->space,
                                           (bd_dvec3){l->at_m[0], l->at_m[1], l->at_m[2]});
        vpls[BD_VPL_VEC4S * i] = (struct bd_vec4){(float)at.x, (float)at.y, (float)at.z, 1e-4f};
        vpls[BD_VPL_VEC4S * i + 1] = (struct bd_vec4){l->normal[0], l->normal[1], l->normal[2], 0};
        vpls[BD_VPL_VEC4S * i + 2] = (struct bd_vec4){0.5f * l->flux, l->flux, 0, 0};
    }
    view_set_vpls(&s->view, vpls, count, &s->list);
    free(vpls);
}

typedef float pixels[PIXELS][4];

static struct bd_splat_bound splat(struct stage *s, double share, pixels out)
{
    const struct bd_vpl_list *lists[] = {&s->list};
    const struct bd_gather_inputs inputs = {
        .scene = s->view.scene,
        .viewpoint = &s->view.viewpoint,
        .gbuffer = s->view.gbuffer,
        .lists = lists,
        .list_count = 1,
    };
    struct bd_splat_bound bound;
    struct bd_indirect *light;
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_splat_bound_find(&s->view.context, &inputs, share, &bound, &detail), 0);
    assert_int_equal(bd_splat_vpls_run(&s->view.context, &inputs, &bound, &light, &detail), 0);
    view_read(&s->view, light->irradiance, out, sizeof(pixels));
    assert_int_equal(light->fragment_count, bound.fragment_count);
    bd_indirect_destroy(s->view.world->gpu, &light);
    return bound;
}

static uint64_t counted(pixels found)
{
    uint64_t count = 0;
    for (int i = 0; i < PIXELS; i++) count += (uint64_t)found[i][3];
    return count;
}

// On every wall and in the air: before the eye, beside it, behind it, at the near plane.
static const struct lamp lamps[] = {
    {{0.2, 0.1, -1}, {0, 0, 1}, 1},      {{-1, 0.3, -0.4}, {1, 0, 0}, 0.3f},
    {{1, -0.6, 0.1}, {-1, 0, 0}, 2},     {{0.1, -1, -0.6}, {0, 1, 0}, 0.01f},
    {{0.5, 1, 0.35}, {0, -1, 0}, 1},     {{-0.6, -1, 0.4}, {0, 1, 0}, 1},
    {{0.4, 0.5, 1}, {0, 0, -1}, 3},      {{0.1, -0.2, 0.9}, {0, 0, -1}, 1},
    {{0.1, -0.2, 0.401}, {0, 0, -1}, 1}, {{0.1, -0.2, 0.399}, {0, 0, -1}, 0.1f},
    {{0.13, -0.2, 0.3}, {0, 0, -1}, 1},  {{0.7, 0.7, -0.99}, {0, -0.6f, -0.8f}, 1},
};

// --- tests ----------------------------------------------------------------------------------

// The count of the areas is that of the fragments, and of the areas there are as many as wanted.
static void fragments_are_as_many_as_wanted(void **state)
{
    static const double shares[] = {0.003, 0.05, 0.5, 0.97, 1};
    pixels found;
    for (uint32_t camera = PERSPECTIVE; camera <= ORTHOGRAPHIC; camera++) {
        struct stage s = open_stage(*state, camera);
        set_lamps(&s, lamps, COUNT(lamps));
        for (uint32_t i = 0; i < COUNT(shares); i++) {
            const struct bd_splat_bound bound = splat(&s, shares[i], found);
            double wanted = shares[i] * PIXELS * COUNT(lamps);
            assert_int_equal(counted(found), bound.fragment_count);
            assert_true((double)bound.fragment_count <= wanted);
            // A row or a column of one splat is the least that the bound can take back.
            assert_true((double)bound.fragment_count >= wanted - 2 * WIDTH || shares[i] > 0.9);
        }
        assert_int_equal(counted(found), PIXELS * COUNT(lamps)); // no bound
        close_stage(&s);
    }
}

// The largest picture, and VPLs for several work groups: more fragments than 32 bits count.
static void counts_are_of_64_bits(void **state)
{
    struct stage s = open_stage(*state, PERSPECTIVE);
    struct lamp many[200];
    for (uint32_t i = 0; i < COUNT(many); i++) many[i] = lamps[0];
    set_lamps(&s, many, COUNT(many));
    s.view.viewpoint.width_px = s.view.viewpoint.height_px = 16384;
    const struct bd_vpl_list *lists[] = {&s.list, &s.list};
    const struct bd_gather_inputs inputs = {
        .scene = s.view.scene, .viewpoint = &s.view.viewpoint, .lists = lists, .list_count = 2};
    struct bd_splat_bound bound;
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_splat_bound_find(&s.view.context, &inputs, 1, &bound, &detail), 0);
    assert_true(bound.fragment_count == (UINT64_C(1) << 28) * 2 * COUNT(many));
    assert_int_equal(bd_splat_bound_find(&s.view.context, &inputs, 0.5, &bound, &detail), 0);
    ASSERT_REL((double)bound.fragment_count, 0x1p27 * 2 * COUNT(many), 1e-3);
    close_stage(&s);
}

// Squared distance of a pixel's surface from a lamp, in render units.
static double distance_squared(const struct stage *s, const struct lamp *lamp, int pixel,
                               float depth)
{
    const struct bd_viewpoint *v = &s->view.viewpoint;
    double scale = s->view.scene->space.render_per_m, z = depth / scale;
    double x = (2 * (pixel % WIDTH + 0.5) / WIDTH - 1) * v->half_width;
    double y = (1 - 2 * (pixel / WIDTH + 0.5) / HEIGHT) * v->half_height;
    if (!v->orthographic) x *= z, y *= z;
    bd_dvec3 at = bd_dvec3_add(v->position_m, bd_dvec3_scale(v->axis_x, x));
    at = bd_dvec3_add(at, bd_dvec3_scale(v->axis_y, y));
    at = bd_dvec3_sub(at, bd_dvec3_scale(v->axis_z, z));
    bd_dvec3 lamp_at = {lamp->at_m[0], lamp->at_m[1], lamp->at_m[2]};
    bd_dvec3 apart = bd_dvec3_scale(bd_dvec3_sub(at, lamp_at), scale);
    return bd_dvec3_dot(apart, apart);
}

// One VPL at a time: a pixel within three quarters of the ball's cross-section has all of its
// light, one outside has none.
static void the_ball_has_its_light_and_nothing_else_has(void **state)
{
    static const double shares[] = {0.02, 0.2, 0.6};
    pixels all, found;
    float depths[PIXELS];
    for (uint32_t camera = PERSPECTIVE; camera <= ORTHOGRAPHIC; camera++) {
        struct stage s = open_stage(*state, camera);
        uint32_t whole = 0, part = 0, none = 0;
        view_read(&s.view, s.view.gbuffer->depth, depths, sizeof depths);
        for (uint32_t i = 0; i < COUNT(lamps) * COUNT(shares); i++) {
            const struct lamp *lamp = &lamps[i / COUNT(shares)];
            set_lamps(&s, lamp, 1);
            splat(&s, 1, all);
            float bound = splat(&s, shares[i % COUNT(shares)], found).irradiance;
            double reach_squared = lamp->flux / (M_PI * bound);
            for (int p = 0; p < PIXELS; p++) {
                double left = 1 - distance_squared(&s, lamp, p, depths[p]) / reach_squared;
                double weight = fmin(fmax(4 * left, 0), 1);
                assert_true(fabs(found[p][1] - weight * all[p][1]) <= 1e-3 * all[p][1]);
                if (all[p][1] > 0) *(weight == 0 ? &none : weight < 1 ? &part : &whole) += 1;
            }
        }
        printf("    lit whole %u, in part %u, not at all %u\n", whole, part, none);
        assert_true(whole > 500 && part > 100 && none > 1000);
        close_stage(&s);
    }
}

// Straight ahead at a distance d a ball of radius r is seen at slopes up to r / sqrt(d^2 - r^2).
static void a_splat_is_as_large_as_its_ball(void **state)
{
    struct stage s = open_stage(*state, PERSPECTIVE);
    const struct lamp one = {{eye[0], eye[1], -1}, {0, 0, 1}, 1};
    pixels found;
    set_lamps(&s, &one, 1);
    const struct bd_splat_bound bound = splat(&s, 0.2, found);
    double reach_squared = one.flux / (M_PI * bound.irradiance);
    double distance = (eye[2] + 1) * s.view.scene->space.render_per_m;
    double slope = sqrt(reach_squared / (distance * distance - reach_squared));
    double columns = slope / s.view.viewpoint.half_width * WIDTH;
    double rows = slope / s.view.viewpoint.half_height * HEIGHT;
    printf("    %g by %g pixels, %g fragments\n", columns, rows, (double)bound.fragment_count);
    assert_true((double)bound.fragment_count >= (columns - 1) * (rows - 1));
    assert_true((double)bound.fragment_count <= (columns + 1) * (rows + 1));
    close_stage(&s);
}

static void compare(struct world *w, const char *const *a, const char *const *b, double tolerance)
{
    struct bd_image *gathered[BD_LAYER_COUNT], *splatted[BD_LAYER_COUNT];
    world_render(w, "rsm", PERSPECTIVE, WIDTH, HEIGHT, 1u << BD_LAYER_INDIRECT, a, gathered);
    world_render(w, "rsm_splat", PERSPECTIVE, WIDTH, HEIGHT, 1u << BD_LAYER_INDIRECT, b, splatted);
    double light = 0;
    for (int i = 0; i < 3 * PIXELS; i++) {
        double seen = splatted[BD_LAYER_INDIRECT]->pixels[i];
        double expected = gathered[BD_LAYER_INDIRECT]->pixels[i];
        assert_true(fabs(seen - expected) <= tolerance * expected);
        light += expected;
    }
    assert_true(light > 0);
    world_free_layers(gathered);
    world_free_layers(splatted);
}

static void without_a_bound_it_is_the_gather(void **state)
{
    static const char *const gather[] = {"vpls=600", NULL};
    static const char *const all[] = {"vpls=600", "splat_share=1", NULL};
    make_room(*state, 1);
    compare(*state, gather, all, 1e-5);
    make_room(*state, 0.3f); // with a specular lobe
    compare(*state, gather, all, 1e-5);
}

// The bound is searched in render space: lights and scenes of any size give the same splats.
static void the_bound_knows_no_units(void **state)
{
    static const char *const settings[] = {"vpls=96", "splat_share=0.05", NULL};
    struct bd_image *before[BD_LAYER_COUNT], *after[BD_LAYER_COUNT];
    struct world *w = *state;
    const uint32_t layer = 1u << BD_LAYER_INDIRECT;
    make_room(w, 1);
    world_render(w, "rsm_splat", PERSPECTIVE, WIDTH, HEIGHT, layer, settings, before);
    uint64_t fragments = w->report.counts.fragments;
    assert_true(fragments > 0 && fragments <= (uint64_t)(0.05 * 96 * PIXELS));
    make_room(w, 1);
    w->scene->lights[0].intensity = 0x1p-40f;
    world_render(w, "rsm_splat", PERSPECTIVE, WIDTH, HEIGHT, layer, settings, after);
    assert_int_equal(w->report.counts.fragments, fragments);
    for (int i = 0; i < 3 * PIXELS; i++)
        assert_true(after[BD_LAYER_INDIRECT]->pixels[i] ==
                    0x1p-40f * before[BD_LAYER_INDIRECT]->pixels[i]);
    world_free_layers(before);
    world_free_layers(after);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(fragments_are_as_many_as_wanted),
        cmocka_unit_test(counts_are_of_64_bits),
        cmocka_unit_test(the_ball_has_its_light_and_nothing_else_has),
        cmocka_unit_test(a_splat_is_as_large_as_its_ball),
        cmocka_unit_test(without_a_bound_it_is_the_gather),
        cmocka_unit_test(the_bound_knows_no_units),
    };
    return cmocka_run_group_tests(tests, world_open, world_close);
}
