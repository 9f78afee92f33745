// A scheduler without a GPU, for the tests of net/: the same interface, the same thread, and a
// gradient where a frame would be. Frames take BD_FAKE_FRAME_MS milliseconds (default 0), the first
// one BD_FAKE_COMPILE_MS more that no pass accounts for, and heed cancel and deadlines as real ones
// do; they estimate their error to be BD_FAKE_ESTIMATE, if that is set. A scene's technique "fail"
// fails.

#include "sched/sched.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/clock.h"
#include "base/hash.h"
#include "technique/technique.h"

struct bd_job {
    uint32_t references;
    struct bd_sched *sched;
    struct bd_job_request request;
    struct bd_job_result result;
    uint64_t submit_ns;
    bool cancelled, ended;
    struct bd_job *next;
};

struct bd_sched {
    struct bd_sched_options options;
    pthread_t thread;
    pthread_mutex_t lock;
    pthread_cond_t changed;
    struct bd_job *waiting, *running;
    bool stopping;
    double frame_ms, compile_ms; // the latter once
    const char *estimate;        // NULL: none
    struct bd_sched_stats stats;
};

static bool asked_to_stop(struct bd_job *job)
{
    pthread_mutex_lock(&job->sched->lock);
    bool stop = job->cancelled || job->sched->stopping;
    pthread_mutex_unlock(&job->sched->lock);
    return stop;
}

static bool is_late(const struct bd_job *job)
{
    uint32_t deadline_ms = job->request.frame.deadline_ms;
    return deadline_ms > 0 && bd_ms_since(job->submit_ns) + job->request.spent_ms > deadline_ms;
}

static enum bd_err wait_for_frame(struct bd_job *job)
{
    uint64_t start_ns = bd_clock_ns();
    double wait_ms = job->sched->frame_ms + job->sched->compile_ms;
    job->sched->compile_ms = 0;
    while (!job->request.frame.plan_only && bd_ms_since(start_ns) < wait_ms) {
        struct timespec slice = {.tv_nsec = 2000000};
        nanosleep(&slice, NULL);
        if (asked_to_stop(job) || is_late(job)) break;
    }
    if (asked_to_stop(job)) return BD_ERR_CANCELLED;
    if (is_late(job)) return BD_ERR_DEADLINE;
    return strcmp(job->request.frame.technique, "fail") == 0 ? BD_ERR_DEVICE : BD_ERR_OK;
}

static struct bd_image *gradient(const struct bd_frame_request *frame, enum bd_layer layer)
{
    struct bd_image *image = bd_image_create(frame->width_px, frame->height_px, bd_layer_channel_count(layer));
    BD_ASSERT(image);
    for (uint32_t y = 0; y < image->height_px; y++)
        for (uint32_t x = 0; x < image->width_px; x++)
            for (uint32_t c = 0; c < image->channel_count; c++)
                bd_image_at(image, x, y)[c] = c == 3 ? 1.0f : (float)(x + y + c + 1) * 0.01f;
    return image;
}

static void fill_report(struct bd_report *report, const struct bd_job *job)
{
    const struct bd_frame_request *frame = &job->request.frame;
    memcpy(report->scene, "sha256:", 8);
    bd_sha256_hex(job->request.scene->content_sha256, report->scene + 7);
    report->width_px = frame->width_px;
    report->height_px = frame->height_px;
    snprintf(report->camera, sizeof report->camera, "%s", frame->camera);
    snprintf(report->technique, sizeof report->technique, "%s",
             frame->technique[0] ? frame->technique : BD_TECHNIQUE_AUTO);
    report->params = frame->params;
    report->seed = frame->seed;
    report->aa = frame->aa;
    snprintf(report->filter, sizeof report->filter, "%s", frame->aa == 1 ? "point" : "box");
    snprintf(report->device.name, sizeof report->device.name, "gradient");
    snprintf(report->device.device_class, sizeof report->device.device_class, "gradient-1");
    report->device.software = true;
    report->time_ms.total = bd_ms_since(job->submit_ns);
    report->pass_count = 2;
    snprintf(report->passes[0].name, sizeof report->passes[0].name, "gbuffer");
    snprintf(report->passes[1].name, sizeof report->passes[1].name, "rsm");
    report->passes[0].state = frame->plan_only ? BD_PASS_PLANNED : BD_PASS_RAN;
    report->passes[1].state = frame->plan_only ? BD_PASS_PLANNED : BD_PASS_REUSED;
    report->passes[0].ms = job->sched->frame_ms;
    report->passes[0].sub_frames = 1;
    report->passes[0].of_each_sub_frame = true;
    report->has_own_estimate = job->sched->estimate != NULL;
    if (report->has_own_estimate)
        report->own_estimate = report->shown_estimate = atof(job->sched->estimate);
    report->flag_count = 1;
    snprintf(report->flags[0], sizeof report->flags[0], "default_lights");
}

