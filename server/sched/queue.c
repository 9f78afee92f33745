#include "sched/queue.h"

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/hash.h"
#include "sched/job.h"

void bd_job_queue_init(struct bd_job_queue *queue, uint32_t capacity)
{
    *queue = (struct bd_job_queue){.capacity = capacity, .room = capacity};
    queue->jobs = calloc(capacity, sizeof(struct bd_job *));
    BD_ASSERT(queue->jobs);
}

void bd_job_queue_finish(struct bd_job_queue *queue)
{
    free(queue->jobs);
    queue->jobs = NULL;
}

void bd_job_queue_return(struct bd_job_queue *queue, struct bd_job *job)
{
    if (queue->count == queue->room) {
        queue->room = 2 * queue->room + 1;
        queue->jobs = realloc(queue->jobs, queue->room * sizeof(struct bd_job *));
        BD_ASSERT(queue->jobs);
    }
    queue->jobs[queue->count++] = job;
}

void bd_job_queue_put_back(struct bd_job_queue *queue, struct bd_job *job)
{
    bd_job_queue_return(queue, job);
    memmove(queue->jobs + 1, queue->jobs, (queue->count - 1) * sizeof(struct bd_job *));
    queue->jobs[0] = job;
}

bool bd_job_queue_push(struct bd_job_queue *queue, struct bd_job *job)
{
    if (queue->count >= queue->capacity) return false;
    bd_job_queue_return(queue, job);
    return true;
}

static uint64_t *served_at(struct bd_job_queue *queue, const struct bd_job *job)
{
    uint64_t turn = job->request.turn;
    return &queue->served[bd_hash64(&turn, sizeof turn, 0) % BD_JOB_QUEUE_TURNS];
}

static bool goes_before(struct bd_job_queue *queue, const struct bd_job *job,
                        const struct bd_job *other)
{
    int priority = job->request.priority, others = other->request.priority;
    if (priority != others) return priority > others;
    return *served_at(queue, job) < *served_at(queue, other);
}

static struct bd_job *take_out(struct bd_job_queue *queue, uint32_t at)
{
    struct bd_job *job = queue->jobs[at];
    queue->count--;
    memmove(queue->jobs + at, queue->jobs + at + 1, (queue->count - at) * sizeof(struct bd_job *));
    return job;
}

static struct bd_job *serve(struct bd_job_queue *queue, uint32_t at)
{
    struct bd_job *job = take_out(queue, at);
    *served_at(queue, job) = ++queue->clock;
    return job;
}

struct bd_job *bd_job_queue_take_cancelled(struct bd_job_queue *queue)
{
    for (uint32_t i = 0; i < queue->count; i++)
        if (atomic_load(&queue->jobs[i]->cancelled)) return take_out(queue, i);
    return NULL;
}

struct bd_job *bd_job_queue_pop(struct bd_job_queue *queue)
{
    if (queue->count == 0) return NULL;
    uint32_t best = 0;
    for (uint32_t i = 1; i < queue->count; i++)
        if (goes_before(queue, queue->jobs[i], queue->jobs[best])) best = i;
    return serve(queue, best);
}

static bool comes_between(const struct bd_job *job, const struct bd_job *running, bool equals)
{
    if (job->request.priority != running->request.priority)
        return job->request.priority > running->request.priority;
    return equals && job->request.turn != running->request.turn;
}

struct bd_job *bd_job_queue_pop_between(struct bd_job_queue *queue, const struct bd_job *running,
                                        bool equals)
{
    uint32_t best = queue->count;
    for (uint32_t i = 0; i < queue->count; i++) {
        if (!comes_between(queue->jobs[i], running, equals)) continue;
        if (best == queue->count || goes_before(queue, queue->jobs[i], queue->jobs[best])) best = i;
    }
    return best < queue->count ? serve(queue, best) : NULL;
}

bool bd_job_queue_has_below(const struct bd_job_queue *queue, int priority)
{
    for (uint32_t i = 0; i < queue->count; i++)
        if (queue->jobs[i]->request.priority < priority) return true;
    return false;
}

bool bd_job_queue_has_above(const struct bd_job_queue *queue, int priority)
{
    for (uint32_t i = 0; i < queue->count; i++)
        if (queue->jobs[i]->request.priority > priority) return true;
    return false;
}

struct bd_job *bd_job_queue_pop_lower(struct bd_job_queue *queue)
{
    for (uint32_t i = 0; i < queue->count; i++)
        if (bd_job_queue_has_above(queue, queue->jobs[i]->request.priority)) return serve(queue, i);
    return NULL;
}

void bd_job_queue_fail_all(struct bd_job_queue *queue)
{
    struct bd_job *job;
    while ((job = bd_job_queue_pop(queue)) != NULL) {
        job->result.err = BD_ERR_CANCELLED;
        (void)bd_err_set(&job->result.detail, BD_ERR_CANCELLED, "", "the daemon is stopping");
        bd_job_end(job);
    }
}
