// Spot checks and error targets, with a real device and the real reference. Exits with 77 where
// there is no EGL.

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
#include "sched/sched.h"
#include "world.h"

// Sanitizers look for other things than noise: less of it is traced away for them.
#define SIDE         (BD_UNDER_SANITIZER ? 16 : 32)
#define TARGET_ERROR (BD_UNDER_SANITIZER ? 0.035 : 0.02)

static struct bd_sched *sched;
static struct bd_scene *scene;

// A closed room with a lamp, and a wall in it that hides light: a technique without visibility of
// indirect light is wrong there, however fine.
static struct bd_scene *create_scene(void)
{
    struct world builder = {.scene = bd_scene_create()};
    const double origin[3] = {0, 0, 0}, lamp[3] = {.3, .6, .1}, down[3] = {0, -1, 0};
    const double eye[3] = {.5, .5, .9};
    const double wall[4][3] = {{-.6, -1, -.2}, {.3, -1, -.2}, {.3, .4, -.2}, {-.6, .4, -.2}};
    int32_t material = world_add_material(&builder, 0.5f);
    world_add_box_room(&builder, material, origin, 1);
    world_add_quad(&builder, material, wall, 1);
    world_add_light(&builder, BD_LIGHT_POINT, lamp, down, 1);
    world_add_camera(&builder, eye, origin, 1.2);
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_scene_finish(builder.scene, &detail), BD_ERR_OK);
    return builder.scene;
}

static struct bd_job_request request_of(const char *technique, const char *setting)
{
    struct bd_job_request request = {.scene = scene, .frame = bd_frame_request_default};
    struct bd_err_detail detail;
    snprintf(request.frame.technique, sizeof request.frame.technique, "%s", technique);
    request.frame.width_px = request.frame.height_px = SIDE;
    if (setting)
        assert_int_equal(bd_param_list_add(&request.frame.params, setting, &detail), BD_ERR_OK);
    return request;
}

static struct bd_job *submit(const struct bd_job_request *request)
{
    struct bd_job *job;
    struct bd_err_detail detail = {0};
    if (bd_sched_submit(sched, request, &job, &detail)) fail_msg("%s", detail.message);
    return job;
}

static struct bd_job *run(const struct bd_job_request *request)
{
    struct bd_job *job = submit(request);
    bd_job_wait(job);
    if (bd_job_result(job)->err) fail_msg("%s", bd_job_result(job)->detail.message);
    return job;
}

static bool has_flag(const struct bd_report *report, const char *start)
{
    for (uint32_t i = 0; i < report->flag_count; i++)
        if (strncmp(report->flags[i], start, strlen(start)) == 0) return true;
    return false;
}

static const char *param(const struct bd_report *report, const char *key)
{
    for (uint32_t i = 0; i < report->params.count; i++)
        if (strcmp(report->params.pairs[i].key, key) == 0) return report->params.pairs[i].value;
    return "";
}

// Relative RMSE of the whole frame against a reference of many samples, halves and all.
static double full_error(const struct bd_image *beauty, const char *setting)
{
    struct bd_job_request request = request_of("reference", setting);
    struct bd_err_detail detail;
    request.frame.layers |= bd_layers_named("halves");
    request.frame.seed = 999;
    assert_int_equal(bd_param_list_add(&request.frame.params, "spp=256", &detail), BD_ERR_OK);
    struct bd_job *job = run(&request);
    struct bd_image *const *layers = bd_job_result(job)->layers;
    const float *a = layers[BD_LAYER_HALF_A]->pixels, *b = layers[BD_LAYER_HALF_B]->pixels;
    double square = 0, sum = 0;
    for (uint32_t i = 0; i < SIDE * SIDE; i++) {
        for (uint32_t c = 0; c < 3; c++) {
            double image = (double)beauty->pixels[4 * i + c];
            uint32_t at = i * layers[BD_LAYER_HALF_A]->channel_count + c;
            square += (image - (double)a[at]) * (image - (double)b[at]);
            sum += ((double)a[at] + (double)b[at]) / 2;
        }
    }
    bd_job_release(&job);
    const double n = 3.0 * SIDE * SIDE;
    return sqrt(fmax(square / n, 0)) / (sum / n);
}

