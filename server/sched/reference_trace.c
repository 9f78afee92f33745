#include "sched/reference_trace.h"

#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/clock.h"
#include "frame/plan.h"
#include "reference/film.h"
#include "sched/reference_filter.h"
#include "sched/reference_picture.h"
#include "sched/reference_subject.h"

_Static_assert((int)BD_LIGHTS_PUNCTUAL == (int)BD_REFERENCE_PUNCTUAL, "one set of bits");
_Static_assert((int)BD_LIGHTS_EMISSIVE == (int)BD_REFERENCE_EMISSIVE, "one set of bits");
_Static_assert((int)BD_LIGHTS_ENVIRONMENT == (int)BD_REFERENCE_ENVIRONMENT, "one set of bits");
_Static_assert(BD_MODEL_BOUNCES_UNLIMITED == BD_BOUNCES_UNLIMITED, "one word for unlimited");

// Of pictures whose sums are not kept (reference_sums.h): pixels of a band, 5 MB of sums whatever
// the picture's size.
#define BAND_PIXELS 16384u
// An item is a run of pixels and a range of samples of each half: 128 paths, a few milliseconds.
#define ITEM_PIXELS  8u
#define ITEM_SAMPLES 8u
// Light paths of an item, and of a loop over items.
#define ITEM_PATHS 1024u
#define LOOP_ITEMS 65536u

struct tracing {
    struct bd_job *job;
    const struct bd_runner_caller *caller;
    struct bd_plan plan;
    struct bd_integrand integrand;
    struct bd_reference_view view;
    const struct bd_reference *reference;
    uint32_t region[4];                       // x, y, width, height
    struct bd_traced traced;                  // of the whole picture, where it will be kept
    struct bd_reference_pixel *band;          // sums of the band's pixels
    uint64_t band_first;                      // index of its first pixel in the region
    uint32_t band_count;
    uint32_t first_sample, sample_count;      // of each half, in the current loop
    struct bd_film *film;                     // or NULL: no light paths
    uint64_t first_path, path_count;          // in the current loop
    _Atomic uint64_t done;                    // pixels x samples of a half
    uint64_t total;
};

struct bd_integrand bd_reference_integrand_of(const struct bd_params *params)
{
    return (struct bd_integrand){
        .bounces_max = params->bounces,
        .indirect_visibility = params->indirect_visibility,
        .lights = params->lights,
        .indirect_lights = params->indirect_lights,
        .filter = params->filter ? BD_FILTER_BOX : BD_FILTER_POINT,
        .alpha = params->alpha_coverage ? BD_ALPHA_AS_COVERAGE : BD_ALPHA_AS_MASK,
        .clamp_per_m2 = params->clamp_per_m2,
        .lambert = params->lambert,
        .lambert_senders = params->senders_lambert,
        .transmission = params->transmission,
        .lamp_radius_m = params->lamp_radius_m,
        .light_vertices = params->light_vertices,
    };
}

struct bd_reference_view bd_reference_view_of(const struct bd_frame_request *frame,
                                              const struct bd_plan *plan)
{
    return (struct bd_reference_view){
        .width_px = frame->width_px,
        .height_px = frame->height_px,
        .camera = (uint32_t)plan->camera,
        .pose = frame->pose,
    };
}

static enum bd_err should_stop(void *user)
{
    struct tracing *tracing = user;
    const double done = (double)atomic_load(&tracing->done);
    if (tracing->total > 0)
        atomic_store(&tracing->job->progress_ppm, (uint32_t)(1e6 * done / (double)tracing->total));
    return bd_job_should_stop(tracing->job);
}

static void pixel_of(const struct tracing *tracing, uint32_t i, uint32_t *x_px, uint32_t *y_px)
{
    uint64_t index = tracing->band_first + i;
    *x_px = tracing->region[0] + (uint32_t)(index % tracing->region[2]);
    *y_px = tracing->region[1] + (uint32_t)(index / tracing->region[2]);
}

static void trace_item(void *user, uint32_t item)
{
    struct tracing *tracing = user;
    uint32_t end = (item + 1) * ITEM_PIXELS;
    if (end > tracing->band_count) end = tracing->band_count;
    for (uint32_t i = item * ITEM_PIXELS; i < end; i++) {
        uint32_t x_px, y_px;
        pixel_of(tracing, i, &x_px, &y_px);
        bd_reference_trace(tracing->reference, &tracing->integrand, &tracing->view,
                           tracing->job->request.frame.seed, x_px, y_px, tracing->first_sample,
                           tracing->sample_count, &tracing->band[i]);
        atomic_fetch_add(&tracing->done, tracing->sample_count);
    }
}

