// The queue of waiting jobs: bounded, higher priority first; among equals the owner (`turn`) that was
// served longest ago, and of one owner's the one that came first. So whoever asks for a hundred
// frames does not keep the next one waiting for a hundred.
//
// Not locked: the scheduler holds its lock around every call.

#ifndef BD_SCHED_QUEUE_H
#define BD_SCHED_QUEUE_H

#include <stdbool.h>
#include <stdint.h>

struct bd_job;

#define BD_JOB_QUEUE_TURNS 256

struct bd_job_queue {
    struct bd_job **jobs; // in order of arrival
    uint32_t count, capacity, room; // jobs waiting, their bound, and what `jobs` has room for
    // When each owner was last served, by a hash of its number: two that fall together share a turn.
    uint64_t served[BD_JOB_QUEUE_TURNS];
    uint64_t clock;
};

void bd_job_queue_init(struct bd_job_queue *queue, uint32_t capacity);
void bd_job_queue_finish(struct bd_job_queue *queue);

// False if the queue is full.
bool bd_job_queue_push(struct bd_job_queue *queue, struct bd_job *job);
// Takes back a job that was popped, whatever the bound: as if it had just come.
void bd_job_queue_return(struct bd_job_queue *queue, struct bd_job *job);
// The same for one that gave way to others: before its equals.
void bd_job_queue_put_back(struct bd_job_queue *queue, struct bd_job *job);
// NULL if the queue is empty.
struct bd_job *bd_job_queue_pop(struct bd_job_queue *queue);
// The same of those that come between the slices of `running`: of higher priority, or, if `equals`
// may, of its own and of another owner. NULL if there is none.
struct bd_job *bd_job_queue_pop_between(struct bd_job_queue *queue, const struct bd_job *running,
                                        bool equals);
// The job that has waited longest among those below the highest priority in the queue; NULL if all
// are of one.
struct bd_job *bd_job_queue_pop_lower(struct bd_job_queue *queue);
// A job that was cancelled while it waited; NULL if there is none.
struct bd_job *bd_job_queue_take_cancelled(struct bd_job_queue *queue);
// Whether a job of lower, or of higher priority than this waits.
bool bd_job_queue_has_below(const struct bd_job_queue *queue, int priority);
bool bd_job_queue_has_above(const struct bd_job_queue *queue, int priority);
// Ends every job in it: the daemon is stopping.
void bd_job_queue_fail_all(struct bd_job_queue *queue);

#endif
