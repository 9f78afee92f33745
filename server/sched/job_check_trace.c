#include "sched/job_check_trace.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "sched/reference_subject.h"
#include "sched/reference_trace.h"

struct tracing {
    struct bd_reference_runner *runner;
    struct bd_job *job;
    const struct bd_reference *reference;
    struct bd_integrand integrand;
    struct bd_reference_view view;
    uint64_t seed;
};

static void trace(void *user, uint32_t x_px, uint32_t y_px, uint32_t first, uint32_t count,
                  struct bd_reference_pixel *pixel)
{
    const struct tracing *tracing = user;
    bd_reference_trace(tracing->reference, &tracing->integrand, &tracing->view, tracing->seed, x_px,
                       y_px, first, count, pixel);
}

// No light, so no path: the ray from the camera alone.
static void first_surface(void *user, uint32_t x_px, uint32_t y_px,
                          struct bd_reference_pixel *pixel)
{
    const struct tracing *tracing = user;
    struct bd_integrand seen = tracing->integrand;
    seen.bounces_max = seen.lights = 0;
    seen.alpha = BD_ALPHA_AS_MASK;
    bd_reference_trace(tracing->reference, &seen, &tracing->view, tracing->seed, x_px, y_px, 0, 1,
                       pixel);
}

// A loop's work and whom to ask whether to go on: the runner hands both the same pointer.
struct work {
    void (*work)(void *user, uint32_t i);
    void *user;
    struct bd_job *job;
};

static void run_work(void *user, uint32_t i)
{
    const struct work *work = user;
    work->work(work->user, i);
}

static enum bd_err should_stop(void *user)
{
    const struct work *work = user;
    return bd_job_should_stop(work->job);
}

static enum bd_err loop(void *user, uint32_t count, void (*work)(void *work_user, uint32_t i),
                        void *work_user)
{
    const struct tracing *tracing = user;
    struct work bound = {work, work_user, tracing->job};
    static const struct bd_runner_caller checking = {.lane = BD_RUNNER_CHECK};
    return bd_reference_runner_loop(tracing->runner, &checking, count, run_work, should_stop,
                                    &bound);
}

static void show_progress(void *user, double share)
{
    struct bd_job *job = user;
    atomic_store(&job->progress_ppm, (uint32_t)(1e6 * share));
}

// What is to be solved, in the words of technique reference: one place turns a technique's model
// into an integrand (technique/params.c). `model_of` NULL: all of the rendering equation.
static enum bd_err reference_params(const struct bd_checked *checked,
                                    const struct bd_technique *model_of, struct bd_param_list *out,
                                    struct bd_err_detail *detail)
{
    const struct bd_frame_request *request = &checked->job->request.frame;
    struct bd_params params;
    enum bd_err err = bd_params_read(&request->params, checked->technique, &params, detail);
    char text[BD_PARAM_KEY_MAX + BD_PARAM_VALUE_MAX] = "model_of=";
    out->count = 0;
    if (!err && model_of) err = bd_param_list_add(out, strcat(text, model_of->name), detail);
    // What a model leaves out by default may be asked for, and the other way round.
    const bool is_own = model_of == checked->technique;
    const bool is_asked = params.indirect_visibility != BD_VISIBILITY_NONE;
    if (!err && is_own && model_of->params_read & BD_READS(BD_PARAM_INDIRECT_VISIBILITY) &&
        model_of->model.indirect_visibility != is_asked)
        err = bd_param_list_add(
            out, is_asked ? "indirect_visibility=rays" : "indirect_visibility=none", detail);
    if (!err && params.lambert) err = bd_param_list_add(out, "brdf=lambert", detail);
    if (!err && request->aa > 1) err = bd_param_list_add(out, "filter=box", detail);
    return err;
}

static const struct bd_technique *model_of(const struct bd_checked *checked)
{
    return checked->against == BD_AGAINST_MODEL ? checked->technique : NULL;
}

void bd_job_check_settings(const struct bd_checked *checked, char *out, size_t size)
{
    struct bd_param_list list;
    struct bd_err_detail detail;
    out[0] = 0;
    if (reference_params(checked, model_of(checked), &list, &detail)) return;
    for (uint32_t i = 0; i < list.count; i++) {
        size_t used = strlen(out);
        snprintf(out + used, size - used, "%s%s=%s", used ? " " : "", list.pairs[i].key,
                 list.pairs[i].value);
    }
}