// Samples in ranges, one loop after the other, so that the sums of a pixel are added up in one
// order whatever the threads do.
static enum bd_err trace_band(struct bd_reference_runner *runner, struct tracing *tracing)
{
    const struct bd_params *params = &tracing->plan.params;
    uint32_t items = (tracing->band_count + ITEM_PIXELS - 1) / ITEM_PIXELS;
    enum bd_err err = BD_ERR_OK;
    for (uint32_t done = tracing->traced.samples; !err && done < params->spp / 2;
         done += tracing->sample_count) {
        uint32_t left = params->spp / 2 - done;
        tracing->first_sample = params->first_sample / 2 + done;
        tracing->sample_count = left < ITEM_SAMPLES ? left : ITEM_SAMPLES;
        err = bd_reference_runner_loop(runner, tracing->caller, items, trace_item, should_stop,
                                       tracing);
    }
    return err;
}

// --- light paths --------------------------------------------------------------------------------

static void trace_paths(void *user, uint32_t item)
{
    struct tracing *tracing = user;
    const uint64_t first = (uint64_t)item * ITEM_PATHS, left = tracing->path_count - first;
    bd_film_trace(tracing->film, tracing->job->request.frame.seed, tracing->first_sample,
                  tracing->first_path + first, left < ITEM_PATHS ? (uint32_t)left : ITEM_PATHS);
    atomic_fetch_add(&tracing->done, (left < ITEM_PATHS ? left : ITEM_PATHS) / 2);
}

// Of the whole picture, whatever its region, and of all samples that are to come.
static enum bd_err expose(struct bd_reference_runner *runner, struct tracing *tracing)
{
    const struct bd_params *params = &tracing->plan.params;
    const struct bd_reference_view *view = &tracing->view;
    const uint64_t samples = params->spp / 2 - tracing->traced.samples;
    const uint64_t paths = 2 * samples * view->width_px * view->height_px;
    enum bd_err err = bd_film_create(tracing->reference, &tracing->integrand, view, tracing->region,
                                     &tracing->film, &tracing->job->result.detail);
    tracing->first_sample = params->first_sample / 2 + tracing->traced.samples;
    tracing->total += paths / 2;
    for (tracing->first_path = 0; !err && tracing->first_path < paths;
         tracing->first_path += tracing->path_count) {
        const uint64_t left = paths - tracing->first_path, most = (uint64_t)LOOP_ITEMS * ITEM_PATHS;
        tracing->path_count = left < most ? left : most;
        err = bd_reference_runner_loop(
            runner, tracing->caller,
            (uint32_t)((tracing->path_count + ITEM_PATHS - 1) / ITEM_PATHS), trace_paths,
            should_stop, tracing);
    }
    return err;
}

static void take_band(const struct tracing *tracing)
{
    for (uint32_t i = 0; tracing->film && i < tracing->band_count; i++) {
        uint32_t x_px, y_px;
        pixel_of(tracing, i, &x_px, &y_px);
        bd_film_take(tracing->film, x_px, y_px, &tracing->band[i]);
    }
}

// --- the picture --------------------------------------------------------------------------------

// What was left out of the picture, and why.
struct left_out {
    uint64_t nonfinite_count, refused_ray_count;
    uint64_t missing_count; // pixels
};

static void store_band(const struct tracing *tracing, struct left_out *left_out)
{
    for (uint32_t i = 0; i < tracing->band_count; i++) {
        uint32_t x_px, y_px;
        pixel_of(tracing, i, &x_px, &y_px);
        bd_reference_picture_store(tracing->job->result.layers, x_px, y_px, &tracing->band[i]);
        left_out->nonfinite_count += tracing->band[i].nonfinite_count;
        left_out->refused_ray_count += tracing->band[i].refused_ray_count;
        left_out->missing_count += tracing->band[i].missing_count > 0;
    }
}

static void report_left_out(struct bd_report *report, const struct left_out *left_out)
{
    if (left_out->nonfinite_count)
        bd_report_flag(report, "nonfinite_samples: %llu left out",
                       (unsigned long long)left_out->nonfinite_count);
    bd_report_refused_rays(report, left_out->refused_ray_count);
    if (left_out->missing_count)
        bd_report_flag(report, "caustics_unseen: %llu pixels",
                       (unsigned long long)left_out->missing_count);
}