static void assert_estimate(enum bd_against against, const char *reference_setting)
{
    struct bd_job_request request = request_of("rsm", "vpls=96");
    request.frame.check_pixels = 200;
    request.frame.against = against;
    struct bd_job *job = run(&request);
    const struct bd_job_result *result = bd_job_result(job);
    const struct bd_report *report = &result->report;
    // The other figure is there as well, and comes second.
    bool is_full = against == BD_AGAINST_FULL;
    assert_int_equal(report->error_count, 2);
    assert_string_equal(report->errors[0].metric, "rel_rmse");
    assert_string_equal(report->errors[0].against, is_full ? "full" : "model");
    assert_string_equal(report->errors[1].against, is_full ? "model" : "full");
    assert_true((report->errors[0].low > report->errors[1].high) == is_full);
    assert_int_equal(report->errors[0].samples, 200);
    assert_int_equal(report->errors[1].samples, 200);
    assert_true(report->time_ms.check > 0);
    assert_true(report->time_ms.total > report->time_ms.check);
    assert_int_equal(report->stopped, BD_STOPPED_COMPLETE);
    double full = full_error(result->layers[BD_LAYER_BEAUTY], reference_setting);
    printf("%g (%g - %g), all pixels %g\n", report->errors[0].value, report->errors[0].low,
           report->errors[0].high, full);
    assert_true(report->errors[0].low <= full && full <= report->errors[0].high);
    assert_true(report->errors[0].high < 2 * report->errors[0].low);
    // What the check read and nobody asked for is gone.
    assert_null(result->layers[BD_LAYER_NORMAL]);
    bd_job_release(&job);
}

static void a_check_tells_the_error_of_the_whole_frame(void **state)
{
    (void)state;
    assert_estimate(BD_AGAINST_MODEL, "model_of=rsm");
    assert_estimate(BD_AGAINST_FULL, NULL);
}

static void a_check_repeated_says_the_same(void **state)
{
    (void)state;
    struct bd_job_request request = request_of("rsm", "vpls=24");
    double value = 0;
    for (int i = 0; i < 2; i++) {
        request.frame.check_pixels = 64;
        struct bd_job *job = run(&request);
        if (i > 0) assert_true(bd_job_result(job)->report.errors[0].value == value);
        value = bd_job_result(job)->report.errors[0].value;
        bd_job_release(&job);
    }
}

static void a_target_is_reached(void **state)
{
    (void)state;
    struct bd_job_request request = request_of("rsm", NULL);
    request.frame.check_pixels = 128;
    request.frame.target_error = TARGET_ERROR;
    request.frame.against = BD_AGAINST_MODEL;
    struct bd_job *job = run(&request);
    const struct bd_report *report = &bd_job_result(job)->report;
    assert_int_equal(report->stopped, BD_STOPPED_TARGET);
    assert_int_equal(report->error_count, 2);
    assert_true(report->errors[0].high < TARGET_ERROR);
    assert_true(report->errors[1].low > TARGET_ERROR); // what its model leaves out is no such error
    assert_true(strtol(param(report, "vpls"), NULL, 10) > 16); // the ladder's foot does not do
    assert_non_null(bd_job_result(job)->layers[BD_LAYER_BEAUTY]);
    bd_job_release(&job);
    // From parameters of one's own the ladder is climbed above them.
    request = request_of("rsm", "vpls=5000");
    request.frame.check_pixels = 128;
    request.frame.target_error = TARGET_ERROR;
    request.frame.against = BD_AGAINST_MODEL;
    job = run(&request);
    assert_int_equal(bd_job_result(job)->report.stopped, BD_STOPPED_TARGET);
    assert_string_equal(param(&bd_job_result(job)->report, "vpls"), "5000");
    bd_job_release(&job);
}

// The setting of technique reference that the flag names.
static uint32_t samples_named(const struct bd_report *report)
{
    for (uint32_t i = 0; i < report->flag_count; i++) {
        const char *at = strstr(report->flags[i], "reached by: reference spp=");
        if (at) return (uint32_t)strtoul(strrchr(at, '=') + 1, NULL, 10);
    }
    fail_msg("no flag names what reaches the target");
    return 0;
}

