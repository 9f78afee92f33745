#include "sched/sched.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/clock.h"
#include "base/log.h"
#include "frame/frame.h"
#include "sched/check_views.h"
#include "sched/job.h"
#include "sched/job_check.h"
#include "sched/queue.h"
#include "sched/reference_trace.h"
#include "sched/worker.h"

#define GPU_MEMORY_UNKNOWN_MIB 2048
// So often may a job begin anew for others: then it is its turn.
#define YIELDS_MAX 32
// Share of the memory limit that may hold outputs for frames to come; and no more than so much of a
// software device's, which is the host's own memory and shows as the daemon's.
#define MEMO_SHARE        0.6
#define MEMO_SOFTWARE_MIB 512

struct bd_sched {
    struct bd_sched_options options;
    char device[64];
    char cache_directory[4096];
    pthread_t thread;
    struct bd_reference_runner *reference_runner;
    struct bd_job_worker *references, *checks;
    struct bd_check_views *check_views; // the checks' worker only

    pthread_mutex_t lock; // of everything below
    pthread_cond_t work_changed;
    struct bd_job_queue queue;
    struct bd_job *running;
    bool stopping;
    bool started; // the device was tried
    enum bd_err start_err;
    struct bd_fault start_fault;
    struct bd_sched_stats stats;

    // Render thread only.
    uint64_t looked_ns; // when it last looked at what else there is to do
    struct bd_gpu *gpu;
    struct bd_renderer renderer;
};

// --- the device, on the render thread -------------------------------------------------------

static uint64_t memory_limit_bytes(uint32_t limit_mib, const struct bd_gpu_caps *caps)
{
    if (limit_mib) return (uint64_t)limit_mib << 20;
    if (caps->memory_bytes) return caps->memory_bytes / 4 * 3;
    return (uint64_t)GPU_MEMORY_UNKNOWN_MIB << 20;
}

static uint64_t memo_budget_bytes(uint64_t limit_bytes, bool software)
{
    uint64_t share = (uint64_t)((double)limit_bytes * MEMO_SHARE);
    const uint64_t software_max = (uint64_t)MEMO_SOFTWARE_MIB << 20;
    return software && share > software_max ? software_max : share;
}

static enum bd_err open_device(struct bd_sched *sched, uint32_t lose_after, struct bd_fault *fault)
{
    const struct bd_gpu_options options = {
        .device = sched->device,
        .cache_directory = sched->cache_directory[0] ? sched->cache_directory : NULL,
        .lose_after_waits = lose_after,
    };
    enum bd_err err = bd_gpu_create(&options, &sched->gpu, fault);
    if (err) return err;
    const struct bd_gpu_caps *caps = bd_gpu_caps(sched->gpu);
    uint64_t limit = memory_limit_bytes(sched->options.gpu_memory_mib, caps);
    bd_gpu_set_memory_limit(sched->gpu, limit);
    bd_renderer_init(&sched->renderer, sched->gpu, memo_budget_bytes(limit, caps->software));
    pthread_mutex_lock(&sched->lock);
    snprintf(sched->stats.device_name, sizeof sched->stats.device_name, "%s", caps->name);
    snprintf(sched->stats.device_class, sizeof sched->stats.device_class, "%s", caps->device_class);
    sched->stats.software = caps->software;
    sched->stats.device_ok = true;
    sched->stats.gpu_memory_limit_mib = (double)(limit >> 20);
    pthread_mutex_unlock(&sched->lock);
    return BD_ERR_OK;
}

static void close_device(struct bd_sched *sched)
{
    if (!sched->gpu) return;
    bd_renderer_finish(&sched->renderer);
    bd_gpu_destroy(&sched->gpu);
}

// What stuck to a device stays: out of memory in the middle of a pass or a refused call, as well as
// a loss, would fail every frame to come.
static bool is_spoilt(const struct bd_sched *sched)
{
    return sched->gpu && bd_gpu_status(sched->gpu) != BD_ERR_OK;
}

static void drop_device(struct bd_sched *sched)
{
    enum bd_err why = bd_gpu_status(sched->gpu);
    bd_log(BD_LOG_WARN, "sched", "the device has failed (%s); building it anew from the snapshots",
           bd_err_name(why));
    pthread_mutex_lock(&sched->lock);
    sched->stats.device_ok = false;
    sched->stats.device_losses += why == BD_ERR_DEVICE_LOST;
    pthread_mutex_unlock(&sched->lock);
    close_device(sched);
}

// --- one job, on the render thread ----------------------------------------------------------