static uint64_t pixel_count_of(const struct tracing *tracing)
{
    return (uint64_t)tracing->region[2] * tracing->region[3];
}

static enum bd_err trace_bands(struct bd_reference_runner *runner, struct tracing *tracing)
{
    uint64_t pixels = pixel_count_of(tracing);
    uint32_t band_max = pixels < BAND_PIXELS ? (uint32_t)pixels : BAND_PIXELS;
    struct left_out left_out = {0};
    tracing->total = pixels * (tracing->plan.params.spp / 2 - tracing->traced.samples);
    struct bd_reference_pixel *own = tracing->traced.pixels ? NULL : malloc(band_max * sizeof *own);
    BD_ASSERT(own || tracing->traced.pixels);
    enum bd_err err = BD_ERR_OK;
    if (bd_reference_has_light_paths(tracing->reference, &tracing->integrand)) {
        if (bd_reference_sums_may_keep(pixels))
            err = expose(runner, tracing);
        else
            bd_report_flag(&tracing->job->result.report, "caustics_left_out: picture too large");
    }
    for (uint64_t first = 0; !err && first < pixels; first += tracing->band_count) {
        tracing->band_first = first;
        tracing->band_count = pixels - first < band_max ? (uint32_t)(pixels - first) : band_max;
        tracing->band = own ? own : tracing->traced.pixels + first;
        if (own) memset(own, 0, band_max * sizeof *own);
        err = trace_band(runner, tracing);
        if (!err) take_band(tracing);
        if (!err) store_band(tracing, &left_out);
    }
    free(own);
    bd_film_destroy(&tracing->film);
    report_left_out(&tracing->job->result.report, &left_out);
    return err;
}

// What was traced of the picture already, or room for it. Without either it is traced in bands.
static void take_sums(struct bd_reference_runner *runner, struct tracing *tracing)
{
    const struct bd_frame_request *frame = &tracing->job->request.frame;
    const uint32_t *region = tracing->region;
    const struct bd_reference_subject subject = {
        .scene = tracing->job->request.scene,
        .integrand = &tracing->integrand,
        .view = &tracing->view,
        .region = {region[0], region[1], region[2], region[3]},
        .seed = frame->seed,
        .first_sample = tracing->plan.params.first_sample,
    };
    struct bd_traced *traced = &tracing->traced;
    uint8_t name[BD_SHA256_BYTES];
    if (!bd_reference_sums_may_keep(pixel_count_of(tracing))) return;
    if (!bd_reference_subject_name(&subject, name)) return;
    if (!frame->fresh && bd_reference_sums_copy(bd_reference_runner_sums(runner), name,
                                                tracing->plan.params.spp / 2, traced))
        return;
    memcpy(traced->name, name, sizeof name);
    traced->pixel_count = pixel_count_of(tracing);
    traced->pixels = calloc(traced->pixel_count, sizeof *traced->pixels);
}

// Sums of a part of the samples are of no use: some pixels have them, others not.
static void leave_sums(struct bd_reference_runner *runner, struct tracing *tracing, enum bd_err err)
{
    struct bd_traced *traced = &tracing->traced;
    if (!traced->pixels) return;
    traced->samples = tracing->plan.params.spp / 2;
    if (err)
        free(traced->pixels);
    else
        bd_reference_sums_keep(bd_reference_runner_sums(runner), traced);
    traced->pixels = NULL;
}

static void set_pass(struct bd_report *report, const char *name, double ms,
                     enum bd_pass_state state)
{
    for (uint32_t p = 0; p < report->pass_count; p++) {
        if (strcmp(report->passes[p].name, name) != 0) continue;
        report->passes[p].ms = ms;
        report->passes[p].state = state;
    }
}

static void describe_device(struct bd_report *report, uint32_t thread_count)
{
    if (thread_count > 0)
        snprintf(report->device.name, sizeof report->device.name, "processor, %u thread%s",
                 thread_count, thread_count == 1 ? "" : "s");
    else
        snprintf(report->device.name, sizeof report->device.name, "processor");
    // Threads change no byte.
    snprintf(report->device.device_class, sizeof report->device.device_class, "processor");
    report->device.software = true;
}

