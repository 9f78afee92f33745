// The render thread: whose turn it is, and for how long.

#include "sched/sched_parts.h"

#include <string.h>

#include "base/assert.h"
#include "base/clock.h"
#include "sched/improve.h"
#include "sched/job_check.h"
#include "sched/standby.h"

// So often may a job begin anew to make room for others: then it is its turn.
#define YIELDS_MAX 32
// So long has a job the device before other owners' of its own priority come between its slices:
// one view's first frame of a large scene takes seconds, others' frames much less.
#define TURN_NS UINT64_C(200000000)
// How often a job is tried on devices that fail.
#define ATTEMPTS_MAX 2

// --- whose turn it is, on the render thread --------------------------------------------------

static void begin_running(struct bd_sched *sched, struct bd_job *job)
{
    job->has_the_device_alone = false;
    job->turn_ends_ns = bd_clock_ns() + TURN_NS;
    sched->running[sched->running_count++] = job;
}

static void end_running(struct bd_sched *sched, const struct bd_job *job)
{
    BD_ASSERT(sched->running_count > 0 && sched->running[sched->running_count - 1] == job);
    sched->running_count--;
}

// Accounts for the time since the last note, which `job` had.
static void note_time(struct bd_sched *sched, const struct bd_job *job)
{
    const int priority = job->request.priority;
    const uint64_t now_ns = bd_clock_ns(), spent_ns = now_ns - sched->noted_ns;
    const double ms = (double)spent_ns * 1e-6;
    sched->noted_ns = now_ns;
    bd_stalls_add(&sched->stats.render_stalls, now_ns, spent_ns);
    bool lower_waits = sched->running_count > 1 || bd_job_queue_has_below(&sched->queue, priority);
    bd_fair_share_note(&sched->share, ms, lower_waits,
                       bd_job_queue_has_above(&sched->queue, priority));
}

static struct bd_job *pop_next(struct bd_sched *sched)
{
    struct bd_job *lower =
        bd_fair_share_begins_lower(&sched->share) ? bd_job_queue_pop_lower(&sched->queue) : NULL;
    return lower ? lower : bd_job_queue_pop(&sched->queue);
}

// Not between the slices of one that came between an equal's itself.
static bool equals_come_between(const struct bd_sched *sched, const struct bd_job *job)
{
    const uint32_t top = sched->running_count - 1;
    const int priority = job->request.priority;
    bool is_between = top > 0 && sched->running[top - 1]->request.priority == priority;
    return !is_between && bd_clock_ns() > job->turn_ends_ns;
}

// The job for which `job` is set aside between two of its slices; NULL: it goes on.
static struct bd_job *pop_urgent(struct bd_sched *sched, const struct bd_job *job)
{
    pthread_mutex_lock(&sched->lock);
    note_time(sched, job);
    bool goes_on = sched->stopping || job->has_the_device_alone ||
                   sched->running_count == BD_FRAMES_MAX ||
                   bd_fair_share_keeps_lower(&sched->share);
    struct bd_job *urgent =
        goes_on ? NULL
                : bd_job_queue_pop_between(&sched->queue, job, equals_come_between(sched, job));
    if (urgent) begin_running(sched, urgent);
    pthread_mutex_unlock(&sched->lock);
    return urgent;
}

// --- one job, on the render thread ----------------------------------------------------------

struct turn {
    struct bd_sched *sched;
    struct bd_job *job;
};

static enum bd_err between_slices(void *user);

static enum bd_err render(struct bd_sched *sched, struct bd_job *job)
{
    struct turn turn = {sched, job};
    memset(&job->rendered.report, 0, sizeof job->rendered.report);
    return bd_frame_render(&sched->renderer, job->request.scene, &job->request.frame,
                           between_slices, &turn, job->rendered.layers, &job->rendered.report,
                           &job->rendered.detail);
}

