// The scheduler with a real device: order, cancel, deadlines, a lost device. Exits with 77 where
// there is no EGL.

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>
#include <epoxy/gl.h>

#include "base/clock.h"
#include "base/sanitizer.h"
#include "sched/sched.h"
#include "world.h"

static struct bd_sched *create_sched(uint32_t lose_after)
{
    const struct bd_sched_options options = {
        .device = "auto",
        .queue_length_max = 8,
        .frame_limits = {.side_px_max = 4096, .pixel_count_max = 1u << 24},
        .lose_device_after_slices = lose_after,
    };
    struct bd_sched *sched;
    struct bd_err_detail detail = {0};
    if (bd_sched_create(&options, &sched, &detail)) {
        fprintf(stderr, "skipped: %s\n", detail.message);
        exit(77);
    }
    return sched;
}

// A closed room with a lamp: every pixel has indirect light to gather.
static struct bd_scene *create_scene(void)
{
    struct world builder = {.scene = bd_scene_create()};
    const double origin[3] = {0, 0, 0}, down[3] = {0, -1, 0}, eye[3] = {.5, .5, .9};
    world_add_box_room(&builder, world_add_material(&builder, 0.5f), origin, 1);
    world_add_light(&builder, BD_LIGHT_POINT, origin, down, 1);
    world_add_camera(&builder, eye, origin, 1.2);
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_scene_finish(builder.scene, &detail), BD_ERR_OK);
    return builder.scene;
}

static struct bd_job_request request_of(struct bd_scene *scene, uint32_t side_px, const char *vpls)
{
    struct bd_job_request request = {.scene = scene, .frame = bd_frame_request_default};
    struct bd_err_detail detail;
    request.frame.width_px = request.frame.height_px = side_px;
    assert_int_equal(bd_param_list_add(&request.frame.params, vpls, &detail), BD_ERR_OK);
    return request;
}

static struct bd_job *submit(struct bd_sched *sched, const struct bd_job_request *request)
{
    struct bd_job *job;
    struct bd_err_detail detail = {0};
    if (bd_sched_submit(sched, request, &job, &detail)) fail_msg("%s", detail.message);
    return job;
}

static void a_lost_device_changes_no_byte(void **state)
{
    (void)state;
    struct bd_scene *scene = create_scene();
    const struct bd_job_request request = request_of(scene, 64, "vpls=384");
    float *expected = NULL;
    const uint32_t lose_after[] = {0, 2, 9};
    for (int i = 0; i < 3; i++) {
        struct bd_sched *sched = create_sched(lose_after[i]);
        struct bd_job *job = submit(sched, &request);
        bd_job_wait(job);
        const struct bd_job_result *result = bd_job_result(job);
        assert_int_equal(result->err, BD_ERR_OK);
        struct bd_sched_stats stats;
        bd_sched_stats(sched, &stats);
        assert_int_equal(stats.device_losses, i > 0);
        assert_true(stats.device_ok);
        const size_t bytes = 64 * 64 * 4 * sizeof(float);
        if (!expected) {
            expected = malloc(bytes);
            memcpy(expected, result->layers[0]->pixels, bytes);
        }
        assert_memory_equal(expected, result->layers[0]->pixels, bytes);
        bd_job_release(&job);
        bd_sched_destroy(&sched);
    }
    free(expected);
    bd_scene_release(&scene);
}

// Leaves the next frame calls that GL refuses. On the render thread, whose context is current.
static void delete_the_programs(void *user, struct bd_job *job)
{
    (void)user, (void)job;
    glUseProgram(0); // one in use lives on
    for (GLuint id = 1; id < 1000; id++)
        if (glIsProgram(id)) glDeleteProgram(id);
}

static void a_failed_call_fails_no_later_frame(void **state)
{
    struct bd_sched *sched = *state;
    struct bd_scene *scene = create_scene();
    struct bd_job_request request = request_of(scene, 32, "vpls=96");
    for (int i = 0; i < 3; i++) {
        request.done = i == 0 ? delete_the_programs : NULL;
        struct bd_job *job = submit(sched, &request);
        bd_job_wait(job);
        assert_int_equal(bd_job_result(job)->err, BD_ERR_OK);
        bd_job_release(&job);
    }
    struct bd_sched_stats stats;
    bd_sched_stats(sched, &stats);
    assert_true(stats.device_ok);
    assert_int_equal(stats.device_losses, 0);
    bd_scene_release(&scene);
}