static void choose_region(struct tracing *tracing)
{
    const struct bd_frame_request *frame = &tracing->job->request.frame;
    memcpy(tracing->region, frame->region, sizeof tracing->region);
    if (tracing->region[2]) return;
    tracing->region[2] = frame->width_px;
    tracing->region[3] = frame->height_px;
}

// With layers that nobody asked for, which go again.
static enum bd_err filter(struct bd_reference_runner *runner, struct tracing *tracing)
{
    struct bd_job_result *result = &tracing->job->result;
    if (!tracing->plan.params.noise_filter) return BD_ERR_OK;
    const uint64_t start_ns = bd_clock_ns();
    enum bd_err err = bd_reference_filter(runner, tracing->caller, result->layers,
                                          bd_job_should_stop, tracing->job, &result->detail);
    set_pass(&result->report, "filter", bd_ms_since(start_ns), BD_PASS_RAN);
    for (uint32_t l = 0; l < BD_LAYER_COUNT; l++)
        if (!(tracing->plan.layers >> l & 1)) bd_image_destroy(&result->layers[l]);
    return err;
}

static enum bd_err make_picture(struct bd_reference_runner *runner, struct tracing *tracing)
{
    struct bd_job *job = tracing->job;
    struct bd_job_result *result = &job->result;
    const uint32_t for_filter =
        tracing->plan.params.noise_filter ? bd_reference_filter_layers() : 0;
    enum bd_err err =
        bd_reference_picture_create(&job->request.frame, tracing->plan.layers | for_filter,
                                    bd_job_should_stop, job, result->layers, &result->detail);
    const uint64_t start_ns = bd_clock_ns();
    if (!err) {
        take_sums(runner, tracing);
        err = trace_bands(runner, tracing);
        leave_sums(runner, tracing, err);
    }
    set_pass(&result->report, "trace", bd_ms_since(start_ns), BD_PASS_RAN);
    return err ? err : filter(runner, tracing);
}

static enum bd_err trace(struct bd_reference_runner *runner, struct tracing *tracing)
{
    struct bd_job *job = tracing->job;
    struct bd_job_result *result = &job->result;
    uint64_t start_ns = bd_clock_ns();
    bool reused;
    enum bd_err err = bd_reference_runner_take(runner, job->request.scene, bd_job_should_stop, job,
                                               &tracing->reference, &reused, &result->detail);
    if (err) return err;
    double bvh_ms = bd_ms_since(start_ns);
    set_pass(&result->report, "bvh", reused ? 0 : bvh_ms, reused ? BD_PASS_REUSED : BD_PASS_RAN);
    result->report.time_ms.load = reused ? 0 : bvh_ms;
    err = make_picture(runner, tracing);
    bd_reference_runner_give_back(runner, &tracing->reference);
    return err;
}

static void finish_report(struct bd_reference_runner *runner, struct bd_report *report)
{
    struct bd_reference_runner_stats stats;
    bd_reference_runner_stats(runner, &stats);
    describe_device(report, stats.thread_count);
    report->memory_reference_mib = (double)stats.memory_bytes / (1 << 20);
}

enum bd_err bd_reference_trace_job(struct bd_reference_runner *runner,
                                   const struct bd_runner_caller *caller, struct bd_job *job)
{
    uint64_t start_ns = bd_clock_ns();
    struct bd_job_result *result = &job->result;
    struct tracing tracing = {.job = job, .caller = caller};
    enum bd_err err = bd_plan_make(job->request.scene, &job->request.frame, &tracing.plan,
                                   &result->report, &result->detail);
    if (!err) err = bd_job_should_stop(job); // late before it began: the plan is told
    if (!err && !job->request.frame.plan_only) {
        tracing.integrand = bd_reference_integrand_of(&tracing.plan.params);
        tracing.view = bd_reference_view_of(&job->request.frame, &tracing.plan);
        choose_region(&tracing);
        err = trace(runner, &tracing);
    }
    if (!err && result->layers[BD_LAYER_BEAUTY])
        bd_report_inspect(&result->report, result->layers[BD_LAYER_BEAUTY]);
    for (uint32_t l = 0; err && l < BD_LAYER_COUNT; l++) bd_image_destroy(&result->layers[l]);
    finish_report(runner, &result->report);
    result->report.time_ms.total = bd_ms_since(start_ns);
    if (err == BD_ERR_CANCELLED) result->report.stopped = BD_STOPPED_CANCELLED;
    if (err == BD_ERR_DEADLINE) result->report.stopped = BD_STOPPED_DEADLINE;
    return err;
}