// The same view, and what is to be solved there.
static enum bd_err plan_reference(const struct bd_checked *checked,
                                  const struct bd_technique *model_of, struct tracing *tracing,
                                  struct bd_err_detail *detail)
{
    const struct bd_job *job = checked->job;
    struct bd_frame_request request = job->request.frame;
    enum bd_err err = reference_params(checked, model_of, &request.params, detail);
    strcpy(request.technique, bd_technique_reference.name);
    request.aa = 1;
    struct bd_plan plan;
    struct bd_report *report = calloc(1, sizeof *report);
    BD_ASSERT(report);
    if (!err) err = bd_plan_make(job->request.scene, &request, &plan, report, detail);
    free(report);
    if (err) return err;
    tracing->integrand = bd_reference_integrand_of(&plan.params);
    tracing->view = bd_reference_view_of(&request, &plan);
    return BD_ERR_OK;
}

static struct bd_check_options options_of(const struct bd_checked *checked)
{
    struct bd_check_options options = bd_check_options_default;
    options.pixel_count = checked->pixel_count;
    options.seed = checked->job->request.frame.seed;
    options.progress = show_progress;
    options.user = checked->job;
    return options;
}

static struct bd_check_frame frame_of(struct bd_image *const layers[BD_LAYER_COUNT])
{
    return (struct bd_check_frame){
        .beauty = layers[BD_LAYER_BEAUTY],
        .indirect = layers[BD_LAYER_INDIRECT],
        .normal = layers[BD_LAYER_NORMAL],
        .depth = layers[BD_LAYER_DEPTH],
        .albedo = layers[BD_LAYER_ALBEDO],
    };
}

enum bd_err bd_job_check_measure(struct bd_reference_runner *runner, struct bd_check_views *views,
                                 const struct bd_checked *checked, struct bd_check_result *out,
                                 struct bd_err_detail *detail)
{
    struct bd_job *job = checked->job;
    struct tracing tracing = {.runner = runner, .job = job, .seed = job->request.frame.seed};
    bool reused;
    enum bd_err err = plan_reference(checked, model_of(checked), &tracing, detail);
    if (!err)
        err = bd_reference_runner_take(runner, job->request.scene, bd_job_should_stop, job,
                                       &tracing.reference, &reused, detail);
    if (err) return err;
    const struct bd_check_frame frame = frame_of(checked->layers);
    const struct bd_check_options options = options_of(checked);
    const bool is_point = tracing.integrand.filter == BD_FILTER_POINT;
    const struct bd_check_tracer tracer = {trace, loop, &tracing, is_point ? first_surface : NULL};
    const struct bd_reference_subject subject = {.scene = job->request.scene,
                                                 .integrand = &tracing.integrand,
                                                 .view = &tracing.view,
                                                 .seed = tracing.seed};
    struct bd_check_cache *cache = bd_check_views_find(views, &subject);
    err = bd_check_run(&frame, &options, &tracer, cache, out, detail);
    bd_reference_runner_give_back(runner, &tracing.reference);
    return err;
}

// --- hidden light ---------------------------------------------------------------------------

// A share is told to two digits: it needs far fewer samples than an error does.
#define HIDDEN_SAMPLES_MAX (1u << 16)

// Indirect light alone, in the place of all.
static void trace_indirect(void *user, uint32_t x_px, uint32_t y_px, uint32_t first, uint32_t count,
                           struct bd_reference_pixel *pixel)
{
    struct bd_reference_pixel all = {0};
    trace(user, x_px, y_px, first, count, &all);
    for (int c = 0; c < 3; c++) {
        for (int half = 0; half < 2; half++)
            pixel->sum[half][BD_PART_INDIRECT][c] += all.sum[half][BD_PART_INDIRECT][c];
        pixel->beauty_square_sum[c] += all.square_sum[BD_PART_INDIRECT][c];
    }
    pixel->sample_count[0] += count;
    pixel->sample_count[1] += count;
}

// The mean of indirect light over the picture, by the integrand; the frame's own indirect light
// says where to look.
static enum bd_err mean_indirect(const struct bd_checked *checked, struct tracing *tracing,
                                 double *out, struct bd_err_detail *detail)
{
    const struct bd_check_frame frame = {
        .beauty = checked->layers[BD_LAYER_INDIRECT],
        .normal = checked->layers[BD_LAYER_NORMAL],
        .depth = checked->layers[BD_LAYER_DEPTH],
    };
    struct bd_check_options options = options_of(checked);
    options.samples_max = HIDDEN_SAMPLES_MAX;
    options.progress = NULL;
    options.blind = true;
    const struct bd_check_tracer tracer = {trace_indirect, loop, tracing, NULL};
    struct bd_check_result result;
    enum bd_err err = bd_check_run(&frame, &options, &tracer, NULL, &result, detail);
    *out = result.mean_reference;
    return err;
}