static void sleep_ms(long ms)
{
    const struct timespec time = {ms / 1000, ms % 1000 * 1000000};
    nanosleep(&time, NULL);
}

#define PATIENCE (BD_UNDER_SANITIZER ? 4 : 1) // the host's share of a slice is that much slower

// Milliseconds from the cancel of a long job, `after_ms` into it, to its end.
static double cancel_latency_ms(struct bd_sched *sched, const struct bd_job_request *request,
                                int after_ms)
{
    struct bd_job *job = submit(sched, request);
    sleep_ms(after_ms);
    uint64_t start_ns = bd_clock_ns();
    bd_job_cancel(job);
    bd_job_wait(job);
    double ms = bd_ms_since(start_ns);
    assert_int_equal(bd_job_result(job)->err, BD_ERR_CANCELLED);
    assert_int_equal(bd_job_result(job)->report.stopped, BD_STOPPED_CANCELLED);
    assert_null(bd_job_result(job)->layers[0]);
    bd_job_release(&job);
    return ms;
}

// With a warm cache, within 0.5 s on the software device, 0.1 s on hardware, in whichever pass. The
// best of three each: what other processes take of the machine is not ours.
static void a_cancelled_job_ends_soon(void **state)
{
    struct bd_sched *sched = *state;
    struct bd_scene *scene = create_scene();
    const struct bd_job_request warm = request_of(scene, 32, "vpls=384");
    struct bd_job *job = submit(sched, &warm);
    bd_job_wait(job);
    bd_job_release(&job);
    struct bd_sched_stats stats;
    bd_sched_stats(sched, &stats);
    const struct bd_job_request request = request_of(scene, 2048, "vpls=1000000");
    const int after_ms[] = {100, 300, 700, 1100};
    for (int i = 0; i < 4; i++) {
        double best = INFINITY;
        for (int k = 0; k < 3; k++)
            best = fmin(best, cancel_latency_ms(sched, &request, after_ms[i]));
        print_message("    cancelled after %d ms: ended %.0f ms later\n", after_ms[i], best);
        assert_true(best < PATIENCE * (stats.software ? 500 : 100));
    }
    bd_scene_release(&scene);
}

static void a_deadline_is_kept(void **state)
{
    struct bd_sched *sched = *state;
    struct bd_scene *scene = create_scene();
    struct bd_job_request request = request_of(scene, 2048, "vpls=1000000");
    request.frame.deadline_ms = 400;
    double best = INFINITY;
    for (int k = 0; k < 3; k++) {
        uint64_t start_ns = bd_clock_ns();
        struct bd_job *job = submit(sched, &request);
        bd_job_wait(job);
        best = fmin(best, bd_ms_since(start_ns));
        assert_int_equal(bd_job_result(job)->err, BD_ERR_DEADLINE);
        assert_int_equal(bd_job_result(job)->report.stopped, BD_STOPPED_DEADLINE);
        assert_string_equal(bd_job_result(job)->detail.field, "deadline_ms");
        bd_job_release(&job);
    }
    print_message("    deadline of 400 ms: ended after %.0f ms\n", best);
    assert_true(best >= 400 && best < 400 + PATIENCE * 500);
    bd_scene_release(&scene);
}

// What it comes to with that deadline, 0 = none; the picture is the caller's.
static struct bd_image *render_within(struct bd_sched *sched, struct bd_job_request *request,
                                      uint32_t deadline_ms, struct bd_report *report)
{
    request->accepts_cheaper = deadline_ms > 0;
    request->frame.deadline_ms = deadline_ms;
    struct bd_job *job = submit(sched, request);
    bd_job_wait(job);
    const struct bd_job_result *result = bd_job_result(job);
    if (result->err) fail_msg("%s", result->detail.message);
    *report = result->report;
    struct bd_image *image = bd_image_create(64, 64, 4);
    memcpy(image->pixels, result->layers[0]->pixels, 64 * 64 * 4 * sizeof(float));
    bd_job_release(&job);
    return image;
}

static void assert_same_picture(struct bd_image *a, struct bd_image *b)
{
    assert_memory_equal(a->pixels, b->pixels, 64 * 64 * 4 * sizeof(float));
    bd_image_destroy(&a);
    bd_image_destroy(&b);
}

