// Frames cut into small slices, and set aside between them for others: the same bytes as in one go,
// of whatever technique, wherever they were interrupted.

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

#include "base/clock.h"
#include "base/sanitizer.h"
#include "world.h"

#define WIDTH  61
#define HEIGHT 47
#define SMALL  16 // side of the frames in between
#define WHOLE  1e12

static const double origin[3] = {0, 0, 0}, down[3] = {0, -1, 0};

// Rough and shining walls, a light of one face and one of six.
static void make_room(struct world *w)
{
    world_clear(w);
    int32_t grey = world_add_material(w, 0.5f), metal = world_add_material(w, 0.7f);
    w->scene->materials[metal].roughness = 0.2f;
    w->scene->materials[metal].metallic = 1;
    w->scene->materials[grey].emissive[0] = 0.1f;
    world_add_box_room(w, grey, origin, 1);
    const double wall[4][3] = {{-.6, -1, -.2}, {.3, -1, -.2}, {.3, .4, -.2}, {-.6, .4, -.2}};
    world_add_quad(w, metal, wall, 3);
    const double lamp[3] = {.3, .5, .2}, eye[3] = {.7, .4, .9};
    world_add_light(w, BD_LIGHT_POINT, lamp, down, 1);
    world_add_light(w, BD_LIGHT_SPOT, origin, down, 1);
    world_add_camera(w, eye, origin, 1.0);
    world_finish(w);
}

static struct bd_frame_request request_of(const char *technique, uint32_t width, uint32_t height)
{
    const char *const settings[] = {"shadow_size=64", "rsm_size=32", "vpls=192",
                                    "indirect_bounces=3"};
    struct bd_frame_request request = bd_frame_request_default;
    struct bd_err_detail detail;
    snprintf(request.technique, sizeof request.technique, "%s", technique);
    request.width_px = width;
    request.height_px = height;
    request.layers = (1u << BD_LAYER_RENDERED_COUNT) - 1;
    const bool splats = strstr(technique, "splat") != NULL;
    const int count = strcmp(technique, "direct") == 0 ? 1 : splats ? 3 : 4;
    for (int i = 0; i < count; i++)
        assert_int_equal(bd_param_list_add(&request.params, settings[i], &detail), BD_ERR_OK);
    return request;
}

static double cpu_ms(clockid_t clock)
{
    struct timespec now;
    assert_int_equal(clock_gettime(clock, &now), 0);
    return 1e3 * (double)now.tv_sec + 1e-6 * (double)now.tv_nsec;
}

struct outcome {
    struct bd_image *layers[BD_LAYER_COUNT];
    struct bd_report report;
    uint32_t width, height;
};

static void render(struct world *w, struct bd_scene *scene, const struct bd_frame_request *request,
                   enum bd_err (*should_stop)(void *), void *user, struct outcome *out)
{
    struct bd_err_detail detail = {0};
    *out = (struct outcome){.width = request->width_px, .height = request->height_px};
    if (bd_frame_render(&w->renderer, scene, request, should_stop, user, out->layers, &out->report,
                        &detail))
        fail_msg("%s: %s", detail.field, detail.message);
}

static void assert_same(const struct outcome *a, const struct outcome *b)
{
    const size_t channels[BD_LAYER_RENDERED_COUNT] = {4, 3, 3, 3, 3, 3, 1, 3, 1};
    for (int l = 0; l < BD_LAYER_RENDERED_COUNT; l++)
        assert_memory_equal(a->layers[l]->pixels, b->layers[l]->pixels,
                            a->width * a->height * channels[l] * sizeof(float));
}

static void forget_everything(struct world *w, double forced_units)
{
    bd_renderer_finish(&w->renderer);
    struct bd_gpu_memory memory;
    bd_gpu_memory(w->gpu, &memory);
    assert_int_equal(memory.used_bytes, 0);
    bd_renderer_init(&w->renderer, w->gpu, UINT64_C(1) << 30);
    w->renderer.slicer.forced_units = forced_units;
}