static void look_up(struct bd_sched *sched)
{
    uint64_t now_ns = bd_clock_ns();
    pthread_mutex_lock(&sched->lock);
    bd_stalls_add(&sched->stats.render_stalls, now_ns, now_ns - sched->looked_ns);
    pthread_mutex_unlock(&sched->lock);
    sched->looked_ns = now_ns;
}

struct watched_job {
    struct bd_sched *sched;
    struct bd_job *job;
};

static enum bd_err should_stop(void *user)
{
    const struct watched_job *watched = user;
    look_up(watched->sched);
    return bd_job_should_stop(watched->job);
}

static enum bd_err render(struct bd_sched *sched, struct bd_job *job)
{
    enum bd_err err = bd_job_should_stop(job);
    if (err) return err;
    memset(&job->result.report, 0, sizeof job->result.report);
    struct watched_job watched = {sched, job};
    return bd_frame_render(&sched->renderer, job->request.scene, &job->request.frame, should_stop,
                           &watched, job->result.layers, &job->result.report, &job->result.fault);
}

static void run_job(struct bd_sched *sched, struct bd_job *job)
{
    enum bd_err err = BD_ERR_OK;
    for (int attempt = 0; attempt < 2; attempt++) {
        err = sched->gpu ? BD_ERR_OK : open_device(sched, 0, &job->result.fault);
        if (!err) err = render(sched, job);
        if (!is_spoilt(sched)) break;
        drop_device(sched);
        if (!err) break;
    }
    job->result.err = err;
    if (err) bd_job_describe_failure(job);
}

// Not left to the next job: a daemon without a device says that it is not ready, and gets none.
static void mend_device(struct bd_sched *sched)
{
    struct bd_fault fault = {0};
    if (!sched->gpu && open_device(sched, 0, &fault))
        bd_log(BD_LOG_ERROR, "sched", "no device any more: %s", fault.message);
}

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

static void account_memory(struct bd_sched *sched, const struct bd_job *job)
{
    struct bd_sched_stats *stats = &sched->stats;
    if (!sched->gpu) return;
    struct bd_gpu_memory memory;
    bd_gpu_memory(sched->gpu, &memory);
    stats->gpu_memory_mib = (double)memory.used_bytes / (1 << 20);
    if (job->result.report.memory_gpu_peak_mib > stats->gpu_memory_peak_mib)
        stats->gpu_memory_peak_mib = job->result.report.memory_gpu_peak_mib;
}

static void end_job(struct bd_sched *sched, struct bd_job *job)
{
    pthread_mutex_lock(&sched->lock);
    account_job(&sched->stats, job);
    pthread_mutex_unlock(&sched->lock);
    bd_job_end(job);
}

// --- references and checks, each on its worker's thread -------------------------------------

static void run_reference(void *user, struct bd_job *job)
{
    struct bd_sched *sched = user;
    job->result.err = bd_reference_trace_job(sched->reference_runner, job);
    if (job->result.err) bd_job_describe_failure(job);
}

static void reference_ran(void *user, struct bd_job *job)
{
    end_job(user, job);
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
    if (job->render_again && render_again(sched, job)) return;
    if (job->render_again)
        job->result.err =
            bd_fault_set(&job->result.fault, BD_ERR_CANCELLED, "", "the daemon is stopping");
    end_job(sched, job);
}

// --- the render thread ----------------------------------------------------------------------

static struct bd_job *wait_for_job(struct bd_sched *sched)
{
    pthread_mutex_lock(&sched->lock);
    while (!sched->stopping && sched->queue.count == 0)
        pthread_cond_wait(&sched->work_changed, &sched->lock);
    struct bd_job *job = sched->stopping ? NULL : bd_job_queue_pop(&sched->queue);
    sched->running = job;
    pthread_mutex_unlock(&sched->lock);
    return job;
}

// False: it goes on to its check, and is not this thread's any more.
static bool is_at_its_end(struct bd_sched *sched, struct bd_job *job)
{
    if (!job->check) return true;
    bd_job_check_settle(job);
    if (job->result.err || job->result.report.stopped != BD_STOPPED_COMPLETE) return true;
    if (bd_job_worker_push(sched->checks, job)) return false;
    job->result.err = bd_fault_set(&job->result.fault, BD_ERR_BUSY, "check",
                                   "%u frames are waiting for their check already",
                                   sched->options.queue_length_max);
    return true;
}

// Under the lock. A job that ended before it noticed has not.
static bool has_yielded(const struct bd_sched *sched, struct bd_job *job)
{
    bool asked = atomic_exchange(&job->yields, false);
    if (!asked || job->result.err != BD_ERR_CANCELLED) return false;
    if (sched->stopping || atomic_load(&job->cancelled)) return false;
    job->yield_count++;
    job->result.err = BD_ERR_OK;
    job->result.fault = (struct bd_fault){0};
    return true;
}