static void a_cheaper_frame_stands_in(void **state)
{
    struct bd_sched *sched = *state;
    struct bd_scene *scene = create_scene();
    struct bd_report report;
    struct bd_job_request cheap = request_of(scene, 64, "vpls=16");
    struct bd_job_request asked = request_of(scene, 64, "vpls=4000000");
    strcpy(cheap.frame.technique, "rsm");
    strcpy(asked.frame.technique, "rsm");
    struct bd_image *expected = render_within(sched, &cheap, 0, &report);
    struct bd_image *got = render_within(sched, &asked, PATIENCE * 1000, &report);
    assert_same_picture(expected, got);
    assert_int_equal(report.stopped, BD_STOPPED_DEADLINE);
    assert_int_equal(report.flag_count > 0, true);
    assert_non_null(strstr(report.flags[report.flag_count - 1], "deadline_rung: "));
    assert_non_null(strstr(report.flags[report.flag_count - 1], "rendered with vpls=16"));

    asked = request_of(scene, 64, "vpls=384");
    strcpy(asked.frame.technique, "rsm");
    expected = render_within(sched, &asked, 0, &report);
    got = render_within(sched, &asked, 600000, &report);
    assert_same_picture(expected, got);
    assert_int_equal(report.stopped, BD_STOPPED_COMPLETE);
    for (uint32_t i = 0; i < report.flag_count; i++)
        assert_null(strstr(report.flags[i], "deadline"));
    bd_scene_release(&scene);
}

static atomic_int ended_count;
static int ended_order[4];

static void note_end(void *user, struct bd_job *job)
{
    (void)job;
    ended_order[atomic_fetch_add(&ended_count, 1)] = *(const int *)user;
}

static void higher_priority_goes_first(void **state)
{
    struct bd_sched *sched = *state;
    struct bd_scene *scene = create_scene();
    static const int ids[4] = {0, 1, 2, 3}, priorities[4] = {0, 0, 10, 0};
    struct bd_job *jobs[4];
    atomic_store(&ended_count, 0);
    for (int i = 0; i < 4; i++) {
        // The first is long enough for the others to be waiting when it ends.
        struct bd_job_request request = request_of(scene, i == 0 ? 512 : 16, "vpls=384");
        request.priority = priorities[i];
        request.done = note_end;
        request.user = (void *)&ids[i];
        jobs[i] = submit(sched, &request);
        if (i == 0) sleep_ms(50);
    }
    for (int i = 0; i < 4; i++) bd_job_wait(jobs[i]);
    for (int i = 0; i < 4; i++) {
        assert_int_equal(bd_job_result(jobs[i])->err, BD_ERR_OK);
        assert_non_null(bd_job_result(jobs[i])->layers[BD_LAYER_BEAUTY]);
    }
    for (int i = 0; i < 4; i++) bd_job_release(&jobs[i]);
    while (atomic_load(&ended_count) < 4) sleep_ms(1); // `done` comes after the wait's end
    const int expected[4] = {2, 0, 1, 3};              // the long one gives way, and begins anew
    assert_memory_equal(ended_order, expected, sizeof expected);
    bd_scene_release(&scene);
}

static void a_full_queue_says_so(void **state)
{
    struct bd_sched *sched = *state;
    struct bd_scene *scene = create_scene();
    const struct bd_job_request request = request_of(scene, 1024, "vpls=100000");
    struct bd_job *jobs[16];
    struct bd_err_detail detail = {0};
    int count = 0;
    while (count < 16 && !bd_sched_submit(sched, &request, &jobs[count], &detail)) count++;
    assert_int_equal(detail.err, BD_ERR_BUSY);
    assert_true(count == 8 || count == 9); // one may be running already
    for (int i = 0; i < count; i++) bd_job_cancel(jobs[i]);
    for (int i = 0; i < count; i++) bd_job_wait(jobs[i]);
    for (int i = 0; i < count; i++) bd_job_release(&jobs[i]);
    bd_scene_release(&scene);
}

static void oversize_is_refused_by_name(void **state)
{
    struct bd_scene *scene = create_scene();
    struct bd_job_request request = request_of(scene, 4097, "vpls=96");
    struct bd_job *job;
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_sched_submit(*state, &request, &job, &detail), BD_ERR_LIMIT);
    assert_string_equal(detail.field, "size");
    bd_scene_release(&scene);
}

