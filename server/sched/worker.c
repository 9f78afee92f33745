#include "sched/worker.h"

#include <pthread.h>
#include <stdlib.h>
#include <sys/resource.h>

#include "base/assert.h"
#include "sched/queue.h"

#define STEPS_BACK 10 // of niceness: a tenth of the processor where others want it

struct bd_job_worker {
    struct bd_job_work work;

    pthread_mutex_t lock; // of everything below
    pthread_cond_t work_changed;
    struct bd_job_queue queue;
    struct bd_job *running;
    bool stopping, started;
    pthread_t thread;
};

struct bd_job_worker *bd_job_worker_create(uint32_t capacity, const struct bd_job_work *work)
{
    struct bd_job_worker *worker = calloc(1, sizeof *worker);
    BD_ASSERT(worker);
    worker->work = *work;
    bd_job_queue_init(&worker->queue, capacity);
    BD_ASSERT(pthread_mutex_init(&worker->lock, NULL) == 0);
    BD_ASSERT(pthread_cond_init(&worker->work_changed, NULL) == 0);
    return worker;
}

static struct bd_job *wait_for_job(struct bd_job_worker *worker)
{
    pthread_mutex_lock(&worker->lock);
    while (!worker->stopping && worker->queue.count == 0)
        pthread_cond_wait(&worker->work_changed, &worker->lock);
    struct bd_job *job = worker->stopping ? NULL : bd_job_queue_pop(&worker->queue);
    worker->running = job;
    pthread_mutex_unlock(&worker->lock);
    return job;
}

// What judges a frame that is shown already: the render thread, and on a software device its
// helpers, come first. On Linux this is the thread's own, and of those that it makes.
static void step_back(void)
{
    (void)setpriority(PRIO_PROCESS, 0, getpriority(PRIO_PROCESS, 0) + STEPS_BACK);
}

static void *run(void *user)
{
    struct bd_job_worker *worker = user;
    if (worker->work.steps_back) step_back();
    struct bd_job *job;
    while ((job = wait_for_job(worker)) != NULL) {
        worker->work.run(worker->work.user, job);
        pthread_mutex_lock(&worker->lock);
        worker->running = NULL;
        pthread_mutex_unlock(&worker->lock);
        worker->work.ran(worker->work.user, job);
    }
    return NULL;
}

static bool push(struct bd_job_queue *queue, struct bd_job *job, bool was_let_in)
{
    if (!was_let_in) return bd_job_queue_push(queue, job);
    bd_job_queue_return(queue, job);
    return true;
}

bool bd_job_worker_push(struct bd_job_worker *worker, struct bd_job *job, bool was_let_in)
{
    pthread_mutex_lock(&worker->lock);
    bool queued = !worker->stopping && push(&worker->queue, job, was_let_in);
    if (queued && !worker->started) {
        BD_ASSERT(pthread_create(&worker->thread, NULL, run, worker) == 0);
        worker->started = true;
    }
    pthread_cond_signal(&worker->work_changed);
    pthread_mutex_unlock(&worker->lock);
    return queued;
}

void bd_job_worker_destroy(struct bd_job_worker **worker)
{
    struct bd_job_worker *w = *worker;
    *worker = NULL;
    if (!w) return;
    pthread_mutex_lock(&w->lock);
    w->stopping = true;
    if (w->running) bd_job_cancel(w->running);
    pthread_cond_broadcast(&w->work_changed);
    pthread_mutex_unlock(&w->lock);
    if (w->started) pthread_join(w->thread, NULL);
    bd_job_queue_fail_all(&w->queue);
    bd_job_queue_finish(&w->queue);
    pthread_mutex_destroy(&w->lock);
    pthread_cond_destroy(&w->work_changed);
    free(w);
}

void bd_job_worker_count(struct bd_job_worker *worker, uint32_t *waiting, uint32_t *running)
{
    pthread_mutex_lock(&worker->lock);
    *waiting = worker->queue.count;
    *running = worker->running != NULL;
    pthread_mutex_unlock(&worker->lock);
}