static void render(struct bd_job *job)
{
    const struct bd_frame_request *frame = &job->request.frame;
    struct bd_job_result *result = &job->result;
    enum bd_err err = wait_for_frame(job);
    fill_report(&result->report, job);
    result->err = err;
    result->report.stopped = err == BD_ERR_CANCELLED  ? BD_STOPPED_CANCELLED
                             : err == BD_ERR_DEADLINE ? BD_STOPPED_DEADLINE
                                                      : BD_STOPPED_COMPLETE;
    if (err) bd_err_set(&result->detail, err, "", "the gradient was stopped: %s", bd_err_name(err));
    if (err || frame->plan_only) return;
    for (int layer = 0; layer < BD_LAYER_COUNT; layer++)
        if (frame->layers & 1u << layer) result->layers[layer] = gradient(frame, layer);
}

static struct bd_job *next_job(struct bd_sched *sched)
{
    pthread_mutex_lock(&sched->lock);
    while (!sched->waiting && !sched->stopping) pthread_cond_wait(&sched->changed, &sched->lock);
    struct bd_job *job = sched->waiting;
    if (job) {
        sched->waiting = job->next;
        sched->stats.jobs_waiting--;
        sched->stats.jobs_running = 1;
    }
    pthread_mutex_unlock(&sched->lock);
    return job;
}

static void end_job(struct bd_job *job)
{
    struct bd_sched *sched = job->sched;
    pthread_mutex_lock(&sched->lock);
    job->ended = true;
    sched->stats.jobs_running = 0;
    sched->stats.jobs_done += job->result.err == BD_ERR_OK;
    sched->stats.jobs_cancelled += job->result.err == BD_ERR_CANCELLED;
    sched->stats.jobs_failed += job->result.err != BD_ERR_OK && job->result.err != BD_ERR_CANCELLED;
    pthread_cond_broadcast(&sched->changed);
    pthread_mutex_unlock(&sched->lock);
    if (job->request.done) job->request.done(job->request.user, job);
    bd_job_release(&job);
}

static void *thread_main(void *data)
{
    struct bd_sched *sched = data;
    for (struct bd_job *job; (job = next_job(sched));) {
        render(job);
        end_job(job);
    }
    return NULL;
}

enum bd_err bd_sched_create(const struct bd_sched_options *options, struct bd_sched **out,
                            struct bd_err_detail *detail)
{
    (void)detail;
    struct bd_sched *sched = calloc(1, sizeof *sched);
    BD_ASSERT(sched);
    const char *frame_ms = getenv("BD_FAKE_FRAME_MS");
    sched->options = *options;
    sched->frame_ms = frame_ms ? atof(frame_ms) : 0;
    sched->estimate = getenv("BD_FAKE_ESTIMATE");
    const char *compile_ms = getenv("BD_FAKE_COMPILE_MS");
    sched->compile_ms = compile_ms ? atof(compile_ms) : 0;
    snprintf(sched->stats.device_name, sizeof sched->stats.device_name, "gradient \"quoted\"");
    snprintf(sched->stats.device_class, sizeof sched->stats.device_class, "gradient-1");
    sched->stats.software = sched->stats.device_ok = true;
    pthread_mutex_init(&sched->lock, NULL);
    pthread_cond_init(&sched->changed, NULL);
    pthread_create(&sched->thread, NULL, thread_main, sched);
    *out = sched;
    return BD_ERR_OK;
}