static const char *const techniques[] = {"direct",         "rsm", "rsm_splat", "multires_gather",
                                         "multires_splat", "isr", "hisr"};
#define TECHNIQUE_COUNT (sizeof techniques / sizeof techniques[0])
// Sanitizers look at what frames keep and give back; that bytes are the same, the other build says
// of all.
#define EVERY (BD_UNDER_SANITIZER ? 3 : 1)

// --- slices -----------------------------------------------------------------------------------

static void no_slicing_changes_a_byte(void **state)
{
    struct world *w = *state;
    make_room(w);
    for (size_t t = 0; t < TECHNIQUE_COUNT; t += EVERY) {
        const struct bd_frame_request request = request_of(techniques[t], WIDTH, HEIGHT);
        struct outcome whole, cut;
        forget_everything(w, WHOLE);
        render(w, w->scene, &request, NULL, NULL, &whole);
        const uint32_t few = w->renderer.slicer.slice_count;
        // A point that is splatted counts as many evaluations.
        forget_everything(w, strcmp(techniques[t], "multires_splat") == 0 ? 100000 : 3000);
        render(w, w->scene, &request, NULL, NULL, &cut);
        print_message("    %s: %u slices and %u\n", techniques[t], few,
                      w->renderer.slicer.slice_count);
        assert_same(&whole, &cut);
        assert_true(w->renderer.slicer.slice_count > few + 50);
        world_free_layers(whole.layers);
        world_free_layers(cut.layers);
    }
}

// Many nodes, one behind the other, each as large as the maps and the picture: what a slice holds
// follows what its triangles cover, which nobody knows before they are drawn.
static void make_stack(struct world *w, uint32_t nodes)
{
    world_clear(w);
    const double sheet[4][3] = {{-4, -4, 0}, {4, -4, 0}, {4, 4, 0}, {-4, 4, 0}};
    const double lamp[3] = {0, 0, 1}, forwards[3] = {0, 0, -1}, eye[3] = {0, 0, 2};
    int32_t mesh = world_add_quad(w, world_add_material(w, 0.5f), sheet, 1);
    world_add_placements(w, mesh, nodes - 1);
    world_add_light(w, BD_LIGHT_SPOT, lamp, forwards, 1);
    world_add_camera(w, eye, origin, 1.0);
    world_finish(w);
}

// Processor time of the process, device included: what else the machine does is not in it.
struct slices {
    double last_ms, longest_ms, all_ms;
    uint32_t count;
};

static enum bd_err note_slice(void *user)
{
    struct slices *slices = user;
    const double now_ms = cpu_ms(CLOCK_PROCESS_CPUTIME_ID), ms = now_ms - slices->last_ms;
    slices->last_ms = now_ms;
    slices->longest_ms = fmax(slices->longest_ms, ms);
    slices->all_ms += ms;
    slices->count++;
    return BD_ERR_OK;
}

// The longest time in which nobody was asked whether to go on, as a share of the frame's.
static double longest_share(struct world *w, const struct bd_frame_request *request)
{
    struct outcome out;
    forget_everything(w, 0);
    w->renderer.slicer = (struct bd_slicer){0};
    struct slices slices = {.last_ms = cpu_ms(CLOCK_PROCESS_CPUTIME_ID)};
    render(w, w->scene, request, note_slice, &slices, &out);
    world_free_layers(out.layers);
    print_message("    %u slices, the longest %.1f of %.1f ms of processor time\n", slices.count,
                  slices.longest_ms, slices.all_ms);
    return slices.longest_ms / slices.all_ms;
}

static void thousands_of_nodes_keep_slices_short(void **state)
{
    struct world *w = *state;
    make_stack(w, 1500);
    struct bd_frame_request request = bd_frame_request_default;
    struct bd_err_detail detail;
    snprintf(request.technique, sizeof request.technique, "direct");
    request.width_px = request.height_px = 64;
    assert_int_equal(bd_param_list_add(&request.params, "shadow_size=256", &detail), BD_ERR_OK);
    longest_share(w, &request); // programs are compiled
    assert_true(longest_share(w, &request) <= 0.1);
}

