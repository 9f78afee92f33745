#include "tests/fuzz/frames.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/clock.h"
#include "base/hash.h"
#include "sched/sched.h"

struct bd_job {
    uint32_t references; // whoever asked, and the scheduler until it has ended
    struct bd_job_request request;
    struct bd_job_result result;
    uint64_t submit_ns;
    bool is_cancelled;
    struct bd_job *next;
};

struct bd_sched {
    struct bd_sched_options options;
    struct bd_job *first;
    struct bd_sched_stats stats;
};

enum bd_err bd_sched_create(const struct bd_sched_options *options, struct bd_sched **out,
                            struct bd_err_detail *detail)
{
    (void)detail;
    struct bd_sched *sched = calloc(1, sizeof *sched);
    BD_ASSERT(sched);
    sched->options = *options;
    sched->stats.device_ok = true;
    *out = sched;
    return BD_ERR_OK;
}

void bd_sched_destroy(struct bd_sched **sched)
{
    while (frames_end_one(*sched)) continue;
    free(*sched);
    *sched = NULL;
}

enum bd_err bd_sched_submit(struct bd_sched *sched, const struct bd_job_request *request,
                            struct bd_job **out, struct bd_err_detail *detail)
{
    enum bd_err err = bd_frame_request_check(&request->frame, &sched->options.frame_limits, detail);
    if (err) return err;
    if (sched->stats.jobs_waiting >= sched->options.queue_length_max)
        return bd_err_set(detail, BD_ERR_BUSY, "jobs_waiting", "the queue is full");
    struct bd_job *job = calloc(1, sizeof *job);
    BD_ASSERT(job);
    *job = (struct bd_job){.references = 2, .request = *request, .submit_ns = bd_clock_ns()};
    bd_scene_retain(request->scene);
    struct bd_job **last = &sched->first;
    while (*last) last = &(*last)->next;
    *last = job;
    sched->stats.jobs_waiting++;
    *out = job;
    return BD_ERR_OK;
}

static enum bd_err outcome(const struct bd_job *job)
{
    const struct bd_frame_request *frame = &job->request.frame;
    if (job->is_cancelled) return BD_ERR_CANCELLED;
    if (frame->deadline_ms > 0 && bd_ms_since(job->submit_ns) > frame->deadline_ms)
        return BD_ERR_DEADLINE;
    return strcmp(frame->technique, "fail") == 0 ? BD_ERR_DEVICE : BD_ERR_OK;
}

static void fill_report(struct bd_report *report, const struct bd_job *job)
{
    const struct bd_frame_request *frame = &job->request.frame;
    memcpy(report->scene, "sha256:", 8);
    bd_sha256_hex(job->request.scene->content_sha256, report->scene + 7);
    report->width_px = frame->width_px;
    report->height_px = frame->height_px;
    memcpy(report->camera, frame->camera, sizeof report->camera);
    memcpy(report->technique, frame->technique, sizeof report->technique);
    report->params = frame->params;
    report->seed = frame->seed;
    report->aa = frame->aa;
    report->pass_count = 1;
    snprintf(report->passes[0].name, sizeof report->passes[0].name, "gbuffer");
}

static struct bd_image *grey(const struct bd_frame_request *frame, enum bd_layer layer)
{
    struct bd_image *image =
        bd_image_create(frame->width_px, frame->height_px, bd_layer_channel_count(layer));
    BD_ASSERT(image);
    const size_t count = (size_t)image->width_px * image->height_px * image->channel_count;
    for (size_t i = 0; i < count; i++) bd_image_at(image, 0, 0)[i] = 0.5f;
    return image;
}

static void render(struct bd_job *job)
{
    const struct bd_frame_request *frame = &job->request.frame;
    struct bd_job_result *result = &job->result;
    result->err = outcome(job);
    fill_report(&result->report, job);
    if (result->err == BD_ERR_CANCELLED) result->report.stopped = BD_STOPPED_CANCELLED;
    if (result->err == BD_ERR_DEADLINE) result->report.stopped = BD_STOPPED_DEADLINE;
    if (result->err) bd_err_set(&result->detail, result->err, "", "the frame was stopped");
    for (int layer = 0; !result->err && !frame->plan_only && layer < BD_LAYER_COUNT; layer++)
        if (frame->layers & 1u << layer) result->layers[layer] = grey(frame, (enum bd_layer)layer);
}

bool frames_end_one(struct bd_sched *sched)
{
    struct bd_job *job = sched->first;
    if (!job) return false;
    sched->first = job->next;
    sched->stats.jobs_waiting--;
    render(job);
    if (job->request.done) job->request.done(job->request.user, job);
    bd_job_release(&job);
    return true;
}

void bd_job_cancel(struct bd_job *job)
{
    job->is_cancelled = true;
}

double bd_job_progress(const struct bd_job *job)
{
    (void)job;
    return 0.5;
}

const char *bd_job_stage(const struct bd_job *job)
{
    (void)job;
    return "render";
}

void bd_job_wait(struct bd_job *job)
{
    BD_ASSERT(job->references == 1);
}

void bd_job_release(struct bd_job **address)
{
    struct bd_job *job = *address;
    *address = NULL;
    if (!job || --job->references > 0) return;
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
    *out = sched->stats;
}