static bool is_reused(const struct bd_report *report, const char *pass)
{
    for (uint32_t p = 0; p < report->pass_count; p++)
        if (strcmp(report->passes[p].name, pass) == 0)
            return report->passes[p].state == BD_PASS_REUSED;
    fail_msg("no pass %s", pass);
    return false;
}

static bool was_reused(const struct bd_job *job, const char *pass)
{
    return is_reused(&bd_job_result(job)->report, pass);
}

static struct bd_job *rendered(struct bd_sched *sched, const struct bd_job_request *request)
{
    struct bd_job *job = submit(sched, request);
    bd_job_wait(job);
    assert_int_equal(bd_job_result(job)->err, BD_ERR_OK);
    return job;
}

// What a pose sees follows from its numbers, and so does what is reused.
static void a_pose_sees_what_its_camera_sees(void **state)
{
    struct bd_scene *scene = create_scene();
    struct bd_job_request request = request_of(scene, 32, "vpls=96");
    struct bd_job *by_camera = rendered(*state, &request);
    const struct bd_placement *placed = &scene->placed_cameras[0];
    request.frame.pose = (struct bd_pose){
        .is_set = true,
        .eye_m = placed->position,
        .target_m = bd_dvec3_sub(placed->position, bd_dvec3_scale(placed->axis_z, 0.3)),
        .up = bd_dvec3_scale(placed->axis_y, 7),
    };
    struct bd_job *by_pose = rendered(*state, &request), *again = rendered(*state, &request);
    request.frame.pose.eye_m.x += 1e-3;
    struct bd_job *moved = rendered(*state, &request);
    const float *a = bd_job_result(by_camera)->layers[BD_LAYER_BEAUTY]->pixels;
    const float *b = bd_job_result(by_pose)->layers[BD_LAYER_BEAUTY]->pixels;
    for (int i = 0; i < 32 * 32 * 4; i++) assert_true(fabsf(a[i] - b[i]) <= 1e-3f * (1 + a[i]));
    assert_string_equal(bd_job_result(by_pose)->report.camera, "pose");
    assert_true(was_reused(again, "gbuffer") && !was_reused(moved, "gbuffer"));
    assert_true(was_reused(moved, "light_paths")); // the light has not moved
    bd_job_release(&by_camera);
    bd_job_release(&by_pose);
    bd_job_release(&again);
    bd_job_release(&moved);
    bd_scene_release(&scene);
}

// Lit by a small panel, whose light is drawn by chance.
static struct bd_scene *create_noisy_scene(void)
{
    const double origin[3] = {0, 0, 0}, eye[3] = {0.6, 0.4, 0.7};
    const double panel[4][3] = {{-.2, .9, -.2}, {.2, .9, -.2}, {.2, .9, .2}, {-.2, .9, .2}};
    struct world builder = {0};
    world_clear(&builder);
    world_add_box_room(&builder, world_add_material(&builder, 0.9f), origin, 1);
    const int32_t glowing = world_add_material(&builder, 0);
    for (int c = 0; c < 3; c++) builder.scene->materials[glowing].emissive[c] = 2;
    world_add_quad(&builder, glowing, panel, 1);
    world_add_camera(&builder, eye, origin, 1.2);
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_scene_finish(builder.scene, &detail), BD_ERR_OK);
    return builder.scene;
}

static struct bd_job_request noisy_request(struct bd_scene *scene)
{
    struct bd_job_request request = request_of(scene, 64, "noise_filter=off");
    assert_int_equal(bd_param_list_add(&request.frame.params, "rays=2", NULL), BD_ERR_OK);
    assert_int_equal(bd_param_list_add(&request.frame.params, "far_rays=2", NULL), BD_ERR_OK);
    return request;
}

static bool has_flag(const struct bd_report *report, const char *name)
{
    for (uint32_t i = 0; i < report->flag_count; i++)
        if (strcmp(report->flags[i], name) == 0) return true;
    return false;
}

static const char *value_of(const struct bd_report *report, const char *key)
{
    for (uint32_t i = 0; i < report->params.count; i++)
        if (strcmp(report->params.pairs[i].key, key) == 0) return report->params.pairs[i].value;
    fail_msg("%s is not read", key);
    return NULL;
}