static void finish_job(struct bd_sched *sched, struct bd_job *job)
{
    pthread_mutex_lock(&sched->lock);
    sched->running = NULL;
    account_memory(sched, job);
    bool waits_again = has_yielded(sched, job);
    if (waits_again) bd_job_queue_put_back(&sched->queue, job);
    pthread_mutex_unlock(&sched->lock);
    if (waits_again) return;
    if (is_at_its_end(sched, job)) end_job(sched, job);
}

static void *render_thread(void *user)
{
    struct bd_sched *sched = user;
    struct bd_fault fault = {0};
    enum bd_err err = open_device(sched, sched->options.lose_device_after_slices, &fault);
    pthread_mutex_lock(&sched->lock);
    sched->started = true;
    sched->start_err = err;
    sched->start_fault = fault;
    pthread_cond_broadcast(&sched->work_changed);
    pthread_mutex_unlock(&sched->lock);
    struct bd_job *job;
    while (!err && (job = wait_for_job(sched)) != NULL) {
        sched->looked_ns = bd_clock_ns();
        run_job(sched, job);
        mend_device(sched);
        finish_job(sched, job);
        look_up(sched);
    }
    close_device(sched);
    return NULL;
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
                            struct bd_fault *fault)
{
    struct bd_sched *sched = calloc(1, sizeof *sched);
    BD_ASSERT(sched);
    sched->options = *options;
    snprintf(sched->device, sizeof sched->device, "%s", options->device);
    if (options->data_directory)
        snprintf(sched->cache_directory, sizeof sched->cache_directory, "%s/shader-cache",
                 options->data_directory);
    bd_job_queue_init(&sched->queue, options->queue_length_max);
    BD_ASSERT(pthread_mutex_init(&sched->lock, NULL) == 0);
    BD_ASSERT(pthread_cond_init(&sched->work_changed, NULL) == 0);
    sched->reference_runner = bd_reference_runner_create(options->reference_threads);
    sched->references = bd_job_worker_create(
        options->queue_length_max, &(struct bd_job_work){run_reference, reference_ran, sched});
    sched->check_views = bd_check_views_create();
    sched->checks = bd_job_worker_create(options->queue_length_max,
                                         &(struct bd_job_work){run_check, check_ran, sched});
    BD_ASSERT(pthread_create(&sched->thread, NULL, render_thread, sched) == 0);
    wait_until_started(sched);
    if (sched->start_err) {
        pthread_join(sched->thread, NULL);
        if (fault) *fault = sched->start_fault;
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
    if (s->running) bd_job_cancel(s->running);
    pthread_cond_broadcast(&s->work_changed);
    pthread_mutex_unlock(&s->lock);
    pthread_join(s->thread, NULL);
    bd_job_queue_fail_all(&s->queue);
    free_sched(s);
}

// A long frame must not keep one of higher priority waiting for all of its time: it stops at its
// next slice and begins anew, over the passes that it had finished. A bounded number of times.
static void make_way(struct bd_sched *sched, const struct bd_job *job)
{
    struct bd_job *running = sched->running;
    if (!running || running->request.priority >= job->request.priority) return;
    if (running->check || running->yield_count >= YIELDS_MAX) return;
    atomic_store(&running->yields, true);
}

static bool push(struct bd_sched *sched, struct bd_job *job)
{
    pthread_mutex_lock(&sched->lock);
    bool queued = !sched->stopping && bd_job_queue_push(&sched->queue, job);
    if (queued) make_way(sched, job);
    pthread_cond_signal(&sched->work_changed);
    pthread_mutex_unlock(&sched->lock);
    return queued;
}

enum bd_err bd_sched_submit(struct bd_sched *sched, const struct bd_job_request *request,
                            struct bd_job **out, struct bd_fault *fault)
{
    enum bd_err err = bd_frame_request_check(&request->frame, &sched->options.frame_limits, fault);
    if (err) return err;
    struct bd_job *job = bd_job_create(request);
    bool queued = bd_frame_request_is_traced(&request->frame)
                      ? bd_job_worker_push(sched->references, job)
                      : push(sched, job);
    if (!queued) {
        bd_job_drop(job);
        bd_job_drop(job);
        return bd_fault_set(fault, BD_ERR_BUSY, "queue", "%u jobs are waiting already",
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
    out->jobs_running = sched->running != NULL;
    pthread_mutex_unlock(&sched->lock);
    add_waiting(sched->references, out);
    add_waiting(sched->checks, out);
    struct bd_reference_runner_stats reference;
    bd_reference_runner_stats(sched->reference_runner, &reference);
    out->reference_memory_mib = (double)reference.memory_bytes / (1 << 20);
}
