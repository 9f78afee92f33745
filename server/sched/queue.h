// The queue of waiting jobs: bounded, higher priority first, then in order of submission.
// Not locked: the scheduler holds its lock around every call.

#ifndef BD_SCHED_QUEUE_H
#define BD_SCHED_QUEUE_H

#include <stdbool.h>
#include <stdint.h>

struct bd_job;

struct bd_job_queue {
    struct bd_job **jobs; // sorted: the next one last
    uint32_t count, capacity, room; // jobs waiting, their bound, and what `jobs` has room for
};

void bd_job_queue_init(struct bd_job_queue *queue, uint32_t capacity);
void bd_job_queue_finish(struct bd_job_queue *queue);

// False if the queue is full.
bool bd_job_queue_push(struct bd_job_queue *queue, struct bd_job *job);
// Takes back a job that was popped, whatever the bound: behind its priority.
void bd_job_queue_return(struct bd_job_queue *queue, struct bd_job *job);
// NULL if the queue is empty.
struct bd_job *bd_job_queue_pop(struct bd_job_queue *queue);
// Ends every job in it: the daemon is stopping.
void bd_job_queue_fail_all(struct bd_job_queue *queue);

#endif