// Two rays of either kind, and no filter, are too noisy: it goes on until it thinks that it is good
// enough. What it ended with has the same bytes when it is asked for.
static void auto_is_content_with_little_doubt(void **state)
{
    struct bd_scene *scene = create_noisy_scene();
    struct bd_report report, again;
    struct bd_job_request request = noisy_request(scene);
    request.improves = true;
    request.frame.aa = 4;
    struct bd_image *improved = render_within(*state, &request, 0, &report);
    print_message("    %s rays=%s, %.2f %% by its own estimate\n", report.technique,
                  value_of(&report, "rays"), 100 * report.own_estimate);
    assert_string_equal(report.technique, "many_light");
    assert_int_equal(report.aa, 4);
    assert_true(report.own_estimate > 0 && report.own_estimate <= 0.05);
    assert_true(atoi(value_of(&report, "rays")) > 2);
    assert_false(has_flag(&report, "chosen_by_clock"));
    request.frame.params = report.params;
    request.improves = false;
    strcpy(request.frame.technique, report.technique);
    assert_same_picture(improved, render_within(*state, &request, 0, &again));
    // Who names a technique gets what he asked for; so does who cannot wait for a second frame.
    request = noisy_request(scene);
    bd_image_destroy(&(struct bd_image *){render_within(*state, &request, 0, &report)});
    assert_string_equal(value_of(&report, "rays"), "2");
    assert_true(report.own_estimate > 0.05);
    request.improves = true;
    strcpy(request.frame.technique, "many_light");
    bd_image_destroy(&(struct bd_image *){render_within(*state, &request, 0, &again)});
    assert_string_equal(value_of(&again, "rays"), "2");
    bd_scene_release(&scene);
}

// What a pilot tells of a picture need not be found out by rendering all of it: its one G-buffer
// was made for the frame that is the answer. Pictures that are too small have none, nor have those
// with a deadline; nor do its size and layers show.
static void a_pilot_finds_the_rung(void **state)
{
    struct bd_scene *scene = create_noisy_scene();
    static const struct {
        uint32_t side_px, deadline_ms;
        bool has_pilot;
    } cases[] = {{364, 0, true}, {160, 0, false}, {368, 3600000, false}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct bd_job_request request = noisy_request(scene);
        request.frame.width_px = cases[i].side_px;
        request.frame.height_px = cases[i].side_px + 1;
        request.frame.deadline_ms = cases[i].deadline_ms;
        request.frame.layers |= 1u << BD_LAYER_NORMAL;
        request.improves = true;
        assert_int_equal(bd_param_list_add(&request.frame.params, "vpls=32", NULL), BD_ERR_OK);
        struct bd_job *job = rendered(*state, &request);
        const struct bd_report *report = &bd_job_result(job)->report;
        const struct bd_image *beauty = bd_job_result(job)->layers[BD_LAYER_BEAUTY];
        print_message("    %u px: rays=%s, %.2f %% by its own estimate, G-buffer %s\n",
                      cases[i].side_px, value_of(report, "rays"), 100 * report->own_estimate,
                      is_reused(report, "gbuffer") ? "reused" : "made");
        assert_int_equal(beauty->width_px, cases[i].side_px);
        assert_int_equal(beauty->height_px, cases[i].side_px + 1);
        assert_non_null(bd_job_result(job)->layers[BD_LAYER_NORMAL]);
        assert_true(atoi(value_of(report, "rays")) > 2 && report->own_estimate <= 0.05);
        assert_int_equal(is_reused(report, "gbuffer"), !cases[i].has_pilot);
        request.frame.params = report->params;
        request.improves = false;
        strcpy(request.frame.technique, report->technique);
        struct bd_job *again = rendered(*state, &request);
        assert_memory_equal(beauty->pixels, bd_job_result(again)->layers[BD_LAYER_BEAUTY]->pixels,
                            16 * (size_t)beauty->width_px * beauty->height_px);
        bd_job_release(&again);
        bd_job_release(&job);
    }
    bd_scene_release(&scene);
}

static uint32_t count_flags(const struct bd_report *report, const char *start)
{
    uint32_t count = 0;
    for (uint32_t i = 0; i < report->flag_count; i++)
        count += strncmp(report->flags[i], start, strlen(start)) == 0;
    return count;
}

