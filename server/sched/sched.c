#include "sched/sched_parts.h"

#include <stdio.h>
#include <stdlib.h>

#include "base/assert.h"
#include "sched/job_check.h"
#include "sched/reference_trace.h"

static void account_job(struct bd_sched_stats *stats, const struct bd_job *job)
{
    switch (job->result.err) {
    case BD_ERR_OK:
        stats->jobs_done++;
        break;
    case BD_ERR_CANCELLED:
        stats->jobs_cancelled++;
        break;
    default:
        stats->jobs_failed++;
        break;
    }
    stats->render_seconds += job->result.report.time_ms.total / 1000;
}

void bd_sched_end_job(struct bd_sched *sched, struct bd_job *job)
{
    pthread_mutex_lock(&sched->lock);
    account_job(&sched->stats, job);
    pthread_mutex_unlock(&sched->lock);
    bd_job_end(job);
}

// --- references and checks, each on its worker's thread -------------------------------------

struct asked {
    struct bd_sched *sched;
    const struct bd_job *job;
};

// Whether a frame of higher priority has the device, or waits for it.
static bool is_urgent_elsewhere(void *of)
{
    const struct asked *asked = of;
    struct bd_sched *sched = asked->sched;
    const int priority = asked->job->request.priority;
    pthread_mutex_lock(&sched->lock);
    const uint32_t count = sched->running_count;
    const bool urgent = bd_job_queue_has_above(&sched->queue, priority) ||
                        (count > 0 && sched->running[count - 1]->request.priority > priority);
    pthread_mutex_unlock(&sched->lock);
    return urgent;
}

static void run_reference(void *user, struct bd_job *job)
{
    struct bd_sched *sched = user;
    struct asked asked = {sched, job};
    const struct bd_runner_caller caller = {BD_RUNNER_ASKED, is_urgent_elsewhere, &asked};
    job->result.err = bd_reference_trace_job(sched->reference_runner, &caller, job);
    if (job->result.err) bd_job_describe_failure(job);
}

static void reference_ran(void *user, struct bd_job *job)
{
    bd_job_check_take_traced(job);
    bd_sched_end_job(user, job);
}

static void run_check(void *user, struct bd_job *job)
{
    struct bd_sched *sched = user;
    job->render_again = bd_job_check_run(sched->reference_runner, sched->check_views, job);
}

// A job that comes back for its next frame was let in already: the queue's bound is for new ones.
static bool render_again(struct bd_sched *sched, struct bd_job *job)
{
    pthread_mutex_lock(&sched->lock);
    bool queued = !sched->stopping;
    if (queued) bd_job_queue_return(&sched->queue, job);
    pthread_cond_signal(&sched->work_changed);
    pthread_mutex_unlock(&sched->lock);
    return queued;
}

static void check_ran(void *user, struct bd_job *job)
{
    struct bd_sched *sched = user;
    const bool is_traced = bd_frame_request_is_traced(&job->request.frame);
    if (job->render_again && is_traced && bd_job_worker_push(sched->references, job, true)) return;
    if (job->render_again && !is_traced && render_again(sched, job)) return;
    if (job->render_again)
        job->result.err =
            bd_err_set(&job->result.detail, BD_ERR_CANCELLED, "", "the daemon is stopping");
    bd_sched_end_job(sched, job);
}

// --- from any thread ------------------------------------------------------------------------

static void free_sched(struct bd_sched *sched)
{
    bd_job_worker_destroy(&sched->references);
    bd_job_worker_destroy(&sched->checks);
    bd_check_views_destroy(&sched->check_views);
    bd_reference_runner_destroy(&sched->reference_runner);
    bd_job_queue_finish(&sched->queue);
    pthread_mutex_destroy(&sched->lock);
    pthread_cond_destroy(&sched->work_changed);
    free(sched);
}

static void wait_until_started(struct bd_sched *sched)
{
    pthread_mutex_lock(&sched->lock);
    while (!sched->started) pthread_cond_wait(&sched->work_changed, &sched->lock);
    pthread_mutex_unlock(&sched->lock);
}

