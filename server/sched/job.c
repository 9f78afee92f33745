#include "sched/job.h"

#include <stdlib.h>

#include "base/assert.h"
#include "base/clock.h"
#include "sched/improve.h"
#include "sched/job_check.h"
#include "sched/standby.h"

struct bd_job *bd_job_create(const struct bd_job_request *request)
{
    struct bd_job *job = calloc(1, sizeof *job);
    BD_ASSERT(job);
    atomic_init(&job->reference_count, 2);
    atomic_init(&job->cancelled, false);
    atomic_init(&job->yields, false);
    atomic_init(&job->progress_ppm, 0);
    atomic_init(&job->checking, false);
    job->request = *request;
    bd_scene_retain(job->request.scene);
    bd_improve_begin(job);
    if (bd_frame_request_is_checked(&request->frame))
        job->check = bd_job_check_create(&job->request.frame);
    job->standby = bd_standby_create(&job->request);
    uint32_t deadline_ms = request->frame.deadline_ms;
    if (deadline_ms)
        job->deadline_ns = bd_clock_ns() + (deadline_ms - request->spent_ms) * UINT64_C(1000000);
    BD_ASSERT(pthread_mutex_init(&job->lock, NULL) == 0);
    BD_ASSERT(pthread_cond_init(&job->ended_changed, NULL) == 0);
    return job;
}

void bd_job_drop(struct bd_job *job)
{
    if (atomic_fetch_sub(&job->reference_count, 1) > 1) return;
    for (int l = 0; l < BD_LAYER_COUNT; l++) bd_image_destroy(&job->result.layers[l]);
    bd_scene_release(&job->request.scene);
    bd_job_check_destroy(&job->check);
    bd_standby_destroy(&job->standby);
    pthread_mutex_destroy(&job->lock);
    pthread_cond_destroy(&job->ended_changed);
    free(job);
}

bool bd_job_is_late(const struct bd_job *job)
{
    return job->deadline_ns && bd_clock_ns() > job->deadline_ns;
}

enum bd_err bd_job_should_stop(void *user)
{
    const struct bd_job *job = user;
    if (atomic_load(&job->cancelled) || atomic_load(&job->yields)) return BD_ERR_CANCELLED;
    if (bd_job_is_late(job)) return BD_ERR_DEADLINE;
    if (job->budget_ends_ns && bd_clock_ns() > job->budget_ends_ns) return BD_ERR_DEADLINE;
    return BD_ERR_OK;
}

void bd_job_describe_failure(struct bd_job *job)
{
    struct bd_err_detail *detail = &job->result.detail;
    enum bd_err err = job->result.err;
    if (err == BD_ERR_CANCELLED)
        (void)bd_err_set(detail, err, "", "cancelled");
    else if (err == BD_ERR_DEADLINE)
        (void)bd_err_set(detail, err, "deadline_ms", "the deadline of %u ms passed%s",
                         job->request.frame.deadline_ms,
                         job->request.spent_ms < job->request.frame.deadline_ms
                             ? ""
                             : " while the scene was loaded");
    else if (err == BD_ERR_DEVICE_LOST)
        (void)bd_err_set(detail, err, "", "the device was lost twice; the job is given up");
    else if (detail->err != err)
        (void)bd_err_set(detail, err, "", "%s", bd_err_name(err));
}

// Whatever ended it, and wherever it was: also in a queue, where nobody had begun a report, and
// between a frame and its check, where layers stand already.
static void settle_failure(struct bd_job_result *result)
{
    if (!result->err) return;
    for (int l = 0; l < BD_LAYER_COUNT; l++) bd_image_destroy(&result->layers[l]);
    if (result->err == BD_ERR_CANCELLED) result->report.stopped = BD_STOPPED_CANCELLED;
    if (result->err == BD_ERR_DEADLINE) result->report.stopped = BD_STOPPED_DEADLINE;
}

void bd_job_end(struct bd_job *job)
{
    settle_failure(&job->result);
    pthread_mutex_lock(&job->lock);
    job->ended = true;
    pthread_cond_broadcast(&job->ended_changed);
    pthread_mutex_unlock(&job->lock);
    if (job->request.done) job->request.done(job->request.user, job);
    bd_job_drop(job);
}

void bd_job_cancel(struct bd_job *job)
{
    atomic_store(&job->cancelled, true);
}

double bd_job_progress(const struct bd_job *job)
{
    return 1e-6 * atomic_load(&job->progress_ppm);
}

const char *bd_job_stage(const struct bd_job *job)
{
    return atomic_load(&job->checking) ? "check" : "render";
}

void bd_job_wait(struct bd_job *job)
{
    pthread_mutex_lock(&job->lock);
    while (!job->ended) pthread_cond_wait(&job->ended_changed, &job->lock);
    pthread_mutex_unlock(&job->lock);
}

void bd_job_release(struct bd_job **job)
{
    if (*job) bd_job_drop(*job);
    *job = NULL;
}

const struct bd_job_result *bd_job_result(const struct bd_job *job)
{
    return &job->result;
}