// Bringing that many meshes, no two alike, to the device and away from it.
static double upload_ms(struct world *w, uint32_t meshes)
{
    const float normals[9] = {0, 0, 1, 0, 0, 1, 0, 0, 1};
    const uint32_t indices[3] = {0, 1, 2};
    world_clear(w);
    int32_t grey = world_add_material(w, 0.5f);
    for (uint32_t i = 0; i < meshes; i++) {
        const float positions[9] = {0, 0, (float)i, 1, 0, (float)i, 0, 1, (float)i};
        world_add_mesh(w, grey, positions, normals, 3, indices, 3);
    }
    world_finish(w);
    struct bd_gpu_scene *scene = NULL;
    struct bd_err_detail detail;
    struct bd_uploader uploader = {.gpu = w->gpu};
    const double start_ms = cpu_ms(CLOCK_THREAD_CPUTIME_ID);
    assert_int_equal(bd_gpu_scene_create(&uploader, w->scene, &scene, &detail), BD_ERR_OK);
    bd_gpu_scene_destroy(&uploader, &scene);
    return cpu_ms(CLOCK_THREAD_CPUTIME_ID) - start_ms;
}

// What a stop in the middle of an upload takes away is not looked for again and again.
static void thousands_of_meshes_take_no_search(void **state)
{
    struct world *w = *state;
    upload_ms(w, 100);
    double few_ms = INFINITY, many_ms = INFINITY;
    for (int i = 0; i < 2; i++) {
        few_ms = fmin(few_ms, upload_ms(w, 2500));
        many_ms = fmin(many_ms, upload_ms(w, 40000));
    }
    print_message("    2,500 meshes %.1f ms, 40,000 %.1f ms of processor time\n", few_ms, many_ms);
    // Sixteen times as many, 256 times as long where each is looked for among all. On a busy
    // machine those that no cache holds take twice as long each.
    assert_true(many_ms < 64 * few_ms);
}

// --- interruptions ----------------------------------------------------------------------------

struct interruption {
    struct world *world;
    struct bd_scene *scene; // of the frames in between
    struct bd_frame_request requests[2];
    struct outcome expected[2];
    uint32_t every, asked, count;
    double ms;
};

static enum bd_err interrupt(void *user)
{
    struct interruption *i = user;
    struct bd_renderer *renderer = &i->world->renderer;
    if (++i->asked % i->every != 0) return BD_ERR_OK;
    const uint32_t which = i->count++ % 2;
    const uint64_t start_ns = bd_clock_ns();
    struct bd_suspended_frame suspended;
    struct outcome between;
    bd_renderer_suspend(renderer, &suspended);
    render(i->world, i->scene, &i->requests[which], NULL, NULL, &between);
    bd_renderer_resume(renderer, &suspended);
    i->ms += bd_ms_since(start_ns);
    assert_same(&between, &i->expected[which]);
    world_free_layers(between.layers);
    return BD_ERR_OK;
}

// Frames in between, one of them taking nothing over: what the frame aside uses must stay.
static struct interruption interruption_of(struct world *w, struct bd_scene *scene)
{
    struct interruption i = {.world = w, .scene = scene};
    i.requests[0] = request_of("hisr", SMALL, SMALL);
    i.requests[1] = request_of("rsm_splat", SMALL, SMALL);
    i.requests[1].fresh = BD_FRESH_ALL;
    i.requests[1].aa = 2;
    for (int k = 0; k < 2; k++) render(w, scene, &i.requests[k], NULL, NULL, &i.expected[k]);
    return i;
}

static double ms_of_passes(const struct bd_report *report)
{
    double ms = 0;
    for (uint32_t p = 0; p < report->pass_count; p++) ms += report->passes[p].ms;
    return ms;
}