enum bd_err bd_job_check_hidden_share(struct bd_reference_runner *runner,
                                      const struct bd_checked *checked, double *out,
                                      struct bd_err_detail *detail)
{
    struct bd_job *job = checked->job;
    struct tracing tracing = {.runner = runner, .job = job, .seed = job->request.frame.seed};
    double open = 0, seen = 0;
    bool reused;
    enum bd_err err = plan_reference(checked, checked->technique, &tracing, detail);
    if (!err)
        err = bd_reference_runner_take(runner, job->request.scene, bd_job_should_stop, job,
                                       &tracing.reference, &reused, detail);
    if (err) return err;
    err = mean_indirect(checked, &tracing, &open, detail);
    tracing.integrand.indirect_visibility = true;
    if (!err && open > 0) err = mean_indirect(checked, &tracing, &seen, detail);
    bd_reference_runner_give_back(runner, &tracing.reference);
    *out = open > 0 ? fmin(fmax(1 - seen / open, 0), 1) : NAN;
    return err;
}

// --- the limit of another technique's model -------------------------------------------------

struct difference {
    struct tracing full, model; // `full` first: the loop's user is both
    const struct bd_image *beauty;
};

static double beauty_of(const struct bd_reference_pixel *pixel, int half, int channel)
{
    double sum = 0;
    for (int part = 0; part < BD_PART_COUNT; part++) sum += pixel->sum[half][part][channel];
    return sum;
}

static double variance_of(const struct bd_reference_pixel *pixel, int channel, double count)
{
    double mean = (beauty_of(pixel, 0, channel) + beauty_of(pixel, 1, channel)) / (2 * count);
    return fmax(pixel->beauty_square_sum[channel] / (2 * count) - mean * mean, 0);
}

// The frame plus what the model leaves out of the whole equation: the frame's "error" against that
// is the model's own. Both are traced with the same numbers: what noise they share drops out.
static void trace_difference(void *user, uint32_t x_px, uint32_t y_px, uint32_t first,
                             uint32_t count, struct bd_reference_pixel *pixel)
{
    struct difference *difference = user;
    struct bd_reference_pixel full = {0}, model = {0};
    trace(&difference->full, x_px, y_px, first, count, &full);
    trace(&difference->model, x_px, y_px, first, count, &model);
    const float *image = bd_image_at(difference->beauty, x_px, y_px);
    for (int c = 0; c < 3; c++) {
        double mean = 0;
        for (int half = 0; half < 2; half++) {
            double sum =
                (double)image[c] * count + beauty_of(&full, half, c) - beauty_of(&model, half, c);
            pixel->sum[half][BD_PART_DIRECT][c] += sum;
            mean += sum / (2 * count);
        }
        pixel->beauty_square_sum[c] +=
            2 * count *
            (mean * mean + variance_of(&full, c, count) + variance_of(&model, c, count));
    }
    pixel->sample_count[0] += count;
    pixel->sample_count[1] += count;
}

double bd_job_check_model_limit(struct bd_reference_runner *runner,
                                const struct bd_checked *checked, const struct bd_technique *other,
                                double mean_reference)
{
    struct bd_job *job = checked->job;
    const struct tracing tracing = {.runner = runner, .job = job, .seed = job->request.frame.seed};
    struct difference difference = {
        .full = tracing, .model = tracing, .beauty = checked->layers[BD_LAYER_BEAUTY]};
    const struct bd_check_frame frame = frame_of(checked->layers);
    struct bd_check_options options = options_of(checked);
    options.blind = true;
    const struct bd_check_tracer tracer = {trace_difference, loop, &difference, NULL};
    struct bd_check_result result;
    struct bd_err_detail detail;
    bool reused;
    enum bd_err err = plan_reference(checked, NULL, &difference.full, &detail);
    if (!err) err = plan_reference(checked, other, &difference.model, &detail);
    if (!err)
        err = bd_reference_runner_take(runner, job->request.scene, bd_job_should_stop, job,
                                       &difference.full.reference, &reused, &detail);
    difference.model.reference = difference.full.reference;
    if (!err) err = bd_check_run(&frame, &options, &tracer, NULL, &result, &detail);
    bd_reference_runner_give_back(runner, &difference.full.reference);
    if (err || !(mean_reference > 0)) return INFINITY;
    return result.high * result.mean_reference / mean_reference;
}