static enum bd_err run_job(struct bd_sched *sched, struct bd_job *job)
{
    enum bd_err err = BD_ERR_OK;
    for (int attempt = 0; attempt < ATTEMPTS_MAX; attempt++) {
        err = sched->gpu ? BD_ERR_OK : bd_sched_open_device(sched, 0, &job->rendered.detail);
        sched->spoilt_by_other = false;
        if (!err) err = render(sched, job);
        if (!bd_sched_device_is_spoilt(sched)) break;
        bd_sched_drop_device(sched);
        if (!err) break;
        if (sched->spoilt_by_other) attempt--; // whose own attempts are counted
    }
    return err;
}

static void take_result(struct bd_job *job, enum bd_err err)
{
    job->result = job->rendered;
    job->rendered = (struct bd_job_result){0};
    job->result.err = err;
    if (err) bd_job_describe_failure(job);
}

static void account_memory(struct bd_sched *sched, const struct bd_job *job)
{
    struct bd_sched_stats *stats = &sched->stats;
    if (!sched->gpu) return;
    struct bd_gpu_memory memory;
    bd_gpu_memory(sched->gpu, &memory);
    stats->gpu_memory_mib = (double)memory.used_bytes / (1 << 20);
    if (job->rendered.report.memory_gpu_peak_mib > stats->gpu_memory_peak_mib)
        stats->gpu_memory_peak_mib = job->rendered.report.memory_gpu_peak_mib;
}

// --- jobs, one after the other ---------------------------------------------------------------

static struct bd_job *wait_for_job(struct bd_sched *sched)
{
    pthread_mutex_lock(&sched->lock);
    while (!sched->stopping && sched->queue.count == 0)
        pthread_cond_wait(&sched->work_changed, &sched->lock);
    struct bd_job *job = sched->stopping ? NULL : pop_next(sched);
    if (job) begin_running(sched, job);
    sched->noted_ns = bd_clock_ns();
    pthread_mutex_unlock(&sched->lock);
    return job;
}