static void interrupt_all(struct world *w, struct bd_scene *scene, uint32_t every, size_t step)
{
    struct interruption i = interruption_of(w, scene);
    i.every = every;
    for (size_t t = 0; t < TECHNIQUE_COUNT; t += step) {
        struct bd_frame_request request = request_of(techniques[t], WIDTH, HEIGHT);
        struct outcome whole, interrupted;
        forget_everything(w, WHOLE);
        render(w, w->scene, &request, NULL, NULL, &whole);
        forget_everything(w, 0);
        i.asked = i.count = 0, i.ms = 0;
        const uint64_t start_ns = bd_clock_ns();
        render(w, w->scene, &request, interrupt, &i, &interrupted);
        const double all_ms = bd_ms_since(start_ns), own_ms = interrupted.report.time_ms.total;
        print_message("    %s: set aside %u times of %u, %.1f of %.1f ms its own, passes %.1f\n",
                      techniques[t], i.count, i.asked, own_ms, all_ms,
                      ms_of_passes(&interrupted.report));

        assert_same(&whole, &interrupted);
        assert_true(i.count >= 3);
        assert_true(own_ms > 0 && own_ms < all_ms - 0.5 * i.ms);
        assert_true(ms_of_passes(&interrupted.report) <= own_ms);
        world_free_layers(whole.layers);
        world_free_layers(interrupted.layers);
    }
    for (int k = 0; k < 2; k++) world_free_layers(i.expected[k].layers);
}

static void frames_of_the_same_scene_in_between_change_no_byte(void **state)
{
    struct world *w = *state;
    make_room(w);
    interrupt_all(w, w->scene, 5, EVERY);
}

// The uploaded scene is shared and holds the light's unit, which is another there.
static void frames_under_other_lights_in_between_change_no_byte(void **state)
{
    struct world *w = *state;
    make_room(w);
    struct bd_scene *darker = bd_scene_retain(w->scene);
    make_room(w);
    for (uint32_t l = 0; l < w->scene->light_count; l++) w->scene->lights[l].intensity *= 1000;
    // As an edit of the lights alone leaves them.
    for (uint32_t i = 0; i < BD_ASPECT_COUNT; i++)
        if (i != BD_ASPECT_LIGHTS) w->scene->aspects.counter[i] = darker->aspects.counter[i];
    interrupt_all(w, darker, 7, 2);
    bd_scene_release(&darker);
}

// Three deep, each frame in the middle of the one before it.
struct nest {
    struct world *world;
    uint32_t depth;
    const struct outcome *expected;
};

static enum bd_err go_deeper(void *user)
{
    struct nest *nest = user;
    if (nest->depth == 0) return BD_ERR_OK;
    struct nest inner = {nest->world, nest->depth - 1, nest->expected};
    nest->depth = 0;
    struct bd_suspended_frame suspended;
    const struct bd_frame_request request = request_of("multires_splat", SMALL, SMALL);
    struct outcome between;
    bd_renderer_suspend(&nest->world->renderer, &suspended);
    render(nest->world, nest->world->scene, &request, go_deeper, &inner, &between);
    bd_renderer_resume(&nest->world->renderer, &suspended);
    assert_same(&between, nest->expected);
    world_free_layers(between.layers);
    return BD_ERR_OK;
}

static void frames_in_frames_in_frames(void **state)
{
    struct world *w = *state;
    make_room(w);
    const struct bd_frame_request request = request_of("multires_splat", SMALL, SMALL);
    struct outcome expected, outer;
    render(w, w->scene, &request, NULL, NULL, &expected);
    forget_everything(w, 0);
    struct nest nest = {w, 3, &expected};
    render(w, w->scene, &request, go_deeper, &nest, &outer);
    assert_same(&outer, &expected);
    world_free_layers(expected.layers);
    world_free_layers(outer.layers);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_slicing_changes_a_byte),
        cmocka_unit_test(thousands_of_nodes_keep_slices_short),
        cmocka_unit_test(thousands_of_meshes_take_no_search),
        cmocka_unit_test(frames_of_the_same_scene_in_between_change_no_byte),
        cmocka_unit_test(frames_under_other_lights_in_between_change_no_byte),
        cmocka_unit_test(frames_in_frames_in_frames),
    };
    return cmocka_run_group_tests(tests, world_open, world_close);
}
