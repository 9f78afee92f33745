// Frames that cannot be finished: too little memory, too many triangles, a stop at every place
// where one is asked for. Each ends with one clear error, gives back what it took, and the next
// frame is as if it had never been.

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "world.h"

#define SIDE 32

static const double origin[3] = {0, 0, 0}, down[3] = {0, -1, 0};

static void make_room(struct world *w)
{
    world_clear(w);
    int32_t grey = world_add_material(w, 0.5f);
    w->scene->materials[grey].roughness = 0.3f; // for the specular lobe's targets
    w->scene->materials[grey].emissive[0] = 0.1f;
    world_add_box_room(w, grey, origin, 1);
    const double lamp[3] = {.3, .5, .2}, eye[3] = {.7, .4, .9};
    world_add_light(w, BD_LIGHT_POINT, lamp, down, 1);
    world_add_light(w, BD_LIGHT_SPOT, origin, down, 1);
    world_add_camera(w, eye, origin, 1.0);
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_scene_finish(w->scene, &detail), BD_ERR_OK);
    w->finished = true;
}

static struct bd_frame_request small_request(void)
{
    const char *const settings[] = {"vpls=96", "rsm_size=32", "shadow_size=64"};
    struct bd_frame_request request = bd_frame_request_default;
    struct bd_err_detail detail;
    request.width_px = request.height_px = SIDE;
    request.layers = (1u << BD_LAYER_RENDERED_COUNT) - 1;
    for (int i = 0; i < 3; i++)
        assert_int_equal(bd_param_list_add(&request.params, settings[i], &detail), BD_ERR_OK);
    return request;
}

struct outcome {
    enum bd_err err;
    struct bd_err_detail detail;
    struct bd_image *layers[BD_LAYER_COUNT];
};

static struct outcome render(struct world *w, enum bd_err (*should_stop)(void *), void *user)
{
    const struct bd_frame_request request = small_request();
    struct outcome o = {0};
    o.err = bd_frame_render(&w->renderer, w->scene, &request, should_stop, user, o.layers,
                            &w->report, &o.detail);
    for (int l = 0; l < BD_LAYER_RENDERED_COUNT; l++)
        assert_true((o.layers[l] != NULL) == (o.err == 0));
    return o;
}

static void assert_same_frame(const struct outcome *a, const struct outcome *b)
{
    const size_t channels[BD_LAYER_RENDERED_COUNT] = {4, 3, 3, 3, 3, 3, 1, 3, 1};
    assert_int_equal(a->err, BD_ERR_OK);
    assert_int_equal(b->err, BD_ERR_OK);
    for (int l = 0; l < BD_LAYER_RENDERED_COUNT; l++)
        assert_memory_equal(a->layers[l]->pixels, b->layers[l]->pixels,
                            SIDE * SIDE * channels[l] * sizeof(float));
}

static void forget_everything(struct world *w)
{
    bd_renderer_finish(&w->renderer);
    struct bd_gpu_memory memory;
    bd_gpu_memory(w->gpu, &memory);
    assert_int_equal(memory.used_bytes, 0);
    bd_renderer_init(&w->renderer, w->gpu, UINT64_C(1) << 30);
}

// --- memory -----------------------------------------------------------------------------------

// From far too little to enough, in steps small enough to fail at every creation of the frame.
static void too_little_memory_is_told_and_given_back(void **state)
{
    struct world *w = *state;
    make_room(w);
    struct outcome whole = render(w, NULL, NULL);
    uint64_t peak = (uint64_t)(w->report.memory_gpu_peak_mib * (1 << 20)) + 1;
    int failed = 0, rendered = 0;
    for (uint64_t limit = 100; limit < peak + peak / 64; limit += limit < 8192 ? 300 : peak / 64) {
        forget_everything(w);
        bd_gpu_set_memory_limit(w->gpu, limit);
        struct outcome o = render(w, NULL, NULL);
        if (o.err) {
            failed++;
            assert_int_equal(o.err, BD_ERR_NO_MEMORY);
            assert_string_equal(o.detail.field, "gpu_memory");
            assert_non_null(strstr(o.detail.message, "MiB allowed"));
            bd_gpu_set_memory_limit(w->gpu, 0);
            o = render(w, NULL, NULL); // with what the failed one left in the memo
        } else {
            rendered++;
        }
        assert_same_frame(&whole, &o);
        world_free_layers(o.layers);
    }
    bd_gpu_set_memory_limit(w->gpu, 0);
    print_message("    peak %.2f MiB: %d limits too small, %d enough\n",
                  w->report.memory_gpu_peak_mib, failed, rendered);
    assert_true(failed > 50 && rendered > 0);
    forget_everything(w);
    world_free_layers(whole.layers);
}

