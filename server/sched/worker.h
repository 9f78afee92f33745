// One thread that takes jobs from a queue of its own. It starts with the first job.
//
// Private to sched/. Thread: any.

#ifndef BD_SCHED_WORKER_H
#define BD_SCHED_WORKER_H

#include <stdbool.h>
#include <stdint.h>

#include "sched/job.h"

struct bd_job_worker;

struct bd_job_work {
    void (*run)(void *user, struct bd_job *job); // may take long; a job that runs can be cancelled
    void (*ran)(void *user, struct bd_job *job); // passes the job on, or ends it
    void *user;
    bool steps_back; // its thread, and those that it makes, leave the processor to others
};

struct bd_job_worker *bd_job_worker_create(uint32_t capacity, const struct bd_job_work *work);
// Cancels what runs, fails what waits, joins the thread. Takes NULL.
void bd_job_worker_destroy(struct bd_job_worker **worker);

// False if the queue is full, or the worker is being destroyed. `was_let_in`: it was in the queue
// before, whose bound is for new ones.
bool bd_job_worker_push(struct bd_job_worker *worker, struct bd_job *job, bool was_let_in);
void bd_job_worker_count(struct bd_job_worker *worker, uint32_t *waiting, uint32_t *running);

#endif