// Relative RMSE of a reference of so many samples, against one of many.
static double error_of_reference(uint32_t samples)
{
    char setting[32];
    snprintf(setting, sizeof setting, "spp=%u", samples);
    struct bd_job_request request = request_of("reference", setting);
    struct bd_job *job = run(&request);
    double error = full_error(bd_job_result(job)->layers[BD_LAYER_BEAUTY], NULL);
    bd_job_release(&job);
    return error;
}

// Unless something else is asked for, the whole rendering equation decides.
static void a_floor_is_told(void **state)
{
    (void)state;
    struct bd_job_request request = request_of("direct", NULL);
    request.frame.check_pixels = 128;
    request.frame.target_error = 0.08;
    struct bd_job *job = run(&request);
    const struct bd_report *report = &bd_job_result(job)->report;
    assert_int_equal(report->stopped, BD_STOPPED_FLOOR);
    assert_int_equal(report->error_count, 2);
    assert_string_equal(report->errors[0].against, "full");
    assert_true(report->errors[0].low > 0.1); // there is no indirect light in it
    assert_true(report->errors[1].high < 0.08);
    assert_true(has_flag(report, "error_floor: "));
    assert_non_null(bd_job_result(job)->layers[BD_LAYER_BEAUTY]);
    // What is said to reach the target does, and is not a hundred times as much as it takes.
    uint32_t samples = samples_named(report);
    assert_true(error_of_reference(samples) < 0.08);
    assert_true(error_of_reference(samples / 8) > 0.08);
    bd_job_release(&job);
}

// One reflection is not all of it, and no rung of the ladder adds another: the reference has it.
static void what_auto_cannot_reach_is_traced(void **state)
{
    (void)state;
    struct bd_job_request request = request_of("auto", "indirect_bounces=1");
    request.frame.check_pixels = 128;
    request.frame.target_error = 0.08;
    request.frame.aa = 2;
    struct bd_job *job = run(&request);
    const struct bd_report *report = &bd_job_result(job)->report;
    assert_string_equal(report->technique, "reference");
    assert_string_equal(report->filter, "box");
    assert_int_equal(report->stopped, BD_STOPPED_TARGET);
    assert_true(report->has_own_estimate && report->own_estimate > 0 &&
                report->own_estimate < 0.08);
    assert_true(report->time_ms.check > 0);
    assert_null(bd_job_result(job)->layers[BD_LAYER_VARIANCE]); // nobody asked for it
    assert_true(full_error(bd_job_result(job)->layers[BD_LAYER_BEAUTY], "filter=box") < 0.08);
    bd_job_release(&job);
    // It has no such layer, and whoever asked for it gets it.
    request.frame.layers |= 1u << BD_LAYER_NOISE;
    job = run(&request);
    assert_string_equal(bd_job_result(job)->report.technique, "many_light");
    assert_non_null(bd_job_result(job)->layers[BD_LAYER_NOISE]);
    bd_job_release(&job);
    request.frame.layers &= ~BD_LAYERS_DOUBT;
    // So many samples that nobody waits for them: it says so, as others do.
    request.frame.target_error = 1e-5;
    job = run(&request);
    assert_string_equal(bd_job_result(job)->report.technique, "many_light");
    assert_int_equal(bd_job_result(job)->report.stopped, BD_STOPPED_FLOOR);
    assert_true(has_flag(&bd_job_result(job)->report, "error_floor: "));
    bd_job_release(&job);
}

static double mean_indirect(const char *setting)
{
    struct bd_job_request request = request_of("reference", "model_of=rsm");
    struct bd_err_detail detail;
    request.frame.layers |= 1u << BD_LAYER_INDIRECT;
    if (setting)
        assert_int_equal(bd_param_list_add(&request.frame.params, setting, &detail), BD_ERR_OK);
    struct bd_job *job = run(&request);
    const struct bd_image *indirect = bd_job_result(job)->layers[BD_LAYER_INDIRECT];
    double sum = 0;
    for (size_t i = 0; i < (size_t)3 * SIDE * SIDE; i++) sum += (double)indirect->pixels[i];
    // What has no visibility says so, the reference included.
    assert_int_equal(has_flag(&bd_job_result(job)->report, "no_indirect_visibility"), !setting);
    bd_job_release(&job);
    return sum;
}