enum bd_err bd_sched_create(const struct bd_sched_options *options, struct bd_sched **out,
                            struct bd_err_detail *detail)
{
    struct bd_sched *sched = calloc(1, sizeof *sched);
    BD_ASSERT(sched);
    sched->options = *options;
    snprintf(sched->device, sizeof sched->device, "%s", options->device);
    sched->disk_reserve_bytes = options->disk_reserve_bytes;
    if (options->data_directory)
        snprintf(sched->cache_directory, sizeof sched->cache_directory, "%s/shader-cache",
                 options->data_directory);
    bd_job_queue_init(&sched->queue, options->queue_length_max);
    BD_ASSERT(pthread_mutex_init(&sched->lock, NULL) == 0);
    BD_ASSERT(pthread_cond_init(&sched->work_changed, NULL) == 0);
    sched->reference_runner = bd_reference_runner_create(options->reference_threads);
    sched->references = bd_job_worker_create(
        options->queue_length_max,
        &(struct bd_job_work){.run = run_reference, .ran = reference_ran, .user = sched});
    sched->check_views = bd_check_views_create();
    sched->checks = bd_job_worker_create(
        options->queue_length_max,
        &(struct bd_job_work){
            .run = run_check, .ran = check_ran, .user = sched, .steps_back = true});
    BD_ASSERT(pthread_create(&sched->thread, NULL, bd_sched_render_thread, sched) == 0);
    wait_until_started(sched);
    if (sched->start_err) {
        pthread_join(sched->thread, NULL);
        if (detail) *detail = sched->start_detail;
        enum bd_err err = sched->start_err;
        free_sched(sched);
        return err;
    }
    *out = sched;
    return BD_ERR_OK;
}

void bd_sched_destroy(struct bd_sched **sched)
{
    struct bd_sched *s = *sched;
    *sched = NULL;
    if (!s) return;
    pthread_mutex_lock(&s->lock);
    s->stopping = true;
    for (uint32_t i = 0; i < s->running_count; i++) bd_job_cancel(s->running[i]);
    pthread_cond_broadcast(&s->work_changed);
    pthread_mutex_unlock(&s->lock);
    pthread_join(s->thread, NULL);
    bd_job_queue_fail_all(&s->queue);
    free_sched(s);
}

static bool push(struct bd_sched *sched, struct bd_job *job)
{
    pthread_mutex_lock(&sched->lock);
    bool queued = !sched->stopping && bd_job_queue_push(&sched->queue, job);
    pthread_cond_signal(&sched->work_changed);
    pthread_mutex_unlock(&sched->lock);
    return queued;
}

enum bd_err bd_sched_submit(struct bd_sched *sched, const struct bd_job_request *request,
                            struct bd_job **out, struct bd_err_detail *detail)
{
    enum bd_err err = bd_frame_request_check(&request->frame, &sched->options.frame_limits, detail);
    if (err) return err;
    struct bd_job *job = bd_job_create(request);
    bool queued = bd_frame_request_is_traced(&request->frame)
                      ? bd_job_worker_push(sched->references, job, false)
                      : push(sched, job);
    if (!queued) {
        bd_job_drop(job);
        bd_job_drop(job);
        return bd_err_set(detail, BD_ERR_BUSY, "queue", "%u jobs are waiting already",
                          sched->options.queue_length_max);
    }
    *out = job;
    return BD_ERR_OK;
}

static void add_waiting(struct bd_job_worker *worker, struct bd_sched_stats *stats)
{
    uint32_t waiting, running;
    bd_job_worker_count(worker, &waiting, &running);
    stats->jobs_waiting += waiting;
    stats->jobs_running += running;
}

void bd_sched_stats(struct bd_sched *sched, struct bd_sched_stats *out)
{
    pthread_mutex_lock(&sched->lock);
    *out = sched->stats;
    out->jobs_waiting = sched->queue.count;
    out->jobs_running = sched->running_count;
    pthread_mutex_unlock(&sched->lock);
    add_waiting(sched->references, out);
    add_waiting(sched->checks, out);
    struct bd_reference_runner_stats reference;
    bd_reference_runner_stats(sched->reference_runner, &reference);
    out->reference_memory_mib = (double)reference.memory_bytes / (1 << 20);
}