// The frame that stood is the answer, once, and nothing else is tried behind a deadline or a
// budget. The first frame is had from the memo: half the time that it took is enough for it, and
// too little for a better one, on every machine.
static void what_comes_too_late_leaves_what_stood(void **state)
{
    struct bd_scene *scene = create_noisy_scene();
    struct bd_job_request request = noisy_request(scene);
    request.frame.width_px = request.frame.height_px = 512;
    assert_int_equal(bd_param_list_add(&request.frame.params, "light_rays=2", NULL), BD_ERR_OK);
    for (int with_budget = 0; with_budget < 2; with_budget++) {
        struct bd_report first;
        request.improves = false;
        request.frame.deadline_ms = 0;
        request.frame.budget_ms = with_budget ? 1 : 0;
        bd_image_destroy(&(struct bd_image *){render_within(*state, &request, 0, &first)});
        request.improves = true;
        request.frame.deadline_ms = 1 + (uint32_t)(first.time_ms.total - first.time_ms.compile) / 2;
        request.frame.budget_ms = with_budget ? 1000000 : 0;
        struct bd_job *job = rendered(*state, &request);
        const struct bd_report *report = &bd_job_result(job)->report;
        print_message("    rays=%s, %.2f %%, deadline %u ms, %.0f ms\n", value_of(report, "rays"),
                      100 * report->own_estimate, request.frame.deadline_ms, report->time_ms.total);
        assert_int_equal(report->stopped, BD_STOPPED_DEADLINE);
        assert_int_equal(count_flags(report, "deadline_rung: "), 1);
        assert_int_equal(count_flags(report, "chosen_by_clock"), with_budget);
        bd_job_release(&job);
    }
    bd_scene_release(&scene);
}

static void a_budget_goes_as_far_as_it_lasts(void **state)
{
    struct bd_scene *scene = create_scene();
    struct bd_job_request request = request_of(scene, 64, "brdf=lambert");
    struct bd_report report;
    request.frame.budget_ms = 1;
    bd_image_destroy(&(struct bd_image *){render_within(*state, &request, 0, &report)});
    assert_string_equal(value_of(&report, "rays"), "2");
    assert_true(has_flag(&report, "chosen_by_clock"));
    request.frame.budget_ms = PATIENCE * 3000;
    bd_image_destroy(&(struct bd_image *){render_within(*state, &request, 0, &report)});
    print_message("    rays=%s in %.0f ms\n", value_of(&report, "rays"), report.time_ms.total);
    assert_true(atoi(value_of(&report, "rays")) > 4);
    assert_true(report.time_ms.total < 3 * PATIENCE * 3000);
    bd_scene_release(&scene);
}

static void no_such_device_says_what_was_tried(void **state)
{
    (void)state;
    const struct bd_sched_options options = {.device = "egl:99", .queue_length_max = 1};
    struct bd_sched *sched;
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_sched_create(&options, &sched, &detail), BD_ERR_DEVICE);
    assert_non_null(strstr(detail.message, "egl:99"));
}

static int open_sched(void **state)
{
    *state = create_sched(0);
    return 0;
}

static int close_sched(void **state)
{
    bd_sched_destroy((struct bd_sched **)state);
    return 0;
}

#define WITH_SCHED(test) cmocka_unit_test_setup_teardown(test, open_sched, close_sched)

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_lost_device_changes_no_byte),
        WITH_SCHED(a_failed_call_fails_no_later_frame),
        WITH_SCHED(a_cancelled_job_ends_soon),
        WITH_SCHED(a_deadline_is_kept),
        WITH_SCHED(a_cheaper_frame_stands_in),
        WITH_SCHED(higher_priority_goes_first),
        WITH_SCHED(a_full_queue_says_so),
        WITH_SCHED(oversize_is_refused_by_name),
        WITH_SCHED(a_pose_sees_what_its_camera_sees),
        WITH_SCHED(auto_is_content_with_little_doubt),
        WITH_SCHED(a_pilot_finds_the_rung),
        WITH_SCHED(what_comes_too_late_leaves_what_stood),
        WITH_SCHED(a_budget_goes_as_far_as_it_lasts),
        cmocka_unit_test(no_such_device_says_what_was_tried),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
