#include "sched/reference_jobs.h"

#include <pthread.h>
#include <stdlib.h>

#include "base/assert.h"
#include "sched/queue.h"
#include "sched/reference_trace.h"

struct bd_reference_jobs {
    struct bd_reference_runner *runner;
    void (*ended)(void *user, const struct bd_job *job);
    void *user;

    pthread_mutex_t lock; // of everything below
    pthread_cond_t work_changed;
    struct bd_job_queue queue;
    struct bd_job *running;
    bool stopping, started;
    pthread_t thread;
};

struct bd_reference_jobs *bd_reference_jobs_create(uint32_t capacity,
                                                   struct bd_reference_runner *runner,
                                                   void (*ended)(void *user,
                                                                 const struct bd_job *job),
                                                   void *user)
{
    struct bd_reference_jobs *jobs = calloc(1, sizeof *jobs);
    BD_ASSERT(jobs);
    jobs->runner = runner;
    jobs->ended = ended;
    jobs->user = user;
    bd_job_queue_init(&jobs->queue, capacity);
    BD_ASSERT(pthread_mutex_init(&jobs->lock, NULL) == 0);
    BD_ASSERT(pthread_cond_init(&jobs->work_changed, NULL) == 0);
    return jobs;
}

static struct bd_job *wait_for_job(struct bd_reference_jobs *jobs)
{
    pthread_mutex_lock(&jobs->lock);
    while (!jobs->stopping && jobs->queue.count == 0)
        pthread_cond_wait(&jobs->work_changed, &jobs->lock);
    struct bd_job *job = jobs->stopping ? NULL : bd_job_queue_pop(&jobs->queue);
    jobs->running = job;
    pthread_mutex_unlock(&jobs->lock);
    return job;
}

static void *coordinator(void *user)
{
    struct bd_reference_jobs *jobs = user;
    struct bd_job *job;
    while ((job = wait_for_job(jobs)) != NULL) {
        job->result.err = bd_reference_trace_job(jobs->runner, job);
        if (job->result.err) bd_job_describe_failure(job);
        pthread_mutex_lock(&jobs->lock);
        jobs->running = NULL;
        pthread_mutex_unlock(&jobs->lock);
        jobs->ended(jobs->user, job);
        bd_job_end(job);
    }
    return NULL;
}

bool bd_reference_jobs_push(struct bd_reference_jobs *jobs, struct bd_job *job)
{
    pthread_mutex_lock(&jobs->lock);
    bool queued = !jobs->stopping && bd_job_queue_push(&jobs->queue, job);
    if (queued && !jobs->started) {
        BD_ASSERT(pthread_create(&jobs->thread, NULL, coordinator, jobs) == 0);
        jobs->started = true;
    }
    pthread_cond_signal(&jobs->work_changed);
    pthread_mutex_unlock(&jobs->lock);
    return queued;
}

void bd_reference_jobs_destroy(struct bd_reference_jobs **jobs)
{
    struct bd_reference_jobs *j = *jobs;
    *jobs = NULL;
    if (!j) return;
    pthread_mutex_lock(&j->lock);
    j->stopping = true;
    if (j->running) bd_job_cancel(j->running);
    pthread_cond_broadcast(&j->work_changed);
    pthread_mutex_unlock(&j->lock);
    if (j->started) pthread_join(j->thread, NULL);
    bd_job_queue_fail_all(&j->queue);
    bd_job_queue_finish(&j->queue);
    pthread_mutex_destroy(&j->lock);
    pthread_cond_destroy(&j->work_changed);
    free(j);
}

void bd_reference_jobs_count(struct bd_reference_jobs *jobs, uint32_t *waiting, uint32_t *running)
{
    pthread_mutex_lock(&jobs->lock);
    *waiting = jobs->queue.count;
    *running = jobs->running != NULL;
    pthread_mutex_unlock(&jobs->lock);
}
