#include "sched/queue.h"

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
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
    uint32_t at = 0;
    // Behind every job of the same priority: nearer to the front of the array.
    while (at < queue->count && queue->jobs[at]->request.priority < job->request.priority) at++;
    memmove(queue->jobs + at + 1, queue->jobs + at, (queue->count - at) * sizeof(struct bd_job *));
    queue->jobs[at] = job;
    queue->count++;
}

bool bd_job_queue_push(struct bd_job_queue *queue, struct bd_job *job)
{
    if (queue->count >= queue->capacity) return false;
    bd_job_queue_return(queue, job);
    return true;
}

struct bd_job *bd_job_queue_pop(struct bd_job_queue *queue)
{
    return queue->count > 0 ? queue->jobs[--queue->count] : NULL;
}

void bd_job_queue_fail_all(struct bd_job_queue *queue)
{
    struct bd_job *job;
    while ((job = bd_job_queue_pop(queue)) != NULL) {
        job->result.err = BD_ERR_CANCELLED;
        (void)bd_fault_set(&job->result.fault, BD_ERR_CANCELLED, "", "the daemon is stopping");
        bd_job_end(job);
    }
}