static void light_that_walls_would_hide_is_told(void **state)
{
    (void)state;
    static const char *const says =
        "no_indirect_visibility: %lf %% of the indirect light is hidden";
    struct bd_job_request request = request_of("rsm", "vpls=96");
    struct bd_job *job = run(&request);
    double hidden = 100 * (1 - mean_indirect("indirect_visibility=on") / mean_indirect(NULL)), told;
    assert_true(has_flag(&bd_job_result(job)->report, "no_indirect_visibility"));
    bd_job_release(&job);
    request.frame.check_pixels = 200;
    job = run(&request);
    const struct bd_report *report = &bd_job_result(job)->report;
    uint32_t i = 0;
    while (i < report->flag_count && sscanf(report->flags[i], says, &told) != 1) i++;
    assert_true(i < report->flag_count);
    printf("%s; all pixels %g %%\n", report->flags[i], hidden);
    assert_true(hidden > 5 && fabs(told - hidden) < 0.1 * hidden);
    bd_job_release(&job);
    // Without indirect light there is none to hide.
    request = request_of("direct", NULL);
    job = run(&request);
    assert_false(has_flag(&bd_job_result(job)->report, "no_indirect_visibility"));
    bd_job_release(&job);
}

// What a frame's rays hide is in the model that it is held to.
static void rays_are_in_the_model_of_who_traces_them(void **state)
{
    (void)state;
    struct bd_job_request request = request_of("rsm", "vpls=2000");
    struct bd_err_detail detail;
    assert_int_equal(bd_param_list_add(&request.frame.params, "indirect_visibility=rays", &detail),
                     BD_ERR_OK);
    request.frame.check_pixels = 300;
    request.frame.against = BD_AGAINST_MODEL;
    struct bd_job *job = run(&request);
    const struct bd_report *report = &bd_job_result(job)->report;
    assert_true(report->error_count > 0);
    printf("%g %%\n", 100 * report->errors[0].value);
    assert_true(report->errors[0].value < 0.02); // 2.9 % against light through walls
    bd_job_release(&job);
}

static void out_of_time_the_best_is_given(void **state)
{
    (void)state;
    struct bd_job_request request = request_of("rsm", NULL);
    request.frame.width_px = request.frame.height_px = 128; // the ladder's top takes far longer
    request.frame.target_error = 1e-6;
    request.frame.against =
        BD_AGAINST_MODEL; // all of the light is out of its reach, and soon known to be
    request.frame.deadline_ms = BD_UNDER_SANITIZER ? 12000 : 3000;
    struct bd_job *job = run(&request);
    const struct bd_report *report = &bd_job_result(job)->report;
    assert_int_equal(report->stopped, BD_STOPPED_DEADLINE);
    assert_int_equal(report->error_count, 1);
    assert_non_null(bd_job_result(job)->layers[BD_LAYER_BEAUTY]);
    assert_true(report->time_ms.total < 2.0 * request.frame.deadline_ms);
    bd_job_release(&job);
}

static void sleep_ms(long ms)
{
    const struct timespec time = {ms / 1000, ms % 1000 * 1000000};
    nanosleep(&time, NULL);
}

// Thousands of pixels of a room whose light bounces on and on take a while.
static struct bd_job *submit_long_check(void)
{
    struct bd_job_request request = request_of("direct", NULL);
    request.frame.width_px = request.frame.height_px = 512;
    request.frame.check_pixels = 65536;
    request.frame.against = BD_AGAINST_FULL;
    struct bd_job *job = submit(&request);
    for (int i = 0; i < 3000 && strcmp(bd_job_stage(job), "check") != 0; i++) sleep_ms(10);
    assert_string_equal(bd_job_stage(job), "check");
    return job;
}