void bd_sched_destroy(struct bd_sched **sched)
{
    pthread_mutex_lock(&(*sched)->lock);
    (*sched)->stopping = true;
    pthread_cond_broadcast(&(*sched)->changed);
    pthread_mutex_unlock(&(*sched)->lock);
    pthread_join((*sched)->thread, NULL);
    free(*sched);
    *sched = NULL;
}

enum bd_err bd_sched_submit(struct bd_sched *sched, const struct bd_job_request *request,
                            struct bd_job **out, struct bd_err_detail *detail)
{
    const struct bd_frame_request *frame = &request->frame;
    const struct bd_frame_limits *limits = &sched->options.frame_limits;
    if (frame->width_px == 0 || frame->width_px > limits->side_px_max || frame->height_px == 0 ||
        frame->height_px > limits->side_px_max ||
        (uint64_t)frame->width_px * frame->height_px > limits->pixel_count_max)
        return bd_err_set(detail, BD_ERR_LIMIT, "size", "%ux%u is above the limit image_side_px",
                          frame->width_px, frame->height_px);
    pthread_mutex_lock(&sched->lock);
    bool full = sched->stats.jobs_waiting >= sched->options.queue_length_max;
    pthread_mutex_unlock(&sched->lock);
    if (full) return bd_err_set(detail, BD_ERR_BUSY, "jobs_waiting", "the queue is full");

    struct bd_job *job = calloc(1, sizeof *job);
    BD_ASSERT(job);
    *job = (struct bd_job){
        .references = 2, .sched = sched, .request = *request, .submit_ns = bd_clock_ns()};
    bd_scene_retain(request->scene);
    pthread_mutex_lock(&sched->lock);
    struct bd_job **last = &sched->waiting;
    while (*last) last = &(*last)->next;
    *last = job;
    sched->stats.jobs_waiting++;
    pthread_cond_broadcast(&sched->changed);
    pthread_mutex_unlock(&sched->lock);
    *out = job;
    return BD_ERR_OK;
}

void bd_job_cancel(struct bd_job *job)
{
    pthread_mutex_lock(&job->sched->lock);
    job->cancelled = true;
    pthread_mutex_unlock(&job->sched->lock);
}

double bd_job_progress(const struct bd_job *job)
{
    double share = job->sched->frame_ms > 0 ? bd_ms_since(job->submit_ns) / job->sched->frame_ms : 0;
    return share < 1 ? share : 1;
}

const char *bd_job_stage(const struct bd_job *job)
{
    (void)job;
    return "render";
}

void bd_job_wait(struct bd_job *job)
{
    pthread_mutex_lock(&job->sched->lock);
    while (!job->ended) pthread_cond_wait(&job->sched->changed, &job->sched->lock);
    pthread_mutex_unlock(&job->sched->lock);
}

void bd_job_release(struct bd_job **address)
{
    struct bd_job *job = *address;
    *address = NULL;
    if (__atomic_sub_fetch(&job->references, 1, __ATOMIC_ACQ_REL) > 0) return;
    for (int layer = 0; layer < BD_LAYER_COUNT; layer++)
        bd_image_destroy(&job->result.layers[layer]);
    bd_scene_release(&job->request.scene);
    free(job);
}

const struct bd_job_result *bd_job_result(const struct bd_job *job)
{
    return &job->result;
}

void bd_sched_stats(struct bd_sched *sched, struct bd_sched_stats *out)
{
    pthread_mutex_lock(&sched->lock);
    *out = sched->stats;
    pthread_mutex_unlock(&sched->lock);
}