// False: it goes on to its check, and is not this thread's any more.
static bool is_at_its_end(struct bd_sched *sched, struct bd_job *job)
{
    if (!job->check) return true;
    bd_job_check_settle(job);
    if (job->result.err || job->result.report.stopped != BD_STOPPED_COMPLETE) return true;
    if (bd_job_worker_push(sched->checks, job, job->render_again)) return false;
    job->result.err = bd_err_set(&job->result.detail, BD_ERR_BUSY, "check",
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
    job->result.detail = (struct bd_err_detail){0};
    return true;
}

static void finish_job(struct bd_sched *sched, struct bd_job *job, enum bd_err err)
{
    pthread_mutex_lock(&sched->lock);
    note_time(sched, job);
    end_running(sched, job);
    account_memory(sched, job);
    if (!job->is_given_up) take_result(job, err);
    bool waits_again = !job->is_given_up &&
                       (has_yielded(sched, job) || bd_standby_take(job) || bd_improve_take(job));
    if (waits_again) bd_job_queue_put_back(&sched->queue, job);
    pthread_mutex_unlock(&sched->lock);
    if (waits_again) return;
    if (job->is_given_up)
        bd_job_drop(job);
    else if (is_at_its_end(sched, job))
        bd_sched_end_job(sched, job);
}

// One that was cancelled, and waits or is set aside, where it could not notice; NULL if there is
// none.
static struct bd_job *take_cancelled(struct bd_sched *sched)
{
    pthread_mutex_lock(&sched->lock);
    struct bd_job *job = bd_job_queue_take_cancelled(&sched->queue);
    for (uint32_t i = 0; !job && i + 1 < sched->running_count; i++) {
        struct bd_job *aside = sched->running[i];
        if (aside->is_given_up || !atomic_load(&aside->cancelled)) continue;
        aside->is_given_up = true;
        atomic_fetch_add(&aside->reference_count, 1); // its frame's, which has the device later
        job = aside;
    }
    pthread_mutex_unlock(&sched->lock);
    return job;
}

// They end now, not after the frames that keep them from running: a view has its next frame
// rendered when the one it cancelled has ended.
static void end_cancelled(struct bd_sched *sched)
{
    struct bd_job *job;
    while ((job = take_cancelled(sched)) != NULL) {
        job->result.err = BD_ERR_CANCELLED;
        bd_job_describe_failure(job);
        bd_sched_end_job(sched, job);
    }
}

// Waits again, as if it had not run.
static void put_back(struct bd_sched *sched, struct bd_job *job)
{
    pthread_mutex_lock(&sched->lock);
    note_time(sched, job);
    end_running(sched, job);
    job->rendered.detail = (struct bd_err_detail){0};
    bd_job_queue_put_back(&sched->queue, job);
    pthread_mutex_unlock(&sched->lock);
}

// There is no room for both frames. The one set aside begins anew later, over the passes that the
// memo has; unless it did so often enough, or is in the middle of a check.
static enum bd_err make_room(struct bd_job *aside)
{
    if (aside->check || aside->yield_count >= YIELDS_MAX) {
        aside->has_the_device_alone = true;
        return BD_ERR_OK;
    }
    atomic_store(&aside->yields, true);
    return BD_ERR_CANCELLED;
}

// Runs a job while another's frame is set aside. An error is for that one: it must end first.
static enum bd_err run_urgent(struct bd_sched *sched, struct bd_job *job, struct bd_job *aside)
{
    enum bd_err err = render(sched, job);
    const bool is_spoilt = bd_sched_device_is_spoilt(sched);
    if (is_spoilt && !sched->spoilt_by_other) job->spoilt_count++;
    sched->spoilt_by_other |= is_spoilt;
    if (err && is_spoilt && !job->is_given_up && job->spoilt_count < ATTEMPTS_MAX) {
        put_back(sched, job);
        return bd_gpu_status(sched->gpu);
    }
    if (err == BD_ERR_NO_MEMORY && !is_spoilt && !job->is_given_up) {
        put_back(sched, job);
        return make_room(aside);
    }
    finish_job(sched, job, err);
    return bd_gpu_status(sched->gpu);
}

// Asked by the frame that runs: whether to stop. Meanwhile frames of higher priority are rendered.
static enum bd_err between_slices(void *user)
{
    const struct turn *turn = user;
    struct bd_sched *sched = turn->sched;
    struct bd_suspended_frame suspended;
    const uint64_t start_ns = bd_clock_ns();
    bool is_aside = false;
    end_cancelled(sched);
    enum bd_err err = bd_job_should_stop(turn->job);
    struct bd_job *urgent;
    while (!err && (urgent = pop_urgent(sched, turn->job)) != NULL) {
        if (!is_aside) bd_renderer_suspend(&sched->renderer, &suspended);
        is_aside = true;
        err = run_urgent(sched, urgent, turn->job);
        if (!err) err = bd_job_should_stop(turn->job);
    }
    if (!is_aside) return err;
    bd_renderer_resume(&sched->renderer, &suspended);
    // As long as the others had it: two long frames share the device evenly.
    const uint64_t now_ns = bd_clock_ns(), away_ns = now_ns - start_ns;
    turn->job->turn_ends_ns = now_ns + (away_ns > TURN_NS ? away_ns : TURN_NS);
    return err;
}

void *bd_sched_render_thread(void *user)
{
    struct bd_sched *sched = user;
    struct bd_err_detail detail = {0};
    enum bd_err err = bd_sched_open_device(sched, sched->options.lose_device_after_slices, &detail);
    pthread_mutex_lock(&sched->lock);
    sched->started = true;
    sched->start_err = err;
    sched->start_detail = detail;
    pthread_cond_broadcast(&sched->work_changed);
    pthread_mutex_unlock(&sched->lock);
    struct bd_job *job;
    while (!err && (job = wait_for_job(sched)) != NULL) {
        enum bd_err ended = run_job(sched, job);
        bd_sched_mend_device(sched);
        finish_job(sched, job, ended);
    }
    bd_sched_close_device(sched);
    return NULL;
}