// --- stops ------------------------------------------------------------------------------------

static enum bd_err stop_when_counted_down(void *user)
{
    int *left = user;
    return (*left)-- > 0 ? BD_ERR_OK : BD_ERR_CANCELLED;
}

static void a_stop_anywhere_leaves_no_trace(void **state)
{
    struct world *w = *state;
    make_room(w);
    struct outcome whole = render(w, NULL, NULL);
    int stops = 0;
    for (enum bd_err err = BD_ERR_CANCELLED; err == BD_ERR_CANCELLED; stops++) {
        forget_everything(w);
        int left = stops;
        struct outcome stopped = render(w, stop_when_counted_down, &left);
        err = stopped.err;
        struct outcome after = render(w, NULL, NULL);
        assert_same_frame(&whole, &after);
        world_free_layers(stopped.layers);
        world_free_layers(after.layers);
    }
    print_message("    stopped at %d places\n", stops - 1);
    assert_true(stops > 20);
    forget_everything(w);
    world_free_layers(whole.layers);
}

// --- slices -----------------------------------------------------------------------------------

// In slices of so many units of work, from a memo without outputs.
static struct outcome render_at(struct world *w, double units_per_slice)
{
    forget_everything(w);
    w->renderer.slicer.forced_units = units_per_slice;
    return render(w, NULL, NULL);
}

// 9,800 triangles five times, of which one lies in front: cut into parts, drawn in bands.
static void slices_change_no_byte(void **state)
{
    struct world *w = *state;
    world_clear(w);
    int32_t grey = world_add_material(w, 0.5f);
    const double corners[4][3] = {{-1, 0, 1}, {1, 0, 1}, {1, 0, -1}, {-1, 0, -1}};
    world_add_quad(w, grey, corners, 70);
    world_add_placements(w, 0, 4);
    for (uint32_t i = 0; i < w->scene->node_count; i++) {
        w->scene->nodes[i].parent_from_node.m[12] = 0.4 * i - 0.8;
        w->scene->nodes[i].parent_from_node.m[13] = i == 3 ? 0.3 : 0.01 * i;
    }
    const double lamp[3] = {.3, 1, .2}, eye[3] = {.7, 1.4, .9};
    world_add_light(w, BD_LIGHT_POINT, lamp, down, 1);
    world_add_camera(w, eye, origin, 1.0);
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_scene_finish(w->scene, &detail), BD_ERR_OK);
    w->finished = true;
    struct outcome whole = render_at(w, 1e12);
    uint32_t few = w->renderer.slicer.slice_count;
    struct outcome cut = render_at(w, 20000);
    uint32_t many = w->renderer.slicer.slice_count;
    print_message("    %u slices and %u\n", few, many);
    assert_same_frame(&whole, &cut);
    // Two sets of six faces and the camera, each in 50 parts or more.
    assert_true(many > few + 13 * 40);
    world_free_layers(whole.layers);
    world_free_layers(cut.layers);
}

// --- triangles --------------------------------------------------------------------------------

// A mesh of 2^17 triangles, placed until the device cannot address them all.
static void more_triangles_than_a_shader_can_index(void **state)
{
    struct world *w = *state;
    world_clear(w);
    const double corners[4][3] = {{-1, 0, 1}, {1, 0, 1}, {1, 0, -1}, {-1, 0, -1}};
    world_add_quad(w, world_add_material(w, 0.5f), corners, 256);
    uint64_t most = bd_gpu_caps(w->gpu)->array_max_bytes / 48;
    world_add_placements(w, 0, (uint32_t)(most / (2 * 256 * 256)));
    const double eye[3] = {0, 1, 0};
    world_add_camera(w, eye, origin, 1.0);
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_scene_finish(w->scene, &detail), BD_ERR_OK);
    w->finished = true;
    struct outcome o = render(w, NULL, NULL);
    assert_int_equal(o.err, BD_ERR_LIMIT);
    print_message("    %s: %s\n", o.detail.field, o.detail.message);
    assert_string_equal(o.detail.field, "scene");
    make_room(w);
    struct outcome after = render(w, NULL, NULL);
    assert_int_equal(after.err, BD_ERR_OK);
    world_free_layers(after.layers);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(too_little_memory_is_told_and_given_back),
        cmocka_unit_test(a_stop_anywhere_leaves_no_trace),
        cmocka_unit_test(slices_change_no_byte),
        cmocka_unit_test(more_triangles_than_a_shader_can_index),
    };
    return cmocka_run_group_tests(tests, world_open, world_close);
}