// The best of three: what other processes take of the machine is not ours.
static void a_cancelled_check_ends_soon(void **state)
{
    (void)state;
    double best_ms = INFINITY;
    for (int i = 0; i < 3; i++) {
        struct bd_job *job = submit_long_check();
        sleep_ms(200);
        uint64_t start_ns = bd_clock_ns();
        bd_job_cancel(job);
        bd_job_wait(job);
        best_ms = fmin(best_ms, bd_ms_since(start_ns));
        assert_int_equal(bd_job_result(job)->err, BD_ERR_CANCELLED);
        assert_null(bd_job_result(job)->layers[BD_LAYER_BEAUTY]);
        bd_job_release(&job);
    }
    printf("cancelled in %.0f ms\n", best_ms);
    assert_true(best_ms < (BD_UNDER_SANITIZER ? 4000 : 1000));
}

static void frames_go_on_beside_a_check(void **state)
{
    (void)state;
    struct bd_job *slow = submit_long_check();
    struct bd_job_request request = request_of("direct", NULL);
    struct bd_job *job = run(&request);
    assert_string_equal(bd_job_stage(slow), "check");
    bd_job_release(&job);
    bd_job_cancel(slow);
    bd_job_wait(slow);
    assert_int_equal(bd_job_result(slow)->err, BD_ERR_CANCELLED);
    bd_job_release(&slow);
}

// The daemon ends while a check runs and another waits.
static void stopping_ends_checks(void **state)
{
    (void)state;
    struct bd_job *first = submit_long_check();
    struct bd_job_request request = request_of("direct", NULL);
    request.frame.target_error = 1e-6;
    struct bd_job *second = submit(&request);
    bd_sched_destroy(&sched);
    assert_int_equal(bd_job_result(first)->err, BD_ERR_CANCELLED);
    assert_int_equal(bd_job_result(second)->err, BD_ERR_CANCELLED);
    bd_job_release(&first);
    bd_job_release(&second);
}

static void refused(struct bd_job_request request, const char *field)
{
    struct bd_job *job;
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_sched_submit(sched, &request, &job, &detail), BD_ERR_USAGE);
    assert_string_equal(detail.field, field);
}

static void what_cannot_be_checked_is_refused_by_name(void **state)
{
    (void)state;
    struct bd_job_request request = request_of("reference", NULL);
    request.frame.check_pixels = 64;
    refused(request, "check");
    request.frame.check_pixels = 0;
    request.frame.target_error = 0.1;
    refused(request, "target_error");
    request = request_of("rsm", NULL);
    request.frame.target_error = 0.1;
    request.frame.budget_ms = 100;
    refused(request, "budget_ms");
}

static int open_all(void **state)
{
    (void)state;
    const struct bd_sched_options options = {
        .device = "auto",
        .queue_length_max = 8,
        .frame_limits = {.side_px_max = 4096, .pixel_count_max = 1u << 24}};
    struct bd_err_detail detail = {0};
    if (bd_sched_create(&options, &sched, &detail)) {
        fprintf(stderr, "skipped: %s\n", detail.message);
        exit(77);
    }
    scene = create_scene();
    return 0;
}

static int close_all(void **state)
{
    (void)state;
    bd_sched_destroy(&sched);
    bd_scene_release(&scene);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_check_tells_the_error_of_the_whole_frame),
        cmocka_unit_test(a_check_repeated_says_the_same),
        cmocka_unit_test(a_target_is_reached),
        cmocka_unit_test(a_floor_is_told),
        cmocka_unit_test(what_auto_cannot_reach_is_traced),
        cmocka_unit_test(light_that_walls_would_hide_is_told),
        cmocka_unit_test(rays_are_in_the_model_of_who_traces_them),
        cmocka_unit_test(out_of_time_the_best_is_given),
        cmocka_unit_test(a_cancelled_check_ends_soon),
        cmocka_unit_test(frames_go_on_beside_a_check),
        cmocka_unit_test(what_cannot_be_checked_is_refused_by_name),
        cmocka_unit_test(stopping_ends_checks),
    };
    return cmocka_run_group_tests(tests, open_all, close_all);
}
